//! Sixteen rays, and the boxes of nodes as they see them.

use crate::{
    accel::structure::Node,
    simd::{Arithmetic, Simd},
    traverse::{
        frame::{Domain, ROUNDING},
        setup::Frames,
    },
    triangle::LANES,
};

/// 64u, see the module's text.
const MARGIN: f32 = 64.0 * ROUNDING;

type Vector<S> = <<S as Simd>::Wide as Arithmetic>::F32;

/// Sixteen rays.
pub struct Packet<S: Simd> {
    pub wide: S::Wide,
    inverse: [Vector<S>; 3],
    /// What is added to `plane * inverse` for lower and for upper planes.
    bias: [[Vector<S>; 3]; 2],
    pub tmin: Vector<S>,
    pub tmax: Vector<S>,
    pub origin: [Vector<S>; 3],
    pub direction: [Vector<S>; 3],
    /// The origin of the first ray.
    pub first: [f32; 3],
    /// How far other origins are from it, in any coordinate.
    pub spread: f32,
    /// The box around the segments: its lower sides, and its upper ones with their sign changed; then the spread, likewise.
    sides: [f32; LANES],
    /// The same, from the first origin.
    pub around: [f32; 6],
}

impl<S: Simd> Packet<S> {
    #[inline(always)]
    pub fn new(simd: S, frames: &Frames<S::Wide>, first: [f32; 3], domain: &Domain) -> Self {
        let wide = simd.wide();
        let zero = wide.splat(0.0);
        let (mut reach, mut spread) = (zero, zero);
        let mut bias = [[zero; 3]; 2];
        for k in 0..3 {
            let (near, far) = (frames.near_bias[k], frames.far_bias[k]);
            bias[0][k] = wide.if_ge(frames.inverse[k], zero, near, far);
            bias[1][k] = wide.if_ge(frames.inverse[k], zero, far, near);
            reach = wide.max(wide.abs(frames.local[k]), reach);
            spread = wide.max(wide.abs(wide.sub(frames.origin[k], wide.splat(first[k]))), spread);
        }
        let size = wide.add(reach, wide.splat(domain.half_extent));
        let (most, least) = (wide.add(size, size), wide.sub(zero, wide.add(size, size)));
        let begin = wide.min(wide.max(frames.tmin, least), most);
        let end = wide.min(wide.max(frames.tmax, least), most);
        let margin = wide.mul(size, wide.splat(MARGIN));
        let mut sides = [simd.splat(0.0); LANES];
        for k in 0..3 {
            let from = wide.mul_add(frames.direction[k], begin, frames.local[k]);
            let to = wide.mul_add(frames.direction[k], end, frames.local[k]);
            sides[k] = Self::least(simd, wide.sub(wide.min(from, to), margin));
            sides[3 + k] = Self::least(simd, wide.sub(zero, wide.add(wide.max(from, to), margin)));
        }
        sides[6] = Self::least(simd, wide.sub(zero, spread));
        let rows = simd.transpose(sides);
        let mut sides = rows[0];
        for lane in 1..LANES {
            sides = simd.min(rows[lane], sides);
        }
        let sides = simd.store(sides);
        let mut around = [0.0; 6];
        for k in 0..3 {
            let local = first[k] - domain.centre[k];
            (around[k], around[3 + k]) = (sides[k] - local, sides[3 + k] + local);
        }
        let Frames { inverse, tmin, tmax, direction, origin, .. } = *frames;
        Self { wide, inverse, bias, tmin, tmax, origin, direction, first, spread: -sides[6], sides, around }
    }

    /// The lesser of each pair of rays.
    #[inline(always)]
    fn least(simd: S, values: Vector<S>) -> S::F32 {
        let [low, high] = simd.halves(values);
        simd.min(low, high)
    }

    /// The rays whose interval is not empty.
    #[inline(always)]
    pub fn all(&self) -> u32 {
        self.wide.le(self.tmin, self.tmax)
    }

    /// The children whose boxes meet the one around the segments.
    #[inline(always)]
    pub fn near(&self, simd: S, node: &Node) -> u32 {
        let mut apart = simd.splat(0.0);
        for k in 0..3 {
            let (lower, upper) = (simd.load(&node.plane[k]), simd.load(&node.plane[3 + k]));
            apart = simd.max(simd.add(lower, simd.splat(self.sides[3 + k])), apart);
            apart = simd.max(simd.sub(simd.splat(self.sides[k]), upper), apart);
        }
        simd.le(apart, simd.splat(0.0))
    }

    /// The rays that meet a child.
    #[inline(always)]
    pub fn meet(&self, node: &Node, child: usize) -> u32 {
        let wide = self.wide;
        let (mut near, mut far) = (self.tmin, self.tmax);
        for k in 0..3 {
            let lower = wide.splat(node.plane[k][child & (LANES - 1)]);
            let upper = wide.splat(node.plane[3 + k][child & (LANES - 1)]);
            let lower = wide.mul_add(lower, self.inverse[k], self.bias[0][k]);
            let upper = wide.mul_add(upper, self.inverse[k], self.bias[1][k]);
            near = wide.max(wide.min(lower, upper), near);
            far = wide.min(wide.max(lower, upper), far);
        }
        wide.le(near, far)
    }
}
