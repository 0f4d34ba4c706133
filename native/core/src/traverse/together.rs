//! Batches whose rays walk together: eight by eight into streams, or, where they start at one point, into tiles.

use bytemuck::Zeroable;

use super::{
    Tracer,
    answers::Answers,
    batch::Room,
    frame::Frame,
    pace::{Pace, Trial},
    setup,
    stream::{self, Bin},
    tile,
};
use crate::{
    Error,
    ray::{Eight, Hit, HitsMut, MISS, Rays},
    simd::{Kernel, Simd},
    triangle::LANES,
};

/// What answers are written to.
pub trait Take {
    /// The hit of a ray, in its frame's units.
    fn take(&mut self, index: usize, frame: &Frame, hit: Hit);
    /// The hits of rays `index` to `index + 7`, in their own units.
    fn take_eight(&mut self, index: usize, hits: &Eight);
}

impl Take for HitsMut<'_> {
    #[inline(always)]
    fn take(&mut self, index: usize, frame: &Frame, hit: Hit) {
        self.set(index, in_ray_units(frame, hit));
    }
    #[inline(always)]
    fn take_eight(&mut self, index: usize, hits: &Eight) {
        self.set_eight(index, hits);
    }
}

impl Take for [bool] {
    #[inline(always)]
    fn take(&mut self, index: usize, _: &Frame, hit: Hit) {
        self[index] = hit.primitive != MISS;
    }
    #[inline(always)]
    fn take_eight(&mut self, index: usize, hits: &Eight) {
        for lane in 0..LANES {
            self[index + lane] = hits.primitive[lane] != MISS;
        }
    }
}

#[inline(always)]
pub fn in_ray_units(frame: &Frame, hit: Hit) -> Hit {
    if hit.primitive == MISS { Hit::MISS } else { Hit { t: frame.parameter(hit.t), ..hit } }
}

/// After rays of one origin that make no tile, tiles are not tried for so many.
const UNRIPE: usize = 128;

/// A batch and what its answers are written to.
pub struct Together<'a, T: ?Sized, const ANY: bool> {
    tracer: Tracer<'a>,
    rays: &'a Rays<'a>,
    to: &'a mut T,
    room: &'a mut Room,
    trial: Trial<'a>,
    /// Before this ray no tile is tried.
    ripe: usize,
    /// Whether all bins are being traced, for a measurement.
    emptying: bool,
}

impl<T: Take + ?Sized, const ANY: bool> Kernel for Together<'_, T, ANY> {
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        match self.tracer.structure.has_grids() {
            false => self.each::<S, false>(simd),
            true => self.each::<S, true>(simd),
        }
    }
}

impl<'a, T: Take + ?Sized, const ANY: bool> Together<'a, T, ANY> {
    /// The batch as a kernel; what it learns about its rays goes to `pace`.
    pub fn new(tracer: Tracer<'a>, rays: &'a Rays<'a>, to: &'a mut T, room: &'a mut Room, pace: &'a Pace) -> Self {
        Self { tracer, rays, to, room, trial: Trial::new(pace), ripe: 0, emptying: false }
    }

    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool>(mut self, simd: S) -> Result<(), Error> {
        let Tracer { structure, mesh, .. } = self.tracer;
        self.room.bins.iter_mut().for_each(Bin::clear);
        let mut next = 0;
        while let Some(octant) = self.fill::<S, GRIDS>(simd, &mut next)? {
            let Room { stack, bins, lists, .. } = &mut *self.room;
            stream::trace::<S, GRIDS, ANY>(simd, structure, mesh, octant, &mut bins[octant], lists, stack);
            self.answer(simd, octant);
            self.room.bins[octant].clear();
        }
        Ok(())
    }

    /// Take rays from `next` on, in tiles or into bins, until a bin is to be traced, and tell which.
    #[inline(always)]
    fn fill<S: Simd, const GRIDS: bool>(&mut self, simd: S, next: &mut usize) -> Result<Option<usize>, Error> {
        let mut full = self.room.bins.iter().position(Bin::is_full);
        loop {
            while full.is_none() && !self.emptying && *next < self.rays.len() {
                let mut taken = if ANY || *next < self.ripe { 0 } else { self.tile::<S, GRIDS>(simd, *next) };
                if taken == 0 {
                    (taken, full) = self.scatter(simd, *next)?;
                }
                *next += taken;
                self.emptying = !ANY && self.trial.took(taken);
            }
            let found = full.or_else(|| self.room.bins.iter().position(|bin| !bin.is_empty()));
            if found.is_some() {
                return Ok(found);
            }
            self.emptying = false;
            self.trial.emptied();
            if *next >= self.rays.len() {
                return Ok(None);
            }
        }
    }

    /// Put eight rays, or the batch's last ones, into bins; returns how many, and which bin is full.
    #[inline(always)]
    fn scatter<S: Simd>(&mut self, simd: S, first: usize) -> Result<(usize, Option<usize>), Error> {
        let mut frames = [Frame::zeroed(); LANES];
        let lanes = LANES.min(self.rays.len() - first);
        self.frames(simd, first, &mut frames[..lanes])?;
        let mut full = None;
        for lane in 0..lanes {
            let octant = frames[lane].octant();
            self.room.bins[octant].push(first + lane, &frames[lane]);
            if self.room.bins[octant].is_full() {
                full = Some(octant);
            }
        }
        Ok((lanes, full))
    }

    /// Trace a tile of the rays from `first` on; returns how many it holds, 0 where it is no tile's turn or they make
    /// none.
    #[inline(always)]
    fn tile<S: Simd, const GRIDS: bool>(&mut self, simd: S, first: usize) -> usize {
        let Tracer { structure, mesh, .. } = self.tracer;
        let Room { stack, tile, visits, .. } = &mut *self.room;
        if !self.trial.wants_tiles() || !self.rays.is_common_origin(first) {
            return 0;
        }
        let start = self.trial.start();
        let taken = tile.gather(simd, self.rays, first, &structure.domain);
        if taken == 0 {
            self.ripe = first + UNRIPE;
            return 0;
        }
        tile::trace::<S, GRIDS>(simd, structure, mesh, tile, visits, stack);
        for group in 0..tile.count {
            self.to.take_eight(first + group * LANES, &tile.hits(simd, mesh, group));
        }
        self.trial.traced_tile(start, taken);
        taken
    }

    /// The frames of the rays from `first` on.
    #[inline(always)]
    fn frames<S: Simd>(&self, simd: S, first: usize, frames: &mut [Frame]) -> Result<(), Error> {
        let domain = &self.tracer.structure.domain;
        if let Some(eight) = frames.first_chunk_mut()
            && setup::eight(simd, self.rays, first, domain, eight)
        {
            return Ok(());
        }
        for (lane, frame) in frames.iter_mut().enumerate() {
            *frame = self.rays.frame(first + lane, domain)?;
        }
        Ok(())
    }

    /// Tell what the rays of a bin hit.
    #[inline(always)]
    fn answer<S: Simd>(&mut self, simd: S, octant: usize) {
        let bin = &self.room.bins[octant];
        if !ANY {
            bin.warm(simd, self.tracer.mesh);
        }
        let (mut answers, mut slot) = (Answers::EMPTY, 0);
        while slot < bin.len() {
            while slot < bin.len() && !answers.is_full() {
                let (index, frame, best) = bin.ray(slot);
                if ANY || best.primitive == MISS {
                    self.to.take(index, frame, Hit { primitive: best.primitive, ..Hit::MISS });
                } else {
                    answers.push(slot, frame, self.tracer.mesh, best.primitive);
                }
                slot += 1;
            }
            if ANY {
                continue;
            }
            let (hits, count) = answers.take(simd);
            for &(slot, hit) in &hits[..count] {
                let (index, frame, _) = bin.ray(slot);
                self.to.take(index, frame, hit);
            }
        }
    }
}
