//! Packets and streams where single precision decides nothing: rays from planes, through edges and corners, that end at a hit to
//! the bit, among triangles long, tiny, huge and flat, near the origin and far from it. Against brute force.

mod common;

use common::*;
use espalier_core::{Accelerator, Config, Hits, Job, Mesh, Method, ray::MISS, simd::Level};
use glam::Vec3;
use std::sync::Arc;

/// A strip of neighbours in a plane that is askew or not, then triangles of every shape.
fn mesh(numbers: &mut Numbers, centre: Vec3, scale: f32) -> Arc<Mesh> {
    let mut vertices = Vec::new();
    for row in 0..6 {
        for column in 0..6 {
            let (x, y) = (row as f32 / 3.0 - 0.8, column as f32 / 3.0 - 0.8);
            vertices.push([Vec3::new(x, y, 0.3), Vec3::new(x, 0.4, y), Vec3::new(x, y, 0.3 * x - 0.2 * y)]);
        }
    }
    let mut triangles = Vec::new();
    for plane in 0..3u32 {
        for corner in (0..30).filter(|corner| corner % 6 < 5) {
            let [a, b, c, d] = [corner, corner + 1, corner + 6, corner + 7].map(|vertex| 3 * vertex + plane);
            triangles.extend([[a, b, c], [d, c, b]]);
        }
    }
    let mut vertices: Vec<Vec3> = vertices.into_iter().flatten().collect();
    for index in 0..160 {
        let (first, size) = (numbers.point(), [1e-3, 0.05, 0.3, 2.0][index % 4]);
        let long = numbers.point() * size;
        let thin = numbers.point() * size * [1.0, 1e-2, 1e-5, 0.0][index / 4 % 4];
        triangles.push([0, 1, 2].map(|corner| vertices.len() as u32 + corner));
        vertices.extend([first, first + long, first + long * 0.4 + thin]);
    }
    let vertices = vertices.into_iter().map(|vertex| vertex * scale + centre).collect();
    Arc::new(Mesh::new(vertices, triangles).unwrap())
}

/// Rays from triangle to triangle, sixteen from near one point: from their planes or a little above, to corners, points
/// of edges and others.
fn rays(numbers: &mut Numbers, mesh: &Mesh, scale: f32) -> RayBatch {
    let count = mesh.triangles().len() as u32;
    let choose = |number: f32| mesh.corners(((number + 1.0) * 0.5 * count as f32) as u32 % count);
    let mut rays = RayBatch::default();
    for packet in 0..200 {
        let [a, b, c] = choose(numbers.next());
        let lift = (b - a).cross(c - a).normalize_or_zero() * scale * [0.0, 1e-7, 1e-5, 1e-2][packet % 4];
        let middle = a * 0.5 + (b + c) * 0.25 + lift;
        for ray in 0..16 {
            let origin = middle + (b - a) * numbers.next() * 0.1 + (c - a) * numbers.next() * 0.1;
            let [p, q, r] = choose(numbers.next());
            let share = (numbers.next() + 1.0) * 0.5;
            let target = match ray % 4 {
                0 => p,
                1 => p + (q - p) * share,
                2 => q + (r - q) * 0.5,
                _ => p + (q - p) * share * 0.7 + (r - p) * (1.0 - share) * 0.9,
            };
            let direction = if (target - origin).length() > 0.0 { target - origin } else { Vec3::Z };
            let (near, far) = [(0.0, f32::INFINITY), (0.0, 1.0), (-2.0, 0.9), (1.0, 1.5)][(packet + ray / 4) % 4];
            rays.push(origin, direction, near, far);
        }
    }
    rays
}

/// The same rays with intervals that end, or begin, exactly at the first hit, or one step away from it.
fn ending(rays: &RayBatch, hits: &Hits, case: usize) -> RayBatch {
    let mut ending = RayBatch::default();
    for index in 0..rays.len() {
        let (ray, hit) = (rays.ray(index), hits.get(index));
        let (near, far) = match case {
            _ if hit.primitive == MISS => (ray.tmin, ray.tmax),
            0 => (ray.tmin, hit.t),
            1 => (ray.tmin, hit.t.next_down()),
            2 => (hit.t, hit.t),
            _ => (hit.t.next_up(), ray.tmax),
        };
        ending.push(ray.origin, ray.direction, near, far);
    }
    ending
}

fn agree(mesh: &Arc<Mesh>, rays: &RayBatch, expected: &Hits, what: &str) {
    let blocked: Vec<bool> = expected.primitive.iter().map(|primitive| *primitive != MISS).collect();
    for method in [Method::BvhSah, Method::Grid, Method::Lbvh] {
        for level in Level::available() {
            let built = Accelerator::build(mesh.clone(), method, &Config::default(), 2, &Job::new()).unwrap();
            let accelerator = built.with_level(level);
            let mut in_packets = vec![false; rays.len()];
            accelerator.tracer().occluded_in_packets(&rays.rays(), &mut in_packets).unwrap();
            let (hits, in_streams) = (closest(&accelerator, rays), occluded(&accelerator, rays));
            for index in 0..rays.len() {
                let case = format!("{index} {:?} {what} {} {}", rays.ray(index), method.name(), level.name());
                assert_eq!(in_packets[index], blocked[index], "{case}");
                assert_eq!(in_streams[index], blocked[index], "{case}");
                assert_eq!(hits.get(index), expected.get(index), "{case}");
            }
        }
    }
}

#[test]
fn packets_and_streams_say_what_the_exact_test_says() {
    let numbers = &mut Numbers(11);
    for (centre, scale) in [(Vec3::ZERO, 1.0), (Vec3::new(900.0, -3e4, 7.0), 3.0), (Vec3::ONE, 1e-4), (Vec3::ZERO, 1e8)]
    {
        let mesh = mesh(numbers, centre, scale);
        let rays = rays(numbers, &mesh, scale);
        let hits = brute_force(&mesh, &rays);
        agree(&mesh, &rays, &hits, "as they are");
        for case in 0..4 {
            let ending = ending(&rays, &hits, case);
            agree(&mesh, &ending, &brute_force(&mesh, &ending), ["to", "before", "at", "behind"][case]);
        }
    }
}
