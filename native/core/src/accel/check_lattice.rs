//! What grids of the other kinds must satisfy.

use glam::{DVec3, Vec3};

use super::{
    check, irregular,
    lattice::{ORDERS, TETRAHEDRA},
    places::Place,
    structure::{Grid, MOST_NEST_EDGE, NodeRef, Structure, Target},
};
use crate::{Mesh, bounds::Bounds};

/// The distinct triangles of a nest; every cell's node holds what overlaps the cell.
pub fn assert_nest(structure: &Structure, mesh: &Mesh, nest: &Grid) -> Vec<u32> {
    check::assert_shape(nest);
    assert!(nest.resolution.iter().all(|&edge| edge <= MOST_NEST_EDGE), "{nest:?}");
    let children = structure.lattices.children(nest);
    let lists: Vec<Vec<u32>> = children.iter().map(|&child| held(structure, child)).collect();
    let primitives = distinct(lists.concat());
    if children.len() * primitives.len() <= check::BRUTE_FORCE {
        for (cell, list) in lists.iter().enumerate() {
            check::assert_lists(structure, mesh, &nest.cell_bounds(cell), list, &primitives);
        }
    }
    primitives
}

fn distinct(mut primitives: Vec<u32>) -> Vec<u32> {
    primitives.sort_unstable();
    primitives.dedup();
    primitives
}

/// The distinct triangles below a node.
fn held(structure: &Structure, node: NodeRef) -> Vec<u32> {
    let list = match node.target() {
        Target::Leaf { block, count } => structure.blocks[block as usize].primitive[..count as usize].to_vec(),
        Target::Grid(index) => {
            let grid = &structure.grids[index as usize];
            (0..grid.cell_count()).flat_map(|cell| structure.cell(grid, cell)).copied().collect()
        }
        Target::Branch(index) => held_by_all(structure, &structure.nodes[index as usize].child),
        Target::Nest(index) => {
            held_by_all(structure, structure.lattices.children(&structure.lattices.nests[index as usize]))
        }
        _ => Vec::new(),
    };
    distinct(list)
}

fn held_by_all(structure: &Structure, nodes: &[NodeRef]) -> Vec<u32> {
    nodes.iter().flat_map(|&node| held(structure, node)).collect()
}

/// The box of a place that is in a cell, and the room around it for what is listed within the margin.
pub fn reach(structure: &Structure, place: &Place) -> Bounds {
    // Boxes in cells are rounded outwards in the mesh's own coordinates.
    let rounding = 2.0 * f32::EPSILON * structure.domain.centre.abs().max_element();
    if place.cell.is_some() { place.bounds.dilated(2.0 * structure.domain.margin() + rounding) } else { place.bounds }
}

/// A place in a cell contains what of its triangles lies in that cell.
pub fn assert_contains_part(structure: &Structure, mesh: &Mesh, place: &Place, primitive: u32) {
    let corners = mesh.corners(primitive).map(|corner| corner - structure.domain.centre);
    let own = match place.target {
        Target::Grid(index) => {
            let grid = &structure.grids[index as usize];
            Bounds { lower: Vec3::from_array(grid.lower), upper: Vec3::from_array(grid.upper) }
        }
        _ => place.bounds,
    };
    let around = reach(structure, &Place { bounds: own, ..*place });
    let part = place.cell.map_or_else(Vec::new, |cell| check::clipped(&cell, corners));
    if !part.is_empty() {
        check::assert_contains(&around, &Bounds::of_points(part.into_iter().map(|point| point.as_vec3())));
    }
}

/// The distinct triangles of a grid of merged cells: every cell lists what overlaps any box of it, and what it lists
/// overlaps its own box.
pub fn assert_irregular(structure: &Structure, mesh: &Mesh, grid: &Grid) -> Vec<u32> {
    check::assert_shape(grid);
    let lattices = &structure.lattices;
    let boxes: Vec<_> = irregular::own_boxes(lattices, grid).collect();
    let primitives = distinct(structure.references.clone());
    let mut voxels = 0;
    for (cell, [lower, upper]) in &boxes {
        let [below, above] = [cell.lower, cell.upper].map(|corner| corner.map(u32::from));
        assert!((0..3).all(|k| below[k] <= lower[k] && upper[k] <= above[k] && above[k] <= grid.resolution[k]));
        voxels += (0..3).map(|k| (upper[k] - lower[k]) as usize).product::<usize>();
        if boxes.len() * primitives.len() <= check::BRUTE_FORCE {
            let listed = check::sorted(&structure.references[cell.start as usize..cell.end as usize]);
            let own = Bounds { lower: grid.corner(*lower), upper: grid.corner(*upper) };
            check::assert_lists(structure, mesh, &own, &listed, &primitives);
            let expanded = Bounds { lower: grid.corner(below), upper: grid.corner(above) };
            let others = primitives.iter().filter(|primitive| listed.binary_search(primitive).is_err());
            let others: Vec<u32> = others.copied().collect();
            check::assert_lists(structure, mesh, &expanded, &[], &others);
        }
    }
    assert_eq!(voxels, grid.cell_count(), "cells are boxes that fill the grid");
    primitives
}

/// The distinct triangles of a grid of tetrahedra: each lists what overlaps it, and nothing from afar.
pub fn assert_tetrahedral(structure: &Structure, mesh: &Mesh, grid: &Grid) -> Vec<u32> {
    check::assert_shape(grid);
    let count = grid.cell_count() * TETRAHEDRA;
    let row = &structure.starts[grid.first..=grid.first + count];
    assert!(row.is_sorted() && row[count] as usize <= structure.references.len(), "starts of {grid:?}");
    let primitives = distinct(structure.references[row[0] as usize..row[count] as usize].to_vec());
    let is_small = count * primitives.len() <= check::BRUTE_FORCE;
    for index in 0..if is_small { count } else { 0 } {
        let listed = check::sorted(structure.cell(grid, index));
        for &primitive in &primitives {
            let corners = mesh.corners(primitive).map(|corner| corner - structure.domain.centre);
            let is_listed = listed.binary_search(&primitive).is_ok();
            let margin = f64::from(structure.domain.margin());
            assert!(is_listed || !reaches(grid, index, corners, 0.0), "tetrahedron {index} lacks {primitive}");
            assert!(!is_listed || reaches(grid, index, corners, 2.0 * margin), "{index} lists {primitive} from afar");
        }
    }
    primitives
}

/// Whether a triangle meets a tetrahedron whose faces are moved outwards, by `margin` along each axis: what remains of
/// it after a cut along every face.
fn reaches(grid: &Grid, index: usize, corners: [Vec3; 3], margin: f64) -> bool {
    let cell = grid.cell_at(index / TETRAHEDRA);
    let [first, second, third] = ORDERS[index % TETRAHEDRA];
    let rest =
        |point: DVec3, k: usize| (point[k] - f64::from(grid.lower[k])) / f64::from(grid.cell[k]) - f64::from(cell[k]);
    let slack = |k: usize| margin / f64::from(grid.cell[k]);
    let corners = corners.map(|corner| corner.as_dvec3());
    let is_beyond = corners.iter().all(|&point| 1.0 + slack(first) - rest(point, first) < 0.0);
    if is_beyond || corners.iter().all(|&point| rest(point, third) + slack(third) < 0.0) {
        return false; // as the first cuts would find, of nearly every tetrahedron and triangle
    }
    let mut polygon = corners.to_vec();
    polygon = check::cut(&polygon, |point| 1.0 + slack(first) - rest(point, first));
    polygon = check::cut(&polygon, |point| rest(point, third) + slack(third));
    for (a, b) in [(first, second), (second, third)] {
        polygon = check::cut(&polygon, |point| rest(point, a) - rest(point, b) + slack(a) + slack(b));
    }
    !polygon.is_empty()
}
