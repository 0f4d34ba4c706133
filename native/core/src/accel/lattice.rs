//! Grids of other kinds than the uniform one with a list a cell: data only.

use super::structure::{Grid, NodeRef};

/// Tetrahedra that a box is divided into.
pub const TETRAHEDRA: usize = 6;

/// The tetrahedra of the unit cube by the descending order of coordinates in each: number `2 first + (second > third)`.
pub const ORDERS: [[usize; 3]; TETRAHEDRA] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// All of them. Each is a [`Grid`] in shape; what its `first` counts depends on the kind.
#[derive(Debug, Default)]
pub struct Lattices {
    /// Grids whose cells are nodes: that of cell `i` is `children[first + i]`.
    pub nests: Vec<Grid>,
    /// What the cells of all nests hold.
    pub children: Vec<NodeRef>,
    /// Grids of boxes, each of six tetrahedra: that of order `s` in [`ORDERS`] in box `i` is cell `6 i + s` in
    /// [`Structure::cell`](super::structure::Structure::cell).
    pub tetrahedral: Vec<Grid>,
    /// Grids of merged cells: voxel `i` belongs to cell `voxels[first + i]` of `merged`.
    pub irregular: Vec<Grid>,
    /// Which cell the voxels of all irregular grids belong to.
    pub voxels: Vec<u32>,
    /// The cells of all irregular grids.
    pub merged: Vec<MergedCell>,
}

/// A cell of an irregular grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct MergedCell {
    /// First voxels, along each axis, of the box that a ray may cross before it looks for another cell: the cell's own,
    /// or a larger one, in which there is nothing that the cell does not list.
    pub lower: [u16; 3],
    /// One behind its last voxels.
    pub upper: [u16; 3],
    /// Where its triangles begin in [`Structure::references`](super::structure::Structure::references).
    pub start: u32,
    /// Where they end.
    pub end: u32,
}

impl Lattices {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.nests.is_empty() && self.tetrahedral.is_empty() && self.irregular.is_empty()
    }

    /// The nodes in the cells of a nest.
    pub fn children(&self, nest: &Grid) -> &[NodeRef] {
        &self.children[nest.first..nest.first + nest.cell_count()]
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        [&self.nests, &self.tetrahedral, &self.irregular].map(|grids| size_of_val(&**grids)).iter().sum::<usize>()
            + size_of_val(&*self.children)
            + size_of_val(&*self.voxels)
            + size_of_val(&*self.merged)
    }
}
