//! Two-level grids: Kalojanov, Billeter and Slusallek, "Two-Level Grids for Ray Tracing on GPUs", CGF 30(2), 2011. A
//! coarse grid whose occupied cells are grids, each with the resolution that its own triangles ask for.
//!
//! Measured against one grid (bunny, dragon, Sponza): a third to three fifths of the steps, a third to two thirds of
//! the tests, and 0.46 to 0.9 times the time of a ray; on soups, 1.5 times.

use super::{
    config::Config,
    grid, nest,
    nest::Nester,
    tree::{self, Item, Kind, Tree, TreeNode},
};
use crate::{Error, Job, Mesh, traverse::frame::Domain};

/// Build one over `items`, the whole mesh's.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn build(mesh: &Mesh, items: &[Item], config: &Config, job: &Job) -> Result<Tree, Error> {
    let (domain, bounds) = (Domain::new(&mesh.bounds()), mesh.bounds());
    let most_cells = config.grid_most_cells;
    let resolution = nest::limited(grid::resolution(&bounds, items.len(), config.coarse_density, most_cells));
    let coarse = grid::build(mesh, &domain, &bounds, items, resolution, job, 1)?;
    let root = TreeNode { bounds, first: 0, count: items.len() as u32, kind: Kind::Leaf };
    let (tree, _) = Nester { mesh, domain: &domain, job }.nest(&coarse, root, |items| {
        let bounds = tree::bounds_of(&items);
        let resolution = grid::resolution(&bounds, items.len(), config.fine_density, most_cells);
        let fine = grid::build(mesh, &domain, &bounds, &items, resolution, job, 0)?;
        let root = TreeNode { bounds, first: 0, count: items.len() as u32, kind: Kind::Grid(0) };
        Ok((Tree { nodes: vec![root], items, grids: vec![fine], ..Tree::default() }, ()))
    })?;
    Ok(tree)
}
