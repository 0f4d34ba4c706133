//! Batches large enough to walk in streams, against brute force, for every method on every instruction set.

mod common;

use common::*;
use espalier_core::{Accelerator, Config, Job, Mesh, Method, simd::Level};
use glam::Vec3;
use std::sync::Arc;

fn soup(numbers: &mut Numbers, count: u32, size: f32) -> Arc<Mesh> {
    let corners = (0..count).flat_map(|_| {
        let centre = numbers.point();
        [(); 3].map(|()| centre + numbers.point() * size)
    });
    let vertices = corners.collect();
    Arc::new(Mesh::new(vertices, (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()).unwrap())
}

fn agree(mesh: &Arc<Mesh>, rays: &RayBatch) {
    let expected = brute_force(mesh, rays);
    let blocked: Vec<bool> = expected.t.iter().map(|t| t.is_finite()).collect();
    for method in Method::ALL {
        for level in Level::available() {
            let built = Accelerator::build(mesh.clone(), method, &Config::default(), 2, &Job::new()).unwrap();
            let accelerator = built.with_level(level);
            assert_eq!(closest(&accelerator, rays), expected, "{} {}", method.name(), level.name());
            assert_eq!(occluded(&accelerator, rays), blocked, "{} {}", method.name(), level.name());
            assert_eq!(in_packets(&accelerator, rays), blocked, "{} {}", method.name(), level.name());
        }
    }
}

fn in_packets(accelerator: &Accelerator, rays: &RayBatch) -> Vec<bool> {
    let mut blocked = vec![false; rays.len()];
    accelerator.tracer().occluded_in_packets(&rays.rays(), &mut blocked).unwrap();
    blocked
}

/// From point to point along a spiral on a sphere, into the half space outside: some along the axes, some without any
/// interval, some that begin behind their origin.
fn along_a_spiral(numbers: &mut Numbers, count: usize) -> RayBatch {
    let mut rays = RayBatch::default();
    for index in 0..count {
        let (height, turn) = (1.0 - 2.0 * (index as f32 + 0.5) / count as f32, index as f32 * 0.05);
        let around = (1.0 - height * height).sqrt();
        let normal = Vec3::new(around * turn.cos(), around * turn.sin(), height);
        let direction = match index % 7 {
            0 => Vec3::X * normal.x.signum(),
            1 => Vec3::new(0.0, normal.y, normal.z),
            _ => normal + 0.9 * numbers.point(),
        };
        let (near, far) = match index % 11 {
            3 => (0.2, 0.1),
            5 => (-0.3, 0.1),
            8 => (0.0, f32::INFINITY),
            _ => (0.0, 0.15),
        };
        rays.push(normal * 1.001, direction, near, far);
    }
    rays
}

#[test]
fn short_rays_side_by_side() {
    let numbers = &mut Numbers(4);
    let mesh = soup(numbers, 3000, 0.1);
    let rays = along_a_spiral(numbers, 6003);
    agree(&mesh, &rays);
}

#[test]
fn packets_and_streams_are_compared_in_large_batches() {
    let numbers = &mut Numbers(5);
    let mesh = soup(numbers, 3000, 0.1);
    let rays = along_a_spiral(numbers, 200_000);
    for level in Level::available() {
        let built = Accelerator::build(mesh.clone(), Method::BvhSah, &Config::default(), 2, &Job::new()).unwrap();
        let accelerator = built.with_level(level);
        let expected: Vec<bool> = closest(&accelerator, &rays).t.iter().map(|t| t.is_finite()).collect();
        assert_eq!(occluded(&accelerator, &rays), expected, "{}", level.name());
        assert_eq!(in_packets(&accelerator, &rays), expected, "{}", level.name());
    }
}

#[test]
fn rays_in_every_direction() {
    let numbers = &mut Numbers(1);
    let mesh = soup(numbers, 2000, 0.1);
    let mut rays = RayBatch::default();
    for index in 0..9000 {
        let (origin, direction) = (numbers.point() * 2.0, numbers.point());
        let near = if index % 3 == 0 { 0.5 } else { 0.0 };
        let far = if index % 5 == 0 { 1.0 } else { f32::INFINITY };
        rays.push(origin, direction, near, far);
    }
    agree(&mesh, &rays);
}

#[test]
fn parallel_rays_along_an_axis() {
    let numbers = &mut Numbers(2);
    let mesh = soup(numbers, 1000, 0.2);
    let mut rays = RayBatch::default();
    for _ in 0..3000 {
        let origin = numbers.point();
        rays.push(Vec3::new(origin.x, origin.y, -2.0), Vec3::Z, 0.0, f32::INFINITY);
        rays.push(Vec3::new(2.0, origin.y, origin.z), Vec3::new(-1.0, 0.0, -0.0), 0.0, f32::INFINITY);
    }
    agree(&mesh, &rays);
}

#[test]
fn rays_from_one_far_point() {
    let numbers = &mut Numbers(3);
    let mesh = soup(numbers, 3000, 0.05);
    let mut rays = RayBatch::default();
    let eye = Vec3::new(30.0, 20.0, -70.0);
    for _ in 0..6000 {
        rays.push(eye, numbers.point() - eye, 0.0, f32::INFINITY);
    }
    agree(&mesh, &rays);
}
