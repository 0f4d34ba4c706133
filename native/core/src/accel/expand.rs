//! The expansion of an irregular grid's cells: a ray that is in a cell's box needs no other cell until it leaves it.

use rayon::prelude::*;

use super::{lattice::MergedCell, structure::Grid};
use crate::{Error, Job, error};

/// Cells that one thread expands between two looks at the job.
const PART: usize = 1 << 10;

/// Grow the box of every cell over neighbours that list nothing it does not list, at most `rounds` times in each
/// direction. All cells see the boxes as they were, so the result does not depend on any order.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn expand(
    grid: &Grid,
    voxels: &[u32],
    cells: &mut Vec<MergedCell>,
    references: &[u32],
    rounds: u32,
    job: &Job,
) -> Result<(), Error> {
    let surroundings = Surroundings { grid, voxels, cells, references };
    let mut expanded = error::reserve(cells.len(), "the cells of an irregular grid")?;
    expanded.extend_from_slice(cells);
    expanded.par_chunks_mut(PART).try_for_each(|part| {
        job.check()?;
        part.iter_mut().for_each(|cell| surroundings.expand(cell, rounds));
        Ok(())
    })?;
    *cells = expanded;
    Ok(())
}

struct Surroundings<'a> {
    grid: &'a Grid,
    voxels: &'a [u32],
    cells: &'a [MergedCell],
    references: &'a [u32],
}

impl Surroundings<'_> {
    fn expand(&self, cell: &mut MergedCell, rounds: u32) {
        for _ in 0..rounds {
            let before = *cell;
            for axis in 0..3 {
                let last = self.grid.resolution[axis] as u16;
                if cell.upper[axis] < last {
                    cell.upper[axis] += self.depth(cell, axis, cell.upper[axis], true);
                }
                if cell.lower[axis] > 0 {
                    cell.lower[axis] -= self.depth(cell, axis, cell.lower[axis] - 1, false);
                }
            }
            if *cell == before {
                return;
            }
        }
    }

    /// How many layers of voxels beyond a face belong to cells that list nothing but what `cell` lists; `layer` is the
    /// first of them.
    fn depth(&self, cell: &MergedCell, axis: usize, layer: u16, rises: bool) -> u16 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut depth = u16::MAX;
        let mut voxel = cell.lower;
        voxel[axis] = layer;
        while voxel[u] < cell.upper[u] {
            let mut next_row = cell.upper[u];
            voxel[v] = cell.lower[v];
            while voxel[v] < cell.upper[v] {
                let neighbour = &self.cells[self.voxels[self.grid.voxel_index(voxel)] as usize];
                if !is_subset(self.list(neighbour), self.list(cell)) {
                    return 0;
                }
                let layers = if rises { neighbour.upper[axis] - layer } else { layer + 1 - neighbour.lower[axis] };
                depth = depth.min(layers);
                next_row = next_row.min(neighbour.upper[u]);
                voxel[v] = neighbour.upper[v];
            }
            voxel[u] = next_row;
        }
        depth
    }

    fn list(&self, cell: &MergedCell) -> &[u32] {
        &self.references[cell.start as usize..cell.end as usize]
    }
}

/// Whether an ascending list has only numbers of another.
fn is_subset(list: &[u32], of: &[u32]) -> bool {
    let mut rest = of.iter();
    list.len() <= of.len() && list.iter().all(|number| rest.by_ref().any(|other| other == number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subsets_are_told() {
        assert!(is_subset(&[], &[]) && is_subset(&[], &[4]) && is_subset(&[2, 9], &[1, 2, 5, 9]));
        assert!(!is_subset(&[3], &[]) && !is_subset(&[2, 10], &[1, 2, 5, 9]) && !is_subset(&[1, 2], &[2]));
    }
}
