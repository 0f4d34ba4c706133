//! Batches whose rays walk together: in streams, sorted by the grid over the rays, or, where they start at one point,
//! in tiles.

use super::{
    Tracer, answers,
    batch::Room,
    frame::Domain,
    pace::{Pace, Trial},
    packet::Packets,
    stream::{self, bin_size},
    take::Take,
    tile::{EXTENTS, Gather, Tell, Trace},
};
use crate::{
    Error,
    ray::{Hit, Rays},
    simd::{Kernel, Simd},
};

/// Whether most of the rays begin near the one before.
#[inline(always)]
fn are_side_by_side(rays: &Rays<'_>, domain: &Domain) -> bool {
    let (mut near, mut pairs) = (0, 0);
    for index in (1..rays.len()).step_by(SAMPLED) {
        let (this, before) = (rays.origin(index), rays.origin(index - 1));
        let mut apart = 0f32;
        for k in 0..3 {
            apart = apart.max((this[k] - before[k]).abs());
        }
        near += usize::from(apart < NEIGHBOURS * domain.half_extent);
        pairs += 1;
    }
    2 * near >= pairs
}

/// As many of a list as are evaluated at once, or what is left of them.
#[inline(always)]
fn sixteen(list: &[u16], first: usize) -> &[u16] {
    &list[first.min(list.len())..list.len().min(first + answers::RAYS)]
}

/// Rays between two looks at the clock where they walk in packets. After a stream the first of them wait for the tree:
/// by 256 rays, packets that took 1/1.2 of the time seemed to take longer.
const PACKED: usize = 1024;

/// Every so many rays are compared with the one before.
const SAMPLED: usize = 32;

/// Half extents of the scene within which rays are near each other: an edge of a cell of the grid over the rays.
const NEIGHBOURS: f32 = 1.0 / 8.0;

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
    /// See [`Pace::is_large`].
    is_large: bool,
}

impl<T: Take + ?Sized, const ANY: bool> Kernel for Together<'_, T, ANY> {
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let traced = match self.tracer.structure.has_grids() {
            false => self.each::<S, false>(simd),
            true => self.each::<S, true>(simd),
        };
        simd.fence();
        traced
    }
}

impl<'a, T: Take + ?Sized, const ANY: bool> Together<'a, T, ANY> {
    /// The batch as a kernel; what it learns about its rays goes to `pace`.
    pub fn new(tracer: Tracer<'a>, rays: &'a Rays<'a>, to: &'a mut T, room: &'a mut Room, pace: &'a Pace) -> Self {
        Self { tracer, rays, to, room, trial: Trial::new(pace), ripe: 0, is_large: pace.is_large() }
    }

    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool>(mut self, simd: S) -> Result<(), Error> {
        self.room.waiting.begin(self.rays.len());
        let mut next = 0;
        while next < self.rays.len() {
            let mut taken = if next < self.ripe {
                0
            } else if ANY {
                self.packets::<S, GRIDS>(simd, next)?
            } else {
                self.tile::<S, GRIDS>(simd, next)
            };
            if taken == 0 {
                taken = self.room.waiting.add(simd, self.rays, next, &self.tracer.structure.domain)?;
            }
            next += taken;
            let measured = self.trial.took(taken);
            if measured || self.room.waiting.is_full() || next == self.rays.len() {
                let Self { tracer, room, to, is_large, .. } = &mut self;
                simd.run(Streams::<T, GRIDS, ANY> { tracer: *tracer, room, to, is_large: *is_large })?;
                self.trial.emptied();
            }
        }
        Ok(())
    }

    /// Trace a tile of the rays from `first` on; returns how many it holds, 0 where it is no tile's turn or they make
    /// none.
    #[inline(always)]
    fn tile<S: Simd, const GRIDS: bool>(&mut self, simd: S, first: usize) -> usize {
        let Tracer { structure, mesh, .. } = self.tracer;
        let Room { stack, tile, visits, waiting, .. } = &mut *self.room;
        if !self.trial.wants_tiles(waiting.is_empty()) || !self.rays.is_common_origin(first) {
            return 0;
        }
        self.trial.begin_tile();
        let taken = simd.run(Gather { tile, rays: self.rays, first, domain: &structure.domain });
        if taken == 0 {
            self.ripe = first + UNRIPE;
            return 0;
        }
        let Some(count) = simd.run(Trace::<GRIDS> { structure, mesh, tile, visits, stack }) else {
            self.trial.gave_up();
            self.ripe = first + taken;
            return 0;
        };
        let (tile, to, is_large) = (&**tile, &mut *self.to, self.is_large);
        simd.run(Tell::<T> { tile, to, first, is_large });
        self.trial.traced_tile(taken, count);
        taken
    }

    /// Trace the rays from `first` on in packets; returns how many rays, 0 where it is not their turn or they would not
    /// keep together.
    #[inline(always)]
    fn packets<S: Simd, const GRIDS: bool>(&mut self, simd: S, first: usize) -> Result<usize, Error> {
        let domain = &self.tracer.structure.domain;
        let Room { stack, packet, waiting, .. } = &mut *self.room;
        if !EXTENTS.contains(&domain.half_extent) || !self.trial.wants_tiles(waiting.is_empty()) {
            return Ok(0);
        }
        let rays = self.rays.part(first, PACKED);
        if !are_side_by_side(&rays, domain) {
            self.ripe = first + UNRIPE;
            return Ok(0);
        }
        self.trial.begin_tile();
        let (tracer, to) = (self.tracer, &mut *self.to);
        simd.run(Packets::<T, GRIDS> { tracer, rays: &rays, memory: packet, stack, to, place: first })?;
        self.trial.traced_tile(rays.len(), usize::MAX);
        Ok(rays.len())
    }
}

/// All rays that wait, to be traced. A kernel of its own: within the loop that comes here now and then, it made camera rays
/// that never do take 1.05 times as long.
struct Streams<'a, T: ?Sized, const GRIDS: bool, const ANY: bool> {
    tracer: Tracer<'a>,
    room: &'a mut Room,
    to: &'a mut T,
    is_large: bool,
}

impl<T: Take + ?Sized, const GRIDS: bool, const ANY: bool> Kernel for Streams<'_, T, GRIDS, ANY> {
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) -> Self::Output {
        let Tracer { structure, mesh, .. } = self.tracer;
        let octants = self.room.waiting.sort();
        for (octant, places) in octants.into_iter().enumerate() {
            for first in places.clone().step_by(bin_size()) {
                let Room { stack, bin, lists, waiting, .. } = &mut *self.room;
                bin.fill::<S, ANY>(simd, waiting, first..places.end.min(first + bin_size()), &structure.domain)?;
                stream::trace::<S, GRIDS, ANY>(simd, structure, mesh, octant, bin, lists, stack);
                self.answer(simd);
            }
        }
        let Self { room: Room { waiting, .. }, to, is_large, .. } = self;
        if !ANY {
            waiting.tell(simd, to, is_large);
        }
        waiting.begin(0);
        Ok(())
    }
}

impl<T: Take + ?Sized, const GRIDS: bool, const ANY: bool> Streams<'_, T, GRIDS, ANY> {
    /// Tell what the rays of a bin hit.
    #[inline(always)]
    fn answer<S: Simd>(&mut self, simd: S) {
        let Room { bin, waiting, .. } = &mut *self.room;
        if ANY {
            for slot in 0..bin.len() {
                let hit = Hit { primitive: bin.best(slot).primitive, ..Hit::MISS };
                self.to.take(waiting.index(bin.place(slot)), hit);
            }
            return;
        }
        bin.find_met();
        let (mesh, met) = (self.tracer.mesh.reader(), bin.met());
        for first in (0..met.len()).step_by(answers::RAYS) {
            // The triangles of the next but one, and the corners of the next, are to be near when they are wanted.
            for &slot in sixteen(met, first + 2 * answers::RAYS) {
                mesh.warm_triangle(simd, bin.best(slot.into()).primitive);
            }
            for &slot in sixteen(met, first + answers::RAYS) {
                mesh.warm_corners(simd, bin.best(slot.into()).primitive);
            }
            let mut slots = [met[first].into(); answers::RAYS];
            for (slot, &ray) in slots.iter_mut().zip(sixteen(met, first)) {
                *slot = ray.into();
            }
            let hits = answers::evaluate(simd, bin, &slots, mesh);
            for (slot, hit) in slots.into_iter().zip(hits) {
                waiting.answer(bin.place(slot), hit);
            }
        }
    }
}
