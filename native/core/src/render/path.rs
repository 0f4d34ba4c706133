//! The integrator: direct light, shadows and mirrors, a tile's sample at a time, as a wavefront.
//!
//! Every step works on all rays of its kind in the tile: primary rays are traced together, then shaded together; every
//! light's shadow rays together; the mirrored rays of all mirrors, gathered without gaps, are the next wave. The order
//! of sums in a pixel depends on the scene alone, so pictures are identical for any number of threads.
//!
//! A path tracer would take the place of this file: all that others call is [`Wavefront::sample`].

use std::{
    f32::consts::FRAC_1_PI,
    time::{Duration, Instant},
};

use glam::Vec3;

use super::{
    Settings,
    camera::{Camera, Window},
    choice::Choice,
    film::Tile,
    light::Incident,
    material::metal_reflectance,
    queue::RayQueue,
    sampler::{Purpose, Sampler, cosine_direction},
    scene::Scene,
    surface::{Facing, Surface},
};
use crate::{
    Error, Job,
    ray::{Hits, MISS, Ray},
    traverse::Tracer,
};

/// What all tiles of a picture share.
#[derive(Debug)]
pub struct Context<'a> {
    /// Finds hits.
    pub tracer: Tracer<'a>,
    /// What is hit.
    pub scene: &'a Scene,
    /// Whence it is seen.
    pub camera: &'a Camera,
    /// How well.
    pub settings: &'a Settings,
    /// The lights.
    pub choice: Choice<'a>,
    /// Of the samplers.
    pub key: u32,
    /// Whether to go on.
    pub job: &'a Job,
}

/// What was traced.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Counters {
    /// Rays from the camera.
    pub primary_rays: u64,
    /// Rays to lights and to the world.
    pub shadow_rays: u64,
    /// Rays from mirrors.
    pub bounce_rays: u64,
    /// Time in the accelerator.
    pub tracing: Duration,
}

impl Counters {
    /// Both together.
    pub fn add(&mut self, other: &Self) {
        self.primary_rays += other.primary_rays;
        self.shadow_rays += other.shadow_rays;
        self.bounce_rays += other.bounce_rays;
        self.tracing += other.tracing;
    }
}

/// A path from the camera: its pixel in the tile, and how much of what it meets arrives there.
#[derive(Debug, Clone, Copy)]
struct Path {
    pixel: u32,
    throughput: Vec3,
}

/// A diffuse surface that a path has come to.
#[derive(Debug, Clone, Copy)]
struct Lit {
    surface: Facing,
    path: Path,
}

/// A thread's buffers, kept from tile to tile.
#[derive(Debug, Default)]
pub struct Wavefront {
    paths: RayQueue<Path>,
    mirrored: RayQueue<Path>,
    shadows: RayQueue<Path>,
    hits: Hits,
    blocked: Vec<bool>,
    lit: Vec<Lit>,
    counters: Counters,
}

/// The primary rays of a tile, in the order of its pixels. The only sample of a pixel is at its centre; more are spread
/// over it.
pub fn primary_rays(context: &Context<'_>, window: Window, sample: u32) -> impl Iterator<Item = Ray> {
    let (camera, key, centred) = (context.camera, context.key, context.settings.samples == 1);
    (0..window.count()).map(move |index| {
        let pixel = window.pixel(index);
        let place = if centred { [0.5; 2] } else { Sampler::new(key, pixel, sample).pair(0, Purpose::Pixel, 0) };
        camera.ray(f64::from(pixel[0]) + f64::from(place[0]), f64::from(pixel[1]) + f64::from(place[1]))
    })
}

impl Wavefront {
    /// Add one sample of every pixel to a tile.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn sample(&mut self, context: &Context<'_>, tile: &mut Tile, sample: u32) -> Result<(), Error> {
        self.paths.clear();
        for (index, ray) in primary_rays(context, tile.window, sample).enumerate() {
            self.paths.push(&ray, Path { pixel: index as u32, throughput: Vec3::ONE });
        }
        self.counters.primary_rays += self.paths.len() as u64;
        for bounce in 0..=context.settings.max_bounces {
            self.find_hits(context)?;
            self.shade(context, tile, sample, bounce);
            self.light(context, tile, sample, bounce)?;
            std::mem::swap(&mut self.paths, &mut self.mirrored);
            if self.paths.is_empty() {
                break;
            }
            self.counters.bounce_rays += self.paths.len() as u64;
        }
        Ok(())
    }

    /// What was traced since the last call.
    pub fn take_counters(&mut self) -> Counters {
        std::mem::take(&mut self.counters)
    }

    fn find_hits(&mut self, context: &Context<'_>) -> Result<(), Error> {
        context.job.check()?;
        self.hits.resize(self.paths.len());
        let start = Instant::now();
        context.tracer.closest(&self.paths.rays()?, &mut self.hits.as_mut())?;
        self.counters.tracing += start.elapsed();
        Ok(())
    }

    /// Add what is seen directly; gather diffuse surfaces to be lit and mirrored rays to be followed.
    fn shade(&mut self, context: &Context<'_>, tile: &mut Tile, sample: u32, bounce: u32) {
        self.lit.clear();
        self.mirrored.clear();
        for index in 0..self.paths.len() {
            let (path, direction) = (self.paths.tags()[index], self.paths.direction(index));
            let hit = self.hits.get(index);
            if hit.primitive == MISS {
                see_world(context, tile, path, bounce);
                continue;
            }
            let surface = Surface::new(context.scene, hit, direction);
            if bounce == 0 {
                let depth = context.camera.depth(direction, hit.t);
                record(tile, index, depth, surface.facing.shading, sample);
            }
            tile.color[path.pixel as usize] += path.throughput * surface.material.emission;
            if !surface.material.is_mirror() {
                self.lit.push(Lit { surface: surface.facing, path: path.through(surface.color) });
            } else if bounce < context.settings.max_bounces {
                let cosine = -direction.dot(surface.facing.shading);
                let ray = leave(&surface.facing, surface.facing.mirrored(direction), f32::INFINITY);
                self.mirrored.push(&ray, path.through(metal_reflectance(surface.color, cosine)));
            }
        }
    }

    /// Add the light of the world and of every light to the gathered surfaces.
    fn light(&mut self, context: &Context<'_>, tile: &mut Tile, sample: u32, bounce: u32) -> Result<(), Error> {
        if self.lit.is_empty() {
            return Ok(());
        }
        if context.scene.world() != Vec3::ZERO {
            self.light_by_world(context, tile, sample, bounce)?;
        }
        for number in 0..context.choice.count() {
            self.light_by_lamp(context, tile, sample, bounce, number)?;
        }
        Ok(())
    }

    /// One direction a surface, as likely as the light from it counts.
    fn light_by_world(
        &mut self,
        context: &Context<'_>,
        tile: &mut Tile,
        sample: u32,
        bounce: u32,
    ) -> Result<(), Error> {
        self.shadows.clear();
        let world = context.scene.world();
        for Lit { surface, path } in &self.lit {
            let random = context.sampler(tile, path.pixel, sample).pair(bounce, Purpose::World, 0);
            let (direction, _) = cosine_direction(surface.shading, random);
            if direction.dot(surface.geometric) > 0.0 {
                self.shadows.push(&leave(surface, direction, f32::INFINITY), path.through(world));
            }
        }
        self.add_unshadowed(context, tile)
    }

    /// One point of a light a surface.
    fn light_by_lamp(
        &mut self,
        context: &Context<'_>,
        tile: &mut Tile,
        sample: u32,
        bounce: u32,
        number: usize,
    ) -> Result<(), Error> {
        self.shadows.clear();
        for Lit { surface, path } in &self.lit {
            let sampler = context.sampler(tile, path.pixel, sample);
            let (emitter, weight) = context.choice.pick(number, || sampler.pair(bounce, Purpose::Choice, 0)[0]);
            let random = || sampler.pair(bounce, Purpose::Light, number as u32);
            let incident = emitter.sample(surface.origin, surface.shading, random);
            let Some((incident, light)) = incident.and_then(|incident| reflected(surface, incident)) else { continue };
            let path = path.through(light * weight);
            if emitter.shadow {
                self.shadows.push(&leave(surface, incident.direction, incident.distance * NEARLY), path);
            } else {
                tile.color[path.pixel as usize] += path.throughput;
            }
        }
        self.add_unshadowed(context, tile)
    }

    /// Trace the gathered shadow rays; what nothing blocks arrives.
    fn add_unshadowed(&mut self, context: &Context<'_>, tile: &mut Tile) -> Result<(), Error> {
        context.job.check()?;
        self.blocked.resize(self.shadows.len(), false);
        let start = Instant::now();
        context.tracer.occluded(&self.shadows.rays()?, &mut self.blocked)?;
        self.counters.tracing += start.elapsed();
        self.counters.shadow_rays += self.shadows.len() as u64;
        for (path, _) in self.shadows.tags().iter().zip(&self.blocked).filter(|(_, blocked)| !**blocked) {
            tile.color[path.pixel as usize] += path.throughput;
        }
        Ok(())
    }
}

/// Shadow rays end this share of the way to a light, so that what touches a light does not shadow it.
const NEARLY: f32 = 1.0 - 1e-5;

impl Context<'_> {
    #[inline]
    fn sampler(&self, tile: &Tile, pixel: u32, sample: u32) -> Sampler {
        Sampler::new(self.key, tile.window.pixel(pixel as usize), sample)
    }
}

impl Path {
    #[inline]
    fn through(self, share: Vec3) -> Self {
        Self { throughput: self.throughput * share, ..self }
    }
}

/// A path that leaves the scene sees the world; where the film is transparent, not directly.
fn see_world(context: &Context<'_>, tile: &mut Tile, path: Path, bounce: u32) {
    if bounce > 0 || !context.settings.transparent {
        tile.color[path.pixel as usize] += path.throughput * context.scene.world();
    }
    if bounce == 0 && !context.settings.transparent {
        tile.alpha[path.pixel as usize] += 1.0;
    }
}

/// Alpha and normal of every sample, depth of the first.
fn record(tile: &mut Tile, pixel: usize, depth: f32, normal: Vec3, sample: u32) {
    tile.alpha[pixel] += 1.0;
    tile.normal[pixel] += normal;
    if sample == 0 {
        tile.depth[pixel] = depth;
    }
}

#[inline]
fn leave(surface: &Facing, direction: Vec3, tmax: f32) -> Ray {
    Ray { origin: surface.origin, direction, tmin: 0.0, tmax }
}

/// The radiance that a white diffuse surface reflects of incident light; `None` where the light comes from behind.
#[inline]
fn reflected(surface: &Facing, incident: Incident) -> Option<(Incident, Vec3)> {
    let cosine = incident.direction.dot(surface.shading);
    let light = incident.radiance * (cosine * FRAC_1_PI);
    let before = cosine > 0.0 && incident.direction.dot(surface.geometric) > 0.0;
    (before && light.is_finite() && incident.distance > 0.0).then_some((incident, light))
}
