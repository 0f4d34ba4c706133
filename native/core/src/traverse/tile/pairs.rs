//! Pairs of a group of rays and a triangle of a block, which some of the rays may meet.

use super::{GROUPS, RAYS};
use crate::triangle::LANES;

/// Most pairs of a block.
const MOST: usize = GROUPS * LANES;

/// A group and the lane of a triangle.
#[derive(Debug, Clone, Copy)]
pub struct Pair(u8);

impl Pair {
    /// Which group.
    #[inline(always)]
    pub fn group(self) -> usize {
        usize::from(self.0) / LANES % GROUPS
    }

    /// Which lane.
    #[inline(always)]
    pub fn lane(self) -> usize {
        usize::from(self.0) % LANES
    }
}

/// Pairs as bits.
#[derive(Debug, Clone, Copy, Default)]
pub struct PairSet(u128);

impl PairSet {
    /// Add a group's triangles.
    #[inline(always)]
    pub fn add(&mut self, group: usize, lanes: u32) {
        self.0 |= u128::from(lanes) << (group * LANES);
    }

    /// Remove one of the pairs; nothing where there is none.
    #[inline(always)]
    pub fn take(&mut self) -> Option<Pair> {
        let pair = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (pair < u128::BITS).then_some(Pair(pair as u8))
    }
}

/// A list of pairs, and the least edge function of every ray of each.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Pairs {
    least: [[f32; RAYS]; MOST],
    pair: [Pair; MOST],
    count: usize,
}

impl Pairs {
    /// None.
    pub const NONE: Self = Self { least: [[0.0; RAYS]; MOST], pair: [Pair(0); MOST], count: 0 };

    /// Forget all.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// How many there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Append a pair if it `counts`, without a branch. There may be one for every group and lane.
    #[inline(always)]
    pub fn push_if(&mut self, counts: bool, pair: Pair, least: [f32; RAYS]) {
        self.least[self.count % MOST] = least;
        self.pair[self.count % MOST] = pair;
        self.count += usize::from(counts);
    }

    /// One of them.
    #[inline(always)]
    pub fn get(&self, index: usize) -> (Pair, &[f32; RAYS]) {
        (self.pair[index % MOST], &self.least[index % MOST])
    }
}
