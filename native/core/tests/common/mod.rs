//! What the tests share: batches of rays, brute force, closed meshes.
#![allow(dead_code)] // Each test file uses its own part.

pub mod picture;

use std::{
    collections::{BTreeMap, BTreeSet},
    hash::{DefaultHasher, Hash, Hasher},
    sync::{Arc, Mutex, OnceLock},
};

use espalier_core::{
    Accelerator, Column, Config, Hits, Job, Mesh, Method, Rays,
    accel::{check::assert_well_formed, config::CostConstants},
    ray::{Hit, MISS, Ray},
    simd::Level,
    traverse::frame::{Domain, Frame},
    triangle,
};
use glam::Vec3;

/// Numbers in -1..1, the same every time.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// Rays by column.
#[derive(Debug, Default, Clone)]
pub struct RayBatch {
    columns: [Vec<f32>; 8],
}

impl RayBatch {
    pub fn push(&mut self, origin: Vec3, direction: Vec3, tmin: f32, tmax: f32) {
        let [o, d] = [origin.to_array(), direction.to_array()];
        let values = [o[0], o[1], o[2], d[0], d[1], d[2], tmin, tmax];
        self.columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
    }

    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    pub fn rays(&self) -> Rays<'_> {
        let [ox, oy, oz, dx, dy, dz, tmin, tmax] = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| Column::new(&self.columns[i]));
        Rays::new([ox, oy, oz], [dx, dy, dz], tmin, tmax, self.len()).unwrap()
    }

    pub fn ray(&self, index: usize) -> Ray {
        self.rays().get(index)
    }
}

/// The first hit in the order of [`Hit::precedes`] among all triangles, tested one by one.
pub fn brute_force(mesh: &Mesh, rays: &RayBatch) -> Hits {
    let domain = Domain::new(&mesh.bounds());
    let mut hits = Hits::misses(rays.len());
    for index in 0..rays.len() {
        let frame = Frame::new(&rays.ray(index), &domain).unwrap();
        let tests = mesh
            .solid(0)
            .filter_map(|t| triangle::intersect(&frame, mesh.corners(t).map(|corner| corner.to_array()), t));
        let best = tests.fold(Hit::MISS, |best, hit| if hit.precedes(&best) { hit } else { best });
        if best.primitive != MISS {
            hits.as_mut().set(index, Hit { t: frame.parameter(best.t), ..best });
        }
    }
    hits
}

/// What brute force finds, worked out once: a test asks the same of every method and instruction set.
fn expected(mesh: &Mesh, rays: &RayBatch) -> &'static Hits {
    static KNOWN: Mutex<BTreeMap<u64, &OnceLock<Hits>>> = Mutex::new(BTreeMap::new());
    let mut hasher = hashed(mesh);
    rays.columns.iter().flatten().for_each(|value| value.to_bits().hash(&mut hasher));
    let answer = *KNOWN.lock().unwrap().entry(hasher.finish()).or_insert_with(|| Box::leak(Box::default()));
    answer.get_or_init(|| brute_force(mesh, rays))
}

fn hashed(mesh: &Mesh) -> DefaultHasher {
    let mut hasher = DefaultHasher::new();
    mesh.vertices().iter().for_each(|vertex| vertex.to_array().map(f32::to_bits).hash(&mut hasher));
    mesh.triangles().hash(&mut hasher);
    hasher
}

pub fn closest(accelerator: &Accelerator, rays: &RayBatch) -> Hits {
    let mut hits = Hits::misses(rays.len());
    accelerator.closest(&rays.rays(), hits.as_mut(), 1, &Job::new()).unwrap();
    hits
}

pub fn occluded(accelerator: &Accelerator, rays: &RayBatch) -> Vec<bool> {
    let mut blocked = vec![false; rays.len()];
    accelerator.occluded(&rays.rays(), &mut blocked, 1, &Job::new()).unwrap();
    blocked
}

/// A closed sphere of `20 * 4^subdivisions` triangles around the origin, of radius 1.
pub fn icosphere(subdivisions: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5f32.sqrt()) / 2.0;
    let rectangle = |a: f32, b: f32| [[a, b], [-a, b], [-a, -b], [a, -b]];
    let corners = rectangle(1.0, golden).into_iter();
    let mut vertices: Vec<Vec3> = corners
        .flat_map(|[a, b]| [Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)])
        .map(Vec3::normalize)
        .collect();
    let mut triangles = hull_faces(&vertices);
    for _ in 0..subdivisions {
        triangles = subdivided(&mut vertices, &triangles);
    }
    (vertices, triangles)
}

/// The faces of a convex solid of equilateral triangles: all triples of points one shortest distance apart, turned
/// outwards.
fn hull_faces(vertices: &[Vec3]) -> Vec<[u32; 3]> {
    let count = vertices.len();
    let edge = (1..count).map(|i| vertices[0].distance(vertices[i])).fold(f32::INFINITY, f32::min) * 1.01;
    let near = |a: usize, b: usize| vertices[a].distance(vertices[b]) < edge;
    let mut faces = Vec::new();
    for a in 0..count {
        for b in a + 1..count {
            for c in (b + 1..count).filter(|&c| near(a, b) && near(b, c) && near(c, a)) {
                let normal = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
                let face = if normal.dot(vertices[a]) > 0.0 { [a, b, c] } else { [a, c, b] };
                faces.push(face.map(|index| index as u32));
            }
        }
    }
    faces
}

/// Every triangle in four, new vertices on the unit sphere.
fn subdivided(vertices: &mut Vec<Vec3>, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middles = std::collections::HashMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            vertices.push(((vertices[a as usize] + vertices[b as usize]) * 0.5).normalize());
            vertices.len() as u32 - 1
        })
    };
    let mut finer = Vec::with_capacity(4 * triangles.len());
    for &[a, b, c] in triangles {
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    finer
}

/// `count` triangles of about the given size, uniformly in the unit cube: the content that grids are good at.
pub fn soup(count: usize, size: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut state = 1u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut point = move || Vec3::new(uniform(), uniform(), uniform());
    let mut vertices = Vec::with_capacity(3 * count);
    for _ in 0..count {
        let centre = point();
        vertices.extend([(); 3].map(|()| centre + (point() - 0.5) * size));
    }
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    (vertices, triangles)
}

/// The accelerator of every method over a mesh, built with two threads and default settings.
pub fn build_all(mesh: &Arc<Mesh>) -> Vec<Accelerator> {
    let build = |method| Accelerator::build(mesh.clone(), method, &Config::default(), 2, &Job::new()).unwrap();
    Method::ALL.map(build).into()
}

/// A method with its settings, walked with one instruction set.
#[derive(Debug, Clone)]
pub struct Walk {
    pub method: Method,
    pub config: Config,
    pub level: Level,
}

impl Walk {
    /// Build, and check what was not checked before; on two threads, so that parallel parts run.
    pub fn build(&self, mesh: &Arc<Mesh>) -> Accelerator {
        let build = || Accelerator::build(mesh.clone(), self.method, &self.config, 2, &Job::new()).unwrap();
        let built = build();
        if !self.is_new(mesh) {
            return built.with_level(self.level);
        }
        let is_lazy = !built.structure().lazy.is_empty();
        assert_well_formed(built.structure(), mesh);
        // The check has refined every cell, which is for rays to do.
        let built = if is_lazy { build() } else { built };
        built.with_level(self.level)
    }

    /// Whether these settings come to this mesh for the first time; instruction sets only walk what was built.
    fn is_new(&self, mesh: &Mesh) -> bool {
        static BUILT: Mutex<BTreeSet<u64>> = Mutex::new(BTreeSet::new());
        let mut hasher = hashed(mesh);
        format!("{:?} {:?}", self.method, self.config).hash(&mut hasher);
        BUILT.lock().unwrap().insert(hasher.finish())
    }

    /// Assert that closest and any hits equal brute force to the bit, for rays that walk together and alone.
    pub fn agrees(&self, mesh: &Arc<Mesh>, rays: &RayBatch) {
        let accelerator = self.build(mesh);
        let expected = expected(mesh, rays);
        let alone = (0..rays.len()).step_by(SMALL).map(|first| self.hits(&accelerator, rays, first, SMALL));
        for hits in [self.hits(&accelerator, rays, 0, rays.len())].into_iter().chain(alone) {
            for (index, hit, blocked) in hits {
                assert_eq!(hit, expected.get(index), "ray {index}, {:?}, {self:?}", rays.ray(index));
                assert_eq!(
                    accelerator.tracer().walker().first(&rays.ray(index)).unwrap(),
                    hit,
                    "ray {index}, {self:?}"
                );
                assert_eq!(blocked, hit.primitive != MISS, "any hit, ray {index}, {:?}, {self:?}", rays.ray(index));
            }
        }
    }

    fn hits(&self, accelerator: &Accelerator, rays: &RayBatch, first: usize, count: usize) -> Vec<(usize, Hit, bool)> {
        let part = rays.rays().part(first, count);
        let (mut hits, mut blocked) = (Hits::misses(part.len()), vec![false; part.len()]);
        accelerator.closest(&part, hits.as_mut(), 1, &Job::new()).unwrap();
        accelerator.occluded(&part, &mut blocked, 1, &Job::new()).unwrap();
        let mut in_packets = vec![false; part.len()];
        accelerator.tracer().occluded_in_packets(&part, &mut in_packets).unwrap();
        assert_eq!(in_packets, blocked, "{self:?}");
        (0..part.len()).map(|index| (first + index, hits.get(index), blocked[index])).collect()
    }
}

/// Batches of this size are traced ray by ray.
const SMALL: usize = 16;

/// Settings under which small nodes become grids readily, so that small meshes have hybrids too.
pub fn eager() -> Config {
    Config {
        grid_least_triangles: 2,
        grid_most_triangles: 100,
        hit_threshold: 0.3,
        spread_threshold: f64::INFINITY,
        cost: CostConstants { node_ns: 50.0, block_ns: 50.0, cell_ns: 1.0, gather_ns: 1.0, reference_ns: 0.0 },
        ..Config::default()
    }
}

/// Settings under which grids hold hierarchies and grids, and hierarchies such grids, in small meshes, too.
pub fn nested() -> Config {
    Config {
        grid_density: 1.0,
        grid_least_triangles: 9,
        grid_most_triangles: 100,
        nesting: 3,
        cost: CostConstants { node_ns: 100.0, block_ns: 1.0, cell_ns: 0.1, gather_ns: 1e5, reference_ns: 0.0 },
        ..Config::default()
    }
}

/// A variant's method and settings. Its name is the method's with underscores; those of hybrids have a second one,
/// `eager_` instead of `hybrid_`, and the methods that decide otherwise a second one with settings in front.
pub fn variant(name: &str) -> (Method, Config) {
    let (wanted, config) = match name.split_once('_') {
        Some(("eager", judge)) => (format!("hybrid_{judge}"), eager()),
        Some(("few", method)) => (method.to_owned(), Config { expected_rays: 0.0, ..Config::default() }),
        Some(("many", method)) => (method.to_owned(), Config { expected_rays: 1e12, ..eager() }),
        Some(("nested", method)) => (method.to_owned(), nested()),
        Some(("tried", method)) => (method.to_owned(), Config { expected_rays: 0.0, ..Config::default() }),
        _ => (name.to_owned(), Config::default()),
    };
    let method = Method::ALL.into_iter().find(|method| method.name().replace(['-', '+'], "_") == wanted);
    (method.unwrap_or_else(|| panic!("no variant {name}")), config)
}

/// Run a test on the named variant of a method and instruction set, if this processor has it.
pub fn run(name: &str, level: &str, test: impl Fn(&Walk)) {
    let (method, config) = variant(name);
    match Level::available().into_iter().find(|available| available.name() == level) {
        Some(level) => test(&Walk { method, config, level }),
        None => eprintln!("skipped: this processor has no {level}"),
    }
}

/// Make `VARIANT::LEVEL::TEST` of every method, or of the named variants, every instruction set, and every named
/// function over a [`Walk`].
#[macro_export]
macro_rules! every_walk {
    ($tests:tt) => {
        $crate::every_walk!(@variants $tests;
            bvh_median, bvh_median_reinsert, bvh_sah, bvh_sah_reinsert, sbvh, sbvh_reinsert, ploc, ploc_reinsert,
            bvh_clusters, lbvh, grid, grid_two_level, grid_irregular, grid_tetrahedral, hapala, tried_hapala, fellner,
            nested_fellner, hybrid_sampled, hybrid_sequential, hybrid, eager_sampled, eager_sequential, few_hybrid,
            many_hybrid);
    };
    (@variants $tests:tt; $($variant:ident),+) => {
        #[test]
        fn no_method_is_left_out() {
            let walked = [$($crate::common::variant(stringify!($variant)).0),+];
            assert!(espalier_core::Method::ALL.iter().all(|method| walked.contains(method)));
        }
        $crate::every_walk!($tests of $($variant),+);
    };
    ($tests:tt of $($variant:ident),+) => {
        $(mod $variant { $crate::every_walk!(@levels $variant $tests; portable, avx2, avx512, neon); })+
    };
    (@levels $variant:ident $tests:tt; $($level:ident),+) => {
        $(mod $level { $crate::every_walk!(@tests $variant $level $tests); })+
    };
    (@tests $variant:ident $level:ident [$($test:ident),+]) => {
        $(#[test]
        fn $test() {
            $crate::common::run(stringify!($variant), stringify!($level), super::super::$test);
        })+
    };
}
