//! Lights against Cycles: radiance of a white floor, 1 m beside the foot of a light, as Cycles 4.5.15 rendered it with 64
//! samples (mean of 16 by 16 pixels over 0.2 m). The Cycles at hand is asked by
//! `tests/headless/test_lights_and_cameras_against_cycles.py`.

mod common;

use common::picture::*;
use espalier_core::render::{Bulb, LightKind, Projection};
use glam::{Mat4, Vec3};

/// Name, light, matrix, power, whether normalised, and what Cycles saw.
type Case = (&'static str, LightKind, Mat4, f32, bool, f64);

fn cases() -> Vec<Case> {
    let up = Mat4::from_translation(Vec3::Z * 2.0);
    let bulb = |radius: f32, soft_falloff: bool| Bulb { radius, soft_falloff };
    let slanted = Mat4::from_rotation_x(0.5);
    let spot = |radius: f32, soft: bool| LightKind::Spot { bulb: bulb(radius, soft), size: 1.2, blend: 0.7 };
    let area = |round, size, spread| LightKind::Area { round, size, spread };
    let pi = std::f32::consts::PI;
    vec![
        ("point_hard", LightKind::Point { bulb: bulb(0.0, true) }, up, 100.0, true, 0.45266974),
        ("point_soft", LightKind::Point { bulb: bulb(0.8, true) }, up, 100.0, true, 0.4013369),
        ("point_sphere", LightKind::Point { bulb: bulb(0.8, false) }, up, 100.0, true, 0.4526835),
        ("point_sphere_unnorm", LightKind::Point { bulb: bulb(0.8, false) }, up, 100.0, false, 3.6406972),
        ("sun", LightKind::Sun { angle: 0.0 }, slanted, 3.0, true, 0.83802897),
        ("sun_wide", LightKind::Sun { angle: 1.5 }, slanted, 3.0, true, 0.83817333),
        ("sun_huge", LightKind::Sun { angle: 3.1 }, slanted, 3.0, true, 0.8905629),
        ("sun_unnorm", LightKind::Sun { angle: 1.0 }, slanted, 3.0, false, 0.60514903),
        ("spot", spot(0.0, true), up, 100.0, true, 0.2687499),
        ("spot_soft", spot(0.5, true), up, 100.0, true, 0.22393823),
        ("spot_sphere", spot(0.5, false), up, 100.0, true, 0.23441866),
        ("spot_scaled", spot(0.0, true), up * Mat4::from_scale(Vec3::new(2.0, 1.0, 1.0)), 100.0, true, 0.45266974),
        ("area", area(false, [1.0, 1.0], pi), up, 100.0, true, 1.5744841),
        (
            "area_scaled",
            area(false, [1.0, 0.5], pi),
            up * Mat4::from_scale(Vec3::new(2.0, 3.0, 1.0)),
            100.0,
            true,
            1.5092305,
        ),
        ("area_disk", area(true, [1.0, 1.0], pi), up, 100.0, true, 1.586184),
        ("area_ellipse", area(true, [1.0, 2.0], pi), up, 100.0, true, 1.4830866),
        ("area_spread", area(false, [1.0, 1.0], 1.5), up, 100.0, true, 3.8210123),
        ("area_unnorm", area(true, [1.0, 2.0], pi), up, 100.0, false, 2.3296273),
    ]
}

#[test]
fn lights_are_as_bright_as_in_cycles() {
    for (name, kind, matrix, power, normalize, expected) in cases() {
        let mut lamp = light(kind, matrix, power);
        lamp.normalize = normalize;
        let mut camera = above(1.0, 0.0);
        camera.projection = Projection::Orthographic { scale: 0.2 };
        camera.resolution = [16, 16];
        let value = radiance(&floor(), white(vec![lamp]), &camera, 64);
        assert!((value / expected - 1.0).abs() < 3e-3, "{name}: {value}, in Cycles {expected}");
    }
}
