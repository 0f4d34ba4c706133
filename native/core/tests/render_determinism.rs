//! One picture, whatever traces it and on however many threads; and how a render is stopped.

mod common;

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use common::{RayBatch, picture::*};
use espalier_core::{
    Error, Job, Mesh, Method,
    render::{Bulb, Camera, CameraSettings, LightKind, Material, Render, Scene, SceneSettings, Settings, render},
    traverse::probe::Counts,
};
use glam::{Mat4, Vec3};

/// A wavy surface of 2 n² triangles with smooth normals in every other of its cells.
fn waves(n: u32) -> (Arc<Mesh>, Vec<[Vec3; 3]>) {
    let place = |i: u32| i as f32 / n as f32 * 6.0 - 3.0;
    let point = |x: f32, y: f32| Vec3::new(x, y, 0.3 * (3.0 * x).sin() * (2.0 * y).cos());
    let vertices = (0..=n).flat_map(|j| (0..=n).map(move |i| point(place(i), place(j)))).collect();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles: Vec<_> = cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let mesh = mesh(vertices, triangles);
    let normals =
        (0..mesh.triangles().len() as u32).map(|t| mesh.corners(t).map(|p| (mesh.normal(t) + p * 0.05).normalize()));
    let normals = normals.collect();
    (mesh, normals)
}

/// Every kind of light, mirrors and a sky.
fn settings(mesh: &Mesh, normals: Vec<[Vec3; 3]>) -> SceneSettings {
    let kinds = [
        LightKind::Point { bulb: Bulb { radius: 0.2, soft_falloff: true } },
        LightKind::Spot { bulb: Bulb { radius: 0.1, soft_falloff: false }, size: 1.0, blend: 0.3 },
        LightKind::Sun { angle: 0.1 },
        LightKind::Area { round: true, size: [1.0, 2.0], spread: 2.0 },
    ];
    let lights = kinds
        .into_iter()
        .zip(0u8..)
        .map(|(kind, index)| light(kind, Mat4::from_translation(Vec3::new(f32::from(index) - 1.5, 0.0, 3.0)), 20.0));
    SceneSettings {
        materials: vec![Material::default(), Material { metallic: 1.0, roughness: 0.1, ..Default::default() }],
        material_index: Some((0..mesh.triangles().len() as u32).map(|t| u32::from(t % 7 < 3)).collect()),
        corner_normals: Some(normals),
        lights: lights.collect(),
        world: Vec3::new(0.2, 0.3, 0.5),
        ..Default::default()
    }
}

fn camera() -> CameraSettings {
    let matrix = Mat4::look_at_rh(Vec3::new(2.0, -6.0, 4.0), Vec3::ZERO, Vec3::Z).inverse();
    CameraSettings { matrix, resolution: [75, 50], ..Default::default() }
}

fn same(a: &Render, b: &Render) -> bool {
    let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    let planes =
        |render: &Render| [&render.film.combined, &render.film.depth, &render.film.normal].map(|plane| bits(plane));
    let rays =
        |render: &Render| (render.counters.primary_rays, render.counters.shadow_rays, render.counters.bounce_rays);
    planes(a) == planes(b) && rays(a) == rays(b)
}

#[test]
fn every_method_and_any_number_of_threads_give_the_same_picture() {
    let (mesh, normals) = waves(40);
    let scene = Scene::new(mesh.clone(), settings(&mesh, normals)).unwrap();
    let camera = Camera::new(&camera()).unwrap();
    let take = |method: Method, threads: usize| {
        let settings = Settings { samples: 3, threads, seed: 5, ..Default::default() };
        render(&accelerator(&mesh, method), &scene, &camera, &settings, &Job::new()).unwrap()
    };
    let expected = take(Method::BvhMedian, 1);
    assert!(expected.counters.bounce_rays > 100 && expected.counters.shadow_rays > 10_000);
    assert!(expected.film.combined.iter().all(|value| value.is_finite()));
    for method in Method::ALL {
        for threads in [1, 2, 5] {
            assert!(same(&take(method, threads), &expected), "{} on {threads} threads", method.name());
        }
    }
}

#[test]
fn cost_is_what_the_counted_query_tells_of_the_centre_rays() {
    let (mesh, normals) = waves(20);
    let scene = settings(&mesh, normals);
    let cost = picture(&mesh, scene, &camera(), &Settings { cost: true, ..Default::default() }).cost.unwrap();
    let (camera, mut rays) = (Camera::new(&camera()).unwrap(), RayBatch::default());
    for index in 0..camera.window().count() {
        let [x, y] = camera.window().pixel(index).map(|place| f64::from(place) + 0.5);
        let ray = camera.ray(x, y);
        rays.push(ray.origin, ray.direction, ray.tmin, ray.tmax);
    }
    let mut counts = vec![Counts::default(); rays.len()];
    let accelerator = accelerator(&mesh, Method::BvhSah);
    accelerator.counted(&rays.rays(), &mut counts, 1, &Job::new()).unwrap();
    let expected: Vec<f32> = counts.iter().map(|count| count.steps as f32).collect();
    assert!(expected.iter().any(|&steps| steps > 3.0));
    assert_eq!(cost, expected);
}

#[test]
fn a_border_is_cut_out_of_the_whole_picture() {
    let (mesh, normals) = waves(10);
    let scene = settings(&mesh, normals);
    let settings = Settings { samples: 2, ..Default::default() };
    let whole = picture(&mesh, scene.clone(), &camera(), &settings).film;
    let border = CameraSettings { border: Some([0.4, 0.2, 0.8, 0.9]), ..camera() };
    let part = picture(&mesh, scene, &border, &settings).film;
    assert_eq!((part.width, part.height), (30, 35));
    for (row, values) in part.combined.chunks(4 * 30).enumerate() {
        let start = 4 * ((row + 10) * 75 + 30);
        assert_eq!(values, &whole.combined[start..start + 4 * 30], "row {row}");
    }
}

#[test]
fn seeds_change_the_noise_only() {
    let (mesh, normals) = waves(10);
    let scene = settings(&mesh, normals);
    let take = |seed| picture(&mesh, scene.clone(), &camera(), &Settings { samples: 4, seed, ..Default::default() });
    let (a, b) = (take(1), take(2));
    assert!(same(&a, &take(1)) && !same(&a, &b));
    let mean = |render: &Render| render.film.combined.iter().map(|&v| f64::from(v)).sum::<f64>();
    near(mean(&a), mean(&b), 0.02);
}

#[test]
fn a_render_stops_soon_after_it_is_cancelled_and_tells_its_progress() {
    let (mesh, normals) = waves(100);
    let scene = Scene::new(mesh.clone(), settings(&mesh, normals)).unwrap();
    let (camera, job) = (Camera::new(&camera()).unwrap(), Job::new());
    let accelerator = accelerator(&mesh, Method::BvhSah);
    let settings = Settings { samples: 1 << 20, threads: 2, ..Default::default() };
    std::thread::scope(|scope| {
        let work = scope.spawn(|| render(&accelerator, &scene, &camera, &settings, &job));
        while job.progress() == 0.0 {
            std::thread::sleep(Duration::from_millis(5));
        }
        let asked = Instant::now();
        job.cancel();
        assert_eq!(work.join().unwrap().unwrap_err(), Error::Cancelled);
        assert!(asked.elapsed() < Duration::from_millis(200), "{:?}", asked.elapsed());
    });
}

#[test]
fn progress_ends_at_one_and_unusable_settings_are_refused() {
    let mesh = floor();
    let scene = Scene::new(mesh.clone(), white(vec![])).unwrap();
    let (camera, job) = (Camera::new(&camera()).unwrap(), Job::new());
    let accelerator = accelerator(&mesh, Method::Grid);
    render(&accelerator, &scene, &camera, &Settings { cost: true, samples: 2, ..Default::default() }, &job).unwrap();
    assert_eq!(job.progress(), 1.0);
    let refused = |settings: &Settings, scene: &Scene| {
        let result = render(&accelerator, scene, &camera, settings, &Job::new());
        assert!(matches!(result, Err(Error::Scene(_))), "{result:?}");
    };
    refused(&Settings { samples: 0, ..Default::default() }, &scene);
    refused(&Settings { max_bounces: 5000, ..Default::default() }, &scene);
    refused(&Settings::default(), &Scene::new(floor(), white(vec![])).unwrap());
}
