//! Lights from mappings.

use std::f32::consts::{FRAC_PI_4, PI};

use espalier_core::render::{Bulb, Light, LightKind};
use glam::Vec3;
use pyo3::prelude::*;

use crate::fields::Fields;

/// What a light can have.
pub const LIGHT: [&str; 15] = [
    "kind",
    "matrix",
    "color",
    "power",
    "radius",
    "soft_falloff",
    "angle",
    "spot_size",
    "spot_blend",
    "shape",
    "size",
    "size_y",
    "spread",
    "normalize",
    "shadow",
];

#[derive(Clone, Copy)]
enum Kind {
    Point,
    Sun,
    Spot,
    Area,
}

const KINDS: [(&str, Kind); 4] =
    [("point", Kind::Point), ("sun", Kind::Sun), ("spot", Kind::Spot), ("area", Kind::Area)];

/// Of an area: whether it is round, and whether its height is its own.
const SHAPES: [(&str, (bool, bool)); 4] =
    [("square", (false, false)), ("rectangle", (false, true)), ("disk", (true, false)), ("ellipse", (true, true))];

/// A light; what is left out is as in Blender's new light, and what its kind does not use is passed over.
pub fn light(fields: &Fields<'_>) -> PyResult<Light> {
    Ok(Light {
        kind: kind(fields)?,
        matrix: fields.matrix("matrix")?,
        color: fields.color("color", Vec3::ONE)?,
        power: fields.number("power", 10.0)?,
        normalize: fields.flag("normalize", true)?,
        shadow: fields.flag("shadow", true)?,
    })
}

fn kind(fields: &Fields<'_>) -> PyResult<LightKind> {
    Ok(match fields.required_choice("kind", &KINDS)? {
        Kind::Point => LightKind::Point { bulb: bulb(fields)? },
        Kind::Sun => LightKind::Sun { angle: fields.number("angle", 0.0)? },
        Kind::Spot => LightKind::Spot {
            bulb: bulb(fields)?,
            size: fields.number("spot_size", FRAC_PI_4)?,
            blend: fields.number("spot_blend", 0.15)?,
        },
        Kind::Area => area(fields)?,
    })
}

fn bulb(fields: &Fields<'_>) -> PyResult<Bulb> {
    Ok(Bulb { radius: fields.number("radius", 0.0)?, soft_falloff: fields.flag("soft_falloff", true)? })
}

fn area(fields: &Fields<'_>) -> PyResult<LightKind> {
    let (round, oblong) = fields.choice("shape", &SHAPES, (false, false))?;
    let width = fields.number("size", 1.0)?;
    let height = if oblong { fields.number("size_y", 1.0)? } else { width };
    Ok(LightKind::Area { round, size: [width, height], spread: fields.number("spread", PI)? })
}
