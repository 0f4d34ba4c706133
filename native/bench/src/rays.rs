//! The rays of the classes. Every one is a function of mesh, camera, seed and pixel, to the bit, on every machine: the
//! arithmetic is in double precision and uses nothing but what IEEE 754 rounds exactly.

use espalier_core::{
    Column, Hits, Mesh, Rays,
    ray::{MISS, Ray},
};
use glam::{DVec2, DVec3, Vec3};

use crate::camera::Camera;

/// Edge of the blocks of pixels in whose order a tiled renderer asks.
const BLOCK: usize = 8;

/// How far a bounce starts from its surface, as a share of the largest coordinate and of the box's diagonal.
const LIFT: f64 = 1e-5;

/// Rays by column, in the order origin, direction, tmin, tmax.
#[derive(Debug, Default, Clone)]
pub struct RayColumns {
    /// The columns, all of one length.
    pub columns: [Vec<f32>; 8],
}

impl RayColumns {
    fn push(&mut self, origin: Vec3, direction: Vec3, tmax: f32) {
        let ([ox, oy, oz], [dx, dy, dz]) = (origin.to_array(), direction.to_array());
        let values = [ox, oy, oz, dx, dy, dz, 0.0, tmax];
        self.columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    /// One of them.
    #[inline]
    pub fn get(&self, index: usize) -> Ray {
        let [ox, oy, oz, dx, dy, dz, tmin, tmax] = &self.columns;
        Ray {
            origin: Vec3::new(ox[index], oy[index], oz[index]),
            direction: Vec3::new(dx[index], dy[index], dz[index]),
            tmin: tmin[index],
            tmax: tmax[index],
        }
    }

    /// As Espalier takes them.
    pub fn rays(&self) -> Rays<'_> {
        let [ox, oy, oz, dx, dy, dz, tmin, tmax] = self.columns.each_ref().map(|column| Column::new(column));
        Rays::new([ox, oy, oz], [dx, dy, dz], tmin, tmax, self.len()).expect("all columns have one length")
    }
}

/// One ray through a random point of every pixel, in the order of blocks.
pub fn primary(camera: &Camera, resolution: usize, seed: u64) -> RayColumns {
    let mut rays = RayColumns::default();
    let blocks = resolution / BLOCK;
    for index in 0..resolution * resolution {
        let (block, inside) = (index / (BLOCK * BLOCK), index % (BLOCK * BLOCK));
        let x = block % blocks * BLOCK + inside % BLOCK;
        let y = block / blocks * BLOCK + inside / BLOCK;
        let mut random = Random::new(seed, index);
        let position = DVec2::new(x as f64 + random.next(), y as f64 + random.next()) / resolution as f64;
        let point = DVec2::new(2.0 * position.x - 1.0, 1.0 - 2.0 * position.y);
        rays.push(camera.eye(), camera.direction(point), f32::INFINITY);
    }
    rays
}

/// One cosine-distributed ray from every hit, on the side the primary ray came from, as long as `reach` times the
/// diagonal of the mesh's box, or endless.
pub fn bounce(mesh: &Mesh, primary: &Rays<'_>, hits: &Hits, reach: Option<f64>, seed: u64) -> RayColumns {
    let mut rays = RayColumns::default();
    let bounds = mesh.bounds();
    let diagonal = (bounds.upper - bounds.lower).as_dvec3().length();
    let lift = LIFT * f64::from(bounds.lower.abs().max(bounds.upper.abs()).max_element()).max(diagonal);
    let tmax = end(reach, diagonal);
    for index in (0..hits.len()).filter(|&index| hits.primitive[index] != MISS) {
        let ray = primary.get(index);
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let [a, b, c] = mesh.corners(hits.primitive[index]).map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        // A primary ray almost in the triangle's plane would throw the point far away; its t is then good enough.
        let slant = direction.dot(normal);
        let t = if slant < -1e-6 { (a - origin).dot(normal) / slant } else { f64::from(hits.t[index]) };
        let start = origin + direction * t + normal * lift;
        rays.push(start.as_vec3(), Random::new(!seed, index).cosine(normal).as_vec3(), tmax);
    }
    rays
}

/// `count` rays from uniform points of the mesh's box in uniform directions, as long as `reach` times its diagonal, or
/// endless.
pub fn inside(mesh: &Mesh, count: usize, reach: Option<f64>, seed: u64) -> RayColumns {
    let mut rays = RayColumns::default();
    let (lower, extent) = (mesh.bounds().lower.as_dvec3(), (mesh.bounds().upper - mesh.bounds().lower).as_dvec3());
    let tmax = end(reach, extent.length());
    for index in 0..count {
        let mut random = Random::new(seed, index);
        let start = lower + extent * DVec3::from_array([(); 3].map(|()| random.next()));
        rays.push(start.as_vec3(), random.direction().as_vec3(), tmax);
    }
    rays
}

/// Where rays end that reach so far, as a share of the diagonal.
fn end(reach: Option<f64>, diagonal: f64) -> f32 {
    reach.map_or(f32::INFINITY, |reach| (reach * diagonal) as f32)
}

/// Random numbers of one ray: splitmix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators",
/// OOPSLA 2014).
struct Random(u64);

impl Random {
    fn new(seed: u64, index: usize) -> Self {
        let mut mixed = Self(seed);
        let start = mixed.bits();
        Self(Self(start ^ index as u64).bits())
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// Uniform in [0, 1).
    fn next(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A uniform unit direction: that of a uniform point of the ball.
    fn direction(&mut self) -> DVec3 {
        loop {
            let point = DVec3::from_array([(); 3].map(|()| 2.0 * self.next() - 1.0));
            if (1e-6..1.0).contains(&point.length_squared()) {
                return point.normalize();
            }
        }
    }

    /// A unit direction about a unit normal with density proportional to the cosine between them: a uniform point of
    /// the disc, lifted onto the hemisphere (Malley).
    fn cosine(&mut self, normal: DVec3) -> DVec3 {
        let disc = loop {
            let point = DVec2::new(2.0 * self.next() - 1.0, 2.0 * self.next() - 1.0);
            if point.length_squared() < 1.0 {
                break point;
            }
        };
        let least = if normal.x.abs() < 0.5 { DVec3::X } else { DVec3::Y };
        let tangent = normal.cross(least).normalize();
        let height = (1.0 - disc.length_squared()).sqrt();
        (tangent * disc.x + normal.cross(tangent) * disc.y + normal * height).normalize()
    }
}
