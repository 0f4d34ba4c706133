//! Batches: where rays are gathered, checked and handed to the kernel that fits.

use std::{cell::RefCell, marker::PhantomData};

use super::{
    frame::Frame,
    kernel::{self, Entry},
    pace::Pace,
    probe::{Counts, Probe, Silent},
    stream::{Bin, Lists},
    tile::{Tile, Visit},
    together::{Take, Together, in_ray_units},
};
use crate::{
    Error, Job, Mesh,
    accel::structure::Structure,
    job::Phase,
    pool,
    ray::{Hit, HitsMut, Ray, Rays},
    simd::{Kernel, Level, Simd},
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
        self.silent::<_, false>(rays, hits, &Pace::default())
    }

    /// Whether anything lies in the interval of every ray, on the calling thread.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub fn occluded(self, rays: &Rays<'_>, occluded: &mut [bool]) -> Result<(), Error> {
        assert_eq!(rays.len(), occluded.len());
        self.silent::<_, true>(rays, occluded, &Pace::default())
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

    fn silent<T: Take + ?Sized, const ANY: bool>(self, rays: &Rays<'_>, to: &mut T, pace: &Pace) -> Result<(), Error> {
        self.with_room(|room| {
            if rays.len() >= LEAST_STREAM {
                return self.level.run(Together::<_, ANY>::new(self, rays, to, room, pace));
            }
            for index in 0..rays.len() {
                let frame = rays.frame(index, &self.structure.domain)?;
                to.take(index, &frame, self.level.run(One::<ANY> { tracer: self, frame: &frame, room }));
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
    pub bins: [Bin; 8],
    pub lists: Lists,
    pub tile: Box<Tile>,
    pub visits: Vec<Visit>,
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

/// Rays between two looks at the job: a few milliseconds of work even on slow structures.
const PART: usize = 1 << 13;

impl Tracer<'_> {
    /// [`Tracer::closest`] on several threads; 0 means all.
    ///
    /// # Errors
    /// As there, and [`Error::Cancelled`].
    pub fn closest_parallel(self, rays: &Rays<'_>, hits: HitsMut<'_>, threads: usize, job: &Job) -> Result<(), Error> {
        let pace = Pace::default();
        let work = |rays: Rays<'_>, mut hits: HitsMut<'_>| self.silent::<_, false>(&rays, &mut hits, &pace);
        self.parallel(rays, hits.parts(PART), threads, job, work)
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
