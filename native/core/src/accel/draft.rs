//! Subtrees as planners leave them: which triangles share a leaf, which children share a node. The geometry is then
//! fitted from the leaves up, and written once, to where rays will read it.

use glam::{Mat4, Vec3A, Vec4};

use super::{
    ahead,
    structure::{Node, NodeRef, Target},
};
use crate::{
    Mesh,
    bounds::BoundsA,
    mesh::Reader,
    ray::MISS,
    simd::{Kernel, Level, Simd},
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

    /// Nothing, with room for the nodes and leaves that so many triangles usually need: to grow, all would be copied.
    pub fn for_triangles(count: usize) -> Self {
        Self { nodes: Vec::with_capacity(count / 16), leaves: Vec::with_capacity(count / 4), ..Self::EMPTY }
    }

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
    /// As many blocks as the draft has leaves.
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
    /// The box of what has just been fitted.
    #[inline(always)]
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
pub fn fit(draft: &Draft, mesh: &Mesh, centre: Vec3A, site: &mut Site<'_>, boxes: &mut Boxes, level: Level) -> BoundsA {
    fill_all(&draft.leaves, mesh, site.blocks, boxes, level);
    level.run(Nodes { draft, centre, site, boxes });
    boxes.of(draft.root)
}

/// Writes nodes and finds the boxes around them, those of the leaves given.
struct Nodes<'a, 's> {
    draft: &'a Draft,
    centre: Vec3A,
    site: &'a mut Site<'s>,
    boxes: &'a mut Boxes,
}

impl Kernel for Nodes<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { draft, centre, site, boxes } = self;
        boxes.nodes.clear();
        boxes.nodes.resize(draft.nodes.len(), BoundsA::EMPTY);
        for (index, children) in draft.nodes.iter().enumerate().rev() {
            let (mut all, mut bounds) = (BoundsA::EMPTY, [BoundsA::EMPTY; LANES]);
            let mut child = [NodeRef::EMPTY; LANES];
            for lane in 0..LANES {
                bounds[lane] = boxes.of(children[lane]);
                all = all.union(&bounds[lane]);
                child[lane] = children[lane].moved(site.first_node, site.first_block);
            }
            site.nodes[index] = Node::new(child, &bounds, centre);
            boxes.nodes[index] = all;
        }
    }
}

/// Write the blocks of leaves whose triangles are followed by [`MISS`]; the boxes around them remain in `boxes`.
pub fn fill_all(leaves: &[[u32; LANES]], mesh: &Mesh, blocks: &mut [Block], boxes: &mut Boxes, level: Level) {
    level.run(Leaves { leaves, mesh, blocks, boxes: &mut boxes.leaves });
}

/// Writes blocks and finds the boxes around them.
struct Leaves<'a> {
    leaves: &'a [[u32; LANES]],
    mesh: &'a Mesh,
    blocks: &'a mut [Block],
    boxes: &'a mut Vec<BoundsA>,
}

impl Kernel for Leaves<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { leaves, mesh, blocks, boxes } = self;
        let (all, reader) = (leaves.as_flattened(), mesh.reader());
        boxes.clear();
        for (index, (leaf, block)) in leaves.iter().zip(blocks).enumerate() {
            for lane in 0..LANES {
                ahead::ask(simd, reader, index * LANES + lane, |place| all.get(place).copied());
            }
            boxes.push(fill(leaf, reader, block));
        }
    }
}

/// Put triangles into a block; returns the box around them.
#[inline(always)]
fn fill(leaf: &[u32; LANES], reader: Reader<'_>, block: &mut Block) -> BoundsA {
    let mut bounds = BoundsA::EMPTY;
    let mut corners = [[Vec4::ZERO; LANES]; 3];
    for (lane, &triangle) in leaf.iter().enumerate().take_while(|(_, triangle)| **triangle != MISS) {
        let triangle = reader.corners(triangle);
        bounds = bounds.union(&BoundsA::of_aligned_corners(triangle));
        for c in 0..3 {
            corners[c][lane] = triangle[c].extend(0.0);
        }
    }
    for (corner, [a, b, c, d, e, f, g, h]) in block.corner.iter_mut().zip(corners) {
        let halves = [Mat4::from_cols(a, b, c, d), Mat4::from_cols(e, f, g, h)].map(|half| half.transpose());
        for k in 0..3 {
            corner[k][..4].copy_from_slice(&halves[0].col(k).to_array());
            corner[k][4..].copy_from_slice(&halves[1].col(k).to_array());
        }
    }
    block.primitive = *leaf;
    bounds
}
