//! Every place of a structure, level by level: what is there, in which box, how deep.

use glam::Vec3;

use super::{
    lazy::Refined,
    structure::{Grid, Node, NodeRef, Structure, Target},
};
use crate::bounds::Bounds;

/// A branch, leaf or grid within a structure.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// What it is.
    pub target: Target,
    /// Its box, relative to the centre of the domain.
    pub bounds: Bounds,
    /// The lazy cell whose subtree it is in.
    pub lazy: Option<u32>,
    /// The cell of a nest that it is in, if any: what it holds elsewhere is held by other cells, too.
    pub cell: Option<Bounds>,
}

/// The places of all levels, from the root down; each level in the order of its parents. `bounds` is the scene's box,
/// in the mesh's own coordinates.
pub fn levels<'a>(structure: &'a Structure, bounds: &Bounds) -> impl Iterator<Item = Vec<Place>> + use<'a> {
    let centre = structure.domain.centre;
    let bounds = Bounds { lower: bounds.lower - centre, upper: bounds.upper - centre };
    let root = place(structure.root, bounds, None, None).into_iter().collect();
    let below = |level: &Vec<Place>| level.iter().flat_map(|place| children(structure, place)).collect();
    std::iter::successors(Some(root), move |level| Some(below(level)))
        .take_while(|level: &Vec<Place>| !level.is_empty())
}

fn place(reference: NodeRef, bounds: Bounds, lazy: Option<u32>, cell: Option<Bounds>) -> Option<Place> {
    let target = reference.target();
    (target != Target::Empty).then_some(Place { target, bounds, lazy, cell })
}

/// The places right below one; below a lazy cell that has become a subtree, that one's root.
pub fn children<'a>(structure: &'a Structure, place: &Place) -> impl Iterator<Item = Place> + use<'a> {
    let Place { target, bounds, lazy, cell: within } = *place;
    let refined = |cell: u32| structure.lazy.refined(cell as usize);
    let view = lazy.and_then(refined).map_or(structure.view(), Refined::view);
    let (node, root, nest) = match target {
        Target::Branch(index) => (Some(&view.nodes[index as usize]), None, None),
        Target::Lazy(cell) => (None, refined(cell).map(|refined| (refined.root, cell)), None),
        Target::Nest(index) => (None, None, Some(&structure.lattices.nests[index as usize])),
        _ => (None, None, None),
    };
    let below = move |node: &'a Node| {
        (0..node.len()).filter_map(move |lane| self::place(node.child[lane], node.bounds(lane), lazy, within))
    };
    let inside = move |nest: &'a Grid| {
        structure.lattices.children(nest).iter().enumerate().filter_map(move |(cell, &child)| {
            let bounds = nest.cell_bounds(cell);
            self::place(child, bounds, None, Some(bounds))
        })
    };
    let root = root.and_then(|(root, cell)| self::place(root, bounds, Some(cell), within));
    node.into_iter().flat_map(below).chain(root).chain(nest.into_iter().flat_map(inside))
}

impl Node {
    /// The box of a child, relative to the centre of the domain.
    pub fn bounds(&self, lane: usize) -> Bounds {
        let corner = |first: usize| Vec3::from_array(std::array::from_fn(|k| self.plane[first + k][lane]));
        Bounds { lower: corner(0), upper: corner(3) }
    }
}

impl Grid {
    /// The box of a cell, relative to the centre of the domain.
    pub fn cell_bounds(&self, index: usize) -> Bounds {
        let cell = self.cell_at(index);
        Bounds { lower: self.corner(cell), upper: self.corner(cell.map(|plane| plane + 1)) }
    }

    /// Where three planes meet, relative to the centre of the domain.
    pub fn corner(&self, planes: [u32; 3]) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|k| self.lower[k] + planes[k] as f32 * self.cell[k]))
    }

    /// Which cell along each axis has an index.
    pub fn cell_at(&self, index: usize) -> [u32; 3] {
        let [columns, rows, _] = self.resolution.map(|r| r as usize);
        [index % columns, index / columns % rows, index / (columns * rows)].map(|c| c as u32)
    }
}
