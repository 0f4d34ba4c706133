//! Blocks of triangles against the rays of a packet: those that are near them all are tested by [`weights`], and what
//! that leaves open is left to the exact test.
//!
//! [`weights`]: crate::traverse::weights

use super::rays::Packet;
use crate::{
    simd::{Arithmetic, Simd},
    traverse::weights::Triangles,
    triangle::Block,
};

/// The triangles of a block whose boxes meet the one around the segments of the rays.
#[inline(always)]
pub fn near<S: Simd>(simd: S, packet: &Packet<S>, block: &Block) -> u32 {
    let mut apart = simd.splat(0.0);
    for k in 0..3 {
        let [a, b, c] =
            [simd.load(&block.corner[0][k]), simd.load(&block.corner[1][k]), simd.load(&block.corner[2][k])];
        let (lower, upper) = (simd.min(simd.min(a, b), c), simd.max(simd.max(a, b), c));
        let first = simd.splat(packet.first[k]);
        apart = simd.max(simd.add(simd.sub(lower, first), simd.splat(packet.around[3 + k])), apart);
        apart = simd.max(simd.sub(simd.splat(packet.around[k]), simd.sub(upper, first)), apart);
    }
    simd.le(apart, simd.splat(0.0))
}

/// Which of the rays `going` certainly hit the triangle in a lane, and of which the exact test is to be asked.
#[inline(always)]
pub fn hit<S: Simd>(triangles: &Triangles, packet: &Packet<S>, going: u32, lane: usize) -> [u32; 2] {
    let (wide, origin) = (packet.wide, packet.origin);
    let away = wide.splat(packet.spread);
    let weights = triangles.weigh(wide, lane, (origin, packet.direction), away);
    let (doubt, determinant) = (weights.doubt, weights.determinant);
    let possible = going & wide.le(wide.splat(0.0), wide.add(weights.least, doubt));
    if possible == 0 {
        return [0; 2];
    }
    let depth = triangles.depth(wide, lane, origin, weights.side);
    let blur = triangles.blur(wide, lane, away);
    let (from, to) = (wide.sub(depth, blur), wide.add(depth, blur));
    let (near, far) = (wide.mul(packet.tmin, determinant), wide.mul(packet.tmax, determinant));
    let sure = possible & wide.le(doubt, weights.least) & wide.le(near, from) & wide.le(to, far);
    let beyond = wide.le(wide.mul(doubt, wide.splat(1.5)), determinant) & (wide.le(to, near) | wide.le(far, from));
    [sure, possible & !sure & !beyond]
}
