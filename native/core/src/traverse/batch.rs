//! Batches: where rays are gathered, checked and handed to the kernel that fits.

use std::{cell::RefCell, marker::PhantomData};

use super::{
    frame::Frame,
    kernel::{self, Entry},
    pace::Pace,
    packet::{self, Packets},
    probe::{Counts, Probe},
    single::{One, Scene},
    stream::{Bin, Lists},
    take::Take,
    tile::{EXTENTS, Tile, Visit},
    together::Together,
    waiting::{self, Waiting},
};
use crate::{
    Error, Job, Mesh,
    accel::structure::Structure,
    job::Phase,
    pool::thread_count,
    ray::{Hit, HitsMut, Rays},
    simd::{Kernel, Level, Simd},
    work,
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
        self.silent::<_, false>(rays, hits, &Pace::closest(rays.len()))
    }

    /// Whether anything lies in the interval of every ray, on the calling thread.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub fn occluded(self, rays: &Rays<'_>, occluded: &mut [bool]) -> Result<(), Error> {
        assert_eq!(rays.len(), occluded.len());
        self.silent::<_, true>(rays, occluded, &Pace::streams())
    }

    /// [`Tracer::occluded`] by packets of sixteen rays as they come: for rays that begin side by side.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub fn occluded_in_packets(self, rays: &Rays<'_>, occluded: &mut [bool]) -> Result<(), Error> {
        assert_eq!(rays.len(), occluded.len());
        if !EXTENTS.contains(&self.structure.domain.half_extent) {
            return self.occluded(rays, occluded);
        }
        self.with_room(|Room { packet: memory, stack, .. }| match self.structure.has_grids() {
            false => self.level.run(Packets::<_, false> { tracer: self, rays, memory, stack, to: occluded, place: 0 }),
            true => self.level.run(Packets::<_, true> { tracer: self, rays, memory, stack, to: occluded, place: 0 }),
        })
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

    fn silent<T: Take + ?Sized, const ANY: bool>(self, rays: &Rays<'_>, to: &mut T, pace: &Pace) -> Result<(), Error> {
        self.with_room(|room| {
            if rays.len() >= LEAST_STREAM {
                return self.level.run(Together::<_, ANY>::new(self, rays, to, room, pace));
            }
            let scene = Scene::new(self);
            for index in 0..rays.len() {
                let (ray, stack) = (rays.get(index), &mut *room.stack);
                let hit = self.level.run(One::<ANY> { scene: &scene, ray: &ray, stack });
                if hit.t.is_nan() {
                    return Err(rays.fault(index));
                }
                to.take(index, hit);
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
pub struct Room {
    pub stack: Vec<Entry>,
    pub waiting: Waiting,
    pub bin: Bin,
    pub lists: Lists,
    pub tile: Box<Tile>,
    pub visits: Vec<Visit>,
    pub packet: packet::Memory,
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

impl<F: FnMut(usize, &Frame, Hit, P), P: Probe + Default> Kernel for Singles<'_, F, P> {
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        match self.tracer.structure.has_grids() {
            false => self.each::<S, false>(simd),
            true => self.each::<S, true>(simd),
        }
    }
}

impl<F: FnMut(usize, &Frame, Hit, P), P: Probe + Default> Singles<'_, F, P> {
    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool>(mut self, simd: S) -> Result<(), Error> {
        let Tracer { structure, mesh, .. } = self.tracer;
        let scene = (structure, structure.view());
        for index in 0..self.rays.len() {
            let frame = self.rays.frame(index, &structure.domain)?;
            let mut probe = P::default();
            let stack = &mut self.room.stack;
            let hit = kernel::trace::<S, P, GRIDS, false>(simd, scene, mesh, &frame, stack, &mut probe);
            (self.take)(index, &frame, hit, probe);
        }
        Ok(())
    }
}

/// The least rays between two looks at the job.
const PART: usize = 1 << 13;

impl Tracer<'_> {
    /// [`Tracer::closest`] on several threads; 0 means all.
    ///
    /// # Errors
    /// As there, and [`Error::Cancelled`].
    pub fn closest_parallel(self, rays: &Rays<'_>, hits: HitsMut<'_>, threads: usize, job: &Job) -> Result<(), Error> {
        let (pace, part) = (Pace::closest(rays.len()), self.part(rays, threads));
        let work = |rays: Rays<'_>, mut hits: HitsMut<'_>| self.silent::<_, false>(&rays, &mut hits, &pace);
        parallel(rays, (part, hits.parts(part)), threads, job, work)
    }

    /// [`Tracer::occluded`] on several threads; 0 means all.
    ///
    /// # Errors
    /// As there, and [`Error::Cancelled`].
    pub fn occluded_parallel(self, rays: &Rays<'_>, out: &mut [bool], threads: usize, job: &Job) -> Result<(), Error> {
        let (pace, part) = (Pace::occluded(rays.len()), self.part(rays, threads));
        let work = |rays: Rays<'_>, out: &mut [bool]| self.silent::<_, true>(&rays, out, &pace);
        parallel(rays, (part, out.chunks_mut(part)), threads, job, work)
    }

    /// [`Tracer::counted`] on several threads; 0 means all.
    ///
    /// # Errors
    /// As there, and [`Error::Cancelled`].
    pub fn counted_parallel(self, rays: &Rays<'_>, out: &mut [Counts], threads: usize, job: &Job) -> Result<(), Error> {
        parallel(rays, (PART, out.chunks_mut(PART)), threads, job, |rays, out| self.counted(&rays, out))
    }

    /// Rays between two looks at the job: as many as can wait for each other, but some parts for every thread, and a few
    /// milliseconds of work where rays walk through grids alone.
    fn part(self, rays: &Rays<'_>, threads: usize) -> usize {
        let alone = self.structure.has_grids() && self.structure.lazy.is_empty();
        let most = if alone { PART } else { waiting::most() };
        if rays.len() <= PART { PART } else { rays.len().div_ceil(4 * thread_count(threads)).clamp(PART, most) }
    }
}

fn parallel<O: Send>(
    rays: &Rays<'_>,
    (size, parts): (usize, impl ExactSizeIterator<Item = O> + Send),
    threads: usize,
    job: &Job,
    work: impl Fn(Rays<'_>, O) -> Result<(), Error> + Sync,
) -> Result<(), Error> {
    job.begin(Phase::Trace, rays.len() as u64);
    work::for_each(threads, parts.enumerate(), job, |(number, part)| {
        let rays = rays.part(number * size, size);
        let count = rays.len() as u64;
        work(rays, part)?;
        job.advance(count);
        Ok(())
    })
}
