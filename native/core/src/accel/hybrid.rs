//! Hybrids of hierarchy and grids: a pass of verdicts over a complete median tree, from the root down. A node that
//! becomes a grid takes the place of everything below it; all others stay as they are.
//!
//! After Zhang and Chiu, "Building a Hybrid Approach to Space Division for Faster Raytracing".

use super::{
    config::Config,
    decision::{Decision, Verdict},
    grid::{self, BuiltGrid},
    sample::{self, Evidence, Samples},
    subtree::Walker,
    tree::{Kind, Tree, TreeNode},
};
use crate::{
    Error, Job, Mesh,
    ray::MISS,
    traverse::frame::{Domain, Frame},
};

/// Everything a verdict may depend on.
pub struct Inquiry<'a> {
    /// The complete tree.
    pub tree: &'a Tree,
    /// Its triangles.
    pub mesh: &'a Mesh,
    /// Where the scene is.
    pub domain: Domain,
    /// Thresholds and constants.
    pub config: &'a Config,
    /// For cancellation and progress.
    pub job: &'a Job,
}

/// Decides whether a node becomes a grid.
pub trait Judge: Sync {
    /// Complete the evidence in `decision`, whose box, depth and size are filled in, and build the grid where the node
    /// becomes one. Must depend on nothing but its arguments.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::OutOfMemory`].
    fn judge(&self, inquiry: &Inquiry<'_>, index: usize, decision: &mut Decision) -> Result<Option<BuiltGrid>, Error>;
}

/// Verdicts on a subtree, in preorder.
#[derive(Default)]
struct Verdicts {
    decisions: Vec<Decision>,
    /// Nodes that become grids.
    grids: Vec<(usize, BuiltGrid)>,
}

/// Turn nodes of a complete tree into grids where the judge finds so, and tell why; nodes of fewer than
/// `grid_least_triangles` are passed over, except the root.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn decide(
    mut tree: Tree,
    mesh: &Mesh,
    config: &Config,
    judge: &impl Judge,
    job: &Job,
) -> Result<(Tree, Vec<Decision>), Error> {
    if tree.nodes.is_empty() {
        return Ok((tree, Vec::new()));
    }
    let inquiry = Inquiry { tree: &tree, mesh, domain: Domain::new(&mesh.bounds()), config, job };
    let Verdicts { decisions, grids } = inquiry.verdicts(judge, 0, 0)?;
    for (index, grid) in grids {
        tree.nodes[index].kind = Kind::Grid(tree.grids.len() as u32);
        tree.grids.push(grid);
    }
    Ok((tree, decisions))
}

impl Inquiry<'_> {
    fn verdicts(&self, judge: &impl Judge, index: usize, depth: u32) -> Result<Verdicts, Error> {
        self.job.check()?;
        let node = &self.tree.nodes[index];
        let mut verdicts = Verdicts::default();
        if depth > 0 && (node.count as usize) < self.config.grid_least_triangles {
            self.job.advance(u64::from(node.count));
            return Ok(verdicts);
        }
        let mut decision = self.undecided(index, depth);
        if let Some(grid) = self.window(node).then(|| judge.judge(self, index, &mut decision)).transpose()?.flatten() {
            decision.verdict = Verdict::Grid;
            verdicts.grids.push((index, grid));
        }
        verdicts.decisions.push(decision);
        match self.tree.children(index) {
            Some([left, right]) if decision.verdict == Verdict::Split => {
                let below = |child| self.verdicts(judge, child, depth + 1);
                let (left, right) = rayon::join(|| below(left), || below(right));
                verdicts.append(left?);
                verdicts.append(right?);
            }
            _ => self.job.advance(u64::from(node.count)),
        }
        Ok(verdicts)
    }

    /// Whether a node is neither too small nor too large for a grid.
    fn window(&self, node: &TreeNode) -> bool {
        let Config { grid_least_triangles, grid_most_triangles, .. } = *self.config;
        (grid_least_triangles..=grid_most_triangles).contains(&(node.count as usize))
    }

    fn undecided(&self, index: usize, depth: u32) -> Decision {
        let node = &self.tree.nodes[index];
        let verdict = if node.kind == Kind::Leaf { Verdict::Leaf } else { Verdict::Split };
        Decision::open(node.bounds, depth, node.count, verdict)
    }

    /// The node's sample rays.
    pub fn samples(&self, index: usize) -> Samples {
        let bounds = &self.tree.nodes[index].bounds;
        let count = sample::ray_count(bounds, &self.mesh.bounds(), self.config);
        Samples::new(bounds, count, self.config.seed, index)
    }

    /// The frames of sample rays.
    ///
    /// # Errors
    /// None; the signature is that of the rays' own checks, which samples pass.
    pub fn frames(&self, samples: &Samples) -> Result<Vec<Frame>, Error> {
        let rays = samples.rays()?;
        (0..rays.len()).map(|ray| rays.frame(ray, &self.domain)).collect()
    }

    /// The cells of the grid that the node would become.
    pub fn resolution(&self, index: usize) -> [u32; 3] {
        let node = &self.tree.nodes[index];
        let Config { grid_density, grid_most_cells, .. } = *self.config;
        grid::resolution(&node.bounds, node.count as usize, grid_density, grid_most_cells)
    }

    /// The grid that the node would become.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::OutOfMemory`].
    pub fn grid(&self, index: usize) -> Result<BuiltGrid, Error> {
        let node = &self.tree.nodes[index];
        let items = self.tree.items_of(node);
        grid::build(self.mesh, &self.domain, &node.bounds, items, self.resolution(index), self.job, 0)
    }
}

impl Verdicts {
    fn append(&mut self, mut other: Self) {
        self.decisions.append(&mut other.decisions);
        self.grids.append(&mut other.grids);
    }
}

/// The paper's rule: a node whose sample rays hit often and evenly is uniform and becomes a grid.
#[derive(Debug, Clone, Copy)]
pub struct Sampled;

impl Judge for Sampled {
    fn judge(&self, inquiry: &Inquiry<'_>, index: usize, decision: &mut Decision) -> Result<Option<BuiltGrid>, Error> {
        let samples = inquiry.samples(index);
        let mut walker = Walker::new(inquiry.tree, inquiry.mesh, &inquiry.domain);
        let frames = inquiry.frames(&samples)?;
        let hits: Vec<bool> = frames.iter().map(|frame| walker.trace::<true>(index, frame).primitive != MISS).collect();
        inquiry.by_evidence(index, &samples.evidence(|ray| hits[ray]), decision)
    }
}

impl Inquiry<'_> {
    /// The grid that the node becomes where its sample rays hit often and evenly.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::OutOfMemory`].
    pub fn by_evidence(
        &self,
        index: usize,
        evidence: &Evidence,
        decision: &mut Decision,
    ) -> Result<Option<BuiltGrid>, Error> {
        let Config { hit_threshold, spread_threshold, .. } = *self.config;
        decision.observe(evidence);
        decision.hit_threshold = hit_threshold as f32;
        decision.spread_threshold = spread_threshold as f32;
        let is_uniform = evidence.share() >= hit_threshold && evidence.spread <= spread_threshold;
        is_uniform.then(|| self.grid(index)).transpose()
    }
}

impl Decision {
    /// Keep what the sample rays told.
    pub(super) fn observe(&mut self, evidence: &Evidence) {
        self.rays = evidence.rays as u32;
        self.hits = evidence.hits as u32;
        self.spread = evidence.spread as f32;
    }
}
