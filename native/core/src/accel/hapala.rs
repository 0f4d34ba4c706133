//! Build a grid, test it, and keep it only where that pays: Hapala, Karlík and Havran, "When It Makes Sense to Use
//! Uniform Grids for Ray Tracing", WSCG 2011. The finished grid tells how sparse it is and how unevenly its cells are
//! filled; sample rays that walk it tell what a ray costs. A hierarchy's cost is foretold from the same rays and the
//! number of triangles. With few rays to come, not even a bad grid is worth replacing.

use super::{
    config::Config,
    decision::{Decision, Verdict},
    expected::{self, Walks},
    grid::BuiltGrid,
    sample::{self, Samples},
    structure::Structure,
};
use crate::{Error, Hits, Mesh, ray::MISS, simd::Level, traverse::Tracer, traverse::frame::Domain};

/// Judge the grid of a whole mesh; verdict [`Verdict::Grid`] keeps it, [`Verdict::Split`] asks for a hierarchy.
///
/// # Errors
/// None; the signature is that of the rays' own checks, which samples pass.
pub fn judge(built: BuiltGrid, mesh: &Mesh, config: &Config) -> Result<(BuiltGrid, Decision), Error> {
    let bounds = mesh.bounds();
    let samples = Samples::within(&bounds, sample::ray_count(&bounds, &bounds, config), config.seed);
    let structure = expected::alone(built, Domain::new(&bounds));
    let walks = expected::walks(&structure, mesh, &samples)?;
    let hits = hits(&structure, mesh, &samples)?;
    let Structure { mut grids, starts, references, .. } = structure;
    let built = BuiltGrid { grid: grids.swap_remove(0), starts, references };
    let Occupancy { sparseness, spread } = Occupancy::of(&built);
    let triangles = mesh.solid_count();
    let to_come = config.expected_rays / samples.len() as f64;
    let grid = to_come * walks.nanoseconds(&config.cost);
    let bvh = to_come * hierarchy(&walks, samples.len(), triangles, config) + build(triangles, config);
    let verdict = if grid as f32 <= bvh as f32 { Verdict::Grid } else { Verdict::Split };
    let decision = Decision {
        rays: samples.len() as u32,
        hits,
        sparseness: sparseness as f32,
        spread: spread as f32,
        cost_grid: grid as f32,
        cost_bvh: bvh as f32,
        ..Decision::open(bounds, 0, triangles as u32, verdict)
    };
    Ok((built, decision))
}

fn hits(structure: &Structure, mesh: &Mesh, samples: &Samples) -> Result<u32, Error> {
    let mut hits = Hits::misses(samples.len());
    Tracer { structure, mesh, level: Level::detect() }.closest(&samples.rays()?, &mut hits.as_mut())?;
    Ok(hits.primitive.iter().filter(|&&primitive| primitive != MISS).count() as u32)
}

/// Nanoseconds of as many rays through a hierarchy as have walked the grid: down to where a ray ends, and to the blocks
/// around the triangles that the grid made it test.
fn hierarchy(walks: &Walks, rays: usize, triangles: usize, config: &Config) -> f64 {
    let blocks = walks.groups as f64 * config.hierarchy_blocks;
    let nodes = rays as f64 * config.hierarchy_nodes * doublings(triangles) + blocks * config.hierarchy_block_nodes;
    nodes * config.cost.node_ns + blocks * config.cost.block_ns
}

/// Nanoseconds of building a hierarchy.
fn build(triangles: usize, config: &Config) -> f64 {
    triangles as f64 * doublings(triangles) * config.hierarchy_build
}

fn doublings(triangles: usize) -> f64 {
    (triangles.max(2) as f64).log2()
}

/// How the cells of a grid are filled.
struct Occupancy {
    /// Empty cells over all.
    sparseness: f64,
    /// Index of dispersion of the references over the occupied cells: variance over mean.
    spread: f64,
}

impl Occupancy {
    fn of(built: &BuiltGrid) -> Self {
        let counts = built.starts.windows(2).map(|ends| f64::from(ends[1] - ends[0]));
        let (mut occupied, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for count in counts.filter(|&count| count > 0.0) {
            occupied += 1.0;
            sum += count;
            squares += count * count;
        }
        let mean = sum / occupied;
        Self {
            sparseness: 1.0 - occupied / built.grid.cell_count() as f64,
            spread: (squares / occupied - mean * mean) / mean,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::structure::Grid;

    #[test]
    fn occupancy_is_that_of_the_cells() {
        let (edges, corner) = ([1.0; 3], [0.0; 3]);
        let grid =
            Grid { lower: corner, upper: edges, cell: edges, inverse_cell: edges, resolution: [4, 1, 1], first: 0 };
        let built = BuiltGrid { grid, starts: vec![0, 1, 1, 4, 4], references: vec![0, 1, 2, 3] };
        let Occupancy { sparseness, spread } = Occupancy::of(&built);
        assert_eq!((sparseness, spread), (0.5, 0.5));
    }
}
