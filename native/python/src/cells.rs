//! `Cells`.

use espalier_core::accel::cells;
use pyo3::prelude::*;

use crate::arrays::{self, List, Table};

/// Boxes of a structure, for drawing, in read-only arrays: from the root down, and within a depth first branches, then
/// leaves, grids, lazy cells and grid cells. A grid's cells are one deeper than the grid.
#[pyclass(frozen, module = "espalier_rt")]
pub struct Cells {
    /// (n, 3) float32: least corners, in the mesh's coordinates.
    #[pyo3(get)]
    lower: Table<f32>,
    /// (n, 3) float32: greatest corners.
    #[pyo3(get)]
    upper: Table<f32>,
    /// (n,) uint8: 0 branch, 1 leaf, 2 grid (its whole box), 3 grid cell, 4 box of a tetrahedral cell, 5 lazy cell that
    /// no ray has reached, 6 lazy cell that has become a subtree.
    #[pyo3(get)]
    kind: List<u8>,
    /// (n,) uint16: depth; the root has 0.
    #[pyo3(get)]
    depth: List<u16>,
    /// (n,) uint32: references to triangles inside; 0 for an empty cell.
    #[pyo3(get)]
    count: List<u32>,
    /// Whether max_count cut the list.
    #[pyo3(get)]
    truncated: bool,
    length: usize,
}

impl Cells {
    /// The core's list as arrays.
    pub fn new(py: Python<'_>, cells: &cells::Cells) -> PyResult<Self> {
        Ok(Self {
            lower: arrays::table(py, cells.lower.iter().copied())?,
            upper: arrays::table(py, cells.upper.iter().copied())?,
            kind: arrays::list(py, cells.kind.iter().map(|&kind| kind as u8))?,
            depth: arrays::list(py, cells.depth.iter().copied())?,
            count: arrays::list(py, cells.count.iter().copied())?,
            truncated: cells.truncated,
            length: cells.len(),
        })
    }
}

#[pymethods]
impl Cells {
    fn __len__(&self) -> usize {
        self.length
    }

    fn __repr__(&self) -> String {
        let truncated = if self.truncated { "True" } else { "False" };
        format!("Cells(count={}, truncated={truncated})", self.length)
    }
}
