//! Every method, on every instruction set, against brute force.

mod common;

use common::*;
use espalier_core::Mesh;
use glam::Vec3;
use proptest::prelude::*;
use std::sync::Arc;

every_walk!([on_random_meshes, far_from_the_origin_and_at_any_scale, on_soups]);

fn point(extent: f32) -> impl Strategy<Value = Vec3> {
    let coordinate = move || prop_oneof![4 => -extent..extent, 1 => Just(0.0), 1 => (-4i32..5).prop_map(move |i| i as f32 * extent / 4.0)];
    (coordinate(), coordinate(), coordinate()).prop_map(Vec3::from)
}

fn soup() -> impl Strategy<Value = (Vec<Vec3>, Vec<[u32; 3]>)> {
    prop::collection::vec(point(1.0), 3..200).prop_flat_map(|vertices| {
        let count = vertices.len() as u32;
        let triangles = prop::collection::vec([0..count, 0..count, 0..count], 1..300);
        (Just(vertices), triangles)
    })
}

/// Rays from the first point of each pair towards the second.
fn towards(ends: Vec<(Vec3, Vec3)>) -> RayBatch {
    let mut rays = RayBatch::default();
    for (origin, target) in ends.into_iter().filter(|(origin, target)| origin != target) {
        rays.push(origin, target - origin, 0.0, f32::INFINITY);
    }
    rays
}

fn on_random_meshes(walk: &Walk) {
    let ends = prop::collection::vec((point(2.0), point(1.0)), 1..150);
    proptest!(ProptestConfig::with_cases(24), |((vertices, triangles) in soup(), ends in ends)| {
        let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
        walk.agrees(&mesh, &towards(ends));
    });
}

fn far_from_the_origin_and_at_any_scale(walk: &Walk) {
    let ends = prop::collection::vec((point(8.0), point(1.0)), 1..80);
    proptest!(ProptestConfig::with_cases(24), |(
        (vertices, triangles) in soup(), ends in ends, offset in point(3e3), exponent in -30i32..30,
    )| {
        let scale = 2f32.powi(exponent);
        let place = |p: Vec3| (p + offset) * scale;
        let mesh = Arc::new(Mesh::new(vertices.into_iter().map(place).collect(), triangles).unwrap());
        let mut rays = towards(ends.into_iter().map(|(origin, target)| (place(origin), place(target))).collect());
        for index in 0..rays.len() {
            let ray = rays.ray(index);
            rays.push(ray.origin - ray.direction * 1e4, ray.direction, 0.0, f32::INFINITY);
        }
        walk.agrees(&mesh, &rays);
    });
}

/// Uniform content of a size at which the hybrids find grids with their default settings.
fn on_soups(walk: &Walk) {
    let (vertices, triangles) = common::soup(1500, 0.15);
    let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
    let ends = prop::collection::vec((point(2.0), point(1.0)), 300);
    proptest!(ProptestConfig::with_cases(2), |(ends in ends)| walk.agrees(&mesh, &towards(ends)));
}
