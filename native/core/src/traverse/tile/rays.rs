//! The rays of a tile: gathering them from a batch, and what is known of each.

use bytemuck::Zeroable;
use glam::Vec3;

use super::{BLOCKS, EXTENTS, GROUPS, Slack, Visit};
use crate::{
    accel::structure::NodeRef,
    ray::{MISS, Rays},
    simd::Simd,
    traverse::frame::{self, Domain, Frame, NEAR},
    triangle::LANES,
};

/// The least groups worth a tile.
const FEWEST: usize = 4;

/// A ray is never this much steeper along another axis than along the tile's: its slopes are at most 2.
const SLANT: f32 = 0.5;

/// Eight rays, as boxes and triangles meet them. Depths are along the tile's axis, from the origin.
#[derive(Debug, Clone, Copy, Zeroable)]
#[repr(C, align(64))]
pub struct Group {
    /// Direction over its component along the axis.
    pub slope: [[f32; LANES]; 2],
    /// Hits before this depth do not count.
    pub near: [f32; LANES],
    /// Hits up to this depth are certainly before the best one, or the end of the interval.
    pub low: [f32; LANES],
    /// Hits from this depth on are certainly behind the best one, or the end of the interval.
    pub high: [f32; LANES],
    /// The triangle of the best hit, or [`MISS`], as bits that no vector operation changes.
    pub best: [f32; LANES],
}

/// Eight rays, as the exact test needs them.
#[derive(Debug, Clone, Copy, Zeroable)]
#[repr(C, align(64))]
pub struct Exactly {
    /// See [`Frame::direction`].
    pub direction: [[f32; LANES]; 3],
    /// See [`Frame::tmin`] and [`Frame::tmax`].
    pub interval: [[f32; LANES]; 2],
    /// From the frame's units to the ray's.
    pub scale: [f32; LANES],
}

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
    const NOTHING: Self = Self {
        low: [[f32::INFINITY; LANES]; 2],
        high: [[f32::NEG_INFINITY; LANES]; 2],
        middle: [[0.0; LANES]; 2],
        half: [[0.0; LANES]; 2],
        far: [f32::NEG_INFINITY; LANES],
    };
}

/// Up to 256 consecutive rays of a batch that start at one point in similar directions. Boxed by its owner.
pub struct Tile {
    /// Groups in use.
    pub count: usize,
    /// Axes x, y and z; rays go along z, and the others follow in cyclic order.
    pub axes: [usize; 3],
    /// Whether rays rise (1) or fall (-1) along z.
    pub sign: f32,
    /// The common origin.
    pub origin: [f32; 3],
    /// The origin relative to the centre of the domain.
    pub local: Vec3,
    /// Largest component of that.
    pub reach: f32,
    /// Half of the longest edge of the scene's box.
    pub half_extent: f32,
    /// Signs of the first ray's direction, for the order of visits.
    pub octant: usize,
    /// Groups in which some ray is steeper along another axis.
    pub slanted: u32,
    /// How far single precision is trusted.
    pub slack: Slack,
    /// Least slopes.
    pub low: [f32; 2],
    /// Greatest slopes.
    pub high: [f32; 2],
    /// The farthest best hit.
    pub far: f32,
    /// The rays.
    pub groups: [Group; GROUPS],
    /// The same rays.
    pub exactly: [Exactly; GROUPS],
    domain: Domain,
    /// What groups have in common, eight by eight.
    pub spans: [Spans; BLOCKS],
}

impl Default for Tile {
    fn default() -> Self {
        Self {
            count: 0,
            axes: [0, 1, 2],
            sign: 1.0,
            origin: [0.0; 3],
            local: Vec3::ZERO,
            reach: 0.0,
            half_extent: 0.0,
            octant: 0,
            slanted: 0,
            slack: Slack::STEEP,
            low: [0.0; 2],
            high: [0.0; 2],
            far: 0.0,
            groups: [Group::zeroed(); GROUPS],
            exactly: [Exactly::zeroed(); GROUPS],
            domain: Domain { centre: Vec3::ZERO, half_extent: 0.0 },
            spans: [Spans::NOTHING; BLOCKS],
        }
    }
}

impl Tile {
    /// Take rays from `first` on, as far as they fit together, and say how many; none where a tile is not worth it.
    #[inline(always)]
    pub fn gather<S: Simd>(&mut self, simd: S, rays: &Rays<'_>, first: usize, domain: &Domain) -> usize {
        let most = ((rays.len() - first) / LANES).min(GROUPS);
        if most < FEWEST || !self.begin(rays, first, domain) {
            return 0;
        }
        while self.count < most && self.add(simd, rays, first + self.count * LANES) {
            self.count += 1;
        }
        if self.count < FEWEST {
            return 0;
        }
        self.slack = if self.slanted == 0 { Slack::STEEP } else { Slack::SLANTED };
        self.span(simd);
        self.count * LANES
    }

    /// An empty tile around the first ray; false where its origin is no tile's.
    #[inline(always)]
    fn begin(&mut self, rays: &Rays<'_>, first: usize, domain: &Domain) -> bool {
        let ray = rays.get(first);
        let steepness = ray.direction.abs();
        let z = if steepness.max_element() == steepness.x {
            0
        } else if steepness.y >= steepness.z {
            1
        } else {
            2
        };
        self.count = 0;
        self.slanted = 0;
        self.axes = [(z + 1) % 3, (z + 2) % 3, z];
        self.sign = 1f32.copysign(ray.direction[z]);
        self.octant = (0..3).fold(0, |octant, k| octant | usize::from(ray.direction[k] < 0.0) << k);
        self.origin = ray.origin.to_array();
        self.local = ray.origin - domain.centre;
        self.reach = self.local.abs().max_element();
        self.half_extent = domain.half_extent;
        self.domain = *domain;
        EXTENTS.contains(&domain.half_extent) && self.reach <= NEAR * domain.half_extent
    }

    /// Add a group; false where it does not fit.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, rays: &Rays<'_>, first: usize) -> bool {
        let columns = rays.eight(simd, first);
        let zero = simd.splat(0.0);
        let (mut elsewhere, mut largest, mut direction) = (zero, zero, [zero; 3]);
        for k in 0..3 {
            let offset = simd.sub(columns[k], simd.splat(self.origin[k]));
            direction[k] = columns[3 + k];
            elsewhere = simd.max(simd.abs(offset), elsewhere);
            elsewhere = simd.add(elsewhere, simd.mul(direction[k], zero));
            largest = simd.max(simd.abs(direction[k]), largest);
        }
        let [x, y, z] = self.axes;
        let [x, y, z] = [direction[x], direction[y], direction[z]];
        let (tmin, tmax) = (columns[6], columns[7]);
        let rise = simd.mul(z, simd.splat(self.sign));
        let fits = simd.le(elsewhere, zero)
            & simd.le(simd.splat(1e-37), largest)
            & simd.le(largest, simd.splat(1e38))
            & simd.le(simd.mul(largest, simd.splat(SLANT)), rise)
            & simd.le(zero, tmin)
            & (simd.le(tmin, tmax) | simd.le(tmax, tmin));
        if fits != 0xff {
            return false;
        }
        let steeper = simd.le(rise, simd.max(simd.abs(x), simd.abs(y)));
        self.slanted |= u32::from(steeper != 0) << self.count;

        let length = simd.and(largest, simd.splat(f32::INFINITY));
        let scale = simd.sub_bits(simd.splat(f32::from_bits(254 << 23)), length);
        let (tmin, tmax) = (simd.mul(tmin, length), simd.mul(tmax, length));
        let exactly = &mut self.exactly[self.count];
        for k in 0..3 {
            exactly.direction[k] = simd.store(simd.mul(direction[k], scale));
        }
        exactly.interval = [simd.store(tmin), simd.store(tmax)];
        exactly.scale = simd.store(scale);

        let rise = simd.mul(rise, scale);
        let inverse = simd.div(simd.splat(1.0), simd.mul(z, scale));
        let group = &mut self.groups[self.count];
        group.slope[0] = simd.store(simd.mul(simd.mul(x, scale), inverse));
        group.slope[1] = simd.store(simd.mul(simd.mul(y, scale), inverse));
        group.near = simd.store(simd.mul(tmin, rise));
        group.low = simd.store(simd.mul(tmax, rise));
        group.high = group.low;
        group.best = simd.store(simd.splat(f32::from_bits(MISS)));
        true
    }

    /// What groups have in common.
    #[inline(always)]
    fn span<S: Simd>(&mut self, simd: S) {
        let [mut all_low, mut all_high] = [[simd.splat(f32::INFINITY); 2], [simd.splat(f32::NEG_INFINITY); 2]];
        self.spans = [Spans::NOTHING; BLOCKS];
        for (block, spans) in self.spans.iter_mut().enumerate().take(self.count.div_ceil(LANES)) {
            let first = block * LANES;
            let groups = &self.groups[first..self.count.min(first + LANES)];
            for k in 0..2 {
                // Groups missing from the last block repeat its first one.
                let mut rows = [simd.load(&groups[0].slope[k]); LANES];
                for (row, group) in rows.iter_mut().zip(groups) {
                    *row = simd.load(&group.slope[k]);
                }
                let [low, high] = extremes(simd, simd.transpose(rows));
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
                *row = simd.load(&group.high);
            }
            let [_, far] = extremes(simd, simd.transpose(rows));
            spans.far = simd.store(far);
        }
        for k in 0..2 {
            self.low[k] = -greatest(&simd.store(simd.sub(simd.splat(0.0), all_low[k])));
            self.high[k] = greatest(&simd.store(all_high[k]));
        }
        self.update_far(simd);
    }

    /// A visit for all groups, whatever they meet.
    pub fn everything(&self, node: NodeRef) -> Visit {
        let groups = u32::MAX >> (GROUPS - self.count);
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

    /// Note that the farthest hit of a group has come nearer; [`Tile::update_far`] is to follow. All eight numbers are
    /// written at once: a vector could not be read soon after one of them was.
    #[inline(always)]
    pub fn approach<S: Simd>(&mut self, simd: S, group: usize) {
        let (this, others) = (simd.splat(greatest(&self.groups[group].high)), simd.splat(f32::INFINITY));
        let limit = simd.if_ge(simd.load(&IDENTITY[group % LANES]), simd.splat(1.0), this, others);
        let far = &mut self.spans[group / LANES].far;
        *far = simd.store(simd.min(limit, simd.load(far)));
    }

    /// Find the farthest hit again.
    #[inline(always)]
    pub fn update_far<S: Simd>(&mut self, simd: S) {
        let mut far = simd.splat(f32::NEG_INFINITY);
        for spans in &self.spans {
            far = simd.max(simd.load(&spans.far), far);
        }
        self.far = greatest(&simd.store(far));
    }

    /// The frame of a ray.
    pub fn frame(&self, group: usize, lane: usize) -> Frame {
        let Exactly { direction, interval: [tmin, tmax], scale } = &self.exactly[group];
        let direction = Vec3::from_array(direction.map(|axis| axis[lane]));
        let interval = (tmin[lane], tmax[lane]);
        let mut frame = Frame::zeroed();
        let (origin, place) = (Vec3::from(self.origin), (self.local, self.reach));
        frame.set_near(origin, place, (direction, frame::inverse(direction, 1.0)), interval, &self.domain);
        frame.scale = scale[lane];
        frame
    }
}

/// The least and the greatest of each lane.
#[inline(always)]
fn extremes<S: Simd>(simd: S, rows: [S::F32; LANES]) -> [S::F32; 2] {
    let (mut low, mut high) = (rows[0], rows[0]);
    for row in &rows[1..] {
        low = simd.min(*row, low);
        high = simd.max(*row, high);
    }
    [low, high]
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
