//! What a structure consists of, in numbers.

use super::{
    config::CostConstants,
    content,
    places::{self, Place, levels},
    structure::{Structure, Target},
};
use crate::{bounds::Bounds, triangle::LANES};

/// Counts and sizes of a structure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Census {
    /// Wide branch nodes.
    pub nodes: usize,
    /// Leaves: blocks of up to eight triangles.
    pub leaves: usize,
    /// Grids of all kinds.
    pub grids: usize,
    /// Cells of all grids but those that hold a node.
    pub cells: usize,
    /// Cells without a triangle.
    pub empty_cells: usize,
    /// Cells that become subtrees when a ray reaches them.
    pub lazy_cells: usize,
    /// How many of them have. Their nodes, leaves and references are among the others.
    pub refined_cells: usize,
    /// Triangles in leaves, grid cells and lazy cells, each as often as it occurs.
    pub references: usize,
    /// Bytes held, without the mesh.
    pub bytes: usize,
    /// Depth of the deepest leaf or grid; the root has depth 0.
    pub max_depth: usize,
    /// Branches, leaves and grids at every depth.
    pub depth_histogram: Vec<usize>,
    /// What a line that meets the scene's box costs when it is followed to its end, by the surface area heuristic, in
    /// visits of a wide node: see [`sah_cost`].
    pub sah_cost: f64,
}

impl Census {
    /// Count a structure over a mesh with these bounds.
    pub fn of(structure: &Structure, bounds: &Bounds) -> Self {
        let mut census = Self { bytes: structure.bytes(), ..Self::default() };
        for level in levels(structure, bounds) {
            census.depth_histogram.push(level.len());
            level.iter().for_each(|place| census.add(structure, place.target));
        }
        census.max_depth = census.depth_histogram.len().saturating_sub(1);
        census.sah_cost = sah_cost(structure, bounds);
        census
    }

    fn add(&mut self, structure: &Structure, target: Target) {
        match target {
            Target::Branch(_) => self.nodes += 1,
            Target::Leaf { count, .. } => {
                self.leaves += 1;
                self.references += count as usize;
            }
            Target::Lazy(cell) => self.add_lazy(structure, cell as usize),
            Target::Empty => {}
            _ => self.add_grid(structure, target),
        }
    }

    fn add_lazy(&mut self, structure: &Structure, cell: usize) {
        self.lazy_cells += 1;
        match structure.lazy.refined(cell) {
            Some(_) => self.refined_cells += 1,
            None => self.references += structure.lazy.triangles(cell).len(),
        }
    }

    fn add_grid(&mut self, structure: &Structure, grid: Target) {
        self.grids += 1;
        for cell in content::cells(structure, grid) {
            self.cells += 1;
            self.empty_cells += usize::from(cell.count == 0);
            self.references += cell.count;
        }
    }
}

/// The surface area heuristic of MacDonald and Booth, "Heuristics for Ray Tracing using Space Subdivision", The Visual
/// Computer 6(3), 1990: a line that meets the scene's box meets a convex box inside with the ratio of their areas as
/// probability. A wide node counts 1; blocks, cell steps and gathered groups count as [`CostConstants::default`]
/// relates them to it, on every machine, so that numbers compare.
pub fn sah_cost(structure: &Structure, bounds: &Bounds) -> f64 {
    let scene = half_area(bounds);
    // A lazy cell counts the same before and after a ray has reached it.
    let places = levels(structure, bounds).flatten().filter(|place| place.lazy.is_none());
    let total: f64 = places.map(|place| half_area(&place.bounds) * work(structure, &place)).sum();
    total / scene.max(f64::MIN_POSITIVE)
}

fn half_area(bounds: &Bounds) -> f64 {
    let [x, y, z] = bounds.extent().as_dvec3().to_array();
    x * y + y * z + z * x
}

/// The share of a lazy cell's blocks that a line through it meets, whether it has become a subtree or not.
const LAZY_BLOCKS: f64 = 0.5;

/// What meeting a place costs, apart from what lies below it.
fn work(structure: &Structure, place: &Place) -> f64 {
    let cost = CostConstants::default();
    match place.target {
        Target::Branch(_) => 1.0,
        Target::Leaf { .. } => cost.block_ns / cost.node_ns,
        Target::Lazy(cell) => {
            let blocks = structure.lazy.triangles(cell as usize).len().div_ceil(LANES);
            1.0 + LAZY_BLOCKS * blocks as f64 * cost.block_ns / cost.node_ns
        }
        Target::Empty => 0.0,
        _ => {
            let walked = content::cells(structure, place.target).map(|cell| {
                let groups = cell.count.div_ceil(LANES) as f64;
                half_area(&cell.bounds) * (cost.cell_ns + groups * cost.gather_ns)
            });
            let occupied = places::children(structure, place).map(|cell| half_area(&cell.bounds) * cost.cell_ns);
            walked.chain(occupied).sum::<f64>() / half_area(&place.bounds).max(f64::MIN_POSITIVE) / cost.node_ns
        }
    }
}
