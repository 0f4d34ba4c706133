//! 256-bit vectors with fused multiply-add.

use std::arch::x86_64::*;

use super::super::{Aligned, Arithmetic, Kernel, Simd, Twice, shuffles::SHUFFLES, twice};

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

/// Never inlined: a kernel that another one runs now and then is to keep its code and registers to itself.
#[inline(never)]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn enter_avx2<K: Kernel>(token: Avx2, kernel: K) -> K::Output {
    kernel.run(token)
}

impl Arithmetic for Avx2 {
    arithmetic!();
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
    #[inline(always)]
    fn select(self, lanes: u32, first: __m256, second: __m256) -> __m256 {
        // SAFETY: a token exists only where AVX2 was detected.
        unsafe {
            let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(lanes as i32), bits), bits);
            _mm256_blendv_ps(second, first, _mm256_castsi256_ps(set))
        }
    }
}

impl Simd for Avx2 {
    type F64 = [__m256d; 2];
    type Wide = Twice<Self>;

    #[inline(always)]
    fn wide(self) -> Twice<Self> {
        Twice(self)
    }
    #[inline(always)]
    fn both(self, halves: [__m256; 2]) -> [__m256; 2] {
        halves
    }
    #[inline(always)]
    fn halves(self, value: [__m256; 2]) -> [__m256; 2] {
        value
    }
    #[inline(always)]
    fn load_wide(self, values: &[f32; 16]) -> [__m256; 2] {
        let [low, high] = twice::halves(values);
        [self.load(low), self.load(high)]
    }
    #[inline(always)]
    fn columns(self, rows: &[&[f32; 4]; 16]) -> [[__m256; 2]; 4] {
        let mut columns = [[self.splat(0.0); 2]; 4];
        for half in 0..2 {
            let mut quads = [self.splat(0.0); 4];
            for first in 0..4 {
                quads[first] = self.join(rows[8 * half + first], rows[8 * half + 4 + first]);
            }
            // SAFETY: as for `splat`.
            unsafe {
                let a = _mm256_unpacklo_ps(quads[0], quads[1]);
                let b = _mm256_unpackhi_ps(quads[0], quads[1]);
                let c = _mm256_unpacklo_ps(quads[2], quads[3]);
                let d = _mm256_unpackhi_ps(quads[2], quads[3]);
                columns[0][half] = _mm256_shuffle_ps::<0x44>(a, c);
                columns[1][half] = _mm256_shuffle_ps::<0xee>(a, c);
                columns[2][half] = _mm256_shuffle_ps::<0x44>(b, d);
                columns[3][half] = _mm256_shuffle_ps::<0xee>(b, d);
            }
        }
        columns
    }
    #[inline(always)]
    fn store_wide(self, value: [__m256; 2]) -> [f32; 16] {
        bytemuck::cast([self.store(value[0]), self.store(value[1])])
    }
    #[inline]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: a token exists only where every feature of `enter_avx2` was detected.
        unsafe { enter_avx2(self, kernel) }
    }
    vectors!();
    #[inline(always)]
    fn compact(self, masks: &[u8], bit: u32, ids: &[u16], out: &mut [u16]) -> usize {
        let mut count = 0;
        let shift = i64::from(7 - bit);
        for (masks, ids) in masks.chunks_exact(8).zip(ids.chunks_exact(8)) {
            let out = &mut out[count..count + 8];
            // SAFETY: a token exists only where AVX2 was detected; all three slices have eight elements, the table's
            // rows sixteen bytes, and no access asks for alignment.
            unsafe {
                let bits = _mm_sll_epi16(_mm_loadl_epi64(masks.as_ptr().cast()), _mm_cvtsi64_si128(shift));
                let wanted = (_mm_movemask_epi8(bits) & 0xff) as usize;
                let order = _mm_loadu_si128(SHUFFLES[wanted].as_ptr().cast());
                let chosen = _mm_shuffle_epi8(_mm_loadu_si128(ids.as_ptr().cast()), order);
                _mm_storeu_si128(out.as_mut_ptr().cast(), chosen);
                count += wanted.count_ones() as usize;
            }
        }
        count
    }
}
