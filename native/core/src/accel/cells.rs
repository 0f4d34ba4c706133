//! The boxes of a structure, for drawing.

use glam::Vec3;

use super::{
    content,
    places::{Place, children, levels},
    structure::{Structure, Target},
};
use crate::{Error, bounds::Bounds, error};

/// What a box is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum CellKind {
    /// A branch.
    Branch = 0,
    /// A leaf.
    Leaf = 1,
    /// A whole grid.
    Grid = 2,
    /// One cell of a grid that holds no node.
    GridCell = 3,
    /// The box of one tetrahedron of a grid of those.
    Tetrahedron = 4,
    /// A lazy cell that no ray has reached.
    Lazy = 5,
    /// A lazy cell that has become a subtree.
    Refined = 6,
}

/// Which boxes to list.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CellFilter {
    /// No box below this depth.
    pub max_depth: Option<usize>,
    /// No grid cell without a triangle.
    pub occupied_only: bool,
    /// No more boxes than this; those nearest to the root are kept.
    pub max_count: Option<usize>,
}

/// Boxes by column, from the root down; within a depth first branches, then leaves, grids, lazy cells and
/// grid cells. The root has
/// depth 0, a grid's cells are one deeper than the grid.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cells {
    /// Least corners, in the mesh's own coordinates.
    pub lower: Vec<[f32; 3]>,
    /// Greatest corners.
    pub upper: Vec<[f32; 3]>,
    /// See [`CellKind`].
    pub kind: Vec<CellKind>,
    /// Depth.
    pub depth: Vec<u16>,
    /// References to triangles inside; 0 for an empty cell.
    pub count: Vec<u32>,
    /// Whether [`CellFilter::max_count`] cut the list.
    pub truncated: bool,
}

impl Cells {
    /// List the boxes of a structure over a mesh with these bounds.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn of(structure: &Structure, bounds: &Bounds, filter: &CellFilter) -> Result<Self, Error> {
        let places = structure.nodes.len() + structure.blocks.len() + structure.lazy.places();
        let all = places + content::most_boxes(structure);
        let most = filter.max_count.unwrap_or(usize::MAX);
        let mut list =
            Lister { structure, filter, most, totals: totals(structure), cells: Self::reserve(all.min(most))? };
        let mut above = Vec::new();
        for (depth, level) in levels(structure, bounds).chain([Vec::new()]).enumerate() {
            if filter.max_depth.is_some_and(|deepest| depth > deepest) || !list.level(depth, &above, &level) {
                break;
            }
            above = level;
        }
        Ok(list.cells)
    }

    /// How many boxes there are.
    pub fn len(&self) -> usize {
        self.kind.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.kind.is_empty()
    }

    fn reserve(count: usize) -> Result<Self, Error> {
        const WHAT: &str = "the list of boxes to draw";
        Ok(Self {
            lower: error::reserve(count, WHAT)?,
            upper: error::reserve(count, WHAT)?,
            kind: error::reserve(count, WHAT)?,
            depth: error::reserve(count, WHAT)?,
            count: error::reserve(count, WHAT)?,
            truncated: false,
        })
    }
}

struct Lister<'a> {
    structure: &'a Structure,
    filter: &'a CellFilter,
    most: usize,
    totals: Vec<u32>,
    cells: Cells,
}

impl Lister<'_> {
    /// List a level: its places, then the cells of the grids right above. False once the list is full.
    fn level(&mut self, depth: usize, above: &[Place], level: &[Place]) -> bool {
        for wanted in [CellKind::Branch, CellKind::Leaf, CellKind::Grid, CellKind::Lazy, CellKind::Refined] {
            for place in level {
                let count = self.count(place);
                if kind(self.structure, place.target) == Some(wanted) && !self.push(&place.bounds, wanted, depth, count)
                {
                    return false;
                }
            }
        }
        above.iter().all(|place| self.grid_cells(place.target, depth))
    }

    fn grid_cells(&mut self, target: Target, depth: usize) -> bool {
        let kind = if matches!(target, Target::Tetrahedral(_)) { CellKind::Tetrahedron } else { CellKind::GridCell };
        content::cells(self.structure, target).all(|cell| {
            let skipped = cell.count == 0 && self.filter.occupied_only;
            skipped || self.push(&cell.bounds, kind, depth, cell.count as u32)
        })
    }

    fn count(&self, place: &Place) -> u32 {
        match place {
            Place { lazy: Some(_), target: Target::Branch(_), .. } => {
                children(self.structure, place).map(|child| self.count(&child)).sum()
            }
            _ => references(self.structure, &self.totals, place.target),
        }
    }

    fn push(&mut self, bounds: &Bounds, kind: CellKind, depth: usize, count: u32) -> bool {
        if self.cells.len() == self.most {
            self.cells.truncated = true;
            return false;
        }
        let world = |corner: Vec3| (corner + self.structure.domain.centre).to_array();
        self.cells.lower.push(world(bounds.lower));
        self.cells.upper.push(world(bounds.upper));
        self.cells.kind.push(kind);
        self.cells.depth.push(depth.min(usize::from(u16::MAX)) as u16);
        self.cells.count.push(count);
        true
    }
}

fn kind(structure: &Structure, target: Target) -> Option<CellKind> {
    match target {
        Target::Branch(_) => Some(CellKind::Branch),
        Target::Leaf { .. } => Some(CellKind::Leaf),
        Target::Lazy(cell) if structure.lazy.refined(cell as usize).is_some() => Some(CellKind::Refined),
        Target::Lazy(_) => Some(CellKind::Lazy),
        Target::Empty => None,
        _ => Some(CellKind::Grid),
    }
}

/// References below every wide node. Nodes stand before their children, so one pass from the end finds them.
fn totals(structure: &Structure) -> Vec<u32> {
    let mut totals = vec![0u32; structure.nodes.len()];
    for (index, node) in structure.nodes.iter().enumerate().rev() {
        let children = node.child.iter().map(|child| references(structure, &totals, child.target()));
        totals[index] = children.fold(0, u32::saturating_add);
    }
    totals
}

/// References within a place, given those of the nodes after it.
fn references(structure: &Structure, totals: &[u32], target: Target) -> u32 {
    match target {
        Target::Branch(index) => totals[index as usize],
        Target::Leaf { count, .. } => count,
        Target::Nest(index) => {
            let children = structure.lattices.children(&structure.lattices.nests[index as usize]);
            children.iter().map(|child| references(structure, totals, child.target())).fold(0, u32::saturating_add)
        }
        Target::Lazy(cell) => structure.lazy.triangles(cell as usize).len() as u32,
        _ => content::cells(structure, target).map(|cell| cell.count as u32).fold(0, u32::saturating_add),
    }
}
