//! Plain arrays, which compilers turn into whatever vectors the target is known to have.

use super::{Arithmetic, Kernel, Simd, Twice, twice};

/// Needs nothing, so anybody may make one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Portable;

#[inline(always)]
fn zip<T: Copy>(a: [T; 8], b: [T; 8], f: impl Fn(T, T) -> T) -> [T; 8] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn bits(f: impl Fn(usize) -> bool) -> u32 {
    (0..8).fold(0, |mask, i| mask | u32::from(f(i)) << i)
}

impl Arithmetic for Portable {
    const ALL: u32 = 0xff;
    type F32 = [f32; 8];

    #[inline(always)]
    fn splat(self, value: f32) -> [f32; 8] {
        [value; 8]
    }
    #[inline(always)]
    fn add(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn mul_add(self, a: [f32; 8], b: [f32; 8], c: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| a[i] * b[i] + c[i])
    }
    #[inline(always)]
    fn mul_sub(self, a: [f32; 8], b: [f32; 8], c: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| a[i] * b[i] - c[i])
    }
    #[inline(always)]
    fn div(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn and(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| f32::from_bits(a.to_bits() & b.to_bits()))
    }
    #[inline(always)]
    fn or(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| f32::from_bits(a.to_bits() | b.to_bits()))
    }
    #[inline(always)]
    fn xor(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| f32::from_bits(a.to_bits() ^ b.to_bits()))
    }
    #[inline(always)]
    fn sub_bits(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| f32::from_bits(a.to_bits().wrapping_sub(b.to_bits())))
    }
    #[inline(always)]
    fn if_ge(self, a: [f32; 8], b: [f32; 8], first: [f32; 8], second: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| if a[i] >= b[i] { first[i] } else { second[i] })
    }
    #[inline(always)]
    fn le(self, a: [f32; 8], b: [f32; 8]) -> u32 {
        bits(|i| a[i] <= b[i])
    }
    #[inline(always)]
    fn straddles_zero(self, a: [f32; 8], b: [f32; 8]) -> u32 {
        bits(|i| (a[i] < 0.0) & (b[i] > 0.0))
    }
    #[inline(always)]
    fn select(self, lanes: u32, first: [f32; 8], second: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| if lanes >> i & 1 == 1 { first[i] } else { second[i] })
    }
}

impl Simd for Portable {
    type F64 = [f64; 8];
    type Wide = Twice<Self>;

    #[inline(always)]
    fn wide(self) -> Twice<Self> {
        Twice(self)
    }
    #[inline(always)]
    fn both(self, halves: [[f32; 8]; 2]) -> [[f32; 8]; 2] {
        halves
    }
    #[inline(always)]
    fn halves(self, value: [[f32; 8]; 2]) -> [[f32; 8]; 2] {
        value
    }
    #[inline(always)]
    fn load_wide(self, values: &[f32; 16]) -> [[f32; 8]; 2] {
        let [low, high] = twice::halves(values);
        [self.load(low), self.load(high)]
    }
    #[inline(always)]
    fn store_wide(self, value: [[f32; 8]; 2]) -> [f32; 16] {
        bytemuck::cast([self.store(value[0]), self.store(value[1])])
    }

    #[inline]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
    #[inline(always)]
    fn load(self, values: &[f32; 8]) -> [f32; 8] {
        *values
    }
    #[inline(always)]
    fn join(self, low: &[f32; 4], high: &[f32; 4]) -> [f32; 8] {
        bytemuck::cast([*low, *high])
    }
    #[inline(always)]
    fn store(self, value: [f32; 8]) -> [f32; 8] {
        value
    }
    #[inline(always)]
    fn transpose(self, rows: [[f32; 8]; 8]) -> [[f32; 8]; 8] {
        std::array::from_fn(|column| std::array::from_fn(|row| rows[row][column]))
    }
    #[inline(always)]
    fn widen(self, value: [f32; 8]) -> [f64; 8] {
        value.map(f64::from)
    }
    #[inline(always)]
    fn narrow(self, value: [f64; 8]) -> [f32; 8] {
        value.map(|value| value as f32)
    }
    #[inline(always)]
    fn add_f64(self, a: [f64; 8], b: [f64; 8]) -> [f64; 8] {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub_f64(self, a: [f64; 8], b: [f64; 8]) -> [f64; 8] {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul_f64(self, a: [f64; 8], b: [f64; 8]) -> [f64; 8] {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div_f64(self, a: [f64; 8], b: [f64; 8]) -> [f64; 8] {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn positive_f64(self, value: [f64; 8]) -> u32 {
        bits(|i| value[i] > 0.0)
    }
    #[inline(always)]
    fn negative_f64(self, value: [f64; 8]) -> u32 {
        bits(|i| value[i] < 0.0)
    }
    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
    #[inline(always)]
    fn compact(self, masks: &[u8], bit: u32, ids: &[u16], out: &mut [u16]) -> usize {
        let mut count = 0;
        for (mask, id) in masks.iter().zip(ids) {
            out[count] = *id;
            count += usize::from(mask >> bit & 1);
        }
        count
    }
}
