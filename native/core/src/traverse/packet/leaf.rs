//! Blocks of triangles against sixteen rays: those that are near them all are tested one after another, in single
//! precision, which says what is surely hit and surely not; the rest is left to the exact test. The arithmetic is that
//! of Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", Journal of Graphics Tools 2(1), 1997: with
//! c the first corner seen from the ray's origin, d the direction, e and f the edges from there and N = e × f, the
//! determinant is D = N·d, the weights are U = f·(c × d), V = -e·(c × d) and W = D - U - V, and the parameter is N·c / D.
//!
//! Write u = 2^-24, C for the largest component of c, E for that of e and f, R = C + E, M < 2 for that of d, n for
//! that of N and G for the sum of the products that N is made of. Corners are within R of the origin; the third edge is
//! at most 2E long in any component.
//!
//! * *What the exact test may see otherwise.* It rounds corners relative to the origin (uR), slopes (2u) and sheared
//!   corners (3uR), so in sheared x and y a corner is off by less than δ = 7uR, and its triangle lies within √2δ of this
//!   one. Functions beyond √2δM times the length of their edge are therefore its, too: at most 28uREM, of W 56uREM.
//! * *Weights and determinant* are off by 33uREM, W by 129uREM (inputs, products and sums). Where one of the three is
//!   below minus [`Triangles::doubt`], at least 256uREM, one that the exact test sees is as negative, even if D has the
//!   wrong sign: then |D| < 66uREM, and U + V + W = D leaves another one no choice. Where all are above it, so is the
//!   exact test's triangle around the ray.
//! * *Parameter*, times D: the exact one is a mean of corners' depths in a triangle shifted by up to √2δ, so it differs
//!   by the slope n√2/D times that, 14unR. Numerator and determinant err by u(9n + 4G)R and u(6n + 4G)R, what they are
//!   compared with by 12unR. [`Triangles::blur`] is u(48n + 16G)R. For walls along the axes G is n, so that rays which
//!   begin just above one do not need the exact test to tell that they leave it.

use super::rays::Packet;
use crate::{
    simd::{Arithmetic, Simd},
    traverse::frame::ROUNDING,
    triangle::{Block, LANES},
};

/// Eight triangles, made ready.
pub struct Triangles {
    corner: [[f32; LANES]; 3],
    /// From the second corner to the first.
    back: [[f32; LANES]; 3],
    /// From the first corner to the third.
    edge: [[f32; LANES]; 3],
    /// Of length twice the area, towards where the corners turn left.
    normal: [[f32; LANES]; 3],
    /// Weights up to this, times the determinant, decide nothing.
    doubt: [f32; LANES],
    /// Parameters are off by this over the determinant.
    blur: [f32; LANES],
}

impl Triangles {
    /// Those of a block, and which of them are near the rays.
    #[inline(always)]
    pub fn new<S: Simd>(simd: S, packet: &Packet<S>, block: &Block) -> (Self, u32) {
        let zero = simd.splat(0.0);
        let [mut corner, mut back, mut edge] = [[zero; 3]; 3];
        let (mut extent, mut reach, mut apart) = (zero, zero, zero);
        for k in 0..3 {
            corner[k] = simd.load(&block.corner[0][k]);
            back[k] = simd.sub(corner[k], simd.load(&block.corner[1][k]));
            edge[k] = simd.sub(simd.load(&block.corner[2][k]), corner[k]);
            extent = simd.max(simd.max(simd.abs(back[k]), simd.abs(edge[k])), extent);
            let a = simd.sub(corner[k], simd.splat(packet.first[k]));
            reach = simd.max(simd.abs(a), reach);
            let (b, c) = (simd.sub(a, back[k]), simd.add(a, edge[k]));
            let (lower, upper) = (simd.min(simd.min(a, b), c), simd.max(simd.max(a, b), c));
            apart = simd.max(simd.add(lower, simd.splat(packet.around[3 + k])), apart);
            apart = simd.max(simd.sub(simd.splat(packet.around[k]), upper), apart);
        }
        let near = simd.le(apart, zero);
        let [mut normal, mut products] = [[zero; 3]; 2];
        for k in 0..3 {
            let (x, y) = ((k + 1) % 3, (k + 2) % 3);
            let product = simd.mul(back[x], edge[y]);
            normal[k] = simd.mul_sub(back[y], edge[x], product);
            products[k] = simd.mul_add(simd.abs(back[y]), simd.abs(edge[x]), simd.abs(product));
        }
        let products = simd.add(simd.add(products[0], products[1]), products[2]);
        let greatest = simd.max(simd.max(simd.abs(normal[0]), simd.abs(normal[1])), simd.abs(normal[2]));
        let reach = simd.add(simd.add(reach, extent), simd.splat(packet.spread));
        let tiny = simd.splat(f32::MIN_POSITIVE);
        let doubt = simd.mul_add(simd.mul(reach, extent), simd.splat(512.0 * ROUNDING), tiny);
        let blur = simd.mul_add(products, simd.splat(16.0), simd.mul(greatest, simd.splat(48.0)));
        let blur = simd.mul_add(simd.mul(blur, reach), simd.splat(ROUNDING), tiny);
        let triangles = Self {
            corner: [simd.store(corner[0]), simd.store(corner[1]), simd.store(corner[2])],
            back: [simd.store(back[0]), simd.store(back[1]), simd.store(back[2])],
            edge: [simd.store(edge[0]), simd.store(edge[1]), simd.store(edge[2])],
            normal: [simd.store(normal[0]), simd.store(normal[1]), simd.store(normal[2])],
            doubt: simd.store(doubt),
            blur: simd.store(blur),
        };
        (triangles, near)
    }

    /// Which of the rays `going` certainly hit the triangle in a lane, and of which the exact test is to be asked.
    #[inline(always)]
    pub fn hit<S: Simd>(&self, packet: &Packet<S>, going: u32, lane: usize) -> [u32; 2] {
        let wide = packet.wide;
        let lane = lane & (LANES - 1);
        let d = packet.direction;
        let [mut c, mut normal] = [packet.origin; 2];
        for k in 0..3 {
            c[k] = wide.sub(wide.splat(self.corner[k][lane]), packet.origin[k]);
            normal[k] = wide.splat(self.normal[k][lane]);
        }
        let r = [
            wide.mul_sub(c[1], d[2], wide.mul(c[2], d[1])),
            wide.mul_sub(c[2], d[0], wide.mul(c[0], d[2])),
            wide.mul_sub(c[0], d[1], wide.mul(c[1], d[0])),
        ];
        let u = along(wide, &self.edge, lane, r);
        let v = along(wide, &self.back, lane, r);
        let determinant = dot(wide, normal, d);
        let side = wide.and(determinant, wide.splat(-0.0));
        let (u, v, determinant) = (wide.xor(u, side), wide.xor(v, side), wide.xor(determinant, side));
        let least = wide.min(wide.min(u, v), wide.sub(wide.sub(determinant, u), v));
        let doubt = wide.splat(self.doubt[lane]);
        let possible = going & wide.le(wide.splat(-self.doubt[lane]), least);
        if possible == 0 {
            return [0; 2];
        }
        let depth = wide.xor(dot(wide, normal, c), side);
        let blur = wide.splat(self.blur[lane]);
        let (from, to) = (wide.sub(depth, blur), wide.add(depth, blur));
        let (near, far) = (wide.mul(packet.tmin, determinant), wide.mul(packet.tmax, determinant));
        let sure = possible & wide.le(doubt, least) & wide.le(near, from) & wide.le(to, far);
        let beyond = wide.le(wide.mul(doubt, wide.splat(1.5)), determinant) & (wide.le(to, near) | wide.le(far, from));
        [sure, possible & !sure & !beyond]
    }
}

#[inline(always)]
fn along<W: Arithmetic>(wide: W, vector: &[[f32; LANES]; 3], lane: usize, r: [W::F32; 3]) -> W::F32 {
    dot(wide, [wide.splat(vector[0][lane]), wide.splat(vector[1][lane]), wide.splat(vector[2][lane])], r)
}

#[inline(always)]
fn dot<W: Arithmetic>(wide: W, p: [W::F32; 3], q: [W::F32; 3]) -> W::F32 {
    wide.mul_add(p[0], q[0], wide.mul_add(p[1], q[1], wide.mul(p[2], q[2])))
}
