//! The binary tree that policies decide on, before it is packed. Splitters say where a node divides; this module only
//! recurses, in parallel, and the result does not depend on the number of threads.

use rayon::prelude::*;

use super::{
    collapse::{Binary, Weighed},
    grid::BuiltGrid,
    structure::Grid,
};
use crate::{
    Error, Job, Mesh,
    bounds::{Bounds, BoundsA},
    error,
};

/// A triangle on its way into the tree.
#[derive(Debug, Clone, Copy)]
pub struct Item {
    /// Box of the triangle.
    pub bounds: Bounds,
    /// Which triangle.
    pub primitive: u32,
}

impl Item {
    const NONE: Self = Self { bounds: Bounds::EMPTY, primitive: 0 };
}

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The left child is the next node, the right one stands `right` nodes on.
    Branch {
        /// Distance to the right child.
        right: u32,
    },
    /// Its items are tested one and all.
    Leaf,
    /// Its items are in [`Tree::grids`] at this index; nodes below it, if any, are passed over.
    Grid(u32),
    /// Its items are below the cells of [`Tree::nests`] at this index.
    Nest(u32),
}

/// A node over the items `first..first + count`.
#[derive(Debug, Clone, Copy)]
pub struct TreeNode {
    /// Tight box of its items.
    pub bounds: Bounds,
    /// Its first item.
    pub first: u32,
    /// How many items it has.
    pub count: u32,
    /// What it is.
    pub kind: Kind,
}

/// Nodes in preorder over ordered items.
#[derive(Debug, Default)]
pub struct Tree {
    /// The root is the first; none where the mesh has no triangles to hit.
    pub nodes: Vec<TreeNode>,
    /// Ordered so that every node's items stand together.
    pub items: Vec<Item>,
    /// Grids that stand in for nodes.
    pub grids: Vec<BuiltGrid>,
    /// Grids that stand in for nodes and have nodes in their cells: such nodes, and all below them, are behind those
    /// that are reached without nests.
    pub nests: Vec<BuiltNest>,
}

/// A grid whose cells are nodes.
#[derive(Debug, Clone)]
pub struct BuiltNest {
    /// Its shape; `first` is 0.
    pub grid: Grid,
    /// Every cell that holds anything, and the node it holds.
    pub cells: Vec<[u32; 2]>,
}

impl Tree {
    /// The items of a node.
    pub fn items_of(&self, node: &TreeNode) -> &[Item] {
        &self.items[node.first as usize..(node.first + node.count) as usize]
    }

    /// The children of node `index`, if it is a branch.
    pub fn children(&self, index: usize) -> Option<[usize; 2]> {
        match self.nodes[index].kind {
            Kind::Branch { right } => Some([index + 1, index + right as usize]),
            Kind::Leaf | Kind::Grid(_) | Kind::Nest(_) => None,
        }
    }
}

impl Binary for Tree {
    fn children(&self, node: usize) -> Option<[usize; 2]> {
        self.children(node)
    }
}

impl Weighed for Tree {
    fn count(&self) -> usize {
        self.nodes.len()
    }

    fn half_area(&self, node: usize) -> f32 {
        self.nodes[node].bounds.half_area()
    }
}

/// Where a node divides.
pub trait Split: Sync {
    /// Reorder `items` (at least two) and return how many go left: at least one, and not all. Must depend on nothing
    /// but its arguments.
    fn split(&self, items: &mut [Item], depth: usize) -> usize;
}

/// The items of a mesh, in order.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn items(mesh: &Mesh) -> Result<Vec<Item>, Error> {
    let mut items = error::filled(mesh.solid_count(), Item::NONE, "the list of triangle boxes")?;
    items.par_chunks_mut(SEQUENTIAL).enumerate().for_each(|(part, items)| {
        let reader = mesh.reader();
        for (item, primitive) in items.iter_mut().zip(mesh.solid(part * SEQUENTIAL)) {
            *item = Item { bounds: BoundsA::of_aligned_corners(reader.corners(primitive)).into(), primitive };
        }
    });
    Ok(items)
}

/// The box around some items.
pub fn bounds_of(items: &[Item]) -> Bounds {
    let around = |part: &[Item]| part.iter().fold(Bounds::EMPTY, |bounds, item| bounds.union(&item.bounds));
    if items.len() <= SEQUENTIAL {
        return around(items);
    }
    items.par_chunks(SEQUENTIAL).map(around).reduce(|| Bounds::EMPTY, |a, b| a.union(&b))
}

/// Subtrees of at most this many items are built by one thread without a look at the job: below a millisecond or two.
const SEQUENTIAL: usize = 1 << 13;

/// Divide items until at most `leaf_size` are together.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn build(items: Vec<Item>, leaf_size: usize, split: &impl Split, job: &Job) -> Result<Tree, Error> {
    build_counted(items, leaf_size, split, job, 1)
}

/// The same, where every item counts `units` in the job's progress.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn build_counted(
    mut items: Vec<Item>,
    leaf_size: usize,
    split: &impl Split,
    job: &Job,
    units: u64,
) -> Result<Tree, Error> {
    if items.is_empty() {
        return Ok(Tree::default());
    }
    let nodes = Builder { leaf_size, split, job, units }.parallel(&mut items, 0, 0)?;
    Ok(Tree { nodes, items, ..Tree::default() })
}

struct Builder<'a, S> {
    leaf_size: usize,
    split: &'a S,
    job: &'a Job,
    units: u64,
}

impl<S: Split> Builder<'_, S> {
    fn parallel(&self, items: &mut [Item], first: usize, depth: usize) -> Result<Vec<TreeNode>, Error> {
        self.job.check()?;
        let mut nodes = Vec::new();
        if items.len() <= SEQUENTIAL {
            nodes.reserve(2 * items.len() / self.leaf_size + 1);
            self.sequential(items, first, depth, &mut nodes);
            self.job.advance(self.units * items.len() as u64);
            return Ok(nodes);
        }
        let bounds = bounds_of(items);
        let middle = self.split.split(items, depth);
        let count = items.len();
        let (left, right) = items.split_at_mut(middle);
        let (left, right) =
            rayon::join(|| self.parallel(left, first, depth + 1), || self.parallel(right, first + middle, depth + 1));
        let (left, right) = (left?, right?);
        nodes.reserve_exact(1 + left.len() + right.len());
        nodes.push(node(bounds, first, count, Kind::Branch { right: left.len() as u32 + 1 }));
        nodes.extend(left);
        nodes.extend(right);
        Ok(nodes)
    }

    fn sequential(&self, items: &mut [Item], first: usize, depth: usize, nodes: &mut Vec<TreeNode>) {
        let index = nodes.len();
        nodes.push(node(bounds_of(items), first, items.len(), Kind::Leaf));
        if items.len() <= self.leaf_size {
            return;
        }
        let middle = self.split.split(items, depth);
        let (left, right) = items.split_at_mut(middle);
        self.sequential(left, first, depth + 1, nodes);
        nodes[index].kind = Kind::Branch { right: (nodes.len() - index) as u32 };
        self.sequential(right, first + middle, depth + 1, nodes);
    }
}

fn node(bounds: Bounds, first: usize, count: usize, kind: Kind) -> TreeNode {
    TreeNode { bounds, first: first as u32, count: count as u32, kind }
}
