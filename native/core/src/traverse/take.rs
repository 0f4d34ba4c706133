//! Where batches write their answers: columns of hits, or whether anything was hit.

use crate::{
    ray::{AlignedHits, Eight, Hit, HitsMut, MISS},
    triangle::LANES,
};

/// What answers are written to.
pub trait Take {
    /// The hit of a ray.
    fn take(&mut self, index: usize, hit: Hit);
    /// The hits of rays `index` to `index + 7`.
    fn take_eight(&mut self, index: usize, hits: &Eight);
    /// Where the hits of `count` rays from `index` on can be written past the caches, if they can;
    /// [`fence`](crate::simd::Simd::fence) must follow.
    fn aligned(&mut self, _index: usize, _count: usize) -> Option<AlignedHits<'_>> {
        None
    }
}

impl Take for HitsMut<'_> {
    #[inline(always)]
    fn take(&mut self, index: usize, hit: Hit) {
        self.set(index, hit);
    }
    #[inline(always)]
    fn take_eight(&mut self, index: usize, hits: &Eight) {
        self.set_eight(index, hits);
    }
    #[inline(always)]
    fn aligned(&mut self, index: usize, count: usize) -> Option<AlignedHits<'_>> {
        HitsMut::aligned(self, index, count)
    }
}

impl Take for [bool] {
    #[inline(always)]
    fn take(&mut self, index: usize, hit: Hit) {
        self[index] = hit.primitive != MISS;
    }
    #[inline(always)]
    fn take_eight(&mut self, index: usize, hits: &Eight) {
        let occluded: &mut [bool; LANES] = self[index..].first_chunk_mut().expect("eight rays have eight answers");
        for lane in 0..LANES {
            occluded[lane] = hits.primitive[lane] != MISS;
        }
    }
}
