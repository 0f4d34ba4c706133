//! Batches of rays from one point in coherent order, which walk in tiles, against brute force, for every method on
//! every instruction set.

mod common;

use common::*;
use espalier_core::{
    Accelerator, Config, Job, Mesh, Method,
    ray::{Hits, HitsMut, Ray},
    simd::Level,
};
use glam::Vec3;
use std::sync::Arc;

every_walk!([
    soups_from_outside_and_inside,
    in_blocks_of_any_side,
    where_squares_break_off,
    of_rays_far_apart,
    at_corners_and_edges,
    from_corners_and_planes,
    intervals_that_end_anywhere,
    sheets_one_upon_another,
    at_any_scale_and_place
]);

fn mesh((vertices, triangles): (Vec<Vec3>, Vec<[u32; 3]>), place: impl Fn(Vec3) -> Vec3) -> Arc<Mesh> {
    Arc::new(Mesh::new(vertices.into_iter().map(place).collect(), triangles).unwrap())
}

/// Rays through a square image in blocks of 8 by 8, as a renderer asks; lengths differ.
fn image(eye: Vec3, forward: Vec3, slope: f32, edge: usize) -> RayBatch {
    in_blocks(eye, forward, slope, edge, 8)
}

/// The same in blocks of `side` by `side`.
fn in_blocks(eye: Vec3, forward: Vec3, slope: f32, edge: usize, side: usize) -> RayBatch {
    let right = forward.any_orthonormal_vector() * slope;
    let up = forward.cross(right);
    let mut rays = RayBatch::default();
    let place = |index: usize| (index as f32 + 0.37) / edge as f32 * 2.0 - 1.0;
    for index in 0..edge * edge {
        let (block, inside) = (index / (side * side), index % (side * side));
        let x = block % (edge / side) * side + inside % side;
        let y = block / (edge / side) * side + inside / side;
        let direction = forward + right * place(x) + up * place(y);
        rays.push(eye, direction * (1.0 + (index % 5) as f32), 0.0, f32::INFINITY);
    }
    rays
}

fn soups_from_outside_and_inside(walk: &Walk) {
    let mesh = mesh(soup(2000, 0.12), |v| v);
    for (eye, forward, slope) in [
        (Vec3::new(0.4, 0.6, -1.5), Vec3::Z, 0.4),
        (Vec3::new(3.0, 2.5, 2.0), Vec3::new(-1.0, -0.8, -0.6), 0.3),
        (Vec3::new(0.5, 0.45, 0.55), Vec3::new(0.7, 0.1, -0.7), 0.9),
        (Vec3::splat(0.5), Vec3::new(-0.5, 0.55, 0.45), 3.0),
    ] {
        walk.agrees(&mesh, &image(eye, forward.normalize(), slope, 32));
    }
}

fn in_blocks_of_any_side(walk: &Walk) {
    let mesh = mesh(soup(2000, 0.12), |v| v);
    for side in [1, 2, 4, 8, 16, 32, 64] {
        walk.agrees(&mesh, &in_blocks(Vec3::new(0.4, 0.6, -1.5), Vec3::new(0.05, -0.02, 1.0), 0.4, 64, side));
    }
}

/// So few rays see so much that their tiles are given up.
fn of_rays_far_apart(walk: &Walk) {
    let mesh = mesh(soup(12_000, 0.02), |v| v);
    let mut rays = image(Vec3::new(0.5, 0.5, -0.6), Vec3::Z, 0.8, 16);
    for index in 0..256 {
        let Ray { origin, direction, tmin, tmax } = rays.ray(index);
        rays.push(origin, direction, tmin, tmax);
    }
    walk.agrees(&mesh, &rays);
}

/// One ray among many starts elsewhere, goes back, or is slanted.
fn where_squares_break_off(walk: &Walk) {
    let mesh = mesh(soup(2000, 0.12), |v| v);
    for (side, odd) in [(8, 100), (8, 255), (16, 37), (16, 240), (32, 511), (32, 256)] {
        let (all, mut rays) = (in_blocks(Vec3::new(0.4, 0.6, -1.5), Vec3::Z, 0.4, 32, side), RayBatch::default());
        for index in 0..all.len() {
            let ray = all.ray(index);
            let (origin, direction) = match index {
                _ if index == odd => (ray.origin + Vec3::X * 0.1, ray.direction),
                _ if index == odd + 300 => (ray.origin, -ray.direction),
                _ if index == odd + 400 => (ray.origin, Vec3::new(1.5, 0.3, 1.0)),
                _ => (ray.origin, ray.direction),
            };
            rays.push(origin, direction, 0.0, f32::INFINITY);
        }
        walk.agrees(&mesh, &rays);
    }
}

/// Hits that fill the caches are written past them, where their columns begin as that asks for.
#[test]
fn of_large_pictures() {
    let mesh = mesh(soup(300, 0.3), |v| v);
    let rays = image(Vec3::new(0.4, 0.6, -1.5), Vec3::Z, 0.4, 512);
    for level in Level::available() {
        let built = Accelerator::build(mesh.clone(), Method::BvhSah, &Config::default(), 2, &Job::new()).unwrap();
        let accelerator = built.with_level(level);
        let (part, mut expected) = (1 << 14, Vec::new());
        for first in (0..rays.len()).step_by(part) {
            let mut hits = Hits::misses(part);
            accelerator.closest(&rays.rays().part(first, part), hits.as_mut(), 1, &Job::new()).unwrap();
            expected.extend((0..part).map(|index| hits.get(index)));
        }
        for offset in 0..5 {
            let mut room = Hits::misses(rays.len() + offset);
            let HitsMut { t, primitive, u, v } = room.as_mut();
            let (t, primitive) = (&mut t[offset..], &mut primitive[offset..]);
            let hits = HitsMut { t, primitive, u: &mut u[offset..], v: &mut v[offset..] };
            accelerator.closest(&rays.rays(), hits, 2, &Job::new()).unwrap();
            for (index, &hit) in expected.iter().enumerate() {
                assert_eq!(room.get(offset + index), hit, "ray {index}, {offset} numbers aside, {}", level.name());
            }
        }
    }
}

/// In the order of a subdivided sphere's corners, whose neighbours lie together.
fn at_corners_and_edges(walk: &Walk) {
    let (vertices, triangles) = icosphere(3);
    let mesh = mesh((vertices.clone(), triangles.clone()), |v| v);
    let mut sorted = vertices.clone();
    sorted.sort_by_key(|v| ((v.z * 4.0) as i32, (v.y * 4.0) as i32, (v.x * 1e4) as i32));
    for eye in [Vec3::ZERO, Vec3::new(0.3, -0.2, 0.1), Vec3::new(-2.0, 1.5, 2.5)] {
        let mut rays = RayBatch::default();
        sorted.iter().for_each(|&corner| rays.push(eye, corner - eye, 0.0, f32::INFINITY));
        for [a, b, c] in &triangles {
            let [a, b, c] = [a, b, c].map(|&index| vertices[index as usize]);
            [a + b, b + c, c + a].iter().for_each(|&sum| rays.push(eye, sum * 0.5 - eye, 0.0, f32::INFINITY));
        }
        walk.agrees(&mesh, &rays);
    }
}

/// Origins on corners, on planes of triangles, and on faces of boxes; directions along axes and planes.
fn from_corners_and_planes(walk: &Walk) {
    let snap = |v: Vec3| (v * 8.0).round() / 8.0;
    let mesh = mesh(soup(600, 0.4), snap);
    for (eye, forward) in [
        (Vec3::new(0.5, 0.5, 0.0), Vec3::Z),
        (Vec3::new(0.5, 0.5, 0.5), Vec3::X),
        (mesh.vertices()[30], Vec3::new(0.0, 1.0, 0.25)),
        (Vec3::new(-1.0, 0.25, 0.25), Vec3::X),
    ] {
        let mut rays = image(eye, forward, 0.5, 24);
        for index in 0..1024 {
            let target = Vec3::new((index % 32) as f32 / 8.0 - 2.0, (index / 32) as f32 / 8.0 - 2.0, 0.0);
            let [x, y] = [forward.any_orthonormal_vector(), forward.cross(forward.any_orthonormal_vector())];
            rays.push(eye, forward * 2.0 + x * target.x * 0.5 + y * target.y * 0.5, 0.0, f32::INFINITY);
        }
        walk.agrees(&mesh, &rays);
    }
}

fn intervals_that_end_anywhere(walk: &Walk) {
    let mesh = mesh(soup(2000, 0.12), |v| v);
    let all = image(Vec3::new(0.5, 0.4, -1.0), Vec3::Z, 0.5, 32);
    let hits = brute_force(&mesh, &all);
    let mut rays = RayBatch::default();
    for index in 0..all.len() {
        let (ray, t) = (all.ray(index), hits.t[index]);
        let (tmin, tmax) = match index % 8 {
            0 => (0.0, t),
            1 => (t, t),
            2 => (t.next_up(), f32::INFINITY),
            3 => (0.0, t.next_down()),
            4 => (0.2, 0.3),
            5 => (1.0, 0.5),
            6 => (-0.5, 1.0),
            _ => (0.0, 0.0),
        };
        rays.push(ray.origin, ray.direction, if tmin.is_finite() { tmin } else { 0.0 }, tmax);
    }
    walk.agrees(&mesh, &rays);
    let mut forwards = RayBatch::default();
    for index in (0..rays.len()).filter(|index| index % 8 != 6) {
        let ray = rays.ray(index);
        forwards.push(ray.origin, ray.direction, ray.tmin, ray.tmax);
    }
    walk.agrees(&mesh, &forwards);
}

/// Copies of one triangle, and sheets a few units in the last place apart.
fn sheets_one_upon_another(walk: &Walk) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for layer in 0..60u32 {
        let z = f32::from_bits(1f32.to_bits() + layer % 20 / 2 * 3);
        let first = vertices.len() as u32;
        let slant = (layer % 3) as f32 * 1e-7;
        let corner = |x: f32, y: f32| Vec3::new(x, y, z + x * slant);
        vertices.extend([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    let mesh = mesh((vertices, triangles), |v| v);
    walk.agrees(&mesh, &image(Vec3::new(0.0, 0.0, -1.0), Vec3::Z, 0.6, 24));
    walk.agrees(&mesh, &image(Vec3::new(0.1, 0.2, 3.0), Vec3::NEG_Z, 0.6, 24));
    walk.agrees(&mesh, &image(Vec3::new(-3.0, 0.2, 1.0), Vec3::X, 0.1, 24));
}

fn at_any_scale_and_place(walk: &Walk) {
    for (scale, offset) in [(1e-30, 0.0), (1e-12, 0.0), (1e-7, 0.0), (1e7, 0.0), (1e12, 0.0), (1e17, 0.0), (1.0, 3e4)] {
        let place = |v: Vec3| (v + offset) * scale;
        let mesh = mesh(soup(600, 0.2), place);
        for distance in [1.5, 7.0, 100.0] {
            let eye = Vec3::new(0.45, 0.55, -distance);
            let mut rays = RayBatch::default();
            let image = image(eye, Vec3::Z, 0.6 / distance, 16);
            (0..image.len()).for_each(|index| rays.push(place(eye), image.ray(index).direction, 0.0, f32::INFINITY));
            walk.agrees(&mesh, &rays);
        }
    }
}
