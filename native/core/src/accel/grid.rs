//! Uniform grids: Fujimoto, Tanaka and Iwata, "ARTS: Accelerated Ray-Tracing System", IEEE CG&A 6(4), 1986, in the
//! compact form of Lagae and Dutré, "Compact, Fast and Robust Grids for Ray Tracing", CGF 27(4), 2008: one pass counts
//! the references of every cell, one pass writes them.

use glam::Vec3;
use rayon::prelude::*;

use super::{overlap::Separator, structure::Grid, tree::Item};
use crate::{Error, Job, Mesh, bounds::Bounds, error, traverse::frame::Domain};

/// A grid with cells of its own.
#[derive(Debug, Clone)]
pub struct BuiltGrid {
    /// Its shape; `first` is 0.
    pub grid: Grid,
    /// One entry a cell, and one more for the end.
    pub starts: Vec<u32>,
    /// Triangles, cell by cell.
    pub references: Vec<u32>,
}

/// Cells along each axis for `count` triangles in a box: in all about `density * count`, as near to cubes as whole
/// numbers allow (Ize, Shirley and Parker, "Grid Creation Strategies for Efficient Ray Tracing", RT 2007).
///
/// An axis along which the box is thinner than such a cube gets one cell, and the others share the cells anew.
pub fn resolution(bounds: &Bounds, count: usize, density: f64, most_cells: usize) -> [u32; 3] {
    let extent = bounds.extent().as_dvec3();
    let wanted = (density * count as f64).clamp(1.0, most_cells as f64);
    let mut axes: Vec<usize> = (0..3).filter(|&k| extent[k] > 0.0).collect();
    let mut cells = [1.0; 3];
    while !axes.is_empty() {
        // The mean of logarithms: a product of three extents may leave the range of numbers.
        let mean = (wanted.ln() - axes.iter().map(|&k| extent[k].ln()).sum::<f64>()) / axes.len() as f64;
        // Rounding must not make 1.999.. of 2.
        let along = |k: usize| extent[k] * mean.exp() + 1e-9;
        let before = axes.len();
        axes.retain(|&k| along(k) >= 1.0);
        if axes.len() == before {
            axes.iter().for_each(|&k| cells[k] = along(k).floor().min(4096.0));
            break;
        }
    }
    while cells.iter().product::<f64>() > most_cells as f64 {
        let longest = (0..3).max_by(|&a, &b| cells[a].total_cmp(&cells[b])).unwrap_or(0);
        cells[longest] = (cells[longest] / 2.0).floor().max(1.0);
    }
    cells.map(|c| c as u32)
}

/// Items are rasterised and sorted in parts of this many.
const PART: usize = 1 << 14;

/// Build a grid over `items`, which lie within `bounds`.
///
/// A cell lists every triangle that comes within the domain's margin of it, so that rounding in the walk is harmless.
/// Every item counts `units` in the job's progress.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn build(
    mesh: &Mesh,
    domain: &Domain,
    bounds: &Bounds,
    items: &[Item],
    resolution: [u32; 3],
    job: &Job,
    units: u64,
) -> Result<BuiltGrid, Error> {
    let raster = Raster::new(domain, bounds, resolution);
    let cells_of = |item: &Item, pairs: &mut Vec<[u32; 2]>| pairs.extend(raster.cells_of(mesh, item));
    let (starts, references) = listed(items, raster.grid.cell_count(), job, units, cells_of)?;
    Ok(BuiltGrid { grid: raster.grid, starts, references })
}

/// The lists of `cell_count` cells, in the order of items: where each begins, and the triangles. `cells_of` appends an
/// item's cells, paired with its triangle.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub(super) fn listed(
    items: &[Item],
    cell_count: usize,
    job: &Job,
    units: u64,
    cells_of: impl Fn(&Item, &mut Vec<[u32; 2]>) + Sync,
) -> Result<(Vec<u32>, Vec<u32>), Error> {
    let parts: Vec<Vec<[u32; 2]>> = items
        .par_chunks(PART)
        .map(|part| {
            let mut pairs = Vec::new();
            for item in part {
                // One item may fill all cells, so even a part is too long to wait for.
                job.check()?;
                cells_of(item, &mut pairs);
            }
            job.advance(units * part.len() as u64);
            Ok(pairs)
        })
        .collect::<Result<_, Error>>()?;
    sort_by_cell(&parts, cell_count, job)
}

/// Cells or pairs that are gone through between two looks at the job: some milliseconds.
const STEP: usize = 1 << 20;

/// A counting sort of (cell, triangle) pairs that keeps their order within a cell.
fn sort_by_cell(parts: &[Vec<[u32; 2]>], cell_count: usize, job: &Job) -> Result<(Vec<u32>, Vec<u32>), Error> {
    let total: usize = parts.iter().map(Vec::len).sum();
    if total > u32::MAX as usize {
        return Err(Error::OutOfMemory { what: "the references of a grid's cells", bytes: total * 4 });
    }
    let mut starts = error::filled(cell_count + 1, 0u32, "the cells of a grid")?;
    for pairs in parts.iter().flat_map(|part| part.chunks(STEP)) {
        job.check()?;
        pairs.iter().for_each(|&[cell, _]| starts[cell as usize] += 1);
    }
    let mut end = 0;
    for row in starts.chunks_mut(STEP) {
        job.check()?;
        for start in row {
            end += *start;
            *start = end;
        }
    }
    let mut references = error::filled(total, 0u32, "the references of a grid's cells")?;
    for pairs in parts.iter().rev().flat_map(|part| part.rchunks(STEP)) {
        job.check()?;
        for &[cell, primitive] in pairs.iter().rev() {
            let start = &mut starts[cell as usize];
            *start -= 1;
            references[*start as usize] = primitive;
        }
    }
    Ok((starts, references))
}

/// The cells of a grid, and which of them a triangle is listed in.
pub(super) struct Raster {
    /// The shape; `first` is 0.
    pub grid: Grid,
    /// The centre of the domain.
    pub centre: Vec3,
    /// The domain's margin.
    pub margin: f32,
}

impl Raster {
    /// Over a box in the mesh's own coordinates.
    pub fn new(domain: &Domain, bounds: &Bounds, resolution: [u32; 3]) -> Self {
        let (lower, upper) = (bounds.lower - domain.centre, bounds.upper - domain.centre);
        // A flat axis gets one cell that is as thick as the margin, so that its inverse is finite.
        let extent = (upper - lower).max(Vec3::splat(domain.margin())).to_array();
        let cell: [f32; 3] = std::array::from_fn(|k| extent[k] / resolution[k] as f32);
        let grid = Grid {
            lower: lower.to_array(),
            upper: upper.to_array(),
            cell,
            inverse_cell: cell.map(|edge| 1.0 / edge),
            resolution,
            first: 0,
        };
        Self { grid, centre: domain.centre, margin: domain.margin() }
    }

    /// The cells that a triangle comes within the margin of, paired with it.
    pub fn cells_of(&self, mesh: &Mesh, item: &Item) -> impl Iterator<Item = [u32; 2]> {
        let corners = mesh.corners(item.primitive).map(|corner| corner - self.centre);
        let [x, y, z] = self.range(&Bounds::of_points(corners));
        let is_single = x.len() * y.len() * z.len() == 1;
        let triangle = Separator::new(corners);
        let primitive = item.primitive;
        let row = move |y, z| x.clone().map(move |x| [x, y, z]);
        let cells = z.flat_map(move |z| {
            let row = row.clone();
            y.clone().flat_map(move |y| row(y, z))
        });
        cells
            .filter(move |&cell| is_single || self.overlaps(&triangle, cell))
            .map(move |cell| [self.index(cell), primitive])
    }

    fn range(&self, bounds: &Bounds) -> [std::ops::Range<u32>; 3] {
        let bounds = bounds.dilated(self.margin);
        std::array::from_fn(|k| {
            let cell = |position: f32| ((position - self.grid.lower[k]) * self.grid.inverse_cell[k]).floor();
            let last = self.grid.resolution[k] as f32 - 1.0;
            cell(bounds.lower[k]).clamp(0.0, last) as u32..cell(bounds.upper[k]).clamp(0.0, last) as u32 + 1
        })
    }

    fn overlaps(&self, triangle: &Separator, cell: [u32; 3]) -> bool {
        let edges = Vec3::from_array(self.grid.cell);
        let position = Vec3::new(cell[0] as f32, cell[1] as f32, cell[2] as f32);
        let centre = Vec3::from_array(self.grid.lower) + (position + 0.5) * edges;
        triangle.overlaps(centre, edges * 0.5 + self.margin)
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> u32 {
        (z * self.grid.resolution[1] + y) * self.grid.resolution[0] + x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells_of(extent: [f32; 3], count: usize) -> [u32; 3] {
        let bounds = Bounds { lower: Vec3::ZERO, upper: Vec3::from_array(extent) };
        resolution(&bounds, count, 1.0, 1 << 24)
    }

    #[test]
    fn cells_are_cubes_and_as_many_as_wanted() {
        assert_eq!(cells_of([1.0; 3], 1000), [10; 3]);
        assert_eq!(cells_of([4.0, 2.0, 1.0], 8000), [40, 20, 10]);
        assert_eq!(cells_of([1e-30, 2e-30, 1e-30], 2000), [10, 20, 10]);
    }

    #[test]
    fn a_flat_box_has_no_more_cells_than_others() {
        assert_eq!(cells_of([1.0, 1.0, 0.0], 10_000), [100, 100, 1]);
        assert_eq!(cells_of([1e-6, 2.0, 1.0], 20_000), [1, 200, 100]);
        assert_eq!(cells_of([0.0, 3.0, 0.0], 77), [1, 77, 1]);
        assert_eq!(cells_of([0.0; 3], 77), [1; 3]);
    }
}
