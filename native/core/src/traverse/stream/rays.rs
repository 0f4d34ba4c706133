//! The rays of a bin, sixteen at once.

use bytemuck::{Pod, Zeroable};

use super::Bin;
use crate::{
    ray::MISS,
    simd::{Arithmetic, Simd},
    traverse::{frame::Frame, leaf::Best},
};

/// Rays that are tested at once.
pub const RAYS: usize = 16;

/// A number for every ray.
type Vector<S> = <<S as Simd>::Wide as Arithmetic>::F32;

/// What a ray has found so far, and where its interval begins.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Standing {
    low: f32,
    high: f32,
    primitive: u32,
    tmin: f32,
}

impl Standing {
    /// Of a ray that has found nothing yet.
    #[inline(always)]
    pub fn begin(frame: &Frame) -> Self {
        Self { low: frame.tmax, high: frame.tmax, primitive: MISS, tmin: frame.tmin }
    }

    /// The first hit so far.
    #[inline(always)]
    pub fn best(&self) -> Best {
        Best { low: self.low, high: self.high, primitive: self.primitive }
    }

    /// Make a hit the first so far.
    #[inline(always)]
    pub fn set(&mut self, Best { low, high, primitive }: Best) {
        *self = Self { low, high, primitive, tmin: self.tmin };
    }
}

/// Sixteen rays of a bin, and what they have found so far.
pub struct Sixteen<S: Simd> {
    ids: [usize; RAYS],
    pub origin: [Vector<S>; 3],
    pub steepness: Vector<S>,
    pub shear: [Vector<S>; 2],
    /// As bits.
    pub axes: [Vector<S>; 3],
    pub tmin: Vector<S>,
    pub low: Vector<S>,
    pub high: Vector<S>,
    /// As bits.
    pub primitive: Vector<S>,
}

impl<S: Simd> Sixteen<S> {
    /// The rays of a list of at most sixteen; the first one is repeated where there are fewer.
    #[inline(always)]
    pub fn new(simd: S, bin: &Bin, list: &[u16]) -> Self {
        let mut ids = [usize::from(list[0]); RAYS];
        for (lane, &id) in list.iter().enumerate() {
            ids[lane & (RAYS - 1)] = usize::from(id);
        }
        let [mut first, mut second, mut third] = [[&[0.0; 4]; RAYS]; 3];
        for lane in 0..RAYS {
            [first[lane], second[lane], _] = bin.frames[ids[lane]].sheared();
            third[lane] = bytemuck::cast_ref(&bin.hits[ids[lane]]);
        }
        let wide = simd.wide();
        let [x, y, z, steepness] = simd.columns(&first);
        let [across, along, kx, ky] = simd.columns(&second);
        let [low, high, primitive, tmin] = simd.columns(&third);
        // The three are 0, 1 and 2.
        let kz = wide.sub_bits(wide.sub_bits(wide.splat(f32::from_bits(3)), kx), ky);
        let (origin, shear, axes) = ([x, y, z], [across, along], [kx, ky, kz]);
        Self { ids, origin, steepness, shear, axes, tmin, low, high, primitive }
    }

    /// Which ray of the bin is in a lane.
    #[inline(always)]
    pub fn id(&self, lane: u32) -> usize {
        self.ids[lane as usize & (RAYS - 1)]
    }

    /// Read anew what the rays have found so far.
    #[inline(always)]
    pub fn read(&mut self, simd: S, bin: &Bin) {
        let mut rows = [&[0.0; 4]; RAYS];
        for lane in 0..RAYS {
            rows[lane] = bytemuck::cast_ref(&bin.hits[self.ids[lane]]);
        }
        [self.low, self.high, self.primitive, self.tmin] = simd.columns(&rows);
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
