//! Accelerators: one structure of branches, leaves and grids, and the methods that decide which is where.

mod ahead;
pub mod bins;
pub mod calibrate;
pub mod cells;
pub mod census;
pub mod check;
mod check_lattice;
mod check_lazy;
pub mod choice;
pub mod clip;
pub mod clustered;
pub mod clusters;
pub mod collapse;
pub mod config;
pub mod content;
pub mod curve;
pub mod decision;
pub mod divided;
pub mod draft;
mod expand;
pub mod expected;
pub mod fellner;
pub mod forest;
pub mod grid;
pub mod hapala;
pub mod hybrid;
pub mod instant;
pub mod irregular;
pub mod lattice;
mod lattices;
pub mod layout;
pub mod lazy;
pub mod lbvh;
pub mod links;
pub mod median;
pub mod method;
pub mod morton;
pub mod nearest;
pub mod nest;
pub mod overlap;
pub mod pack;
pub mod places;
pub mod planner;
pub mod ploc;
pub mod radix;
pub mod record;
pub mod reinsert;
pub mod sah;
pub mod sample;
pub mod sbvh;
pub mod sequential;
pub mod small;
pub mod spatial;
pub mod structure;
pub mod subtree;
pub mod sweep;
pub mod tetrahedra;
pub mod tree;
pub mod two_level;

use std::{sync::Arc, time::Instant};

pub use self::method::Method;
use self::{
    cells::{CellFilter, Cells},
    census::Census,
    choice::Estimate,
    config::Config,
    decision::Decision,
    grid::BuiltGrid,
    layout::Opening,
    method::{Finish, Hierarchy, Recipe},
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
    choice: Vec<Estimate>,
    level: Level,
}

impl Accelerator {
    /// Build; `threads` 0 means all. The result depends on mesh, method and configuration only.
    ///
    /// # Errors
    /// [`Error::Config`], [`Error::Cancelled`], [`Error::OutOfMemory`].
    pub fn build(mesh: Arc<Mesh>, method: Method, config: &Config, threads: usize, job: &Job) -> Result<Self, Error> {
        config.check()?;
        job.begin(Phase::Build, method.passes() * mesh.solid_count() as u64);
        let mut builder =
            Builder { mesh: &mesh, config, job, phases: Vec::new(), decisions: Vec::new(), choice: Vec::new() };
        let structure = pool::install(threads, || builder.structure(method.recipe()))?;
        let Builder { phases, decisions, choice, .. } = builder;
        Ok(Self { mesh, method, structure, phases, decisions, choice, level: Level::detect() })
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

    /// What a method that decides by evidence decided, from the root down; empty for other methods.
    pub fn decisions(&self) -> &[Decision] {
        &self.decisions
    }

    /// What each builder that a method chose from was expected to cost, the chosen one first; empty for methods that
    /// have no choice.
    pub fn choice(&self) -> &[Estimate] {
        &self.choice
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
    choice: Vec<Estimate>,
}

impl Builder<'_> {
    fn structure(&mut self, recipe: Recipe) -> Result<Structure, Error> {
        let tree = match recipe {
            Recipe::Cheapest => return self.cheapest(),
            Recipe::Hierarchy(hierarchy, Finish::Plain) => self.hierarchy(hierarchy)?,
            Recipe::Hierarchy(hierarchy, Finish::Reinserted) => self.reinserted(hierarchy)?,
            Recipe::Clustered => return self.clustered(),
            Recipe::Linear => return self.linear(),
            Recipe::Grid => self.single_grid()?,
            Recipe::Lattice(lattice) => return self.lattice(lattice),
            Recipe::Hapala => self.grid_or_hierarchy()?,
            Recipe::Fellner => self.fellner()?,
            Recipe::Sampled => self.hybrid(Hierarchy::Median, &hybrid::Sampled)?,
            Recipe::Sequential => self.hybrid(Hierarchy::Median, &sequential::Sequential)?,
        };
        let opening = recipe.opening();
        self.timed("pack", |this| pack::pack_opened(&tree, this.mesh, opening, this.job))
    }

    fn hierarchy(&mut self, hierarchy: Hierarchy) -> Result<Tree, Error> {
        match hierarchy {
            Hierarchy::Median => self.divided(&median::CyclingMedian { job: self.job }),
            Hierarchy::Sah => self.divided(&sah::BinnedSah { bins: self.config.sah_bins, job: self.job }),
            Hierarchy::Spatial => {
                let items = self.timed("bounds", |this| tree::items(this.mesh))?;
                self.timed("split", |this| sbvh::build(items, this.mesh, this.config, this.job))
            }
            Hierarchy::LocallyOrdered => {
                let items = self.timed("bounds", |this| tree::items(this.mesh))?;
                self.timed("cluster", |this| ploc::build(items, &this.mesh.bounds(), this.config, this.job))
            }
        }
    }

    fn reinserted(&mut self, hierarchy: Hierarchy) -> Result<Tree, Error> {
        let tree = self.hierarchy(hierarchy)?;
        let units = self.mesh.solid_count() as u64;
        self.timed("reinsert", |this| reinsert::improve(tree, &this.mesh.bounds(), this.config, this.job, units))
    }

    fn divided(&mut self, split: &impl tree::Split) -> Result<Tree, Error> {
        let items = self.timed("bounds", |this| tree::items(this.mesh))?;
        self.timed("split", |this| tree::build(items, this.config.leaf_size, split, this.job))
    }

    fn clustered(&mut self) -> Result<Structure, Error> {
        let Config { leaf_size, .. } = *self.config;
        let keys = self.timed("sort", |this| morton::sorted(this.mesh, this.job))?;
        let clusters = self.timed("clusters", |this| clusters::Clusters::of(&keys, this.mesh, leaf_size, this.job))?;
        let (top, drafts) = self.timed("split", |this| clustered::plan(&clusters, leaf_size, this.job))?;
        self.timed("write", |this| forest::write(&top, &drafts, this.mesh, this.job))
    }

    fn linear(&mut self) -> Result<Structure, Error> {
        let keys = self.timed("sort", |this| morton::sorted(this.mesh, this.job))?;
        let (top, drafts) = self.timed("split", |this| lbvh::plan(&keys, this.config.leaf_size, this.job))?;
        self.timed("write", |this| forest::write(&top, &drafts, this.mesh, this.job))
    }

    fn cheapest(&mut self) -> Result<Structure, Error> {
        let triangles = self.mesh.solid_count();
        let estimates = choice::estimates(triangles, self.config);
        self.choice = estimates.to_vec();
        let builder = estimates[0].builder;
        // Progress was promised for the builder that goes through all triangles most often.
        self.job.advance(builder.passes_saved() * triangles as u64);
        match builder {
            choice::Builder::Lazy => self.timed("cells", |this| instant::build(this.mesh, this.job)),
            choice::Builder::Linear => self.linear(),
            choice::Builder::Clustered => self.clustered(),
            choice::Builder::Complete => {
                let tree = self.hybrid(Hierarchy::Sah, &expected::ExpectedCost)?;
                self.timed("pack", |this| pack::pack_opened(&tree, this.mesh, Opening::Cheapest, this.job))
            }
        }
    }

    fn hybrid(&mut self, hierarchy: Hierarchy, judge: &impl hybrid::Judge) -> Result<Tree, Error> {
        let tree = self.hierarchy(hierarchy)?;
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
        Ok(Tree { nodes: vec![root], items, grids: vec![grid], ..Tree::default() })
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
