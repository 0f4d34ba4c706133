//! Who is whose nearest among neighbours in a list of boxes.

use crate::{
    bounds::BoundsA,
    simd::{Kernel, Level, Simd},
    triangle::LANES,
};
use glam::Vec3A;

/// Most boxes at once.
pub const MOST: usize = 1024;

/// How far to either side a box is compared with others. At most 15: see [`SIDES`].
const REACH: usize = 15;

/// Columns begin with as many entries before the first box as are read there, and end with as many behind the last.
const ROOM: usize = 16 + MOST + 32;
const FRONT: usize = 16;

/// A box that is near to none.
const FAR: f32 = 1e12;

type Column = [f32; ROOM];

/// Boxes by column, and the distances between them.
///
/// The distance of two boxes is the area of the box around both. Its last bits are replaced by those of the exclusive or
/// of both places, which is the same seen from either side: so the least distance of all is always mutual, also among
/// many equal ones, and the other's place is found from one's own.
#[derive(Debug)]
pub struct Neighbours {
    count: usize,
    planes: Box<[Column; 6]>,
    /// `distances[k][i]` is that from box `i` to box `i + k + 1`.
    distances: Box<[Column; REACH]>,
    nearest: Box<Column>,
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
            count: 0,
            planes: Box::new([[0.0; ROOM]; 6]),
            distances: Box::new([[f32::MAX; ROOM]; REACH]),
            nearest: Box::new([0.0; ROOM]),
        }
    }
}

impl Neighbours {
    /// Forget all boxes.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Add a box behind the last; there may be [`MOST`].
    #[inline(always)]
    pub fn push(&mut self, bounds: &BoundsA) {
        self.set(self.count, bounds);
        self.count += 1;
    }

    #[inline(always)]
    fn set(&mut self, index: usize, bounds: &BoundsA) {
        for k in 0..3 {
            self.planes[k][FRONT + index] = bounds.lower[k];
            self.planes[3 + k][FRONT + index] = bounds.upper[k];
        }
    }

    /// A box.
    #[inline(always)]
    pub fn bounds(&self, index: usize) -> BoundsA {
        let corner = |first: usize| Vec3A::from_array(std::array::from_fn(|k| self.planes[first + k][FRONT + index]));
        BoundsA { lower: corner(0), upper: corner(3) }
    }

    /// Find the nearest neighbour of every box.
    pub fn find(&mut self, level: Level) {
        let nowhere = BoundsA { lower: Vec3A::splat(-FAR), upper: Vec3A::splat(FAR) };
        (self.count..self.count + 24).for_each(|index| self.set(index, &nowhere));
        level.run(Find(self));
    }

    /// The nearest neighbour of a box whose nearest it is, too.
    #[inline(always)]
    pub fn mutual(&self, index: usize) -> Option<usize> {
        let nearest = self.nearest(index);
        (nearest < self.count && self.nearest(nearest) == index).then_some(nearest)
    }

    #[inline(always)]
    fn nearest(&self, index: usize) -> usize {
        let place = (self.nearest[FRONT + index].to_bits() ^ index as u32) & PLACE;
        let ahead = place.wrapping_sub(index as u32) & PLACE;
        let distance = if ahead > REACH as u32 { ahead.wrapping_sub(PLACE + 1) } else { ahead };
        index.wrapping_add_signed(distance as i32 as isize)
    }
}

/// Eight entries of a column.
#[inline(always)]
fn at(column: &Column, first: usize) -> &[f32; LANES] {
    column[first..].first_chunk().unwrap_or(&[f32::MAX; LANES])
}

struct Find<'a>(&'a mut Neighbours);

impl Kernel for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Neighbours { count, planes, distances, nearest } = self.0;
        let end = FRONT + *count;
        for first in (FRONT..end).step_by(LANES) {
            ahead(simd, planes, distances, nearest, first);
        }
        for first in (FRONT..end).step_by(LANES) {
            behind(simd, distances, nearest, first);
        }
    }
}

/// Distances from eight boxes to those that follow each, and the least of them.
#[inline(always)]
fn ahead<S: Simd>(simd: S, planes: &[Column; 6], distances: &mut [Column; REACH], nearest: &mut Column, first: usize) {
    let own: [S::F32; 6] = std::array::from_fn(|plane| simd.load(at(&planes[plane], first)));
    let high = simd.splat(f32::from_bits(!PLACE));
    let sides = &SIDES[(first - FRONT) / LANES % 4];
    let mut best = simd.splat(f32::MAX);
    for k in 0..REACH {
        let other = first + k + 1;
        let mut edges = own;
        for axis in 0..3 {
            let lower = simd.min(own[axis], simd.load(at(&planes[axis], other)));
            let upper = simd.max(own[3 + axis], simd.load(at(&planes[3 + axis], other)));
            edges[axis] = simd.sub(upper, lower);
        }
        let [x, y, z, ..] = edges;
        let area = simd.add(simd.mul(x, simd.add(y, z)), simd.mul(y, z));
        let distance = simd.or(simd.and(area, high), simd.load(&sides[k]));
        best = simd.min(distance, best);
        distances[k][first..first + LANES].copy_from_slice(&simd.store(distance));
    }
    nearest[first..first + LANES].copy_from_slice(&simd.store(best));
}

/// Let the boxes before eight boxes be their nearest, too.
#[inline(always)]
fn behind<S: Simd>(simd: S, distances: &[Column; REACH], nearest: &mut Column, first: usize) {
    let mut best = simd.load(at(nearest, first));
    for k in 0..REACH {
        best = simd.min(simd.load(at(&distances[k], first - k - 1)), best);
    }
    nearest[first..first + LANES].copy_from_slice(&simd.store(best));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(neighbours: &Neighbours, a: usize, b: usize) -> u32 {
        let area = neighbours.bounds(a).union(&neighbours.bounds(b)).half_area();
        area.to_bits() & !PLACE | (a ^ b) as u32 & PLACE
    }

    #[test]
    fn nearest_are_those_of_all_within_reach() {
        for level in Level::available() {
            for (count, step) in [(1, 3), (2, 1), (300, 7), (MOST, 37), (77, 0)] {
                let mut neighbours = Neighbours::default();
                for index in 0..count {
                    let lower = Vec3A::new((index * step % 64) as f32, (index * step % 16) as f32, 1.0);
                    neighbours.push(&BoundsA { lower, upper: lower + Vec3A::new(2.0, 1.0, 4.0) });
                }
                neighbours.find(level);
                for index in 0..count {
                    let reach = index.saturating_sub(REACH)..count.min(index + REACH + 1);
                    let others = reach.filter(|&other| other != index);
                    let nearest = others.min_by_key(|&other| distance(&neighbours, index, other));
                    if let Some(nearest) = nearest {
                        assert_eq!(neighbours.nearest(index), nearest, "{index} of {count}, {}", level.name());
                    }
                }
            }
        }
    }
}
