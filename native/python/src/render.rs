//! `render` and `Render`.

use espalier_core::render::{self as core, Settings};
use numpy::{Ix2, Ix3, PyArray};
use pyo3::prelude::*;

use crate::{
    accelerator::Accelerator,
    arrays,
    camera::Camera,
    config,
    errors::{Kind, OrRaise, guard},
    job::Job,
    scene::Scene,
};

/// A finished picture: scene-linear, rows bottom-up, as Blender has them.
#[pyclass(frozen, module = "espalier_rt")]
pub struct Render {
    /// (h, w, 4) float32: RGBA, premultiplied.
    #[pyo3(get)]
    combined: Py<PyArray<f32, Ix3>>,
    /// (h, w) float32: distance along the view axis at the pixel's first sample; 1e10 where nothing was hit.
    #[pyo3(get)]
    depth: Py<PyArray<f32, Ix2>>,
    /// (h, w, 3) float32: mean shading normal in the world; zero where nothing was hit.
    #[pyo3(get)]
    normal: Py<PyArray<f32, Ix3>>,
    /// (h, w) float32: traversal steps of the pixel's primary rays, mean per sample; None where not asked for.
    #[pyo3(get)]
    cost: Option<Py<PyArray<f32, Ix2>>>,
    /// Rays from the camera.
    #[pyo3(get)]
    primary_rays: u64,
    /// Rays to lights and to the world.
    #[pyo3(get)]
    shadow_rays: u64,
    /// Rays from mirrors.
    #[pyo3(get)]
    bounce_rays: u64,
    /// Wall seconds in the accelerator: summed over threads, divided by their number.
    #[pyo3(get)]
    trace_s: f64,
    /// Wall seconds of everything but the cost pass.
    #[pyo3(get)]
    total_s: f64,
}

#[pymethods]
impl Render {
    /// All rays traced: primary, shadow and bounce.
    #[getter]
    fn rays(&self) -> u64 {
        self.primary_rays + self.shadow_rays + self.bounce_rays
    }

    fn __repr__(&self) -> String {
        format!("Render(rays={}, trace_s={:.4}, total_s={:.4})", self.rays(), self.trace_s, self.total_s)
    }
}

impl Render {
    fn new(py: Python<'_>, camera: &core::Camera, made: core::Render) -> PyResult<Self> {
        let [width, height] = camera.size();
        let core::Render { film, cost, counters, trace_s, total_s } = made;
        Ok(Self {
            combined: arrays::shaped(py, film.combined, (height, width, 4))?,
            depth: arrays::shaped(py, film.depth, (height, width))?,
            normal: arrays::shaped(py, film.normal, (height, width, 3))?,
            cost: cost.map(|cost| arrays::shaped(py, cost, (height, width))).transpose()?,
            primary_rays: counters.primary_rays,
            shadow_rays: counters.shadow_rays,
            bounce_rays: counters.bounce_rays,
            trace_s,
            total_s,
        })
    }
}

/// Make a picture; other Python threads run meanwhile.
///
/// accelerator, scene: of the same Mesh.
/// samples: per pixel, 1 or more; a single one goes through the pixel's centre.
/// seed: of all random numbers; the picture depends on it, not on the number of threads.
/// max_bounces: most reflections that are followed.
/// threads: 0 for all the machine has.
/// cost: whether the traversal steps of primary rays are counted, in a pass of its own that no time includes.
/// transparent: whether the world is left out of the picture, as Blender's film_transparent; otherwise alpha is 1.
/// job: to watch and cancel from another thread.
///
/// Raises SceneError for different meshes or a number out of range, ConfigError for a bad number of threads, Cancelled,
/// and OutOfMemory.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "they are keywords in Python")]
#[pyo3(signature = (accelerator, scene, camera, *, samples=1, seed=0, max_bounces=4, threads=0, cost=false,
    transparent=false, job=None))]
pub fn render(
    accelerator: &Bound<'_, Accelerator>,
    scene: &Bound<'_, Scene>,
    camera: &Bound<'_, Camera>,
    samples: i64,
    seed: i64,
    max_bounces: i64,
    threads: i64,
    cost: bool,
    transparent: bool,
    job: Option<&Bound<'_, Job>>,
) -> PyResult<Render> {
    let py = accelerator.py();
    guard(py, || {
        let settings = Settings {
            samples: number(py, "samples", samples)?,
            seed: seed.cast_unsigned(),
            max_bounces: number(py, "max_bounces", max_bounces)?,
            threads: config::threads(py, threads)?,
            transparent,
            cost,
        };
        let (accelerator, scene, camera) = (accelerator.get().core(), scene.get().core(), camera.get().core());
        let job = Job::shared(job);
        let made = py.detach(|| core::render(accelerator, scene, camera, &settings, &job)).or_raise(py)?;
        Render::new(py, camera, made)
    })
}

/// A count; the core checks its range.
fn number(py: Python<'_>, name: &str, value: i64) -> PyResult<u32> {
    value
        .try_into()
        .map_err(|_| Kind::Scene.error(py, format!("{name} is {value}; it must be a count that fits 32 bits")))
}
