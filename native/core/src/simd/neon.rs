//! aarch64: pairs of 128-bit NEON vectors, which every such processor has.

use std::arch::aarch64::*;

use super::{Kernel, Simd, shuffles::SHUFFLES};

/// Proof that the processor has NEON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Neon(());

impl Neon {
    /// The proof, where the processor gives it.
    pub fn detect() -> Option<Self> {
        std::arch::is_aarch64_feature_detected!("neon").then_some(Self(()))
    }
}

#[target_feature(enable = "neon")]
fn enter_neon<K: Kernel>(token: Neon, kernel: K) -> K::Output {
    kernel.run(token)
}

/// Lanes 0 to 3, then 4 to 7.
type Pair = [float32x4_t; 2];

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

/// The halves of comparisons as bits.
#[inline(always)]
fn bits(_: Neon, [low, high]: [uint32x4_t; 2]) -> u32 {
    const WEIGHTS: [u32; 8] = [1, 2, 4, 8, 16, 32, 64, 128];
    // SAFETY: the token exists only where NEON was detected; the array has eight readable numbers.
    unsafe {
        let weigh = |lanes, first: usize| vandq_u32(lanes, vld1q_u32(WEIGHTS[first..].as_ptr()));
        vaddvq_u32(vorrq_u32(weigh(low, 0), weigh(high, 4)))
    }
}

impl Simd for Neon {
    type F32 = Pair;

    #[inline]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: a token exists only where NEON was detected.
        unsafe { enter_neon(self, kernel) }
    }
    #[inline(always)]
    fn splat(self, value: f32) -> Pair {
        // SAFETY: a token exists only where NEON was detected.
        unsafe { [vdupq_n_f32(value); 2] }
    }
    #[inline(always)]
    fn load(self, values: &[f32; 8]) -> Pair {
        // SAFETY: as for `splat`; each half of the array is 16 readable bytes, and the loads ask for no alignment.
        unsafe { [vld1q_f32(values.as_ptr()), vld1q_f32(values[4..].as_ptr())] }
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
    fn add(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vaddq_f32(a, b))
    }
    #[inline(always)]
    fn div(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vdivq_f32(a, b))
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
    fn sub_bits(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vreinterpretq_f32_u32(vsubq_u32(vreinterpretq_u32_f32(a), vreinterpretq_u32_f32(b))))
    }
    #[inline(always)]
    fn if_ge(self, a: Pair, b: Pair, first: Pair, second: Pair) -> Pair {
        halves!(a, b, first, second => vbslq_f32(vcgeq_f32(a, b), first, second))
    }
    #[inline(always)]
    fn transpose(self, rows: [Pair; 8]) -> [Pair; 8] {
        let rows = rows.map(|row| self.store(row));
        std::array::from_fn(|column| self.load(&std::array::from_fn(|row| rows[row][column])))
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
    fn min(self, a: Pair, b: Pair) -> Pair {
        // Not `vminq_f32`: that returns not-a-number where either argument is.
        halves!(a, b => vbslq_f32(vcltq_f32(a, b), a, b))
    }
    #[inline(always)]
    fn max(self, a: Pair, b: Pair) -> Pair {
        halves!(a, b => vbslq_f32(vcgtq_f32(a, b), a, b))
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
