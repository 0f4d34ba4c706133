//! Cells that become subtrees when a ray reaches them: nobody can tell from the hits.

mod common;

use std::sync::Arc;

use common::*;
use espalier_core::{
    Accelerator, Config, Job, Mesh, Method,
    accel::cells::{CellFilter, CellKind},
};
use glam::Vec3;

fn lazy(mesh: &Arc<Mesh>, threads: usize) -> Accelerator {
    let config = Config { expected_rays: 0.0, ..Config::default() };
    Accelerator::build(mesh.clone(), Method::Hybrid, &config, threads, &Job::new()).unwrap()
}

fn mesh((vertices, triangles): (Vec<Vec3>, Vec<[u32; 3]>)) -> Arc<Mesh> {
    Arc::new(Mesh::new(vertices, triangles).unwrap())
}

/// Rays along x through a square, a row a line.
fn parallel_rays(side: usize, extent: f32) -> RayBatch {
    let mut rays = RayBatch::default();
    for index in 0..side * side {
        let place = |index: usize| (index as f32 + 0.5) / side as f32 * 2.0 * extent - extent;
        rays.push(Vec3::new(-3.0, place(index % side), place(index / side)), Vec3::X, 0.0, f32::INFINITY);
    }
    rays
}

#[test]
fn only_what_rays_reach_is_refined() {
    let accelerator = lazy(&mesh(icosphere(5)), 2);
    let before = accelerator.census();
    assert!(before.lazy_cells > 400 && before.refined_cells == 0 && before.leaves == 0);
    closest(&accelerator, &parallel_rays(100, 0.3));
    let after = accelerator.census();
    assert!((1..before.lazy_cells / 4).contains(&after.refined_cells), "{} refined", after.refined_cells);
    assert!(after.leaves > 0 && after.bytes > before.bytes);
    assert_eq!((after.references, after.sah_cost), (before.references, before.sah_cost));
    let cells = accelerator.cells(&CellFilter::default()).unwrap();
    let count = |kind| cells.kind.iter().filter(|&&other| other == kind).count();
    assert_eq!(count(CellKind::Refined), after.refined_cells);
    assert_eq!(count(CellKind::Lazy), after.lazy_cells - after.refined_cells);
    assert_eq!((count(CellKind::Branch), count(CellKind::Leaf)), (after.nodes, after.leaves));
    assert!((cells.kind.iter().zip(&cells.count)).all(|(&kind, &count)| kind != CellKind::Refined || count > 0));
}

#[test]
fn threads_that_refine_together_find_the_same_hits() {
    let mesh = mesh(soup(60_000, 0.03));
    let rays = parallel_rays(256, 1.0);
    let expected = closest(&lazy(&mesh, 1), &rays);
    for threads in [2, 5] {
        let accelerator = lazy(&mesh, threads);
        let mut hits = espalier_core::Hits::misses(rays.len());
        accelerator.closest(&rays.rays(), hits.as_mut(), threads, &Job::new()).unwrap();
        assert!((0..rays.len()).all(|index| hits.get(index) == expected.get(index)));
        let alone = lazy(&mesh, 1);
        closest(&alone, &rays);
        assert_eq!(alone.census(), accelerator.census());
    }
}

#[test]
fn a_crowd_in_one_cell_of_the_grid_is_told_apart() {
    let (mut vertices, mut triangles) = soup(5000, 0.05);
    vertices.iter_mut().for_each(|vertex| *vertex *= 1e-4);
    let first = vertices.len() as u32;
    vertices.extend([Vec3::splat(100.0), Vec3::new(100.0, 101.0, 100.0), Vec3::new(101.0, 100.0, 100.0)]);
    triangles.push([first, first + 1, first + 2]);
    let accelerator = lazy(&mesh((vertices, triangles)), 2);
    let lazy = &accelerator.structure().lazy;
    assert!((0..lazy.len()).all(|cell| lazy.triangles(cell).len() <= 48));
    assert!(accelerator.census().sah_cost < 40.0, "{}", accelerator.census().sah_cost);
}

#[test]
fn triangles_that_cannot_be_told_apart_are_halved() {
    let (corner, faces) = (soup(1, 1.0).0, vec![[0, 1, 2]; 3000]);
    let accelerator = lazy(&mesh((corner, faces)), 2);
    let lazy = &accelerator.structure().lazy;
    assert!((0..lazy.len()).all(|cell| lazy.triangles(cell).len() <= 48));
}
