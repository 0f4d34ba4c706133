//! What the tests of pictures share: small scenes, and cameras that look at one spot of them.
#![allow(dead_code)] // Each test file uses its own part.

use std::sync::Arc;

use espalier_core::{
    Accelerator, Config, Job, Mesh, Method,
    render::{
        Bulb, Camera, CameraSettings, Light, LightKind, Projection, Render, Scene, SceneSettings, Settings, render,
    },
};
use glam::{Mat4, Vec3};

pub const HARD: Bulb = Bulb { radius: 0.0, soft_falloff: true };

pub fn mesh(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Arc<Mesh> {
    Arc::new(Mesh::new(vertices, triangles).unwrap())
}

/// Squares by centre and half edges, two triangles each; their normal is `u` × `v`.
pub fn squares(all: &[(Vec3, Vec3, Vec3)]) -> Arc<Mesh> {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for &(centre, u, v) in all {
        let first = vertices.len() as u32;
        vertices.extend([centre - u - v, centre + u - v, centre + u + v, centre - u + v]);
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    mesh(vertices, triangles)
}

/// A square of 20 by 20 in the plane z = 0.
pub fn floor() -> Arc<Mesh> {
    squares(&[(Vec3::ZERO, Vec3::X * 10.0, Vec3::Y * 10.0)])
}

pub fn light(kind: LightKind, matrix: Mat4, power: f32) -> Light {
    Light { kind, matrix, color: Vec3::ONE, power, normalize: true, shadow: true }
}

pub fn point_light(position: Vec3, power: f32) -> Light {
    light(LightKind::Point { bulb: HARD }, Mat4::from_translation(position), power)
}

/// White diffuse surfaces.
pub fn white(lights: Vec<Light>) -> SceneSettings {
    let mut settings = SceneSettings { lights, ..Default::default() };
    settings.materials[0].base_color = Vec3::ONE;
    settings
}

/// An orthographic camera of one small pixel that looks straight down at a spot of the plane z = 0.
pub fn above(x: f32, y: f32) -> CameraSettings {
    CameraSettings {
        projection: Projection::Orthographic { scale: 1e-3 },
        matrix: Mat4::from_translation(Vec3::new(x, y, 5.0)),
        resolution: [1, 1],
        ..Default::default()
    }
}

pub fn accelerator(mesh: &Arc<Mesh>, method: Method) -> Accelerator {
    Accelerator::build(mesh.clone(), method, &Config::default(), 2, &Job::new()).unwrap()
}

pub fn picture(mesh: &Arc<Mesh>, scene: SceneSettings, camera: &CameraSettings, settings: &Settings) -> Render {
    let scene = Scene::new(mesh.clone(), scene).unwrap();
    let camera = Camera::new(camera).unwrap();
    render(&accelerator(mesh, Method::BvhSah), &scene, &camera, settings, &Job::new()).unwrap()
}

/// Mean red of the picture that a camera takes.
pub fn radiance(mesh: &Arc<Mesh>, scene: SceneSettings, camera: &CameraSettings, samples: u32) -> f64 {
    let film = picture(mesh, scene, camera, &Settings { samples, ..Default::default() }).film;
    film.combined.chunks(4).map(|rgba| f64::from(rgba[0])).sum::<f64>() / (film.combined.len() / 4) as f64
}

pub fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance * expected.abs(), "{value} is not {expected} within {tolerance}");
}
