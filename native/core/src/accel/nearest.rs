//! Who is whose nearest among neighbours in a list of boxes.

use super::record::Record;
use crate::{
    simd::{Kernel, Level, Simd},
    triangle::LANES,
};

/// Most boxes at once.
pub const MOST: usize = 1024;

/// How far to either side a box is compared with others. At most 15: see [`SIDES`].
const REACH: usize = 15;

/// Boxes whose distances are known at once: few, so that they stay in the nearest cache, but enough that none is read
/// back while it is still being written.
const STRIP: usize = 128;

/// Distances of as many boxes before the strip are known, too.
const FRONT: usize = 16;

/// The sides of a box that is near to none.
const FAR: f32 = -1e12;

/// A number of every box, with as much room behind the last as is read there.
type Column = [f32; MOST + 32];

/// A number of every box of a strip, and of those before it.
type Window = [f32; FRONT + STRIP];

/// Boxes, and the distances between them.
///
/// The distance of two boxes is the area of the box around both. Its last bits are replaced by those of the exclusive or
/// of both places, which is the same seen from either side: so the least distance of all is always mutual, also among
/// many equal ones, and the other's place is found from one's own.
#[derive(Debug)]
pub struct Neighbours {
    records: Vec<Record>,
    /// By column, as in [`Record::row`].
    planes: Box<[Column; 6]>,
    /// `distances[k][FRONT + i]` is that from box `i` of the strip to the `k + 1`th after it.
    distances: Box<[Window; REACH]>,
    least: Box<Column>,
    nearest: Vec<u16>,
}

/// The bits of a distance that tell a place.
const PLACE: u32 = 31;

/// The exclusive or of places `i` and `i + k + 1`, where `i` is `8 * phase + lane`: by phase, k and lane.
static SIDES: [[[f32; LANES]; REACH]; 4] = sides();

const fn sides() -> [[[f32; LANES]; REACH]; 4] {
    let mut table = [[[0.0; LANES]; REACH]; 4];
    let mut entry = 0;
    while entry < 4 * REACH * LANES {
        let (phase, k, lane) = (entry / (REACH * LANES), entry / LANES % REACH, entry % LANES);
        let place = phase * LANES + lane;
        table[phase][k][lane] = f32::from_bits((place ^ (place + k + 1)) as u32 & PLACE);
        entry += 1;
    }
    table
}

impl Default for Neighbours {
    fn default() -> Self {
        Self {
            records: Vec::new(),
            planes: bytemuck::allocation::zeroed_box(),
            distances: bytemuck::allocation::zeroed_box(),
            least: bytemuck::allocation::zeroed_box(),
            nearest: Vec::new(),
        }
    }
}

impl Neighbours {
    /// Find the nearest neighbour of each of at most [`MOST`] boxes.
    pub fn find(&mut self, records: &[Record], level: Level) {
        self.records.clear();
        self.records.extend_from_slice(records);
        let count = self.records.len();
        // Columns are filled by eight, and read to [`REACH`] beyond the last.
        self.records.resize(count.next_multiple_of(LANES) + 2 * LANES, Record { row: [FAR; LANES] });
        level.run(Find(self));
        self.records.truncate(count);
        self.nearest.clear();
        self.nearest.extend(self.least[..count].iter().enumerate().map(|(index, least)| other(index, *least)));
    }

    /// The boxes.
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// The nearest neighbour of a box whose nearest it is, too.
    #[inline(always)]
    pub fn mutual(&self, index: usize) -> Option<usize> {
        let nearest = usize::from(self.nearest[index]);
        (self.nearest.get(nearest).copied() == Some(index as u16)).then_some(nearest)
    }
}

/// Whose distance that is.
#[inline(always)]
fn other(index: usize, distance: f32) -> u16 {
    let place = (distance.to_bits() ^ index as u32) & PLACE;
    let ahead = place.wrapping_sub(index as u32) & PLACE;
    let behind = if ahead > REACH as u32 { PLACE + 1 } else { 0 };
    (index as u32).wrapping_add(ahead).wrapping_sub(behind) as u16
}

/// Eight entries of a column.
#[inline(always)]
fn at(column: &[f32], first: usize) -> &[f32; LANES] {
    column[first..].first_chunk().unwrap_or(&[f32::MAX; LANES])
}

struct Find<'a>(&'a mut Neighbours);

impl Kernel for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Neighbours { records, planes, distances, least, .. } = self.0;
        for (index, eight) in records.as_chunks::<LANES>().0.iter().enumerate() {
            columns(simd, eight, planes, index * LANES);
        }
        distances.iter_mut().for_each(|window| window[..FRONT].fill(f32::MAX));
        let end = records.len() - 2 * LANES;
        for strip in (0..end).step_by(STRIP) {
            let firsts = (strip..end.min(strip + STRIP)).step_by(LANES);
            for first in firsts.clone() {
                ahead(simd, planes, distances, least, first);
            }
            for first in firsts {
                behind(simd, distances, least, first);
            }
            distances.iter_mut().for_each(|window| window.copy_within(STRIP.., 0));
        }
    }
}

/// Where the distances of a box are in a window.
#[inline(always)]
fn place(index: usize) -> usize {
    FRONT + index % STRIP
}

/// Bring eight rows into columns.
#[inline(always)]
fn columns<S: Simd>(simd: S, rows: &[Record; LANES], planes: &mut [Column; 6], first: usize) {
    let columns = simd.transpose([
        simd.load(&rows[0].row),
        simd.load(&rows[1].row),
        simd.load(&rows[2].row),
        simd.load(&rows[3].row),
        simd.load(&rows[4].row),
        simd.load(&rows[5].row),
        simd.load(&rows[6].row),
        simd.load(&rows[7].row),
    ]);
    for plane in 0..6 {
        planes[plane][first..first + LANES].copy_from_slice(&simd.store(columns[plane + plane / 3]));
    }
}

/// Distances from eight boxes to those that follow each, and the least of them.
#[inline(always)]
fn ahead<S: Simd>(simd: S, planes: &[Column; 6], distances: &mut [Window; REACH], least: &mut Column, first: usize) {
    let own: [S::F32; 6] = std::array::from_fn(|plane| simd.load(at(&planes[plane], first)));
    let high = simd.splat(f32::from_bits(!PLACE));
    let sides = &SIDES[first / LANES % 4];
    let mut best = simd.splat(f32::MAX);
    for k in 0..REACH {
        let other = first + k + 1;
        let mut edges = own;
        for axis in 0..3 {
            let lower = simd.min(own[axis], simd.load(at(&planes[axis], other)));
            let upper = simd.min(own[3 + axis], simd.load(at(&planes[3 + axis], other)));
            edges[axis] = simd.add(lower, upper);
        }
        let [x, y, z, ..] = edges;
        let area = simd.add(simd.mul(x, simd.add(y, z)), simd.mul(y, z));
        let distance = simd.or(simd.and(area, high), simd.load(&sides[k]));
        best = simd.min(distance, best);
        distances[k][place(first)..][..LANES].copy_from_slice(&simd.store(distance));
    }
    least[first..first + LANES].copy_from_slice(&simd.store(best));
}

/// Let the boxes before eight boxes be their nearest, too.
#[inline(always)]
fn behind<S: Simd>(simd: S, distances: &[Window; REACH], least: &mut Column, first: usize) {
    let mut best = simd.load(at(least, first));
    for k in 0..REACH {
        best = simd.min(simd.load(at(&distances[k], place(first) - k - 1)), best);
    }
    least[first..first + LANES].copy_from_slice(&simd.store(best));
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::*;
    use crate::bounds::BoundsA;

    fn distance(records: &[Record], a: usize, b: usize) -> u32 {
        let row = std::array::from_fn(|lane| records[a].row[lane].min(records[b].row[lane]));
        let area = Record { row }.half_area();
        area.to_bits() & !PLACE | (a ^ b) as u32 & PLACE
    }

    #[test]
    fn nearest_are_those_of_all_within_reach() {
        let record = |index: usize, step: usize| {
            let lower = Vec3A::new((index * step % 64) as f32, (index * step % 16) as f32, 1.0);
            Record::new(&BoundsA { lower, upper: lower + Vec3A::new(2.0, 1.0, 4.0) }, index, 1)
        };
        for level in Level::available() {
            let mut neighbours = Neighbours::default();
            for (count, step) in [(300, 7), (MOST, 37), (2, 1), (1, 3), (77, 0)] {
                let records: Vec<Record> = (0..count).map(|index| record(index, step)).collect();
                neighbours.find(&records, level);
                let records = neighbours.records();
                assert_eq!(records.len(), count);
                for index in 0..count {
                    let reach = index.saturating_sub(REACH)..count.min(index + REACH + 1);
                    let others = reach.filter(|&other| other != index);
                    let nearest = others.min_by_key(|&other| distance(records, index, other));
                    if let Some(nearest) = nearest {
                        let found = usize::from(neighbours.nearest[index]);
                        assert_eq!(found, nearest, "{index} of {count}, {}", level.name());
                    }
                }
            }
        }
    }
}
