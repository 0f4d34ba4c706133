//! Every constant that steers a builder, each with its meaning, default and range.

use super::sah::MOST_BINS;
use crate::{Error, triangle::LANES};

/// Settings of all builders. Each method reads those it needs.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Most triangles in a leaf; 1 to 8, the lanes of a block.
    pub leaf_size: usize,
    /// Bins per axis of the binned surface area heuristic; 2 to 32. Wald, "On fast Construction of SAH-based Bounding
    /// Volume Hierarchies", RT 2007, finds 16 enough.
    pub sah_bins: usize,
    /// References that spatial splits may add, as a share of the triangles; 0 to 8.
    pub split_budget: f64,
    /// Spatial splits are tried where the sides of the best other split overlap by more than this share of the scene's
    /// surface; 0 to 1. Stich, Friedrich and Dietrich, "Spatial Splits in Bounding Volume Hierarchies", HPG 2009, find
    /// 1e-5 a good compromise.
    pub split_overlap: f64,
    /// Neighbours on either side, along the Morton curve, among which locally ordered clustering looks for the nearest;
    /// 1 to 128. Meister and Bittner, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction",
    /// TVCG 24(3), 2018, find no gain beyond some tens.
    pub cluster_radius: usize,
    /// Rounds of reinsertion; 0 to 1000.
    pub reinsert_rounds: usize,
    /// Grid cells per triangle; above 0, at most 64. Ize, Shirley and Parker, "Grid Creation Strategies for Efficient
    /// Ray Tracing", RT 2007.
    pub grid_density: f64,
    /// No grid has more cells than this; 1 to 2^30.
    pub grid_most_cells: usize,
    /// Cells of the coarse grid of a two-level one, per triangle; above 0, at most 64. This and the next as
    /// Perard-Gayot, Kalojanov and Slusallek, "GPU Ray Tracing using Irregular Grids", CGF 36(2), 2017, have them for
    /// static scenes.
    pub coarse_density: f64,
    /// Cells of the grids in its cells, per triangle in such a cell; above 0, at most 64.
    pub fine_density: f64,
    /// How often an irregular grid's cells are expanded in every direction; 0 to 64. The source finds 3 enough.
    pub expansions: u32,
    /// No more grids stand in one another; 0 to 8.
    pub nesting: usize,
    /// Nodes of a hierarchy that a ray visits for every doubling of the triangles, as foretold before there is one.
    /// This and the next two fit what lines through the bunny, the dragon, Sponza and a soup do, within 15% of the
    /// nodes.
    pub hierarchy_nodes: f64,
    /// Nodes it visits besides for every block it tests.
    pub hierarchy_block_nodes: f64,
    /// Blocks of a hierarchy that a ray tests for every group of triangles it has tested in a grid.
    pub hierarchy_blocks: f64,
    /// Nanoseconds of building a hierarchy, for every triangle and every doubling of their number.
    pub hierarchy_build: f64,
    /// Seed of the sampled hybrids' rays.
    pub seed: u64,
    /// How many rays are to be traced through the finished accelerator; at least 0.
    pub expected_rays: f64,
    /// Rays that a node with the scene's whole volume is sampled with; a node's own number is its share of that
    /// volume, within the next two bounds.
    pub sample_rays: f64,
    /// Fewest rays a node is sampled with; at least 4.
    pub sample_least: u32,
    /// Most rays a node is sampled with.
    pub sample_most: u32,
    /// How sure the sequential hybrid is of a verdict before it stops tracing rays through a node: the chance that more
    /// rays would not turn it; 0.5 to 0.999999.
    pub confidence: f64,
    /// A node is uniform where at least this share of its sample rays hit; 0 to 1. Measured: nodes of dense soups have
    /// 0.93 to 0.97, large nodes of scans (bunny, dragon), halls (Sponza) and hair 0.3 to 0.77. Below 0.8, scans turn
    /// into grids almost wholly, and are traced two to three times slower.
    pub hit_threshold: f64,
    /// A node is uniform where the hits over the strata vary at most this much more than chance alone would make them
    /// (index of dispersion: chi-squared over its degrees of freedom; strata have about eight rays whatever the number
    /// of rays, so that it means the same everywhere). Measured: nodes of soups have 0.8 to 1.4, large nodes of scans
    /// and halls 1.3 to 3.
    pub spread_threshold: f64,
    /// Nodes with fewer triangles never become grids, and are not sampled. Half as many doubles the time of sampling.
    pub grid_least_triangles: usize,
    /// Nodes with more triangles never become grids.
    pub grid_most_triangles: usize,
    /// A node becomes a grid only where that is expected to take less than this share of the time without it; 0 to 1.
    /// Below 1, so that errors of the estimate do not make a tree slower than it was.
    pub grid_gain: f64,
    /// What a traversal costs on this machine.
    pub cost: CostConstants,
}

/// Nanoseconds per unit of work of a single ray, as [`calibrate`](super::calibrate) measures them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CostConstants {
    /// Visiting a wide node.
    pub node_ns: f64,
    /// Testing a block of triangles.
    pub block_ns: f64,
    /// Stepping into a grid cell.
    pub cell_ns: f64,
    /// Gathering and testing up to eight triangles of a grid cell.
    pub gather_ns: f64,
    /// Entering one triangle into one grid cell while building.
    pub reference_ns: f64,
}

impl Default for CostConstants {
    /// As calibrated on one machine; good enough to decide by, since only ratios matter. At these, no grid pays on the
    /// bunny, the dragon, Sponza, hair or soups: streams make a hierarchy's nodes cheap, while rays walk through grids
    /// alone. Measured there: a grid takes 1.4 to 11 times as long to trace.
    fn default() -> Self {
        Self { node_ns: 10.0, block_ns: 10.0, cell_ns: 16.0, gather_ns: 30.0, reference_ns: 90.0 }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self {
            leaf_size: LANES,
            sah_bins: 16,
            split_budget: 1.0,
            split_overlap: 1e-5,
            cluster_radius: 16,
            reinsert_rounds: 16,
            grid_density: 4.0,
            grid_most_cells: 1 << 27,
            coarse_density: 0.12,
            fine_density: 2.4,
            expansions: 3,
            nesting: 2,
            hierarchy_nodes: 0.3,
            hierarchy_block_nodes: 1.3,
            hierarchy_blocks: 0.5,
            hierarchy_build: 25.0,
            seed: 0,
            expected_rays: 1e6,
            sample_rays: 2048.0,
            sample_least: 32,
            sample_most: 1024,
            confidence: 0.95,
            hit_threshold: 0.8,
            spread_threshold: 2.0,
            grid_least_triangles: 256,
            grid_most_triangles: 1 << 16,
            grid_gain: 0.8,
            cost: CostConstants::default(),
        }
    }
}

impl Config {
    /// # Errors
    /// [`Error::Config`] names the first value out of its range.
    pub fn check(&self) -> Result<(), Error> {
        let ranges = [
            ("leaf_size", self.leaf_size as f64, 1.0, LANES as f64),
            ("sah_bins", self.sah_bins as f64, 2.0, MOST_BINS as f64),
            ("split_budget", self.split_budget, 0.0, 8.0),
            ("split_overlap", self.split_overlap, 0.0, 1.0),
            ("cluster_radius", self.cluster_radius as f64, 1.0, 128.0),
            ("reinsert_rounds", self.reinsert_rounds as f64, 0.0, 1000.0),
            ("grid_density", self.grid_density, 1e-3, 64.0),
            ("coarse_density", self.coarse_density, 1e-3, 64.0),
            ("fine_density", self.fine_density, 1e-3, 64.0),
            ("nesting", self.nesting as f64, 0.0, 8.0),
            ("hierarchy_nodes", self.hierarchy_nodes, 0.0, 1e3),
            ("hierarchy_block_nodes", self.hierarchy_block_nodes, 0.0, 1e3),
            ("hierarchy_blocks", self.hierarchy_blocks, 0.0, 1e3),
            ("hierarchy_build", self.hierarchy_build, 0.0, 1e6),
            ("expansions", f64::from(self.expansions), 0.0, 64.0),
            ("grid_most_cells", self.grid_most_cells as f64, 1.0, (1u64 << 30) as f64),
            ("expected_rays", self.expected_rays, 0.0, 1e18),
            ("sample_rays", self.sample_rays, 0.0, 1e9),
            ("sample_least", f64::from(self.sample_least), 4.0, 1e6),
            ("sample_most", f64::from(self.sample_most), f64::from(self.sample_least), 1e6),
            ("confidence", self.confidence, 0.5, 0.999_999),
            ("hit_threshold", self.hit_threshold, 0.0, 1.0),
            ("spread_threshold", self.spread_threshold, 0.0, f64::INFINITY),
            ("grid_least_triangles", self.grid_least_triangles as f64, 1.0, 1e9),
            ("grid_most_triangles", self.grid_most_triangles as f64, 0.0, 1e9),
            ("grid_gain", self.grid_gain, 0.0, 1.0),
            ("node_ns", self.cost.node_ns, 0.0, 1e6),
            ("block_ns", self.cost.block_ns, 0.0, 1e6),
            ("cell_ns", self.cost.cell_ns, 0.0, 1e6),
            ("gather_ns", self.cost.gather_ns, 0.0, 1e6),
            ("reference_ns", self.cost.reference_ns, 0.0, 1e6),
        ];
        let fault = ranges.into_iter().find(|(_, value, least, most)| !(least..=most).contains(&value));
        fault.map_or(Ok(()), |(name, value, least, most)| {
            Err(Error::Config(format!("{name} is {value}; it must be from {least} to {most}")))
        })
    }
}
