//! Lights against the laws they obey.

mod common;

use std::f64::consts::PI;

use common::picture::*;
use espalier_core::render::{Bulb, Light, LightKind};
use glam::{Mat4, Vec3};

fn on_floor(light: Light, x: f32, samples: u32) -> f64 {
    radiance(&floor(), white(vec![light]), &above(x, 0.0), samples)
}

fn area(round: bool, size: [f32; 2], spread: f32, height: f32, power: f32) -> Light {
    light(LightKind::Area { round, size, spread }, Mat4::from_translation(Vec3::Z * height), power)
}

#[test]
fn a_point_light_obeys_the_inverse_square_and_cosine_laws() {
    for (height, aside) in [(1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (2.0, 1.0), (2.0, 4.0)] {
        let square = f64::from(height * height + aside * aside);
        let cosine = f64::from(height) / square.sqrt();
        let expected = 100.0 / (4.0 * PI) / square * cosine / PI;
        near(on_floor(point_light(Vec3::Z * height, 100.0), aside, 1), expected, 1e-4);
    }
}

/// A sphere wholly above the horizon lights like the point in its middle; so does a disk up to the share it covers.
#[test]
fn a_large_point_light_keeps_its_power() {
    for (soft_falloff, square) in [(false, 4.0), (true, 4.0 + 0.25)] {
        let kind = LightKind::Point { bulb: Bulb { radius: 0.5, soft_falloff } };
        let value = on_floor(light(kind, Mat4::from_translation(Vec3::Z * 2.0), 100.0), 0.0, 4096);
        near(value, 100.0 / (4.0 * PI) / square / PI, 2e-3);
    }
}

/// Inside a sphere of radiance P / (4π² r²) a white surface takes that very radiance on.
#[test]
fn a_surface_inside_a_sphere_light_sees_its_radiance_all_around() {
    let kind = LightKind::Point { bulb: Bulb { radius: 2.0, soft_falloff: false } };
    let value = on_floor(light(kind, Mat4::from_translation(Vec3::new(0.3, 0.2, 1.0)), 100.0), 0.0, 64);
    near(value, 100.0 / (4.0 * PI * PI * 4.0), 1e-3);
}

/// Cycles' rule: 4 π r², and 4 without a radius.
#[test]
fn points_that_are_not_normalised_shine_by_their_surface() {
    for (radius, surface) in [(0.0, 4.0), (0.5, PI)] {
        let kind = LightKind::Point { bulb: Bulb { radius, soft_falloff: false } };
        let mut lamp = light(kind, Mat4::from_translation(Vec3::Z * 2.0), 100.0);
        lamp.normalize = false;
        near(on_floor(lamp, 0.0, 256), surface * 100.0 / (4.0 * PI) / 4.0 / PI, 2e-3);
    }
}

/// Every point under a wide light with a narrow spread sees its beam straight above, with little noise.
#[test]
fn narrow_spreads_are_beams() {
    for (round, surface) in [(false, 4.0), (true, PI)] {
        let lamp = area(round, [2.0, 2.0], 0.02, 2.0, 100.0);
        for x in [0.0, 0.5, 0.95] {
            near(on_floor(lamp.clone(), x, 256), 100.0 / surface / PI, 1e-2);
        }
        assert_eq!(on_floor(lamp, 1.05, 64), 0.0);
    }
}

#[test]
fn an_area_without_surface_is_dark() {
    assert_eq!(on_floor(area(false, [0.0, 1.0], 3.0, 2.0, 100.0), 0.0, 16), 0.0);
}

#[test]
fn a_sun_gives_its_irradiance_whatever_its_angle() {
    for angle in [0.0, 0.01, 0.5, 2.0] {
        near(on_floor(light(LightKind::Sun { angle }, Mat4::IDENTITY, 3.0), 0.0, 4096), 3.0 / PI, 2e-3);
    }
    let slanted = Mat4::from_rotation_x(1.0);
    near(on_floor(light(LightKind::Sun { angle: 0.0 }, slanted, 3.0), 0.0, 1), 3.0 / PI * f64::cos(1.0), 1e-4);
}

#[test]
fn a_sun_from_below_the_floor_gives_nothing() {
    assert_eq!(on_floor(light(LightKind::Sun { angle: 0.0 }, Mat4::from_rotation_x(2.0), 3.0), 0.0, 1), 0.0);
}

#[test]
fn a_spot_is_full_in_its_core_blended_at_its_edge_and_dark_outside() {
    let spot = |blend: f32| {
        let kind = LightKind::Spot { bulb: HARD, size: 1.0, blend };
        light(kind, Mat4::from_translation(Vec3::Z * 2.0), 100.0)
    };
    let point = |angle: f64| 100.0 / (4.0 * PI) / 4.0 * angle.cos().powi(3) / PI;
    let at = |angle: f64| (2.0 * angle.tan()) as f32;
    near(on_floor(spot(0.5), 0.0, 1), point(0.0), 1e-4);
    near(on_floor(spot(0.0), at(0.49), 1), point(0.49), 1e-3);
    assert_eq!(on_floor(spot(0.5), at(0.51), 1), 0.0);
    let edge = f64::cos(0.5);
    let x = (f64::cos(0.4) - edge) / (1.0 - edge) / 0.5;
    near(on_floor(spot(0.5), at(0.4), 1), point(0.4) * (x * x * (3.0 - 2.0 * x)), 1e-3);
}

#[test]
fn a_spot_scaled_along_one_axis_has_an_elliptic_cone() {
    let kind = LightKind::Spot { bulb: HARD, size: 1.0, blend: 0.0 };
    let matrix = Mat4::from_translation(Vec3::Z * 2.0) * Mat4::from_scale(Vec3::new(2.0, 1.0, 1.0));
    let value = |x: f32, y: f32| radiance(&floor(), white(vec![light(kind, matrix, 100.0)]), &above(x, y), 1);
    assert!(value(1.6, 0.0) > 0.0 && value(0.0, 1.0) > 0.0);
    assert_eq!(value(0.0, 1.6), 0.0);
}

/// A small piece of floor under the middle of a rectangle a by b at height h sees it with the form factor
/// (Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", B-3): four quarters of
/// (X/√(1+X²) atan(Y/√(1+X²)) + Y/√(1+Y²) atan(X/√(1+Y²))) / 2π with X = a/2h, Y = b/2h.
fn rectangle_factor(a: f64, b: f64, h: f64) -> f64 {
    let (x, y) = (a / (2.0 * h), b / (2.0 * h));
    let half = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
    4.0 * (half(x, y) + half(y, x)) / (2.0 * PI)
}

#[test]
fn area_lights_light_by_their_form_factor() {
    let (power, pi) = (100.0, std::f32::consts::PI);
    for (size, height) in [([1.0, 1.0], 2.0), ([3.0, 0.5], 1.0), ([2.0, 2.0], 0.5)] {
        let radiance = f64::from(power) / (PI * f64::from(size[0] * size[1]));
        let factor = rectangle_factor(f64::from(size[0]), f64::from(size[1]), f64::from(height));
        near(on_floor(area(false, size, pi, height, power), 0.0, 1 << 14), radiance * factor, 5e-3);
    }
    let disk = f64::from(power) / (PI * PI * 0.25) * (0.25 / (0.25 + 4.0));
    near(on_floor(area(true, [1.0, 1.0], pi, 2.0, power), 0.0, 1 << 14), disk, 5e-3);
}

#[test]
fn area_lights_are_dark_on_their_back_and_can_scale_with_their_size() {
    let pi = std::f32::consts::PI;
    let mut back = area(false, [1.0, 1.0], pi, 2.0, 100.0);
    back.matrix *= Mat4::from_rotation_x(pi);
    assert_eq!(on_floor(back, 0.0, 16), 0.0);
    let mut scaled = area(true, [2.0, 3.0], pi, 2.0, 100.0);
    let normal = on_floor(scaled.clone(), 0.0, 256);
    scaled.normalize = false;
    near(on_floor(scaled, 0.0, 256), normal * PI * 1.5, 1e-4);
}

/// A grid in front of an area light takes nothing from its power: summed over the floor it is as bright as without.
#[test]
fn spread_keeps_the_power_and_bounds_the_angle() {
    let lamp = area(false, [0.1, 0.1], 1.0, 2.0, 100.0);
    assert_eq!(on_floor(lamp.clone(), 2.0, 16), 0.0);
    let rings = 200;
    let flux: f64 = (0..rings)
        .map(|ring| {
            let (inner, outer) =
                (1.3 * f64::from(ring) / f64::from(rings), 1.3 * f64::from(ring + 1) / f64::from(rings));
            let value = on_floor(lamp.clone(), (0.5 * (inner + outer)) as f32, 16);
            value * PI * PI * (outer * outer - inner * inner)
        })
        .sum();
    near(flux, 100.0, 1e-2);
}

#[test]
fn shadows_are_cast_where_a_light_has_them() {
    let above_floor = Vec3::Z;
    let mesh = squares(&[(Vec3::ZERO, Vec3::X * 10.0, Vec3::Y * 10.0), (above_floor, Vec3::X * 0.1, Vec3::Y * 0.1)]);
    let mut lamp = point_light(Vec3::new(0.0, 0.0, 2.0), 100.0);
    let mut below = above(0.0, 0.0);
    below.matrix = Mat4::from_translation(Vec3::Z * 0.9);
    assert_eq!(radiance(&mesh, white(vec![lamp.clone()]), &below, 1), 0.0);
    lamp.shadow = false;
    near(radiance(&mesh, white(vec![lamp]), &below, 1), 100.0 / (4.0 * PI) / 4.0 / PI, 1e-4);
}

#[test]
fn many_lights_are_chosen_by_their_power_without_bias() {
    let lamps: Vec<Light> = (0..50u8)
        .map(|i| point_light(Vec3::new(f32::from(i % 7) - 3.0, f32::from(i / 7) - 3.0, 2.0), 1.0 + f32::from(i)))
        .collect();
    let sum: f64 = lamps.iter().map(|lamp| on_floor(lamp.clone(), 0.0, 1)).sum();
    near(radiance(&floor(), white(lamps), &above(0.0, 0.0), 1024), sum, 5e-3);
}
