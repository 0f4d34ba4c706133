//! [`triangle::intersect`](crate::triangle::intersect) for eight rays and eight triangles at once, operation by
//! operation, so that both give the same bits.

use crate::simd::Simd;

/// Eight rays against a triangle each, without their intervals.
pub struct Exact<S: Simd> {
    /// Ray parameters, in the frame's units; like the weights they mean something in the lanes of `hit`, and in those
    /// of `unclear` that [`triangle::intersect`](crate::triangle::intersect) finds to be hit.
    pub t: S::F32,
    /// Weights of the second corners.
    pub u: S::F32,
    /// Weights of the third corners.
    pub v: S::F32,
    /// Lanes whose ray crosses the triangle, at whatever parameter.
    pub hit: u32,
    /// Lanes in which a ray meets the line of an edge: to be decided by the scalar test.
    pub unclear: u32,
}

impl<S: Simd> Exact<S> {
    /// `corners[c][k]` are relative to the rays' origins, k in the order of the rays' [axes]; `shear` and `depth` are
    /// the rays' directions over, and along, the last of these.
    ///
    /// [axes]: super::frame::Frame::axes
    #[inline(always)]
    pub fn new(simd: S, corners: &[[S::F32; 3]; 3], shear: [S::F32; 2], depth: S::F32) -> Self {
        let a = sheared(simd, corners[0], shear);
        let b = sheared(simd, corners[1], shear);
        let c = sheared(simd, corners[2], shear);
        let (u, v, w) = (edge(simd, c, b), edge(simd, a, c), edge(simd, b, a));
        let determinant = simd.add_f64(simd.add_f64(u, v), w);
        let depths = simd.add_f64(simd.mul_f64(u, a[2]), simd.mul_f64(v, b[2]));
        let depths = simd.add_f64(depths, simd.mul_f64(w, c[2]));
        let [above, below] = [
            [simd.positive_f64(u), simd.positive_f64(v), simd.positive_f64(w)],
            [simd.negative_f64(u), simd.negative_f64(v), simd.negative_f64(w)],
        ];
        let hit = above[0] & above[1] & above[2] | below[0] & below[1] & below[2];
        let missed = (above[0] | above[1] | above[2]) & (below[0] | below[1] | below[2]);
        Self {
            t: simd.narrow(simd.div_f64(depths, simd.mul_f64(determinant, simd.widen(depth)))),
            u: simd.narrow(simd.div_f64(v, determinant)),
            v: simd.narrow(simd.div_f64(w, determinant)),
            hit,
            unclear: 0xff & !(hit | missed),
        }
    }
}

/// Corners in sheared space; x and y are rounded to single precision step by step.
#[inline(always)]
fn sheared<S: Simd>(simd: S, [x, y, z]: [S::F32; 3], shear: [S::F32; 2]) -> [S::F64; 3] {
    let x = simd.sub(x, simd.mul(shear[0], z));
    let y = simd.sub(y, simd.mul(shear[1], z));
    [simd.widen(x), simd.widen(y), simd.widen(z)]
}

/// Twice the signed areas of the triangles of the origin, `p` and `q`, in x and y.
#[inline(always)]
fn edge<S: Simd>(simd: S, p: [S::F64; 3], q: [S::F64; 3]) -> S::F64 {
    simd.sub_f64(simd.mul_f64(p[0], q[1]), simd.mul_f64(p[1], q[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        ray::Ray,
        simd::{Kernel, Level},
        traverse::frame::{Domain, Frame},
        triangle::{self, LANES},
    };
    use glam::Vec3;

    type Triangle = [[f32; 3]; 3];

    struct Eight<'a>(&'a Frame, &'a [Triangle]);

    impl Kernel for Eight<'_> {
        type Output = ([[f32; LANES]; 3], u32, u32);
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let Self(frame, triangles) = self;
            let axes = frame.axes.map(|axis| axis as usize);
            let lanes = |c: usize, k: usize| std::array::from_fn(|i| triangles[i][c][axes[k]] - frame.origin[axes[k]]);
            let corners = [0, 1, 2].map(|c| [0, 1, 2].map(|k| simd.load(&lanes(c, k))));
            let depth = simd.splat(frame.direction[axes[2]]);
            let exact = Exact::new(simd, &corners, frame.shear.map(|shear| simd.splat(shear)), depth);
            ([exact.t, exact.u, exact.v].map(|value| simd.store(value)), exact.hit, exact.unclear)
        }
    }

    /// Triangles around the z axis, so that rays along it hit some, miss some, and meet edges and corners of others.
    fn triangles() -> Vec<Triangle> {
        let number = |seed: u32| (seed.wrapping_mul(2_654_435_761) >> 28) as f32 / 4.0 - 1.75;
        let odd = |seed: u32| if seed.is_multiple_of(3) { 0.0 } else { 1e-3 * (seed % 7) as f32 };
        (0..400u32)
            .map(|i| {
                [0, 1, 2]
                    .map(|c| [0, 1, 2].map(|k| number(9 * i + 3 * c + k) + odd(i) + if k == 2 { 5.0 } else { 0.0 }))
            })
            .collect()
    }

    fn agree(level: Level, frame: &Frame, triangles: &[Triangle]) {
        let ([t, u, v], hit, unclear) = level.run(Eight(frame, triangles));
        for (lane, corners) in triangles.iter().enumerate() {
            let expected = triangle::intersect(frame, *corners, 7);
            if unclear >> lane & 1 == 0 {
                assert_eq!(hit >> lane & 1 == 1, expected.is_some(), "{} {corners:?}", level.name());
            }
            if let Some(hit) = expected {
                assert_eq!([t[lane], u[lane], v[lane]], [hit.t, hit.u, hit.v], "{} {corners:?}", level.name());
            }
        }
    }

    #[test]
    fn eight_have_the_bits_of_one() {
        let domain = Domain { centre: Vec3::new(0.0, 0.0, 5.0), half_extent: 2.0 };
        for direction in [Vec3::Z, Vec3::new(0.1, -0.2, 1.0), Vec3::new(-0.37, 0.91, -0.2)] {
            let origin = Vec3::new(0.0, 0.0, 5.0) - direction * 4.0;
            let ray = Ray { origin, direction, tmin: f32::NEG_INFINITY, tmax: f32::INFINITY };
            let frame = Frame::new(&ray, &domain).unwrap();
            for triangles in triangles().chunks(LANES) {
                Level::available().into_iter().for_each(|level| agree(level, &frame, triangles));
            }
        }
    }
}
