//! What the rays of a tile hit, by the exact arithmetic, in their own units.

use super::{
    RAYS,
    rays::{QUAD, Quad, Tile},
    resolve::eight,
};
use crate::{
    ray::{Eight, MISS},
    simd::{Kernel, Simd},
    traverse::take::Take,
    triangle::LANES,
};

/// Tells the hits of a traced tile, whose rays are those of the batch from `first` on.
pub struct Tell<'a, T: ?Sized> {
    pub tile: &'a Tile,
    pub to: &'a mut T,
    pub first: usize,
    /// Whether hits go [past the caches](Take::aligned).
    pub is_large: bool,
}

impl<T: Take + ?Sized> Kernel for Tell<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { tile, to, first, is_large } = self;
        let count = tile.count * RAYS;
        if is_large && let Some(mut to) = to.aligned(first, count) {
            for ray in (0..count).step_by(LANES) {
                let mut hits = Eight::MISSES;
                tile.tell(simd, ray, &mut hits);
                to.set_eight(simd, ray, &hits);
            }
        } else {
            for ray in (0..count).step_by(LANES) {
                let mut hits = Eight::MISSES;
                tile.tell(simd, ray, &mut hits);
                to.take_eight(first + ray, &hits);
            }
        }
    }
}

impl Tile {
    /// Write the best hits of eight rays of the tile, from `first` on, over misses. To return them would copy them by
    /// vectors wider than those they were written by.
    #[inline(always)]
    fn tell<S: Simd>(&self, simd: S, first: usize, hits: &mut Eight) {
        let quads = [self.quad(first / QUAD), self.quad(first / QUAD + 1)];
        let [one, other] = quads;
        let best = eight(simd, quads, [&self.groups[one.group].best, &self.groups[other.group].best]);
        // Of all these bits, those of MISS alone are not a number.
        let met = simd.le(best, best);
        if met != 0 {
            self.set_together(simd, quads, (best, met), hits);
        }
    }

    #[inline(always)]
    fn set_together<S: Simd>(&self, simd: S, quads: [Quad; 2], (best, met): (S::F32, u32), hits: &mut Eight) {
        let zero = simd.splat(0.0);
        let found = self.found(simd, quads, (best, met));
        let exact = self.exact(simd, quads, &found.corners);
        let [one, other] = quads;
        let scale = eight(simd, quads, [&self.exactly[one.group].scale, &self.exactly[other.group].scale]);
        let t = simd.mul(exact.t, scale);
        let primitive = simd.if_ge(best, zero, found.primitive, simd.splat(f32::from_bits(MISS)));
        hits.primitive = bytemuck::cast(simd.store(primitive));
        hits.t = simd.store(simd.if_ge(best, zero, t, simd.splat(f32::INFINITY)));
        hits.u = simd.store(simd.if_ge(best, zero, exact.u, zero));
        hits.v = simd.store(simd.if_ge(best, zero, exact.v, zero));
    }
}
