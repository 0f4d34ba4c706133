//! Which nodes of the binary tree stand side by side in wide ones, and which triangles share a leaf: all that is decided
//! before a structure is written. Large subtrees are laid out in parallel; the order does not depend on the number of
//! threads.

use rayon::prelude::*;

use super::{
    collapse::{Collapse, Costs},
    structure::{NEST_STACK, NodeRef},
    tree::{BuiltNest, Kind, Tree},
};
use crate::{Error, Job, error, ray::MISS, triangle::LANES};

/// Which descendants of a branch stand side by side in its wide node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Opening {
    /// Whichever is largest is opened first: fast.
    Largest,
    /// Those with which all wide nodes together have the least area.
    Cheapest,
}

/// A wide node before it is written.
#[derive(Debug, Clone, Copy)]
pub struct Wide {
    /// Its children; the used ones come first.
    pub child: [NodeRef; LANES],
    /// Which nodes of the tree they are.
    pub of: [u32; LANES],
}

/// A subtree, its nodes and leaves numbered from zero, every node before its children.
#[derive(Debug)]
pub struct Layout {
    /// Where rays begin.
    pub root: NodeRef,
    /// Most entries a traversal can put on its stack.
    pub stack_size: usize,
    /// The wide nodes.
    pub nodes: Vec<Wide>,
    /// The triangles of every leaf, [`MISS`] behind the last.
    pub leaves: Vec<[u32; LANES]>,
    /// What the cells of nests hold, with the number that each nest has in the tree.
    pub nests: Vec<(u32, Vec<NodeRef>)>,
}

/// Subtrees of at most this many items are laid out by one thread without a look at the job: below a millisecond.
const PIECE: usize = 1 << 14;

impl Layout {
    const EMPTY: Self =
        Self { root: NodeRef::EMPTY, stack_size: 0, nodes: Vec::new(), leaves: Vec::new(), nests: Vec::new() };

    /// Of a tree.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::OutOfMemory`].
    pub fn of(tree: &Tree, opening: Opening, job: &Job) -> Result<Self, Error> {
        let Some(root) = tree.nodes.first() else { return Ok(Self::EMPTY) };
        let unit = root.bounds.half_area();
        let collapse = match opening {
            Opening::Cheapest => Some(Collapse::of(tree, unit, &mut Costs::default())?),
            Opening::Largest => None,
        };
        Widener { tree, collapse, job }.alone(0)
    }

    /// Add another one behind all there is; returns where its root is then.
    fn append(&mut self, other: Self) -> NodeRef {
        let (nodes, leaves) = (self.nodes.len(), self.leaves.len());
        let moved = |child: NodeRef| child.moved(nodes, leaves);
        self.nodes.extend(other.nodes.into_iter().map(|wide| Wide { child: wide.child.map(moved), ..wide }));
        self.leaves.extend(other.leaves);
        self.nests.extend(other.nests.into_iter().map(|(nest, cells)| (nest, cells.into_iter().map(moved).collect())));
        moved(other.root)
    }
}

struct Widener<'a> {
    tree: &'a Tree,
    collapse: Option<Collapse>,
    job: &'a Job,
}

impl Widener<'_> {
    fn alone(&self, index: usize) -> Result<Layout, Error> {
        let mut layout = Layout::EMPTY;
        (layout.root, layout.stack_size) = self.subtree(index, &mut layout)?;
        Ok(layout)
    }

    /// Returns where it is, and the entries a traversal needs on its stack.
    fn subtree(&self, index: usize, layout: &mut Layout) -> Result<(NodeRef, usize), Error> {
        let node = &self.tree.nodes[index];
        match node.kind {
            Kind::Branch { .. } if node.count as usize > PIECE => self.in_pieces(index, layout),
            Kind::Branch { .. } => self.branch(index, layout),
            Kind::Leaf => Ok((self.leaf(index, layout), 0)),
            Kind::Grid(grid) => Ok((NodeRef::grid(grid as usize), 0)),
            Kind::Nest(nest) => self.nest(nest, layout),
        }
    }

    fn in_pieces(&self, index: usize, layout: &mut Layout) -> Result<(NodeRef, usize), Error> {
        self.job.check()?;
        let (of, count) = self.side_by_side(index);
        let pieces = of[..count].par_iter().map(|&child| self.alone(child as usize));
        let pieces = pieces.collect::<Result<Vec<Layout>, Error>>()?;
        let slot = layout.nodes.len();
        layout.nodes.reserve(1 + pieces.iter().map(|piece| piece.nodes.len()).sum::<usize>());
        layout.leaves.reserve(pieces.iter().map(|piece| piece.leaves.len()).sum());
        layout.nodes.push(Wide { child: [NodeRef::EMPTY; LANES], of });
        let mut deepest = 0;
        for (lane, piece) in pieces.into_iter().enumerate() {
            deepest = deepest.max(piece.stack_size);
            layout.nodes[slot].child[lane] = layout.append(piece);
        }
        Ok((NodeRef::branch(slot), count - 1 + deepest))
    }

    fn branch(&self, index: usize, layout: &mut Layout) -> Result<(NodeRef, usize), Error> {
        let slot = layout.nodes.len();
        let (of, count) = self.side_by_side(index);
        layout.nodes.push(Wide { child: [NodeRef::EMPTY; LANES], of });
        let mut deepest = 0;
        for (lane, &child) in of[..count].iter().enumerate() {
            let (child, below) = self.subtree(child as usize, layout)?;
            layout.nodes[slot].child[lane] = child;
            deepest = deepest.max(below);
        }
        Ok((NodeRef::branch(slot), count - 1 + deepest))
    }

    fn nest(&self, nest: u32, layout: &mut Layout) -> Result<(NodeRef, usize), Error> {
        let BuiltNest { grid, cells } = &self.tree.nests[nest as usize];
        let mut children = error::filled(grid.cell_count(), NodeRef::EMPTY, "the cells of nests")?;
        let mut deepest = 0;
        for &[cell, node] in cells {
            self.job.check()?;
            let (child, below) = self.subtree(node as usize, layout)?;
            children[cell as usize] = child;
            deepest = deepest.max(below);
        }
        layout.nests.push((nest, children));
        Ok((NodeRef::nest(nest as usize), NEST_STACK + deepest))
    }

    fn leaf(&self, index: usize, layout: &mut Layout) -> NodeRef {
        let items = self.tree.items_of(&self.tree.nodes[index]);
        let mut leaf = [MISS; LANES];
        leaf.iter_mut().zip(items).for_each(|(triangle, item)| *triangle = item.primitive);
        layout.leaves.push(leaf);
        NodeRef::leaf(layout.leaves.len() - 1, items.len())
    }

    /// Up to eight descendants that stand in for a branch, and how many they are.
    fn side_by_side(&self, index: usize) -> ([u32; LANES], usize) {
        let Some(collapse) = &self.collapse else { return self.opened(index) };
        let (children, count) = collapse.children(self.tree, index);
        (children.map(|(child, _)| child as u32), count)
    }

    /// The same where whichever is largest is opened first.
    fn opened(&self, index: usize) -> ([u32; LANES], usize) {
        let (mut open, mut areas, mut count) = ([index as u32; LANES], [f32::INFINITY; LANES], 1);
        while count < LANES {
            let largest = (1..count).fold(0, |best, place| if areas[place] >= areas[best] { place } else { best });
            let children = self.tree.children(open[largest] as usize);
            let Some(children) = children.filter(|_| areas[largest] >= 0.0) else { break };
            open.copy_within(largest + 1..count, largest + 2);
            areas.copy_within(largest + 1..count, largest + 2);
            for (place, child) in children.into_iter().enumerate() {
                (open[largest + place], areas[largest + place]) = (child as u32, self.priority(child));
            }
            count += 1;
        }
        (open, count)
    }

    /// The area of a branch; less than none of what has no children.
    fn priority(&self, index: usize) -> f32 {
        let node = &self.tree.nodes[index];
        if matches!(node.kind, Kind::Branch { .. }) { node.bounds.half_area() } else { -1.0 }
    }
}
