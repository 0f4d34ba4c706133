//! What the parts of a traversal take on this machine, measured on small generated meshes.
//!
//! Trees with leaves of several sizes and grids of several densities do different numbers of steps and tests for the
//! same rays; least squares over their times tell what each kind of step takes.

use std::time::Instant;

use glam::Vec3;

use super::{
    config::{Config, CostConstants},
    expected, grid,
    median::CyclingMedian,
    pack,
    sample::{Generator, Samples},
    structure::{NodeRef, Structure},
    subtree::Walker,
    tree,
};
use crate::{Error, Hits, Job, Mesh, pool, simd::Level, traverse::Tracer, traverse::frame::Domain};

/// Triangles of a mesh.
const TRIANGLES: usize = 1 << 13;
/// Sample rays through it: streams in every octant, yet less than a time slice, so that on a busy machine some rounds
/// go undisturbed.
const RAYS: usize = 1 << 11;
/// Every time is the least of so many.
const ROUNDS: usize = 12;
/// No step takes less, whatever was measured.
const LEAST_NS: f64 = 0.1;

/// Measure [`Config::cost`] on one thread, in a fraction of a second. The result varies a little from call to call, so
/// builds never ask for it themselves: they are repeatable for equal settings.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn calibrate() -> Result<CostConstants, Error> {
    pool::install(1, || {
        let (mut trees, mut grids, mut reference_ns) = (Vec::new(), Vec::new(), f64::INFINITY);
        for size in [0.02, 0.1] {
            let subject = Subject::new(size)?;
            for leaf_size in [1, 4, 8] {
                trees.push(subject.tree(leaf_size)?);
            }
            for density in [0.5, 4.0, 16.0] {
                let (time, build_ns) = subject.grid(density)?;
                grids.push(time);
                reference_ns = build_ns.min(reference_ns);
            }
        }
        let [node_ns, block_ns] = least_squares(&trees);
        let entered: Vec<Time> = grids.iter().map(|time| time.less(RAYS as f64 * node_ns)).collect();
        let [cell_ns, gather_ns] = least_squares(&entered);
        Ok(CostConstants { node_ns, block_ns, cell_ns, gather_ns, reference_ns })
    })
}

/// A mesh, and rays through it.
struct Subject {
    mesh: Mesh,
    samples: Samples,
    /// What the rays take where there is nothing to meet.
    setup_ns: f64,
}

impl Subject {
    /// Triangles of about `size` in the unit cube.
    fn new(size: f32) -> Result<Self, Error> {
        let mut generator = Generator::new(0, TRIANGLES as u64);
        let mut point = || Vec3::from_array([(); 3].map(|()| generator.uniform() as f32));
        let vertices = (0..TRIANGLES).flat_map(|_| {
            let centre = point();
            [(); 3].map(|()| centre + (point() - 0.5) * size)
        });
        let triangles = (0..TRIANGLES as u32).map(|first| [3 * first, 3 * first + 1, 3 * first + 2]);
        let mesh = Mesh::new(vertices.collect(), triangles.collect())?;
        let samples = Samples::new(&mesh.bounds(), RAYS, 0, 0);
        let mut subject = Self { mesh, samples, setup_ns: 0.0 };
        let grid = grid::build(&subject.mesh, &subject.domain(), &subject.mesh.bounds(), &[], [1; 3], &Job::new(), 0)?;
        let nothing = Structure { root: NodeRef::EMPTY, ..expected::alone(grid, subject.domain()) };
        subject.setup_ns = subject.trace_ns(&nothing)?;
        Ok(subject)
    }

    fn domain(&self) -> Domain {
        Domain::new(&self.mesh.bounds())
    }

    /// Nodes and blocks of a median tree.
    fn tree(&self, leaf_size: usize) -> Result<Time, Error> {
        let tree = tree::build(tree::items(&self.mesh)?, leaf_size, &CyclingMedian { job: &Job::new() }, &Job::new())?;
        let (rays, domain) = (self.samples.rays()?, self.domain());
        let mut walker = Walker::new(&tree, &self.mesh, &domain);
        for ray in 0..rays.len() {
            walker.trace::<false>(0, &rays.frame(ray, &domain)?);
        }
        let counts = [walker.work.nodes(), walker.work.blocks as f64];
        let nanoseconds = self.trace_ns(&pack::pack(&tree, &self.mesh, &Job::new())?)? - self.setup_ns;
        Ok(Time { counts, nanoseconds })
    }

    /// Cells and groups of a grid, and what building it took per reference.
    fn grid(&self, density: f64) -> Result<(Time, f64), Error> {
        let (bounds, items) = (self.mesh.bounds(), tree::items(&self.mesh)?);
        let resolution = grid::resolution(&bounds, items.len(), density, Config::default().grid_most_cells);
        let start = Instant::now();
        let built = grid::build(&self.mesh, &self.domain(), &bounds, &items, resolution, &Job::new(), 0)?;
        let build_ns = start.elapsed().as_secs_f64() * 1e9 / built.references.len().max(1) as f64;
        let structure = expected::alone(built, self.domain());
        let walks = expected::walks(&structure, &self.mesh, &self.samples)?;
        let nanoseconds = self.trace_ns(&structure)? - self.setup_ns;
        Ok((Time { counts: [walks.cells as f64, walks.groups as f64], nanoseconds }, build_ns))
    }

    /// All rays once.
    fn trace_ns(&self, structure: &Structure) -> Result<f64, Error> {
        let tracer = Tracer { structure, mesh: &self.mesh, level: Level::detect() };
        let (rays, mut hits) = (self.samples.rays()?, Hits::misses(RAYS));
        let mut least = f64::INFINITY;
        for _ in 0..ROUNDS {
            let start = Instant::now();
            tracer.closest(&rays, &mut hits.as_mut())?;
            least = least.min(start.elapsed().as_secs_f64() * 1e9);
        }
        Ok(least)
    }
}

/// So many steps of two kinds took so long.
#[derive(Debug, Clone, Copy)]
struct Time {
    counts: [f64; 2],
    nanoseconds: f64,
}

impl Time {
    fn less(self, nanoseconds: f64) -> Self {
        Self { nanoseconds: self.nanoseconds - nanoseconds, ..self }
    }
}

/// What a step of each kind takes, by least squares of relative errors.
fn least_squares(times: &[Time]) -> [f64; 2] {
    let sum = |term: &dyn Fn(&Time) -> f64| times.iter().map(|time| term(time) / time.nanoseconds.powi(2)).sum::<f64>();
    let square = |i: usize, j: usize| sum(&|time| time.counts[i] * time.counts[j]);
    let right = |i: usize| sum(&|time| time.counts[i] * time.nanoseconds);
    let (a, b, c) = (square(0, 0), square(0, 1), square(1, 1));
    let determinant = a * c - b * b;
    let both = [(c * right(0) - b * right(1)) / determinant, (a * right(1) - b * right(0)) / determinant];
    // Where noise makes one kind cost less than nothing, the other has all of it.
    match both {
        [first, second] if first >= LEAST_NS && second >= LEAST_NS => both,
        [first, _] if first < LEAST_NS => [LEAST_NS, (right(1) / c).max(LEAST_NS)],
        _ => [(right(0) / a).max(LEAST_NS), LEAST_NS],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_squares_find_what_made_the_times() {
        let time = |x: f64, y: f64| Time { counts: [x, y], nanoseconds: 9.0 * x + 4.0 * y };
        let [node, block] = least_squares(&[time(1.0, 0.5), time(2.0, 5.0), time(10.0, 3.0)]);
        assert!((node - 9.0).abs() < 1e-9 && (block - 4.0).abs() < 1e-9);
    }

    #[test]
    fn nothing_costs_less_than_nothing() {
        let times = [([1.0, 1.0], 1.0), ([2.0, 1.0], 3.5), ([3.0, 1.0], 6.0)];
        let [first, second] = least_squares(&times.map(|(counts, nanoseconds)| Time { counts, nanoseconds }));
        assert!(first > 1.0 && second == LEAST_NS);
    }

    #[test]
    fn constants_are_valid_settings() {
        let cost = calibrate().unwrap();
        Config { cost, ..Config::default() }.check().unwrap();
        assert!(cost.node_ns > 0.0 && cost.gather_ns > 0.0 && cost.reference_ns > 0.0);
    }
}
