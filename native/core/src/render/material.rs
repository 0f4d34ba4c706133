//! What surfaces are made of.

use glam::Vec3;

/// A surface: Lambert's diffuse reflection of the base colour, or a mirror, and light of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Scene-linear RGB, 0 to 1.
    pub base_color: Vec3,
    /// Index of the texture that takes the place of the base colour.
    pub texture: Option<u32>,
    /// 0 for dielectrics, 1 for metals.
    pub metallic: f32,
    /// 0 for smooth, 1 for rough.
    pub roughness: f32,
    /// Radiance sent out on both sides, seen by camera and mirrors.
    pub emission: Vec3,
}

/// Surfaces at least this metallic can be mirrors.
pub const MIRROR_METALLIC: f32 = 0.5;

/// Metals at most this rough are mirrors.
pub const MIRROR_ROUGHNESS: f32 = 0.2;

impl Default for Material {
    /// Blender's new material.
    fn default() -> Self {
        Self { base_color: Vec3::splat(0.8), texture: None, metallic: 0.0, roughness: 0.5, emission: Vec3::ZERO }
    }
}

impl Material {
    /// Whether it reflects like a mirror: a smooth metal.
    #[inline]
    pub fn is_mirror(&self) -> bool {
        self.metallic >= MIRROR_METALLIC && self.roughness <= MIRROR_ROUGHNESS
    }
}

/// Schlick's reflectance of a metal whose colour at normal incidence is `base`: Blender's Principled BSDF with a white
/// specular tint. Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", CGF 13(3), 1994.
#[inline]
pub fn metal_reflectance(base: Vec3, cosine: f32) -> Vec3 {
    let grazing = (1.0 - cosine.clamp(0.0, 1.0)).powi(5);
    base + (Vec3::ONE - base) * grazing
}
