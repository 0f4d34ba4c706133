//! Some rays, and the boxes of nodes as they see them.

use crate::{
    accel::structure::Node,
    ray::Rays,
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

/// Rays of a vector.
pub const RAYS: usize = 16;

/// Some rays, as many vectors of them as there are parts; masks have a bit for each.
pub struct Packet<S: Simd, const PARTS: usize> {
    pub wide: S::Wide,
    pub parts: [Part<S>; PARTS],
    /// The origin of the first ray.
    pub first: [f32; 3],
    /// How far other origins are from it, in any coordinate.
    pub spread: f32,
    /// The box around the segments: its lower sides, and its upper ones with their sign changed; then the spread, likewise.
    sides: [f32; LANES],
    /// The same, from the first origin.
    pub around: [f32; 6],
    /// Of a narrow packet, which rays of the wide one it has.
    places: [u32; RAYS],
}

/// Sixteen of them.
#[derive(Clone, Copy)]
pub struct Part<S: Simd> {
    inverse: [Vector<S>; 3],
    /// What is added to `plane * inverse` for lower and for upper planes.
    bias: [[Vector<S>; 3]; 2],
    pub tmin: Vector<S>,
    pub tmax: Vector<S>,
    pub origin: [Vector<S>; 3],
    pub direction: [Vector<S>; 3],
}

impl<S: Simd, const PARTS: usize> Packet<S, PARTS> {
    /// No rays, to be overwritten.
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let wide = simd.wide();
        let (zero, zeros) = (wide.splat(0.0), [wide.splat(0.0); 3]);
        let part = Part { inverse: zeros, bias: [zeros; 2], tmin: zero, tmax: zero, origin: zeros, direction: zeros };
        let (first, sides, around, places) = Default::default();
        Self { wide, parts: [part; PARTS], first, spread: 0.0, sides, around, places }
    }

    /// Take those of a batch's from `first` on; false where there are too few, or one has no frame. In place: to return it
    /// would copy some kilobytes.
    #[inline(always)]
    pub fn set(&mut self, simd: S, (rays, first): (&Rays<'_>, usize), domain: &Domain) -> bool {
        if first + RAYS * PARTS > rays.len() {
            return false;
        }
        self.first = rays.origin(first);
        let mut rows = [simd.splat(f32::INFINITY); LANES];
        for part in 0..PARTS {
            let Some(frames) = Frames::new(simd.wide(), &rays.sixteen(simd, first + RAYS * part), domain) else {
                return false;
            };
            self.parts[part] = Part::new(simd.wide(), &frames);
            let sides = sides(simd, &frames, self.first, domain);
            for k in 0..LANES {
                rows[k] = simd.min(sides[k], rows[k]);
            }
        }
        let rows = simd.transpose(rows);
        let mut sides = rows[0];
        for lane in 1..LANES {
            sides = simd.min(rows[lane], sides);
        }
        self.sides = simd.store(sides);
        self.spread = -self.sides[6];
        for k in 0..3 {
            let local = self.first[k] - domain.centre[k];
            (self.around[k], self.around[3 + k]) = (self.sides[k] - local, self.sides[3 + k] + local);
        }
        true
    }

    /// Some rays of it, at most sixteen.
    #[inline(always)]
    pub fn narrow(&self, simd: S, rays: u64) -> Packet<S, 1> {
        let places = simd.places(rays);
        let Self { wide, first, spread, sides, around, .. } = *self;
        let part = Part::pick(simd, &self.parts, &places);
        Packet { wide, parts: [part], first, spread, sides, around, places }
    }

    /// Which ray of the batch's, from where the packet begins, is in a lane.
    #[inline(always)]
    pub fn place(&self, lane: usize) -> usize {
        if PARTS == 1 { self.places[lane % RAYS] as usize } else { lane }
    }

    /// The rays whose interval is not empty.
    #[inline(always)]
    pub fn all(&self) -> u64 {
        let mut all = 0;
        for part in 0..PARTS {
            let Part { tmin, tmax, .. } = self.parts[part];
            all |= u64::from(self.wide.le(tmin, tmax)) << (RAYS * part);
        }
        all
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
    pub fn meet(&self, node: &Node, child: usize) -> u64 {
        let mut met = 0;
        for part in 0..PARTS {
            met |= u64::from(self.parts[part].meet(self.wide, node, child)) << (RAYS * part);
        }
        met
    }
}

/// The box around the segments of sixteen rays, and how far their origins are from the first one's, as [`Packet::sides`]:
/// the least number of each row.
#[inline(always)]
fn sides<S: Simd>(simd: S, frames: &Frames<S::Wide>, first: [f32; 3], domain: &Domain) -> [S::F32; LANES] {
    let wide = simd.wide();
    let zero = wide.splat(0.0);
    let (mut reach, mut spread) = (zero, zero);
    for k in 0..3 {
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
        sides[k] = lesser(simd, wide.sub(wide.min(from, to), margin));
        sides[3 + k] = lesser(simd, wide.sub(zero, wide.add(wide.max(from, to), margin)));
    }
    sides[6] = lesser(simd, wide.sub(zero, spread));
    sides
}

/// The lesser of each pair of rays.
#[inline(always)]
fn lesser<S: Simd>(simd: S, values: Vector<S>) -> S::F32 {
    let [low, high] = simd.halves(values);
    simd.min(low, high)
}

impl<S: Simd> Part<S> {
    #[inline(always)]
    fn new(wide: S::Wide, frames: &Frames<S::Wide>) -> Self {
        let zero = wide.splat(0.0);
        let mut bias = [[zero; 3]; 2];
        for k in 0..3 {
            let (near, far) = (frames.near_bias[k], frames.far_bias[k]);
            bias[0][k] = wide.if_ge(frames.inverse[k], zero, near, far);
            bias[1][k] = wide.if_ge(frames.inverse[k], zero, far, near);
        }
        let Frames { inverse, tmin, tmax, direction, origin, .. } = *frames;
        Self { inverse, bias, tmin, tmax, origin, direction }
    }

    /// Those at some places of several parts.
    #[inline(always)]
    fn pick<const PARTS: usize>(simd: S, parts: &[Self; PARTS], places: &[u32; RAYS]) -> Self {
        let [a, b, c, d] = [&parts[0], &parts[1 % PARTS], &parts[2 % PARTS], &parts[3 % PARTS]];
        let mut picked = *a;
        for k in 0..3 {
            picked.inverse[k] = simd.pick([a.inverse[k], b.inverse[k], c.inverse[k], d.inverse[k]], places);
            for side in 0..2 {
                let biases = [a.bias[side][k], b.bias[side][k], c.bias[side][k], d.bias[side][k]];
                picked.bias[side][k] = simd.pick(biases, places);
            }
            picked.origin[k] = simd.pick([a.origin[k], b.origin[k], c.origin[k], d.origin[k]], places);
            picked.direction[k] = simd.pick([a.direction[k], b.direction[k], c.direction[k], d.direction[k]], places);
        }
        picked.tmin = simd.pick([a.tmin, b.tmin, c.tmin, d.tmin], places);
        picked.tmax = simd.pick([a.tmax, b.tmax, c.tmax, d.tmax], places);
        picked
    }

    /// Those that meet a child.
    #[inline(always)]
    fn meet(&self, wide: S::Wide, node: &Node, child: usize) -> u32 {
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
