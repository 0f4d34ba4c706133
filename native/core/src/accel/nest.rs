//! Grids whose cells are nodes of any kind: how they are made of a grid with lists.

use glam::Vec3;
use rayon::prelude::*;

use super::{
    grid::BuiltGrid,
    structure::MOST_NEST_EDGE,
    tree::{BuiltNest, Item, Kind, Tree, TreeNode},
};
use crate::{Error, Job, Mesh, bounds::Bounds, traverse::frame::Domain};

/// No more items may lie in all cells, each as often as it occurs: references to blocks and nodes are that short.
const MOST_ITEMS: usize = 1 << 27;

/// Cells whose nodes wait to be joined to the tree; enough for every thread to have some.
const PART: usize = 1 << 12;

/// The most cells of a nest, given how many a grid may have.
pub fn limited(resolution: [u32; 3]) -> [u32; 3] {
    resolution.map(|edge| edge.min(MOST_NEST_EDGE))
}

/// Where the cells of a nest are made into nodes.
pub struct Nester<'a> {
    /// The triangles.
    pub mesh: &'a Mesh,
    /// Where the scene is.
    pub domain: &'a Domain,
    /// For cancellation.
    pub job: &'a Job,
}

impl Nester<'_> {
    /// A tree whose root, over the box of `root`, is the nest of a grid; `inside` makes the tree of a cell from its
    /// items, and tells something about it, which is handed on cell by cell.
    ///
    /// An item's box is what of the triangle's box lies in the cell or within the margin of it. That suffices: a walk
    /// that has reached a cell is within that margin of it, and hits elsewhere are found from other cells.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::OutOfMemory`].
    pub fn nest<T: Send>(
        &self,
        built: &BuiltGrid,
        root: TreeNode,
        inside: impl Fn(Vec<Item>) -> Result<(Tree, T), Error> + Sync,
    ) -> Result<(Tree, Vec<T>), Error> {
        let mut tree = Tree { nodes: vec![TreeNode { kind: Kind::Nest(0), ..root }], ..Tree::default() };
        tree.nests.push(BuiltNest { grid: built.grid.clone(), cells: Vec::new() });
        let occupied: Vec<usize> =
            (0..built.grid.cell_count()).filter(|&cell| built.starts[cell] < built.starts[cell + 1]).collect();
        let mut all = Vec::with_capacity(occupied.len());
        for part in occupied.chunks(PART) {
            let made: Vec<(Tree, T)> = part
                .par_iter()
                .map(|&cell| {
                    self.job.check()?;
                    inside(self.items(built, cell))
                })
                .collect::<Result<_, Error>>()?;
            for (&cell, (inside, told)) in part.iter().zip(made) {
                let node = tree.append(inside)?;
                tree.nests[0].cells.push([cell as u32, node]);
                all.push(told);
            }
        }
        Ok((tree, all))
    }

    fn items(&self, built: &BuiltGrid, cell: usize) -> Vec<Item> {
        let around = self.world(&built.grid.cell_bounds(cell).dilated(self.domain.margin()));
        let list = &built.references[built.starts[cell] as usize..built.starts[cell + 1] as usize];
        let item = |&primitive: &u32| {
            let bounds = Bounds::of_points(self.mesh.corners(primitive));
            let (lower, upper) = (bounds.lower.max(around.lower), bounds.upper.min(around.upper));
            // Where rounding has them apart, a box between them.
            Item { bounds: Bounds { lower: lower.min(upper), upper: upper.max(lower) }, primitive }
        };
        list.iter().map(item).collect()
    }

    /// A box relative to the domain's centre in the mesh's own coordinates, rounded outwards.
    fn world(&self, bounds: &Bounds) -> Bounds {
        let (lower, upper) = (bounds.lower + self.domain.centre, bounds.upper + self.domain.centre);
        Bounds {
            lower: Vec3::from_array(lower.to_array().map(f32::next_down)),
            upper: Vec3::from_array(upper.to_array().map(f32::next_up)),
        }
    }
}

impl Tree {
    /// Add another tree behind this one, reached from a cell; returns where its root is.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn append(&mut self, other: Self) -> Result<u32, Error> {
        let (root, items) = (self.nodes.len() as u32, self.items.len() as u32);
        let (grids, nests) = (self.grids.len() as u32, self.nests.len() as u32);
        let total = self.items.len() + other.items.len();
        if total > MOST_ITEMS {
            return Err(Error::OutOfMemory {
                what: "the triangles in cells of cells",
                bytes: total * size_of::<Item>(),
            });
        }
        self.nodes.extend(other.nodes.into_iter().map(|node| {
            let kind = match node.kind {
                Kind::Grid(grid) => Kind::Grid(grid + grids),
                Kind::Nest(nest) => Kind::Nest(nest + nests),
                kind => kind,
            };
            TreeNode { first: node.first + items, kind, ..node }
        }));
        self.nests.extend(other.nests.into_iter().map(|mut nest| {
            nest.cells.iter_mut().for_each(|[_, node]| *node += root);
            nest
        }));
        self.items.extend(other.items);
        self.grids.extend(other.grids);
        Ok(root)
    }
}
