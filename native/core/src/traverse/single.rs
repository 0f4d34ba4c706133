//! Rays that walk alone.

use super::{
    Tracer,
    frame::Frame,
    kernel::{self, Entry},
    probe::Silent,
};
use crate::{
    Error,
    ray::{Hit, Ray},
    simd::{Kernel, Simd},
};

/// Traces one ray at a call, as cheaply as that can be: for rays that depend on each other's hits.
#[derive(Debug)]
pub struct Walker<'a> {
    tracer: Tracer<'a>,
    stack: Vec<Entry>,
}

impl<'a> Tracer<'a> {
    /// For one ray at a call.
    pub fn walker(self) -> Walker<'a> {
        Walker { tracer: self, stack: vec![Entry::NONE; self.structure.stack_size] }
    }
}

impl Walker<'_> {
    /// The closest hit of a ray.
    ///
    /// # Errors
    /// [`Error::Ray`] where the ray is unusable.
    #[inline]
    pub fn first(&mut self, ray: &Ray) -> Result<Hit, Error> {
        let one = One::<false> { tracer: self.tracer, ray, stack: &mut self.stack };
        self.tracer.level.run(one).ok_or_else(|| ray.fault(0))
    }
}

/// A ray that walks alone; its hit, or nothing where it is unusable.
pub(super) struct One<'a, const ANY: bool> {
    pub tracer: Tracer<'a>,
    pub ray: &'a Ray,
    pub stack: &'a mut [Entry],
}

impl<const ANY: bool> Kernel for One<'_, ANY> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        match self.tracer.structure.has_grids() {
            false => self.each::<S, false>(simd),
            true => self.each::<S, true>(simd),
        }
    }
}

impl<const ANY: bool> One<'_, ANY> {
    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool>(self, simd: S) -> Option<Hit> {
        let Tracer { structure, mesh, .. } = self.tracer;
        let frame = Frame::new(self.ray, &structure.domain)?;
        let hit = kernel::trace::<S, Silent, GRIDS, ANY>(simd, structure, mesh, &frame, self.stack, &mut Silent);
        Some(frame.in_ray_units(hit))
    }
}
