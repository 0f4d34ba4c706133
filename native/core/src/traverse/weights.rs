//! Triangles before sixteen rays, one triangle after another, in single precision: what is surely hit, what is surely
//! not, and what only a closer look can tell. The arithmetic is that of Möller and Trumbore, "Fast, Minimum Storage
//! Ray/Triangle Intersection", Journal of Graphics Tools 2(1), 1997: with c the first corner seen from the ray's origin,
//! d the direction, e and f the edges from there and N = e × f, the determinant is D = N·d, the weights are
//! U = f·(c × d), V = -e·(c × d) and W = D - U - V, and the parameter is N·c / D.
//!
//! Write u = 2^-24, C for the largest component of c, E for that of e and f, R = C + E, M < 2 for that of d, n for
//! that of N and G for the sum of the products that N is made of. Corners are within R of the origin; the third edge is
//! at most 2E long in any component.
//!
//! * *What the exact test may see otherwise.* It rounds corners relative to the origin (uR), slopes (2u) and sheared
//!   corners (3uR), so in sheared x and y a corner is off by less than δ = 7uR, and its triangle lies within √2δ of this
//!   one. Functions beyond √2δM times the length of their edge are therefore its, too: at most 28uREM, of W 56uREM.
//! * *Weights and determinant* are off by 33uREM, W by 129uREM (inputs, products and sums). Where one of the three is
//!   below minus [`Weights::doubt`], at least 256uREM, one that the exact test sees is as negative, even if D has the
//!   wrong sign: then |D| < 66uREM, and U + V + W = D leaves another one no choice. Where all are above it, so is the
//!   exact test's triangle around the ray.
//! * *Parameter*, times D: the exact one is a mean of corners' depths in a triangle shifted by up to √2δ, so it differs
//!   by the slope n√2/D times that, 14unR. Numerator and determinant err by u(9n + 4G)R and u(6n + 4G)R, what they are
//!   compared with by 12unR. [`Triangles::blur`] is u(48n + 16G)R. For walls along the axes G is n, so that rays which
//!   begin just above one do not need the exact test to tell that they leave it. The parameter itself is off by another
//!   4u of its own, of which 8 are taken, so that it lies strictly inside its interval.
//!
//! Nothing here may overflow or vanish: the scene's half extent must be one of [`EXTENTS`](super::tile::EXTENTS).

use super::{crossing::Crossings, frame::ROUNDING};
use crate::{
    simd::{Arithmetic, Simd},
    triangle::{Block, LANES},
};

/// Eight triangles, made ready for rays from around some point.
pub struct Triangles {
    corner: [[f32; LANES]; 3],
    /// From the second corner to the first.
    back: [[f32; LANES]; 3],
    /// From the first corner to the third.
    edge: [[f32; LANES]; 3],
    /// Of length twice the area, towards where the corners turn left.
    normal: [[f32; LANES]; 3],
    /// Weights up to this, times the determinant, decide nothing: for origins at the point, and more for every unit away.
    doubt: [[f32; LANES]; 2],
    /// Parameters are off by this over the determinant; likewise.
    blur: [[f32; LANES]; 2],
}

/// A triangle before some rays.
#[derive(Clone, Copy)]
pub struct Weights<W: Arithmetic> {
    /// The least of the three weights, times the determinant.
    pub least: W::F32,
    /// Not negative.
    pub determinant: W::F32,
    /// The sign that the determinant had, in the first bit.
    pub side: W::F32,
    /// Weights up to this decide nothing.
    pub doubt: W::F32,
}

impl Triangles {
    /// Those of a block, for rays from around a point.
    #[inline(always)]
    pub fn new<S: Simd>(simd: S, block: &Block, from: [f32; 3]) -> Self {
        let zero = simd.splat(0.0);
        let [mut corner, mut back, mut edge] = [[zero; 3]; 3];
        let (mut extent, mut reach) = (zero, zero);
        for k in 0..3 {
            corner[k] = simd.load(&block.corner[0][k]);
            back[k] = simd.sub(corner[k], simd.load(&block.corner[1][k]));
            edge[k] = simd.sub(simd.load(&block.corner[2][k]), corner[k]);
            extent = simd.max(simd.max(simd.abs(back[k]), simd.abs(edge[k])), extent);
            reach = simd.max(simd.abs(simd.sub(corner[k], simd.splat(from[k]))), reach);
        }
        let [mut normal, mut products] = [[zero; 3]; 2];
        for k in 0..3 {
            let (x, y) = ((k + 1) % 3, (k + 2) % 3);
            let product = simd.mul(back[x], edge[y]);
            normal[k] = simd.mul_sub(back[y], edge[x], product);
            products[k] = simd.mul_add(simd.abs(back[y]), simd.abs(edge[x]), simd.abs(product));
        }
        let products = simd.add(simd.add(products[0], products[1]), products[2]);
        let greatest = simd.max(simd.max(simd.abs(normal[0]), simd.abs(normal[1])), simd.abs(normal[2]));
        let reach = simd.add(reach, extent);
        let tiny = simd.splat(f32::MIN_POSITIVE);
        let doubt = simd.mul(extent, simd.splat(512.0 * ROUNDING));
        let blur = simd.mul_add(products, simd.splat(16.0), simd.mul(greatest, simd.splat(48.0)));
        let blur = simd.mul(blur, simd.splat(ROUNDING));
        Self {
            corner: store(simd, corner),
            back: store(simd, back),
            edge: store(simd, edge),
            normal: store(simd, normal),
            doubt: [simd.store(simd.mul_add(doubt, reach, tiny)), simd.store(doubt)],
            blur: [simd.store(simd.mul_add(blur, reach, tiny)), simd.store(blur)],
        }
    }

    /// The weights of the triangle in a lane, for rays whose origins are no farther from the point than `away` in any
    /// coordinate.
    #[inline(always)]
    pub fn weigh<W: Arithmetic>(
        &self,
        wide: W,
        lane: usize,
        (origin, direction): ([W::F32; 3], [W::F32; 3]),
        away: W::F32,
    ) -> Weights<W> {
        let (lane, d) = (lane & (LANES - 1), direction);
        let c = self.corner(wide, lane, origin);
        let r = [
            wide.mul_sub(c[1], d[2], wide.mul(c[2], d[1])),
            wide.mul_sub(c[2], d[0], wide.mul(c[0], d[2])),
            wide.mul_sub(c[0], d[1], wide.mul(c[1], d[0])),
        ];
        let (u, v) = (along(wide, &self.edge, lane, r), along(wide, &self.back, lane, r));
        let determinant = along(wide, &self.normal, lane, d);
        let side = wide.and(determinant, wide.splat(-0.0));
        let (u, v, determinant) = (wide.xor(u, side), wide.xor(v, side), wide.xor(determinant, side));
        let least = wide.min(wide.min(u, v), wide.sub(wide.sub(determinant, u), v));
        Weights { least, determinant, side, doubt: affine(wide, &self.doubt, lane, away) }
    }

    /// The parameters of rays along the triangle in a lane, times the determinant.
    #[inline(always)]
    pub fn depth<W: Arithmetic>(&self, wide: W, lane: usize, origin: [W::F32; 3], side: W::F32) -> W::F32 {
        let lane = lane & (LANES - 1);
        let c = self.corner(wide, lane, origin);
        wide.xor(along(wide, &self.normal, lane, c), side)
    }

    /// What these are off by.
    #[inline(always)]
    pub fn blur<W: Arithmetic>(&self, wide: W, lane: usize, away: W::F32) -> W::F32 {
        affine(wide, &self.blur, lane & (LANES - 1), away)
    }

    #[inline(always)]
    fn corner<W: Arithmetic>(&self, wide: W, lane: usize, origin: [W::F32; 3]) -> [W::F32; 3] {
        let [x, y, z] =
            [wide.splat(self.corner[0][lane]), wide.splat(self.corner[1][lane]), wide.splat(self.corner[2][lane])];
        [wide.sub(x, origin[0]), wide.sub(y, origin[1]), wide.sub(z, origin[2])]
    }
}

impl<W: Arithmetic> Weights<W> {
    /// The crossings, of which those between `tmin` and `tmax` are wanted, from depths and what they are off by.
    #[inline(always)]
    pub fn cross(&self, wide: W, (depth, blur): (W::F32, W::F32), (tmin, tmax): (W::F32, W::F32)) -> Crossings<W> {
        let inverse = wide.div(wide.splat(1.0), self.determinant);
        let t = wide.mul(depth, inverse);
        let error = wide.mul_add(blur, inverse, wide.mul(wide.abs(t), wide.splat(8.0 * ROUNDING)));
        let (low, high) = (wide.sub(t, error), wide.add(t, error));
        let clear = wide.le(self.doubt, self.least);
        let stands = wide.le(wide.mul(self.doubt, wide.splat(1.5)), self.determinant);
        Crossings {
            sure: clear & wide.le(tmin, low) & wide.le(high, tmax),
            outside: stands & (wide.le(high, tmin) | wide.le(tmax, low)),
            low,
            high,
        }
    }
}

#[inline(always)]
fn store<S: Simd>(simd: S, [x, y, z]: [S::F32; 3]) -> [[f32; LANES]; 3] {
    [simd.store(x), simd.store(y), simd.store(z)]
}

#[inline(always)]
fn affine<W: Arithmetic>(wide: W, [here, rise]: &[[f32; LANES]; 2], lane: usize, away: W::F32) -> W::F32 {
    wide.mul_add(away, wide.splat(rise[lane]), wide.splat(here[lane]))
}

#[inline(always)]
fn along<W: Arithmetic>(wide: W, vector: &[[f32; LANES]; 3], lane: usize, r: [W::F32; 3]) -> W::F32 {
    let [x, y, z] = [wide.splat(vector[0][lane]), wide.splat(vector[1][lane]), wide.splat(vector[2][lane])];
    wide.mul_add(x, r[0], wide.mul_add(y, r[1], wide.mul(z, r[2])))
}
