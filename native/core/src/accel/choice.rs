//! Which builder the hybrid uses: the one whose build, together with the rays to come, is expected to take least.
//!
//! Build times and the share of lazy cells that rays touch were fitted to 1e4 to 1e6 rays through bunny, dragon and
//! Sponza, on one thread; as they are told in visits of a wide node, the constants that `calibrate` measures carry them
//! over to other machines. Measured there, lazy cells pay up to some 3e4 rays on the dragon, where refining a cell when
//! a ray comes takes longer than writing it with all others does, and up to 1e6 on the bunny.

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
    /// Building, per triangle.
    build: f64,
    /// Refining, per triangle of a lazy cell that a ray touches.
    refine: f64,
    /// Time of a ray as a share of that through the best tree.
    trace: f64,
}

const PROFILES: [Profile; 4] = [
    Profile { builder: Builder::Lazy, build: 10.0, refine: 20.0, trace: 1.1 },
    Profile { builder: Builder::Linear, build: 15.0, refine: 0.0, trace: 1.2 },
    Profile { builder: Builder::Clustered, build: 44.0, refine: 0.0, trace: 1.05 },
    Profile { builder: Builder::Complete, build: 80.0, refine: 0.0, trace: 1.0 },
];

/// Triangles in a lazy cell, on average.
const CELL: f64 = 31.0;

/// The share of cells that any number of rays touches, and how many cells a ray touches first while there are enough.
const VISIBLE: f64 = 0.6;
const TOUCHED: f64 = 0.2;

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
    // A ray visits about as many nodes as the binary tree has levels.
    let ray = (count + 2.0).log2();
    let mut estimates = PROFILES.map(|Profile { builder, build, refine, trace }| {
        let visits = count * (build + refine * touched) + rays * ray * trace;
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
