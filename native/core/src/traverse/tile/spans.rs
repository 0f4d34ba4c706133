//! What the rays of a group, and of the whole tile, have in common, and which groups meet a box.

use super::{BLOCKS, GROUPS, RAYS, Visit, rays::Tile};
use crate::{
    accel::structure::NodeRef,
    simd::{Arithmetic, Simd},
    triangle::LANES,
};

/// Rays along the side of a square of them.
const SIDE: f32 = 16.0;

/// In row `i` lane `i` is set.
static IDENTITY: [[f32; LANES]; LANES] = identity();

const fn identity() -> [[f32; LANES]; LANES] {
    let mut rows = [[0.0; LANES]; LANES];
    let mut row = 0;
    while row < LANES {
        rows[row][row] = 1.0;
        row += 1;
    }
    rows
}

/// The slopes of eight groups, and where the farthest hit of each is.
#[derive(Debug, Clone, Copy)]
pub struct Spans {
    low: [[f32; LANES]; 2],
    high: [[f32; LANES]; 2],
    /// The middle of all slopes of a group.
    pub middle: [[f32; LANES]; 2],
    /// The greatest distance of any from it.
    pub half: [[f32; LANES]; 2],
    far: [f32; LANES],
}

impl Spans {
    pub const NOTHING: Self = Self {
        low: [[f32::INFINITY; LANES]; 2],
        high: [[f32::NEG_INFINITY; LANES]; 2],
        middle: [[0.0; LANES]; 2],
        half: [[0.0; LANES]; 2],
        far: [f32::NEG_INFINITY; LANES],
    };
}

impl Tile {
    /// What groups have in common.
    #[inline(always)]
    pub(super) fn span<S: Simd>(&mut self, simd: S) {
        let [mut all_low, mut all_high] = [[simd.splat(f32::INFINITY); 2], [simd.splat(f32::NEG_INFINITY); 2]];
        self.spans = [Spans::NOTHING; BLOCKS];
        for (block, spans) in self.spans.iter_mut().enumerate().take(self.count.div_ceil(LANES)) {
            let first = block * LANES;
            let groups = &self.groups[first..self.count.min(first + LANES)];
            for k in 0..2 {
                // Groups missing from the last block repeat its first one.
                let mut rows = [extremes(simd, &groups[0].slope[k]); LANES];
                for (row, group) in rows.iter_mut().zip(groups) {
                    *row = extremes(simd, &group.slope[k]);
                }
                let [mut least, mut greatest] = [[simd.splat(0.0); LANES]; 2];
                for (group, [low, high]) in rows.into_iter().enumerate() {
                    (least[group], greatest[group]) = (low, high);
                }
                let (low, high) = (least_of(simd, least), greatest_of(simd, greatest));
                all_low[k] = simd.min(low, all_low[k]);
                all_high[k] = simd.max(high, all_high[k]);
                // A half that reaches both ends however the middle was rounded.
                let middle = simd.mul(simd.add(low, high), simd.splat(0.5));
                let half = simd.max(simd.sub(high, middle), simd.sub(middle, low));
                (spans.low[k], spans.high[k]) = (simd.store(low), simd.store(high));
                (spans.middle[k], spans.half[k]) = (simd.store(middle), simd.store(half));
            }
            let mut rows = [simd.splat(f32::NEG_INFINITY); LANES];
            for (row, group) in rows.iter_mut().zip(groups) {
                [_, *row] = extremes(simd, &group.high);
            }
            spans.far = simd.store(greatest_of(simd, rows));
        }
        for k in 0..2 {
            self.low[k] = -greatest(&simd.store(simd.sub(simd.splat(0.0), all_low[k])));
            self.high[k] = greatest(&simd.store(all_high[k]));
        }
        self.step = [(self.high[0] - self.low[0]) / SIDE, (self.high[1] - self.low[1]) / SIDE];
        self.update_far(simd);
    }

    /// A visit for all groups, whatever they meet.
    pub fn everything(&self, node: NodeRef) -> Visit {
        let groups = (1 << self.count) - 1;
        let (low, high) = ([f32::NEG_INFINITY; 2], [f32::INFINITY; 2]);
        Visit { node, groups, near: f32::NEG_INFINITY, low, high }
    }

    /// The groups of a visit that meet its box before their farthest hit.
    #[inline(always)]
    pub fn meeting<S: Simd>(&self, simd: S, visit: &Visit) -> u32 {
        if visit.near > self.far {
            return 0;
        }
        let near = simd.splat(visit.near);
        let mut groups = 0;
        for (block, spans) in self.spans.iter().enumerate() {
            if visit.groups >> (block * LANES) & 0xff == 0 {
                continue;
            }
            let mut apart = simd.sub(near, simd.load(&spans.far));
            for k in 0..2 {
                let after = simd.sub(simd.splat(visit.low[k]), simd.load(&spans.high[k]));
                let before = simd.sub(simd.load(&spans.low[k]), simd.splat(visit.high[k]));
                apart = simd.max(simd.max(after, before), apart);
            }
            groups |= simd.le(apart, simd.splat(0.0)) << (block * LANES);
        }
        groups & visit.groups
    }

    /// Whether a visit's rectangle is so narrow that it may be between all rays.
    #[inline(always)]
    pub fn may_miss(&self, visit: &Visit) -> bool {
        let [x, y] = [visit.high[0] - visit.low[0], visit.high[1] - visit.low[1]];
        (x < self.step[0]) | (y < self.step[1])
    }

    /// Those of some groups that have a ray with slopes in a visit's rectangle.
    #[inline(always)]
    pub fn holding<S: Simd>(&self, simd: S, visit: &Visit, groups: u32) -> u32 {
        let wide = simd.wide();
        let (mut rest, mut holding) = (groups, groups);
        while rest != 0 {
            let group = rest.trailing_zeros() as usize % GROUPS;
            rest &= rest - 1;
            let mut inside = S::Wide::ALL;
            for k in 0..2 {
                let slope = simd.load_wide(&self.groups[group].slope[k]);
                inside &= wide.le(wide.splat(visit.low[k]), slope) & wide.le(slope, wide.splat(visit.high[k]));
            }
            holding &= !(u32::from(inside == 0) << group);
        }
        holding
    }

    /// Note that the farthest hits of some groups have come nearer. All eight numbers are written at once: a vector could not
    /// be read soon after one of them was.
    #[inline(always)]
    pub fn approach<S: Simd>(&mut self, simd: S, groups: u32) {
        let mut rest = groups;
        while rest != 0 {
            let group = rest.trailing_zeros() as usize % GROUPS;
            rest &= rest - 1;
            let (this, others) = (greatest_of_all(simd, &self.groups[group].high), simd.splat(f32::INFINITY));
            let this = simd.splat(this);
            let limit = simd.if_ge(simd.load(&IDENTITY[group % LANES]), simd.splat(1.0), this, others);
            let far = &mut self.spans[group / LANES].far;
            *far = simd.store(simd.min(limit, simd.load(far)));
        }
        if groups != 0 {
            self.update_far(simd);
        }
    }

    /// Find the farthest hit again.
    #[inline(always)]
    fn update_far<S: Simd>(&mut self, simd: S) {
        let mut far = simd.splat(f32::NEG_INFINITY);
        for spans in &self.spans {
            far = simd.max(simd.load(&spans.far), far);
        }
        self.far = greatest(&simd.store(far));
    }
}

/// The lesser and the greater of each of eight numbers and that eight places on.
#[inline(always)]
fn extremes<S: Simd>(simd: S, numbers: &[f32; RAYS]) -> [S::F32; 2] {
    let [low, high] = simd.halves(simd.load_wide(numbers));
    [simd.min(low, high), simd.max(low, high)]
}

/// The least of each row.
#[inline(always)]
fn least_of<S: Simd>(simd: S, rows: [S::F32; LANES]) -> S::F32 {
    let columns = simd.transpose(rows);
    let mut least = columns[0];
    for column in &columns[1..] {
        least = simd.min(*column, least);
    }
    least
}

/// The greatest of each row.
#[inline(always)]
fn greatest_of<S: Simd>(simd: S, rows: [S::F32; LANES]) -> S::F32 {
    let columns = simd.transpose(rows);
    let mut greatest = columns[0];
    for column in &columns[1..] {
        greatest = simd.max(*column, greatest);
    }
    greatest
}

/// The greatest of sixteen numbers.
#[inline(always)]
fn greatest_of_all<S: Simd>(simd: S, numbers: &[f32; RAYS]) -> f32 {
    let [_, greater] = extremes(simd, numbers);
    greatest(&simd.store(greater))
}

/// The greatest of eight numbers.
#[inline(always)]
pub fn greatest(values: &[f32; LANES]) -> f32 {
    let [a, b, c, d, e, f, g, h] = *values;
    let (a, b, c, d) = (greater(a, e), greater(b, f), greater(c, g), greater(d, h));
    greater(greater(a, c), greater(b, d))
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
