//! Every method, on every instruction set, against brute force.

mod common;

use common::*;
use espalier_core::{Accelerator, Config, Job, Mesh, Method, simd::Level};
use glam::Vec3;
use proptest::prelude::*;
use std::sync::Arc;

fn agree(mesh: &Arc<Mesh>, rays: &RayBatch) {
    let expected = brute_force(mesh, rays);
    for method in Method::ALL {
        for level in Level::available() {
            let built = Accelerator::build(mesh.clone(), method, &Config::default(), 2, &Job::new()).unwrap();
            let accelerator = built.with_level(level);
            let hits = closest(&accelerator, rays);
            for index in 0..rays.len() {
                let name = (method.name(), level.name(), index, rays.ray(index));
                assert_eq!(hits.get(index), expected.get(index), "{name:?}");
            }
            let blocked = occluded(&accelerator, rays);
            let expected: Vec<bool> = expected.t.iter().map(|t| t.is_finite()).collect();
            assert_eq!(blocked, expected, "{} {}", method.name(), level.name());
        }
    }
}

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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn on_random_meshes((vertices, triangles) in soup(), ends in prop::collection::vec((point(2.0), point(1.0)), 1..60)) {
        let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
        let mut rays = RayBatch::default();
        for (origin, target) in ends.into_iter().filter(|(origin, target)| origin != target) {
            rays.push(origin, target - origin, 0.0, f32::INFINITY);
        }
        agree(&mesh, &rays);
    }

    #[test]
    fn far_from_the_origin_and_at_any_scale(
        (vertices, triangles) in soup(),
        ends in prop::collection::vec((point(8.0), point(1.0)), 1..40),
        offset in point(3e3), exponent in -30i32..30,
    ) {
        let scale = 2f32.powi(exponent);
        let place = |p: Vec3| (p + offset) * scale;
        let mesh = Arc::new(Mesh::new(vertices.into_iter().map(place).collect(), triangles).unwrap());
        let mut rays = RayBatch::default();
        for (origin, target) in ends.into_iter().filter(|(origin, target)| origin != target) {
            let direction = place(target) - place(origin);
            if direction != Vec3::ZERO {
                rays.push(place(origin), direction, 0.0, f32::INFINITY);
                rays.push(place(origin) - direction * 1e4, direction, 0.0, f32::INFINITY);
            }
        }
        agree(&mesh, &rays);
    }
}
