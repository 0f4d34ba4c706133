//! How long the parts of a picture take: what a class of kind `image` times, taken apart.

use espalier_core::Method;
use serde_json::{Map, Value, json};

use crate::{
    arena::trace_ours,
    error::Error,
    plan::Class,
    race::timed,
    rivals::Answer,
    scene::{Built, Scene, new_mesh},
};

/// Least milliseconds of `repeats` times: of the mesh, of every phase of the build, of all of it, and of the rays.
///
/// # Errors
/// Those of our side.
pub fn row(scene: &Scene<'_>, class: &Class, method: Method, repeats: usize) -> Result<Value, Error> {
    let threads = scene.plan.threads;
    let rays = scene.rays(class.rays, &Built::new(scene))?;
    let mut answer = Answer::new(rays.len());
    let mut row = Map::new();
    let mut keep = |name: &str, milliseconds: f64| {
        let least = row.get(name).and_then(Value::as_f64).unwrap_or(f64::INFINITY);
        row.insert(name.into(), json!(least.min(milliseconds)));
    };
    for _ in 0..repeats {
        let (mesh_time, mesh) = timed(threads, || new_mesh(&scene.arrays));
        let mesh = mesh?;
        let (build_time, accelerator) = timed(threads, || scene.build(mesh, method));
        let accelerator = accelerator?;
        let (trace_time, traced) = timed(threads, || trace_ours(&accelerator, &rays, class, threads, &mut answer));
        traced?;
        accelerator.phases().iter().for_each(|phase| keep(phase.name, phase.milliseconds));
        let parts = [("mesh", mesh_time), ("build", build_time), ("trace", trace_time)];
        parts.into_iter().for_each(|(name, time)| keep(name, time.as_secs_f64() * 1e3));
        keep("total", (mesh_time + build_time + trace_time).as_secs_f64() * 1e3);
    }
    Ok(Value::Object(row))
}
