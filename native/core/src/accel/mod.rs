//! Accelerators: one structure of branches, leaves and grids, and the methods that decide which is where.

pub mod bins;
pub mod calibrate;
pub mod cells;
pub mod census;
pub mod check;
pub mod config;
pub mod decision;
pub mod draft;
pub mod expected;
pub mod grid;
pub mod hybrid;
pub mod median;
pub mod overlap;
pub mod pack;
pub mod places;
pub mod planner;
pub mod record;
pub mod sah;
pub mod sample;
pub mod small;
pub mod structure;
pub mod subtree;
pub mod tree;

use std::{sync::Arc, time::Instant};

use self::{
    cells::{CellFilter, Cells},
    census::Census,
    config::Config,
    decision::Decision,
    grid::BuiltGrid,
    structure::Structure,
    tree::{Kind, Tree, TreeNode},
};
use crate::{
    Error, Job, Mesh,
    job::Phase,
    pool,
    ray::{HitsMut, Rays},
    simd::Level,
    traverse::{Tracer, frame::Domain, probe::Counts},
};

/// How a tree is decided on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// Median splits along cycling axes: the paper's benchmark.
    BvhMedian,
    /// Binned surface area heuristic.
    BvhSah,
    /// One uniform grid.
    Grid,
    /// The paper's hybrid: sampled rays decide which nodes become grids.
    HybridSampled,
    /// The same tree and samples, decided by expected cost.
    HybridCost,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::BvhMedian, Self::BvhSah, Self::Grid, Self::HybridSampled, Self::HybridCost];

    /// Its name, as users write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::BvhMedian => "bvh-median",
            Self::BvhSah => "bvh-sah",
            Self::Grid => "grid",
            Self::HybridSampled => "hybrid-sampled",
            Self::HybridCost => "hybrid-cost",
        }
    }

    /// How often a build goes through all triangles: to divide them, to judge them, to pack them.
    fn passes(self) -> u64 {
        match self {
            Self::BvhMedian | Self::BvhSah | Self::Grid => 2,
            Self::HybridSampled | Self::HybridCost => 3,
        }
    }

    /// The method of that name.
    ///
    /// # Errors
    /// [`Error::Config`] lists the names there are.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|method| method.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::Config(format!("there is no method '{name}'; choose one of: {names}"))
        })
    }
}

/// Milliseconds of one phase of a build.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseTime {
    /// What was done.
    pub name: &'static str,
    /// How long it took.
    pub milliseconds: f64,
}

/// A mesh with a structure that rays walk.
#[derive(Debug)]
pub struct Accelerator {
    mesh: Arc<Mesh>,
    method: Method,
    structure: Structure,
    phases: Vec<PhaseTime>,
    decisions: Vec<Decision>,
    level: Level,
}

impl Accelerator {
    /// Build; `threads` 0 means all. The result depends on mesh, method and configuration only.
    ///
    /// # Errors
    /// [`Error::Config`], [`Error::Cancelled`], [`Error::OutOfMemory`].
    pub fn build(mesh: Arc<Mesh>, method: Method, config: &Config, threads: usize, job: &Job) -> Result<Self, Error> {
        config.check()?;
        job.begin(Phase::Build, method.passes() * mesh.solid().len() as u64);
        let mut builder = Builder { mesh: &mesh, config, job, phases: Vec::new(), decisions: Vec::new() };
        let structure = pool::install(threads, || builder.structure(method))??;
        let Builder { phases, decisions, .. } = builder;
        Ok(Self { mesh, method, structure, phases, decisions, level: Level::detect() })
    }

    /// The same accelerator, walked with another instruction set.
    pub fn with_level(self, level: Level) -> Self {
        Self { level, ..self }
    }

    /// What it was built over.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// How it was built.
    pub fn method(&self) -> Method {
        self.method
    }

    /// What rays walk.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// How long each phase of the build took.
    pub fn phases(&self) -> &[PhaseTime] {
        &self.phases
    }

    /// What a hybrid decided on, from the root down; empty for other methods.
    pub fn decisions(&self) -> &[Decision] {
        &self.decisions
    }

    /// What the structure consists of.
    pub fn census(&self) -> Census {
        Census::of(&self.structure, &self.mesh.bounds())
    }

    /// The boxes of the structure, for drawing.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn cells(&self, filter: &CellFilter) -> Result<Cells, Error> {
        Cells::of(&self.structure, &self.mesh.bounds(), filter)
    }

    /// For queries on the calling thread; the ones below are for whole batches.
    pub fn tracer(&self) -> Tracer<'_> {
        Tracer { structure: &self.structure, mesh: &self.mesh, level: self.level }
    }

    /// The closest hit of every ray; `threads` 0 means all.
    ///
    /// # Errors
    /// [`Error::Ray`], [`Error::Cancelled`].
    pub fn closest(&self, rays: &Rays<'_>, hits: HitsMut<'_>, threads: usize, job: &Job) -> Result<(), Error> {
        self.tracer().closest_parallel(rays, hits, threads, job)
    }

    /// Whether anything lies in the interval of every ray; `threads` 0 means all.
    ///
    /// # Errors
    /// [`Error::Ray`], [`Error::Cancelled`].
    pub fn occluded(&self, rays: &Rays<'_>, out: &mut [bool], threads: usize, job: &Job) -> Result<(), Error> {
        self.tracer().occluded_parallel(rays, out, threads, job)
    }

    /// Steps and tests of the closest-hit query of every ray; `threads` 0 means all.
    ///
    /// # Errors
    /// [`Error::Ray`], [`Error::Cancelled`].
    pub fn counted(&self, rays: &Rays<'_>, out: &mut [Counts], threads: usize, job: &Job) -> Result<(), Error> {
        self.tracer().counted_parallel(rays, out, threads, job)
    }
}

struct Builder<'a> {
    mesh: &'a Mesh,
    config: &'a Config,
    job: &'a Job,
    phases: Vec<PhaseTime>,
    decisions: Vec<Decision>,
}

impl Builder<'_> {
    fn structure(&mut self, method: Method) -> Result<Structure, Error> {
        let tree = match method {
            Method::BvhSah => self.hierarchy(&sah::BinnedSah { bins: self.config.sah_bins, job: self.job })?,
            Method::Grid => self.single_grid()?,
            Method::BvhMedian => self.hierarchy(&median::CyclingMedian { job: self.job })?,
            Method::HybridSampled => self.hybrid(&hybrid::Sampled)?,
            Method::HybridCost => self.hybrid(&expected::ExpectedCost)?,
        };
        self.timed("pack", |this| pack::pack(&tree, this.mesh, this.job))
    }

    fn hierarchy(&mut self, split: &impl tree::Split) -> Result<Tree, Error> {
        let items = self.timed("bounds", |this| tree::items(this.mesh))?;
        self.timed("split", |this| tree::build(items, this.config.leaf_size, split, this.job))
    }

    fn hybrid(&mut self, judge: &impl hybrid::Judge) -> Result<Tree, Error> {
        let tree = self.hierarchy(&median::CyclingMedian { job: self.job })?;
        let (tree, decisions) =
            self.timed("verdicts", |this| hybrid::decide(tree, this.mesh, this.config, judge, this.job))?;
        self.decisions = decisions;
        Ok(tree)
    }

    fn single_grid(&mut self) -> Result<Tree, Error> {
        let items = self.timed("bounds", |this| tree::items(this.mesh))?;
        if items.is_empty() {
            return Ok(Tree::default());
        }
        let grid = self.timed("grid", |this| this.grid(&items))?;
        let root = TreeNode { bounds: self.mesh.bounds(), first: 0, count: items.len() as u32, kind: Kind::Grid(0) };
        Ok(Tree { nodes: vec![root], items, grids: vec![grid] })
    }

    fn grid(&self, items: &[tree::Item]) -> Result<BuiltGrid, Error> {
        let bounds = self.mesh.bounds();
        let Config { grid_density, grid_most_cells, .. } = *self.config;
        let resolution = grid::resolution(&bounds, items.len(), grid_density, grid_most_cells);
        grid::build(self.mesh, &Domain::new(&bounds), &bounds, items, resolution, self.job, 1)
    }

    fn timed<T>(&mut self, name: &'static str, work: impl FnOnce(&mut Self) -> Result<T, Error>) -> Result<T, Error> {
        let start = Instant::now();
        let result = work(self);
        self.phases.push(PhaseTime { name, milliseconds: start.elapsed().as_secs_f64() * 1e3 });
        result
    }
}
