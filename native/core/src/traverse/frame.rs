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
//!   error of the sheared vertices (at most 8uR, Woop et al. 2013, with a slope rounded twice) and the subtraction of
//!   the centre sum to less than 22uR. Boxes are therefore tested dilated by [`DILATION`]·R, which costs nothing: it is
//!   part of the two biases.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3, Vec3A};

use crate::{
    bounds::Bounds,
    ray::{Hit, MISS, Ray},
};

/// Origins beyond this many half extents from the scene's centre are brought near.
pub const NEAR: f32 = 4.0;

/// Half a unit in the last place of single precision, u in the module's text.
pub(super) const ROUNDING: f32 = 1.0 / (1 << 24) as f32;

/// Boxes are tested grown by this share of R, see the module's text.
pub const DILATION: f32 = 32.0 * ROUNDING;

/// Below this share of the largest component, a direction component is treated as zero: over the whole scene it moves
/// a ray by far less than the dilation, and its inverse stays finite.
pub(super) const PARALLEL: f32 = 1e-18;

/// Largest components of directions that [`inverse`] may be asked about as they are.
const INVERTIBLE: std::ops::RangeInclusive<f32> = 1e-18..=1e18;

/// The same as bits, in which what is not a number is greater than all that is.
const INVERTIBLE_BITS: std::ops::RangeInclusive<u32> = INVERTIBLE.start().to_bits()..=INVERTIBLE.end().to_bits();

/// The bits of a number's sign, and those of its exponent.
const SIGN: u32 = 1 << 31;
const EXPONENT: u32 = f32::INFINITY.to_bits();

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

    /// Origins no farther than this from the centre, in any coordinate, are near.
    #[inline(always)]
    fn near(&self) -> f32 {
        (NEAR * self.half_extent).min(f32::MAX)
    }

    /// The largest error of position, in any coordinate, of any ray in its frame: what cells must be dilated by.
    pub fn margin(&self) -> f32 {
        DILATION * (NEAR + 2.0) * self.half_extent + f32::MIN_POSITIVE
    }
}

/// See the module's text. Two cache lines, [`Slabs`] and [`Shears`]: what box tests read, then what triangle tests read.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Frame {
    /// Inverse of the direction, finite.
    pub inverse: [f32; 3],
    /// What is added to `plane * inverse` for the near planes of dilated boxes.
    pub near_bias: [f32; 3],
    /// What is added to `plane * inverse` for the far planes of dilated boxes.
    pub far_bias: [f32; 3],
    /// Origin relative to the centre of the domain.
    pub local: [f32; 3],
    /// The interval, in the frame's own units.
    pub tmin: f32,
    /// The interval, in the frame's own units.
    pub tmax: f32,
    /// Nothing yet: what [`Slabs`] has here.
    pub(super) found: Found,
    /// Origin of the triangle test, in the mesh's own coordinates.
    pub origin: [f32; 3],
    /// Inverse of the dominant component of the direction.
    pub steepness: f32,
    /// Direction, its largest component in [1, 2).
    pub direction: [f32; 3],
    /// The direction's dominant component.
    pub depth: f32,
    /// Direction over its dominant component, for the sheared x and y.
    pub shear: [f32; 2],
    /// Axes in the order x, y, z of the sheared space; z is the direction's dominant one.
    pub axes: [u32; 3],
    pub(super) scale: f32,
    pub(super) advance: f64,
}

/// The first hit so far; a parameter behind it is the end of the interval.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Found {
    /// A parameter before it.
    pub low: f32,
    /// Its triangle, or [`MISS`].
    pub primitive: u32,
}

/// The first line of a frame, and what its ray has found so far: all that box tests read. Streams have these lines side by
/// side: of two-line frames in turns, box tests use every other set of the first-level cache. What belongs to an axis's near
/// and far planes stands side by side, to be read by one load; a single ray would take 1.02 times as long to write it so.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Slabs {
    /// See [`Frame::inverse`].
    pub inverse: [f32; 3],
    /// Along every axis [`Frame::near_bias`] and [`Frame::far_bias`].
    pub bias: [[f32; 2]; 3],
    local: [f32; 3],
    /// See [`Frame::tmin`].
    pub tmin: f32,
    /// Nothing beyond is of interest any more.
    pub tmax: f32,
    /// The first hit.
    pub found: Found,
}

/// The second line of a frame: all that triangle tests read.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Shears {
    /// See [`Frame::origin`].
    pub origin: [f32; 3],
    /// See [`Frame::steepness`].
    pub steepness: f32,
    direction: [f32; 3],
    depth: f32,
    /// See [`Frame::shear`].
    pub shear: [f32; 2],
    /// See [`Frame::axes`].
    pub axes: [u32; 3],
    scale: f32,
    advance: f64,
}

impl Slabs {
    /// The interval.
    #[inline(always)]
    pub fn interval(&self) -> &[f32; 2] {
        let [.., interval, _]: &[[f32; 2]; 8] = bytemuck::cast_ref(self);
        interval
    }

    /// The interval and what was found, in a row; the triangle is bits.
    #[inline(always)]
    pub fn standing(&self) -> &[f32; 4] {
        let rows: &[[f32; 4]; 4] = bytemuck::cast_ref(self);
        &rows[3]
    }
}

impl Shears {
    /// In rows: origin and steepness, direction and depth, shear and two axes; axes are bits.
    #[inline(always)]
    pub fn rows(&self) -> [&[f32; 4]; 3] {
        let rows: &[[f32; 4]; 4] = bytemuck::cast_ref(self);
        [&rows[0], &rows[1], &rows[2]]
    }

    /// [`Frame::parameter`].
    #[inline(always)]
    pub fn parameter(&self, t: f32) -> f32 {
        parameter(t, self.scale, self.advance)
    }
}

impl Frame {
    /// The frame of a ray, or `None` where the ray is not a number, not finite, or has no direction.
    #[inline(always)]
    pub fn new(ray: &Ray, domain: &Domain) -> Option<Self> {
        let mut frame = Self::zeroed();
        frame.set(ray, domain).then_some(frame)
    }

    /// Become what [`Frame::new`] gives; false where there is none, and the frame is then unspecified. In place: copies
    /// of a frame that was written number by number wait for all of the numbers. The ray's are read one by one, since a
    /// caller may have just written them so, and are three of a vector from then on. What no usual ray asks for is left to
    /// [`Frame::set_unusual`]; single rays take 1/1.04 of the time so (a Xeon, seven scenes).
    #[inline(always)]
    pub(super) fn set(&mut self, ray: &Ray, domain: &Domain) -> bool {
        let Ray { origin, direction, tmin, tmax } = ray.read_alone();
        let size = |component: f32| component.to_bits() & !SIGN;
        let largest = size(direction.x).max(size(direction.y)).max(size(direction.z));
        let origin = Vec3A::from(origin);
        let local = origin - Vec3A::from(domain.centre);
        let is_near = local.abs().cmple(Vec3A::splat(domain.near())).all();
        if !INVERTIBLE_BITS.contains(&largest) || !is_near || tmin.partial_cmp(&tmax).is_none() {
            return self.set_unusual(ray, domain);
        }
        let exponent = largest & EXPONENT;
        let (scale, length) = (f32::from_bits((254 << 23) - exponent), f32::from_bits(exponent));
        let direction = Vec3A::from(direction);
        let place = (local, local.abs().max_element());
        let greatest = f32::from_bits(largest & !EXPONENT | 1.0f32.to_bits());
        let directions = (direction * scale, inverse(direction, length), greatest);
        self.set_near(origin, place, directions, (tmin * length, tmax * length), domain);
        self.scale = scale;
        true
    }

    /// The same for any ray.
    #[cold]
    #[inline(never)]
    fn set_unusual(&mut self, ray: &Ray, domain: &Domain) -> bool {
        let &Ray { origin, direction, tmin, tmax } = ray;
        let (origin, direction) = (Vec3A::from(origin), Vec3A::from(direction));
        let largest = direction.abs().max_element();
        if !origin.is_finite() || !direction.is_finite() || largest < 1e-37 || tmin.partial_cmp(&tmax).is_none() {
            return false;
        }
        let exponent = largest.to_bits() >> 23;
        let power = |exponent: u32| f32::from_bits(exponent << 23);
        let (scale, length) = if exponent < 254 { (power(254 - exponent), power(exponent)) } else { (0.5, 2.0) };
        let local = origin - Vec3A::from(domain.centre);
        let reach = local.abs().max_element();
        if reach > domain.near() {
            self.set_from_afar(ray, domain, scale);
            return true;
        }
        let interval = (tmin * length, tmax * length);
        let inverse =
            if INVERTIBLE.contains(&largest) { inverse(direction, length) } else { inverse(direction * scale, 1.0) };
        self.set_near(origin, (local, reach), (direction * scale, inverse, largest * scale), interval, domain);
        self.scale = scale;
        true
    }

    /// Become the frame of a ray whose origin is near; `local` is it relative to the centre, `reach` the largest
    /// component of that, and direction, [`inverse`], largest component and interval are scaled already.
    #[inline(always)]
    pub(super) fn set_near(
        &mut self,
        origin: Vec3A,
        (local, reach): (Vec3A, f32),
        (direction, inverse, largest): (Vec3A, Vec3A, f32),
        (tmin, tmax): (f32, f32),
        domain: &Domain,
    ) {
        let margin = DILATION * (reach + domain.half_extent) + f32::MIN_POSITIVE;
        let (bias, slack) = (-local * inverse, inverse.abs() * margin);
        self.inverse = inverse.to_array();
        self.near_bias = (bias - slack).to_array();
        self.far_bias = (bias + slack).to_array();
        self.local = local.to_array();
        self.tmin = tmin;
        self.tmax = tmax;
        self.found = Found { low: tmax, primitive: MISS };
        self.origin = origin.to_array();
        self.direction = direction.to_array();
        let [x, y, z] = in_order(direction, largest);
        self.axes = [x as u32, y as u32, z as u32];
        self.depth = self.direction[z as usize];
        self.steepness = self.inverse[z as usize];
        self.shear = [self.direction[x as usize] * self.steepness, self.direction[y as usize] * self.steepness];
        self.scale = 1.0;
        self.advance = 0.0;
    }

    /// Become the frame of a ray whose origin is far, begun two half extents before the closest approach to the scene's
    /// centre. A ray that meets the scene's bounding sphere (radius at most √3 half extents) is then within √7 half
    /// extents of the centre; of one that does not, the interval is made empty.
    #[cold]
    #[inline(never)]
    fn set_from_afar(&mut self, ray: &Ray, domain: &Domain, scale: f32) {
        let direction = ray.direction * scale;
        let (o, d) = (ray.origin.as_dvec3(), direction.as_dvec3());
        let to_centre: DVec3 = domain.centre.as_dvec3() - o;
        let advance = to_centre.dot(d) / d.length_squared() - 2.0 * f64::from(domain.half_extent) / d.length();
        let direction = Vec3A::from(direction);
        let origin = (o + d * advance).as_vec3a();
        let local = origin - Vec3A::from(domain.centre);
        let reach = local.abs().max_element();
        let largest = direction.abs().max_element();
        if reach > domain.near() {
            let nowhere = (f32::INFINITY, f32::NEG_INFINITY);
            let centre = domain.centre.into();
            self.set_near(centre, (Vec3A::ZERO, 0.0), (direction, inverse(direction, 1.0), largest), nowhere, domain);
            return;
        }
        let shifted = |t: f32| (f64::from(t) / f64::from(scale) - advance) as f32;
        let interval = (shifted(ray.tmin), shifted(ray.tmax));
        self.set_near(origin, (local, reach), (direction, inverse(direction, 1.0), largest), interval, domain);
        self.scale = scale;
        self.advance = advance;
    }

    /// Where the ray enters a dilated box, given relative to the centre of the domain, if it does before `limit`.
    #[inline(always)]
    pub fn enter(&self, lower: &[f32; 3], upper: &[f32; 3], limit: f32) -> Option<f32> {
        let (mut near, mut far) = (self.tmin, limit);
        for k in 0..3 {
            let (first, last) = if self.inverse[k] < 0.0 { (upper[k], lower[k]) } else { (lower[k], upper[k]) };
            near = near.max(first * self.inverse[k] + self.near_bias[k]);
            far = far.min(last * self.inverse[k] + self.far_bias[k]);
        }
        (near <= far).then_some(near)
    }

    /// The first line, as streams have it.
    #[inline(always)]
    pub fn slabs(&self) -> Slabs {
        let ([nx, ny, nz], [fx, fy, fz]) = (self.near_bias, self.far_bias);
        let Self { inverse, local, tmin, tmax, found, .. } = *self;
        Slabs { inverse, bias: [[nx, fx], [ny, fy], [nz, fz]], local, tmin, tmax, found }
    }

    /// The second line.
    #[inline(always)]
    pub fn shears(&self) -> &Shears {
        let [_, shears]: &[Shears; 2] = bytemuck::cast_ref(self);
        shears
    }

    /// The frame of two lines; it ends where nothing is of interest any more.
    #[inline(always)]
    pub fn of_lines(slabs: &Slabs, shears: &Shears) -> Self {
        let [[nx, fx], [ny, fy], [nz, fz]] = slabs.bias;
        let mut frame: Self = bytemuck::cast([Shears::zeroed(), *shears]);
        let Slabs { inverse, local, tmin, tmax, found, .. } = *slabs;
        (frame.inverse, frame.near_bias, frame.far_bias) = (inverse, [nx, ny, nz], [fx, fy, fz]);
        (frame.local, frame.tmin, frame.tmax, frame.found) = (local, tmin, tmax, found);
        frame
    }

    /// The signs of the direction: bit `k` is set where it falls along axis `k`.
    #[inline]
    pub fn octant(&self) -> usize {
        let sign = |k: usize| (self.inverse[k].to_bits() >> 31) as usize;
        sign(0) | sign(1) << 1 | sign(2) << 2
    }

    /// A hit in the frame's units as one in the ray's own.
    #[inline(always)]
    pub fn in_ray_units(&self, hit: Hit) -> Hit {
        if hit.primitive == MISS { Hit::MISS } else { Hit { t: self.parameter(hit.t), ..hit } }
    }

    /// A parameter of the frame in lengths of the ray's own direction, from its own origin.
    #[inline]
    pub fn parameter(&self, t: f32) -> f32 {
        parameter(t, self.scale, self.advance)
    }
}

#[inline(always)]
fn parameter(t: f32, scale: f32, advance: f64) -> f32 {
    if advance == 0.0 { t * scale } else { ((f64::from(t) + advance) * f64::from(scale)) as f32 }
}

/// The inverse of a direction over a power of two, `length`: its own inverse times that, to the bit, where neither over-
/// nor underflows. So the division begins before the length is known; everything waits for it.
#[inline(always)]
pub(super) fn inverse(direction: Vec3A, length: f32) -> Vec3A {
    let parallel = direction.abs().cmplt(Vec3A::splat(PARALLEL * length));
    Vec3A::select(parallel, Vec3A::splat(1.0 / PARALLEL).copysign(direction), direction.recip() * length)
}

/// An axis.
#[derive(Debug, Clone, Copy)]
#[repr(u32)]
enum Axis {
    X,
    Y,
    Z,
}

/// The axes in cyclic order so that the one along which a direction is steepest, the first of several, is the last; for one
/// ray what [`super::setup::Steepest`] is for eight. Without branches: which axis it is cannot be predicted.
#[inline(always)]
fn in_order(direction: Vec3A, largest: f32) -> [Axis; 3] {
    use Axis::{X, Y, Z};
    // The last row is never read; a power of two takes no test of the index.
    const ORDERS: &[[Axis; 3]; 4] = &[[Y, Z, X], [Z, X, Y], [X, Y, Z], [X, Y, Z]];
    let steepest = direction.abs().cmpge(Vec3A::splat(largest)).bitmask().trailing_zeros();
    ORDERS[(steepest & 3) as usize]
}
