//! Bins along three axes, and the cheapest of the planes between them by the surface area heuristic, after Wald, "On
//! fast Construction of SAH-based Bounding Volume Hierarchies", RT 2007. As for
//! [`BinnedSah`](super::sah::BinnedSah), the cost of a side is its area times the blocks it would fill.

use glam::{Mat4, Vec3A, Vec4};

use super::record::{Record, half_area, halves};
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

/// A place from 0 to 2^16 plus this constant has its integer from bit [`POINT`] on: no instruction is needed to convert
/// it, nor to multiply it by the size of a [`Bin`].
const INTEGER: f32 = (3 << 16) as f32;
const POINT: u32 = 6;

/// Of a place to which [`INTEGER`] was added.
#[inline(always)]
fn bin_of(place: f32) -> usize {
    (place.to_bits() >> POINT) as usize & (MOST - 1)
}

/// The box around twice the centres of records.
pub type Centres = BoundsA;

impl Centres {
    /// Of some records.
    #[inline(always)]
    pub fn of(records: &[Record]) -> Self {
        let add = |all: Self, record: &Record| {
            let centre = record.centre();
            all.union(&Self { lower: centre, upper: centre })
        };
        // Two chains, as each step waits for the one before it.
        let (pairs, rest) = records.as_chunks::<2>();
        let mut all = [rest.iter().fold(Self::EMPTY, add), Self::EMPTY];
        for pair in pairs {
            all = [add(all[0], &pair[0]), add(all[1], &pair[1])];
        }
        all[0].union(&all[1])
    }
}

impl Mapping {
    /// Of centres in a box to `bins` bins.
    #[inline(always)]
    pub fn between(centres: &Centres, bins: usize) -> Self {
        // Places are rounded to 1/64, by [`POINT`], and none may be rounded up to `bins`, of which there are 16 at most.
        let scale = bins as f32 * (1.0 - 1.0 / 256.0) / (centres.upper - centres.lower);
        Self { lower: centres.lower, scale: Vec3A::select(scale.cmple(Vec3A::splat(f32::MAX)), scale, Vec3A::ZERO) }
    }

    #[inline(always)]
    fn bins(&self, record: &Record) -> [usize; 3] {
        let place = (record.centre() - self.lower) * self.scale + Vec3A::splat(INTEGER);
        place.to_array().map(bin_of)
    }

    /// Whether a record lies before a plane: along its axis, the arithmetic of [`Mapping::bins`].
    #[inline(always)]
    pub fn is_left(lower: f32, scale: f32, record: &Record, plane: &Plane) -> bool {
        bin_of((record.centre_along(plane.axis) - lower) * scale + INTEGER) < plane.bin
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
        let ([lower, upper], [other_lower, other_upper]) = (halves(&self.row), halves(row));
        self.row = bytemuck::cast([lower.min(other_lower), upper.min(other_upper)]);
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

/// What lies on one side of a plane, along each of the three axes.
#[derive(Debug, Clone, Copy)]
struct Swept {
    lower: [Vec4; 3],
    upper: [Vec4; 3],
    counts: [u32; 4],
}

impl Swept {
    const EMPTY: Self = Self { lower: [Vec4::INFINITY; 3], upper: [Vec4::INFINITY; 3], counts: [0; 4] };

    #[inline(always)]
    fn add(&mut self, bins: [&Side; 3]) {
        for axis in 0..3 {
            let [lower, upper] = halves(&bins[axis].row);
            (self.lower[axis], self.upper[axis]) = (self.lower[axis].min(lower), self.upper[axis].min(upper));
            self.counts[axis] += bins[axis].count;
        }
    }

    /// Expected work by axis, up to a constant; not a number where there are no triangles, and behind the last axis.
    #[inline(always)]
    fn cost(&self) -> Vec4 {
        let (lower, upper) = (&self.lower, &self.upper);
        let extents = [lower[0] + upper[0], lower[1] + upper[1], lower[2] + upper[2]];
        let Mat4 { x_axis: x, y_axis: y, z_axis: z, .. } =
            Mat4::from_cols(extents[0], extents[1], extents[2], Vec4::INFINITY).transpose();
        let mut blocks = [0.0; 4];
        for axis in 0..4 {
            blocks[axis] = ((self.counts[axis] + LANES as u32 - 1) >> LANES.ilog2()) as i32 as f32;
        }
        (x * (y + z) + y * z) * Vec4::from_array(blocks)
    }
}

/// Bins of records along all axes, reused from node to node.
#[derive(Debug, Clone)]
pub struct Bins {
    bins: [[Bin; MOST]; 3],
    used: usize,
}

/// What is in a bin, in a line of its own, so that finding a bin takes no multiplication.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Bin(Side);

impl Bins {
    /// Nothing in them.
    pub const EMPTY: Self = Self { bins: [[Bin(Side::EMPTY); MOST]; 3], used: MOST };

    /// Put records into `used` bins along every axis, from each quarter of them in turns: neighbours are often in the same
    /// bin, which is not to be read soon after it was written.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, records: &[Record], mapping: &Mapping, used: usize) {
        self.used = used;
        for axis in &mut self.bins {
            axis[..used].fill(Bin(Side::EMPTY));
        }
        let quarter = records.len() / 4;
        for index in 0..quarter {
            for part in 0..4 {
                self.add(simd, &records[part * quarter + index], mapping);
            }
        }
        for record in &records[4 * quarter..] {
            self.add(simd, record, mapping);
        }
    }

    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, record: &Record, mapping: &Mapping) {
        let (places, row, count) = (mapping.bins(record), simd.load(&record.row), record.count());
        for axis in 0..3 {
            let Bin(side) = &mut self.bins[axis][places[axis]];
            side.row = simd.store(simd.min(simd.load(&side.row), row));
            side.count += count;
        }
    }

    /// Together with what is in as many other bins.
    pub fn with(mut self, other: Self) -> Self {
        for (mine, theirs) in self.bins.iter_mut().flatten().zip(other.bins.iter().flatten()) {
            mine.0.add(&theirs.0.row, theirs.0.count);
        }
        self
    }

    /// The bins with a number.
    #[inline(always)]
    fn along(&self, bin: usize) -> [&Side; 3] {
        let [x, y, z] = &self.bins;
        [&x[bin].0, &y[bin].0, &z[bin].0]
    }

    /// The cheapest plane with records on both of its sides: a side without triangles has infinite extents and no
    /// blocks, so that its cost is not a number, and less than none.
    #[inline(always)]
    pub fn cheapest(&self) -> Option<Plane> {
        let right_costs = self.right_costs();
        let (mut left, mut least, mut bins) = (Swept::EMPTY, Vec4::INFINITY, Vec4::ZERO);
        for bin in 1..self.used {
            left.add(self.along(bin - 1));
            let cost = left.cost() + right_costs[bin];
            let is_less = cost.cmplt(least);
            least = Vec4::select(is_less, cost, least);
            bins = Vec4::select(is_less, Vec4::splat(bin as f32), bins);
        }
        let mut best = Plane { axis: 0, bin: 0, cost: f32::INFINITY };
        for axis in 0..3 {
            let plane = Plane { axis, bin: bins[axis] as usize, cost: least[axis] };
            if plane.cost < best.cost || plane.cost == best.cost && plane.bin < best.bin {
                best = plane;
            }
        }
        (best.bin > 0).then_some(best)
    }

    /// The cost of what lies from each bin on.
    #[inline(always)]
    fn right_costs(&self) -> [Vec4; MOST] {
        let (mut costs, mut right) = ([Vec4::ZERO; MOST], Swept::EMPTY);
        for bin in (1..self.used).rev() {
            right.add(self.along(bin));
            costs[bin] = right.cost();
        }
        costs
    }

    /// What lies on either side of a plane.
    #[inline(always)]
    pub fn sides<S: Simd>(&self, simd: S, plane: &Plane) -> [Side; 2] {
        let (mut rows, mut counts) = ([simd.splat(f32::INFINITY); 2], [0; 2]);
        let (left, right) = self.bins[plane.axis][..self.used].split_at(plane.bin);
        for (k, bins) in [left, right].into_iter().enumerate() {
            for Bin(side) in bins {
                rows[k] = simd.min(rows[k], simd.load(&side.row));
                counts[k] += side.count;
            }
        }
        [Side { row: simd.store(rows[0]), count: counts[0] }, Side { row: simd.store(rows[1]), count: counts[1] }]
    }
}
