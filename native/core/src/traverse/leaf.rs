//! Triangle tests in blocks of eight.

use super::{frame::Frame, probe::Probe};
use crate::{Mesh, ray::Hit, simd::Simd, triangle::Block, triangle::LANES};

/// The best hit so far, and the ray it belongs to.
pub struct Search<'a, S: Simd, P> {
    pub simd: S,
    pub frame: &'a Frame,
    pub probe: &'a mut P,
    pub best: Hit,
}

impl<'a, S: Simd, P: Probe> Search<'a, S, P> {
    /// Nothing found yet: only hits within the frame's interval will count.
    #[inline(always)]
    pub fn new(simd: S, frame: &'a Frame, probe: &'a mut P) -> Self {
        Self { simd, frame, probe, best: Hit { t: frame.tmax, ..Hit::MISS } }
    }

    /// Test the first `count` triangles of a block; true once there is any hit in it.
    ///
    /// The vector part is a filter that never discards a hit: rounding is monotonic, so two edge functions of opposite
    /// sign in single precision have opposite signs exactly, and whatever overflows, underflows or is zero passes.
    /// What passes is decided by [`Block::intersect`].
    #[inline(always)]
    pub fn block(&mut self, block: &Block, count: u32) -> bool {
        self.probe.tests(count);
        let mut candidates = !self.surely_missed(block) & ((1 << count) - 1);
        let mut any = false;
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            if let Some(hit) = block.intersect(lane & (LANES - 1), self.frame) {
                any = true;
                if hit.precedes(&self.best) {
                    self.best = hit;
                }
            }
        }
        any
    }

    /// The lanes in which two edge functions have opposite signs.
    #[inline(always)]
    fn surely_missed(&self, block: &Block) -> u32 {
        let simd = self.simd;
        let a = self.shear(&block.corner[0]);
        let b = self.shear(&block.corner[1]);
        let c = self.shear(&block.corner[2]);
        let (u, v, w) = (edge(simd, c, b), edge(simd, a, c), edge(simd, b, a));
        let least = simd.min(simd.min(u, v), w);
        let greatest = simd.max(simd.max(u, v), w);
        simd.straddles_zero(least, greatest)
    }

    /// Corners in sheared space, rounded as in the exact test.
    #[inline(always)]
    fn shear(&self, corner: &[[f32; LANES]; 3]) -> [S::F32; 2] {
        let (simd, frame) = (self.simd, self.frame);
        let [kx, ky, kz] = frame.axes;
        let x = self.relative(corner, kx);
        let y = self.relative(corner, ky);
        let z = self.relative(corner, kz);
        let x = simd.sub(x, simd.mul(simd.splat(frame.shear[0]), z));
        let y = simd.sub(y, simd.mul(simd.splat(frame.shear[1]), z));
        [x, y]
    }

    #[inline(always)]
    fn relative(&self, corner: &[[f32; LANES]; 3], axis: u32) -> S::F32 {
        let axis = axis as usize;
        self.simd.sub(self.simd.load(&corner[axis]), self.simd.splat(self.frame.origin[axis]))
    }

    /// Test triangles by index, eight at a time; true once there is any hit among them.
    #[inline(always)]
    pub fn gather(&mut self, mesh: &Mesh, triangles: &[u32]) -> bool {
        let mut any = false;
        for group in triangles.chunks(LANES) {
            let mut block = Block::EMPTY;
            for (lane, &triangle) in group.iter().enumerate() {
                block.set(lane, triangle, mesh.corners(triangle));
            }
            any |= self.block(&block, group.len() as u32);
        }
        any
    }
}

/// Twice the signed areas of the triangles of the origin, `p` and `q`.
#[inline(always)]
fn edge<S: Simd>(simd: S, p: [S::F32; 2], q: [S::F32; 2]) -> S::F32 {
    simd.sub(simd.mul(p[0], q[1]), simd.mul(p[1], q[0]))
}
