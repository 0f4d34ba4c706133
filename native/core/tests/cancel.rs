//! Work stops when it is told to, and tells how far it is.

mod common;

use std::{sync::Arc, thread};

use common::*;
use espalier_core::{Accelerator, Config, Error, Hits, Job, Mesh, Method, job::Phase};
use glam::Vec3;

/// Cancel `work` from another thread once it has begun its phase.
fn cancelled<R: Send>(phase: Phase, work: impl FnOnce(&Job) -> R + Send) -> (R, Job) {
    let job = Job::new();
    let result = thread::scope(|scope| {
        let worker = scope.spawn(|| work(&job));
        while job.phase() != phase && !worker.is_finished() {
            thread::yield_now();
        }
        job.cancel();
        worker.join().unwrap()
    });
    (result, job)
}

fn large() -> Arc<Mesh> {
    let (vertices, triangles) = soup(400_000, 0.03);
    Arc::new(Mesh::new(vertices, triangles).unwrap())
}

#[test]
fn builds_stop() {
    let mesh = large();
    for method in Method::ALL {
        for threads in [1, 2] {
            let build = |job: &Job| Accelerator::build(mesh.clone(), method, &Config::default(), threads, job);
            let (result, job) = cancelled(Phase::Build, build);
            assert_eq!(result.err(), Some(Error::Cancelled), "{method:?}");
            assert!(job.progress() < 1.0, "{method:?} finished all work");
        }
    }
}

#[test]
fn traces_stop() {
    let (vertices, triangles) = soup(2000, 0.1);
    let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
    let mut rays = RayBatch::default();
    for index in 0..1_000_000 {
        let angle = index as f32 * 1e-3;
        rays.push(Vec3::splat(0.5), Vec3::new(angle.cos(), angle.sin(), (angle * 0.01).sin()), 0.0, f32::INFINITY);
    }
    for accelerator in build_all(&mesh) {
        let trace = |job: &Job| {
            let mut hits = Hits::misses(rays.len());
            accelerator.closest(&rays.rays(), hits.as_mut(), 2, job)
        };
        let (result, job) = cancelled(Phase::Trace, trace);
        assert_eq!(result, Err(Error::Cancelled), "{:?}", accelerator.method());
        assert!(job.progress() < 1.0, "{:?} finished all work", accelerator.method());
    }
}

#[test]
fn a_job_cancelled_before_does_nothing() {
    let (vertices, triangles) = soup(2000, 0.1);
    let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
    let job = Job::new();
    job.cancel();
    for method in Method::ALL {
        let result = Accelerator::build(mesh.clone(), method, &Config::default(), 2, &job);
        assert_eq!(result.err(), Some(Error::Cancelled), "{method:?}");
        assert_eq!(job.progress(), 0.0);
    }
}

#[test]
fn finished_builds_have_done_all_they_promised() {
    let (vertices, triangles) = soup(20_000, 0.05);
    let mesh = Arc::new(Mesh::new(vertices, triangles).unwrap());
    for method in Method::ALL {
        for config in [Config::default(), eager()] {
            let job = Job::new();
            Accelerator::build(mesh.clone(), method, &config, 2, &job).unwrap();
            assert_eq!(job.progress(), 1.0, "{method:?}");
        }
    }
}
