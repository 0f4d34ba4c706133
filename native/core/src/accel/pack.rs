//! From the binary tree to the structure that rays walk: up to eight nodes stand side by side in a wide one, leaves
//! become blocks, grids are joined into one store. After Wald, Benthin and Boulos, "Getting Rid of Packets", RT 2008.

use glam::Vec3A;
use rayon::prelude::*;

use super::{
    draft::{self, Boxes},
    layout::{Layout, Opening, Wide},
    structure::{Grid, Node, NodeRef, Structure},
    tree::Tree,
};
use crate::{
    Error, Job, Mesh,
    arena::Arena,
    bounds::BoundsA,
    error,
    simd::Level,
    traverse::frame::Domain,
    triangle::{Block, LANES},
};

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
    let layout = Layout::of(tree, opening, job)?;
    let nodes = write_nodes(&layout.nodes, tree, domain.centre.into(), job)?;
    let blocks = write_leaves(&layout.leaves, mesh, job)?;
    let stack_size = layout.stack_size;
    let mut structure = Structure { nodes, blocks, stack_size, ..Structure::of(layout.root, domain) };
    join_nests(tree, layout.nests, &mut structure)?;
    join_grids(tree, &mut structure)?;
    Ok(structure)
}

/// Nodes or leaves that are written by one thread without a look at the job: below a millisecond.
const PART: usize = 1 << 11;

fn write_nodes(wides: &[Wide], tree: &Tree, centre: Vec3A, job: &Job) -> Result<Arena<Node>, Error> {
    let mut nodes = Arena::stale(wides.len(), "the nodes")?;
    nodes.par_chunks_mut(PART).zip(wides.par_chunks(PART)).try_for_each(|(nodes, wides)| {
        job.check()?;
        nodes.iter_mut().zip(wides).for_each(|(node, wide)| *node = fitted(wide, tree, centre));
        Ok(())
    })?;
    Ok(nodes)
}

fn fitted(wide: &Wide, tree: &Tree, centre: Vec3A) -> Node {
    let bounds = std::array::from_fn(|lane| match wide.child[lane] {
        NodeRef::EMPTY => BoundsA::EMPTY,
        _ => tree.nodes[wide.of[lane] as usize].bounds.into(),
    });
    Node::new(wide.child, &bounds, centre)
}

/// All of the job's units for packing are counted here, whatever leaves hold: triangles may be in many of them, or in
/// grids alone.
fn write_leaves(leaves: &[[u32; LANES]], mesh: &Mesh, job: &Job) -> Result<Arena<Block>, Error> {
    let mut blocks = Arena::stale(leaves.len(), "the leaves")?;
    let (parts, units, level) = (leaves.len().div_ceil(PART), mesh.solid_count(), Level::detect());
    let sites = blocks.par_chunks_mut(PART).zip(leaves.par_chunks(PART)).enumerate();
    sites.try_for_each_init(Boxes::default, |boxes, (part, (blocks, leaves))| {
        job.check()?;
        draft::fill_all(leaves, mesh, blocks, boxes, level);
        job.advance((units * (part + 1) / parts - units * part / parts) as u64);
        Ok(())
    })?;
    if parts == 0 {
        job.advance(units as u64);
    }
    Ok(blocks)
}

fn join_nests(tree: &Tree, mut nests: Vec<(u32, Vec<NodeRef>)>, structure: &mut Structure) -> Result<(), Error> {
    let lattices = &mut structure.lattices;
    let cells = nests.iter().map(|(_, cells)| cells.len()).sum();
    lattices.children = error::reserve(cells, "the cells of nests")?;
    nests.sort_by_key(|(nest, _)| *nest);
    for (nest, cells) in nests {
        let first = lattices.children.len();
        lattices.nests.push(Grid { first, ..tree.nests[nest as usize].grid.clone() });
        lattices.children.extend(cells);
    }
    Ok(())
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
