//! Bins along three axes, and the cheapest of the planes between them by the surface area heuristic, after Wald, "On
//! fast Construction of SAH-based Bounding Volume Hierarchies", RT 2007. As for
//! [`BinnedSah`](super::sah::BinnedSah), the cost of a side is its area times the blocks it would fill.

use glam::Vec3A;

use super::record::Record;
use crate::{bounds::BoundsA, triangle::LANES};

/// Most bins along an axis.
pub const MOST: usize = 16;

/// How centres map to bins.
#[derive(Debug, Clone, Copy)]
pub struct Mapping {
    lower: Vec3A,
    /// 0 where all centres agree.
    scale: Vec3A,
}

impl Mapping {
    /// Of records to `bins` bins.
    pub fn new(records: &[Record], bins: usize) -> Self {
        Self::between(&Centres::of(records), bins)
    }

    /// Of centres in a box.
    #[inline(always)]
    pub fn between(centres: &Centres, bins: usize) -> Self {
        let scale = bins as f32 * (1.0 - 1e-6) / (centres.upper - centres.lower);
        Self { lower: centres.lower, scale: Vec3A::select(scale.cmple(Vec3A::splat(f32::MAX)), scale, Vec3A::ZERO) }
    }

    /// The bins of a centre, in the low bits: a number below 2^22 plus this constant has its integer there, and needs no
    /// instruction to convert it.
    #[inline(always)]
    fn bins(&self, centre: Vec3A) -> [usize; 3] {
        const INTEGER: f32 = (3 << 22) as f32;
        let shifted = (centre - self.lower) * self.scale - Vec3A::splat(0.5) + Vec3A::splat(INTEGER);
        shifted.to_array().map(|number| number.to_bits() as usize & (MOST - 1))
    }

    /// Whether a record lies before a plane.
    #[inline(always)]
    pub fn is_left(&self, record: &Record, plane: &Plane) -> bool {
        self.bins(record.centre())[plane.axis] < plane.bin
    }
}

/// The box around twice the centres of records.
pub type Centres = BoundsA;

impl Centres {
    /// Of some records.
    #[inline(always)]
    pub fn of(records: &[Record]) -> Self {
        records.iter().fold(Self::EMPTY, |all, record| {
            let centre = record.centre();
            all.union(&Self { lower: centre, upper: centre })
        })
    }
}

/// A place to divide records at.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// Across which axis.
    pub axis: usize,
    /// The first bin behind it.
    pub bin: usize,
    cost: f32,
}

/// A part of the records: the box around them, and how many triangles they are.
#[derive(Debug, Clone, Copy)]
pub struct Side {
    /// The box around them.
    pub bounds: BoundsA,
    /// Their triangles.
    pub count: u32,
}

impl Side {
    const EMPTY: Self = Self { bounds: BoundsA::EMPTY, count: 0 };

    /// Take in more.
    #[inline(always)]
    fn add(&mut self, bounds: &BoundsA, count: u32) {
        self.bounds = self.bounds.union(bounds);
        self.count += count;
    }

    /// Expected work, up to a constant; not a number where there are no triangles.
    #[inline(always)]
    fn cost(&self) -> f32 {
        self.bounds.half_area() * self.count.div_ceil(LANES as u32) as f32
    }

    /// Both together.
    pub fn of(records: &[Record]) -> Self {
        records.iter().fold(Self::EMPTY, |mut side, record| {
            side.add(&record.bounds(), record.count());
            side
        })
    }
}

/// Bins of records along all axes, reused from node to node.
#[derive(Debug, Clone)]
pub struct Bins {
    bins: [[Side; MOST]; 3],
    used: usize,
}

impl Bins {
    /// Nothing in them.
    pub const EMPTY: Self = Self { bins: [[Side::EMPTY; MOST]; 3], used: MOST };

    /// Put records into `used` bins along every axis.
    #[inline(always)]
    pub fn fill(&mut self, records: &[Record], mapping: &Mapping, used: usize) {
        self.used = used;
        self.bins.iter_mut().for_each(|axis| axis[..used].fill(Side::EMPTY));
        for record in records {
            let (places, bounds, count) = (mapping.bins(record.centre()), record.bounds(), record.count());
            for axis in 0..3 {
                self.bins[axis][places[axis]].add(&bounds, count);
            }
        }
    }

    /// Together with what is in as many other bins.
    pub fn with(mut self, other: Self) -> Self {
        for (mine, theirs) in self.bins.iter_mut().flatten().zip(other.bins.iter().flatten()) {
            mine.add(&theirs.bounds, theirs.count);
        }
        self
    }

    /// The cheapest plane with records on both of its sides.
    #[inline(always)]
    pub fn cheapest(&self) -> Option<Plane> {
        let mut best = Plane { axis: 0, bin: 0, cost: f32::INFINITY };
        for axis in 0..3 {
            self.sweep(axis, &mut best);
        }
        (best.bin > 0).then_some(best)
    }

    /// A side without triangles has infinite extents and no blocks, so that its cost is not a number, and less than none.
    #[inline(always)]
    fn sweep(&self, axis: usize, best: &mut Plane) {
        let bins = &self.bins[axis][..self.used];
        let (mut right_costs, mut right) = ([0.0; MOST], Side::EMPTY);
        for bin in (1..bins.len()).rev() {
            right.add(&bins[bin].bounds, bins[bin].count);
            right_costs[bin] = right.cost();
        }
        let mut left = Side::EMPTY;
        for bin in 1..bins.len() {
            left.add(&bins[bin - 1].bounds, bins[bin - 1].count);
            let cost = left.cost() + right_costs[bin];
            if cost < best.cost {
                *best = Plane { axis, bin, cost };
            }
        }
    }

    /// What lies on either side of a plane.
    #[inline(always)]
    pub fn sides(&self, plane: &Plane) -> [Side; 2] {
        let bins = &self.bins[plane.axis][..self.used];
        [&bins[..plane.bin], &bins[plane.bin..]].map(|part| {
            let mut side = Side::EMPTY;
            part.iter().for_each(|bin| side.add(&bin.bounds, bin.count));
            side
        })
    }
}
