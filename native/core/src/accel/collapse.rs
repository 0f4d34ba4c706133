//! Which binary nodes become wide ones so that the areas of all wide nodes together are least: by dynamic programming
//! from the leaves up, after Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed
//! Wide BVHs", HPG 2017.
//!
//! Opening the largest child first, which needs no table, makes 6 to 11% more steps a ray in `sbvh` on Sponza, Sibenik
//! and hair, primary and diffuse rays together. In `bvh-sah` it makes up to 9% more, and 11% more bytes (bunny): a wide
//! node has 3.7 children then, not 6. In `bvh-clusters` it makes 3 to 7% more, and 6 to 9% more bytes.

use crate::{Error, error, triangle::LANES};

/// A binary tree, every node before its children, the root first.
pub trait Binary {
    /// How many nodes there are.
    fn count(&self) -> usize;
    /// The children of a node that may be opened.
    fn children(&self, node: usize) -> Option<[usize; 2]>;
    /// Half of the area of the box of a node.
    fn half_area(&self, node: usize) -> f32;
}

/// How a subtree is best shown as at most so many places side by side.
#[derive(Debug, Clone, Copy)]
struct Ways {
    /// The least sum of areas of wide nodes, by the number of places less one.
    cost: [f32; LANES],
    /// How many of the places go to the left child; 0 where the subtree is one place.
    left: [u8; LANES],
}

/// The best ways for every node of a tree; room that can be used for another one.
#[derive(Debug, Default, Clone)]
pub struct Collapse {
    ways: Vec<Ways>,
}

impl Collapse {
    /// Find those of a tree; what has no children stays what it is.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn find(&mut self, tree: &impl Binary) -> Result<(), Error> {
        let nothing = Ways { cost: [0.0; LANES], left: [0; LANES] };
        let count = tree.count();
        if self.ways.len() < count {
            self.ways = error::filled(count, nothing, "the table of wide nodes")?;
        }
        let scale = if count == 0 { 1.0 } else { tree.half_area(0).max(f32::MIN_POSITIVE).recip() };
        for index in (0..count).rev() {
            self.ways[index] = match tree.children(index) {
                Some([left, right]) => {
                    Ways::of_branch(tree.half_area(index) * scale, &self.ways[left], &self.ways[right])
                }
                None => nothing,
            };
        }
        Ok(())
    }

    /// The places side by side in the wide node that a branch of that tree becomes, and their number: two to eight.
    pub fn children(&self, tree: &impl Binary, branch: usize) -> ([usize; LANES], usize) {
        let mut children = ([0; LANES], 0);
        self.divide(tree, branch, LANES, self.ways[branch].left[LANES - 1], &mut children);
        children
    }

    fn places(&self, tree: &impl Binary, node: usize, count: usize, children: &mut ([usize; LANES], usize)) {
        // The last entry is for the wide node itself.
        match self.ways[node].left[count - 1] {
            0 => {
                children.0[children.1] = node;
                children.1 += 1;
            }
            left => self.divide(tree, node, count, left, children),
        }
    }

    fn divide(&self, tree: &impl Binary, node: usize, count: usize, left: u8, to: &mut ([usize; LANES], usize)) {
        if let Some([first, second]) = tree.children(node) {
            self.places(tree, first, usize::from(left), to);
            self.places(tree, second, count - usize::from(left), to);
        }
    }
}

impl Ways {
    /// All numbers of places at once, by vectors, the right child's costs shifted by k lanes, took 0.98 to 1.05 of the time
    /// of a whole build (Zen 5).
    fn of_branch(area: f32, left: &Self, right: &Self) -> Self {
        let mut ways = Self { cost: [0.0; LANES], left: [0; LANES] };
        let divided = |count: usize| {
            let ways = (1..count).map(|k| (left.cost[k - 1] + right.cost[count - k - 1], k as u8));
            ways.fold((f32::INFINITY, 1), |best, way| if way.0 < best.0 { way } else { best })
        };
        let (below, widest) = divided(LANES);
        let single = area + below;
        (ways.cost[0], ways.left[0]) = (single, 0);
        for count in 2..LANES {
            let (cost, k) = divided(count);
            (ways.cost[count - 1], ways.left[count - 1]) = if cost < single { (cost, k) } else { (single, 0) };
        }
        (ways.cost[LANES - 1], ways.left[LANES - 1]) = (below, widest);
        ways
    }
}
