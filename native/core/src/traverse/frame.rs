//! A ray as the kernels see it: normalised, brought near, and with every constant of the tests computed once.
//!
//! All accelerators and the brute-force oracle start from the same frame, so the arithmetic that decides a hit is one
//! function of ray and triangle, whichever structure finds the triangle. Write u = 2^-24 (half a unit in the last
//! place, relative) and R = the largest distance, by component, from the origin to a corner of the scene's box.
//!
//! * The direction is scaled by a power of two (exact) until its largest component lies in [1, 2).
//! * An origin farther than [`NEAR`] half extents from the scene is moved along the ray to the scene's surroundings,
//!   in double precision; hits are reported from the true origin. So R is at most (NEAR + 2) half extents.
//! * Box and grid planes are held relative to the scene's centre, so that a scene far from the world's origin is
//!   culled as well as one at it. Their distances are one multiply-add, `plane * inverse + bias`; its error, the
//!   error of the sheared vertices (at most 6uR, Woop et al. 2013) and the subtraction of the centre sum to less than
//!   20uR. Boxes are therefore tested dilated by [`DILATION`]·R, which costs nothing: it is part of the two biases.

use glam::{DVec3, Vec3};

use crate::{bounds::Bounds, ray::Ray};

/// Origins beyond this many half extents from the scene's centre are brought near.
pub const NEAR: f32 = 4.0;

/// Boxes are tested grown by this share of R: 32u, see the module's text.
pub const DILATION: f32 = 32.0 / (1 << 24) as f32;

/// Below this share of the largest component, a direction component is treated as zero: over the whole scene it moves
/// a ray by far less than the dilation, and its inverse stays finite.
const PARALLEL: f32 = 1e-18;

/// Where the scene is, as far as the arithmetic of rays needs to know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Centre of the scene's box: planes of boxes and grids are relative to it.
    pub centre: Vec3,
    /// Half of the box's longest edge.
    pub half_extent: f32,
}

impl Domain {
    /// The domain of a scene's box.
    pub fn new(bounds: &Bounds) -> Self {
        if bounds.is_empty() {
            return Self { centre: Vec3::ZERO, half_extent: 0.0 };
        }
        let centre = bounds.centre();
        let reach = (bounds.upper - centre).max(centre - bounds.lower);
        Self { centre, half_extent: reach.max_element() }
    }

    /// The largest error of position, in any coordinate, of any ray in its frame: what cells must be dilated by.
    pub fn margin(&self) -> f32 {
        DILATION * (NEAR + 2.0) * self.half_extent + f32::MIN_POSITIVE
    }
}

/// See the module's text. Two cache lines: what box tests read, then what triangle tests read.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub struct Frame {
    /// Inverse of the direction, finite.
    pub inverse: [f32; 3],
    /// What is added to `plane * inverse` for the near planes of dilated boxes.
    pub near_bias: [f32; 3],
    /// What is added to `plane * inverse` for the far planes of dilated boxes.
    pub far_bias: [f32; 3],
    /// The interval, in the frame's own units.
    pub tmin: f32,
    /// The interval, in the frame's own units.
    pub tmax: f32,
    /// Origin relative to the centre of the domain.
    pub local: [f32; 3],
    advance: f64,
    /// Origin of the triangle test, in the mesh's own coordinates.
    pub origin: [f32; 3],
    /// Direction over its dominant component, for the sheared x and y.
    pub shear: [f32; 2],
    /// Axes in the order x, y, z of the sheared space; z is the direction's dominant one.
    pub axes: [u32; 3],
    /// Direction, its largest component in [1, 2).
    pub direction: [f32; 3],
    scale: f32,
}

impl Frame {
    /// The frame of a ray, or `None` where the ray is not a number, not finite, or has no direction.
    #[inline]
    pub fn new(ray: &Ray, domain: &Domain) -> Option<Self> {
        let largest = ray.direction.abs().max_element();
        let finite = ray.origin.is_finite() && ray.direction.is_finite() && !ray.tmin.is_nan() && !ray.tmax.is_nan();
        if !finite || largest < 1e-37 {
            return None;
        }
        let exponent = largest.to_bits() >> 23;
        let scale = f32::from_bits((254 - exponent).max(1) << 23);
        let direction = ray.direction * scale;
        let Some((origin, advance)) = bring_near(ray.origin, direction, domain) else {
            return Some(Self::near(domain.centre, direction, f32::INFINITY, f32::NEG_INFINITY, domain, scale, 0.0));
        };
        let (tmin, tmax) = interval(ray, scale, advance);
        Some(Self::near(origin, direction, tmin, tmax, domain, scale, advance))
    }

    #[inline]
    #[allow(clippy::too_many_arguments)] // The one constructor of a wide plain struct.
    fn near(origin: Vec3, direction: Vec3, tmin: f32, tmax: f32, domain: &Domain, scale: f32, advance: f64) -> Self {
        let local = origin - domain.centre;
        let margin = DILATION * (local.abs().max_element() + domain.half_extent) + f32::MIN_POSITIVE;
        let inverse = direction.to_array().map(|d| 1.0 / if d.abs() < PARALLEL { PARALLEL.copysign(d) } else { d });
        let axes = dominant_last(direction);
        let d = direction.to_array();
        let bias = |side: f32| std::array::from_fn(|k| -local[k] * inverse[k] + side * margin * inverse[k].abs());
        Self {
            origin: origin.to_array(),
            direction: d,
            axes,
            shear: [d[axes[0] as usize] / d[axes[2] as usize], d[axes[1] as usize] / d[axes[2] as usize]],
            inverse,
            near_bias: bias(-1.0),
            far_bias: bias(1.0),
            local: local.to_array(),
            tmin,
            tmax,
            scale,
            advance,
        }
    }

    /// The signs of the direction: bit `k` is set where it falls along axis `k`.
    #[inline]
    pub fn octant(&self) -> usize {
        (0..3).fold(0, |octant, k| octant | usize::from(self.inverse[k] < 0.0) << k)
    }

    /// A parameter of the frame in lengths of the ray's own direction, from its own origin.
    #[inline]
    pub fn parameter(&self, t: f32) -> f32 {
        if self.advance == 0.0 {
            t * self.scale
        } else {
            ((f64::from(t) + self.advance) * f64::from(self.scale)) as f32
        }
    }
}

/// Sheared z is the axis along which the ray is steepest.
#[inline]
fn dominant_last(direction: Vec3) -> [u32; 3] {
    let a = direction.abs();
    if a.x >= a.y && a.x >= a.z {
        [1, 2, 0]
    } else if a.y >= a.z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}

/// The interval in the frame's units. One that lies wholly outside single precision becomes empty.
#[inline]
fn interval(ray: &Ray, scale: f32, advance: f64) -> (f32, f32) {
    if advance == 0.0 {
        return (ray.tmin / scale, ray.tmax / scale);
    }
    let shifted = |t: f32| (f64::from(t) / f64::from(scale) - advance) as f32;
    (shifted(ray.tmin), shifted(ray.tmax))
}

/// The origin, moved along the ray where it is far, and how far it was moved; `None` where the ray passes the scene by.
#[inline]
fn bring_near(origin: Vec3, direction: Vec3, domain: &Domain) -> Option<(Vec3, f64)> {
    let is_near = (origin - domain.centre).abs().max_element() <= NEAR * domain.half_extent;
    if is_near { Some((origin, 0.0)) } else { approach(origin, direction, domain) }
}

/// Move a far origin to two half extents before its closest approach to the scene's centre. A ray that meets the
/// scene's bounding sphere (radius at most √3 half extents) is then within √7 half extents of the centre.
#[cold]
fn approach(origin: Vec3, direction: Vec3, domain: &Domain) -> Option<(Vec3, f64)> {
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    let to_centre: DVec3 = domain.centre.as_dvec3() - o;
    let advance = to_centre.dot(d) / d.length_squared() - 2.0 * f64::from(domain.half_extent) / d.length();
    let moved = (o + d * advance).as_vec3();
    let arrived = (moved - domain.centre).abs().max_element() <= NEAR * domain.half_extent;
    arrived.then_some((moved, advance))
}
