//! The exact hits of rays whose triangle is known, sixteen at once.

use super::{
    crossing::{in_order, third_axis},
    exact::Exact,
    stream::Bin,
};
use crate::{
    mesh::Reader,
    ray::Hit,
    simd::{Arithmetic, Simd},
    triangle::LANES,
};

/// Rays that are evaluated at once.
pub const RAYS: usize = 16;

/// The hits of sixteen rays of a bin, each of which hit something, in the rays' own units, to the bit those of
/// [`triangle::evaluate`](crate::triangle::evaluate).
#[inline(always)]
pub fn evaluate<S: Simd>(simd: S, bin: &Bin, slots: &[usize; RAYS], mesh: Reader<'_>) -> [Hit; RAYS] {
    let wide = simd.wide();
    let (shears, row) = (bin.shears(), &[0.0; 4]);
    let [mut a, mut b, mut c, mut first, mut second, mut third] = [[row; RAYS]; 6];
    let mut hits = [Hit::MISS; RAYS];
    for lane in 0..RAYS {
        hits[lane].primitive = bin.best(slots[lane]).primitive;
        [a[lane], b[lane], c[lane]] = mesh.rows(hits[lane].primitive);
        [first[lane], second[lane], third[lane]] = shears[slots[lane]].rows();
    }
    let [x, y, z, _] = simd.columns(&first);
    let [.., depth] = simd.columns(&second);
    let [across, along, kx, ky] = simd.columns(&third);
    let (origin, axes) = ([x, y, z], [kx, ky, third_axis(wide, kx, ky)]);
    let corners = [
        relative(wide, simd.columns(&a), axes, origin),
        relative(wide, simd.columns(&b), axes, origin),
        relative(wide, simd.columns(&c), axes, origin),
    ];
    let (across, along, depth) = (simd.halves(across), simd.halves(along), simd.halves(depth));
    let corners = halves(simd, &corners);
    for half in 0..2 {
        let exact = Exact::new(simd, &corners[half], [across[half], along[half]], depth[half]);
        let (t, u, v) = (simd.store(exact.t), simd.store(exact.u), simd.store(exact.v));
        for lane in 0..LANES {
            let place = LANES * half + lane;
            let t = shears[slots[place]].parameter(t[lane]);
            hits[place] = Hit { t, u: u[lane], v: v[lane], ..hits[place] };
        }
    }
    hits
}

/// A corner relative to the origin, in the order of the axes.
#[inline(always)]
fn relative<W: Arithmetic>(wide: W, [x, y, z, _]: [W::F32; 4], axes: [W::F32; 3], origin: [W::F32; 3]) -> [W::F32; 3] {
    let [x, y, z] = [wide.sub(x, origin[0]), wide.sub(y, origin[1]), wide.sub(z, origin[2])];
    in_order(wide, [x, y, z], axes)
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
