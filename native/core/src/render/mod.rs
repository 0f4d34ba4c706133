//! Pictures: camera → primary rays → surfaces → shadow rays and mirrored rays → film.

pub mod camera;
pub mod choice;
mod cost;
pub mod film;
pub mod light;
pub mod material;
mod path;
mod queue;
pub mod sampler;
pub mod scene;
mod surface;
pub mod texture;

use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::Instant,
};

pub use self::{
    camera::{Camera, CameraSettings, Projection, SensorFit, Window},
    film::Film,
    light::{Bulb, Light, LightKind},
    material::Material,
    path::Counters,
    scene::{Scene, SceneSettings},
    texture::{Extension, Interpolation, Texture},
};
use self::{
    choice::Choice,
    film::{TILE, Tile},
    path::{Context, Wavefront},
};
use crate::{Accelerator, Error, Job, job::Phase, pool, work};

/// How a picture is to be made.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Samples per pixel, at least 1. A single one goes through the pixel's centre; more are spread over the pixel and
    /// weighed alike (a box filter of one pixel).
    pub samples: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Most reflections that are followed.
    pub max_bounces: u32,
    /// How many threads; 0 for all. The picture is the same for any number.
    pub threads: usize,
    /// Whether the world is left out of the picture, as Blender's `film_transparent`.
    pub transparent: bool,
    /// Whether the cost of primary rays is counted, in a pass of its own after all others.
    pub cost: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { samples: 1, seed: 0, max_bounces: 4, threads: 0, transparent: false, cost: false }
    }
}

/// Most samples per pixel and most bounces.
pub const MOST_SAMPLES: u32 = 1 << 20;

/// Most reflections that can be asked for.
pub const MOST_BOUNCES: u32 = 1024;

/// A finished picture.
#[derive(Debug, Clone)]
pub struct Render {
    /// The picture and its passes.
    pub film: Film,
    /// Traversal steps of a pixel's primary rays, mean per sample; `None` where they were not asked for.
    pub cost: Option<Vec<f32>>,
    /// Rays traced, and the time in the accelerator summed over threads.
    pub counters: Counters,
    /// Wall-clock seconds in the accelerator: summed over threads, divided by their number.
    pub trace_s: f64,
    /// Wall-clock seconds of everything but the cost pass.
    pub total_s: f64,
}

/// Make a picture.
///
/// # Errors
/// [`Error::Scene`] where accelerator and scene stand for different meshes or a setting is out of its range;
/// [`Error::Cancelled`]; [`Error::OutOfMemory`].
pub fn render(
    accelerator: &Accelerator,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    job: &Job,
) -> Result<Render, Error> {
    check(accelerator, scene, settings)?;
    let passes = 1 + u64::from(settings.cost);
    job.begin(Phase::Trace, camera.window().count() as u64 * u64::from(settings.samples) * passes);
    let (tracer, choice, key) = (accelerator.tracer(), Choice::new(scene), sampler::key(settings.seed));
    let context = Context { tracer, scene, camera, settings, choice, key, job };
    let start = Instant::now();
    let (film, counters) = picture(&context)?;
    let total_s = start.elapsed().as_secs_f64();
    let cost = if settings.cost { Some(cost::steps(&context)?) } else { None };
    let threads = pool::thread_count(settings.threads).min(camera.window().tiles(TILE).len());
    Ok(Render { film, cost, counters, trace_s: counters.tracing.as_secs_f64() / threads as f64, total_s })
}

/// What threads share while they make a picture. Buffers are handed from tile to tile, one set a thread.
struct Shared {
    film: Film,
    counters: Counters,
    spare: Vec<(Wavefront, Tile)>,
}

fn picture(context: &Context<'_>) -> Result<(Film, Counters), Error> {
    let window = context.camera.window();
    let film = Film::new(context.camera.size())?;
    let shared = Mutex::new(Shared { film, counters: Counters::default(), spare: Vec::new() });
    work::for_each(context.settings.threads, window.tiles(TILE).into_iter(), context.job, |pixels| {
        let (mut wavefront, mut tile) = lock(&shared).spare.pop().unwrap_or_default();
        tile.reset(pixels);
        for sample in 0..context.settings.samples {
            wavefront.sample(context, &mut tile, sample)?;
            context.job.advance(pixels.count() as u64);
        }
        let mut shared = lock(&shared);
        shared.film.store(&tile, window, context.settings.samples);
        shared.counters.add(&wavefront.take_counters());
        shared.spare.push((wavefront, tile));
        Ok(())
    })?;
    let shared = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok((shared.film, shared.counters))
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

fn check(accelerator: &Accelerator, scene: &Scene, settings: &Settings) -> Result<(), Error> {
    if !std::sync::Arc::ptr_eq(accelerator.mesh(), scene.mesh()) {
        return Err(Error::Scene("accelerator and scene were made of different meshes: make both of the same".into()));
    }
    let (samples, bounces) = (settings.samples, settings.max_bounces);
    if !(1..=MOST_SAMPLES).contains(&samples) {
        return Err(Error::Scene(format!("{samples} samples per pixel; there can be 1 to {MOST_SAMPLES}")));
    }
    if bounces > MOST_BOUNCES {
        return Err(Error::Scene(format!("{bounces} bounces; there can be at most {MOST_BOUNCES}")));
    }
    Ok(())
}
