//! Walking a uniform grid with a 3D digital differential analyser, after Amanatides and Woo, "A Fast Voxel Traversal
//! Algorithm for Ray Tracing", Eurographics 1987.
//!
//! A triangle may stretch over many cells, so a hit counts only once the walk has reached the cell it lies in; it is
//! kept as the best so far until then, and the walk ends when the current cell ends behind it. Every crossing is
//! computed from its plane, never accumulated, so each is off by at most 8uR (see [`super::frame`]), and cells list
//! every triangle within [`Domain::margin`](super::frame::Domain::margin) of them: what is found does not depend on
//! which of two cells a rounded crossing chooses.

use super::{frame::Frame, leaf::Search, probe::Probe};
use crate::{
    accel::structure::{Grid, Structure},
    simd::Simd,
};

/// Where a walk is.
pub struct Walk {
    /// The current cell.
    pub index: isize,
    /// The same along each axis.
    pub cell: [i32; 3],
    step: [i32; 3],
    stride: [isize; 3],
    /// Where the ray leaves it along each axis.
    pub crossing: [f32; 3],
}

/// Search a grid; true once there is any hit, where `any` is wanted.
#[inline(always)]
pub fn walk<S: Simd, P: Probe, const ANY: bool>(
    search: &mut Search<'_, S, P>,
    structure: &Structure,
    grid: &Grid,
) -> bool {
    let Some(enter) = search.frame.enter(&grid.lower, &grid.upper, search.best.high) else {
        return false;
    };
    let frame = search.frame;
    let mut walk = Walk::new(frame, grid, enter);
    loop {
        search.probe.step();
        let triangles = structure.cell(grid, walk.index as usize);
        if !triangles.is_empty() && search.gather::<ANY>(triangles) {
            return true;
        }
        let axis = walk.next_axis();
        if search.best.high < walk.crossing[axis] || !walk.advance(axis, frame, grid) {
            return false;
        }
    }
}

/// The parameter at which the ray leaves what lies before a plane along `axis`. Behind the grid's last plane there is
/// no cell that would make up for a rounding error, so the grid ends where its dilated box does.
#[inline(always)]
pub fn crossing(plane: i32, axis: usize, frame: &Frame, grid: &Grid) -> f32 {
    let position = grid.lower[axis] + plane as f32 * grid.cell[axis];
    if plane == 0 || plane == grid.resolution[axis] as i32 {
        position * frame.inverse[axis] + frame.far_bias[axis]
    } else {
        (position - frame.local[axis]) * frame.inverse[axis]
    }
}

impl Walk {
    /// In the cell where the ray is at `enter`.
    #[inline(always)]
    pub fn new(frame: &Frame, grid: &Grid, enter: f32) -> Self {
        let mut cell = [0; 3];
        for k in 0..3 {
            let position = frame.local[k] + frame.direction[k] * enter;
            // Towards zero, which differs from the floor only below the first cell.
            let place = ((position - grid.lower[k]) * grid.inverse_cell[k]) as i32;
            cell[k] = place.clamp(0, grid.resolution[k] as i32 - 1);
        }
        Self::at(cell, frame, grid)
    }

    /// In a cell.
    #[inline(always)]
    pub fn at(cell: [i32; 3], frame: &Frame, grid: &Grid) -> Self {
        let [columns, rows, _] = grid.resolution;
        let strides = [1, columns as isize, columns as isize * rows as isize];
        let mut walk = Self { index: 0, cell, step: [1; 3], stride: strides, crossing: [0.0; 3] };
        for k in 0..3 {
            walk.index += cell[k] as isize * strides[k];
            if frame.inverse[k] < 0.0 {
                walk.step[k] = -1;
                walk.stride[k] = -strides[k];
            }
            walk.crossing[k] = walk.crossing(k, frame, grid);
        }
        walk
    }

    /// The parameter at which the ray leaves the current cell along `axis`.
    #[inline(always)]
    fn crossing(&self, axis: usize, frame: &Frame, grid: &Grid) -> f32 {
        crossing(self.cell[axis] + i32::from(self.step[axis] > 0), axis, frame, grid)
    }

    /// The axis along which the ray leaves the current cell first.
    #[inline(always)]
    pub fn next_axis(&self) -> usize {
        let [x, y, z] = self.crossing;
        if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        }
    }

    /// Step into the next cell; false where the grid ends.
    #[inline(always)]
    pub fn advance(&mut self, axis: usize, frame: &Frame, grid: &Grid) -> bool {
        self.cell[axis] += self.step[axis];
        self.index += self.stride[axis];
        let inside = (self.cell[axis] as u32) < grid.resolution[axis];
        if inside {
            self.crossing[axis] = self.crossing(axis, frame, grid);
        }
        inside
    }
}
