//! Materials, textures, normals, the world, and the passes.

mod common;

use std::{f64::consts::PI, sync::Arc};

use common::picture::*;
use espalier_core::{
    Error, Mesh,
    render::{Extension, Interpolation, Material, Scene, SceneSettings, Settings, Texture},
};
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

fn mirror(base_color: Vec3) -> Material {
    Material { base_color, metallic: 1.0, roughness: 0.0, ..Default::default() }
}

fn glowing(radiance: Vec3) -> Material {
    Material { base_color: Vec3::ZERO, emission: radiance, ..Default::default() }
}

/// A box of the given half size around the middle, seen from inside.
fn room(half: f32) -> Arc<Mesh> {
    let faces = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    let square = |normal: Vec3| {
        let turn = Quat::from_rotation_arc(Vec3::Z, normal);
        (normal * half, turn * Vec3::X * half, turn * Vec3::Y * half)
    };
    squares(&faces.map(square).collect::<Vec<_>>())
}

#[test]
fn a_white_convex_body_under_a_white_sky_is_as_bright_as_the_sky() {
    let scene = SceneSettings { world: Vec3::splat(0.7), ..white(vec![]) };
    let mut camera = above(0.0, 0.0);
    camera.resolution = [16, 16];
    camera.matrix = Mat4::from_translation(Vec3::new(0.2, 0.1, 5.0));
    near(radiance(&room(1.0), scene, &camera, 4), 0.7, 1e-5);
}

#[test]
fn inside_a_closed_room_no_light_comes_from_the_sky() {
    let scene = SceneSettings { world: Vec3::ONE, ..white(vec![]) };
    let mut camera = above(0.0, 0.0);
    camera.matrix = Mat4::IDENTITY;
    assert_eq!(radiance(&room(1.0), scene, &camera, 64), 0.0);
}

/// Floor and a tall wall: half of the sky is hidden at the foot of the wall.
#[test]
fn a_wall_hides_its_share_of_the_sky() {
    let wall = (Vec3::new(0.0, 0.0, 1e3), Vec3::Y * 1e4, Vec3::Z * 1e3);
    let mesh = squares(&[(Vec3::ZERO, Vec3::X * 10.0, Vec3::Y * 10.0), wall]);
    let scene = SceneSettings { world: Vec3::ONE, ..white(vec![]) };
    near(radiance(&mesh, scene, &above(0.01, 0.0), 1 << 12), 0.5, 1e-2);
}

#[test]
fn emission_is_seen_from_both_sides() {
    let scene = || SceneSettings { materials: vec![glowing(Vec3::new(2.0, 0.0, 0.0))], ..Default::default() };
    near(radiance(&floor(), scene(), &above(0.0, 0.0), 1), 2.0, 1e-6);
    let mut below = above(0.0, 0.0);
    below.matrix = Mat4::from_translation(Vec3::Z * -5.0) * Mat4::from_rotation_x(std::f32::consts::PI);
    near(radiance(&floor(), scene(), &below, 1), 2.0, 1e-6);
}

/// A ray falls on a mirror at 45°, from there on a second one, and then on something that glows.
fn chain(max_bounces: u32) -> f64 {
    let tilt = Quat::from_rotation_y(std::f32::consts::FRAC_PI_4);
    let first = (Vec3::ZERO, tilt * Vec3::X, Vec3::Y);
    let second = (Vec3::X * 4.0, tilt * Vec3::X, Vec3::Y);
    let lamp = (Vec3::new(4.0, 0.0, -4.0), Vec3::X, Vec3::Y);
    let scene = SceneSettings {
        materials: vec![mirror(Vec3::splat(0.5)), glowing(Vec3::splat(8.0))],
        material_index: Some(vec![0, 0, 0, 0, 1, 1]),
        ..Default::default()
    };
    let settings = Settings { max_bounces, ..Default::default() };
    let mesh = squares(&[first, second, lamp]);
    f64::from(picture(&mesh, scene, &above(0.0, 0.0), &settings).film.combined[0])
}

#[test]
fn mirrors_reflect_mirrors_up_to_the_last_bounce() {
    let grazing = (1.0 - f64::sqrt(0.5)).powi(5);
    let reflectance = 0.5 + 0.5 * grazing;
    near(chain(4), 8.0 * reflectance * reflectance, 1e-4);
    near(chain(2), 8.0 * reflectance * reflectance, 1e-4);
    assert_eq!(chain(1), 0.0);
}

#[test]
fn two_mirrors_that_face_each_other_end_with_the_bounces() {
    let mesh = squares(&[(Vec3::ZERO, Vec3::X, Vec3::Y), (Vec3::Z * 10.0, Vec3::X, Vec3::Y)]);
    let scene = SceneSettings { materials: vec![mirror(Vec3::ONE)], ..Default::default() };
    let counters = picture(&mesh, scene, &above(0.0, 0.0), &Settings { max_bounces: 9, ..Default::default() }).counters;
    assert_eq!((counters.primary_rays, counters.bounce_rays, counters.shadow_rays), (1, 9, 0));
}

#[test]
fn rough_metals_and_smooth_plastics_are_diffuse() {
    for (metallic, roughness, is_mirror) in [(1.0, 0.5, false), (0.0, 0.0, false), (0.5, 0.2, true)] {
        assert_eq!(Material { metallic, roughness, ..Default::default() }.is_mirror(), is_mirror);
    }
}

/// 3 by 2 pixels: red 0, 1, 2 below, 10, 11, 12 above.
fn checks(interpolation: Interpolation, extension: Extension) -> Texture {
    let pixels = (0..6u8).map(|i| Vec4::new(f32::from(i % 3 + 10 * (i / 3)), 0.0, 0.0, 1.0)).collect();
    Texture::new([3, 2], pixels, interpolation, extension).unwrap()
}

#[test]
fn textures_are_looked_up_by_pixel_or_between_pixels() {
    let closest = checks(Interpolation::Closest, Extension::Repeat);
    let linear = checks(Interpolation::Linear, Extension::Repeat);
    for (u, v, near_pixel, between) in [
        (0.5 / 3.0, 0.25, 0.0, 0.0),
        (1.0 / 3.0 + 0.01, 0.25, 1.0, 0.53),
        (2.5 / 3.0, 0.75, 12.0, 12.0),
        (0.5, 0.5001, 11.0, 6.002),
        (1.5 / 3.0 + 1.0, 0.25 - 3.0, 1.0, 1.0),
        (0.0, 0.25, 0.0, 1.0),
    ] {
        assert_eq!(closest.color(Vec2::new(u, v)).x, near_pixel, "closest ({u}, {v})");
        assert!((linear.color(Vec2::new(u, v)).x - between).abs() < 2e-3, "linear ({u}, {v})");
    }
}

#[test]
fn textures_end_as_told() {
    let at = |extension, u: f32| checks(Interpolation::Closest, extension).color(Vec2::new(u, 0.25)).x;
    assert_eq!([at(Extension::Repeat, 1.2), at(Extension::Repeat, -0.1)], [0.0, 2.0]);
    assert_eq!([at(Extension::Extend, 1.2), at(Extension::Extend, -0.1)], [2.0, 0.0]);
    assert_eq!([at(Extension::Clip, 1.2), at(Extension::Clip, 0.9)], [0.0, 2.0]);
    let far = checks(Interpolation::Linear, Extension::Repeat).color(Vec2::splat(1e30));
    assert!(far.is_finite(), "{far}");
}

#[test]
fn a_textured_floor_shows_the_texture_the_right_way_round() {
    let corner = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let scene = SceneSettings {
        materials: vec![Material { texture: Some(0), ..Default::default() }],
        corner_uvs: Some(vec![[corner[0], corner[1], corner[2]], [corner[0], corner[2], corner[3]]]),
        textures: vec![checks(Interpolation::Closest, Extension::Repeat)],
        world: Vec3::ONE,
        ..Default::default()
    };
    for (x, y, red) in [(-9.0, -9.0, 0.0), (9.0, -9.0, 2.0), (9.0, 9.0, 12.0), (0.0, 5.0, 11.0)] {
        let value = radiance(&floor(), scene.clone(), &above(x, y), 1);
        assert!((value - red).abs() < 1e-4, "({x}, {y}): {value}");
    }
}

#[test]
fn smooth_normals_are_blended_from_the_corners_and_light_reckoned_by_them() {
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    let normals = vec![[tilted; 3]; 2];
    let scene = SceneSettings { corner_normals: Some(normals), ..white(vec![point_light(Vec3::Z * 2.0, 100.0)]) };
    let render = picture(&floor(), scene.clone(), &above(0.0, 0.0), &Settings::default());
    near(f64::from(render.film.combined[0]), 100.0 / (4.0 * PI) / 4.0 * 0.8 / PI, 1e-4);
    assert!((Vec3::from_slice(&render.film.normal) - tilted).length() < 1e-6);
}

#[test]
fn passes_tell_depth_normal_and_coverage() {
    let mut camera = above(0.0, 0.0);
    camera.projection = espalier_core::render::Projection::Perspective { lens: 50.0 };
    camera.resolution = [64, 48];
    camera.matrix = Mat4::from_translation(Vec3::new(10.0, 0.0, 5.0));
    let scene = SceneSettings { world: Vec3::new(0.1, 0.2, 0.3), ..white(vec![]) };
    let mut settings = Settings { transparent: true, ..Default::default() };
    let render = picture(&floor(), scene.clone(), &camera, &settings);
    let (left, right) = (24 * 64, 24 * 64 + 63);
    assert!((render.film.depth[left] - 5.0).abs() < 1e-5);
    assert_eq!(render.film.depth[right], 1e10);
    assert_eq!(render.film.normal[3 * left..3 * left + 3], [0.0, 0.0, 1.0]);
    assert_eq!(render.film.normal[3 * right..3 * right + 3], [0.0; 3]);
    assert_eq!(render.film.combined[4 * left + 3], 1.0);
    assert_eq!(render.film.combined[4 * right..4 * right + 4], [0.0; 4]);
    settings.transparent = false;
    let render = picture(&floor(), scene, &camera, &settings);
    assert_eq!(render.film.combined[4 * right..4 * right + 4], [0.1, 0.2, 0.3, 1.0]);
}

/// A floor far from the origin and far larger than what is seen of it, lit at grazing angles: no dark spot anywhere.
#[test]
fn surfaces_do_not_shadow_themselves() {
    for (place, turn) in [(0.0, 0.0), (1e4, 0.3), (1e6, 1.0)] {
        let (turn, place) = (Quat::from_euler(glam::EulerRot::XYZ, turn, 2.0 * turn, turn), Vec3::splat(place));
        let mesh = squares(&[(place, turn * Vec3::X * 1e3, turn * Vec3::Y * 1e3)]);
        let sun = Mat4::from_quat(turn * Quat::from_rotation_x(1.57));
        let light = light(espalier_core::render::LightKind::Sun { angle: 0.0 }, sun, 1.0);
        let mut camera = above(0.0, 0.0);
        camera.resolution = [64, 64];
        camera.projection = espalier_core::render::Projection::Orthographic { scale: 100.0 };
        camera.matrix = Mat4::from_rotation_translation(turn, place + turn * Vec3::Z * 10.0);
        let film = picture(&mesh, white(vec![light]), &camera, &Settings::default()).film;
        let dark = film.combined.chunks(4).filter(|rgba| rgba[0] <= 0.0).count();
        assert_eq!(dark, 0, "of 4096 at {place}");
    }
}

#[test]
fn unusable_scenes_are_told_apart() {
    let refused = |settings: SceneSettings, word: &str| match Scene::new(floor(), settings) {
        Err(Error::Scene(message)) => assert!(message.contains(word), "{message}"),
        other => panic!("{other:?}"),
    };
    let with = SceneSettings::default;
    refused(SceneSettings { materials: vec![], ..with() }, "material");
    refused(SceneSettings { material_index: Some(vec![0]), ..with() }, "material_index");
    refused(SceneSettings { material_index: Some(vec![0, 1]), ..with() }, "triangle 1");
    refused(SceneSettings { corner_normals: Some(vec![[Vec3::Z; 3]]), ..with() }, "corner_normals");
    refused(SceneSettings { corner_normals: Some(vec![[Vec3::NAN; 3]; 2]), ..with() }, "triangle 0");
    refused(SceneSettings { corner_uvs: Some(vec![[Vec2::ZERO; 3]; 3]), ..with() }, "corner_uvs");
    refused(SceneSettings { world: Vec3::NAN, ..with() }, "world");
    let textured = Material { texture: Some(0), ..Default::default() };
    refused(SceneSettings { materials: vec![textured], ..with() }, "texture");
    let mut lamp = point_light(Vec3::NAN, 1.0);
    refused(SceneSettings { lights: vec![lamp.clone()], ..with() }, "light 0");
    lamp = point_light(Vec3::Z, f32::INFINITY);
    refused(SceneSettings { lights: vec![point_light(Vec3::Z, 1.0), lamp], ..with() }, "light 1");
    assert!(Texture::new([0, 1], vec![], Interpolation::Linear, Extension::Clip).is_err());
    assert!(Texture::new([1, 1], vec![Vec4::NAN], Interpolation::Linear, Extension::Clip).is_err());
}
