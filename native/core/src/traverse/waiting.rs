//! The grid over the rays: those that are to walk in streams wait until there are many, and then those of one octant
//! that begin near each other walk together. A counting sort by octant and by cell of a uniform grid over their
//! origins, along a Morton curve, does for rays what a grid does for triangles. After Boulos et al., "Adaptive Ray
//! Packet Reordering", RT 2008, and Moon et al., "Cache-Oblivious Ray Reordering", ACM TOG 29(3), 2010, without lists.

use std::ops::Range;

use glam::Vec3;

use super::{
    frame::{Domain, Frame},
    stream::bin_size,
    take::Take,
};
use crate::{
    Error,
    ray::{Eight, Hit, Ray, Rays},
    simd::Simd,
    triangle::LANES,
};

/// The most rays that wait, but for eight more: eight bins, but at least so many. Their numbers fit into 16 bits. Of 8 to 64 thousand, with
/// 512 KiB of second-level cache and rays in the order of pixels, none was the fastest everywhere, and 64 thousand cost
/// up to 15% (ambient occlusion on the dragon).
///
/// Against bins of an octant in the order in which rays came, half a million bounces from random triangles took 1/1.20
/// of the time on the dragon and 1/1.14 on the soup. Rays in the order of pixels gain nothing from the cells.
pub fn most() -> usize {
    const LEAST: usize = 1 << 14;
    (8 * bin_size()).max(LEAST)
}

/// Rays whose hits are told at once.
const RAYS: usize = 16;

/// Room that [`Waiting::add`] needs: up to eight rays, and eight places written for each.
const SPARE: usize = 2 * LANES;

/// Cells along each axis of the grid: 2 to the power of this.
const CELL_BITS: u32 = 4;

/// Keys are an octant and a cell.
const KEY_BITS: u32 = 3 + 3 * CELL_BITS;

/// Added to a number from 0 to 15 it leaves the integer part in the lowest bits.
const INTEGER: f32 = (1 << 23) as f32;

/// The rays that wait, in the order in which they came, and the order in which they are to be traced. Once a ray has a
/// frame, its hit stands in its row.
#[derive(Debug, Default)]
pub struct Waiting {
    count: usize,
    rows: Vec<[f32; 8]>,
    keys: Vec<u16>,
    indices: Vec<u32>,
    order: Vec<u16>,
    starts: Vec<u16>,
}

impl Waiting {
    /// Forget all rays; there is room then for as many as wait at once in a batch of that size.
    pub fn begin(&mut self, batch: usize) {
        let room = batch.min(most()) + SPARE;
        if self.rows.len() < room {
            self.rows.resize(room, [0.0; 8]);
            self.keys.resize(room, 0);
            self.indices.resize(room, 0);
            self.order.resize(room, 0);
        }
        self.count = 0;
    }

    /// Let eight rays of a batch wait, or its last ones; returns how many. There must be room for eight.
    ///
    /// # Errors
    /// [`Error::Ray`] for an unusable ray.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, simd: S, rays: &Rays<'_>, first: usize, domain: &Domain) -> Result<usize, Error> {
        if first + LANES <= rays.len() {
            let columns = rays.eight(simd, first);
            if usable(simd, &columns) {
                self.put(simd, &columns, first, domain);
                self.count += LANES;
                return Ok(LANES);
            }
        }
        let count = LANES.min(rays.len() - first);
        for index in first..first + count {
            rays.frame(index, domain)?;
            self.put(simd, &splat(simd, rays.get(index).to_row()), index, domain);
            self.count += 1;
        }
        Ok(count)
    }

    /// Write eight rays behind those that wait.
    #[inline(always)]
    fn put<S: Simd>(&mut self, simd: S, columns: &[S::F32; 8], first: usize, domain: &Domain) {
        let places = self.count..self.count + LANES;
        let (rows, indices) = (&mut self.rows[places.clone()], &mut self.indices[places.clone()]);
        let transposed = simd.transpose(*columns);
        for lane in 0..LANES {
            rows[lane] = simd.store(transposed[lane]);
            indices[lane] = (first + lane) as u32;
        }
        self.keys[places].copy_from_slice(&keys(simd, columns, domain));
    }

    /// Whether no rays wait.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether no eight more rays fit.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count + SPARE > self.rows.len()
    }

    /// Decide the order; tells which part of it each octant has.
    pub fn sort(&mut self) -> [Range<usize>; 8] {
        let keys = &self.keys[..self.count];
        // A cell for every eight rays.
        let bits = (self.count.max(64).ilog2() - 6).div_ceil(3).min(CELL_BITS);
        let coarse = 3 * (CELL_BITS - bits);
        let buckets = 1 << (KEY_BITS - coarse);
        self.starts.clear();
        self.starts.resize(buckets + 1, 0);
        for &key in keys {
            self.starts[usize::from(key >> coarse) + 1] += 1;
        }
        let mut before = 0;
        for start in &mut self.starts {
            before += *start;
            *start = before;
        }
        let octant = |octant: usize| usize::from(self.starts[octant << (3 * bits)]);
        let octants = std::array::from_fn(|index| octant(index)..octant(index + 1));
        for (ray, &key) in keys.iter().enumerate() {
            let place = &mut self.starts[usize::from(key >> coarse)];
            self.order[usize::from(*place)] = ray as u16;
            *place += 1;
        }
        octants
    }

    /// Eight rays from the order, by column: origin, direction, tmin, tmax. Missing ones repeat the last.
    #[inline(always)]
    pub fn eight<S: Simd>(&self, simd: S, places: Range<usize>) -> [S::F32; 8] {
        let mut rows = [simd.splat(0.0); LANES];
        for lane in 0..LANES {
            let place = (places.start + lane).min(places.end - 1);
            rows[lane] = simd.load(&self.rows[usize::from(self.order[place])]);
        }
        simd.transpose(rows)
    }

    /// Ask for eight rays of the order, so that they are near when they are wanted.
    #[inline(always)]
    pub fn warm<S: Simd>(&self, simd: S, first: usize) {
        for &ray in self.order[..self.count].iter().skip(first).take(LANES) {
            simd.prefetch(&self.rows[usize::from(ray)]);
        }
    }

    /// The frame of a ray of the order.
    ///
    /// # Errors
    /// [`Error::Ray`] where it has none.
    pub fn frame(&self, place: usize, domain: &Domain) -> Result<Frame, Error> {
        let [ox, oy, oz, dx, dy, dz, tmin, tmax] = self.rows[usize::from(self.order[place])];
        let ray = Ray { origin: Vec3::new(ox, oy, oz), direction: Vec3::new(dx, dy, dz), tmin, tmax };
        Frame::new(&ray, domain).ok_or_else(|| ray.fault(self.index(place)))
    }

    /// The rays of some places hit nothing for now; their rows are not needed any more.
    #[inline(always)]
    pub fn miss(&mut self, places: Range<usize>) {
        for place in places {
            self.answer(place, Hit::MISS);
        }
    }

    /// What a ray of the order hits.
    #[inline(always)]
    pub fn answer(&mut self, place: usize, hit: Hit) {
        let [row, _]: &mut [[f32; 4]; 2] = bytemuck::cast_mut(&mut self.rows[usize::from(self.order[place])]);
        *row = hit.to_row();
    }

    /// Tell what all rays hit, sixteen by sixteen.
    #[inline(always)]
    pub fn tell<S: Simd, T: Take + ?Sized>(&self, simd: S, to: &mut T, is_large: bool) {
        let (rows, indices) = (&self.rows[..self.count], &self.indices[..self.count]);
        for (rows, indices) in rows.chunks(RAYS).zip(indices.chunks(RAYS)) {
            let first = indices[0] as usize;
            if let Ok(rows) = rows.try_into()
                && indices[RAYS - 1] as usize == first + RAYS - 1
            {
                take_sixteen(simd, rows, to, first, is_large);
                continue;
            }
            for (row, &index) in rows.iter().zip(indices) {
                let [row, _]: &[[f32; 4]; 2] = bytemuck::cast_ref(row);
                to.take(index as usize, Hit::of_row(row));
            }
        }
    }

    /// Where in the batch a ray of the order is.
    #[inline(always)]
    pub fn index(&self, place: usize) -> usize {
        self.indices[usize::from(self.order[place])] as usize
    }
}

/// Tell what the rays hit that have some rows.
#[inline(always)]
fn take_sixteen<S: Simd, T: Take + ?Sized>(simd: S, rows: &[[f32; 8]; RAYS], to: &mut T, first: usize, is_large: bool) {
    let mut hits = [&[0.0; 4]; RAYS];
    for lane in 0..RAYS {
        let [row, _]: &[[f32; 4]; 2] = bytemuck::cast_ref(&rows[lane]);
        hits[lane] = row;
    }
    let [t, primitive, u, v] = simd.columns(&hits);
    let (t, primitive, u, v) = (simd.halves(t), simd.halves(primitive), simd.halves(u), simd.halves(v));
    let mut eights = [Eight::MISSES; 2];
    for half in 0..2 {
        eights[half] = Eight {
            t: simd.store(t[half]),
            primitive: bytemuck::cast(simd.store(primitive[half])),
            u: simd.store(u[half]),
            v: simd.store(v[half]),
        };
    }
    if is_large && let Some(mut to) = to.aligned(first, RAYS) {
        to.set_eight(simd, 0, &eights[0]);
        to.set_eight(simd, LANES, &eights[1]);
    } else {
        to.take_eight(first, &eights[0]);
        to.take_eight(first + LANES, &eights[1]);
    }
}

#[inline(always)]
fn splat<S: Simd>(simd: S, row: [f32; 8]) -> [S::F32; 8] {
    let mut columns = [simd.splat(0.0); 8];
    for column in 0..8 {
        columns[column] = simd.splat(row[column]);
    }
    columns
}

/// Whether all eight have a [`Frame`].
#[inline(always)]
fn usable<S: Simd>(simd: S, columns: &[S::F32; 8]) -> bool {
    let zero = simd.splat(0.0);
    let (mut finite, mut largest) = (zero, zero);
    for k in 0..6 {
        finite = simd.add(finite, simd.mul(columns[k], zero));
    }
    for k in 3..6 {
        largest = simd.max(simd.abs(columns[k]), largest);
    }
    let [.., tmin, tmax] = *columns;
    let ordered = simd.le(tmin, tmax) | simd.le(tmax, tmin);
    simd.le(finite, zero) & simd.le(simd.splat(1e-37), largest) & ordered == 0xff
}

/// Octant and cell of eight rays: the signs of the direction, then the cell's place on the Morton curve.
#[inline(always)]
fn keys<S: Simd>(simd: S, columns: &[S::F32; 8], domain: &Domain) -> [u16; LANES] {
    let cells = (1 << CELL_BITS) as f32;
    let per_unit = cells / (2.0 * domain.half_extent).max(f32::MIN_POSITIVE);
    let mut keys = [0; LANES];
    for k in 0..3 {
        let local = simd.sub(columns[k], simd.splat(domain.centre[k]));
        let place = simd.mul_add(local, simd.splat(per_unit), simd.splat(0.5 * cells - 0.5));
        let place = simd.max(simd.min(place, simd.splat(cells - 1.0)), simd.splat(0.0));
        let cell = simd.store(simd.add(place, simd.splat(INTEGER)));
        let direction = simd.store(columns[3 + k]);
        for lane in 0..LANES {
            let spread = cell[lane].to_bits() & ((1 << CELL_BITS) - 1);
            let spread = (spread | spread << 4) & 0xc3;
            let spread = (spread | spread << 2) & 0x249;
            keys[lane] |= (spread << k | (direction[lane].to_bits() >> 31) << (3 * CELL_BITS + k as u32)) as u16;
        }
    }
    keys
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        ray::Column,
        simd::{Kernel, Level},
    };
    use glam::Vec3;

    const DOMAIN: Domain = Domain { centre: Vec3::ZERO, half_extent: 1.0 };

    struct Add<'a>(&'a mut Waiting, &'a Rays<'a>);

    impl Kernel for Add<'_> {
        type Output = Result<(), Error>;
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let Self(waiting, rays) = self;
            waiting.begin(rays.len());
            let mut next = 0;
            while next < rays.len() {
                next += waiting.add(simd, rays, next, &DOMAIN)?;
            }
            Ok(())
        }
    }

    /// Six columns of numbers between -1 and 1, of which those of the directions are never zero.
    fn columns(count: usize) -> [Vec<f32>; 6] {
        let number = |seed: u32| (seed.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 23) as f32 - 1.0 + 1e-7;
        std::array::from_fn(|column| (0..count as u32).map(|ray| number(6 * ray + column as u32)).collect())
    }

    fn rays(columns: &[Vec<f32>; 6]) -> Rays<'_> {
        let [o, d] = [0, 3].map(|first| [0, 1, 2].map(|k| Column::new(&columns[first + k])));
        Rays::new(o, d, Column::constant(&0.0), Column::constant(&1.0), columns[0].len()).unwrap()
    }

    #[test]
    fn every_ray_is_in_the_part_of_its_octant_once() {
        for count in [1, 8, 77, 5000, most() - SPARE] {
            let columns = columns(count);
            for level in Level::available() {
                let mut waiting = Waiting::default();
                level.run(Add(&mut waiting, &rays(&columns))).unwrap();
                let mut seen = vec![false; count];
                for (octant, places) in waiting.sort().into_iter().enumerate() {
                    for place in places {
                        let index = waiting.index(place);
                        let frame = waiting.frame(place, &DOMAIN).unwrap();
                        assert_eq!(frame, rays(&columns).frame(index, &DOMAIN).unwrap());
                        assert_eq!(frame.octant(), octant);
                        assert!(!std::mem::replace(&mut seen[index], true));
                    }
                }
                assert!(seen.into_iter().all(|seen| seen));
            }
        }
    }

    #[test]
    fn neighbours_in_the_order_begin_near_each_other() {
        let columns = columns(most() - SPARE);
        let mut waiting = Waiting::default();
        Level::detect().run(Add(&mut waiting, &rays(&columns))).unwrap();
        let origin = |ray: usize| Vec3::new(columns[0][ray], columns[1][ray], columns[2][ray]);
        let apart = |pairs: &mut dyn Iterator<Item = (usize, usize)>| -> f32 {
            pairs.map(|(one, two)| origin(one).distance(origin(two))).sum()
        };
        let as_they_came = apart(&mut (1..most() - SPARE).map(|ray| (ray - 1, ray)));
        let parts = waiting.sort().into_iter().filter(|places| !places.is_empty());
        let mut pairs = parts.flat_map(|places| {
            (places.start + 1..places.end).map(|place| (waiting.index(place - 1), waiting.index(place)))
        });
        assert!(apart(&mut pairs) < 0.3 * as_they_came);
    }

    #[test]
    fn the_first_unusable_ray_is_named() {
        let mut columns = columns(40);
        columns[1][33] = f32::NAN;
        for column in &mut columns[3..] {
            column[21] = 0.0;
        }
        let error = Level::detect().run(Add(&mut Waiting::default(), &rays(&columns))).unwrap_err();
        assert!(error.to_string().contains("ray 21"), "{error}");
    }
}
