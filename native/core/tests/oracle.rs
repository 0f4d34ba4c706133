//! Every method, on every instruction set, against brute force.

mod common;

use common::*;
use espalier_core::Mesh;
use glam::Vec3;
use proptest::prelude::*;
use std::sync::Arc;

every_walk!([on_random_meshes, far_from_the_origin_and_at_any_scale, on_soups, along_the_faces_of_the_box]);

fn point(extent: f32) -> impl Strategy<Value = Vec3> {
    let coordinate = move || prop_oneof![4 => -extent..extent, 1 => Just(0.0), 1 => (-4i32..5).prop_map(move |i| i as f32 * extent / 4.0)];
    (coordinate(), coordinate(), coordinate()).prop_map(Vec3::from)
}

fn mesh_parts() -> impl Strategy<Value = (Vec<Vec3>, Vec<[u32; 3]>)> {
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
    proptest!(ProptestConfig::with_cases(24), |((vertices, triangles) in mesh_parts(), ends in ends)| {
        let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
        walk.agrees(&mesh, &towards(ends));
    });
}

fn far_from_the_origin_and_at_any_scale(walk: &Walk) {
    let ends = prop::collection::vec((point(8.0), point(1.0)), 1..80);
    proptest!(ProptestConfig::with_cases(24), |(
        (vertices, triangles) in mesh_parts(), ends in ends, offset in point(3e3), exponent in -30i32..30,
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
    let (vertices, triangles) = soup(1500, 0.15);
    let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
    let ends = prop::collection::vec((point(2.0), point(1.0)), 300);
    proptest!(ProptestConfig::with_cases(2), |(ends in ends)| walk.agrees(&mesh, &towards(ends)));
}

/// Rays that run on a face of the scene's box, or some units in the last place beside it, as those from a point on the
/// ground to another do. Found by rays between surface points of a model of a city, which grids lost.
fn along_the_faces_of_the_box(walk: &Walk) {
    let (lower, upper) = (Vec3::new(-10.0, -0.225195, -10.0), Vec3::new(10.0, 4.0, 9.0));
    let corner =
        |index: u32| Vec3::select(glam::BVec3::from_array([1, 2, 4].map(|bit| index & bit != 0)), upper, lower);
    let mut vertices: Vec<Vec3> = (0..8).map(corner).collect();
    let mut triangles: Vec<[u32; 3]> =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
    let (walls, faces) = soup(300, 0.3);
    triangles.extend(faces.iter().map(|face| face.map(|index| index + 8)));
    vertices.extend(walls.into_iter().map(|wall| lower + (upper - lower) * wall.clamp(Vec3::ZERO, Vec3::ONE)));
    let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
    let place = || (0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0).prop_map(Vec3::from);
    let ends = prop::collection::vec((place(), place(), 0..3usize, any::<bool>(), -4i32..5, -4i32..5), 200);
    proptest!(ProptestConfig::with_cases(8), |(ends in ends)| {
        let ends = ends.into_iter().map(|(start, end, axis, high, start_ulps, end_ulps)| {
            let side = if high { upper[axis] } else { lower[axis] };
            [(start, start_ulps), (end, end_ulps)].map(|(share, ulps)| {
                let mut point = lower + (upper - lower) * share;
                point[axis] = f32::from_bits(side.to_bits().wrapping_add_signed(ulps));
                point
            }).into()
        });
        walk.agrees(&mesh, &towards(ends.collect()));
    });
}
