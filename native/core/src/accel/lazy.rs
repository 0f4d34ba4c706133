//! Cells that become subtrees when the first ray reaches them, so that a picture pays only for what is seen: Hunt,
//! Mark and Fussell, "Fast and Lazy Build of Acceleration Structures from Scene Hierarchies", RT 2007.
//!
//! A cell's subtree depends on nothing but the mesh and the cell's list of triangles, so it is the same whichever ray
//! comes first, and hits are what they would be in a complete structure.

use std::{cell::RefCell, sync::OnceLock};

use super::{
    small::{SmallBuilder, Subtree},
    structure::{Node, NodeRef, View},
};
use crate::{Error, Mesh, bounds::Bounds, error, traverse::frame::Frame, triangle::Block};

/// A lazy cell.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Where its triangles end, which begin where those of the cell before it end.
    pub end: u32,
    /// The box around them, relative to the centre of the domain.
    pub bounds: Bounds,
}

/// All lazy cells of a structure.
#[derive(Debug, Default)]
pub struct LazyCells {
    /// Cell by cell.
    triangles: Vec<u32>,
    cells: Vec<Cell>,
    /// What becomes of each; nothing where the system refused the memory.
    refined: Vec<OnceLock<Option<Refined>>>,
}

/// The subtree of a cell.
#[derive(Debug)]
pub struct Refined {
    /// Where rays begin; a reference into the cell's own nodes and blocks.
    pub root: NodeRef,
    nodes: Box<[Node]>,
    blocks: Box<[Block]>,
}

impl Refined {
    /// What its references mean.
    #[inline(always)]
    pub fn view(&self) -> View<'_> {
        View { nodes: &self.nodes, blocks: &self.blocks }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.blocks)
    }
}

impl LazyCells {
    /// Cells over these triangles.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(triangles: Vec<u32>, cells: Vec<Cell>) -> Result<Self, Error> {
        let mut refined = error::reserve(cells.len(), "the lazy cells")?;
        refined.extend(cells.iter().map(|_| OnceLock::new()));
        Ok(Self { triangles, cells, refined })
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// The triangles of a cell.
    pub fn triangles(&self, index: usize) -> &[u32] {
        let first = index.checked_sub(1).map_or(0, |before| self.cells[before].end);
        &self.triangles[first as usize..self.cells[index].end as usize]
    }

    /// Whether a ray meets the dilated box of a cell within its interval.
    #[inline(always)]
    pub fn is_met(&self, index: usize, frame: &Frame) -> bool {
        let Bounds { lower, upper } = self.cells[index].bounds;
        frame.enter(lower.as_ref(), upper.as_ref(), frame.tmax).is_some()
    }

    /// The subtree of a cell, which is built now if nobody has asked for it yet. Where the system refuses the memory
    /// there is none, then and for good, and the cell's triangles are to be tested one and all.
    #[inline(always)]
    pub fn refine(&self, index: usize, mesh: &Mesh) -> Option<&Refined> {
        match self.refined[index].get() {
            Some(refined) => refined.as_ref(),
            None => self.refine_now(index, mesh),
        }
    }

    #[cold]
    #[inline(never)]
    fn refine_now(&self, index: usize, mesh: &Mesh) -> Option<&Refined> {
        thread_local!(static BUILDER: RefCell<SmallBuilder> = RefCell::default());
        let build = || {
            let built = BUILDER.with_borrow_mut(|builder| builder.build(mesh, self.triangles(index)));
            let Subtree { root, nodes, blocks, .. } = built.ok()?;
            Some(Refined { root, nodes: nodes.into(), blocks: blocks.into() })
        };
        self.refined[index].get_or_init(build).as_ref()
    }

    /// The subtree of a cell, if a ray has been there.
    pub fn refined(&self, index: usize) -> Option<&Refined> {
        self.refined[index].get()?.as_ref()
    }

    /// Cells, and nodes and leaves of the subtrees that there are.
    pub fn places(&self) -> usize {
        let subtrees = (0..self.len()).filter_map(|index| self.refined(index)).map(Refined::view);
        self.len() + subtrees.map(|view| view.nodes.len() + view.blocks.len()).sum::<usize>()
    }

    /// Bytes held, those of the subtrees that there are among them.
    pub fn bytes(&self) -> usize {
        let subtrees = (0..self.len()).filter_map(|index| self.refined(index)).map(Refined::bytes);
        size_of_val(&*self.triangles)
            + size_of_val(&*self.cells)
            + size_of_val(&*self.refined)
            + subtrees.sum::<usize>()
    }
}
