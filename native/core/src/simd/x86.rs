//! x86-64 with AVX2 and FMA.

use std::arch::x86_64::*;

use super::{Kernel, Simd};

/// Proof that the processor has AVX2, FMA, BMI1, BMI2, LZCNT and POPCNT.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx2(());

impl Avx2 {
    /// The proof, where the processor gives it.
    pub fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn enter<K: Kernel>(token: Avx2, kernel: K) -> K::Output {
    kernel.run(token)
}

impl Simd for Avx2 {
    type F32 = __m256;

    #[inline]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: a token exists only where every feature of `enter` was detected.
        unsafe { enter(self, kernel) }
    }
    #[inline(always)]
    fn splat(self, value: f32) -> __m256 {
        // SAFETY: a token exists only where AVX was detected.
        unsafe { _mm256_set1_ps(value) }
    }
    #[inline(always)]
    fn load(self, values: &[f32; 8]) -> __m256 {
        // SAFETY: as for `splat`; the reference is to 32 readable bytes and the load asks for no alignment.
        unsafe { _mm256_loadu_ps(values.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, value: __m256) -> [f32; 8] {
        let mut values = [0.0; 8];
        // SAFETY: as for `splat`; the array is 32 writable bytes and the store asks for no alignment.
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), value) };
        values
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as for `splat`.
        unsafe { _mm256_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as for `splat`.
        unsafe { _mm256_mul_ps(a, b) }
    }
    #[inline(always)]
    fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        // SAFETY: a token exists only where FMA was detected.
        unsafe { _mm256_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as for `splat`.
        unsafe { _mm256_min_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as for `splat`.
        unsafe { _mm256_max_ps(a, b) }
    }
    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as for `splat`.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
    }
    #[inline(always)]
    fn straddles_zero(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as for `splat`.
        unsafe {
            let zero = _mm256_setzero_ps();
            let below = _mm256_cmp_ps::<_CMP_LT_OQ>(a, zero);
            let above = _mm256_cmp_ps::<_CMP_GT_OQ>(b, zero);
            _mm256_movemask_ps(_mm256_and_ps(below, above)) as u32
        }
    }
}
