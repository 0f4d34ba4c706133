//! What a structure tells about itself: numbers and boxes agree with each other and with the mesh.

mod common;

use std::sync::Arc;

use common::*;
use espalier_core::{
    Accelerator, Mesh, Method,
    accel::{
        cells::{CellFilter, CellKind, Cells},
        census::Census,
    },
};
use glam::Vec3;

fn meshes() -> Vec<Arc<Mesh>> {
    let offset = Vec3::new(40.0, -7.0, 3.0);
    let (vertices, triangles) = icosphere(3);
    let sphere = Mesh::new(vertices.into_iter().map(|v| v + offset).collect(), triangles).unwrap();
    let (vertices, triangles) = soup(3000, 0.05);
    vec![Arc::new(sphere), Arc::new(Mesh::new(vertices, triangles).unwrap())]
}

fn accelerators() -> Vec<Accelerator> {
    meshes().iter().flat_map(build_all).collect()
}

fn all(accelerator: &Accelerator) -> Cells {
    accelerator.cells(&CellFilter::default()).unwrap()
}

fn of_kind(cells: &Cells, kind: CellKind) -> impl Iterator<Item = usize> + '_ {
    (0..cells.len()).filter(move |&i| cells.kind[i] == kind)
}

#[test]
fn boxes_are_as_many_as_the_census_counts() {
    for accelerator in accelerators() {
        let (cells, census) = (all(&accelerator), accelerator.census());
        let count = |kind| of_kind(&cells, kind).count();
        assert_eq!(count(CellKind::Branch), census.nodes);
        assert_eq!(count(CellKind::Leaf), census.leaves);
        assert_eq!(count(CellKind::Grid), census.grids);
        assert_eq!(count(CellKind::GridCell) + count(CellKind::Tetrahedron), census.cells);
        let in_grids = || of_kind(&cells, CellKind::GridCell).chain(of_kind(&cells, CellKind::Tetrahedron));
        assert_eq!(in_grids().filter(|&i| cells.count[i] == 0).count(), census.empty_cells);
        assert_eq!(count(CellKind::Lazy), census.lazy_cells - census.refined_cells);
        let ends = of_kind(&cells, CellKind::Leaf).chain(in_grids()).chain(of_kind(&cells, CellKind::Lazy));
        assert_eq!(ends.map(|i| cells.count[i] as usize).sum::<usize>(), census.references);
        assert_eq!(cells.count[0] as usize, census.references);
        let places = census.nodes + census.leaves + census.grids + census.lazy_cells;
        assert_eq!(census.depth_histogram.iter().sum::<usize>(), places);
        assert_eq!(census.depth_histogram.len(), census.max_depth + 1);
        assert!(census.sah_cost > 0.0 && census.sah_cost.is_finite());
    }
}

#[test]
fn a_hierarchy_refers_to_every_triangle_once() {
    let hierarchies = [
        Method::BvhMedian,
        Method::BvhMedianReinsert,
        Method::BvhSah,
        Method::BvhSahReinsert,
        Method::Ploc,
        Method::PlocReinsert,
        Method::BvhClusters,
        Method::Lbvh,
    ];
    for accelerator in accelerators().iter().filter(|a| hierarchies.contains(&a.method())) {
        assert_eq!(accelerator.census().references, accelerator.mesh().solid_count());
    }
}

#[test]
fn boxes_are_in_world_coordinates_and_the_first_is_the_scene() {
    for accelerator in accelerators() {
        let (cells, bounds) = (all(&accelerator), accelerator.mesh().bounds());
        let slack = bounds.upper.abs().max_element() * 1e-6;
        assert!(Vec3::from(cells.lower[0]).abs_diff_eq(bounds.lower, slack));
        assert!(Vec3::from(cells.upper[0]).abs_diff_eq(bounds.upper, slack));
        for i in 0..cells.len() {
            let (lower, upper) = (Vec3::from(cells.lower[i]), Vec3::from(cells.upper[i]));
            assert!(lower.cmpge(bounds.lower - slack).all() && upper.cmple(bounds.upper + slack).all());
            assert!(lower.cmple(upper).all());
        }
    }
}

#[test]
fn filters_keep_the_top_of_the_full_list() {
    for accelerator in accelerators() {
        let full = all(&accelerator);
        assert!(full.depth.is_sorted() && !full.truncated);
        let cut = accelerator.cells(&CellFilter { max_count: Some(7), ..CellFilter::default() }).unwrap();
        assert_eq!((cut.len(), cut.truncated), (full.len().min(7), full.len() > 7));
        assert_eq!(cut.lower[..], full.lower[..cut.len()]);
        let exact = CellFilter { max_count: Some(full.len()), ..CellFilter::default() };
        assert_eq!(accelerator.cells(&exact).unwrap(), full);
        let shallow = accelerator.cells(&CellFilter { max_depth: Some(1), ..CellFilter::default() }).unwrap();
        assert_eq!(shallow.len(), full.depth.iter().filter(|&&depth| depth <= 1).count());
        let occupied = accelerator.cells(&CellFilter { occupied_only: true, ..CellFilter::default() }).unwrap();
        assert_eq!(occupied.len(), full.count.iter().filter(|&&count| count > 0).count());
    }
}

#[test]
fn the_cost_of_one_leaf_is_one_block() {
    let mesh = Arc::new(Mesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap());
    let accelerator = &build_all(&mesh)[0];
    let cost = espalier_core::accel::config::CostConstants::default();
    let census = accelerator.census();
    assert_eq!((census.nodes, census.leaves, census.references, census.max_depth), (0, 1, 1, 0));
    assert!((census.sah_cost - cost.block_ns / cost.node_ns).abs() < 1e-9);
}

#[test]
fn an_empty_mesh_has_nothing_to_show() {
    let mesh = Arc::new(Mesh::new(vec![], vec![]).unwrap());
    for accelerator in build_all(&mesh) {
        assert!(all(&accelerator).is_empty());
        let expected = Census { bytes: accelerator.structure().bytes(), ..Census::default() };
        assert_eq!(accelerator.census(), expected);
    }
}
