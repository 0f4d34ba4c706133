//! Vectors of eight and of sixteen lanes of single precision, one implementation per instruction set.
//!
//! A value of a type that implements [`Simd`] proves that the processor has the instruction set: only [`Level::detect`]
//! makes one. Kernels are written once, generic over the token, and enter through [`Level::run`].
//!
//! This folder is the only home of `unsafe`.
#![allow(unsafe_code)]

mod guess;
#[cfg(target_arch = "aarch64")]
mod neon;
mod portable;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod shuffles;
mod twice;
#[cfg(target_arch = "x86_64")]
mod x86;

use bytemuck::{Pod, Zeroable};

pub use guess::guessed;
#[cfg(target_arch = "aarch64")]
pub use neon::Neon;
pub use portable::Portable;
pub use twice::Twice;
#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512};

/// Arithmetic on vectors of some number of lanes, which are numbered from 0.
///
/// `min` and `max` return their second argument where either is not a number, as x86 does; kernels rely on that.
pub trait Arithmetic: Copy + Send + Sync + 'static {
    /// A bit for every lane.
    const ALL: u32;
    /// A number in every lane.
    type F32: Copy;

    /// A copy in every lane.
    fn splat(self, value: f32) -> Self::F32;
    /// a + b
    fn add(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// a - b
    fn sub(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// a * b
    fn mul(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// a * b + c, rounded once or twice
    fn mul_add(self, a: Self::F32, b: Self::F32, c: Self::F32) -> Self::F32;
    /// a * b - c, rounded once or twice
    fn mul_sub(self, a: Self::F32, b: Self::F32, c: Self::F32) -> Self::F32;
    /// a / b
    fn div(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// The lesser of each pair.
    fn min(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// The greater of each pair.
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// The bits that are set in both.
    fn and(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// The bits that are set in one or the other.
    fn or(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// The bits that are set in one and not in the other.
    fn xor(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// The difference of the bits as integers.
    fn sub_bits(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// Where a >= b the first choice, elsewhere the second.
    fn if_ge(self, a: Self::F32, b: Self::F32, first: Self::F32, second: Self::F32) -> Self::F32;
    /// Bit `i` is set where lane `i` has a <= b.
    fn le(self, a: Self::F32, b: Self::F32) -> u32;
    /// Bit `i` is set where lane `i` has a < 0 < b.
    fn straddles_zero(self, a: Self::F32, b: Self::F32) -> u32;
    /// The first in the lanes whose bits are set, else the second.
    fn select(self, lanes: u32, first: Self::F32, second: Self::F32) -> Self::F32;
    /// The magnitude of each.
    #[inline(always)]
    fn abs(self, value: Self::F32) -> Self::F32 {
        self.and(value, self.splat(f32::from_bits(i32::MAX as u32)))
    }
}

/// Operations on eight lanes.
pub trait Simd: Arithmetic {
    /// Lists of ids are handled in groups of this many.
    const GROUP: usize = 8;
    /// Whether sixteen lanes are one register.
    const IS_WIDE: bool = false;

    /// Eight numbers in double precision.
    type F64: Copy;
    /// The same instruction set on sixteen lanes.
    type Wide: Arithmetic;

    /// Compile `kernel` for this instruction set and run it.
    fn run<K: Kernel>(self, kernel: K) -> K::Output;
    /// The token for sixteen lanes.
    fn wide(self) -> Self::Wide;
    /// Sixteen lanes from twice eight.
    fn both(self, halves: [Self::F32; 2]) -> <Self::Wide as Arithmetic>::F32;
    /// Twice eight lanes from sixteen.
    fn halves(self, value: <Self::Wide as Arithmetic>::F32) -> [Self::F32; 2];
    /// Eight numbers from memory.
    fn load(self, values: &[f32; 8]) -> Self::F32;
    /// Sixteen numbers from memory.
    fn load_wide(self, values: &[f32; 16]) -> <Self::Wide as Arithmetic>::F32;
    /// Eight points from memory, by coordinate.
    #[inline(always)]
    fn load_points(self, points: &[f32; 24]) -> [Self::F32; 3] {
        let mut axes = [[0.0; 8]; 3];
        for lane in 0..8 {
            for axis in 0..3 {
                axes[axis][lane] = points[3 * lane + axis];
            }
        }
        [self.load(&axes[0]), self.load(&axes[1]), self.load(&axes[2])]
    }
    /// Sixteen points from memory, likewise.
    #[inline(always)]
    fn load_points_wide(self, points: &[f32; 48]) -> [<Self::Wide as Arithmetic>::F32; 3] {
        let [low, high]: &[[f32; 24]; 2] = bytemuck::cast_ref(points);
        let ([x, y, z], [p, q, r]) = (self.load_points(low), self.load_points(high));
        [self.both([x, p]), self.both([y, q]), self.both([z, r])]
    }
    /// Twice four numbers from memory.
    fn join(self, low: &[f32; 4], high: &[f32; 4]) -> Self::F32;
    /// Eight numbers to memory.
    fn store(self, value: Self::F32) -> [f32; 8];
    /// Sixteen numbers to memory.
    fn store_wide(self, value: <Self::Wide as Arithmetic>::F32) -> [f32; 16];
    /// The columns of sixteen rows.
    fn columns(self, rows: &[&[f32; 4]; 16]) -> [<Self::Wide as Arithmetic>::F32; 4] {
        let half = |k: usize, half: usize| self.load(&std::array::from_fn(|row| rows[8 * half + row][k]));
        std::array::from_fn(|k| self.both([half(k, 0), half(k, 1)]))
    }
    /// The even and the odd quads of lanes of both: of four rows of eight lanes, two by two, squares of four by four. Of
    /// four rows of sixteen, squares of rows' squares are that.
    #[inline(always)]
    fn squares(self, [upper, lower]: [<Self::Wide as Arithmetic>::F32; 2]) -> [<Self::Wide as Arithmetic>::F32; 2] {
        let ([a, b], [c, d]) = (self.halves(upper), self.halves(lower));
        let rows: [[[f32; 4]; 2]; 4] = bytemuck::cast([self.store(a), self.store(b), self.store(c), self.store(d)]);
        let [[a, e], [b, f], [c, g], [d, h]] = &rows;
        [self.both([self.join(a, b), self.join(c, d)]), self.both([self.join(e, f), self.join(g, h)])]
    }
    /// The numbers of the first sixteen bits that are set; behind the last any.
    #[inline(always)]
    fn places(self, set: u64) -> [u32; 16] {
        let (mut places, mut rest) = ([0; 16], set);
        for place in &mut places {
            *place = rest.trailing_zeros() % 64;
            rest &= rest.wrapping_sub(1);
        }
        places
    }
    /// The numbers at some places of sixty-four.
    #[inline(always)]
    fn pick(self, table: [<Self::Wide as Arithmetic>::F32; 4], places: &[u32; 16]) -> <Self::Wide as Arithmetic>::F32 {
        let [a, b, c, d] = table;
        let rows = [self.store_wide(a), self.store_wide(b), self.store_wide(c), self.store_wide(d)];
        let (table, mut picked): ([f32; 64], _) = (bytemuck::cast(rows), [0.0; 16]);
        for lane in 0..16 {
            picked[lane] = table[places[lane] as usize % 64];
        }
        self.load_wide(&picked)
    }
    /// Rows to columns.
    fn transpose(self, rows: [Self::F32; 8]) -> [Self::F32; 8];
    /// The same numbers in double precision.
    fn widen(self, value: Self::F32) -> Self::F64;
    /// The nearest numbers in single precision, ties to even, as `as f32` rounds.
    fn narrow(self, value: Self::F64) -> Self::F32;
    /// a + b, rounded once
    fn add_f64(self, a: Self::F64, b: Self::F64) -> Self::F64;
    /// a - b, rounded once
    fn sub_f64(self, a: Self::F64, b: Self::F64) -> Self::F64;
    /// a * b, rounded once
    fn mul_f64(self, a: Self::F64, b: Self::F64) -> Self::F64;
    /// a / b, rounded once
    fn div_f64(self, a: Self::F64, b: Self::F64) -> Self::F64;
    /// Bit `i` is set where lane `i` is above zero.
    fn positive_f64(self, value: Self::F64) -> u32;
    /// Bit `i` is set where lane `i` is below zero.
    fn negative_f64(self, value: Self::F64) -> u32;
    /// Which of eight boxes a ray meets within an interval, given their near and far planes along every axis, and the
    /// ray's inverse direction and what is to be added to products with it.
    #[inline(always)]
    fn meet(
        self,
        [near, far]: &[[Self::F32; 3]; 2],
        inverse: &[f32; 3],
        bias: &[[f32; 2]; 3],
        interval: &[f32; 2],
    ) -> u32 {
        let (mut from, mut to) = (self.splat(interval[0]), self.splat(interval[1]));
        for k in 0..3 {
            let inverse = self.splat(inverse[k]);
            from = self.max(self.mul_add(near[k], inverse, self.splat(bias[k][0])), from);
            to = self.min(self.mul_add(far[k], inverse, self.splat(bias[k][1])), to);
        }
        self.le(from, to)
    }
    /// Ask for a value that is to be read soon; may do nothing.
    fn prefetch<T>(self, value: &T);
    /// Write numbers that nobody reads soon: past the caches, where that is possible, so that they need not be read before and
    /// push nothing out. [`Simd::fence`] must follow before anybody looks at them.
    #[inline(always)]
    fn stream(self, from: &[f32; 8], to: &mut [Aligned; 2]) {
        *to = bytemuck::cast(*from);
    }
    /// Wait for what was written by [`Simd::stream`].
    #[inline(always)]
    fn fence(self) {}
    /// Copy the ids whose mask has bit `bit` to the front of `out`, in order, and count them.
    ///
    /// All slices have the same length, a multiple of [`Simd::GROUP`]; what stands in `out` behind the copies is unspecified.
    fn compact(self, masks: &[u8], bit: u32, ids: &[u16], out: &mut [u16]) -> usize;
}

/// Four numbers that begin at a multiple of sixteen bytes.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Aligned([f32; 4]);

/// The number, read on its own. Compilers join reads of neighbours to one of a vector; that has to wait until all
/// numbers have arrived in the cache where they were written one by one just before, some fifteen cycles.
#[inline(always)]
pub fn read_alone<T: Copy>(number: &T) -> T {
    // SAFETY: the reference is to a number that can be read.
    unsafe { std::ptr::from_ref(number).read_volatile() }
}

/// The largest [`Simd::GROUP`].
pub const MOST_GROUP: usize = 32;

/// Work written once for every instruction set. Implementations must be `#[inline(always)]`, and so must all that they
/// call in their inner loops: a closure, or a function that takes one, is compiled without the instruction set and
/// keeps the operations of [`Simd`] from being inlined (measured: three times slower); so are those that
/// `array::map`, `array::from_fn` and `fold` take, and a call to one saves all vectors (a tile: a fifth slower).
pub trait Kernel {
    /// What it returns.
    type Output;
    /// Do the work.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// An instruction set that this processor has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Plain arrays: any processor.
    Portable(Portable),
    /// 256-bit vectors with fused multiply-add.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// The same with mask registers and compression.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
    /// Pairs of 128-bit vectors.
    #[cfg(target_arch = "aarch64")]
    Neon(Neon),
}

impl Level {
    /// The best instruction set of this processor.
    pub fn detect() -> Self {
        Self::available().pop().unwrap_or(Self::Portable(Portable))
    }

    /// Every instruction set of this processor, the best last.
    pub fn available() -> Vec<Self> {
        #[allow(unused_mut)]
        let mut levels = vec![Self::Portable(Portable)];
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(Avx2::detect().map(Self::Avx2));
            levels.extend(Avx512::detect().map(Self::Avx512));
        }
        #[cfg(target_arch = "aarch64")]
        levels.extend(Neon::detect().map(Self::Neon));
        levels
    }

    /// Its name: `portable`, `avx2`, `avx512` or `neon`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable(_) => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "avx512",
            #[cfg(target_arch = "aarch64")]
            Self::Neon(_) => "neon",
        }
    }

    /// Run a kernel compiled for this instruction set.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Self::Portable(simd) => simd.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => simd.run(kernel),
            #[cfg(target_arch = "aarch64")]
            Self::Neon(simd) => simd.run(kernel),
        }
    }
}
