//! How the grids of other kinds are built, and hybrids with them, phase by phase.

use super::{
    Builder,
    decision::Verdict,
    fellner::Fellner,
    hapala, irregular,
    method::Lattice,
    pack,
    sah::BinnedSah,
    structure::Structure,
    tetrahedra,
    tree::{self, Kind, Tree, TreeNode},
    two_level,
};
use crate::{Error, traverse::frame::Domain};

impl Builder<'_> {
    /// One grid over everything.
    pub(super) fn lattice(&mut self, lattice: Lattice) -> Result<Structure, Error> {
        let items = self.timed("bounds", |this| tree::items(this.mesh))?;
        if items.is_empty() {
            return pack::pack(&Tree::default(), self.mesh, self.job);
        }
        match lattice {
            Lattice::TwoLevel => {
                let tree = self.timed("grid", |this| two_level::build(this.mesh, &items, this.config, this.job))?;
                self.timed("pack", |this| pack::pack(&tree, this.mesh, this.job))
            }
            Lattice::Irregular => self.timed("grid", |this| irregular::build(this.mesh, &items, this.config, this.job)),
            Lattice::Tetrahedral => {
                self.timed("grid", |this| tetrahedra::build(this.mesh, &items, this.config, this.job))
            }
        }
    }

    /// One grid, or a hierarchy where a test of the grid finds that worth while.
    pub(super) fn grid_or_hierarchy(&mut self) -> Result<Tree, Error> {
        let items = self.timed("bounds", |this| tree::items(this.mesh))?;
        if items.is_empty() {
            return Ok(Tree::default());
        }
        let grid = self.timed("grid", |this| this.grid(&items))?;
        let (grid, decision) = self.timed("test", |this| hapala::judge(grid, this.mesh, this.config))?;
        self.decisions = vec![decision];
        if decision.verdict == Verdict::Grid {
            self.job.advance(items.len() as u64);
            let count = items.len() as u32;
            let root = TreeNode { bounds: self.mesh.bounds(), first: 0, count, kind: Kind::Grid(0) };
            return Ok(Tree { nodes: vec![root], items, grids: vec![grid], ..Tree::default() });
        }
        drop(grid);
        let split = BinnedSah { bins: self.config.sah_bins, job: self.job };
        self.timed("split", |this| tree::build(items, this.config.leaf_size, &split, this.job))
    }

    /// Hierarchies in grids in hierarchies.
    pub(super) fn fellner(&mut self) -> Result<Tree, Error> {
        let items = self.timed("bounds", |this| tree::items(this.mesh))?;
        let domain = Domain::new(&self.mesh.bounds());
        let (tree, decisions) = self.timed("verdicts", |this| {
            Fellner { mesh: this.mesh, domain, config: this.config, job: this.job }.build(items)
        })?;
        self.decisions = decisions;
        Ok(tree)
    }
}
