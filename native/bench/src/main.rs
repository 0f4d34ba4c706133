//! Espalier against Embree on the same rays, in one process, in turns. For development only: `tests/bench/run.py`
//! writes the plans, starts this, and shows what it prints, one JSON object a line.
//!
//! `espalier-bench race PLAN.json` measures; `espalier-bench turns PLAN.json` measures our methods against each other,
//! without Embree; `espalier-bench hits PLAN.json` only counts the hits of the plan's
//! rays, without Embree; `espalier-bench rays PLAN.json CLASS FILE` writes them; `espalier-bench steps PLAN.json
//! METHODS` counts what rays do in trees; `espalier-bench phases PLAN CLASS METHOD REPEATS` takes a picture's time
//! apart; `espalier-bench work PLAN.json CLASS METHOD REPEATS` does what a class times, without Embree, and prints the
//! least time: the difference between two numbers of repeats is what instruments can count.

mod arena;
mod camera;
mod embree;
mod error;
mod phases;
mod plan;
mod race;
mod rays;
mod rivals;
mod row;
mod scene;
mod steps;
mod verify;

use std::{path::Path, process::ExitCode, time::Duration};

use error::Error;
use espalier_core::Method;
use plan::{Class, Kind, Plan, Query};
use serde_json::json;

/// Bytes of [`settle`].
const LARGE: usize = 1 << 20;

/// Let the heap be as in a process that has run for a while. Until something large was freed once, glibc gives more than
/// 128 KiB at its end back to the system, and whether a build of some thousand triangles waits for those pages again, for
/// a third of its time, is an accident of the order in which it frees.
fn settle() {
    drop(std::hint::black_box(vec![1u8; LARGE]));
}

fn main() -> ExitCode {
    settle();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match arguments[..] {
        ["race", plan] => Plan::read(Path::new(plan)).and_then(|plan| race(&plan)),
        ["turns", plan] => Plan::read(Path::new(plan)).and_then(|plan| turns(&plan)),
        ["hits", plan] => Plan::read(Path::new(plan)).and_then(|plan| hits(&plan)),
        ["rays", plan, class, file] => Plan::read(Path::new(plan)).and_then(|plan| rays(&plan, class, Path::new(file))),
        ["work", plan, class, method, repeats] => {
            Plan::read(Path::new(plan)).and_then(|plan| work(&plan, class, method, repeats))
        }
        ["phases", plan, class, method, repeats] => {
            Plan::read(Path::new(plan)).and_then(|plan| phases(&plan, class, method, repeats))
        }
        ["steps", plan, methods] => Plan::read(Path::new(plan)).and_then(|plan| steps(&plan, methods)),
        _ => Err(Error::Plan(
            "the arguments are: race PLAN, turns PLAN, hits PLAN, rays PLAN CLASS FILE, steps PLAN METHODS, phases PLAN CLASS METHOD REPEATS, or work PLAN CLASS METHOD REPEATS".into(),
        )),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("espalier-bench: {error}");
            ExitCode::FAILURE
        }
    }
}

fn race(plan: &Plan) -> Result<(), Error> {
    let library = plan.library.as_deref().ok_or_else(|| Error::Plan("racing needs the library of Embree".into()))?;
    let embree = embree::Embree::load(library)?;
    let devices = rivals::devices(&embree, plan)?;
    let scene = scene::Scene::read(plan)?;
    let arena = arena::Arena::new(&scene, &devices);
    for class in &plan.classes {
        for row in arena.measure(class)? {
            println!("{}", serde_json::to_string(&row).expect("rows are plain data"));
        }
    }
    Ok(())
}

/// Our methods alone.
fn turns(plan: &Plan) -> Result<(), Error> {
    let scene = scene::Scene::read(plan)?;
    let arena = arena::Arena::new(&scene, &[]);
    for class in &plan.classes {
        for row in arena.turns(class)? {
            println!("{}", serde_json::to_string(&row).expect("rows are plain data"));
        }
    }
    Ok(())
}

/// How many rays each class has, and how many of them hit.
fn hits(plan: &Plan) -> Result<(), Error> {
    let scene = scene::Scene::read(plan)?;
    let built = scene::Built::new(&scene);
    for class in plan.classes.iter().filter(|class| matches!(class.kind, Kind::Batch | Kind::Single)) {
        for name in &class.methods {
            let rays = scene.rays(class.rays, &built)?;
            let mut answer = rivals::Answer::new(rays.len());
            let ours = built.get(Method::from_name(name)?)?;
            arena::trace_ours(&ours, &rays, class, plan.threads, &mut answer)?;
            let hits = match class.query {
                Query::Closest => answer.hits.t.iter().filter(|t| t.is_finite()).count(),
                Query::Any => answer.blocked.iter().filter(|&&blocked| blocked).count(),
            };
            let row = json!({"class": class.name, "method": name, "rays": rays.len(), "hits": hits});
            println!("{row}");
        }
    }
    Ok(())
}

/// Write the rays of a class, column by column, and say how fast each of its methods traces them from Rust.
fn rays(plan: &Plan, name: &str, file: &Path) -> Result<(), Error> {
    let class = class(plan, name)?;
    let scene = scene::Scene::read(plan)?;
    let built = scene::Built::new(&scene);
    let rays = scene.rays(class.rays, &built)?;
    let bytes: Vec<u8> = rays.columns.iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
    std::fs::write(file, bytes).map_err(|source| Error::Write { path: file.into(), source })?;
    let mut answer = rivals::Answer::new(rays.len());
    for name in &class.methods {
        let accelerator = built.get(Method::from_name(name)?)?;
        let mut best = Duration::MAX;
        for _ in 0..plan.rounds {
            let trace = || arena::trace_ours(&accelerator, &rays, class, plan.threads, &mut answer);
            let (time, result) = race::timed(plan.threads, trace);
            best = result.map(|()| best.min(time))?;
        }
        println!("{}", json!({"method": name, "rays_per_second": rays.len() as f64 / best.as_secs_f64()}));
    }
    Ok(())
}

/// Steps and tests per ray of comma-separated methods.
fn steps(plan: &Plan, methods: &str) -> Result<(), Error> {
    let methods: Vec<Method> = methods.split(',').map(Method::from_name).collect::<Result<_, _>>()?;
    for row in steps::rows(plan, &methods)? {
        println!("{row}");
    }
    Ok(())
}

/// Milliseconds of a picture's parts.
fn phases(plan: &Plan, class: &str, method: &str, repeats: &str) -> Result<(), Error> {
    let (class, repeats) = (self::class(plan, class)?, number(repeats)?);
    let scene = scene::Scene::read(plan)?;
    println!("{}", phases::row(&scene, class, Method::from_name(method)?, repeats)?);
    Ok(())
}

fn number(repeats: &str) -> Result<usize, Error> {
    repeats.parse().map_err(|_| Error::Plan(format!("'{repeats}' is no number of repeats")))
}

fn class<'p>(plan: &'p Plan, name: &str) -> Result<&'p Class, Error> {
    let missing = || Error::Plan(format!("the plan has no class {name}"));
    plan.classes.iter().find(|known| known.name == name).ok_or_else(missing)
}

/// Do what a class times, `repeats` times.
fn work(plan: &Plan, class: &str, method: &str, repeats: &str) -> Result<(), Error> {
    let (class, repeats) = (self::class(plan, class)?, number(repeats)?);
    let (scene, method) = (scene::Scene::read(plan)?, Method::from_name(method)?);
    let built = scene::Built::new(&scene);
    let rays = scene.rays(class.rays, &built)?;
    let mut answer = rivals::Answer::new(rays.len());
    let mut least = Duration::MAX;
    for _ in 0..repeats {
        let (time, done) = race::timed(plan.threads, || match class.kind {
            Kind::Build => scene.build(scene.mesh.clone(), method).map(drop),
            _ => arena::trace_ours(&*built.get(method)?, &rays, class, plan.threads, &mut answer),
        });
        done?;
        least = least.min(time);
    }
    println!("{}", json!({ "least_ms": least.as_secs_f64() * 1e3 }));
    Ok(())
}
