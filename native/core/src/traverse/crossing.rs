//! One ray against a block of triangles in single precision, with certified errors: what is surely missed, what is
//! surely hit and between which parameters, and what only the exact test can tell.
//!
//! Write u = 2^-24, and e', t' for the computed values of an edge function e and of the parameter t. The sheared
//! corners are those of the exact test, to the bit, so e errs by its two products and their difference alone:
//! |e' - e| <= u(|p| + |q|) + u|e'|, where |p| <= |q| + |e|; so by less than ε/2 + 2u|e'| for ε = 4u max|q| + 1e-25,
//! which also covers what underflows. An edge function beyond ±ε therefore has the sign it shows.
//!
//! Let D be the sum of the edge functions, Z the largest |z| of a corner, and |z-component of the direction| >= 1.
//! Where the exact test finds a hit, t is a mean of the corners' z, so |t| <= Z; and numerator and denominator, with
//! three and two roundings of sums of magnitude at most |D'| + 3.01ε, err by Z(1.5ε + 7u|D'|) and 1.5ε + 4u|D'|. With
//! the reciprocal and two products, and the exact t rounded once, |t' - t| <= Z(3ε/|D'| + 16u). The interval kept is
//! twice as wide, which covers its own roundings and makes t lie strictly inside. Z is at least 1e-18, for underflow.
//! Whatever overflows makes the interval's ends not a number, which nothing here takes for certain.

use super::frame::Shears;
use crate::{
    simd::{Arithmetic, Simd, read_alone},
    triangle::{Block, LANES},
};

/// 4u.
const EDGE_ERROR: f32 = 4.0 / (1 << 24) as f32;
/// See the module's text.
const LEAST_ERROR: f32 = 1e-25;
/// 32u.
const DEPTH_ERROR: f32 = 32.0 / (1 << 24) as f32;
/// See the module's text.
const LEAST_DEPTH: f32 = 1e-18;

/// Triangles in the sheared space of a ray, or one triangle in those of several rays.
pub struct Sheared<S: Arithmetic> {
    depth: [S::F32; 3],
    edge: [S::F32; 3],
    product: [S::F32; 3],
}

/// Where rays cross triangles, if they do.
pub struct Crossings<S: Arithmetic> {
    /// For every lane a parameter before the crossing.
    pub low: S::F32,
    /// And one behind it.
    pub high: S::F32,
    /// The lanes that are surely hit within the interval asked for.
    pub sure: u32,
    /// The lanes that are surely not hit within it.
    pub outside: u32,
}

impl<S: Simd> Sheared<S> {
    /// A block's triangles before one ray.
    #[inline(always)]
    pub fn of_block(simd: S, shears: &Shears, block: &Block) -> Self {
        // Both would be read together with their neighbours.
        let slopes = [simd.splat(read_alone(&shears.shear[0])), simd.splat(read_alone(&shears.shear[1]))];
        let a = sheared(simd, shears, slopes, &block.corner[0]);
        let b = sheared(simd, shears, slopes, &block.corner[1]);
        let c = sheared(simd, shears, slopes, &block.corner[2]);
        Self::of_corners(simd, [a, b, c])
    }
}

/// Corners of a block in the sheared space of a ray.
#[inline(always)]
fn sheared<S: Simd>(simd: S, shears: &Shears, slopes: [S::F32; 2], corner: &[[f32; LANES]; 3]) -> [S::F32; 3] {
    let [x, y, z] = shears.axes;
    let x = simd.sub(simd.load(&corner[x as usize]), simd.splat(shears.origin[x as usize]));
    let y = simd.sub(simd.load(&corner[y as usize]), simd.splat(shears.origin[y as usize]));
    let z = simd.sub(simd.load(&corner[z as usize]), simd.splat(shears.origin[z as usize]));
    shear(simd, [x, y, z], slopes)
}

impl<S: Arithmetic> Sheared<S> {
    /// A triangle's corners and edge functions, as the exact test has them before its arithmetic is in double precision;
    /// axes are bits.
    #[inline(always)]
    pub fn new(
        simd: S,
        [a, b, c]: [&[f32; 3]; 3],
        origin: [S::F32; 3],
        axes: [S::F32; 3],
        shears: [S::F32; 2],
    ) -> Self {
        let a = shear(simd, relative(simd, a, origin, axes), shears);
        let b = shear(simd, relative(simd, b, origin, axes), shears);
        let c = shear(simd, relative(simd, c, origin, axes), shears);
        Self::of_corners(simd, [a, b, c])
    }

    #[inline(always)]
    fn of_corners(simd: S, [a, b, c]: [[S::F32; 3]; 3]) -> Self {
        let (u, v, w) = (edge(simd, c, b), edge(simd, a, c), edge(simd, b, a));
        Self { depth: [a[2], b[2], c[2]], edge: [u.0, v.0, w.0], product: [u.1, v.1, w.1] }
    }

    /// The lanes in which two edge functions have opposite signs. Rounding is monotonic, so they have them exactly, too;
    /// whatever overflows, underflows or is zero is not among them.
    #[inline(always)]
    pub fn missed(&self, simd: S) -> u32 {
        let (least, greatest) = self.extremes(simd);
        simd.straddles_zero(least, greatest)
    }

    #[inline(always)]
    fn extremes(&self, simd: S) -> (S::F32, S::F32) {
        let [u, v, w] = self.edge;
        (simd.min(simd.min(u, v), w), simd.max(simd.max(u, v), w))
    }

    /// The crossings, of which those between `tmin` and `tmax` are wanted; `steepness` is that of the rays' frames.
    #[inline(always)]
    pub fn cross(&self, simd: S, steepness: S::F32, tmin: S::F32, tmax: S::F32) -> Crossings<S> {
        let ([a, b, c], [u, v, w]) = (self.depth, self.edge);
        let sum = simd.add(simd.add(u, v), w);
        let weighted = simd.mul_add(w, c, simd.mul_add(v, b, simd.mul(u, a)));
        let error = simd.mul_add(greatest(simd, self.product), simd.splat(EDGE_ERROR), simd.splat(LEAST_ERROR));
        // Not a number where something overflowed.
        let zero = simd.splat(0.0);
        let error = simd.mul_add(sum, zero, simd.mul_add(weighted, zero, error));

        let reciprocal = simd.div(simd.splat(1.0), sum);
        let t = simd.mul(simd.mul(weighted, reciprocal), steepness);
        let share = simd.mul(simd.mul(error, simd.splat(8.0)), simd.abs(reciprocal));
        let reach = simd.max(greatest(simd, self.depth), simd.splat(LEAST_DEPTH));
        let doubt = simd.mul(reach, simd.add(share, simd.splat(DEPTH_ERROR)));
        let (low, high) = (simd.sub(t, doubt), simd.add(t, doubt));

        let (least, greatest) = self.extremes(simd);
        let clear = simd.le(error, simd.max(least, simd.sub(zero, greatest)));
        Crossings {
            sure: clear & simd.le(tmin, low) & simd.le(high, tmax),
            outside: simd.le(high, tmin) | simd.le(tmax, low),
            low,
            high,
        }
    }
}

/// Corners in sheared space, rounded as in the exact test.
#[inline(always)]
fn shear<S: Arithmetic>(simd: S, [x, y, z]: [S::F32; 3], shear: [S::F32; 2]) -> [S::F32; 3] {
    let x = simd.sub(x, simd.mul(shear[0], z));
    let y = simd.sub(y, simd.mul(shear[1], z));
    [x, y, z]
}

/// A corner relative to the origins, in the order of the axes.
#[inline(always)]
fn relative<S: Arithmetic>(simd: S, [x, y, z]: &[f32; 3], origin: [S::F32; 3], axes: [S::F32; 3]) -> [S::F32; 3] {
    let x = simd.sub(simd.splat(*x), origin[0]);
    let y = simd.sub(simd.splat(*y), origin[1]);
    let z = simd.sub(simd.splat(*z), origin[2]);
    in_order(simd, [x, y, z], axes)
}

/// The last axis of three whose others are known; they are 0, 1 and 2, as bits.
#[inline(always)]
pub fn third_axis<S: Arithmetic>(simd: S, x: S::F32, y: S::F32) -> S::F32 {
    simd.sub_bits(simd.sub_bits(simd.splat(f32::from_bits(3)), x), y)
}

/// The numbers of three axes in the order of others, which are bits.
#[inline(always)]
pub fn in_order<S: Arithmetic>(simd: S, [x, y, z]: [S::F32; 3], axes: [S::F32; 3]) -> [S::F32; 3] {
    let (one, two) = (simd.splat(f32::from_bits(1)), simd.splat(f32::from_bits(2)));
    let mut ordered = axes;
    for k in 0..3 {
        ordered[k] = simd.if_ge(axes[k], two, z, simd.if_ge(axes[k], one, y, x));
    }
    ordered
}

/// Twice the signed areas of the triangles of the origin, `p` and `q`, and the products they come from that are
/// subtracted last.
#[inline(always)]
fn edge<S: Arithmetic>(simd: S, p: [S::F32; 3], q: [S::F32; 3]) -> (S::F32, S::F32) {
    let product = simd.mul(p[1], q[0]);
    (simd.sub(simd.mul(p[0], q[1]), product), product)
}

/// The greatest magnitude of three.
#[inline(always)]
fn greatest<S: Arithmetic>(simd: S, [a, b, c]: [S::F32; 3]) -> S::F32 {
    simd.max(simd.max(simd.abs(a), simd.abs(b)), simd.abs(c))
}
