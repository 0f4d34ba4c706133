//! Walking a grid of merged cells, after Perard-Gayot, Kalojanov and Slusallek, "GPU Ray Tracing using Irregular
//! Grids", CGF 36(2), 2017: the map of voxels tells the cell, the cell a box that may be crossed in one step.
//!
//! Rounding is harmless for the reason told in [`super::dda`]. A walk enters a box at a voxel that the ray is within
//! 8uR of, and leaves it at a crossing off by as much; in between, a box being convex, the ray is within 8uR of it. And
//! a cell lists every triangle within the margin of any voxel of its box.

use super::{dda, frame::Frame, probe::Probe};
use crate::accel::{
    lattice::MergedCell,
    structure::{Grid, Structure},
};

/// Where a ray is.
pub struct Walk<'a> {
    structure: &'a Structure,
    frame: &'a Frame,
    grid: &'a Grid,
    voxel: [i32; 3],
    /// The cell last told of.
    cell: Option<&'a MergedCell>,
}

impl<'a> Walk<'a> {
    /// At the first voxel of a grid that the ray meets before `limit`, if any.
    #[inline(never)]
    pub fn new(frame: &'a Frame, structure: &'a Structure, index: u32, limit: f32) -> Option<Self> {
        let grid = &structure.lattices.irregular[index as usize];
        let near = frame.enter(&grid.lower, &grid.upper, limit)?;
        let voxel = std::array::from_fn(|k| coordinate(k, near, frame, grid).clamp(0, grid.resolution[k] as i32 - 1));
        Some(Self { structure, frame, grid, voxel, cell: None })
    }

    /// The triangles of the next cell that has any and that the ray reaches before `limit`.
    #[inline(never)]
    pub fn next<P: Probe>(&mut self, probe: &mut P, limit: f32) -> Option<&'a [u32]> {
        let lattices = &self.structure.lattices;
        loop {
            if let Some(cell) = self.cell
                && !self.leave(cell, limit)
            {
                return None;
            }
            probe.step();
            let [columns, rows, _] = self.grid.resolution.map(|edge| edge as usize);
            let [x, y, z] = self.voxel.map(|coordinate| coordinate as usize);
            let cell = &lattices.merged[lattices.voxels[self.grid.first + (z * rows + y) * columns + x] as usize];
            self.cell = Some(cell);
            if cell.start < cell.end {
                return Some(&self.structure.references[cell.start as usize..cell.end as usize]);
            }
        }
    }

    /// Step out of a cell's box; false where the grid ends, or the ray does not get that far before `limit`.
    #[inline(always)]
    fn leave(&mut self, cell: &MergedCell, limit: f32) -> bool {
        let rises = self.frame.inverse.map(|inverse| inverse >= 0.0);
        let crossings: [f32; 3] = std::array::from_fn(|k| {
            let plane = if rises[k] { cell.upper[k] } else { cell.lower[k] };
            dda::crossing(i32::from(plane), k, self.frame, self.grid)
        });
        let axis = least(crossings);
        let exit = crossings[axis];
        if limit < exit {
            return false;
        }
        for k in 0..3 {
            let [first, last] = [i32::from(cell.lower[k]), i32::from(cell.upper[k]) - 1];
            // Never back, whatever rounding says: so every walk ends.
            let [first, last] = if rises[k] { [self.voxel[k], last] } else { [first, self.voxel[k]] };
            self.voxel[k] = coordinate(k, exit, self.frame, self.grid).clamp(first, last);
        }
        self.voxel[axis] = if rises[axis] { i32::from(cell.upper[axis]) } else { i32::from(cell.lower[axis]) - 1 };
        (self.voxel[axis] as u32) < self.grid.resolution[axis]
    }
}

/// In which voxel along an axis the ray is at `t`, if the grid were endless; at 0 where it is below the first.
#[inline(always)]
fn coordinate(axis: usize, t: f32, frame: &Frame, grid: &Grid) -> i32 {
    let position = frame.local[axis] + frame.direction[axis] * t;
    ((position - grid.lower[axis]) * grid.inverse_cell[axis]) as i32
}

/// Which of three is least.
#[inline(always)]
fn least([x, y, z]: [f32; 3]) -> usize {
    if x <= y && x <= z {
        0
    } else if y <= z {
        1
    } else {
        2
    }
}
