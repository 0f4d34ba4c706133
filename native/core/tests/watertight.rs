//! Closed meshes leak nothing.

mod common;

use std::sync::{Arc, OnceLock};

use common::*;
use espalier_core::{Mesh, ray::MISS};
use glam::Vec3;

every_walk!([nothing_leaves_a_sphere]);

/// A sphere of many more faces, for one method of each kind of node that rays go through.
mod large {
    use super::nothing_leaves_a_large_sphere;

    crate::every_walk!([nothing_leaves_a_large_sphere] of
        bvh_sah, sbvh, grid, grid_two_level, grid_irregular, grid_tetrahedral, eager_sampled, few_hybrid);
}

type Sphere = (Arc<Mesh>, RayBatch);

/// A sphere with rays from inside at every vertex and at the middle of every edge.
fn sphere(subdivisions: u32) -> Sphere {
    let (vertices, triangles) = icosphere(subdivisions);
    let mut rays = RayBatch::default();
    for origin in [Vec3::ZERO, Vec3::new(0.3, -0.2, 0.15), Vec3::new(0.0, 0.9, 0.0)] {
        let mut aim = |target: Vec3| rays.push(origin, target - origin, 0.0, f32::INFINITY);
        vertices.iter().for_each(|&vertex| aim(vertex));
        for [a, b, c] in &triangles {
            let edges = [[a, b], [b, c], [c, a]].into_iter().filter(|[a, b]| a < b);
            edges.for_each(|[a, b]| aim((vertices[*a as usize] + vertices[*b as usize]) * 0.5));
        }
    }
    (Arc::new(Mesh::new(vertices, triangles).unwrap()), rays)
}

fn nothing_leaves_a_sphere(walk: &Walk) {
    static SPHERE: OnceLock<Sphere> = OnceLock::new();
    let sphere = SPHERE.get_or_init(|| sphere(5));
    assert_eq!((sphere.0.triangles().len(), sphere.1.len()), (20_480, 3 * (10_242 + 30_720)));
    nothing_leaves(walk, sphere);
}

fn nothing_leaves_a_large_sphere(walk: &Walk) {
    static SPHERE: OnceLock<Sphere> = OnceLock::new();
    let sphere = SPHERE.get_or_init(|| sphere(6));
    assert_eq!((sphere.0.triangles().len(), sphere.1.len()), (81_920, 3 * (40_962 + 122_880)));
    nothing_leaves(walk, sphere);
}

fn nothing_leaves(walk: &Walk, (mesh, rays): &Sphere) {
    let accelerator = walk.build(mesh);
    let hits = closest(&accelerator, rays);
    assert_eq!(hits.primitive.iter().filter(|&&primitive| primitive == MISS).count(), 0);
    assert!(occluded(&accelerator, rays).into_iter().all(|blocked| blocked));
    // Small batches are traced ray by ray.
    for first in (0..rays.len()).step_by(16) {
        let (part, mut blocked) = (rays.rays().part(first, 16), [false; 16]);
        accelerator.tracer().occluded(&part, &mut blocked[..part.len()]).unwrap();
        assert!(blocked[..part.len()].iter().all(|&blocked| blocked));
    }
}
