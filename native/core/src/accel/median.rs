//! Object-median splits along cycling axes: the benchmark of Zhang and Chiu, "Building a Hybrid Approach to Space
//! Division for Faster Raytracing"; the median of Kay and Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986.

use std::cmp::Ordering;

use super::tree::{Item, Split};
use crate::Job;

/// Splits at the median centroid, along x at the root, then y, then z, and so on.
#[derive(Debug, Clone, Copy)]
pub struct CyclingMedian<'a> {
    /// May cancel large splits halfway.
    pub job: &'a Job,
}

impl Split for CyclingMedian<'_> {
    fn split(&self, items: &mut [Item], depth: usize) -> usize {
        halve(items, depth % 3, self.job)
    }
}

/// Items that are gone through between two looks at the job: some milliseconds.
const STEP: usize = 1 << 20;

/// Put the half of the items with the lesser centroids first; ties go by primitive, so the halves are unique. Where the
/// job is cancelled meanwhile they are not halves of any kind.
pub fn halve(items: &mut [Item], axis: usize, job: &Job) -> usize {
    let middle = items.len() / 2;
    let centroid = |item: &Item| item.bounds.lower[axis] + item.bounds.upper[axis];
    let order = |a: &Item, b: &Item| centroid(a).total_cmp(&centroid(b)).then_with(|| a.primitive.cmp(&b.primitive));
    let (mut begin, mut end) = (0, items.len());
    while end - begin > STEP {
        let pivot = median_of_some(&items[begin..end], order);
        let below = begin + partition(&mut items[begin..end], |item| order(item, &pivot).is_lt(), job);
        if job.is_cancelled() {
            return middle;
        }
        (begin, end) = if middle < below { (begin, below) } else { (below, end) };
    }
    items[begin..end].select_nth_unstable_by(middle - begin, order);
    middle
}

/// The median of some evenly spaced items: never the least of all, so that every partition by it leaves less to search.
fn median_of_some(items: &[Item], order: impl Fn(&Item, &Item) -> Ordering) -> Item {
    const SOME: usize = 63;
    let mut some: [Item; SOME] = std::array::from_fn(|i| items[i * (items.len() / SOME)]);
    *some.select_nth_unstable_by(SOME / 2, order).1
}

/// Put the items that `goes_left` first and count them, unless the job is cancelled.
fn partition(items: &mut [Item], goes_left: impl Fn(&Item) -> bool, job: &Job) -> usize {
    let mut count = 0;
    for first in (0..items.len()).step_by(STEP) {
        if job.is_cancelled() {
            break;
        }
        for index in first..items.len().min(first + STEP) {
            if goes_left(&items[index]) {
                items.swap(index, count);
                count += 1;
            }
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bounds::Bounds;

    /// Items in no order, many of them with equal centroids.
    fn items(count: usize) -> Vec<Item> {
        let place = |i: usize| Vec3::splat(((i * 7919) % (count / 3 + 1)) as f32);
        let bounds = |i| Bounds { lower: place(i), upper: place(i) };
        (0..count).map(|i| Item { bounds: bounds(i), primitive: i as u32 }).collect()
    }

    #[test]
    fn halves_are_those_of_a_full_sort() {
        for count in [2, 3, 100, 2 * STEP + STEP / 2 + 1] {
            let (mut halved, mut sorted) = (items(count), items(count));
            let middle = halve(&mut halved, 1, &Job::new());
            sorted.sort_by(|a, b| a.bounds.lower.y.total_cmp(&b.bounds.lower.y).then(a.primitive.cmp(&b.primitive)));
            let ids = |part: &[Item]| {
                let mut ids: Vec<u32> = part.iter().map(|item| item.primitive).collect();
                ids.sort_unstable();
                ids
            };
            assert_eq!(middle, count / 2);
            assert_eq!(ids(&halved[..middle]), ids(&sorted[..middle]));
            assert_eq!(ids(&halved[middle..]), ids(&sorted[middle..]));
        }
    }

    #[test]
    fn a_cancelled_split_loses_nothing() {
        let (mut items, job) = (items(STEP + 9), Job::new());
        job.cancel();
        halve(&mut items, 0, &job);
        let mut ids: Vec<u32> = items.iter().map(|item| item.primitive).collect();
        ids.sort_unstable();
        assert!(ids.into_iter().eq(0..STEP as u32 + 9));
    }
}
