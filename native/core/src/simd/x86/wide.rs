//! x86-64: sixteen lanes in one vector of 512 bits.

use std::arch::x86_64::*;

use super::{super::Arithmetic, Avx512};

/// Proof that the processor has AVX-512 F and DQ.
#[derive(Debug, Clone, Copy)]
pub struct Zmm(());

impl Zmm {
    /// What the proof of more proves.
    #[inline(always)]
    pub fn new(_: Avx512) -> Self {
        Self(())
    }
}

impl Arithmetic for Zmm {
    const ALL: u32 = 0xffff;
    type F32 = __m512;

    #[inline(always)]
    fn splat(self, value: f32) -> __m512 {
        // SAFETY: a token exists only where AVX-512 F was detected.
        unsafe { _mm512_set1_ps(value) }
    }
    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_mul_ps(a, b) }
    }
    #[inline(always)]
    fn mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    fn mul_sub(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_fmsub_ps(a, b, c) }
    }
    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_min_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_max_ps(a, b) }
    }
    #[inline(always)]
    fn and(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: a token exists only where AVX-512 DQ was detected.
        unsafe { _mm512_and_ps(a, b) }
    }
    #[inline(always)]
    fn xor(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `and`.
        unsafe { _mm512_xor_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_div_ps(a, b) }
    }
    #[inline(always)]
    fn or(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `and`.
        unsafe { _mm512_or_ps(a, b) }
    }
    #[inline(always)]
    fn sub_bits(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_castsi512_ps(_mm512_sub_epi32(_mm512_castps_si512(a), _mm512_castps_si512(b))) }
    }
    #[inline(always)]
    fn if_ge(self, a: __m512, b: __m512, first: __m512, second: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(a, b), second, first) }
    }
    #[inline(always)]
    fn le(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as for `splat`.
        u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) })
    }
    #[inline(always)]
    fn straddles_zero(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as for `splat`.
        unsafe {
            let zero = _mm512_setzero_ps();
            let below = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, zero);
            u32::from(_mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(below, b, zero))
        }
    }
    #[inline(always)]
    fn select(self, lanes: u32, first: __m512, second: __m512) -> __m512 {
        // SAFETY: as for `splat`.
        unsafe { _mm512_mask_blend_ps(lanes as u16, second, first) }
    }
}
