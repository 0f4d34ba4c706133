//! The binned surface area heuristic, after Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies",
//! RT 2007. The cost of a side is its area times the blocks of triangles it would fill, since blocks are what is
//! tested.

use rayon::prelude::*;

use super::{
    median,
    tree::{Item, Split},
};
use crate::{Job, bounds::Bounds, triangle::LANES};

/// Splits at the cheapest of the planes between bins along all axes.
#[derive(Debug, Clone, Copy)]
pub struct BinnedSah<'a> {
    /// Bins per axis, at most [`MOST_BINS`].
    pub bins: usize,
    /// May cancel large splits halfway.
    pub job: &'a Job,
}

/// More bins than this do not pay.
pub const MOST_BINS: usize = 32;

/// Below this depth medians are taken, which bounds the stack of every traversal.
pub(super) const MOST_DEPTH: usize = 64;

/// Larger sets of items are binned in parallel, in parts of this size.
const PART: usize = 1 << 15;

/// Items and the box around them.
#[derive(Clone, Copy)]
pub(super) struct Bin {
    pub(super) bounds: Bounds,
    pub(super) count: usize,
}

impl Bin {
    pub(super) const EMPTY: Self = Self { bounds: Bounds::EMPTY, count: 0 };

    pub(super) fn add(&mut self, other: &Self) {
        self.bounds = self.bounds.union(&other.bounds);
        self.count += other.count;
    }

    /// Expected work, up to a constant.
    pub(super) fn cost(&self) -> f32 {
        if self.count == 0 { 0.0 } else { self.bounds.half_area() * self.count.div_ceil(LANES) as f32 }
    }
}

type Bins = [[Bin; MOST_BINS]; 3];

/// How centroids map to bins: `(centroid - lower) * scale`, along each axis; scale 0 where all centroids agree.
pub(super) struct Mapping {
    lower: [f32; 3],
    scale: [f32; 3],
    last: usize,
}

/// A plane between bins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    axis: usize,
    bin: usize,
    /// Expected work, up to a constant.
    pub(super) cost: f32,
    /// The boxes of what lies on either side.
    pub(super) sides: [Bounds; 2],
}

impl Split for BinnedSah<'_> {
    fn split(&self, items: &mut [Item], depth: usize) -> usize {
        let plane = if depth < MOST_DEPTH { self.best_plane(items) } else { None };
        match plane {
            Some((plane, mapping)) => partition(items, |item| mapping.is_left(item, &plane)),
            None => median::halve(items, depth % 3, self.job),
        }
    }
}

impl BinnedSah<'_> {
    /// The cheapest plane, if items can be told apart at all.
    pub(super) fn best_plane(&self, items: &[Item]) -> Option<(Plane, Mapping)> {
        let mapping = Mapping::new(items, self.bins);
        let bins = if items.len() <= PART {
            mapping.fill(items)
        } else {
            items.par_chunks(PART).map(|part| mapping.fill(part)).reduce_with(merged)?
        };
        let axes = (0..3).filter(|&axis| mapping.scale[axis] > 0.0);
        let planes = axes.filter_map(|axis| cheapest(axis, &bins[axis][..self.bins]));
        let plane = planes.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some((plane, mapping))
    }
}

#[inline]
fn centroid(item: &Item, axis: usize) -> f32 {
    item.bounds.lower[axis] * 0.5 + item.bounds.upper[axis] * 0.5
}

impl Mapping {
    fn new(items: &[Item], bins: usize) -> Self {
        let around = |part: &[Item]| Bounds::of_points(part.iter().map(|item| item.bounds.centre()));
        let bounds = if items.len() <= PART {
            around(items)
        } else {
            items.par_chunks(PART).map(around).reduce(|| Bounds::EMPTY, |a, b| a.union(&b))
        };
        let scale = bounds.extent().to_array().map(|extent| {
            let scale = bins as f32 * (1.0 - 1e-6) / extent;
            if scale.is_finite() { scale } else { 0.0 }
        });
        Self { lower: bounds.lower.to_array(), scale, last: bins - 1 }
    }

    #[inline]
    fn bin(&self, item: &Item, axis: usize) -> usize {
        (((centroid(item, axis) - self.lower[axis]) * self.scale[axis]) as usize).min(self.last)
    }

    /// Whether an item lies before a plane.
    #[inline]
    pub(super) fn is_left(&self, item: &Item, plane: &Plane) -> bool {
        self.bin(item, plane.axis) < plane.bin
    }

    fn fill(&self, items: &[Item]) -> Bins {
        let mut bins = [[Bin::EMPTY; MOST_BINS]; 3];
        for item in items {
            for (axis, row) in bins.iter_mut().enumerate() {
                row[self.bin(item, axis)].add(&Bin { bounds: item.bounds, count: 1 });
            }
        }
        bins
    }
}

fn merged(mut a: Bins, b: Bins) -> Bins {
    for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
        a.add(b);
    }
    a
}

/// The cheapest plane along an axis with items on both of its sides.
fn cheapest(axis: usize, bins: &[Bin]) -> Option<Plane> {
    let mut rights = [Bin::EMPTY; MOST_BINS];
    let mut right = Bin::EMPTY;
    for bin in (1..bins.len()).rev() {
        right.add(&bins[bin]);
        rights[bin] = right;
    }
    let mut left = Bin::EMPTY;
    let planes = (1..bins.len()).filter_map(|bin| {
        left.add(&bins[bin - 1]);
        let (cost, right) = (left.cost() + rights[bin].cost(), &rights[bin]);
        let divides = left.count > 0 && right.count > 0 && cost.is_finite();
        divides.then_some(Plane { axis, bin, cost, sides: [left.bounds, right.bounds] })
    });
    planes.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// Put the items that `goes_left` first and count them.
pub(super) fn partition(items: &mut [Item], goes_left: impl Fn(&Item) -> bool) -> usize {
    let (mut begin, mut end) = (0, items.len());
    loop {
        while begin < end && goes_left(&items[begin]) {
            begin += 1;
        }
        while begin < end && !goes_left(&items[end - 1]) {
            end -= 1;
        }
        if begin == end {
            return begin;
        }
        items.swap(begin, end - 1);
    }
}
