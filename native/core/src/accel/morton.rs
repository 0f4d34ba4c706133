//! Triangles in the order of a Morton curve through the middles of their boxes.

use glam::Vec3A;
use rayon::prelude::*;

use super::{
    ahead,
    radix::{self, BUCKETS, Counts, DIGIT, STEP, Splitters},
    record::UnitCube,
};
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

    /// Of a triangle.
    #[inline(always)]
    pub fn new(code: u64, triangle: u32) -> Self {
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

    /// One of the three digits of its code, the least significant first.
    #[inline(always)]
    pub fn digit(self, pass: u32) -> usize {
        (self.0 >> (Self::TRIANGLE + pass * DIGIT)) as usize & (BUCKETS - 1)
    }
}

/// Fewest keys that are worth a thread of their own.
const PART: usize = 1 << 14;

/// Keys per part by which is found out where the parts of a sort are to end.
const SAMPLES: usize = 1 << 7;

/// The keys of all solid triangles, sorted.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn sorted(mesh: &Mesh, job: &Job) -> Result<Arena<Key>, Error> {
    const WHAT: &str = "the order of triangles";
    let count = mesh.solid_count();
    let (mut keys, spare) = (Arena::stale(count, WHAT)?, Arena::stale(count, WHAT)?);
    let parts = rayon::current_num_threads().min(count / PART).max(1);
    let (cube, level) = (UnitCube::new(&mesh.bounds()), Level::detect());
    let splitters = splitters(mesh, &cube, parts);
    let chunk = count.div_ceil(parts).max(1);
    let mut counts: Vec<Vec<Counts>> = error::reserve(parts, WHAT)?;
    for _ in keys.chunks(chunk) {
        counts.push(error::filled(parts, Counts::NONE, WHAT)?);
    }
    keys.par_chunks_mut(chunk).zip(&mut counts).enumerate().try_for_each(|(index, (keys, counts))| {
        for (step, keys) in keys.chunks_mut(STEP).enumerate() {
            job.check()?;
            let first = index * chunk + step * STEP;
            level.run(Encode { mesh, cube: &cube, first, keys, splitters: &splitters, counts });
        }
        Ok(())
    })?;
    radix::sort(keys, spare, &splitters, &counts, job)
}

/// Keys that divide all into so many parts of about the same size, as far as a few triangles tell.
fn splitters(mesh: &Mesh, cube: &UnitCube, parts: usize) -> Splitters {
    let (reader, samples) = (mesh.reader(), SAMPLES * parts);
    let sample = |index| {
        let triangle = mesh.solid(mesh.solid_count() * index / samples).next()?;
        Some(key(reader.corners(triangle), cube, triangle))
    };
    let mut keys: Vec<Key> = if parts > 1 { (0..samples).filter_map(sample).collect() } else { Vec::new() };
    keys.sort_unstable();
    Splitters(keys.chunks(SAMPLES).skip(1).map(|part| part[0]).collect())
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

/// Makes the keys of solid triangles from the one with the number `first` on, and counts their digits by their part.
struct Encode<'a> {
    mesh: &'a Mesh,
    cube: &'a UnitCube,
    first: usize,
    keys: &'a mut [Key],
    splitters: &'a Splitters,
    counts: &'a mut [Counts],
}

impl Kernel for Encode<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { mesh, cube, first, keys, splitters, counts } = self;
        let reader = mesh.reader();
        for (to, triangle) in keys.iter_mut().zip(mesh.solid(first)) {
            ahead::ask(simd, reader, triangle as usize, |place| u32::try_from(place).ok());
            let key = key(reader.corners(triangle), cube, triangle);
            *to = key;
            counts[splitters.part(key)].add(key);
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

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::pool;

    /// Triangles at places that come in no order, or all at one.
    fn mesh(count: u32, place: impl Fn(u32) -> Vec3) -> Mesh {
        let vertices = (0..count).flat_map(|i| [place(i), place(i) + Vec3::X, place(i) + Vec3::Y]).collect();
        Mesh::new(vertices, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()).unwrap()
    }

    #[test]
    fn keys_are_sorted_whatever_the_number_of_threads() {
        let scattered = |i: u32| Vec3::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, (i * 71 % 89) as f32);
        let count = 5 * PART as u32 + 7;
        let lonely = |i: u32| if i == 9 { Vec3::splat(1e6) } else { scattered(i) };
        for mesh in [mesh(count, scattered), mesh(count, lonely), mesh(count, |_| Vec3::ONE), mesh(3, scattered)] {
            let [one, two, three] =
                [1, 2, 3].map(|threads| pool::install(threads, || sorted(&mesh, &Job::new())).unwrap());
            assert!(one.is_sorted() && one[..] == two[..] && one[..] == three[..]);
            let mut triangles: Vec<u32> = one.iter().map(|key| key.triangle()).collect();
            triangles.sort_unstable();
            assert!(triangles.into_iter().eq(0..mesh.triangles().len() as u32));
        }
    }

    #[test]
    fn parts_of_a_sort_are_about_as_large() {
        let count = 4 * PART as u32;
        let mesh = mesh(count, |i| Vec3::new((i % 256) as f32, (i / 256 * 7 % 256) as f32, 0.0));
        let splitters = splitters(&mesh, &UnitCube::new(&mesh.bounds()), 4);
        let mut counts = [0; 4];
        sorted(&mesh, &Job::new()).unwrap().iter().for_each(|&key| counts[splitters.part(key)] += 1);
        assert!(counts.iter().all(|part| (PART * 4 / 5..PART * 5 / 4).contains(part)), "{counts:?}");
    }

    #[test]
    fn bits_are_spread_to_every_third_place() {
        for coordinate in 0..1024 {
            let spread = SPREAD[coordinate];
            assert!((0..10).all(|bit| spread >> (3 * bit) & 7 == coordinate as u32 >> bit & 1));
        }
    }
}
