//! The rays of a bin, sixteen at once.

use super::Bin;
use crate::{
    simd::{Arithmetic, Simd},
    traverse::{
        crossing::{Crossings, third_axis},
        leaf::Best,
    },
};

/// Rays that are tested at once.
pub const RAYS: usize = 16;

/// A number for every ray.
type Vector<S> = <<S as Simd>::Wide as Arithmetic>::F32;

/// Sixteen rays of a bin, and what they have found so far.
pub struct Sixteen<S: Simd> {
    ids: [usize; RAYS],
    pub origin: [Vector<S>; 3],
    pub direction: [Vector<S>; 3],
    pub steepness: Vector<S>,
    pub tmin: Vector<S>,
    pub high: Vector<S>,
    low: Vector<S>,
    /// As bits.
    primitive: Vector<S>,
}

impl<S: Simd> Sixteen<S> {
    /// The rays of a list of at most sixteen; the first one is repeated where there are fewer.
    #[inline(always)]
    pub fn new(simd: S, bin: &Bin, list: &[u16]) -> Self {
        let mut ids = [usize::from(list[0]); RAYS];
        for (lane, &id) in list.iter().enumerate() {
            ids[lane & (RAYS - 1)] = usize::from(id);
        }
        let (slabs, shears) = (bin.slabs(), bin.shears());
        let [mut first, mut second, mut third] = [[&[0.0; 4]; RAYS]; 3];
        for lane in 0..RAYS {
            [first[lane], second[lane], _] = shears[ids[lane]].rows();
            third[lane] = slabs[ids[lane]].standing();
        }
        let [x, y, z, steepness] = simd.columns(&first);
        let [dx, dy, dz, _] = simd.columns(&second);
        let [tmin, high, low, primitive] = simd.columns(&third);
        Self { ids, origin: [x, y, z], direction: [dx, dy, dz], steepness, tmin, high, low, primitive }
    }

    /// How far the origins are from a point, in any coordinate.
    #[inline(always)]
    pub fn away(&self, wide: S::Wide, from: [f32; 3]) -> Vector<S> {
        let mut away = wide.splat(0.0);
        for k in 0..3 {
            away = wide.max(wide.abs(wide.sub(self.origin[k], wide.splat(from[k]))), away);
        }
        away
    }

    /// Shears and axes, the latter as bits.
    #[inline(always)]
    pub fn shear(&self, simd: S, bin: &Bin) -> ([Vector<S>; 2], [Vector<S>; 3]) {
        let (shears, mut rows) = (bin.shears(), [&[0.0; 4]; RAYS]);
        for lane in 0..RAYS {
            [_, _, rows[lane]] = shears[self.ids[lane]].rows();
        }
        let wide = simd.wide();
        let [across, along, x, y] = simd.columns(&rows);
        ([across, along], [x, y, third_axis(wide, x, y)])
    }

    /// Make a triangle that is surely the first hit of some of the lanes theirs; tells of which.
    #[inline(always)]
    pub fn take<W, const ANY: bool>(&mut self, wide: W, lanes: u32, crossings: &Crossings<W>, primitive: u32) -> u32
    where
        W: Arithmetic,
        S: Simd<Wide = W>,
    {
        let nearer = if ANY { u32::MAX } else { !wide.le(self.low, crossings.high) };
        let hit = lanes & crossings.sure & nearer;
        self.primitive = wide.select(hit, wide.splat(f32::from_bits(primitive)), self.primitive);
        if !ANY {
            self.low = wide.select(hit, crossings.low, self.low);
            self.high = wide.select(hit, crossings.high, self.high);
        }
        hit
    }

    /// Which ray of the bin is in a lane.
    #[inline(always)]
    pub fn id(&self, lane: u32) -> usize {
        self.ids[lane as usize & (RAYS - 1)]
    }

    /// Read anew what the rays have found so far.
    #[inline(always)]
    pub fn read(&mut self, simd: S, bin: &Bin) {
        let (slabs, mut rows) = (bin.slabs(), [&[0.0; 4]; RAYS]);
        for lane in 0..RAYS {
            rows[lane] = slabs[self.ids[lane]].standing();
        }
        [self.tmin, self.high, self.low, self.primitive] = simd.columns(&rows);
    }

    /// Write what the rays of some lanes have found.
    #[inline(always)]
    pub fn write<const ANY: bool>(&self, simd: S, bin: &mut Bin, mut lanes: u32) {
        if lanes == 0 {
            return;
        }
        let (low, high) = (simd.store_wide(self.low), simd.store_wide(self.high));
        let primitive = simd.store_wide(self.primitive);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & (RAYS - 1);
            lanes &= lanes - 1;
            let best = Best { low: low[lane], high: high[lane], primitive: primitive[lane].to_bits() };
            bin.keep::<ANY>(self.ids[lane], best);
        }
    }
}
