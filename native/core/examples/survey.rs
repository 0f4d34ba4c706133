//! Build and trace cost of every method over meshes: `survey [--methods a,b] [--threads n] [--calibrate yes] [--set key=value] MESH...`, where MESH is a
//! binary PLY file of triangles, or `soup:COUNT:SIZE`, `sphere:SUBDIVISIONS`.
//!
//! Nanoseconds a ray, one thread, least of three rounds: `camera` looks at the mesh from outside; `bounce` leaves the camera's hit
//! points in cosine-weighted directions; `lines` run between random points of the scene's box. In parentheses, steps and
//! triangle tests of a ray that walks alone.

use std::{path::Path, sync::Arc, time::Instant};

use espalier_core::{
    Accelerator, Config, Hits, Job, Mesh, Method,
    accel::{calibrate::calibrate, config::CostConstants},
    ray::MISS,
    traverse::probe::Counts,
};
use glam::Vec3;

#[path = "../tests/common/mod.rs"]
mod common;
use common::RayBatch;

fn main() {
    let mut arguments = std::env::args().skip(1).peekable();
    let (mut methods, mut config) = (Method::ALL.to_vec(), Config::default());
    let (mut threads, mut totals) = (0, None);
    while let Some(option) = arguments.next_if(|argument| argument.starts_with("--")) {
        let value = arguments.next().expect("a value");
        match option.as_str() {
            "--methods" => methods = value.split(',').map(|name| Method::from_name(name).unwrap()).collect(),
            "--threads" => threads = value.parse().unwrap(),
            "--calibrate" => config.cost = calibrated(&value),
            "--totals" => totals = Some(value.split(',').map(|count| count.parse().unwrap()).collect::<Vec<f64>>()),
            "--set" => set(&mut config, value.split_once('=').expect("key=value")),
            _ => panic!("unknown option {option}"),
        }
    }
    for name in arguments {
        match &totals {
            Some(counts) => tell_totals(&name, &methods, &config, counts),
            None => survey(&name, &methods, &config, threads),
        }
    }
}

/// Constants of this machine, where wanted: `--calibrate yes`.
fn calibrated(value: &str) -> CostConstants {
    let start = Instant::now();
    let cost = if value == "yes" { calibrate().unwrap() } else { CostConstants::default() };
    println!("{cost:?} in {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    cost
}

fn set(config: &mut Config, (key, value): (&str, &str)) {
    let number: f64 = value.parse().unwrap();
    match key {
        "hit_threshold" => config.hit_threshold = number,
        "spread_threshold" => config.spread_threshold = number,
        "grid_density" => config.grid_density = number,
        "grid_least_triangles" => config.grid_least_triangles = number as usize,
        "grid_most_triangles" => config.grid_most_triangles = number as usize,
        "sample_least" => config.sample_least = number as u32,
        "sample_rays" => config.sample_rays = number,
        "expected_rays" => config.expected_rays = number,
        "coarse_density" => config.coarse_density = number,
        "fine_density" => config.fine_density = number,
        "expansions" => config.expansions = number as u32,
        "nesting" => config.nesting = number as usize,
        "grid_gain" => config.grid_gain = number,
        _ => panic!("unknown key {key}"),
    }
}

fn load(name: &str) -> Mesh {
    let parts: Vec<&str> = name.split(':').collect();
    let (vertices, triangles) = match parts[..] {
        ["soup", count, size] => common::soup(count.parse().unwrap(), size.parse().unwrap()),
        ["sphere", subdivisions] => common::icosphere(subdivisions.parse().unwrap()),
        _ => ply(Path::new(name)),
    };
    Mesh::new(vertices, triangles).unwrap()
}

/// Little-endian float32 positions and triangles of int32 indices.
fn ply(path: &Path) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let bytes = std::fs::read(path).unwrap();
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8_lossy(&bytes[..end]);
    let count = |element: &str| -> usize {
        let line = header.lines().find_map(|line| line.strip_prefix(&format!("element {element} ")));
        line.unwrap().parse().unwrap()
    };
    let (vertices, faces) = bytes[end..].split_at(12 * count("vertex"));
    let word = |part: &[u8]| <[u8; 4]>::try_from(part).unwrap();
    let vertices =
        vertices.chunks_exact(12).map(|v| Vec3::from_array([0, 4, 8].map(|i| f32::from_le_bytes(word(&v[i..i + 4])))));
    let faces = faces.chunks_exact(13).map(|f| [1, 5, 9].map(|i| u32::from_le_bytes(word(&f[i..i + 4]))));
    (vertices.collect(), faces.take(count("face")).collect())
}

fn survey(name: &str, methods: &[Method], config: &Config, threads: usize) {
    let mesh = Arc::new(load(name));
    println!("{name}: {} triangles", mesh.triangles().len());
    let sets = [("camera", camera(&mesh)), ("bounce", bounce(&mesh)), ("lines", lines(&mesh))];
    for &method in methods {
        let (start, before) = (Instant::now(), processor_ms());
        let accelerator = Accelerator::build(mesh.clone(), method, config, threads, &Job::new()).unwrap();
        let (build, processor) = (start.elapsed().as_secs_f64() * 1e3, processor_ms() - before);
        let census = accelerator.census();
        print!("{:15} build {build:7.1} ms ({processor} ms of all processors)", method.name());
        for (set, rays) in &sets {
            print!("  {set} {:6.1} {}", nanoseconds(&accelerator, rays), counted(&accelerator, rays));
        }
        println!(
            "\n{:15} nodes {} leaves {} grids {} cells {} ({} empty) refs {} depth {} sah {:.1} bytes {}",
            "",
            census.nodes,
            census.leaves,
            census.grids,
            census.cells,
            census.empty_cells,
            census.references,
            census.max_depth,
            census.sah_cost,
            census.bytes
        );
        let phases: Vec<String> =
            accelerator.phases().iter().map(|phase| format!("{} {:.1}", phase.name, phase.milliseconds)).collect();
        println!("{:15} {}", "", phases.join(", "));
        verdicts(&accelerator);
    }
}

/// Milliseconds of building on one thread and then tracing so many rays, as JSON, a line for each method and number of
/// rays: half of the rays come from the camera, the others leave its hit points.
fn tell_totals(name: &str, methods: &[Method], config: &Config, counts: &[f64]) {
    let mesh = Arc::new(load(name));
    let sets = [camera(&mesh), bounce(&mesh)];
    for &expected_rays in counts {
        for &method in methods {
            let config = Config { expected_rays, ..config.clone() };
            let rounds = if expected_rays > 2e6 { 1 } else { 3 };
            let [build, trace] = (0..rounds)
                .map(|_| total(&mesh, method, &config, &sets))
                .min_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])))
                .unwrap();
            println!(
                "{{\"mesh\": \"{name}\", \"triangles\": {}, \"rays\": {expected_rays}, \"method\": \"{}\", \"build_ms\": {build:.3}, \"trace_ms\": {trace:.3}}}",
                mesh.triangles().len(),
                method.name()
            );
        }
    }
}

fn total(mesh: &Arc<Mesh>, method: Method, config: &Config, sets: &[RayBatch; 2]) -> [f64; 2] {
    let start = process_ns();
    let accelerator = Accelerator::build(mesh.clone(), method, config, 1, &Job::new()).unwrap();
    let built = process_ns();
    for batch in sets {
        let mut left = (config.expected_rays / 2.0) as usize;
        while left > 0 {
            let rays = batch.rays().part(0, left);
            let mut hits = Hits::misses(rays.len());
            accelerator.closest(&rays, hits.as_mut(), 1, &Job::new()).unwrap();
            left -= rays.len();
        }
    }
    [built - start, process_ns() - built].map(|nanoseconds| nanoseconds * 1e-6)
}

/// How many decisions of each size went which way.
fn verdicts(accelerator: &Accelerator) {
    let decisions = accelerator.decisions();
    let depth = decisions.iter().map(|decision| decision.depth).max().map_or(0, |depth| depth + 1);
    for depth in 0..depth {
        let level: Vec<_> = decisions.iter().filter(|decision| decision.depth == depth).collect();
        let count = |verdict: u8| level.iter().filter(|decision| decision.verdict as u8 == verdict).count();
        let quantiles = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            [0.1, 0.5, 0.9].map(|share| {
                values.get((share * values.len() as f64) as usize).map_or(f64::NAN, |v| (v * 100.0).round() / 100.0)
            })
        };
        let sampled = || level.iter().filter(|decision| decision.rays > 0);
        println!(
            "    depth {depth}: {} decided, {} split {} grid {} leaf; hits {:?} spread {:?} grid/bvh {:?}",
            level.len(),
            count(0),
            count(1),
            count(2),
            quantiles(&mut sampled().map(|d| f64::from(d.hits) / f64::from(d.rays)).collect()),
            quantiles(&mut sampled().map(|d| f64::from(d.spread)).collect()),
            quantiles(&mut sampled().map(|d| f64::from(d.cost_grid / d.cost_bvh)).collect()),
        );
    }
}

/// What this process has used so far, in milliseconds of processor time by steps of 10; Linux only, else 0.
fn processor_ms() -> u64 {
    let line = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = line.rsplit(") ").next().unwrap_or_default().split(' ');
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<u64>().ok()).sum::<u64>() * 10
}

/// What this process has used so far, in nanoseconds of processor time.
fn process_ns() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    now.tv_sec as f64 * 1e9 + now.tv_nsec as f64
}

/// What this thread has used so far, in nanoseconds of processor time, so that other work on the machine matters
/// little; of wall time where the system does not tell.
fn thread_ns() -> f64 {
    let line = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let used = line.split(' ').next().and_then(|used| used.parse::<f64>().ok());
    used.unwrap_or_else(|| std::time::UNIX_EPOCH.elapsed().unwrap().as_secs_f64() * 1e9)
}

fn nanoseconds(accelerator: &Accelerator, batch: &RayBatch) -> f64 {
    let rays = batch.rays();
    let mut hits = Hits::misses(rays.len());
    let round = |_| {
        let start = thread_ns();
        accelerator.closest(&rays, hits.as_mut(), 1, &Job::new()).unwrap();
        (thread_ns() - start) / rays.len() as f64
    };
    (0..3).map(round).fold(f64::INFINITY, f64::min)
}

/// Mean steps and tests of a ray that walks alone.
fn counted(accelerator: &Accelerator, batch: &RayBatch) -> String {
    let rays = batch.rays();
    let mut counts = vec![Counts::default(); rays.len()];
    accelerator.counted(&rays, &mut counts, 1, &Job::new()).unwrap();
    let mean = |part: fn(&Counts) -> u32| counts.iter().map(|c| f64::from(part(c))).sum::<f64>() / rays.len() as f64;
    format!("({:.2} steps {:.2} tests)", mean(|counts| counts.steps), mean(|counts| counts.tests))
}

fn uniform(index: usize, dimension: u64) -> f32 {
    let mut z = (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ dimension.wrapping_mul(0xd1b5_4a32_d192_ed03);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

const EDGE: usize = 400;

fn camera(mesh: &Mesh) -> RayBatch {
    let bounds = mesh.bounds();
    let (centre, reach) = (bounds.centre(), bounds.extent().length());
    let eye = centre + Vec3::new(0.45, 0.3, 0.84).normalize() * reach;
    let forward = (centre - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let mut rays = RayBatch::default();
    for pixel in 0..EDGE * EDGE {
        let place = |i: usize| (i as f32 + 0.5) / EDGE as f32 - 0.5;
        let direction = forward + right * place(pixel % EDGE) * 0.8 + up * place(pixel / EDGE) * 0.8;
        rays.push(eye, direction, 0.0, f32::INFINITY);
    }
    rays
}

fn bounce(mesh: &Arc<Mesh>) -> RayBatch {
    let accelerator = Accelerator::build(mesh.clone(), Method::BvhSah, &Config::default(), 0, &Job::new()).unwrap();
    let first = camera(mesh);
    let hits = common::closest(&accelerator, &first);
    let mut rays = RayBatch::default();
    for index in (0..first.len()).filter(|&index| hits.primitive[index] != MISS) {
        let ray = first.ray(index);
        let mut normal = mesh.normal(hits.primitive[index]);
        normal *= -normal.dot(ray.direction).signum();
        let point = ray.origin + ray.direction * hits.t[index];
        let (z, angle) = (2.0 * uniform(index, 1) - 1.0, std::f32::consts::TAU * uniform(index, 2));
        let sphere = Vec3::new(angle.cos(), angle.sin(), 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z;
        rays.push(point, normal * 1.001 + sphere, 1e-4 * mesh.bounds().extent().max_element(), f32::INFINITY);
    }
    rays
}

fn lines(mesh: &Mesh) -> RayBatch {
    let bounds = mesh.bounds();
    let mut rays = RayBatch::default();
    for index in 0..EDGE * EDGE / 2 {
        let point = |first: u64| {
            bounds.lower + bounds.extent() * Vec3::from_array([0, 1, 2].map(|k| uniform(index, first + k)))
        };
        let (origin, target) = (point(3), point(6));
        rays.push(origin, target - origin, 0.0, f32::INFINITY);
    }
    rays
}
