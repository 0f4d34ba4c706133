//! Where the planes decide nothing about a triangle and some rays of a tile, and the exact test is asked.

use super::{
    RAYS,
    alone::CONVERSION,
    rays::{Exactly, Group, QUAD, Quad, Tile},
};
use crate::{
    simd::{Kernel, Simd},
    triangle::{Block, LANES},
};

/// A triangle that the exact test is to decide about for some lanes of a group; tells whether some best hit came nearer.
/// A kernel of its own: as part of the loop that comes here now and then, it made camera rays take 1.03 times as long.
pub struct Decide<'a> {
    pub tile: &'a mut Tile,
    pub group: usize,
    pub lanes: u32,
    pub block: &'a Block,
    pub triangle: usize,
    /// Where the tile holds it.
    pub place: u32,
}

impl Kernel for Decide<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let Self { tile, group, lanes, block, triangle, place } = self;
        tile.decide(simd, (group, lanes), (block, triangle), place)
    }
}

impl Tile {
    #[inline(always)]
    fn decide<S: Simd>(
        &mut self,
        simd: S,
        (group, lanes): (usize, u32),
        (block, triangle): (&Block, usize),
        place: u32,
    ) -> bool {
        let order = self.order([Quad { group, quad: 0 }; 2]);
        let corners = self.repeated(simd, order, block.corners(triangle).each_ref());
        let mut is_nearer = false;
        for first in [0, LANES] {
            let lanes = lanes >> first & 0xff;
            if lanes == 0 {
                continue;
            }
            let quads = [Quad { group, quad: first / QUAD }, Quad { group, quad: first / QUAD + 1 }];
            let exact = self.exact(simd, quads, &corners);
            let (mut t, mut hit) = (exact.t, lanes & exact.hit);
            if lanes & exact.unclear != 0 {
                let mut each = simd.store(t);
                hit |= self.ask(quads, lanes & exact.unclear, (block, triangle), &mut each);
                t = simd.load(&each);
            }
            is_nearer |= self.offer(simd, quads, hit, t, place);
        }
        is_nearer
    }

    /// Ask about a triangle for some of eight rays one by one; tells which hit it, and where.
    #[cold]
    #[inline(never)]
    fn ask(&self, quads: [Quad; 2], lanes: u32, (block, triangle): (&Block, usize), t: &mut [f32; LANES]) -> u32 {
        let mut hit = 0;
        for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
            let Quad { group, quad } = quads[lane / QUAD];
            if let Some(found) = block.intersect(triangle, &self.frame(group, quad * QUAD + lane % QUAD)) {
                t[lane] = found.t;
                hit |= 1 << lane;
            }
        }
        hit
    }

    /// Make exact hits of a triangle, in some of eight rays of a group, the best of theirs that they are; true where there
    /// is such.
    #[inline(always)]
    fn offer<S: Simd>(&mut self, simd: S, quads: [Quad; 2], lanes: u32, t: S::F32, place: u32) -> bool {
        let [Quad { group, quad }, _] = quads;
        let first = quad * QUAD;
        let Exactly { interval: [tmin, tmax], direction, .. } = &self.exactly[group];
        let (tmin, tmax) = (simd.load(half(tmin, first)), simd.load(half(tmax, first)));
        let lanes = lanes & simd.le(tmin, t) & simd.le(t, tmax);
        if lanes == 0 {
            return false;
        }
        let depth = simd.mul(t, simd.abs(simd.load(half(&direction[self.axes[2]], first))));
        let from = simd.mul(depth, simd.splat(1.0 - CONVERSION));
        let to = simd.mul(depth, simd.splat(1.0 + CONVERSION));
        let Group { low, high, best, .. } = &self.groups[group];
        let [low, high, best] =
            [simd.load(half(low, first)), simd.load(half(high, first)), simd.load(half(best, first))];
        let mut nearer = lanes & !simd.le(low, to);
        let equal = lanes & !nearer & simd.le(from, high);
        if equal != 0 {
            nearer |= equal & self.preceding(simd, quads, best, t, place);
        }
        if nearer == 0 {
            return false;
        }
        let rays = &mut self.groups[group];
        *half_mut(&mut rays.low, first) = simd.store(simd.select(nearer, from, low));
        *half_mut(&mut rays.high, first) = simd.store(simd.select(nearer, to, high));
        let winner = simd.splat(f32::from_bits(place));
        *half_mut(&mut rays.best, first) = simd.store(simd.select(nearer, winner, best));
        true
    }

    /// The rays whose best hits so far come behind others of some triangle in the order of [`Hit::precedes`].
    ///
    /// [`Hit::precedes`]: crate::ray::Hit::precedes
    #[inline(always)]
    fn preceding<S: Simd>(&self, simd: S, quads: [Quad; 2], best: S::F32, t: S::F32, place: u32) -> u32 {
        let met = simd.le(best, best);
        if met == 0 {
            return 0xff;
        }
        let found = self.found(simd, quads, (best, met));
        let (other, t) = (simd.store(self.exact(simd, quads, &found.corners).t), simd.store(t));
        let best: [u32; LANES] = bytemuck::cast(simd.store(found.primitive));
        let primitive = self.held.get(place).primitive();
        let mut preceding = !met & 0xff;
        for lane in 0..LANES {
            let precedes = (t[lane] < other[lane]) | ((t[lane] == other[lane]) & (primitive < best[lane]));
            preceding |= u32::from(precedes) << lane;
        }
        preceding
    }
}

/// Eight of a group's numbers, from `first` on.
#[inline(always)]
fn half(numbers: &[f32; RAYS], first: usize) -> &[f32; LANES] {
    &bytemuck::cast_ref::<_, [[f32; LANES]; 2]>(numbers)[first / LANES]
}

#[inline(always)]
fn half_mut(numbers: &mut [f32; RAYS], first: usize) -> &mut [f32; LANES] {
    &mut bytemuck::cast_mut::<_, [[f32; LANES]; 2]>(numbers)[first / LANES]
}
