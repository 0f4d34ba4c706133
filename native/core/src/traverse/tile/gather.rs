//! Gathering the rays of a tile from a batch, sixteen by sixteen: one after another, or, where they come in rows of a
//! picture, squares of four by four.

use super::{
    EXTENTS, GROUPS, RAYS, Slack,
    rays::{QUAD, Tile},
};
use crate::{
    ray::{MISS, Rays},
    simd::{Arithmetic, Kernel, Simd},
    traverse::frame::{Domain, NEAR},
};

/// The least groups worth a tile.
const FEWEST: usize = 2;

/// A ray is never this much steeper along another axis than along the tile's: its slopes are at most 2.
const SLANT: f32 = 0.5;

/// Sixteen rays by column: origin, direction, tmin, tmax.
type Columns<S> = [<<S as Simd>::Wide as Arithmetic>::F32; 8];

/// Rays of a batch to be gathered in a tile, from `first` on, as far as they fit together; tells how many, none where a tile
/// is not worth it. Where it also asked for the lines in which the next tile begins, five scenes took 1.03 times as long
/// (Zen 5).
pub struct Gather<'a> {
    pub tile: &'a mut Tile,
    pub rays: &'a Rays<'a>,
    pub first: usize,
    pub domain: &'a Domain,
}

impl Kernel for Gather<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> usize {
        self.tile.gather(simd, self.rays, self.first, self.domain)
    }
}

impl Tile {
    #[inline(always)]
    fn gather<S: Simd>(&mut self, simd: S, rays: &Rays<'_>, first: usize, domain: &Domain) -> usize {
        let most = ((rays.len() - first) / RAYS).min(GROUPS);
        if most < FEWEST || !self.begin(rays, first, domain) {
            return 0;
        }
        self.across = if most == GROUPS { quads_across(rays, first) } else { 0 };
        let are_square = match self.across {
            0 => false,
            1 => self.add_from_eights(simd, rays, first),
            _ => self.add_from_rows(simd, rays, first),
        };
        if !are_square {
            (self.across, self.count, self.slanted) = (0, 0, 0);
            while self.count < most && self.add(simd, &rays.sixteen(simd, first + self.count * RAYS)) {
                self.count += 1;
            }
        }
        if self.count < FEWEST {
            return 0;
        }
        self.slack = if self.slanted == 0 { Slack::STEEP } else { Slack::SLANTED };
        self.span(simd);
        self.count * RAYS
    }

    /// Add square groups of rays in rows of eight; false where not all of them fit.
    #[inline(always)]
    fn add_from_eights<S: Simd>(&mut self, simd: S, rays: &Rays<'_>, first: usize) -> bool {
        for pair in 0..GROUPS / 2 {
            let place = first + 2 * RAYS * pair;
            let groups = squares(simd, &rays.sixteen(simd, place), &rays.sixteen(simd, place + RAYS));
            if !self.add_all(simd, &groups) {
                return false;
            }
        }
        true
    }

    /// The same of longer rows.
    #[inline(always)]
    fn add_from_rows<S: Simd>(&mut self, simd: S, rays: &Rays<'_>, first: usize) -> bool {
        let row = QUAD << self.across;
        for place in (0..GROUPS * RAYS).step_by(QUAD * row) {
            for place in (first + place..first + place + row).step_by(RAYS) {
                let upper = squares(simd, &rays.sixteen(simd, place), &rays.sixteen(simd, place + row));
                let place = place + 2 * row;
                let lower = squares(simd, &rays.sixteen(simd, place), &rays.sixteen(simd, place + row));
                let [even, odd] = [squares(simd, &upper[0], &lower[0]), squares(simd, &upper[1], &lower[1])];
                if !self.add_all(simd, &[even[0], odd[0], even[1], odd[1]]) {
                    return false;
                }
            }
        }
        true
    }

    /// Add groups; false where one does not fit.
    #[inline(always)]
    fn add_all<S: Simd>(&mut self, simd: S, groups: &[Columns<S>]) -> bool {
        for group in groups {
            if !self.add(simd, group) {
                return false;
            }
            self.count += 1;
        }
        true
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
    fn add<S: Simd>(&mut self, simd: S, columns: &Columns<S>) -> bool {
        let wide = simd.wide();
        let zero = wide.splat(0.0);
        let (mut elsewhere, mut largest, mut direction) = (zero, zero, [zero; 3]);
        for k in 0..3 {
            let offset = wide.sub(columns[k], wide.splat(self.origin[k]));
            direction[k] = columns[3 + k];
            elsewhere = wide.max(wide.abs(offset), elsewhere);
            elsewhere = wide.add(elsewhere, wide.mul(direction[k], zero));
            largest = wide.max(wide.abs(direction[k]), largest);
        }
        let [x, y, z] = self.axes;
        let [x, y, z] = [direction[x], direction[y], direction[z]];
        let (tmin, tmax) = (columns[6], columns[7]);
        let rise = wide.mul(z, wide.splat(self.sign));
        let fits = wide.le(elsewhere, zero)
            & wide.le(wide.splat(1e-37), largest)
            & wide.le(largest, wide.splat(1e38))
            & wide.le(wide.mul(largest, wide.splat(SLANT)), rise)
            & wide.le(zero, tmin)
            & (wide.le(tmin, tmax) | wide.le(tmax, tmin));
        if fits != S::Wide::ALL {
            return false;
        }
        let steeper = wide.le(rise, wide.max(wide.abs(x), wide.abs(y)));
        self.slanted |= u32::from(steeper != 0) << self.count;

        let length = wide.and(largest, wide.splat(f32::INFINITY));
        let scale = wide.sub_bits(wide.splat(f32::from_bits(254 << 23)), length);
        let (tmin, tmax) = (wide.mul(tmin, length), wide.mul(tmax, length));
        let exactly = &mut self.exactly[self.count];
        for k in 0..3 {
            exactly.direction[k] = simd.store_wide(wide.mul(direction[k], scale));
        }
        exactly.interval = [simd.store_wide(tmin), simd.store_wide(tmax)];
        exactly.scale = simd.store_wide(scale);

        let rise = wide.mul(rise, scale);
        let inverse = wide.div(wide.splat(1.0), wide.mul(z, scale));
        let group = &mut self.groups[self.count];
        group.slope[0] = simd.store_wide(wide.mul(wide.mul(x, scale), inverse));
        group.slope[1] = simd.store_wide(wide.mul(wide.mul(y, scale), inverse));
        group.near = simd.store_wide(wide.mul(tmin, rise));
        group.low = simd.store_wide(wide.mul(tmax, rise));
        group.high = group.low;
        group.best = simd.store_wide(wide.splat(f32::from_bits(MISS)));
        true
    }
}

/// How many quads there are in the rows of a picture that the rays from `first` on, as many as a tile holds, seem to come
/// in, as a power of two; 0 where they come otherwise.
#[inline(always)]
fn quads_across(rays: &Rays<'_>, first: usize) -> u32 {
    for across in 1..=QUAD as u32 {
        let row = QUAD << across;
        if 4.0 * away(rays, first, row) < away(rays, first, row / 2) {
            return across;
        }
    }
    0
}

/// The square of the distance of two directions.
#[inline(always)]
fn away(rays: &Rays<'_>, first: usize, by: usize) -> f32 {
    (rays.get(first + by).direction - rays.get(first).direction).length_squared()
}

/// See [`Simd::squares`].
#[inline(always)]
fn squares<S: Simd>(simd: S, upper: &Columns<S>, lower: &Columns<S>) -> [Columns<S>; 2] {
    let [mut left, mut right] = [*upper, *lower];
    for column in 0..8 {
        [left[column], right[column]] = simd.squares([upper[column], lower[column]]);
    }
    [left, right]
}
