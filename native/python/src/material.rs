//! Materials and textures from mappings.

use espalier_core::render::{Extension, Interpolation, Material, Texture};
use glam::Vec4;
use pyo3::prelude::*;

use crate::{arrays, errors::OrRaise, fields::Fields};

/// What a material can have.
pub const MATERIAL: [&str; 5] = ["base_color", "texture", "metallic", "roughness", "emission"];

/// A material; what is left out is as in Blender's new material.
pub fn material(fields: &Fields<'_>) -> PyResult<Material> {
    let default = Material::default();
    Ok(Material {
        base_color: fields.color("base_color", default.base_color)?,
        texture: fields.index("texture")?,
        metallic: fields.number("metallic", default.metallic)?,
        roughness: fields.number("roughness", default.roughness)?,
        emission: fields.color("emission", default.emission)?,
    })
}

/// What a texture can have.
pub const TEXTURE: [&str; 3] = ["pixels", "interpolation", "extension"];

const INTERPOLATIONS: [(&str, Interpolation); 2] =
    [("linear", Interpolation::Linear), ("closest", Interpolation::Closest)];

const EXTENSIONS: [(&str, Extension); 3] =
    [("repeat", Extension::Repeat), ("extend", Extension::Extend), ("clip", Extension::Clip)];

/// A texture.
pub fn texture(fields: &Fields<'_>) -> PyResult<Texture> {
    let pixels = fields.array("pixels", "(h, w, 4)", |shape| matches!(shape, [_, _, 4]))?;
    let size = [pixels.shape()[1], pixels.shape()[0]];
    let interpolation = fields.choice("interpolation", &INTERPOLATIONS, Interpolation::Linear)?;
    let extension = fields.choice("extension", &EXTENSIONS, Extension::Repeat)?;
    let (py, values) = (fields.py(), pixels.values());
    let make = || {
        let pixels = arrays::grouped::<_, 4>(values, "a texture", |&pixel| Vec4::from_array(pixel))?;
        Texture::new(size, pixels, interpolation, extension)
    };
    py.detach(make).map_err(|error| fields.named(error)).or_raise(py)
}
