//! Triangles in the order of a Morton curve through the middles of their boxes: a parallel radix sort, least
//! significant digit first, whose result does not depend on the number of threads.

use std::slice::IterMut;

use rayon::prelude::*;

use super::record::UnitCube;
use crate::{Error, Job, Mesh, arena::Arena, error};

/// A triangle with its code along the curve, which orders keys: the code in the upper bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Key(u64);

impl Key {
    /// Bits of a triangle's number; [`Mesh`] allows no more.
    const TRIANGLE: u32 = 27;

    fn new(code: u64, triangle: u32) -> Self {
        Self(code << Self::TRIANGLE | u64::from(triangle))
    }

    /// Which triangle.
    #[inline(always)]
    pub fn triangle(self) -> u32 {
        (self.0 & ((1 << Self::TRIANGLE) - 1)) as u32
    }

    /// Where along the curve.
    #[inline(always)]
    pub fn code(self) -> u64 {
        self.0 >> Self::TRIANGLE
    }

    #[inline(always)]
    fn digit(self, pass: u32) -> usize {
        (self.0 >> (Self::TRIANGLE + pass * DIGIT)) as usize & (BUCKETS - 1)
    }
}

/// Bits of a coordinate, and of a digit: three coordinates are sorted in three passes. More buckets than a thousand leave
/// the cache nearest to the processor.
const DIGIT: u32 = 10;
const BUCKETS: usize = 1 << DIGIT;

/// Most keys that a thread goes through between two looks at the job: some milliseconds.
const STEP: usize = 1 << 20;

/// Fewest keys that are worth a thread of their own.
const PART: usize = 1 << 14;

type Histogram = [u32; BUCKETS];

/// The keys of all solid triangles, sorted.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn sorted(mesh: &Mesh, job: &Job) -> Result<Arena<Key>, Error> {
    const WHAT: &str = "the order of triangles";
    let solid = mesh.solid();
    let (mut keys, mut other) = (Arena::zeroed(solid.len(), WHAT)?, Arena::zeroed(solid.len(), WHAT)?);
    let part = solid.len().div_ceil(rayon::current_num_threads()).clamp(PART, STEP);
    let mut histograms: Vec<[Histogram; 3]> = error::filled(solid.len().div_ceil(part), [[0; BUCKETS]; 3], WHAT)?;
    let cube = UnitCube::new(&mesh.bounds());
    let parts = keys.par_chunks_mut(part).zip(solid.par_chunks(part)).zip(&mut histograms);
    parts.try_for_each(|((keys, solid), histograms)| {
        job.check()?;
        encode(mesh, &cube, solid, keys, histograms);
        Ok(())
    })?;
    for pass in 0..3 {
        if pass > 0 && histograms.len() > 1 {
            recount(&keys, part, pass, &mut histograms);
        }
        scatter(&keys, &mut other, part, pass, &histograms, job)?;
        std::mem::swap(&mut keys, &mut other);
    }
    Ok(keys)
}

/// The key of a triangle whose box has its middle in `cube`.
#[inline(always)]
pub fn key(mesh: &Mesh, cube: &UnitCube, triangle: u32) -> Key {
    let bounds = cube.bounds(mesh.corners(triangle));
    let place = (bounds.lower + bounds.upper) * (BUCKETS / 2) as f32;
    let [x, y, z] = place.to_array().map(|place| spread((place as u32).min(BUCKETS as u32 - 1)));
    Key::new(x << 2 | y << 1 | z, triangle)
}

fn encode(mesh: &Mesh, cube: &UnitCube, solid: &[u32], keys: &mut [Key], histograms: &mut [Histogram; 3]) {
    for (key, &triangle) in keys.iter_mut().zip(solid) {
        *key = self::key(mesh, cube, triangle);
        for (pass, histogram) in histograms.iter_mut().enumerate() {
            histogram[key.digit(pass as u32)] += 1;
        }
    }
}

/// Two empty bits between any two.
#[inline(always)]
fn spread(coordinate: u32) -> u64 {
    let x = coordinate & 0x3ff;
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    u64::from((x | x << 2) & 0x0924_9249)
}

/// What each part has of each digit, after its keys have changed.
fn recount(keys: &[Key], part: usize, pass: u32, histograms: &mut [[Histogram; 3]]) {
    keys.par_chunks(part).zip(histograms).for_each(|(keys, histograms)| {
        let histogram = &mut histograms[pass as usize];
        histogram.fill(0);
        keys.iter().for_each(|key| histogram[key.digit(pass)] += 1);
    });
}

/// Sort by one digit; keys of equal digits stay in order.
fn scatter(
    from: &[Key],
    to: &mut [Key],
    part: usize,
    pass: u32,
    histograms: &[[Histogram; 3]],
    job: &Job,
) -> Result<(), Error> {
    let mut buckets: Vec<Vec<IterMut<'_, Key>>> = Vec::new();
    for _ in histograms {
        buckets.push(error::reserve(BUCKETS, "sorting")?);
    }
    let mut rest = to;
    for digit in 0..BUCKETS {
        for (buckets, histograms) in buckets.iter_mut().zip(histograms) {
            let (bucket, behind) = rest.split_at_mut(histograms[pass as usize][digit] as usize);
            buckets.push(bucket.iter_mut());
            rest = behind;
        }
    }
    from.par_chunks(part).zip(buckets).try_for_each(|(keys, mut buckets)| {
        job.check()?;
        for key in keys {
            if let Some(place) = buckets[key.digit(pass)].next() {
                *place = *key;
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::pool;

    #[test]
    fn keys_are_sorted_whatever_the_number_of_threads() {
        let count = 5 * PART as u32 + 7;
        let place = |i: u32| Vec3::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, (i * 71 % 89) as f32);
        let vertices = (0..count).flat_map(|i| [place(i), place(i) + Vec3::X, place(i) + Vec3::Y]).collect();
        let mesh = Mesh::new(vertices, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()).unwrap();
        let [one, three] =
            [1, 3].map(|threads| pool::install(threads, || sorted(&mesh, &Job::new())).unwrap().unwrap());
        assert!(one.is_sorted() && one[..] == three[..]);
        let mut triangles: Vec<u32> = one.iter().map(|key| key.triangle()).collect();
        triangles.sort_unstable();
        assert!(triangles.into_iter().eq(0..count));
    }

    #[test]
    fn bits_are_spread_to_every_third_place() {
        for coordinate in 0..1024 {
            let spread = spread(coordinate);
            assert!((0..21).all(|bit| spread >> (3 * bit) & 7 == u64::from(coordinate >> bit & 1)));
        }
    }
}
