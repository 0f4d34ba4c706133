//! What the cells of a grid of any kind hold, for those who count and draw.

use super::{
    irregular,
    lattice::TETRAHEDRA,
    structure::{Grid, NodeRef, Structure, Target},
};
use crate::bounds::Bounds;

/// A cell that holds triangles, or nothing.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Its box, relative to the centre of the domain.
    pub bounds: Bounds,
    /// Triangles in it.
    pub count: usize,
}

/// The cells of a grid, in order, without those that hold a node; none of what is no grid.
pub fn cells(structure: &Structure, target: Target) -> Box<dyn Iterator<Item = Cell> + '_> {
    let lattices = &structure.lattices;
    match target {
        Target::Grid(index) => {
            let grid = &structure.grids[index as usize];
            let cell = |index| Cell { bounds: grid.cell_bounds(index), count: structure.cell(grid, index).len() };
            Box::new((0..grid.cell_count()).map(cell))
        }
        Target::Nest(index) => {
            let nest = &lattices.nests[index as usize];
            let free = lattices.children(nest).iter().enumerate().filter(|(_, child)| **child == NodeRef::EMPTY);
            Box::new(free.map(|(index, _)| Cell { bounds: nest.cell_bounds(index), count: 0 }))
        }
        Target::Irregular(index) => {
            let grid = &lattices.irregular[index as usize];
            let boxes = irregular::own_boxes(lattices, grid);
            Box::new(boxes.map(|(cell, [lower, upper])| {
                let bounds = Bounds { lower: grid.corner(lower), upper: grid.corner(upper) };
                Cell { bounds, count: cell.len() }
            }))
        }
        Target::Tetrahedral(index) => {
            let grid = &lattices.tetrahedral[index as usize];
            let cell =
                |index| Cell { bounds: grid.cell_bounds(index / TETRAHEDRA), count: structure.cell(grid, index).len() };
            Box::new((0..grid.cell_count() * TETRAHEDRA).map(cell))
        }
        _ => Box::new(std::iter::empty()),
    }
}

/// No fewer boxes are listed of all grids and their cells.
pub fn most_boxes(structure: &Structure) -> usize {
    let lattices = &structure.lattices;
    let shapes = || structure.grids.iter().chain(&lattices.nests).chain(&lattices.irregular);
    let tetrahedra: usize = lattices.tetrahedral.iter().map(|grid| 1 + grid.cell_count() * TETRAHEDRA).sum();
    shapes().count() + shapes().map(Grid::cell_count).sum::<usize>() + tetrahedra
}
