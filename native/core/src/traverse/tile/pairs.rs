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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_come_group_by_group_and_those_that_count_are_kept() {
        let mut set = PairSet::default();
        for (group, lanes) in [(GROUPS - 1, 0x81), (0, 0xff), (7, 0), (8, 0x12)] {
            set.add(group, lanes);
        }
        let mut pairs = Pairs::NONE;
        let mut places = Vec::new();
        while let Some(pair) = set.take() {
            places.push((pair.group(), pair.lane()));
            pairs.push_if(pair.lane() % 2 == 1, pair, [pair.lane() as f32; RAYS]);
        }
        let expected = (0..LANES).map(|lane| (0, lane)).chain([(8, 1), (8, 4), (GROUPS - 1, 0), (GROUPS - 1, 7)]);
        assert!(places.into_iter().eq(expected));
        let kept = (0..pairs.len()).map(|index| pairs.get(index)).map(|(pair, least)| (pair.group(), least[3]));
        assert!(kept.eq([(0, 1.0), (0, 3.0), (0, 5.0), (0, 7.0), (8, 1.0), (GROUPS - 1, 7.0)]));
    }

    #[test]
    fn there_is_room_for_every_pair() {
        let (mut set, mut pairs) = (PairSet::default(), Pairs::NONE);
        (0..GROUPS).for_each(|group| set.add(group, 0xff));
        while let Some(pair) = set.take() {
            pairs.push_if(true, pair, [0.0; RAYS]);
        }
        assert_eq!(pairs.len(), MOST);
        assert!((0..MOST).all(|index| usize::from(pairs.get(index).0.0) == index));
    }
}
