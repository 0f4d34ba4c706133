//! The exact hits of rays whose triangle is known, sixteen at once.

use super::{exact::Exact, frame::Frame};
use crate::{
    mesh::Reader,
    ray::Hit,
    simd::{Arithmetic, Simd},
    triangle::LANES,
};

/// Rays that are evaluated at once.
pub const RAYS: usize = 16;

/// A ray, and the triangle that it is known to hit.
#[derive(Clone, Copy)]
pub struct Answer<'a> {
    /// By whatever name the ray has.
    pub slot: usize,
    pub frame: &'a Frame,
    pub primitive: u32,
}

/// The hits of sixteen rays, in their frames' units, to the bit those of [`triangle::evaluate`](crate::triangle::evaluate).
#[inline(always)]
pub fn evaluate<S: Simd>(simd: S, answers: &[Answer<'_>; RAYS], mesh: Reader<'_>) -> [Hit; RAYS] {
    let wide = simd.wide();
    let row: &[f32; 4] = &[0.0; 4];
    let [mut a, mut b, mut c, mut first, mut second, mut third] = [[row; RAYS]; 6];
    for (lane, answer) in answers.iter().enumerate() {
        [a[lane], b[lane], c[lane]] = mesh.rows(answer.primitive);
        [first[lane], second[lane], third[lane]] = answer.frame.sheared();
    }
    let [x, y, z, _] = simd.columns(&first);
    let [across, along, kx, ky] = simd.columns(&second);
    let [kz, depth, ..] = simd.columns(&third);
    let (origin, axes) = ([x, y, z], [kx, ky, kz]);
    let corners = [
        relative(wide, simd.columns(&a), axes, origin),
        relative(wide, simd.columns(&b), axes, origin),
        relative(wide, simd.columns(&c), axes, origin),
    ];
    let mut hits = [Hit::MISS; RAYS];
    let (across, along, depth) = (simd.halves(across), simd.halves(along), simd.halves(depth));
    let corners = halves(simd, &corners);
    for half in 0..2 {
        let exact = Exact::new(simd, &corners[half], [across[half], along[half]], depth[half]);
        let (t, u, v) = (simd.store(exact.t), simd.store(exact.u), simd.store(exact.v));
        for lane in 0..LANES {
            let place = LANES * half + lane;
            hits[place] = Hit { t: t[lane], primitive: answers[place].primitive, u: u[lane], v: v[lane] };
        }
    }
    hits
}

/// A corner relative to the origin, in the order of the axes.
#[inline(always)]
fn relative<W: Arithmetic>(wide: W, [x, y, z, _]: [W::F32; 4], axes: [W::F32; 3], origin: [W::F32; 3]) -> [W::F32; 3] {
    let (one, two) = (wide.splat(f32::from_bits(1)), wide.splat(f32::from_bits(2)));
    let mut relative = origin;
    for k in 0..3 {
        let place = wide.if_ge(axes[k], two, z, wide.if_ge(axes[k], one, y, x));
        relative[k] = wide.sub(place, origin[k]);
    }
    relative
}

#[inline(always)]
fn halves<S: Simd>(simd: S, corners: &[[<S::Wide as Arithmetic>::F32; 3]; 3]) -> [[[S::F32; 3]; 3]; 2] {
    let zero = simd.splat(0.0);
    let mut halves = [[[zero; 3]; 3]; 2];
    for c in 0..3 {
        for k in 0..3 {
            [halves[0][c][k], halves[1][c][k]] = simd.halves(corners[c][k]);
        }
    }
    halves
}
