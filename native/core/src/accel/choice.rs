//! Which builder the hybrid uses: the one whose build, together with the rays to come, is expected to take least.
//!
//! Build times were fitted to nine scenes of up to 871 thousand triangles, on one thread; as they are told in
//! visits of a wide node, the constants that `calibrate` measures carry them over to other machines. The order by codes
//! has become so cheap to write (bunny 5 ms, Sponza 18, dragon 84) that lazy cells (7, 30, 74) save little or nothing,
//! and the first million rays then take 1.1 to 1.5 times as long: they pay for some thousand rays at most. (Later, on
//! Zen 5, the order by codes takes 1.8, 8.0 and 31 ms, lazy cells 1.9, 9.8 and 29: there they pay for hardly any.)
//!
//! What rays take was measured in ten scenes on a machine with AVX-512 (EPYC, Zen 4), against `bvh-sah`: over clusters 1.00
//! times for camera rays and 1.00 after a bounce (0.93 to 1.04), by codes 1.08 (1.01 to 1.16) and 1.19 (1.08 to 1.37).
//!
//! For camera rays alone, no tree at all was tried (Zen 5): triangles sorted into a grid over the rays' slopes, after Hunt
//! and Mark, "Ray-Specialized Acceleration Structures for Ray Tracing", RT 2008, with cells that fit tiles. It is filled in a
//! third of the time that codes take, but all that is hidden is tested, too: a million rays took 0.85 (stadium), 1.08
//! (dragon), 1.15 (bunny2) and 1.9 times as long in all (Sponza) as by codes, the mesh not counted. And cells fit tiles only
//! where rays come in the rows of a picture.

use super::config::Config;

/// How the hybrid builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Builder {
    /// [Lazy cells](super::instant).
    Lazy,
    /// [By Morton codes](super::lbvh).
    Linear,
    /// [Over clusters](super::clustered).
    Clustered,
    /// By the surface area heuristic, with [grids](super::expected) where they pay.
    Complete,
}

impl Builder {
    /// Its name, as users read it: that of the method that builds likewise, where there is one.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lazy => "lazy",
            Self::Linear => "lbvh",
            Self::Clustered => "bvh-clusters",
            Self::Complete => "bvh-sah",
        }
    }

    /// How many passes over all triangles it has less than the one with most.
    pub(super) fn passes_saved(self) -> u64 {
        match self {
            Self::Lazy => 2,
            Self::Linear => 1,
            Self::Clustered | Self::Complete => 0,
        }
    }
}

/// What a builder is expected to cost, in visits of a wide node.
#[derive(Debug, Clone, Copy)]
struct Profile {
    builder: Builder,
    /// Judging nodes, where there are enough triangles for a grid.
    judge: f64,
    /// Building, per triangle.
    build: f64,
    /// Refining, per triangle of a lazy cell that a ray touches.
    refine: f64,
    /// Time of a ray as a share of that through the best tree.
    trace: f64,
}

const PROFILES: [Profile; 4] = [
    Profile { builder: Builder::Lazy, judge: 0.0, build: 7.5, refine: 20.0, trace: 1.3 },
    Profile { builder: Builder::Linear, judge: 0.0, build: 8.0, refine: 0.0, trace: 1.09 },
    Profile { builder: Builder::Clustered, judge: 0.0, build: 30.0, refine: 0.0, trace: 1.01 },
    // The rays that judge its nodes are as many for a small mesh as for a large one.
    Profile { builder: Builder::Complete, judge: 4e5, build: 85.0, refine: 0.0, trace: 1.0 },
];

/// Triangles in a lazy cell, on average.
const CELL: f64 = 31.0;

/// The share of cells that any number of rays touches, and how many cells a ray touches first while there are enough.
const VISIBLE: f64 = 0.6;
const TOUCHED: f64 = 0.2;

/// A ray alone visits about as many nodes as the binary tree has levels; in a batch that takes this share of the time,
/// camera rays less and bounces more. With 0.5, and codes at 1.2 and clusters at 1.05 times, meshes of 20 to 60 thousand
/// triangles were built too well for their rays: a million camera rays took 1.24 and 1.28 times as long in all
/// (goldfish2_sub, city_blocks), and ten million 1.25 (vianney_house).
const STREAMED: f64 = 0.4;

/// A builder, and the nanoseconds it is expected to cost in all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Which.
    pub builder: Builder,
    /// Nanoseconds of building and of tracing the rays to come.
    pub nanoseconds: f64,
}

/// What every builder is expected to cost, the best one first.
pub fn estimates(triangles: usize, config: &Config) -> [Estimate; 4] {
    let (count, rays) = (triangles as f64, config.expected_rays);
    let seen = VISIBLE * (count / CELL).max(1.0);
    let touched = VISIBLE * (1.0 - (-rays * TOUCHED / seen).exp());
    let ray = STREAMED * (count + 2.0).log2();
    let mut estimates = PROFILES.map(|Profile { builder, judge, build, refine, trace }| {
        let judge = if triangles < config.grid_least_triangles { 0.0 } else { judge };
        let visits = judge + count * (build + refine * touched) + rays * ray * trace;
        Estimate { builder, nanoseconds: visits * config.cost.node_ns }
    });
    estimates.sort_by(|a, b| a.nanoseconds.total_cmp(&b.nanoseconds));
    estimates
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_built_for_nobody_and_the_best_tree_for_many() {
        for triangles in [1000, 70_000, 1_000_000] {
            let choose =
                |expected_rays| estimates(triangles, &Config { expected_rays, ..Config::default() })[0].builder;
            assert_eq!([0.0, 1e10].map(choose), [Builder::Lazy, Builder::Complete]);
        }
    }
}
