//! Subtrees as planners leave them: which triangles share a leaf, which children share a node. The geometry is then
//! fitted from the leaves up, and written once, to where rays will read it.

use glam::Vec3A;

use super::{
    ahead,
    record::halves,
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
    /// Where rays begin: one of them, or several that stand side by side in a node above.
    pub roots: Vec<Root>,
    /// How many triangles are in its leaves.
    pub triangles: usize,
}

/// Where rays begin.
#[derive(Debug, Clone, Copy)]
pub struct Root {
    /// A node or a leaf.
    pub node: NodeRef,
    /// Most entries a traversal can put on its stack.
    pub stack_size: usize,
}

impl Root {
    /// Where there are no triangles.
    pub const EMPTY: Self = Self { node: NodeRef::EMPTY, stack_size: 0 };
}

impl Draft {
    /// Nothing.
    pub const EMPTY: Self = Self { nodes: Vec::new(), leaves: Vec::new(), roots: Vec::new(), triangles: 0 };

    /// Nothing, with room for the nodes and leaves that so many triangles usually need: to grow, all would be copied.
    pub fn for_triangles(count: usize) -> Self {
        Self { nodes: Vec::with_capacity(count / 16), leaves: Vec::with_capacity(count / 4), ..Self::EMPTY }
    }

    /// Forget everything but the room.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.leaves.clear();
        self.roots.clear();
        self.triangles = 0;
    }

    /// Add a leaf of one to eight triangles.
    #[inline(always)]
    pub fn push_leaf(&mut self, triangles: impl Iterator<Item = u32>) -> NodeRef {
        let (leaf, mut count) = (self.leaf(), 0);
        for triangle in triangles {
            leaf[count] = triangle;
            count += 1;
        }
        self.filled(count)
    }

    /// A new leaf without triangles, to be filled where it is: one that was filled elsewhere number by number would be
    /// copied by vectors, which wait for all numbers.
    #[inline(always)]
    pub fn leaf(&mut self) -> &mut [u32; LANES] {
        self.leaves.push([MISS; LANES]);
        self.leaves.last_mut().expect("there is the one just added")
    }

    /// The new leaf with so many triangles.
    #[inline(always)]
    pub fn filled(&mut self, count: usize) -> NodeRef {
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
    pub fn of(&self, child: NodeRef) -> BoundsA {
        match child.target() {
            Target::Branch(node) => self.nodes[node as usize],
            Target::Leaf { block, .. } => self.leaves[block as usize],
            _ => BoundsA::EMPTY,
        }
    }
}

/// Write a draft: blocks of triangles, then nodes around them from the last to the first. The boxes of all remain in
/// `boxes`, in the mesh's own coordinates.
pub fn fit(draft: &Draft, mesh: &Mesh, centre: Vec3A, site: &mut Site<'_>, boxes: &mut Boxes, level: Level) {
    fill_all(&draft.leaves, mesh, site.blocks, boxes, level);
    level.run(Nodes { draft, centre, site, boxes });
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
        // Where no triangle is, the last one is asked for: nobody can guess how many are in a leaf.
        let last = mesh.triangles().len().max(1) as u32 - 1;
        boxes.clear();
        for (index, (leaf, block)) in leaves.iter().zip(blocks).enumerate() {
            for lane in 0..LANES {
                ahead::ask(simd, reader, index * LANES + lane, |place| all.get(place).map(|&t| t.min(last)));
            }
            boxes.push(fill(simd, leaf, reader, block));
        }
    }
}

/// Put triangles into a block; returns the box around them.
#[inline(always)]
fn fill<S: Simd>(simd: S, leaf: &[u32; LANES], reader: Reader<'_>, block: &mut Block) -> BoundsA {
    // Of each triangle two corners, and the third one twice; and what is least and greatest of each.
    let mut rows = [[simd.splat(0.0); LANES]; 2];
    let (mut lower, mut upper) = ([simd.splat(f32::INFINITY); 2], [simd.splat(f32::NEG_INFINITY); 2]);
    for (lane, &triangle) in leaf.iter().enumerate() {
        if triangle == MISS {
            break;
        }
        let [a, b, c] = reader.rows(triangle);
        let row = [simd.join(a, b), simd.join(c, c)];
        for k in 0..2 {
            rows[k][lane] = row[k];
            (lower[k], upper[k]) = (simd.min(row[k], lower[k]), simd.max(row[k], upper[k]));
        }
    }
    let [ax, ay, az, _, bx, by, bz, _] = simd.transpose(rows[0]);
    let [cx, cy, cz, ..] = simd.transpose(rows[1]);
    let corners = [[ax, ay, az], [bx, by, bz], [cx, cy, cz]];
    for c in 0..3 {
        for k in 0..3 {
            block.corner[c][k] = simd.store(corners[c][k]);
        }
    }
    block.primitive = *leaf;
    let [lower, upper] = [simd.store(simd.min(lower[0], lower[1])), simd.store(simd.max(upper[0], upper[1]))];
    let ([a, b], [c, d]) = (halves(&lower), halves(&upper));
    BoundsA { lower: Vec3A::from_vec4(a.min(b)), upper: Vec3A::from_vec4(c.max(d)) }
}
