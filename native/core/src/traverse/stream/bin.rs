//! The rays that walk together, from where they wait to what they have found.

use std::{ops::Range, sync::LazyLock};

use bytemuck::Zeroable;

use crate::{
    Error, cache,
    ray::MISS,
    simd::Simd,
    traverse::{
        frame::{Domain, Found, Frame, Shears, Slabs},
        leaf::Best,
        setup::Frames,
        waiting::Waiting,
    },
    triangle::LANES,
};

/// The least and the most rays that walk together.
const SIZES: [usize; 2] = [1 << 10, 1 << 12];

/// Rays that walk together, a power of two: as many as have frames in a quarter of the second-level cache. With 2 MiB of
/// it 4096 took 1/1.05 of the time of 1024 (the dragon 1/1.06, Sponza 1/1.13, the room 1.01 times), and 8192 as long as
/// 4096; with 512 KiB 4096 took up to 1.1 times as long on surfaces.
pub fn bin_size() -> usize {
    static SIZE: LazyLock<usize> = LazyLock::new(|| {
        let fitting = cache::second_level() / 4 / size_of::<Frame>();
        1 << fitting.clamp(SIZES[0], SIZES[1]).ilog2()
    });
    *SIZE
}

/// Rays of one octant.
#[derive(Debug, Default)]
pub struct Bin {
    slabs: Vec<Slabs>,
    shears: Vec<Shears>,
    places: Range<usize>,
    /// The rays that hit something, then what is left from before.
    met: Vec<u16>,
    count_met: usize,
}

impl Bin {
    /// Take the rays of some places in the order of those that wait, at most [`bin_size`].
    ///
    /// # Errors
    /// [`Error::Ray`] for an unusable ray.
    #[inline(always)]
    pub fn fill<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        waiting: &mut Waiting,
        places: Range<usize>,
        domain: &Domain,
    ) -> Result<(), Error> {
        self.slabs.resize(bin_size(), Slabs::zeroed());
        self.shears.resize(bin_size(), Shears::zeroed());
        let ((slabs, _), (shears, _)) = (self.slabs.as_chunks_mut(), self.shears.as_chunks_mut());
        for ((first, slabs), shears) in places.clone().step_by(LANES).zip(slabs).zip(shears) {
            waiting.warm(simd, first + 2 * LANES);
            if let Some(eight) = Frames::new(simd, &waiting.eight(simd, first..places.end), domain) {
                (*slabs, *shears) = eight.lines(simd);
            } else {
                for ((place, slabs), shears) in (first..places.end).zip(slabs).zip(shears) {
                    let frame = waiting.frame(place, domain)?;
                    (*slabs, *shears) = (frame.slabs(), *frame.shears());
                }
            }
            if !ANY {
                waiting.miss(first..places.end.min(first + LANES));
            }
        }
        self.places = places;
        Ok(())
    }

    /// How many rays there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// The place of a ray in the order of those that waited.
    #[inline(always)]
    pub fn place(&self, slot: usize) -> usize {
        self.places.start + slot
    }

    /// What box tests of the rays read.
    #[inline(always)]
    pub fn slabs(&self) -> &[Slabs] {
        &self.slabs
    }

    /// What triangle tests of the rays read.
    #[inline(always)]
    pub fn shears(&self) -> &[Shears] {
        &self.shears
    }

    /// The frame of a ray.
    #[inline(always)]
    pub fn frame(&self, slot: usize) -> Frame {
        Frame::of_lines(&self.slabs[slot], &self.shears[slot])
    }

    /// Whether a ray's interval is empty.
    #[inline(always)]
    pub fn has_ended(&self, slot: usize) -> bool {
        self.slabs[slot].tmin > self.slabs[slot].tmax
    }

    /// What a ray has found so far.
    #[inline(always)]
    pub fn best(&self, slot: usize) -> Best {
        let Slabs { tmax, found, .. } = self.slabs[slot];
        Best { low: found.low, high: tmax, primitive: found.primitive }
    }

    /// Nothing beyond the best hit of a ray is of interest any more; where any hit will do, nothing at all.
    #[inline(always)]
    pub fn keep<const ANY: bool>(&mut self, slot: usize, best: Best) {
        let ends = ANY && best.primitive != MISS;
        let slabs = &mut self.slabs[slot];
        slabs.tmax = if ends { f32::NEG_INFINITY } else { best.high };
        slabs.found = Found { low: best.low, primitive: best.primitive };
    }

    /// Find out which rays hit something. Without a branch, which could not be predicted.
    #[inline(always)]
    pub fn find_met(&mut self) {
        let count = self.len();
        self.met.resize(bin_size(), 0);
        let (met, mut front) = (&mut self.met[..count], 0);
        for (slot, slabs) in self.slabs[..count].iter().enumerate() {
            met[front] = slot as u16;
            front += usize::from(slabs.found.primitive != MISS);
        }
        self.count_met = front;
    }

    /// The rays that hit something, by what [`Bin::find_met`] found.
    #[inline(always)]
    pub fn met(&self) -> &[u16] {
        &self.met[..self.count_met]
    }
}
