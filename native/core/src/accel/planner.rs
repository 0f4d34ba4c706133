//! The binned surface area heuristic over records, which move between two buffers, so that a division is one pass without
//! a branch.

use rayon::prelude::*;

use super::{
    bins::{self, Bins, Centres, Mapping, Plane, Side},
    record::Record,
};
use crate::{
    simd::{Kernel, Level, Simd},
    triangle::LANES,
};

/// What is left to decide on: records, as much room again, and what they are together.
#[derive(Debug)]
pub struct Set<'r> {
    records: &'r mut [Record],
    spare: &'r mut [Record],
    depth: usize,
    side: Side,
}

impl<'r> Set<'r> {
    /// All of some records; there must be as much spare room or more.
    pub fn new(records: &'r mut [Record], spare: &'r mut [Record]) -> Self {
        let (side, spare) = (Side::of(records), &mut spare[..records.len()]);
        Self { records, spare, depth: 0, side }
    }

    /// How many triangles it has.
    pub fn count(&self) -> usize {
        self.side.count as usize
    }

    /// Half of the area of the box around them.
    pub fn half_area(&self) -> f32 {
        self.side.half_area()
    }

    /// Its area where it may be divided; less than none where it has at most `whole` triangles.
    #[inline(always)]
    fn priority(&self, whole: usize) -> f32 {
        if self.count() <= whole { -1.0 } else { self.half_area() }
    }

    /// Its records.
    pub fn records(&self) -> &[Record] {
        self.records
    }

    /// Its records, for as long as they live.
    pub fn into_records(self) -> &'r [Record] {
        self.records
    }

    /// The first `middle` records, on `left`, and the others.
    #[inline(always)]
    fn split(self, middle: usize, [left, right]: [Side; 2]) -> [Self; 2] {
        let (records, spare) = (self.records.split_at_mut(middle), self.spare.split_at_mut(middle));
        let depth = self.depth + 1;
        [
            Self { records: records.0, spare: spare.0, depth, side: left },
            Self { records: records.1, spare: spare.1, depth, side: right },
        ]
    }
}

/// Below this depth of divisions records are halved as they stand, which bounds the stack of every traversal.
pub const MOST_DEPTH: usize = 64;

/// Larger sets are put into bins in parallel, in parts of this size.
const PART: usize = 1 << 14;

/// Bins for a number of records: few records do not need the sixteen that Wald finds enough, and clearing and sweeping
/// bins is most of the work for them. Measured, against sixteen always: the same cost of the tree to 0.5%, in 0.8 of the
/// time; with 4 + n / 32, up to 3% more, as leaves are filled less well.
#[inline(always)]
fn bins_for(records: usize) -> usize {
    bins::MOST.min(8 + records / 16)
}

/// Up to eight parts of a set, side by side: whichever has the largest box is divided first, those of at most `whole`
/// triangles never. After Wald, Benthin and Boulos, "Getting Rid of Packets", RT 2008.
pub fn open<'r>(set: Set<'r>, whole: usize, bins: &mut Bins, level: Level) -> [Option<Set<'r>>; LANES] {
    level.run(Open { set, whole, bins })
}

struct Open<'r, 'b> {
    set: Set<'r>,
    whole: usize,
    bins: &'b mut Bins,
}

impl<'r> Kernel for Open<'r, '_> {
    type Output = [Option<Set<'r>>; LANES];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let mut parts = [const { None::<Set<'r>> }; LANES];
        let mut areas = [-1.0; LANES];
        areas[0] = f32::MAX;
        parts[0] = Some(self.set);
        for count in 1..LANES {
            let mut largest = 0;
            for lane in 1..count {
                largest = if areas[lane] > areas[largest] { lane } else { largest };
            }
            if areas[largest] < 0.0 {
                break;
            }
            let Some(set) = parts[largest].take() else { break };
            let [left, right] = divide(simd, set, self.bins);
            (areas[largest], areas[count]) = (left.priority(self.whole), right.priority(self.whole));
            (parts[largest], parts[count]) = (Some(left), Some(right));
        }
        parts
    }
}

/// Both parts of a set of at least two records.
pub fn halve<'r>(set: Set<'r>, bins: &mut Bins, level: Level) -> [Set<'r>; 2] {
    level.run(Halve { set, bins })
}

struct Halve<'r, 'b> {
    set: Set<'r>,
    bins: &'b mut Bins,
}

impl<'r> Kernel for Halve<'r, '_> {
    type Output = [Set<'r>; 2];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        divide(simd, self.set, self.bins)
    }
}

/// Both parts of a set of at least two records.
#[inline(always)]
pub fn divide<'r, S: Simd>(simd: S, set: Set<'r>, bins: &mut Bins) -> [Set<'r>; 2] {
    let plane = if set.depth < MOST_DEPTH { best_plane(simd, set.records, bins) } else { None };
    match plane {
        Some((plane, mapping)) => {
            let middle = partition(simd, set.records, set.spare, &plane, &mapping);
            let set = Set { records: set.spare, spare: set.records, ..set };
            set.split(middle, bins.sides(simd, &plane))
        }
        None => {
            let middle = set.records.len() / 2;
            let sides = [Side::of(&set.records[..middle]), Side::of(&set.records[middle..])];
            set.split(middle, sides)
        }
    }
}

#[inline(always)]
fn best_plane<S: Simd>(simd: S, records: &[Record], bins: &mut Bins) -> Option<(Plane, Mapping)> {
    let used = bins_for(records.len());
    let mapping = if records.len() <= PART {
        let mapping = Mapping::between(&Centres::of(records), used);
        bins.fill(simd, records, &mapping, used);
        mapping
    } else {
        fill_parallel(simd, records, bins, used)
    };
    Some((bins.cheapest()?, mapping))
}

fn fill_parallel<S: Simd>(simd: S, records: &[Record], bins: &mut Bins, used: usize) -> Mapping {
    let parts = records.par_chunks(PART);
    let both = |a: Centres, b: Centres| a.union(&b);
    let mapping = Mapping::between(&parts.clone().map(Centres::of).reduce(|| Centres::EMPTY, both), used);
    let filled = parts.map(|part| {
        let mut bins = Bins::EMPTY;
        simd.run(Fill { bins: &mut bins, part, mapping: &mapping, used });
        bins
    });
    *bins = filled.reduce_with(Bins::with).unwrap_or(Bins::EMPTY);
    mapping
}

struct Fill<'a> {
    bins: &'a mut Bins,
    part: &'a [Record],
    mapping: &'a Mapping,
    used: usize,
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.bins.fill(simd, self.part, self.mapping, self.used);
    }
}

/// Copy what lies before a plane to the front and the rest, backwards, to the end; returns how many went to the front.
/// Both places are written to, so that nothing depends on a branch that nobody can predict, and by vectors: a record that
/// is copied as such goes through memory first.
#[inline(always)]
fn partition<S: Simd>(simd: S, from: &[Record], to: &mut [Record], plane: &Plane, mapping: &Mapping) -> usize {
    let (mut left, mut right) = (0, from.len());
    let (lower, scale) = mapping.along(plane.axis);
    for record in from {
        let row = simd.load(&record.row);
        to[left].row = simd.store(row);
        to[right - 1].row = simd.store(row);
        let is_left = Mapping::is_left(lower, scale, record, plane);
        left += usize::from(is_left);
        right -= usize::from(!is_left);
    }
    left
}
