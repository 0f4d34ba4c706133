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
    /// The children of a node that may be opened.
    fn children(&self, node: usize) -> Option<[usize; 2]>;
}

/// One whose nodes have boxes.
pub trait Weighed: Binary {
    /// How many nodes there are.
    fn count(&self) -> usize;
    /// Half of the area of the box of a node.
    fn half_area(&self, node: usize) -> f32;
    /// What a node without children costs, itself the root of a tree, as [`Costs::of_root`] tells: nothing, where it is a
    /// leaf.
    fn costs(&self, _node: usize) -> [f32; LANES] {
        [0.0; LANES]
    }
}

/// By the number of places less one that a subtree is shown as, the least sum of areas of its wide nodes; room that can be
/// used for another tree.
#[derive(Debug, Default)]
pub struct Costs(Vec<[f32; LANES]>);

impl Costs {
    /// Those of the whole tree.
    pub fn of_root(&self) -> [f32; LANES] {
        self.0[0]
    }
}

/// The best ways to show every node of a tree.
#[derive(Debug)]
pub struct Collapse(Vec<Ways>);

/// By the number of places that a subtree is shown as, how many of them go to the left child; none where it is one place.
/// One to eight numbers of three bits.
#[derive(Debug, Clone, Copy, Default)]
struct Ways(u32);

impl Ways {
    const BITS: usize = 3;

    fn of(lefts: [u8; LANES]) -> Self {
        Self(lefts.iter().rev().fold(0, |all, &left| all << Self::BITS | u32::from(left)))
    }

    fn left(self, places: usize) -> usize {
        self.0 as usize >> (Self::BITS * (places - 1)) & (LANES - 1)
    }
}

/// A node side by side with others, and how many places it has where it is [one without children](Weighed::costs).
pub type Place = (usize, usize);

impl Collapse {
    /// Find those of a tree, areas in units of `unit`; what has no children stays what it is.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn of(tree: &(impl Weighed + ?Sized), unit: f32, Costs(costs): &mut Costs) -> Result<Self, Error> {
        const WHAT: &str = "the table of wide nodes";
        let (count, scale) = (tree.count(), unit.max(f32::MIN_POSITIVE).recip());
        if costs.len() < count {
            *costs = error::filled(count, [0.0; LANES], WHAT)?;
        }
        let mut all = error::filled(count, Ways::default(), WHAT)?;
        for index in (0..count).rev() {
            match tree.children(index) {
                Some([one, other]) => {
                    let (sums, lefts) = ways(tree.half_area(index) * scale, &costs[one], &costs[other]);
                    (costs[index], all[index]) = (sums, Ways::of(lefts));
                }
                None => costs[index] = tree.costs(index),
            }
        }
        Ok(Self(all))
    }

    /// The places side by side in the wide node that a branch of that tree becomes, and how many nodes they are: up to
    /// eight.
    pub fn children(&self, tree: &impl Binary, branch: usize) -> ([Place; LANES], usize) {
        let mut children = ([(0, 0); LANES], 0);
        self.divide(tree, branch, LANES, self.0[branch].left(LANES), &mut children);
        children
    }

    /// The nodes that a tree is shown as in a number of places.
    pub fn shown(&self, tree: &impl Binary, count: usize) -> ([Place; LANES], usize) {
        let mut nodes = ([(0, 0); LANES], 0);
        self.places(tree, 0, count, &mut nodes);
        nodes
    }

    fn places(&self, tree: &impl Binary, node: usize, count: usize, to: &mut ([Place; LANES], usize)) {
        // The last entry is for the wide node itself.
        match self.0[node].left(count) {
            0 => {
                to.0[to.1] = (node, count);
                to.1 += 1;
            }
            left => self.divide(tree, node, count, left, to),
        }
    }

    fn divide(&self, tree: &impl Binary, node: usize, count: usize, left: usize, to: &mut ([Place; LANES], usize)) {
        if let Some([first, second]) = tree.children(node) {
            self.places(tree, first, left, to);
            self.places(tree, second, count - left, to);
        }
    }
}

/// The costs of a branch from those of its children, and how many places go to the left one. All numbers of places at once,
/// by vectors, the right child's costs shifted by k lanes, took 0.98 to 1.05 of the time of a whole build (Zen 5).
fn ways(area: f32, left: &[f32; LANES], right: &[f32; LANES]) -> ([f32; LANES], [u8; LANES]) {
    let (mut costs, mut lefts) = ([0.0; LANES], [0; LANES]);
    let divided = |count: usize| {
        let ways = (1..count).map(|k| (left[k - 1] + right[count - k - 1], k as u8));
        ways.fold((f32::INFINITY, 1), |best, way| if way.0 < best.0 { way } else { best })
    };
    let (below, widest) = divided(LANES);
    let single = area + below;
    costs[0] = single;
    for count in 2..LANES {
        let (cost, k) = divided(count);
        (costs[count - 1], lefts[count - 1]) = if cost < single { (cost, k) } else { (single, 0) };
    }
    (costs[LANES - 1], lefts[LANES - 1]) = (below, widest);
    (costs, lefts)
}
