//! The exact hits of rays whose triangle is known, eight at once.

use super::{exact::Exact, frame::Frame};
use crate::{mesh::Reader, ray::Hit, simd::Simd, triangle::LANES};

/// Up to eight rays, and the triangle that each is known to hit.
pub struct Answers {
    corner: [[[f32; LANES]; 3]; 3],
    shear: [[f32; LANES]; 2],
    depth: [f32; LANES],
    primitive: [u32; LANES],
    slot: [usize; LANES],
    count: usize,
}

impl Answers {
    /// No rays.
    pub const EMPTY: Self = Self {
        corner: [[[0.0; LANES]; 3]; 3],
        shear: [[0.0; LANES]; 2],
        depth: [1.0; LANES],
        primitive: [0; LANES],
        slot: [0; LANES],
        count: 0,
    };

    /// Add a ray, by whatever name it has; there must be room.
    #[inline(always)]
    pub fn push(&mut self, slot: usize, frame: &Frame, mesh: Reader<'_>, primitive: u32) {
        let (lane, corners) = (self.count, mesh.places(primitive));
        for k in 0..3 {
            let axis = frame.axes[k] as usize;
            for c in 0..3 {
                self.corner[c][k][lane] = corners[c][axis] - frame.origin[axis];
            }
        }
        self.shear[0][lane] = frame.shear[0];
        self.shear[1][lane] = frame.shear[1];
        self.depth[lane] = frame.direction[frame.axes[2] as usize];
        self.primitive[lane] = primitive;
        self.slot[lane] = slot;
        self.count += 1;
    }

    /// Whether no more rays fit.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Names and hits of all rays, in the frames' units, as many as the last number says; the rays are then forgotten.
    #[inline(always)]
    pub fn take<S: Simd>(&mut self, simd: S) -> ([(usize, Hit); LANES], usize) {
        let zero = simd.splat(0.0);
        let mut corners = [[zero; 3]; 3];
        for c in 0..3 {
            for k in 0..3 {
                corners[c][k] = simd.load(&self.corner[c][k]);
            }
        }
        let shear = [simd.load(&self.shear[0]), simd.load(&self.shear[1])];
        let exact = Exact::new(simd, &corners, shear, simd.load(&self.depth));
        let (t, u, v) = (simd.store(exact.t), simd.store(exact.u), simd.store(exact.v));
        let mut hits = [(0, Hit::MISS); LANES];
        for lane in 0..LANES {
            let hit = Hit { t: t[lane], primitive: self.primitive[lane], u: u[lane], v: v[lane] };
            hits[lane] = (self.slot[lane], hit);
        }
        (hits, std::mem::take(&mut self.count))
    }
}
