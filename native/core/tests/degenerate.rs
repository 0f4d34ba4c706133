//! Inputs at the edges of what numbers can say, for every method on every instruction set, against brute force.

mod common;

use std::sync::Arc;

use common::*;
use espalier_core::{Error, Mesh, ray::MISS};
use glam::Vec3;

every_walk!([
    triangles_without_area,
    duplicate_and_coplanar_triangles,
    huge_and_tiny,
    far_from_the_origin,
    rays_along_axes_planes_and_faces,
    rays_that_start_on_triangles,
    both_ends_of_the_interval_count,
    negative_zero_and_denormal_directions,
    no_triangle_and_one,
    flat_meshes
]);

type Triangles = (Vec<Vec3>, Vec<[u32; 3]>);

fn mesh((vertices, triangles): Triangles) -> Arc<Mesh> {
    Arc::new(Mesh::new(vertices, triangles).unwrap())
}

fn mapped((vertices, triangles): Triangles, map: impl Fn(Vec3) -> Vec3) -> Triangles {
    (vertices.into_iter().map(map).collect(), triangles)
}

/// Rays between all pairs of some points, to both sides.
fn between(points: &[Vec3]) -> RayBatch {
    let mut rays = RayBatch::default();
    for (index, &from) in points.iter().enumerate() {
        for &to in points[index + 1..].iter().filter(|&&to| to != from) {
            rays.push(from, to - from, 0.0, f32::INFINITY);
            rays.push(to, from - to, 0.0, 1.0);
        }
    }
    rays
}

/// Points on, in and around the unit cube, some of them on its faces, edges and corners.
fn around() -> Vec<Vec3> {
    let steps = [-0.75, 0.0, 0.5, 1.0, 1.5];
    let all = steps.into_iter().flat_map(|x| steps.into_iter().flat_map(move |y| steps.map(|z| Vec3::new(x, y, z))));
    all.step_by(3).collect()
}

fn triangles_without_area(walk: &Walk) {
    let (mut vertices, mut triangles) = soup(300, 0.2);
    let first = vertices.len() as u32;
    vertices.extend([Vec3::ZERO, Vec3::splat(0.5), Vec3::ONE]);
    triangles.extend([[first, first + 1, first + 2], [first, first, first], [first, first + 2, first], [5, 6, 5]]);
    let mesh = mesh((vertices, triangles));
    assert_eq!(mesh.degenerate_count(), 4);
    walk.agrees(&mesh, &between(&around()));
    let nothing = self::mesh((vec![Vec3::ZERO, Vec3::ONE], vec![[0, 1, 0], [1, 1, 1]]));
    walk.agrees(&nothing, &between(&around()[..9]));
}

fn duplicate_and_coplanar_triangles(walk: &Walk) {
    let (vertices, triangles) = soup(60, 0.4);
    let repeated = triangles.iter().cycle().take(300).copied().collect();
    walk.agrees(&mesh((vertices, repeated)), &between(&around()));
    let level = mapped(soup(300, 0.3), |v| Vec3::new(v.x, v.y, (v.z * 3.0).floor() / 4.0));
    walk.agrees(&mesh(level), &between(&around()));
    // All of one centroid: no plane divides them.
    let stack = (0..40).flat_map(|_| [Vec3::ZERO, Vec3::X, Vec3::Y]);
    let stack = (stack.collect(), (0..40).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    walk.agrees(&mesh(stack), &between(&around()));
}

fn huge_and_tiny(walk: &Walk) {
    for scale in [1e15, 1e17, 1e-15, 1e-20, 1e-30] {
        let mesh = mesh(mapped(soup(300, 0.2), |v| v * scale));
        let points: Vec<Vec3> = around().into_iter().map(|point| point * scale).collect();
        walk.agrees(&mesh, &between(&points));
    }
}

fn far_from_the_origin(walk: &Walk) {
    for offset in [Vec3::new(1e6, -2e6, 3e5), Vec3::new(0.0, 1e4, -1e7)] {
        let mesh = mesh(mapped(soup(300, 0.2), |v| v * 40.0 + offset));
        let mut points: Vec<Vec3> = around().into_iter().map(|point| point * 40.0 + offset).collect();
        points.extend([Vec3::ZERO, offset * 1e3, -offset]);
        walk.agrees(&mesh, &between(&points));
    }
}

/// A grid of the unit cube's surface, in squares of two triangles: its planes are those of cells and boxes.
fn boxes() -> Triangles {
    const EDGE: u32 = 6;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (axis, side) in [(0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0), (2, 0.0), (2, 1.0), (2, 0.5)] {
        let first = vertices.len() as u32;
        for (i, j) in (0..=EDGE).flat_map(|i| (0..=EDGE).map(move |j| (i, j))) {
            let mut point = Vec3::splat(side);
            point[(axis + 1) % 3] = i as f32 / EDGE as f32;
            point[(axis + 2) % 3] = j as f32 / EDGE as f32;
            vertices.push(point);
        }
        for (i, j) in (0..EDGE).flat_map(|i| (0..EDGE).map(move |j| (i, j))) {
            let corner = first + i * (EDGE + 1) + j;
            triangles.extend([[corner, corner + 1, corner + EDGE + 2], [corner, corner + EDGE + 2, corner + EDGE + 1]]);
        }
    }
    (vertices, triangles)
}

fn rays_along_axes_planes_and_faces(walk: &Walk) {
    let mut rays = RayBatch::default();
    let steps = [0.0, 1.0 / 6.0, 0.25, 1.0 / 3.0, 0.5, 1.0, 1.0 + f32::EPSILON];
    for axis in 0..3 {
        for (a, b) in steps.into_iter().flat_map(|a| steps.map(|b| (a, b))) {
            for start in [-0.5, 0.0, 0.5, 1.0, 2.0] {
                let mut origin = Vec3::splat(start);
                origin[(axis + 1) % 3] = a;
                origin[(axis + 2) % 3] = b;
                for side in [1.0, -1.0] {
                    rays.push(origin, Vec3::AXES[axis] * side, 0.0, f32::INFINITY);
                    rays.push(origin, Vec3::AXES[axis] * side + Vec3::AXES[(axis + 1) % 3] * 0.5, 0.0, 3.0);
                }
            }
        }
    }
    walk.agrees(&mesh(boxes()), &rays);
    let (vertices, triangles) = soup(300, 0.2);
    let snapped = mapped((vertices, triangles), |v| (v * 8.0).round() / 8.0);
    walk.agrees(&mesh(snapped), &rays);
}

fn rays_that_start_on_triangles(walk: &Walk) {
    let mesh = mesh(soup(300, 0.2));
    let mut rays = RayBatch::default();
    for triangle in mesh.solid(0).step_by(3) {
        let [a, b, c] = mesh.corners(triangle);
        for point in [a, (a + b) * 0.5, (a + b + c) / 3.0] {
            for direction in [mesh.normal(triangle), b - a, (c - a) * 1e-3, Vec3::new(0.3, -1.0, 0.2)] {
                rays.push(point, direction, 0.0, f32::INFINITY);
                rays.push(point, -direction, 1e-4, f32::INFINITY);
                rays.push(point, direction, f32::NEG_INFINITY, 0.0);
            }
        }
    }
    walk.agrees(&mesh, &rays);
}

fn both_ends_of_the_interval_count(walk: &Walk) {
    let mesh = mesh(boxes());
    let (origin, direction) = (Vec3::new(0.4, 0.3, -1.0), Vec3::new(0.0, 0.0, 2.0));
    // Faces are met at t = 0.5, 0.75 and 1.
    let below = f32::from_bits(1f32.to_bits() - 1);
    let intervals = [
        (0.5, 0.5),
        (0.75, 1.0),
        (0.5f32.next_up(), 0.74),
        (1.0, below),
        (1.0, 1.0),
        (1.0f32.next_up(), 9.0),
        (2.0, 1.0),
    ];
    let expected = [Some(0.5), Some(0.75), None, None, Some(1.0), None, None];
    let mut rays = RayBatch::default();
    intervals.iter().for_each(|&(tmin, tmax)| rays.push(origin, direction, tmin, tmax));
    walk.agrees(&mesh, &rays);
    let hits = closest(&walk.build(&mesh), &rays);
    for (index, expected) in expected.into_iter().enumerate() {
        let found = (hits.primitive[index] != MISS).then_some(hits.t[index]);
        assert_eq!(found, expected, "interval {:?} of {walk:?}", intervals[index]);
    }
}

fn negative_zero_and_denormal_directions(walk: &Walk) {
    let mut rays = RayBatch::default();
    let odd = [0.0, -0.0, 1e-40, -1e-45, 1e-30, -1e-20, f32::MIN_POSITIVE];
    for (a, b) in odd.into_iter().flat_map(|a| odd.map(|b| (a, b))) {
        for origin in [Vec3::new(0.5, 0.5, -1.0), Vec3::new(1.0 / 3.0, 0.0, 2.0), Vec3::ZERO, Vec3::splat(0.25)] {
            for long in [1.0, -1.0, 1e-36, -1e30] {
                let direction = Vec3::new(a, b, long);
                [direction, Vec3::new(long, a, b), Vec3::new(b, long, a)]
                    .into_iter()
                    .for_each(|direction| rays.push(origin, direction, 0.0, f32::INFINITY));
            }
        }
    }
    walk.agrees(&mesh(boxes()), &rays);
    walk.agrees(&mesh(soup(300, 0.2)), &rays);
    let mut zero = RayBatch::default();
    zero.push(Vec3::ZERO, Vec3::new(0.0, -0.0, 1e-40), 0.0, 1.0);
    let mut blocked = [false];
    let refused = walk.build(&mesh(boxes())).tracer().occluded(&zero.rays(), &mut blocked);
    assert!(matches!(refused, Err(Error::Ray(_))), "{refused:?}");
}

fn no_triangle_and_one(walk: &Walk) {
    walk.agrees(&mesh((vec![], vec![])), &between(&around()[..9]));
    let one = (vec![Vec3::ZERO, Vec3::new(1.0, 0.0, 0.5), Vec3::new(0.0, 1.0, 0.5)], vec![[0, 1, 2]]);
    walk.agrees(&mesh(one), &between(&around()));
}

fn flat_meshes(walk: &Walk) {
    for axis in 0..3 {
        let flat = mapped(soup(300, 0.2), |mut v| {
            v[axis] = 0.3;
            v
        });
        walk.agrees(&mesh(flat), &between(&around()));
    }
    let needle = mapped(soup(300, 0.2), |v| v * Vec3::new(1.0, 1e-9, 1e-6));
    walk.agrees(&mesh(needle), &between(&around()));
}
