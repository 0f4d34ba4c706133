//! Object-median splits along cycling axes: the benchmark of Zhang and Chiu, "Building a Hybrid Approach to Space
//! Division for Faster Raytracing"; the median of Kay and Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986.

use super::tree::{Item, Split};

/// Splits at the median centroid, along x at the root, then y, then z, and so on.
#[derive(Debug, Clone, Copy)]
pub struct CyclingMedian;

impl Split for CyclingMedian {
    fn split(&self, items: &mut [Item], depth: usize) -> usize {
        halve(items, depth % 3)
    }
}

/// Put the half of the items with the lesser centroids first; ties go by primitive, so the halves are unique.
pub fn halve(items: &mut [Item], axis: usize) -> usize {
    let middle = items.len() / 2;
    let centroid = |item: &Item| item.bounds.lower[axis] + item.bounds.upper[axis];
    items
        .select_nth_unstable_by(middle, |a, b| centroid(a).total_cmp(&centroid(b)).then(a.primitive.cmp(&b.primitive)));
    middle
}
