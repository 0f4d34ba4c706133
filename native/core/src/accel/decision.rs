//! What hybrids, and others that decide, decided, and on what evidence.

use crate::bounds::Bounds;

/// What becomes of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Verdict {
    /// It divides, and its children are decided on.
    Split = 0,
    /// It becomes a grid.
    Grid = 1,
    /// Its triangles are tested one and all.
    Leaf = 2,
}

/// One node's verdict with all it was based on. Numbers that the method does not use are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// Tight box of the node, in the mesh's own coordinates.
    pub bounds: Bounds,
    /// Depth in the binary tree; the root has 0.
    pub depth: u32,
    /// Triangles in the node.
    pub primitives: u32,
    /// Sample rays traced through it; 0 where it was outside the window of sizes for grids.
    pub rays: u32,
    /// How many of them hit.
    pub hits: u32,
    /// The share of a grid's cells that are empty.
    pub sparseness: f32,
    /// Index of dispersion of the hits over the strata of the box's surface; of a grid that is tested, of the
    /// references over the occupied cells.
    pub spread: f32,
    /// Least share of hits of a uniform node.
    pub hit_threshold: f32,
    /// Greatest spread of a uniform node.
    pub spread_threshold: f32,
    /// Expected nanoseconds of building the node as a grid and tracing the rays to come through it. Where even a grid
    /// that holds nothing but the hits would not pay, none was built, and this is the cost of that one.
    pub cost_grid: f32,
    /// Expected nanoseconds of tracing the rays to come through the node's subtree, which exists already.
    pub cost_bvh: f32,
    /// What it became.
    pub verdict: Verdict,
}

impl Decision {
    /// One without evidence yet.
    pub(super) fn open(bounds: Bounds, depth: u32, primitives: u32, verdict: Verdict) -> Self {
        Self {
            bounds,
            depth,
            primitives,
            rays: 0,
            hits: 0,
            sparseness: f32::NAN,
            spread: f32::NAN,
            hit_threshold: f32::NAN,
            spread_threshold: f32::NAN,
            cost_grid: f32::NAN,
            cost_bvh: f32::NAN,
            verdict,
        }
    }
}
