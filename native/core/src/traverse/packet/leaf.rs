//! Blocks of triangles against the rays of a packet: those that are near them all are tested by [`weights`], and what
//! that leaves open is left to the exact test.
//!
//! [`weights`]: crate::traverse::weights

use super::rays::{Packet, Part, RAYS};
use crate::{
    ray::Rays,
    simd::{Arithmetic, Simd},
    traverse::{
        frame::Domain,
        weights::{Triangles, Weights},
    },
    triangle::Block,
};

/// A block of triangles to be tested against the rays of a packet.
pub struct Leaf<'a> {
    pub block: &'a Block,
    /// Triangles in it.
    pub count: u32,
    /// A batch, and where in it the packet begins.
    pub batch: (&'a Rays<'a>, usize),
    pub domain: &'a Domain,
}

impl Leaf<'_> {
    /// Which of the rays `going` hit one of the triangles.
    #[inline(always)]
    pub fn hit<S: Simd, const PARTS: usize>(&self, simd: S, packet: &Packet<S, PARTS>, going: u64) -> u64 {
        let mut near = near(simd, packet, self.block) & ((1 << self.count) - 1);
        if near == 0 {
            return 0;
        }
        let triangles = Triangles::new(simd, self.block, packet.first);
        let mut rest = going;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            let [sure, mut unclear] = hit(&triangles, packet, rest, lane);
            rest &= !sure;
            while unclear != 0 {
                let ray = unclear.trailing_zeros();
                unclear &= unclear - 1;
                rest &= !(u64::from(self.is_hit(lane, packet.place(ray as usize))) << ray);
            }
            if rest == 0 {
                break;
            }
        }
        going & !rest
    }

    /// What the exact test says of a triangle and a ray.
    #[cold]
    #[inline(never)]
    fn is_hit(&self, lane: usize, ray: usize) -> bool {
        let (rays, first) = self.batch;
        rays.frame(first + ray, self.domain).is_ok_and(|frame| self.block.intersect(lane, &frame).is_some())
    }
}

/// The triangles of a block whose boxes meet the one around the segments of the rays.
#[inline(always)]
fn near<S: Simd, const PARTS: usize>(simd: S, packet: &Packet<S, PARTS>, block: &Block) -> u32 {
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

/// Which of the rays `going` certainly hit the triangle in a lane, and of which the exact test is to be asked. No part is
/// passed by where none of its rays may: with branches, which cannot be predicted, the room took 1.01 and 1.2 times as long,
/// five other scenes 0.93 to 1.08.
#[inline(always)]
fn hit<S: Simd, const PARTS: usize>(
    triangles: &Triangles,
    packet: &Packet<S, PARTS>,
    going: u64,
    lane: usize,
) -> [u64; 2] {
    let (wide, parts) = (packet.wide, &packet.parts);
    let away = wide.splat(packet.spread);
    let mut weights = [triangles.weigh(wide, lane, (parts[0].origin, parts[0].direction), away); PARTS];
    for part in 1..PARTS {
        weights[part] = triangles.weigh(wide, lane, (parts[part].origin, parts[part].direction), away);
    }
    let mut possible = 0;
    for part in 0..PARTS {
        let Weights { least, doubt, .. } = weights[part];
        possible |= u64::from(wide.le(wide.splat(0.0), wide.add(least, doubt))) << (RAYS * part);
    }
    possible &= going;
    if possible == 0 {
        return [0; 2];
    }
    let [mut sure, mut beyond] = [0; 2];
    for part in 0..PARTS {
        let of_part = within(wide, triangles, (&parts[part], &weights[part]), lane, away);
        sure |= u64::from(of_part[0]) << (RAYS * part);
        beyond |= u64::from(of_part[1]) << (RAYS * part);
    }
    sure &= possible;
    [sure, possible & !sure & !beyond]
}

/// Which rays surely hit a triangle if they may, and which cross its plane surely outside of their interval.
#[inline(always)]
fn within<S: Simd>(
    wide: S::Wide,
    triangles: &Triangles,
    (rays, weights): (&Part<S>, &Weights<S::Wide>),
    lane: usize,
    away: <S::Wide as Arithmetic>::F32,
) -> [u32; 2] {
    let Weights { least, doubt, determinant, side } = *weights;
    let (depth, blur) = (triangles.depth(wide, lane, rays.origin, side), triangles.blur(wide, lane, away));
    let (from, to) = (wide.sub(depth, blur), wide.add(depth, blur));
    let (near, far) = (wide.mul(rays.tmin, determinant), wide.mul(rays.tmax, determinant));
    let sure = wide.le(doubt, least) & wide.le(near, from) & wide.le(to, far);
    let stands = wide.le(wide.mul(doubt, wide.splat(1.5)), determinant);
    [sure, stands & (wide.le(to, near) | wide.le(far, from))]
}
