//! Which binary nodes become wide ones so that the areas of all wide nodes together are least: by dynamic programming
//! from the leaves up, after Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed
//! Wide BVHs", HPG 2017.
//!
//! Opening the largest child first, which needs no table, makes 6 to 11% more steps a ray in `sbvh` on Sponza, Sibenik
//! and hair, primary and diffuse rays together. In `bvh-sah` it makes up to 9% more, and 11% more bytes (bunny): a wide
//! node has 3.7 children then, not 6.

use super::tree::Tree;
use crate::{Error, error, triangle::LANES};

/// How a subtree is best shown as at most so many places side by side.
#[derive(Debug, Clone, Copy)]
struct Ways {
    /// The least sum of areas of wide nodes, by the number of places less one.
    cost: [f32; LANES],
    /// How many of the places go to the left child; 0 where the subtree is one place.
    left: [u8; LANES],
}

/// The best ways for every node of a tree.
#[derive(Debug)]
pub struct Collapse<'a> {
    tree: &'a Tree,
    ways: Vec<Ways>,
}

impl<'a> Collapse<'a> {
    /// Of a tree; leaves and grids stay what they are.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(tree: &'a Tree) -> Result<Self, Error> {
        let nothing = Ways { cost: [0.0; LANES], left: [0; LANES] };
        let mut ways = error::filled(tree.nodes.len(), nothing, "the table of wide nodes")?;
        let scale = tree.nodes.first().map_or(1.0, |root| root.bounds.half_area().max(f32::MIN_POSITIVE).recip());
        for index in (0..tree.nodes.len()).rev() {
            if let Some([left, right]) = tree.children(index) {
                let area = tree.nodes[index].bounds.half_area() * scale;
                ways[index] = Ways::of_branch(area, &ways[left], &ways[right]);
            }
        }
        Ok(Self { tree, ways })
    }

    /// The places side by side in the wide node that a branch becomes: two to eight.
    pub fn children(&self, branch: usize) -> Vec<usize> {
        let mut children = Vec::with_capacity(LANES);
        self.divide(branch, LANES, self.ways[branch].left[LANES - 1], &mut children);
        children
    }

    fn places(&self, node: usize, count: usize, children: &mut Vec<usize>) {
        // The last entry is for the wide node itself.
        match self.ways[node].left[count - 1] {
            0 => children.push(node),
            left => self.divide(node, count, left, children),
        }
    }

    fn divide(&self, node: usize, count: usize, left: u8, children: &mut Vec<usize>) {
        if let Some([first, second]) = self.tree.children(node) {
            self.places(first, usize::from(left), children);
            self.places(second, count - usize::from(left), children);
        }
    }
}

impl Ways {
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
