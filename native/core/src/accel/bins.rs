//! Bins along three axes, and the cheapest of the planes between them by the surface area heuristic, after Wald, "On
//! fast Construction of SAH-based Bounding Volume Hierarchies", RT 2007. As for
//! [`BinnedSah`](super::sah::BinnedSah), the cost of a side is its area times the blocks it would fill.

use glam::Vec3A;

use super::record::{Record, half_area};
use crate::{bounds::BoundsA, simd::Simd, triangle::LANES};

/// Most bins along an axis.
pub const MOST: usize = 16;

/// How centres map to bins.
#[derive(Debug, Clone, Copy)]
pub struct Mapping {
    lower: Vec3A,
    /// 0 where all centres agree.
    scale: Vec3A,
}

/// A number below 2^22 plus this constant has its integer in the low bits, and needs no instruction to convert it.
const INTEGER: f32 = (3 << 22) as f32;

/// The box around twice the centres of records.
pub type Centres = BoundsA;

impl Centres {
    /// Of some records.
    #[inline(always)]
    pub fn of(records: &[Record]) -> Self {
        let mut all = Self::EMPTY;
        for record in records {
            let centre = record.centre();
            all = all.union(&Self { lower: centre, upper: centre });
        }
        all
    }
}

impl Mapping {
    /// Of centres in a box to `bins` bins.
    #[inline(always)]
    pub fn between(centres: &Centres, bins: usize) -> Self {
        let scale = bins as f32 * (1.0 - 1e-6) / (centres.upper - centres.lower);
        Self { lower: centres.lower, scale: Vec3A::select(scale.cmple(Vec3A::splat(f32::MAX)), scale, Vec3A::ZERO) }
    }

    #[inline(always)]
    fn bins(&self, record: &Record) -> [usize; 3] {
        let place = (record.centre() - self.lower) * self.scale - Vec3A::splat(0.5) + Vec3A::splat(INTEGER);
        place.to_array().map(|place| place.to_bits() as usize & (MOST - 1))
    }

    /// Whether a record lies before a plane: along its axis, the arithmetic of [`Mapping::bins`].
    #[inline(always)]
    pub fn is_left(lower: f32, scale: f32, record: &Record, plane: &Plane) -> bool {
        let place = (record.centre_along(plane.axis) - lower) * scale - 0.5 + INTEGER;
        (place.to_bits() as usize & (MOST - 1)) < plane.bin
    }

    /// Where bins begin along an axis, and how many there are to a unit.
    #[inline(always)]
    pub fn along(&self, axis: usize) -> (f32, f32) {
        (self.lower[axis], self.scale[axis])
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

/// A part of the records: the box around them, as in [`Record::row`], and how many triangles they are.
#[derive(Debug, Clone, Copy)]
pub struct Side {
    row: [f32; LANES],
    /// Their triangles.
    pub count: u32,
}

impl Side {
    const EMPTY: Self = Self { row: Record::NONE.row, count: 0 };

    #[inline(always)]
    fn add(&mut self, row: &[f32; LANES], count: u32) {
        for lane in 0..LANES {
            self.row[lane] = self.row[lane].min(row[lane]);
        }
        self.count += count;
    }

    /// Half the surface area of the box.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        half_area(&self.row)
    }

    /// All of some records.
    pub fn of(records: &[Record]) -> Self {
        let mut side = Self::EMPTY;
        records.iter().for_each(|record| side.add(&record.row, record.count()));
        side
    }
}

/// Expected work, up to a constant; not a number where there are no triangles.
#[inline(always)]
fn cost(row: &[f32; LANES], count: u32) -> f32 {
    half_area(row) * count.div_ceil(LANES as u32) as f32
}

/// Bins of records along all axes, reused from node to node.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
pub struct Bins {
    rows: [[[f32; LANES]; 3]; MOST],
    counts: [[u32; 3]; MOST],
    used: usize,
}

impl Bins {
    /// Nothing in them.
    pub const EMPTY: Self = Self { rows: [[Record::NONE.row; 3]; MOST], counts: [[0; 3]; MOST], used: MOST };

    /// Put records into `used` bins along every axis.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, records: &[Record], mapping: &Mapping, used: usize) {
        self.used = used;
        self.rows[..used].fill([Record::NONE.row; 3]);
        self.counts[..used].fill([0; 3]);
        for record in records {
            let (places, row, count) = (mapping.bins(record), simd.load(&record.row), record.count());
            for axis in 0..3 {
                let bin = &mut self.rows[places[axis]][axis];
                *bin = simd.store(simd.min(simd.load(bin), row));
                self.counts[places[axis]][axis] += count;
            }
        }
    }

    /// Together with what is in as many other bins.
    pub fn with(mut self, other: Self) -> Self {
        for (mine, theirs) in self.rows.iter_mut().flatten().zip(other.rows.iter().flatten()) {
            *mine = std::array::from_fn(|lane| mine[lane].min(theirs[lane]));
        }
        for (mine, theirs) in self.counts.iter_mut().flatten().zip(other.counts.iter().flatten()) {
            *mine += theirs;
        }
        self
    }

    /// The cheapest plane with records on both of its sides: a side without triangles has infinite extents and no
    /// blocks, so that its cost is not a number, and less than none.
    #[inline(always)]
    pub fn cheapest<S: Simd>(&self, simd: S) -> Option<Plane> {
        let right_costs = self.right_costs(simd);
        let mut best = Plane { axis: 0, bin: 0, cost: f32::INFINITY };
        let (mut left, mut counts) = ([simd.splat(f32::INFINITY); 3], [0; 3]);
        for bin in 1..self.used {
            for axis in 0..3 {
                left[axis] = simd.min(left[axis], simd.load(&self.rows[bin - 1][axis]));
                counts[axis] += self.counts[bin - 1][axis];
                let cost = cost(&simd.store(left[axis]), counts[axis]) + right_costs[bin][axis];
                if cost < best.cost {
                    best = Plane { axis, bin, cost };
                }
            }
        }
        (best.bin > 0).then_some(best)
    }

    /// The cost of what lies from each bin on.
    #[inline(always)]
    fn right_costs<S: Simd>(&self, simd: S) -> [[f32; 3]; MOST] {
        let mut costs = [[0.0; 3]; MOST];
        let (mut right, mut counts) = ([simd.splat(f32::INFINITY); 3], [0; 3]);
        for bin in (1..self.used).rev() {
            for axis in 0..3 {
                right[axis] = simd.min(right[axis], simd.load(&self.rows[bin][axis]));
                counts[axis] += self.counts[bin][axis];
                costs[bin][axis] = cost(&simd.store(right[axis]), counts[axis]);
            }
        }
        costs
    }

    /// What lies on either side of a plane.
    #[inline(always)]
    pub fn sides(&self, plane: &Plane) -> [Side; 2] {
        let mut sides = [Side::EMPTY; 2];
        for bin in 0..self.used {
            sides[usize::from(bin >= plane.bin)].add(&self.rows[bin][plane.axis], self.counts[bin][plane.axis]);
        }
        sides
    }
}
