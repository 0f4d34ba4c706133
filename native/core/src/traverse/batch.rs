//! Batches: where rays are gathered, checked and handed to the kernel that fits.

use std::marker::PhantomData;

use super::{
    frame::Frame,
    kernel::{self, Entry},
    probe::{Counts, Probe, Silent},
};
use crate::{
    Error, Job, Mesh,
    accel::structure::Structure,
    job::Phase,
    pool,
    ray::{Hit, HitsMut, MISS, Rays},
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
        let take = |index, frame: &Frame, hit: Hit, _: Silent| hits.set(index, in_ray_units(frame, hit));
        self.level.run(Batch { tracer: self, rays, any: false, take, probe: PhantomData })
    }

    /// Whether anything lies in the interval of every ray, on the calling thread.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub fn occluded(self, rays: &Rays<'_>, occluded: &mut [bool]) -> Result<(), Error> {
        assert_eq!(rays.len(), occluded.len());
        let take = |index: usize, _: &Frame, hit: Hit, _: Silent| occluded[index] = hit.primitive != MISS;
        self.level.run(Batch { tracer: self, rays, any: true, take, probe: PhantomData })
    }

    /// What the closest-hit query of every ray costs, on the calling thread.
    ///
    /// # Errors
    /// [`Error::Ray`] for the first unusable ray.
    pub fn counted(self, rays: &Rays<'_>, counts: &mut [Counts]) -> Result<(), Error> {
        assert_eq!(rays.len(), counts.len());
        let take = |index: usize, _: &Frame, _: Hit, seen: Counts| counts[index] = seen;
        self.level.run(Batch { tracer: self, rays, any: false, take, probe: PhantomData })
    }
}

#[inline(always)]
fn in_ray_units(frame: &Frame, hit: Hit) -> Hit {
    if hit.primitive == MISS { Hit::MISS } else { Hit { t: frame.parameter(hit.t), ..hit } }
}

/// Rays, and what to do with the index, frame, hit (in the frame's units) and probe of each.
struct Batch<'a, F, P> {
    tracer: Tracer<'a>,
    rays: &'a Rays<'a>,
    any: bool,
    take: F,
    probe: PhantomData<P>,
}

impl<F: FnMut(usize, &Frame, Hit, P), P: Probe + Default> Kernel for Batch<'_, F, P> {
    type Output = Result<(), Error>;

    /// The table that picks the loop's instance, once a batch.
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        match (self.tracer.structure.grids.is_empty(), self.any) {
            (true, false) => self.each::<S, false, false>(simd),
            (true, true) => self.each::<S, false, true>(simd),
            (false, false) => self.each::<S, true, false>(simd),
            (false, true) => self.each::<S, true, true>(simd),
        }
    }
}

impl<F: FnMut(usize, &Frame, Hit, P), P: Probe + Default> Batch<'_, F, P> {
    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool, const ANY: bool>(mut self, simd: S) -> Result<(), Error> {
        let Tracer { structure, mesh, .. } = self.tracer;
        let mut stack = vec![Entry::NONE; structure.stack_size];
        for index in 0..self.rays.len() {
            let frame = self.rays.frame(index, &structure.domain)?;
            let mut probe = P::default();
            let hit = kernel::trace::<S, P, GRIDS, ANY>(simd, structure, mesh, &frame, &mut stack, &mut probe);
            (self.take)(index, &frame, hit, probe);
        }
        Ok(())
    }
}

/// Rays between two looks at the job: a few milliseconds of work even on slow structures.
const PART: usize = 2048;

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
