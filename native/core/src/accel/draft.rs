//! Subtrees as planners leave them: which triangles share a leaf, which children share a node. The geometry is then
//! fitted from the leaves up, and written once, to where rays will read it.

use glam::Vec3A;

use super::structure::{Node, NodeRef, Target};
use crate::{
    Mesh,
    bounds::BoundsA,
    ray::MISS,
    triangle::{Block, LANES},
};

/// Nodes and leaves numbered from zero, every node before its children.
#[derive(Debug, Clone)]
pub struct Draft {
    /// The children of every node.
    pub nodes: Vec<[NodeRef; LANES]>,
    /// The triangles of every leaf, [`MISS`] behind the last.
    pub leaves: Vec<[u32; LANES]>,
    /// Where rays begin.
    pub root: NodeRef,
    /// Most entries a traversal can put on its stack.
    pub stack_size: usize,
    /// How many triangles are in its leaves.
    pub triangles: usize,
}

impl Draft {
    /// Nothing.
    pub const EMPTY: Self =
        Self { nodes: Vec::new(), leaves: Vec::new(), root: NodeRef::EMPTY, stack_size: 0, triangles: 0 };

    /// Forget everything but the room.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.leaves.clear();
        (self.root, self.stack_size, self.triangles) = (NodeRef::EMPTY, 0, 0);
    }

    /// Add a leaf of one to eight triangles.
    #[inline(always)]
    pub fn push_leaf(&mut self, triangles: impl Iterator<Item = u32>) -> NodeRef {
        let (mut leaf, mut count) = ([MISS; LANES], 0);
        for triangle in triangles {
            leaf[count] = triangle;
            count += 1;
        }
        self.leaves.push(leaf);
        self.triangles += count;
        NodeRef::leaf(self.leaves.len() - 1, count)
    }
}

impl Default for Draft {
    fn default() -> Self {
        Self::EMPTY
    }
}

/// Where a draft is written to.
#[derive(Debug)]
pub struct Site<'a> {
    /// As many nodes as the draft has.
    pub nodes: &'a mut [Node],
    /// As many blocks as the draft has leaves, all of their bytes zero.
    pub blocks: &'a mut [Block],
    /// The number of the first node.
    pub first_node: usize,
    /// The number of the first block.
    pub first_block: usize,
}

/// Room for the boxes of a draft's nodes and leaves, reused from draft to draft.
#[derive(Debug, Default, Clone)]
pub struct Boxes {
    nodes: Vec<BoundsA>,
    leaves: Vec<BoundsA>,
}

impl Boxes {
    /// The box of a root that has just been fitted.
    fn of(&self, child: NodeRef) -> BoundsA {
        match child.target() {
            Target::Branch(node) => self.nodes[node as usize],
            Target::Leaf { block, .. } => self.leaves[block as usize],
            _ => BoundsA::EMPTY,
        }
    }
}

/// Write a draft: blocks of triangles, then nodes around them from the last to the first. Returns the box of the root,
/// in the mesh's own coordinates.
pub fn fit(draft: &Draft, mesh: &Mesh, centre: Vec3A, site: &mut Site<'_>, boxes: &mut Boxes) -> BoundsA {
    boxes.leaves.clear();
    boxes.leaves.extend(draft.leaves.iter().zip(&mut *site.blocks).map(|(leaf, block)| fill(leaf, mesh, block)));
    boxes.nodes.clear();
    boxes.nodes.resize(draft.nodes.len(), BoundsA::EMPTY);
    for (index, children) in draft.nodes.iter().enumerate().rev() {
        let bounds = children.map(|child| boxes.of(child));
        let child = children.map(|child| child.moved(site.first_node, site.first_block));
        site.nodes[index] = Node::new(child, &bounds, centre);
        boxes.nodes[index] = bounds.iter().fold(BoundsA::EMPTY, |all, bounds| all.union(bounds));
    }
    boxes.of(draft.root)
}

/// Put triangles into a block of zeros; returns the box around them.
#[inline(always)]
fn fill(leaf: &[u32; LANES], mesh: &Mesh, block: &mut Block) -> BoundsA {
    let mut bounds = BoundsA::EMPTY;
    for (lane, &triangle) in leaf.iter().enumerate().take_while(|(_, triangle)| **triangle != MISS) {
        let corners = mesh.corners(triangle);
        bounds = bounds.union(&BoundsA::of_corners(corners));
        block.set(lane, triangle, corners);
    }
    block.primitive = *leaf;
    bounds
}
