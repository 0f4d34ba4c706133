//! What rays do in the trees of different methods: steps and tests per ray, which no noise changes, with the build times
//! for what they cost.

use std::time::Instant;

use espalier_core::{Accelerator, Config, Job, Method, traverse::probe::Counts};
use serde_json::{Value, json};

use crate::{
    error::Error,
    plan::{Kind, Plan},
    scene::{Built, Scene},
};

/// Rounds of builds, in turns; the least time of each method counts.
const BUILDS: usize = 3;

/// One row a method, for all classes of rays of a plan.
pub fn rows(plan: &Plan, methods: &[Method]) -> Result<Vec<Value>, Error> {
    let scene = Scene::read(plan)?;
    let built = Built::new(&scene);
    let mut rows: Vec<Value> = methods.iter().map(|method| json!({"method": method.name()})).collect();
    for class in plan.classes.iter().filter(|class| matches!(class.kind, Kind::Batch | Kind::Single)) {
        let rays = scene.rays(class.rays, &built)?;
        for (row, &method) in rows.iter_mut().zip(methods) {
            let mut counts = vec![Counts::default(); rays.len()];
            built.get(method)?.counted(&rays.rays(), &mut counts, plan.threads, &Job::new())?;
            let mean = |count: fn(&Counts) -> u32| {
                counts.iter().map(|counts| f64::from(count(counts))).sum::<f64>() / rays.len() as f64
            };
            row[&class.name] = json!({"steps": mean(|counts| counts.steps), "tests": mean(|counts| counts.tests)});
        }
    }
    for (row, &method) in rows.iter_mut().zip(methods) {
        let census = built.get(method)?.census();
        row["census"] = json!({
            "nodes": census.nodes, "leaves": census.leaves, "references": census.references,
            "depth": census.max_depth, "sah_cost": census.sah_cost, "bytes": census.bytes,
        });
    }
    time_builds(plan, &scene, methods, &mut rows)?;
    Ok(rows)
}

fn time_builds(plan: &Plan, scene: &Scene, methods: &[Method], rows: &mut [Value]) -> Result<(), Error> {
    let mut best = vec![f64::INFINITY; methods.len()];
    for _ in 0..BUILDS {
        for (best, &method) in best.iter_mut().zip(methods) {
            let start = Instant::now();
            Accelerator::build(scene.mesh.clone(), method, &Config::default(), plan.threads, &Job::new())?;
            *best = best.min(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    rows.iter_mut().zip(best).for_each(|(row, best)| row["build_ms"] = json!(best));
    Ok(())
}
