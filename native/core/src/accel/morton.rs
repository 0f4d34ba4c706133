//! Triangles in the order of a Morton curve through the middles of their boxes: a parallel radix sort, least
//! significant digit first, whose result does not depend on the number of threads.

use std::slice::IterMut;

use glam::Vec3A;
use rayon::prelude::*;

use super::{ahead, record::UnitCube};
use crate::{
    Error, Job, Mesh,
    arena::Arena,
    error,
    simd::{Kernel, Level, Simd},
};

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
    let count = mesh.solid_count();
    let (mut keys, mut other) = (Arena::stale(count, WHAT)?, Arena::stale(count, WHAT)?);
    let part = count.div_ceil(rayon::current_num_threads()).clamp(PART, STEP);
    let mut histograms: Vec<[Histogram; 3]> = error::filled(count.div_ceil(part), [[0; BUCKETS]; 3], WHAT)?;
    let (cube, level) = (UnitCube::new(&mesh.bounds()), Level::detect());
    let parts = keys.par_chunks_mut(part).zip(&mut histograms).enumerate();
    parts.try_for_each(|(index, (keys, histograms))| {
        job.check()?;
        level.run(Encode { mesh, cube: &cube, first: index * part, keys, histograms });
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

/// A number below 2^22 plus this has its integer in the low bits, and needs no instruction to convert it.
const INTEGER: f32 = (3 << 22) as f32;

/// The key of a triangle whose box has its middle in `cube`.
#[inline(always)]
pub fn key(corners: [Vec3A; 3], cube: &UnitCube, triangle: u32) -> Key {
    let bounds = cube.bounds(corners);
    let place = (bounds.lower + bounds.upper) * (BUCKETS / 2) as f32;
    let place = (place - 0.5).max(Vec3A::ZERO).min(Vec3A::splat((BUCKETS - 1) as f32)) + INTEGER;
    let [x, y, z] = [place.x, place.y, place.z].map(|place| SPREAD[place.to_bits() as usize & (BUCKETS - 1)]);
    Key::new(u64::from(x << 2 | y << 1 | z), triangle)
}

/// Makes the keys of solid triangles from the one with the number `first` on, and counts their digits.
struct Encode<'a> {
    mesh: &'a Mesh,
    cube: &'a UnitCube,
    first: usize,
    keys: &'a mut [Key],
    histograms: &'a mut [Histogram; 3],
}

impl Kernel for Encode<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { mesh, cube, first, keys, histograms } = self;
        let reader = mesh.reader();
        for (to, triangle) in keys.iter_mut().zip(mesh.solid(first)) {
            ahead::ask(simd, reader, triangle as usize, |place| u32::try_from(place).ok());
            let key = key(reader.corners(triangle), cube, triangle);
            *to = key;
            for (pass, histogram) in histograms.iter_mut().enumerate() {
                histogram[key.digit(pass as u32)] += 1;
            }
        }
    }
}

/// Coordinates with two empty bits between any two of theirs.
static SPREAD: [u32; BUCKETS] = {
    let mut spread = [0; BUCKETS];
    let mut coordinate = 0;
    while coordinate < BUCKETS {
        let x = coordinate as u32;
        let x = (x | x << 16) & 0x0300_00ff;
        let x = (x | x << 8) & 0x0300_f00f;
        let x = (x | x << 4) & 0x030c_30c3;
        spread[coordinate] = (x | x << 2) & 0x0924_9249;
        coordinate += 1;
    }
    spread
};

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
    if let [histograms] = histograms {
        job.check()?;
        scatter_alone(from, to, pass, &histograms[pass as usize]);
        return Ok(());
    }
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

/// The same by one thread, which needs to remember less of where it is.
fn scatter_alone(from: &[Key], to: &mut [Key], pass: u32, histogram: &Histogram) {
    let mut place = 0;
    let mut places = histogram.map(|count| {
        place += count;
        place - count
    });
    for key in from {
        let place = &mut places[key.digit(pass)];
        to[*place as usize] = *key;
        *place += 1;
    }
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
        let [one, three] = [1, 3].map(|threads| pool::install(threads, || sorted(&mesh, &Job::new())).unwrap());
        assert!(one.is_sorted() && one[..] == three[..]);
        let mut triangles: Vec<u32> = one.iter().map(|key| key.triangle()).collect();
        triangles.sort_unstable();
        assert!(triangles.into_iter().eq(0..count));
    }

    #[test]
    fn bits_are_spread_to_every_third_place() {
        for coordinate in 0..1024 {
            let spread = SPREAD[coordinate];
            assert!((0..10).all(|bit| spread >> (3 * bit) & 7 == coordinate as u32 >> bit & 1));
        }
    }
}
