//! The lit point of a hit: where it is, how it faces, what it is made of.

use glam::{DVec3, Vec2, Vec3};

use super::{material::Material, scene::Scene};
use crate::ray::Hit;

/// Half a unit in the last place, relative: the error of one rounding.
const ROUNDING: f32 = 1.0 / (1 << 24) as f32;

/// Where a surface is and how it faces. Normals are on the viewer's side.
#[derive(Debug, Clone, Copy)]
pub struct Facing {
    /// Where rays from it start: off the surface by a little more than all rounding errors, see [`offset`].
    pub origin: Vec3,
    /// The triangle's own normal.
    pub geometric: Vec3,
    /// The normal that light is reckoned by.
    pub shading: Vec3,
}

/// A point on a surface, seen from a direction.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Where it is and how it faces.
    pub facing: Facing,
    /// What it is made of.
    pub material: &'a Material,
    /// The base colour there.
    pub color: Vec3,
}

impl<'a> Surface<'a> {
    /// The surface that a ray in `direction` hit.
    #[inline]
    pub fn new(scene: &'a Scene, hit: Hit, direction: Vec3) -> Self {
        let settings = scene.settings();
        let index = settings.material_index.as_ref().map_or(0, |index| index[hit.primitive as usize]);
        let material = &settings.materials[index as usize];
        Self { facing: Facing::new(scene, hit, direction), material, color: color(scene, material, hit) }
    }
}

impl Facing {
    #[inline]
    fn new(scene: &Scene, hit: Hit, direction: Vec3) -> Self {
        let corners = scene.mesh().corners(hit.primitive);
        let normal = scene.mesh().normal(hit.primitive);
        let side = if normal.dot(direction) > 0.0 { -1.0 } else { 1.0 };
        let geometric = normal * side;
        let smooth = scene.settings().corner_normals.as_ref();
        let smooth = smooth.and_then(|normals| blend(normals[hit.primitive as usize], hit).try_normalize());
        let shading = smooth.map_or(geometric, |normal| normal * side);
        Self { origin: offset(point(corners, hit), geometric, corners), geometric, shading }
    }

    /// The mirrored direction of a ray, on the outside of the triangle even where the shading normal says otherwise.
    pub fn mirrored(&self, direction: Vec3) -> Vec3 {
        let reflected = direction - self.shading * (2.0 * direction.dot(self.shading));
        let depth = reflected.dot(self.geometric).min(0.0);
        (reflected - self.geometric * (2.0 * depth)).normalize()
    }
}

/// The hit point: on the triangle's plane up to one rounding of each coordinate, since it is reckoned in double
/// precision, and since rounded weights move it within the plane only.
#[inline]
fn point(corners: [Vec3; 3], hit: Hit) -> Vec3 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let (u, v) = (f64::from(hit.u), f64::from(hit.v));
    let point: DVec3 = a * (1.0 - u - v) + b * u + c * v;
    point.as_vec3()
}

/// The point, moved along the normal just so far that a ray from it cannot hit its own triangle, or a neighbour in the
/// same plane, by rounding.
///
/// With r the error of one rounding: the point is off the plane by at most √3 r max|p|, and moving it rounds as much
/// again. The intersection test sees corners off by at most 6 r R in every sheared coordinate, R the largest distance by
/// coordinate from the ray's origin to a corner (see [`crate::traverse::frame`]), so the plane by at most 6√3 r R. The
/// sum is below 16 r (max|p| + R). The idea is that of Wächter and Binder, "A Fast and Robust Method for Avoiding
/// Self-Intersection", Ray Tracing Gems, 2019; the bound takes the place of their constants.
#[inline]
fn offset(point: Vec3, normal: Vec3, corners: [Vec3; 3]) -> Vec3 {
    let reach = corners.iter().map(|&corner| (corner - point).abs().max_element()).fold(0.0, f32::max);
    point + normal * (16.0 * ROUNDING * (point.abs().max_element() + reach) + f32::MIN_POSITIVE)
}

#[inline]
fn blend(corners: [Vec3; 3], hit: Hit) -> Vec3 {
    corners[0] * (1.0 - hit.u - hit.v) + corners[1] * hit.u + corners[2] * hit.v
}

#[inline]
fn color(scene: &Scene, material: &Material, hit: Hit) -> Vec3 {
    let settings = scene.settings();
    let Some(texture) = material.texture else { return material.base_color };
    let corners = settings.corner_uvs.as_ref().map_or([Vec2::ZERO; 3], |uvs| uvs[hit.primitive as usize]);
    let uv = corners[0] * (1.0 - hit.u - hit.v) + corners[1] * hit.u + corners[2] * hit.v;
    settings.textures[texture as usize].color(uv)
}
