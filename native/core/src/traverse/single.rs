//! Rays that walk alone.

use bytemuck::Zeroable;

use super::{
    Tracer,
    frame::Frame,
    kernel::{self, Entry},
    probe::Silent,
};
use crate::{
    Error, Mesh,
    accel::structure::{Structure, View},
    ray::{Hit, Ray},
    simd::{Kernel, Simd},
};

/// Traces one ray at a call, as cheaply as that can be: for rays that depend on each other's hits.
#[derive(Debug)]
pub struct Walker<'a> {
    tracer: Tracer<'a>,
    scene: Scene<'a>,
    stack: Vec<Entry>,
}

impl<'a> Tracer<'a> {
    /// For one ray at a call.
    pub fn walker(self) -> Walker<'a> {
        Walker { tracer: self, scene: Scene::new(self), stack: vec![Entry::NONE; self.structure.stack_size] }
    }
}

impl Walker<'_> {
    /// The closest hit of a ray.
    ///
    /// # Errors
    /// [`Error::Ray`] where the ray is unusable.
    #[inline]
    pub fn first(&mut self, ray: &Ray) -> Result<Hit, Error> {
        let hit = self.tracer.level.run(One::<false> { scene: &self.scene, ray, stack: &mut self.stack });
        if hit.t.is_nan() { Err(ray.fault(0)) } else { Ok(hit) }
    }
}

/// What a tracer's rays need again and again, looked up once.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    structure: &'a Structure,
    mesh: &'a Mesh,
    view: View<'a>,
    has_grids: bool,
}

impl<'a> Scene<'a> {
    /// Of a tracer.
    pub fn new(tracer: Tracer<'a>) -> Self {
        let Tracer { structure, mesh, .. } = tracer;
        Self { structure, mesh, view: structure.view(), has_grids: structure.has_grids() }
    }
}

/// A ray that walks alone; its hit, whose parameter is not a number where the ray is unusable: a hit goes through
/// registers, an optional one through memory (a tenth of the time of a ray that misses).
pub(super) struct One<'a, const ANY: bool> {
    pub scene: &'a Scene<'a>,
    pub ray: &'a Ray,
    pub stack: &'a mut [Entry],
}

impl<const ANY: bool> Kernel for One<'_, ANY> {
    type Output = Hit;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        match self.scene.has_grids {
            false => self.each::<S, false>(simd),
            true => self.each::<S, true>(simd),
        }
    }
}

impl<const ANY: bool> One<'_, ANY> {
    #[inline(always)]
    fn each<S: Simd, const GRIDS: bool>(self, simd: S) -> Hit {
        let &Scene { structure, mesh, view, .. } = self.scene;
        // Zeros that nobody reads: without them single rays took 1/1.03 of the time (a Xeon), but a frame that is kept from
        // one ray to the next took 1.01 times as long, and one that is returned 1.5 times.
        let mut frame = Frame::zeroed();
        if !frame.set(self.ray, &structure.domain) {
            return Hit { t: f32::NAN, ..Hit::MISS };
        }
        let scene = (structure, view);
        let hit = kernel::trace::<S, Silent, GRIDS, ANY>(simd, scene, mesh, &frame, self.stack, &mut Silent);
        frame.in_ray_units(hit)
    }
}
