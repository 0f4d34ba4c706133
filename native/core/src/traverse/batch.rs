//! Batches: where rays are gathered, checked and handed to the kernel that fits.

use std::{cell::RefCell, marker::PhantomData};

use super::{
    answers::Answers,
    frame::Frame,
    kernel::{self, Entry},
    probe::{Counts, Probe, Silent},
    setup,
    stream::{self, Bin, Lists},
};
use bytemuck::Zeroable;

use crate::{
    Error, Job, Mesh,
    accel::structure::Structure,
    job::Phase,
    pool,
    ray::{Hit, HitsMut, MISS, Ray, Rays},
    simd::{Kernel, Level, Simd},
    triangle::LANES,
};

/// A structure, the mesh it stands for, and the instruction set to use.
#[derive(Debug, Clone, Copy)]
pub struct Tracer<'a> {
    /// The tree.
    pub structure: &'a Structure,
    /// Its triangles.
    pub mesh: &'a Mesh,
    /// The instruction set.
    pub level: Level,
}

impl<'a> Tracer<'a> {
    /// The closest hit of every ray, on the calling thread.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub fn closest(self, rays: &Rays<'_>, hits: &mut HitsMut<'_>) -> Result<(), Error> {
        assert_eq!(rays.len(), hits.len());
        let take = |index, frame: &Frame, hit: Hit| hits.set(index, in_ray_units(frame, hit));
        self.silent::<false>(rays, take)
    }

    /// Whether anything lies in the interval of every ray, on the calling thread.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub fn occluded(self, rays: &Rays<'_>, occluded: &mut [bool]) -> Result<(), Error> {
        assert_eq!(rays.len(), occluded.len());
        let take = |index: usize, _: &Frame, hit: Hit| occluded[index] = hit.primitive != MISS;
        self.silent::<true>(rays, take)
    }

    /// What the closest-hit query of every ray costs where it walks alone, on the calling thread.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub fn counted(self, rays: &Rays<'_>, counts: &mut [Counts]) -> Result<(), Error> {
        self.probed(rays, counts)
    }

    /// What a probe of any kind sees of the closest-hit query of every ray, on the calling thread.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub(crate) fn probed<P: Probe + Default>(self, rays: &Rays<'_>, probes: &mut [P]) -> Result<(), Error> {
        assert_eq!(rays.len(), probes.len());
        let take = |index: usize, _: &Frame, _: Hit, seen: P| probes[index] = seen;
        self.with_room(|room| self.level.run(Singles { tracer: self, rays, take, room, probe: PhantomData }))
    }

    /// The closest hit of one ray, on the calling thread: the cheapest way to ask for just one.
    ///
    /// # Errors
    /// [`Error::Ray`] where the ray is unusable.
    pub fn first(self, ray: &Ray) -> Result<Hit, Error> {
        let frame = Frame::new(ray, &self.structure.domain).ok_or_else(|| ray.fault(0))?;
        let hit = self.with_room(|room| self.level.run(One::<false> { tracer: self, frame: &frame, room }));
        Ok(in_ray_units(&frame, hit))
    }

    fn silent<const ANY: bool>(self, rays: &Rays<'_>, mut take: impl FnMut(usize, &Frame, Hit)) -> Result<(), Error> {
        self.with_room(|room| {
            if rays.len() >= LEAST_STREAM {
                return self.level.run(Streams::<_, ANY> { tracer: self, rays, take, room });
            }
            for index in 0..rays.len() {
                let frame = rays.frame(index, &self.structure.domain)?;
                take(index, &frame, self.level.run(One::<ANY> { tracer: self, frame: &frame, room }));
            }
            Ok(())
        })
    }

    /// Lend `work` this thread's room.
    fn with_room<R>(self, work: impl FnOnce(&mut Room) -> R) -> R {
        thread_local!(static ROOM: RefCell<Room> = RefCell::default());
        ROOM.with_borrow_mut(|room| {
            room.stack.resize(self.structure.stack_size.max(room.stack.len()), Entry::NONE);
            work(room)
        })
    }
}

/// Smaller batches are traced ray by ray.
const LEAST_STREAM: usize = 64;

/// What traversals need to remember things in, reused from batch to batch.
#[derive(Default)]
struct Room {
    stack: Vec<Entry>,
    bins: [Bin; 8],
    lists: Lists,
}

#[inline(always)]
fn in_ray_units(frame: &Frame, hit: Hit) -> Hit {
    if hit.primitive == MISS { Hit::MISS } else { Hit { t: frame.parameter(hit.t), ..hit } }
}

/// A ray that walks alone; the result is in the frame's units.
struct One<'a, const ANY: bool> {
    tracer: Tracer<'a>,
    frame: &'a Frame,
    room: &'a mut Room,
}

/// Rays that walk alone under the eyes of probes, and what to do with the index, frame, hit (in the frame's units) and
/// probe of each.
struct Singles<'a, F, P> {
    tracer: Tracer<'a>,
    rays: &'a Rays<'a>,
    take: F,
    room: &'a mut Room,
    probe: PhantomData<P>,
}

/// Rays that walk together, and what to do with the index, frame and hit (in the frame's units) of each.
struct Streams<'a, F, const ANY: bool> {
    tracer: Tracer<'a>,
    rays: &'a Rays<'a>,
    take: F,
    room: &'a mut Room,
}

/// The table that picks a loop's instance, once a batch.
macro_rules! pick_instance {
    ($batch:ident, $simd:ident) => {
        match $batch.tracer.structure.has_grids() {
            false => $batch.each::<S, false>($simd),
            true => $batch.each::<S, true>($simd),
        }
    };
}

impl<const ANY: bool> Kernel for One<'_, ANY> {
    type Output = Hit;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        pick_instance!(self, simd)
    }
}

impl<const ANY: bool> One<'_, ANY> {
    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool>(self, simd: S) -> Hit {
        let Tracer { structure, mesh, .. } = self.tracer;
        let (frame, stack) = (self.frame, &mut self.room.stack);
        kernel::trace::<S, Silent, GRIDS, ANY>(simd, structure, mesh, frame, stack, &mut Silent)
            .answer::<ANY>(frame, mesh)
    }
}

impl<F: FnMut(usize, &Frame, Hit, P), P: Probe + Default> Kernel for Singles<'_, F, P> {
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        pick_instance!(self, simd)
    }
}

impl<F: FnMut(usize, &Frame, Hit), const ANY: bool> Kernel for Streams<'_, F, ANY> {
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        pick_instance!(self, simd)
    }
}

impl<F: FnMut(usize, &Frame, Hit, P), P: Probe + Default> Singles<'_, F, P> {
    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool>(mut self, simd: S) -> Result<(), Error> {
        let Tracer { structure, mesh, .. } = self.tracer;
        for index in 0..self.rays.len() {
            let frame = self.rays.frame(index, &structure.domain)?;
            let mut probe = P::default();
            let stack = &mut self.room.stack;
            let best = kernel::trace::<S, P, GRIDS, false>(simd, structure, mesh, &frame, stack, &mut probe);
            (self.take)(index, &frame, best.answer::<false>(&frame, mesh), probe);
        }
        Ok(())
    }
}

impl<F: FnMut(usize, &Frame, Hit), const ANY: bool> Streams<'_, F, ANY> {
    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool>(mut self, simd: S) -> Result<(), Error> {
        let Tracer { structure, mesh, .. } = self.tracer;
        self.room.bins.iter_mut().for_each(Bin::clear);
        let mut next = 0;
        while let Some(octant) = self.fill(simd, &mut next)? {
            let Room { stack, bins, lists } = &mut *self.room;
            stream::trace::<S, GRIDS, ANY>(simd, structure, mesh, octant, &mut bins[octant], lists, stack);
            self.answer(simd, octant);
            self.room.bins[octant].clear();
        }
        Ok(())
    }

    /// Sort rays from `next` on into bins until one is full or no ray is left, and tell which bin to trace.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, next: &mut usize) -> Result<Option<usize>, Error> {
        let count = self.rays.len();
        let mut full = self.room.bins.iter().position(Bin::is_full);
        while full.is_none() && *next < count {
            let mut frames = [Frame::zeroed(); LANES];
            let lanes = LANES.min(count - *next);
            self.frames(simd, *next, &mut frames[..lanes])?;
            for lane in 0..lanes {
                let octant = frames[lane].octant();
                self.room.bins[octant].push(*next + lane, &frames[lane]);
                if self.room.bins[octant].is_full() {
                    full = Some(octant);
                }
            }
            *next += lanes;
        }
        Ok(full.or_else(|| self.room.bins.iter().position(|bin| !bin.is_empty())))
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
                    (self.take)(index, frame, Hit { primitive: best.primitive, ..Hit::MISS });
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
                (self.take)(index, frame, hit);
            }
        }
    }
}

/// Rays between two looks at the job: a few milliseconds of work even on slow structures.
const PART: usize = 1 << 13;

impl Tracer<'_> {
    /// [`Tracer::closest`] on several threads; 0 means all.
    ///
    /// # Errors
    /// As there, and [`Error::Cancelled`].
    pub fn closest_parallel(self, rays: &Rays<'_>, hits: HitsMut<'_>, threads: usize, job: &Job) -> Result<(), Error> {
        self.parallel(rays, hits.parts(PART), threads, job, |rays, mut hits| self.closest(&rays, &mut hits))
    }

    /// [`Tracer::occluded`] on several threads; 0 means all.
    ///
    /// # Errors
    /// As there, and [`Error::Cancelled`].
    pub fn occluded_parallel(self, rays: &Rays<'_>, out: &mut [bool], threads: usize, job: &Job) -> Result<(), Error> {
        self.parallel(rays, out.chunks_mut(PART), threads, job, |rays, out| self.occluded(&rays, out))
    }

    /// [`Tracer::counted`] on several threads; 0 means all.
    ///
    /// # Errors
    /// As there, and [`Error::Cancelled`].
    pub fn counted_parallel(self, rays: &Rays<'_>, out: &mut [Counts], threads: usize, job: &Job) -> Result<(), Error> {
        self.parallel(rays, out.chunks_mut(PART), threads, job, |rays, out| self.counted(&rays, out))
    }

    fn parallel<O: Send>(
        self,
        rays: &Rays<'_>,
        parts: impl ExactSizeIterator<Item = O> + Send,
        threads: usize,
        job: &Job,
        work: impl Fn(Rays<'_>, O) -> Result<(), Error> + Sync,
    ) -> Result<(), Error> {
        job.begin(Phase::Trace, rays.len() as u64);
        pool::for_each(threads, parts.enumerate(), job, |(number, part)| {
            let rays = rays.part(number * PART, PART);
            let count = rays.len() as u64;
            work(rays, part)?;
            job.advance(count);
            Ok(())
        })
    }
}
