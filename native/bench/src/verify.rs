//! Comparing answers ray by ray, and deciding in double precision who was wrong where they differ.

use espalier_core::{
    Hits, Mesh,
    ray::{Hit, MISS, Ray},
};
use glam::DVec3;
use serde::Serialize;

use crate::rays::RayColumns;

/// Relative difference of t up to which two hits are the same.
const SAME: f64 = 1e-5;

/// A position in single precision is off by at most this share of the largest coordinate, seen from the ray's origin:
/// twice what `espalier_core::traverse::frame` derives.
const DOUBT: f64 = 16.0 / (1 << 24) as f64;

/// How the answers to one batch of rays compare.
#[derive(Debug, Default, Clone, Copy, Serialize)]
pub struct Comparison {
    /// Rays that hit something, by our answer.
    pub hits: usize,
    /// Rays of equal t whose primitives differ: they cross an edge or two triangles in one place.
    pub ties: usize,
    /// Rays whose answers differ.
    pub mismatches: usize,
    /// Of these, those where double precision says that we are wrong.
    pub ours_wrong: usize,
    /// Of these, those where double precision says that Embree is wrong.
    pub embree_wrong: usize,
}

/// Compare closest hits.
pub fn closest(mesh: &Mesh, rays: &RayColumns, ours: &Hits, embree: &Hits) -> Comparison {
    let mut comparison = Comparison::default();
    let batch = rays.rays();
    for index in 0..rays.len() {
        let (mine, theirs) = (ours.get(index), embree.get(index));
        comparison.hits += usize::from(mine.primitive != MISS);
        if same(&mine, &theirs) {
            comparison.ties += usize::from(mine.primitive != theirs.primitive);
        } else {
            let ray = batch.get(index);
            comparison.mismatches += 1;
            comparison.ours_wrong += usize::from(is_wrong(mesh, &ray, &mine, &theirs));
            comparison.embree_wrong += usize::from(is_wrong(mesh, &ray, &theirs, &mine));
        }
    }
    comparison
}

/// Compare any-hit answers; `nearest` gives the closest hit by either side's word, to judge where they differ.
pub fn any(mesh: &Mesh, rays: &RayColumns, ours: &[bool], embree: &[bool], nearest: [&Hits; 2]) -> Comparison {
    let mut comparison = Comparison::default();
    let batch = rays.rays();
    for index in 0..rays.len() {
        comparison.hits += usize::from(ours[index]);
        if ours[index] != embree[index] {
            let ray = batch.get(index);
            let is_blocked = nearest.iter().any(|hits| is_sure(mesh, &ray, hits.get(index).primitive));
            comparison.mismatches += 1;
            comparison.ours_wrong += usize::from(is_blocked && !ours[index]);
            comparison.embree_wrong += usize::from(is_blocked && !embree[index]);
        }
    }
    comparison
}

/// Both miss, or both hit at one t. Two primitives at one t of one ray meet there, so that is a tie.
fn same(a: &Hit, b: &Hit) -> bool {
    match (a.primitive == MISS, b.primitive == MISS) {
        (true, true) => true,
        (false, false) => (f64::from(a.t) - f64::from(b.t)).abs() <= SAME * f64::from(a.t.abs().max(b.t.abs())),
        _ => false,
    }
}

/// Whether `answer` is wrong beyond doubt: it names a triangle that the ray passes by, or a distance that is not the
/// triangle's, or `other` has a nearer hit that is beyond doubt.
fn is_wrong(mesh: &Mesh, ray: &Ray, answer: &Hit, other: &Hit) -> bool {
    let Some(crossing) = Crossing::new(mesh, ray, answer.primitive) else {
        return is_sure(mesh, ray, other.primitive);
    };
    let is_displaced = (crossing.t - f64::from(answer.t)).abs() > crossing.blur;
    let is_nearer = |other: Crossing| other.t + other.blur < crossing.t - crossing.blur;
    let is_late =
        is_sure(mesh, ray, other.primitive) && Crossing::new(mesh, ray, other.primitive).is_some_and(is_nearer);
    crossing.inside < -crossing.doubt || is_displaced || is_late
}

/// Whether the ray hits the triangle beyond doubt.
fn is_sure(mesh: &Mesh, ray: &Ray, primitive: u32) -> bool {
    Crossing::new(mesh, ray, primitive).is_some_and(|crossing| {
        let interval = f64::from(ray.tmin) + crossing.blur..=f64::from(ray.tmax) - crossing.blur;
        crossing.inside > crossing.doubt && interval.contains(&crossing.t)
    })
}

/// Where a ray meets a triangle's plane, in double precision.
struct Crossing {
    t: f64,
    /// The least barycentric weight.
    inside: f64,
    /// By how much single precision may be off in `t`.
    blur: f64,
    /// By how much single precision may be off in `inside`.
    doubt: f64,
}

impl Crossing {
    fn new(mesh: &Mesh, ray: &Ray, primitive: u32) -> Option<Self> {
        if primitive == MISS {
            return None;
        }
        let [a, b, c] = mesh.corners(primitive).map(|corner| corner.as_dvec3());
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let normal = (b - a).cross(c - a);
        let slant = direction.dot(normal);
        let t = (a - origin).dot(normal) / slant;
        let point = origin + direction * t;
        let weight = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(normal) / normal.length_squared();
        let reach = [a, b, c].map(|corner| (corner - origin).abs().max_element()).into_iter().fold(0.0, f64::max);
        let across = slant.abs() / (normal.length() * direction.length());
        let edge = (b - a).length().max((c - b).length()).max((a - c).length());
        t.is_finite().then(|| Self {
            t,
            inside: weight(a, b).min(weight(b, c)).min(weight(c, a)),
            blur: SAME * t.abs().max(reach / (across * direction.length())),
            doubt: DOUBT * reach / (across * normal.length() / edge),
        })
    }
}
