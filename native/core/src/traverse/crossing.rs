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

use super::frame::Frame;
use crate::{
    simd::Simd,
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

/// A block's triangles in the sheared space of a ray.
pub struct Sheared<S: Simd> {
    depth: [S::F32; 3],
    edge: [S::F32; 3],
    product: [S::F32; 3],
}

/// Where a ray crosses the triangles of a block, if it does.
pub struct Crossings {
    /// For every lane a parameter before the crossing.
    pub low: [f32; LANES],
    /// And one behind it.
    pub high: [f32; LANES],
    /// The lanes that are surely hit within the interval asked for.
    pub sure: u32,
    /// The lanes that are surely not hit within it.
    pub outside: u32,
}

impl<S: Simd> Sheared<S> {
    /// Corners and edge functions, as the exact test has them before its arithmetic is in double precision.
    #[inline(always)]
    pub fn new(simd: S, frame: &Frame, block: &Block) -> Self {
        let a = shear(simd, frame, &block.corner[0]);
        let b = shear(simd, frame, &block.corner[1]);
        let c = shear(simd, frame, &block.corner[2]);
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

    /// The crossings, of which those between `tmin` and `tmax` are wanted.
    #[inline(always)]
    pub fn cross(&self, simd: S, frame: &Frame, tmin: f32, tmax: f32) -> Crossings {
        let ([a, b, c], [u, v, w]) = (self.depth, self.edge);
        let sum = simd.add(simd.add(u, v), w);
        let weighted = simd.mul_add(w, c, simd.mul_add(v, b, simd.mul(u, a)));
        let error = simd.mul_add(greatest(simd, self.product), simd.splat(EDGE_ERROR), simd.splat(LEAST_ERROR));
        // Not a number where something overflowed.
        let zero = simd.splat(0.0);
        let error = simd.mul_add(sum, zero, simd.mul_add(weighted, zero, error));

        let reciprocal = simd.div(simd.splat(1.0), sum);
        let steepness = simd.splat(frame.inverse[frame.axes[2] as usize]);
        let t = simd.mul(simd.mul(weighted, reciprocal), steepness);
        let share = simd.mul(simd.mul(error, simd.splat(8.0)), simd.abs(reciprocal));
        let reach = simd.max(greatest(simd, self.depth), simd.splat(LEAST_DEPTH));
        let doubt = simd.mul(reach, simd.add(share, simd.splat(DEPTH_ERROR)));
        let (low, high) = (simd.sub(t, doubt), simd.add(t, doubt));

        let (tmin, tmax) = (simd.splat(tmin), simd.splat(tmax));
        let (least, greatest) = self.extremes(simd);
        let clear = simd.le(error, simd.max(least, simd.sub(zero, greatest)));
        Crossings {
            sure: clear & simd.le(tmin, low) & simd.le(high, tmax),
            outside: simd.le(high, tmin) | simd.le(tmax, low),
            low: simd.store(low),
            high: simd.store(high),
        }
    }
}

/// Corners in sheared space, rounded as in the exact test.
#[inline(always)]
fn shear<S: Simd>(simd: S, frame: &Frame, corner: &[[f32; LANES]; 3]) -> [S::F32; 3] {
    let [kx, ky, kz] = frame.axes;
    let x = relative(simd, frame, corner, kx);
    let y = relative(simd, frame, corner, ky);
    let z = relative(simd, frame, corner, kz);
    let x = simd.sub(x, simd.mul(simd.splat(frame.shear[0]), z));
    let y = simd.sub(y, simd.mul(simd.splat(frame.shear[1]), z));
    [x, y, z]
}

#[inline(always)]
fn relative<S: Simd>(simd: S, frame: &Frame, corner: &[[f32; LANES]; 3], axis: u32) -> S::F32 {
    let axis = axis as usize;
    simd.sub(simd.load(&corner[axis]), simd.splat(frame.origin[axis]))
}

/// Twice the signed areas of the triangles of the origin, `p` and `q`, and the products they come from that are
/// subtracted last.
#[inline(always)]
fn edge<S: Simd>(simd: S, p: [S::F32; 3], q: [S::F32; 3]) -> (S::F32, S::F32) {
    let product = simd.mul(p[1], q[0]);
    (simd.sub(simd.mul(p[0], q[1]), product), product)
}

/// The greatest magnitude of three.
#[inline(always)]
fn greatest<S: Simd>(simd: S, [a, b, c]: [S::F32; 3]) -> S::F32 {
    simd.max(simd.max(simd.abs(a), simd.abs(b)), simd.abs(c))
}
