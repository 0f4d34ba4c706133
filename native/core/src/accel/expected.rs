//! The hybrid by expected cost: a node becomes a grid where building one and tracing the rays to come through it is
//! expected to take less time than tracing them through the node's subtree, which exists already.
//!
//! Both are measured with the node's sample rays, in steps and tests; [`CostConstants`] tell what these take.

use glam::Vec3;

use super::{
    config::CostConstants,
    decision::Decision,
    grid::BuiltGrid,
    hybrid::{Inquiry, Judge},
    sample::Samples,
    structure::{NodeRef, Structure},
    subtree::{self, Walker, Work},
};
use crate::{
    Error, Mesh,
    bounds::Bounds,
    ray::{Hit, MISS},
    simd::Level,
    traverse::{
        Tracer,
        frame::{Domain, Frame},
        probe::Probe,
    },
};

/// Decides by expected cost.
#[derive(Debug, Clone, Copy)]
pub struct ExpectedCost;

impl Judge for ExpectedCost {
    fn judge(&self, inquiry: &Inquiry<'_>, index: usize, decision: &mut Decision) -> Result<Option<BuiltGrid>, Error> {
        let cost = &inquiry.config.cost;
        let samples = inquiry.samples(index);
        let frames = inquiry.frames(&samples)?;
        let mut walker = Walker::new(inquiry.tree, inquiry.mesh, &inquiry.domain);
        let hits: Vec<Hit> = frames.iter().map(|frame| walker.trace::<false>(index, frame)).collect();
        decision.observe(&samples.evidence(|ray| hits[ray].primitive != MISS));
        // How often each sample ray stands for a ray to come.
        let weight = inquiry.rays_to_come(index) / frames.len() as f64;
        let bvh = weight * walker.work.nanoseconds(cost);
        let worthwhile = bvh * inquiry.config.grid_gain;
        let least = weight * inquiry.least_walks(index, &frames, &hits).nanoseconds(cost);
        (decision.cost_bvh, decision.cost_grid) = (bvh as f32, least as f32);
        if least >= worthwhile {
            return Ok(None);
        }
        let (grid, walks) = counted(inquiry.grid(index)?, inquiry, &samples)?;
        let build = cost.reference_ns * grid.references.len() as f64;
        let cost_grid = weight * walks.nanoseconds(cost) + build;
        decision.cost_grid = cost_grid as f32;
        Ok((cost_grid < worthwhile).then_some(grid))
    }
}

impl Inquiry<'_> {
    /// Rays that will meet a node's box, of all that will meet the scene's: by the ratio of their areas.
    fn rays_to_come(&self, index: usize) -> f64 {
        let area = |bounds: &Bounds| {
            let [x, y, z] = bounds.extent().as_dvec3().to_array();
            x * y + y * z + z * x
        };
        let share = area(&self.tree.nodes[index].bounds) / area(&self.mesh.bounds()).max(f64::MIN_POSITIVE);
        self.config.expected_rays * share.min(1.0)
    }

    /// What rays would cost in a grid whose cells hold nothing but the hits: no real grid over the node is cheaper.
    fn least_walks(&self, index: usize, frames: &[Frame], hits: &[Hit]) -> Walks {
        let node = &self.tree.nodes[index];
        let resolution = self.resolution(index);
        let cells = Vec3::from_array(resolution.map(|count| count as f32));
        let extent = node.bounds.extent().max(Vec3::splat(self.domain.margin()));
        let lower = node.bounds.lower - self.domain.centre;
        let walks = frames.iter().zip(hits).filter_map(|(frame, hit)| {
            let limit = if hit.primitive == MISS { frame.tmax } else { hit.t };
            let ends = subtree::cross(&node.bounds, self.domain.centre, frame, limit)?;
            let [from, to] = ends.map(|t| {
                let position = Vec3::from_array(frame.local) + Vec3::from_array(frame.direction) * t;
                ((position - lower) / extent * cells).floor().clamp(Vec3::ZERO, cells - 1.0)
            });
            let steps = 1 + (to - from).abs().element_sum() as u64;
            Some(Walks { grids: 1, cells: steps, groups: u64::from(hit.primitive != MISS) })
        });
        walks.fold(Walks::default(), Walks::plus)
    }
}

impl Work {
    /// How long it takes.
    pub fn nanoseconds(&self, cost: &CostConstants) -> f64 {
        self.nodes() * cost.node_ns + self.blocks as f64 * cost.block_ns
    }
}

/// What a walk through a grid does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Walks {
    /// Grids entered, which takes about as long as a wide node.
    pub grids: u64,
    /// Cells stepped into.
    pub cells: u64,
    /// Groups of up to eight triangles gathered and tested.
    pub groups: u64,
}

impl Walks {
    /// How long it takes.
    pub fn nanoseconds(&self, cost: &CostConstants) -> f64 {
        self.grids as f64 * cost.node_ns + self.cells as f64 * cost.cell_ns + self.groups as f64 * cost.gather_ns
    }

    fn plus(self, other: Self) -> Self {
        Self { grids: self.grids + other.grids, cells: self.cells + other.cells, groups: self.groups + other.groups }
    }
}

impl Probe for Walks {
    fn step(&mut self) {
        self.cells += 1;
    }
    fn tests(&mut self, _count: u32) {
        self.groups += 1;
    }
}

/// What sample rays do in a grid, by a walk through the real one.
fn counted(grid: BuiltGrid, inquiry: &Inquiry<'_>, samples: &Samples) -> Result<(BuiltGrid, Walks), Error> {
    let structure = alone(grid, inquiry.domain);
    let walks = walks(&structure, inquiry.mesh, samples)?;
    let Structure { mut grids, starts, references, .. } = structure;
    let grid = grids.swap_remove(0);
    Ok((BuiltGrid { grid, starts, references }, walks))
}

/// A structure of one grid.
pub fn alone(grid: BuiltGrid, domain: Domain) -> Structure {
    let BuiltGrid { grid, starts, references } = grid;
    Structure { grids: vec![grid], starts, references, ..Structure::of(NodeRef::grid(0), domain) }
}

/// What sample rays do in a structure of one grid. Counts are the same on every instruction set.
///
/// # Errors
/// None; the signature is that of the rays' own checks, which samples pass.
pub fn walks(structure: &Structure, mesh: &Mesh, samples: &Samples) -> Result<Walks, Error> {
    let mut walks = vec![Walks::default(); samples.len()];
    Tracer { structure, mesh, level: Level::detect() }.probed(&samples.rays()?, &mut walks)?;
    let entered = |walk: Walks| Walks { grids: u64::from(walk.cells > 0), ..walk };
    Ok(walks.into_iter().map(entered).fold(Walks::default(), Walks::plus))
}
