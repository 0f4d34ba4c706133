//! What every structure must satisfy, whatever built it; run after every build in tests.

use glam::{DVec3, Vec3};

use super::{
    check_lattice, check_lazy,
    places::{self, Place, levels},
    structure::{Grid, NEST_STACK, NodeRef, Structure, Target, View},
};
use crate::{Mesh, bounds::Bounds, ray::MISS, traverse::frame::DILATION, triangle::LANES};

/// Grids of at most this many pairs of cell and triangle are compared with brute force.
pub(super) const BRUTE_FORCE: usize = 1 << 22;

/// Panic unless rays that walk `structure` can find every triangle of `mesh`.
///
/// # Panics
/// With what is wrong.
pub fn assert_well_formed(structure: &Structure, mesh: &Mesh) {
    let places = levels(structure, &mesh.bounds()).flatten().filter(|place| place.lazy.is_none());
    let places: Vec<Place> = places.collect();
    assert_all_reached(structure, &places);
    let mut parts: Vec<(u32, usize)> = Vec::new();
    for (index, place) in places.iter().enumerate() {
        let primitives = match place.target {
            Target::Branch(node) => {
                assert_branch(structure, node as usize, place);
                continue;
            }
            Target::Leaf { block, count } => assert_leaf(structure.view(), mesh, block as usize, count as usize),
            Target::Grid(grid) => assert_grid(structure, mesh, &structure.grids[grid as usize]),
            Target::Lazy(cell) => check_lazy::assert_cell(structure, mesh, cell as usize, &place.bounds),
            Target::Nest(nest) => check_lattice::assert_nest(structure, mesh, &structure.lattices.nests[nest as usize]),
            Target::Irregular(grid) => {
                check_lattice::assert_irregular(structure, mesh, &structure.lattices.irregular[grid as usize])
            }
            Target::Tetrahedral(grid) => {
                check_lattice::assert_tetrahedral(structure, mesh, &structure.lattices.tetrahedral[grid as usize])
            }
            target => panic!("{target:?} was reached"),
        };
        if place.cell.is_some() {
            primitives
                .iter()
                .for_each(|&primitive| check_lattice::assert_contains_part(structure, mesh, place, primitive));
            continue;
        }
        parts.extend(primitives.into_iter().map(|primitive| (primitive, index)));
    }
    parts.sort_unstable();
    for parts in parts.chunk_by(|a, b| a.0 == b.0) {
        assert!(parts.is_sorted_by(|a, b| a.1 < b.1), "a place holds triangle {} twice", parts[0].0);
        let boxes: Vec<Bounds> = parts.iter().map(|&(_, index)| places[index].bounds).collect();
        assert_covered(structure, mesh, parts[0].0, &boxes);
    }
    assert_held(mesh, &parts);
    let needed = stack_need(structure, structure.view(), structure.root);
    assert!(structure.stack_size >= needed, "a stack of {} entries, {needed} needed", structure.stack_size);
}

fn assert_all_reached(structure: &Structure, places: &[Place]) {
    let indices = |wanted: fn(Target) -> Option<u32>| {
        let mut found: Vec<u32> = places.iter().filter_map(|place| wanted(place.target)).collect();
        found.sort_unstable();
        found
    };
    let all = |count: usize| (0..count as u32).collect::<Vec<_>>();
    let branches = indices(|target| if let Target::Branch(index) = target { Some(index) } else { None });
    let leaves = indices(|target| if let Target::Leaf { block, .. } = target { Some(block) } else { None });
    let grids = indices(|target| if let Target::Grid(index) = target { Some(index) } else { None });
    let nests = indices(|target| if let Target::Nest(index) = target { Some(index) } else { None });
    assert_eq!(branches, all(structure.nodes.len()), "nodes not reached exactly once");
    assert_eq!(leaves, all(structure.blocks.len()), "blocks not reached exactly once");
    assert_eq!(grids, all(structure.grids.len()), "grids not reached exactly once");
    assert_eq!(nests, all(structure.lattices.nests.len()), "nests not reached exactly once");
    let lazy = indices(|target| if let Target::Lazy(index) = target { Some(index) } else { None });
    assert_eq!(lazy, all(structure.lazy.len()), "lazy cells not reached exactly once");
}

fn assert_branch(structure: &Structure, index: usize, place: &Place) {
    let node = &structure.nodes[index];
    assert!(node.len() >= 2, "node {index} has {} children", node.len());
    for lane in node.len()..LANES {
        assert!(node.child[lane] == NodeRef::EMPTY && node.bounds(lane).is_empty(), "lane {lane} of node {index}");
    }
    for order in node.order {
        let mut lanes: [u32; LANES] = std::array::from_fn(|step| order >> (3 * step) & 7);
        lanes.sort_unstable();
        assert_eq!(lanes, std::array::from_fn(|lane| lane as u32), "order of visits of node {index}");
    }
    let leaf = |lane: &usize| matches!(node.child[*lane].target(), Target::Leaf { .. });
    let leaves = (0..LANES).filter(leaf).fold(0, |leaves, lane| leaves | 1 << lane);
    assert_eq!(node.leaves(), leaves, "leaves of node {index}");
    let around = check_lattice::reach(structure, place);
    for child in places::children(structure, place) {
        assert_contains(&around, &child.bounds);
        if let Target::Branch(below) = child.target {
            assert!(below as usize > index, "node {below} stands before its parent {index}");
        }
    }
}

pub(super) fn assert_leaf(view: View<'_>, mesh: &Mesh, index: usize, count: usize) -> Vec<u32> {
    let block = &view.blocks[index];
    assert!(block.primitive[count..].iter().all(|&primitive| primitive == MISS), "unused lanes of block {index}");
    for lane in 0..count {
        let corners = block.corner.map(|corner| Vec3::from_array(corner.map(|axis| axis[lane])));
        assert_eq!(corners, mesh.corners(block.primitive[lane]), "lane {lane} of block {index}");
    }
    block.primitive[..count].to_vec()
}

/// The distinct triangles of a grid.
fn assert_grid(structure: &Structure, mesh: &Mesh, grid: &Grid) -> Vec<u32> {
    assert_shape(grid);
    let row = &structure.starts[grid.first..=grid.first + grid.cell_count()];
    assert!(row.is_sorted() && row[grid.cell_count()] as usize <= structure.references.len(), "starts of {grid:?}");
    let mut primitives = structure.references[row[0] as usize..row[grid.cell_count()] as usize].to_vec();
    primitives.sort_unstable();
    primitives.dedup();
    if grid.cell_count() * primitives.len() <= BRUTE_FORCE {
        (0..grid.cell_count()).for_each(|cell| assert_cell(structure, mesh, grid, cell, &primitives));
    }
    primitives
}

pub(super) fn assert_shape(grid: &Grid) {
    assert!(grid.cell.iter().chain(&grid.inverse_cell).all(|edge| edge.is_finite() && *edge > 0.0), "{grid:?}");
}

/// A cell lists what overlaps it, and nothing that is farther than twice the margin.
fn assert_cell(structure: &Structure, mesh: &Mesh, grid: &Grid, cell: usize, primitives: &[u32]) {
    let listed = sorted(structure.cell(grid, cell));
    assert_lists(structure, mesh, &grid.cell_bounds(cell), &listed, primitives);
}

/// In order, and each once.
pub(super) fn sorted(listed: &[u32]) -> Vec<u32> {
    let mut sorted = listed.to_vec();
    sorted.sort_unstable();
    assert!(sorted.windows(2).all(|pair| pair[0] < pair[1]), "a cell lists a triangle twice: {listed:?}");
    sorted
}

/// What overlaps a box is listed, and nothing that is farther than twice the margin.
pub(super) fn assert_lists(structure: &Structure, mesh: &Mesh, bounds: &Bounds, listed: &[u32], primitives: &[u32]) {
    let generous = bounds.dilated(2.0 * structure.domain.margin());
    for &primitive in primitives {
        let corners = mesh.corners(primitive).map(|corner| corner - structure.domain.centre);
        let is_listed = listed.binary_search(&primitive).is_ok();
        assert!(is_listed || clipped(bounds, corners).is_empty(), "{bounds:?} lacks triangle {primitive}");
        assert!(!is_listed || !clipped(&generous, corners).is_empty(), "{bounds:?} has triangle {primitive} from afar");
    }
}

/// What remains of a triangle in a box after a cut along every side, in double precision. Shares no arithmetic with the
/// separating axes that grids are built by.
pub(super) fn clipped(bounds: &Bounds, corners: [Vec3; 3]) -> Vec<DVec3> {
    let is_beside = |axis: usize| {
        corners.iter().all(|corner| corner[axis] < bounds.lower[axis])
            || corners.iter().all(|corner| corner[axis] > bounds.upper[axis])
    };
    if (0..3).any(is_beside) {
        return Vec::new(); // as the first cuts would find, of nearly every cell and triangle
    }
    let mut polygon = corners.map(|corner| corner.as_dvec3()).to_vec();
    for axis in 0..3 {
        let (lower, upper) = (f64::from(bounds.lower[axis]), f64::from(bounds.upper[axis]));
        polygon = cut(&polygon, |point| point[axis] - lower);
        polygon = cut(&polygon, |point| upper - point[axis]);
    }
    polygon
}

/// The part of a convex polygon where `side` is not negative (Sutherland and Hodgman, CACM 17(1), 1974).
pub(super) fn cut(polygon: &[DVec3], side: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut rest = Vec::with_capacity(polygon.len() + 1);
    for (index, &point) in polygon.iter().enumerate() {
        let next = polygon[(index + 1) % polygon.len()];
        let (here, there) = (side(point), side(next));
        if here >= 0.0 {
            rest.push(point);
        }
        if (here < 0.0) != (there < 0.0) {
            rest.push(point.lerp(next, here / (here - there)));
        }
    }
    rest
}

/// Every point of a triangle lies in the box of some place that holds it, but for what traversal makes up for by
/// dilating boxes: see [`clip`](super::clip). One that stands in a single place lies in its box without exception.
fn assert_covered(structure: &Structure, mesh: &Mesh, primitive: u32, boxes: &[Bounds]) {
    if let [bounds] = boxes {
        return assert_contains(bounds, &triangle_bounds(structure, mesh, primitive));
    }
    let slack = DILATION / 4.0 * structure.domain.half_extent + f32::MIN_POSITIVE;
    let corners = mesh.corners(primitive).map(|corner| (corner - structure.domain.centre).as_dvec3());
    let mut bare = vec![corners.to_vec()];
    for bounds in boxes {
        bare = bare.iter().flat_map(|polygon| outside(polygon, &bounds.dilated(slack))).collect();
    }
    assert!(bare.is_empty(), "triangle {primitive} is not in any of {boxes:?} at {bare:?}");
}

/// The parts of a convex polygon that lie outside a box.
fn outside(polygon: &[DVec3], bounds: &Bounds) -> Vec<Vec<DVec3>> {
    let (mut inside, mut parts) = (polygon.to_vec(), Vec::new());
    for axis in 0..3 {
        let (lower, upper) = (f64::from(bounds.lower[axis]), f64::from(bounds.upper[axis]));
        for (sign, plane) in [(1.0, lower), (-1.0, upper)] {
            let side = |point: DVec3| sign * (point[axis] - plane);
            if inside.iter().any(|&point| side(point) < 0.0) {
                parts.push(cut(&inside, |point| -side(point)));
                inside = cut(&inside, side);
            }
        }
    }
    parts
}

fn assert_held(mesh: &Mesh, parts: &[(u32, usize)]) {
    let mut held: Vec<u32> = parts.iter().map(|&(primitive, _)| primitive).collect();
    held.dedup();
    let lost = mesh.solid(0).find(|primitive| held.binary_search(primitive).is_err());
    assert_eq!(lost, None, "a triangle is nowhere");
    assert_eq!(held.len(), mesh.solid_count(), "triangles without area are held");
}

pub(super) fn triangle_bounds(structure: &Structure, mesh: &Mesh, primitive: u32) -> Bounds {
    Bounds::of_points(mesh.corners(primitive).map(|corner| corner - structure.domain.centre))
}

pub(super) fn assert_contains(outer: &Bounds, inner: &Bounds) {
    let contains = outer.lower.cmple(inner.lower).all() && inner.upper.cmple(outer.upper).all();
    assert!(contains, "{outer:?} does not contain {inner:?}");
}

/// The most entries that a walk from a place can have on its stack: all children but the one that is visited, at every
/// level.
fn stack_need(structure: &Structure, view: View<'_>, place: NodeRef) -> usize {
    let (own, children) = match place.target() {
        Target::Branch(index) => {
            let node = &view.nodes[index as usize];
            (node.len() - 1, &node.child[..node.len()])
        }
        Target::Nest(index) => (NEST_STACK, structure.lattices.children(&structure.lattices.nests[index as usize])),
        Target::Lazy(cell) => {
            let cell = structure.lazy.refined(cell as usize);
            return cell.map_or(0, |cell| stack_need(structure, cell.view(), cell.root));
        }
        _ => return 0,
    };
    own + children.iter().map(|&child| stack_need(structure, view, child)).max().unwrap_or(0)
}
