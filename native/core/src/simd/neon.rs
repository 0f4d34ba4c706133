//! aarch64: pairs of 128-bit NEON vectors, which every such processor has.

use std::arch::aarch64::*;

use super::{Arithmetic, Kernel, Simd, Twice, shuffles::SHUFFLES, twice};

/// Proof that the processor has NEON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Neon(());

impl Neon {
    /// The proof, where the processor gives it.
    pub fn detect() -> Option<Self> {
        std::arch::is_aarch64_feature_detected!("neon").then_some(Self(()))
    }
}

/// Never inlined: a kernel that another one runs now and then is to keep its code and registers to itself.
#[inline(never)]
#[target_feature(enable = "neon")]
fn enter_neon<K: Kernel>(token: Neon, kernel: K) -> K::Output {
    kernel.run(token)
}

/// Lanes 0 to 3, then 4 to 7.
type Pair = [float32x4_t; 2];

/// Lanes 0 and 1, then 2 and 3, and so on.
type Quad = [float64x2_t; 4];

/// Both halves by the same operation, in which every named pair stands for its half.
macro_rules! halves {
    ($($pair:ident),+ => $operation:expr) => {
        [
            {
                let ($($pair,)+) = ($($pair[0],)+);
                // SAFETY: a token exists only where NEON was detected.
                unsafe { $operation }
            },
            {
                let ($($pair,)+) = ($($pair[1],)+);
                // SAFETY: as above.
                unsafe { $operation }
            },
        ]
    };
}

/// All quarters by the same operation.
macro_rules! quarters {
    ($a:ident, $b:ident => $operation:ident) => {
        // SAFETY: a token exists only where NEON was detected.
        unsafe {
            [$operation($a[0], $b[0]), $operation($a[1], $b[1]), $operation($a[2], $b[2]), $operation($a[3], $b[3])]
        }
    };
}

/// The quarters of comparisons as bits.
#[inline(always)]
fn quarter_bits(_: Neon, set: [uint64x2_t; 4]) -> u32 {
    let mut bits = 0;
    for (quarter, set) in set.into_iter().enumerate() {
        // SAFETY: the token exists only where NEON was detected.
        let (low, high) = unsafe { (vgetq_lane_u64::<0>(set), vgetq_lane_u64::<1>(set)) };
        bits |= (low as u32 & 1 | high as u32 & 2) << (2 * quarter);
    }
    bits
}

const WEIGHTS: [u32; 8] = [1, 2, 4, 8, 16, 32, 64, 128];

/// The halves of comparisons as bits.
#[inline(always)]
fn bits(_: Neon, [low, high]: [uint32x4_t; 2]) -> u32 {
    // SAFETY: the token exists only where NEON was detected; the array has eight readable numbers.
    unsafe {
        let weigh = |lanes, first: usize| vandq_u32(lanes, vld1q_u32(WEIGHTS[first..].as_ptr()));
        vaddvq_u32(vorrq_u32(weigh(low, 0), weigh(high, 4)))
    }
}

impl Arithmetic for Neon {
    const ALL: u32 = 0xff;
    type F32 = Pair;

    #[inline(always)]
    fn splat(self, value: f32) -> Pair {
        // SAFETY: a token exists only where NEON was detected.
        unsafe { [vdupq_n_f32(value); 2] }
    }
    #[inline(always)]
    fn add(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vaddq_f32(a, b))
    }
    #[inline(always)]
    fn sub(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vsubq_f32(a, b))
    }
    #[inline(always)]
    fn mul(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vmulq_f32(a, b))
    }
    #[inline(always)]
    fn mul_add(self, a: Pair, b: Pair, c: Pair) -> Pair {
        halves!(a, b, c => vfmaq_f32(c, a, b))
    }
    #[inline(always)]
    fn mul_sub(self, a: Pair, b: Pair, c: Pair) -> Pair {
        halves!(a, b, c => vnegq_f32(vfmsq_f32(c, a, b)))
    }
    #[inline(always)]
    fn div(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vdivq_f32(a, b))
    }
    #[inline(always)]
    fn min(self, a: Pair, b: Pair) -> Pair {
        // Not `vminq_f32`: that returns not-a-number where either argument is.
        halves!(a, b => vbslq_f32(vcltq_f32(a, b), a, b))
    }
    #[inline(always)]
    fn max(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vbslq_f32(vcgtq_f32(a, b), a, b))
    }
    #[inline(always)]
    fn and(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vreinterpretq_f32_u32(vandq_u32(vreinterpretq_u32_f32(a), vreinterpretq_u32_f32(b))))
    }
    #[inline(always)]
    fn or(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vreinterpretq_f32_u32(vorrq_u32(vreinterpretq_u32_f32(a), vreinterpretq_u32_f32(b))))
    }
    #[inline(always)]
    fn xor(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vreinterpretq_f32_u32(veorq_u32(vreinterpretq_u32_f32(a), vreinterpretq_u32_f32(b))))
    }
    #[inline(always)]
    fn sub_bits(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vreinterpretq_f32_u32(vsubq_u32(vreinterpretq_u32_f32(a), vreinterpretq_u32_f32(b))))
    }
    #[inline(always)]
    fn if_ge(self, a: Pair, b: Pair, first: Pair, second: Pair) -> Pair {
        halves!(a, b, first, second => vbslq_f32(vcgeq_f32(a, b), first, second))
    }
    #[inline(always)]
    fn le(self, a: Pair, b: Pair) -> u32 {
        bits(self, halves!(a, b => vcleq_f32(a, b)))
    }
    #[inline(always)]
    fn straddles_zero(self, a: Pair, b: Pair) -> u32 {
        bits(self, halves!(a, b => vandq_u32(vcltzq_f32(a), vcgtzq_f32(b))))
    }
    #[inline(always)]
    fn select(self, lanes: u32, first: Pair, second: Pair) -> Pair {
        // SAFETY: as for `splat`; the array has eight readable numbers.
        let bits = unsafe { [vld1q_u32(WEIGHTS.as_ptr()), vld1q_u32(WEIGHTS[4..].as_ptr())] };
        halves!(bits, first, second => vbslq_f32(vtstq_u32(vdupq_n_u32(lanes), bits), first, second))
    }
}

impl Simd for Neon {
    type F64 = Quad;
    type Wide = Twice<Self>;

    #[inline(always)]
    fn wide(self) -> Twice<Self> {
        Twice(self)
    }
    #[inline(always)]
    fn both(self, halves: [Pair; 2]) -> [Pair; 2] {
        halves
    }
    #[inline(always)]
    fn halves(self, value: [Pair; 2]) -> [Pair; 2] {
        value
    }
    #[inline(always)]
    fn load_wide(self, values: &[f32; 16]) -> [Pair; 2] {
        let [low, high] = twice::halves(values);
        [self.load(low), self.load(high)]
    }
    #[inline(always)]
    fn store_wide(self, value: [Pair; 2]) -> [f32; 16] {
        bytemuck::cast([self.store(value[0]), self.store(value[1])])
    }

    #[inline]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: a token exists only where NEON was detected.
        unsafe { enter_neon(self, kernel) }
    }
    #[inline(always)]
    fn load(self, values: &[f32; 8]) -> Pair {
        // SAFETY: as for `splat`; each half of the array is 16 readable bytes, and the loads ask for no alignment.
        unsafe { [vld1q_f32(values.as_ptr()), vld1q_f32(values[4..].as_ptr())] }
    }
    #[inline(always)]
    fn load_points(self, points: &[f32; 24]) -> [Pair; 3] {
        // SAFETY: as for `splat`; each half of the array is 48 readable bytes, and the loads ask for no alignment.
        let (low, high) = unsafe { (vld3q_f32(points.as_ptr()), vld3q_f32(points[12..].as_ptr())) };
        [[low.0, high.0], [low.1, high.1], [low.2, high.2]]
    }
    #[inline(always)]
    fn join(self, low: &[f32; 4], high: &[f32; 4]) -> Pair {
        // SAFETY: as for `splat`; each reference is to 16 readable bytes, and the loads ask for no alignment.
        unsafe { [vld1q_f32(low.as_ptr()), vld1q_f32(high.as_ptr())] }
    }
    #[inline(always)]
    fn store(self, value: Pair) -> [f32; 8] {
        let mut values = [0.0; 8];
        // SAFETY: as for `splat`; each half of the array is 16 writable bytes, and the stores ask for no alignment.
        unsafe {
            vst1q_f32(values.as_mut_ptr(), value[0]);
            vst1q_f32(values[4..].as_mut_ptr(), value[1]);
        }
        values
    }
    #[inline(always)]
    fn transpose(self, rows: [Pair; 8]) -> [Pair; 8] {
        let rows = rows.map(|row| self.store(row));
        std::array::from_fn(|column| self.load(&std::array::from_fn(|row| rows[row][column])))
    }
    #[inline(always)]
    fn widen(self, [a, b]: Pair) -> Quad {
        // SAFETY: as for `splat`.
        unsafe {
            [vcvt_f64_f32(vget_low_f32(a)), vcvt_high_f64_f32(a), vcvt_f64_f32(vget_low_f32(b)), vcvt_high_f64_f32(b)]
        }
    }
    #[inline(always)]
    fn narrow(self, [a, b, c, d]: Quad) -> Pair {
        // SAFETY: as for `splat`.
        unsafe { [vcvt_high_f32_f64(vcvt_f32_f64(a), b), vcvt_high_f32_f64(vcvt_f32_f64(c), d)] }
    }
    #[inline(always)]
    fn add_f64(self, a: Quad, b: Quad) -> Quad {
        quarters!(a, b => vaddq_f64)
    }
    #[inline(always)]
    fn sub_f64(self, a: Quad, b: Quad) -> Quad {
        quarters!(a, b => vsubq_f64)
    }
    #[inline(always)]
    fn mul_f64(self, a: Quad, b: Quad) -> Quad {
        quarters!(a, b => vmulq_f64)
    }
    #[inline(always)]
    fn div_f64(self, a: Quad, b: Quad) -> Quad {
        quarters!(a, b => vdivq_f64)
    }
    #[inline(always)]
    fn positive_f64(self, value: Quad) -> u32 {
        // SAFETY: as for `splat`.
        let set = unsafe { [vcgtzq_f64(value[0]), vcgtzq_f64(value[1]), vcgtzq_f64(value[2]), vcgtzq_f64(value[3])] };
        quarter_bits(self, set)
    }
    #[inline(always)]
    fn negative_f64(self, value: Quad) -> u32 {
        // SAFETY: as for `splat`.
        let set = unsafe { [vcltzq_f64(value[0]), vcltzq_f64(value[1]), vcltzq_f64(value[2]), vcltzq_f64(value[3])] };
        quarter_bits(self, set)
    }
    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
    #[inline(always)]
    fn compact(self, masks: &[u8], bit: u32, ids: &[u16], out: &mut [u16]) -> usize {
        const WEIGHTS: [u8; 8] = [1, 2, 4, 8, 16, 32, 64, 128];
        let mut count = 0;
        for (masks, ids) in masks.chunks_exact(8).zip(ids.chunks_exact(8)) {
            let out = &mut out[count..count + 8];
            // SAFETY: a token exists only where NEON was detected; all slices have eight elements, the table's rows
            // sixteen bytes, and no access asks for alignment.
            unsafe {
                let set = vtst_u8(vld1_u8(masks.as_ptr()), vdup_n_u8(1 << bit));
                let wanted = usize::from(vaddv_u8(vand_u8(set, vld1_u8(WEIGHTS.as_ptr()))));
                let ids = vreinterpretq_u8_u16(vld1q_u16(ids.as_ptr()));
                let chosen = vqtbl1q_u8(ids, vld1q_u8(SHUFFLES[wanted].as_ptr()));
                vst1q_u16(out.as_mut_ptr(), vreinterpretq_u16_u8(chosen));
                count += wanted.count_ones() as usize;
            }
        }
        count
    }
}
