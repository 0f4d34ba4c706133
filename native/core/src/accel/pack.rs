//! From the binary tree to the structure that rays walk: the largest children are opened until eight are side by
//! side, leaves become blocks, grids are joined into one store. After Wald, Benthin and Boulos, "Getting Rid of
//! Packets", RT 2008.

use glam::Vec3;

use super::{
    collapse::Collapse,
    lattice::Lattices,
    structure::{Grid, NEST_STACK, Node, NodeRef, Structure},
    tree::{BuiltNest, Kind, Tree},
};
use crate::{
    Error, Job, Mesh, arena::Arena, bounds::Bounds, error, traverse::frame::Domain, triangle::Block, triangle::LANES,
};

/// Which descendants of a branch stand side by side in its wide node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Opening {
    /// Whichever is largest is opened first: fast.
    Largest,
    /// Those with which all wide nodes together have the least area.
    Cheapest,
}

/// Pack a tree, the largest children opened first.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn pack(tree: &Tree, mesh: &Mesh, job: &Job) -> Result<Structure, Error> {
    pack_opened(tree, mesh, Opening::Largest, job)
}

/// Pack a tree.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn pack_opened(tree: &Tree, mesh: &Mesh, opening: Opening, job: &Job) -> Result<Structure, Error> {
    let domain = Domain::new(&mesh.bounds());
    let leaves = tree.nodes.iter().filter(|node| node.kind == Kind::Leaf).count();
    let (blocks, nodes) = (Arena::with_capacity(leaves, "the leaves")?, Arena::with_capacity(leaves, "the nodes")?);
    let collapse = (opening == Opening::Cheapest).then(|| Collapse::new(tree)).transpose()?;
    // What is in the cells of nests is not counted, however often it is there.
    let items = if tree.nests.is_empty() { tree.items.len() } else { 0 };
    let surplus = items.saturating_sub(mesh.solid_count()) as u64;
    let (lattices, nested, centre) = (Lattices::default(), 0, domain.centre);
    let mut packer = Packer { tree, mesh, job, centre, surplus, collapse, nodes, blocks, lattices, nested };
    let packed = if tree.nodes.is_empty() { Packed::EMPTY } else { packer.subtree(0)? };
    let Packer { nodes, blocks, lattices, .. } = packer;
    let stack_size = packed.stack_size;
    let mut structure = Structure { nodes, blocks, lattices, stack_size, ..Structure::of(packed.root, domain) };
    join_grids(tree, &mut structure)?;
    Ok(structure)
}

/// A packed subtree.
struct Packed {
    root: NodeRef,
    /// Most entries a traversal of it can put on its stack.
    stack_size: usize,
}

impl Packed {
    const EMPTY: Self = Self { root: NodeRef::EMPTY, stack_size: 0 };
}

struct Packer<'a> {
    tree: &'a Tree,
    mesh: &'a Mesh,
    job: &'a Job,
    centre: Vec3,
    /// References beyond one a triangle, which the job does not count.
    surplus: u64,
    collapse: Option<Collapse<'a>>,
    nodes: Arena<Node>,
    blocks: Arena<Block>,
    lattices: Lattices,
    /// In how many nests the current subtree is.
    nested: usize,
}

impl Packer<'_> {
    fn subtree(&mut self, index: usize) -> Result<Packed, Error> {
        let packed = match self.tree.nodes[index].kind {
            Kind::Branch { .. } => return self.branch(index),
            Kind::Leaf => Packed { root: self.leaf(index), stack_size: 0 },
            Kind::Grid(grid) => Packed { root: NodeRef::grid(grid as usize), stack_size: 0 },
            Kind::Nest(nest) => self.nest(&self.tree.nests[nest as usize])?,
        };
        // What is in cells is counted where the nest is: items may be in many of them.
        if self.nested == 0 {
            let count = u64::from(self.tree.nodes[index].count);
            let uncounted = self.surplus.min(count);
            self.surplus -= uncounted;
            self.job.advance(count - uncounted);
        }
        Ok(packed)
    }

    fn nest(&mut self, built: &BuiltNest) -> Result<Packed, Error> {
        let (index, first) = (self.lattices.nests.len(), self.lattices.children.len());
        error::grow(
            &mut self.lattices.children,
            first + built.grid.cell_count(),
            NodeRef::EMPTY,
            "the cells of nests",
        )?;
        self.lattices.nests.push(Grid { first, ..built.grid.clone() });
        self.nested += 1;
        let mut deepest = 0;
        for &[cell, node] in &built.cells {
            self.job.check()?;
            let packed = self.subtree(node as usize)?;
            self.lattices.children[first + cell as usize] = packed.root;
            deepest = deepest.max(packed.stack_size);
        }
        self.nested -= 1;
        Ok(Packed { root: NodeRef::nest(index), stack_size: NEST_STACK + deepest })
    }

    fn branch(&mut self, index: usize) -> Result<Packed, Error> {
        if self.nodes.len().is_multiple_of(1 << 12) {
            self.job.check()?;
        }
        let slot = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let children = self.collapse.as_ref().map_or_else(|| self.opened(index), |ways| ways.children(index));
        let mut node = Node::EMPTY;
        let mut deepest = 0;
        for (lane, &child) in children.iter().enumerate() {
            set_planes(&mut node, lane, &self.tree.nodes[child].bounds, self.centre);
            let packed = self.subtree(child)?;
            node.child[lane] = packed.root;
            deepest = deepest.max(packed.stack_size);
        }
        node.set_order();
        self.nodes.as_mut_slice()[slot] = node;
        Ok(Packed { root: NodeRef::branch(slot), stack_size: children.len() - 1 + deepest })
    }

    /// Up to eight descendants that stand in for a branch: whichever is largest is opened first.
    fn opened(&self, index: usize) -> Vec<usize> {
        let mut open = vec![index];
        while open.len() < LANES {
            let area = |&(_, &child): &(usize, &usize)| self.tree.nodes[child].bounds.half_area();
            let branches = open.iter().enumerate().filter(|(_, child)| self.tree.children(**child).is_some());
            let Some((place, &largest)) = branches.max_by(|a, b| area(a).total_cmp(&area(b))) else {
                break;
            };
            let children = self.tree.children(largest);
            open.splice(place..=place, children.into_iter().flatten());
        }
        open
    }

    fn leaf(&mut self, index: usize) -> NodeRef {
        let items = self.tree.items_of(&self.tree.nodes[index]);
        let mut block = Block::EMPTY;
        for (lane, item) in items.iter().enumerate() {
            block.set(lane, item.primitive, self.mesh.corners(item.primitive));
        }
        self.blocks.push(block);
        NodeRef::leaf(self.blocks.len() - 1, items.len())
    }
}

fn set_planes(node: &mut Node, lane: usize, bounds: &Bounds, centre: Vec3) {
    let (lower, upper) = (bounds.lower - centre, bounds.upper - centre);
    for k in 0..3 {
        node.plane[k][lane] = lower[k];
        node.plane[3 + k][lane] = upper[k];
    }
}

fn join_grids(tree: &Tree, structure: &mut Structure) -> Result<(), Error> {
    let cells = tree.grids.iter().map(|built| built.starts.len()).sum();
    let references: usize = tree.grids.iter().map(|built| built.references.len()).sum();
    if references > u32::MAX as usize {
        return Err(Error::OutOfMemory { what: "the references of all grid cells", bytes: references * 4 });
    }
    structure.starts = error::reserve(cells, "the cells of all grids")?;
    structure.references = error::reserve(references, "the references of all grid cells")?;
    for built in &tree.grids {
        let (first, offset) = (structure.starts.len(), structure.references.len() as u32);
        structure.grids.push(Grid { first, ..built.grid.clone() });
        structure.starts.extend(built.starts.iter().map(|start| start + offset));
        structure.references.extend_from_slice(&built.references);
    }
    Ok(())
}
