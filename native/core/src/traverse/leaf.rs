//! Triangle tests in blocks of eight.

use super::{crossing::Sheared, frame::Frame, probe::Probe};
use crate::{
    Mesh,
    ray::{Hit, MISS},
    simd::{Simd, guessed},
    triangle::{self, Block, LANES},
};

/// The first hit so far in the order of [`Hit::precedes`], as exactly as need be.
#[derive(Debug, Clone, Copy)]
pub struct Best {
    /// The parameter is at least this.
    pub low: f32,
    /// The parameter is at most this; nothing beyond is of interest.
    pub high: f32,
    /// The triangle, or [`MISS`].
    pub primitive: u32,
}

impl Best {
    /// Nothing yet, and interest in hits up to `tmax`.
    #[inline(always)]
    pub fn none(tmax: f32) -> Self {
        Self { low: tmax, high: tmax, primitive: MISS }
    }

    /// An exact hit.
    #[inline(always)]
    pub fn exactly(hit: &Hit) -> Self {
        Self { low: hit.t, high: hit.t, primitive: hit.primitive }
    }

    /// The hit, evaluated; in the frame's units.
    #[inline(always)]
    fn hit(&self, frame: &Frame, mesh: &Mesh) -> Hit {
        if self.primitive == MISS {
            return Hit::MISS;
        }
        triangle::evaluate(frame, triangle::relative(frame, mesh.reader().places(self.primitive)), self.primitive)
    }

    /// The first of two hits.
    #[inline(always)]
    pub fn or(self, other: Self, frame: &Frame, mesh: &Mesh) -> Self {
        if other.high < self.low {
            other
        } else if other.low > self.high {
            self
        } else {
            self.settle(other, frame, mesh)
        }
    }

    /// Which of two hits whose intervals overlap comes first.
    #[cold]
    #[inline(never)]
    fn settle(self, other: Self, frame: &Frame, mesh: &Mesh) -> Self {
        let [one, two] =
            [self, other].map(|best| if best.low < best.high { best.evaluated(frame, mesh) } else { best });
        if (two.low, two.primitive) < (one.low, one.primitive) { two } else { one }
    }

    fn evaluated(self, frame: &Frame, mesh: &Mesh) -> Self {
        Self::exactly(&self.hit(frame, mesh))
    }
}

/// The best hit so far, and the ray it belongs to.
pub struct Search<'a, S: Simd, P> {
    pub simd: S,
    pub frame: &'a Frame,
    pub mesh: &'a Mesh,
    pub probe: &'a mut P,
    pub best: Best,
    /// The block and the lane that the best hit so far came from, if it came from a block of the structure.
    place: Option<(&'a Block, usize)>,
}

impl<'a, S: Simd, P: Probe> Search<'a, S, P> {
    /// A search for what is better than the best hit so far.
    #[inline(always)]
    pub fn new(simd: S, frame: &'a Frame, mesh: &'a Mesh, probe: &'a mut P, best: Best) -> Self {
        Self { simd, frame, mesh, probe, best, place: None }
    }

    /// What is told of the best hit: all, or, where `ANY` will do, of which triangle it is. The triangle is read from
    /// its block, which is near, where it can be.
    #[inline(always)]
    pub fn answer<const ANY: bool>(&self) -> Hit {
        let Self { frame, best, .. } = self;
        if ANY || best.primitive == MISS {
            return Hit { primitive: best.primitive, ..Hit::MISS };
        }
        if let Some((block, lane)) = self.place {
            return triangle::evaluate(frame, block.relative(lane, frame), best.primitive);
        }
        best.hit(frame, self.mesh)
    }

    /// Test the first `count` triangles of a block of the structure; see [`Self::test`].
    #[inline(always)]
    pub fn block<const ANY: bool>(&mut self, block: &'a Block, count: u32) -> bool {
        let mut lane = LANES;
        let found = self.test::<ANY>(block, count, &mut lane);
        if lane != LANES {
            self.place = Some((block, lane));
        }
        found
    }

    /// Test the first `count` triangles of a block; true once there is any hit in it, where `ANY` is wanted. Where one
    /// of them becomes the best, `place` becomes its lane.
    #[inline(always)]
    fn test<const ANY: bool>(&mut self, block: &Block, count: u32, place: &mut usize) -> bool {
        self.probe.tests(count);
        let sheared = Sheared::of_block(self.simd, self.frame.shears(), block);
        let candidates = !sheared.missed(self.simd) & ((1 << count) - 1);
        candidates != 0 && self.candidates::<ANY>(block, &sheared, candidates, place)
    }

    /// Test the triangles that may be hit.
    #[inline(always)]
    fn candidates<const ANY: bool>(
        &mut self,
        block: &Block,
        sheared: &Sheared<S>,
        candidates: u32,
        place: &mut usize,
    ) -> bool {
        let (simd, frame) = (self.simd, self.frame);
        let interval = (simd.splat(frame.tmin), simd.splat(self.best.high));
        let crossings = sheared.cross(simd, simd.splat(frame.steepness), interval.0, interval.1);
        let mut candidates = candidates & !crossings.outside;
        if ANY && candidates & crossings.sure != 0 {
            self.best.primitive =
                block.primitive[(candidates & crossings.sure).trailing_zeros() as usize & (LANES - 1)];
            return true;
        }
        let (low, high) = (simd.store(crossings.low), simd.store(crossings.high));
        while candidates != 0 {
            let lane = guessed(candidates.trailing_zeros()) & (LANES - 1);
            candidates &= candidates - 1;
            let hit = if crossings.sure >> lane & 1 == 1 {
                Best { low: low[lane], high: high[lane], primitive: block.primitive[lane] }
            } else if let Some(hit) = block.intersect(lane, self.frame) {
                Best::exactly(&hit)
            } else {
                continue;
            };
            if self.offer(hit) {
                *place = lane;
            }
            if ANY {
                return true;
            }
        }
        false
    }

    /// Take the better of a hit and the best so far; true where it is the former.
    #[inline(always)]
    fn offer(&mut self, hit: Best) -> bool {
        self.best = self.best.or(hit, self.frame, self.mesh);
        self.best.primitive == hit.primitive
    }

    /// Test triangles by index, eight at a time; true once there is any hit among them, where `ANY` is wanted.
    #[inline(always)]
    pub fn gather<const ANY: bool>(&mut self, triangles: &[u32]) -> bool {
        for group in triangles.chunks(LANES) {
            let mut block = Block::EMPTY;
            for (lane, &triangle) in group.iter().enumerate() {
                block.set(lane, triangle, self.mesh.corners(triangle));
            }
            let mut lane = LANES;
            let found = self.test::<ANY>(&block, group.len() as u32, &mut lane);
            if lane != LANES {
                self.place = None;
            }
            if found {
                return true;
            }
        }
        false
    }
}
