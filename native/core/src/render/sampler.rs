//! Random numbers that depend on pixel, sample and purpose alone, and directions made of them.
//!
//! The numbers are the first two dimensions of Sobol's sequence with nested uniform (Owen) scrambling by a hash, after
//! Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, with Vegdahl's constants for the hash of Laine and
//! Karras ("Building a Better LK Hash", 2021). Every purpose shuffles the sequence anew ("padding" in Burley's paper),
//! so any number of purposes share two dimensions. Sobol's second matrix is Pascal's triangle modulo 2 and is applied
//! in five steps (Ahmed, "An Implementation Algorithm of 2D Sobol Sequence Fast, Elegant, and Compact", EGSR 2024).

use std::f32::consts::PI;

use glam::Vec3;

/// What a pair of random numbers is for; each gets its own sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Purpose {
    /// The place in the pixel.
    Pixel = 0,
    /// The direction to the world.
    World = 1,
    /// Which of many lights.
    Choice = 2,
    /// The place on a light; the number of the light is added to it.
    Light = 3,
}

/// The random numbers of one sample of one pixel.
#[derive(Debug, Clone, Copy)]
pub struct Sampler {
    key: u32,
    sample: u32,
}

/// What all samplers of a picture share.
pub fn key(seed: u64) -> u32 {
    mixed(seed as u32 ^ mixed((seed >> 32) as u32))
}

impl Sampler {
    /// Numbers for sample `sample` of the pixel at `pixel` of the whole frame; `key` is that of the picture.
    #[inline]
    pub fn new(key: u32, pixel: [u32; 2], sample: u32) -> Self {
        Self { key: mixed(key ^ (pixel[1] << 16 | pixel[0])), sample }
    }

    /// Two numbers in 0 to 1 (excluded), for the `number`th of a purpose at a bounce.
    #[inline]
    pub fn pair(&self, bounce: u32, purpose: Purpose, number: u32) -> [f32; 2] {
        let key = mixed(self.key ^ (bounce << 16 | (purpose as u32 + number)));
        let index = scrambled(self.sample.reverse_bits(), key).reverse_bits();
        let x = scrambled(index, key.wrapping_mul(0x9e37_79b1));
        let y = scrambled(pascal(index), key.wrapping_mul(0x85eb_ca77));
        [x, y].map(unit)
    }
}

/// A number in 0 to 1, from the leading 24 bits of the reversed one.
#[inline]
fn unit(reversed: u32) -> f32 {
    (reversed.reverse_bits() >> 8) as f32 / (1 << 24) as f32
}

/// Owen's scrambling of a number with reversed bits.
#[inline]
fn scrambled(mut x: u32, key: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Sobol's second dimension, with reversed bits: bit j is the sum of the bits whose number contains j.
#[inline]
fn pascal(mut index: u32) -> u32 {
    index ^= index >> 1 & 0x5555_5555;
    index ^= index >> 2 & 0x3333_3333;
    index ^= index >> 4 & 0x0f0f_0f0f;
    index ^= index >> 8 & 0x00ff_00ff;
    index ^ index >> 16
}

/// A hash: Wellons' "lowbias32" (hash-prospector, 2018), moved so that zero is no fixed point.
#[inline]
fn mixed(x: u32) -> u32 {
    let mut x = x.wrapping_add(0x9e37_79b9);
    x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
    x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

/// A point of the unit disk, uniform by area.
#[inline]
pub fn disk_point([a, b]: [f32; 2]) -> [f32; 2] {
    let (sine, cosine) = (2.0 * PI * b).sin_cos();
    [cosine, sine].map(|coordinate| coordinate * a.sqrt())
}

/// A unit vector around `normal`, with a density of its cosine over π; and that cosine.
#[inline]
pub fn cosine_direction(normal: Vec3, random: [f32; 2]) -> (Vec3, f32) {
    let [x, y] = disk_point(random);
    let cosine = (1.0 - random[0]).sqrt();
    let [u, v] = perpendiculars(normal);
    ((u * x + v * y + normal * cosine).normalize(), cosine)
}

/// A unit vector in a cone around `axis`, uniform by solid angle.
#[inline]
pub fn cone_direction(axis: Vec3, one_minus_cosine: f32, [a, b]: [f32; 2]) -> Vec3 {
    let below = a * one_minus_cosine;
    let radius = (below * (2.0 - below)).sqrt();
    let (sine, cosine) = (2.0 * PI * b).sin_cos();
    let [u, v] = perpendiculars(axis);
    (u * (radius * cosine) + v * (radius * sine) + axis * (1.0 - below)).normalize()
}

/// Two unit vectors perpendicular to a unit vector and to each other. Duff et al., "Building an Orthonormal Basis,
/// Revisited", JCGT 6(1), 2017.
#[inline]
pub fn perpendiculars(n: Vec3) -> [Vec3; 2] {
    let sign = 1f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sobol's second dimension from its direction numbers, one bit at a time.
    fn second_dimension(index: u32) -> u32 {
        let mut direction = 1u32 << 31;
        let mut value = 0;
        for bit in 0..32 {
            value ^= if index >> bit & 1 == 1 { direction } else { 0 };
            direction ^= direction >> 1;
        }
        value
    }

    #[test]
    fn the_five_steps_equal_the_matrix() {
        for index in (0..2000).chain([u32::MAX, 0x8000_0000, 0x1234_5678]) {
            assert_eq!(pascal(index).reverse_bits(), second_dimension(index));
        }
    }

    /// The first 2^k points of a (0, 2)-sequence put one point into every elementary interval of area 2^-k.
    #[test]
    fn samples_are_stratified_in_every_elementary_interval() {
        for pixel in 0..20 {
            for (columns, rows) in [(1, 64), (2, 32), (4, 16), (8, 8), (16, 4), (32, 2), (64, 1)] {
                let mut count = vec![0; 64];
                for sample in 0..64 {
                    let [x, y] = Sampler::new(key(7), [pixel, 3], sample).pair(1, Purpose::Light, 2);
                    count[(y * rows as f32) as usize * columns + (x * columns as f32) as usize] += 1;
                }
                assert!(count.iter().all(|&count| count == 1), "{columns} by {rows}: {count:?}");
            }
        }
    }

    /// Over many pixels the numbers are uniform, and those of one purpose tell nothing of those of another.
    #[test]
    fn pixels_and_purposes_are_independent() {
        let count = 20_000;
        let (mut mean, mut products) = ([0.0f64; 4], [0.0f64; 4]);
        for pixel in 0..count {
            let sampler = Sampler::new(key(1), [pixel % 200, pixel / 200], 0);
            let [a, b] = sampler.pair(0, Purpose::Pixel, 0).map(|value| f64::from(value) - 0.5);
            let [c, d] = sampler.pair(0, Purpose::Light, 1).map(|value| f64::from(value) - 0.5);
            for (sum, value) in mean.iter_mut().zip([a, b, c, d]) {
                *sum += value / f64::from(count);
            }
            for (sum, value) in products.iter_mut().zip([a * b, a * c, c * d, b * d]) {
                *sum += value / f64::from(count);
            }
        }
        assert!(mean.iter().all(|mean| mean.abs() < 0.01), "{mean:?}");
        assert!(products.iter().all(|product| product.abs() < 0.003), "{products:?}");
    }

    #[test]
    fn perpendiculars_are_perpendicular() {
        for n in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(1.0, -2.0, -3.0).normalize(), Vec3::new(0.0, 1e-6, -1.0)] {
            let [u, v] = perpendiculars(n);
            for value in [u.dot(v), u.dot(n), v.dot(n), u.length() - 1.0, v.length() - 1.0] {
                assert!(value.abs() < 1e-6, "{n}: {u} {v}");
            }
        }
    }
}
