//! x86-64: AVX2 with FMA, and the AVX-512 subsets of Ice Lake and Zen 4.

use std::arch::x86_64::*;

use super::{Arithmetic, Kernel, MOST_GROUP, Simd, Twice, shuffles::SHUFFLES, twice, wide::Zmm};

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

/// Proof that the processor has all of [`Avx2`] and AVX-512 F, BW, DQ, VL and VBMI2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx512(());

impl Avx512 {
    /// The proof, where the processor gives it.
    pub fn detect() -> Option<Self> {
        let has = Avx2::detect().is_some()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512vbmi2");
        has.then_some(Self(()))
    }
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn enter_avx2<K: Kernel>(token: Avx2, kernel: K) -> K::Output {
    kernel.run(token)
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn enter_avx512<K: Kernel>(token: Avx512, kernel: K) -> K::Output {
    kernel.run(token)
}

/// The operations on 256-bit vectors that both tokens share.
macro_rules! arithmetic {
    () => {
        const ALL: u32 = 0xff;
        type F32 = __m256;

        #[inline(always)]
        fn splat(self, value: f32) -> __m256 {
            // SAFETY: a token exists only where AVX was detected.
            unsafe { _mm256_set1_ps(value) }
        }
        #[inline(always)]
        fn add(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as for `splat`.
            unsafe { _mm256_add_ps(a, b) }
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
        fn mul_sub(self, a: __m256, b: __m256, c: __m256) -> __m256 {
            // SAFETY: a token exists only where FMA was detected.
            unsafe { _mm256_fmsub_ps(a, b, c) }
        }
        #[inline(always)]
        fn div(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as for `splat`.
            unsafe { _mm256_div_ps(a, b) }
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
        fn and(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as for `splat`.
            unsafe { _mm256_and_ps(a, b) }
        }
        #[inline(always)]
        fn or(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as for `splat`.
            unsafe { _mm256_or_ps(a, b) }
        }
        #[inline(always)]
        fn xor(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as for `splat`.
            unsafe { _mm256_xor_ps(a, b) }
        }
        #[inline(always)]
        fn sub_bits(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: a token exists only where AVX2 was detected.
            unsafe { _mm256_castsi256_ps(_mm256_sub_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b))) }
        }
        #[inline(always)]
        fn if_ge(self, a: __m256, b: __m256, first: __m256, second: __m256) -> __m256 {
            // SAFETY: as for `splat`.
            unsafe { _mm256_blendv_ps(second, first, _mm256_cmp_ps::<_CMP_GE_OQ>(a, b)) }
        }
    };
}

/// What else both tokens do with these vectors.
macro_rules! vectors {
    () => {
        #[inline(always)]
        fn load(self, values: &[f32; 8]) -> __m256 {
            // SAFETY: as for `splat`; the reference is to 32 readable bytes and the load asks for no alignment.
            unsafe { _mm256_loadu_ps(values.as_ptr()) }
        }
        #[inline(always)]
        fn join(self, low: &[f32; 4], high: &[f32; 4]) -> __m256 {
            // SAFETY: as for `splat`; the references are to 16 readable bytes and the loads ask for no alignment.
            unsafe { _mm256_loadu2_m128(high.as_ptr(), low.as_ptr()) }
        }
        #[inline(always)]
        fn store(self, value: __m256) -> [f32; 8] {
            let mut values = [0.0; 8];
            // SAFETY: as for `splat`; the array is 32 writable bytes and the store asks for no alignment.
            unsafe { _mm256_storeu_ps(values.as_mut_ptr(), value) };
            values
        }
        #[inline(always)]
        fn transpose(self, r: [__m256; 8]) -> [__m256; 8] {
            // SAFETY: as for `splat`.
            unsafe {
                let a0 = _mm256_unpacklo_ps(r[0], r[1]);
                let a1 = _mm256_unpackhi_ps(r[0], r[1]);
                let a2 = _mm256_unpacklo_ps(r[2], r[3]);
                let a3 = _mm256_unpackhi_ps(r[2], r[3]);
                let a4 = _mm256_unpacklo_ps(r[4], r[5]);
                let a5 = _mm256_unpackhi_ps(r[4], r[5]);
                let a6 = _mm256_unpacklo_ps(r[6], r[7]);
                let a7 = _mm256_unpackhi_ps(r[6], r[7]);
                let b0 = _mm256_shuffle_ps::<0x44>(a0, a2);
                let b1 = _mm256_shuffle_ps::<0xee>(a0, a2);
                let b2 = _mm256_shuffle_ps::<0x44>(a1, a3);
                let b3 = _mm256_shuffle_ps::<0xee>(a1, a3);
                let b4 = _mm256_shuffle_ps::<0x44>(a4, a6);
                let b5 = _mm256_shuffle_ps::<0xee>(a4, a6);
                let b6 = _mm256_shuffle_ps::<0x44>(a5, a7);
                let b7 = _mm256_shuffle_ps::<0xee>(a5, a7);
                [
                    _mm256_permute2f128_ps::<0x20>(b0, b4),
                    _mm256_permute2f128_ps::<0x20>(b1, b5),
                    _mm256_permute2f128_ps::<0x20>(b2, b6),
                    _mm256_permute2f128_ps::<0x20>(b3, b7),
                    _mm256_permute2f128_ps::<0x31>(b0, b4),
                    _mm256_permute2f128_ps::<0x31>(b1, b5),
                    _mm256_permute2f128_ps::<0x31>(b2, b6),
                    _mm256_permute2f128_ps::<0x31>(b3, b7),
                ]
            }
        }
        #[inline(always)]
        fn prefetch<T>(self, value: &T) {
            const LINE: usize = 64;
            let first: *const i8 = std::ptr::from_ref(value).cast();
            for offset in (0..size_of::<T>()).step_by(LINE) {
                // SAFETY: a prefetch reads nothing and faults nowhere; the sum stays within the value.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(first.add(offset)) };
            }
        }
        #[inline(always)]
        fn widen(self, value: __m256) -> [__m256d; 2] {
            // SAFETY: as for `splat`.
            unsafe {
                let high = _mm256_extractf128_ps::<1>(value);
                [_mm256_cvtps_pd(_mm256_castps256_ps128(value)), _mm256_cvtps_pd(high)]
            }
        }
        #[inline(always)]
        fn narrow(self, value: [__m256d; 2]) -> __m256 {
            // SAFETY: as for `splat`.
            unsafe { _mm256_set_m128(_mm256_cvtpd_ps(value[1]), _mm256_cvtpd_ps(value[0])) }
        }
        #[inline(always)]
        fn add_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
            // SAFETY: as for `splat`.
            unsafe { [_mm256_add_pd(a[0], b[0]), _mm256_add_pd(a[1], b[1])] }
        }
        #[inline(always)]
        fn sub_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
            // SAFETY: as for `splat`.
            unsafe { [_mm256_sub_pd(a[0], b[0]), _mm256_sub_pd(a[1], b[1])] }
        }
        #[inline(always)]
        fn mul_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
            // SAFETY: as for `splat`.
            unsafe { [_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1])] }
        }
        #[inline(always)]
        fn reciprocal_f64(self, a: [__m256d; 2]) -> [__m256d; 2] {
            // SAFETY: as for `splat`.
            unsafe {
                let one = _mm256_set1_pd(1.0);
                [_mm256_div_pd(one, a[0]), _mm256_div_pd(one, a[1])]
            }
        }
        #[inline(always)]
        fn positive_f64(self, value: [__m256d; 2]) -> u32 {
            // SAFETY: as for `splat`.
            unsafe {
                let zero = _mm256_setzero_pd();
                let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(value[0], zero));
                let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(value[1], zero));
                low as u32 | (high as u32) << 4
            }
        }
        #[inline(always)]
        fn negative_f64(self, value: [__m256d; 2]) -> u32 {
            // SAFETY: as for `splat`.
            unsafe {
                let zero = _mm256_setzero_pd();
                let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(value[0], zero));
                let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(value[1], zero));
                low as u32 | (high as u32) << 4
            }
        }
    };
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

impl Arithmetic for Avx512 {
    arithmetic!();
    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: a token exists only where AVX-512 F and VL were detected.
        u32::from(unsafe { _mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b) })
    }
    #[inline(always)]
    fn straddles_zero(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as for `le`.
        unsafe {
            let zero = _mm256_setzero_ps();
            let below = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, zero);
            u32::from(_mm256_mask_cmp_ps_mask::<_CMP_GT_OQ>(below, b, zero))
        }
    }
    #[inline(always)]
    fn select(self, lanes: u32, first: __m256, second: __m256) -> __m256 {
        // SAFETY: as for `le`.
        unsafe { _mm256_mask_blend_ps(lanes as u8, second, first) }
    }
}

impl Simd for Avx512 {
    const GROUP: usize = MOST_GROUP;
    type F64 = [__m256d; 2];
    type Wide = Zmm;

    #[inline(always)]
    fn wide(self) -> Zmm {
        Zmm::new(self)
    }
    #[inline(always)]
    fn both(self, halves: [__m256; 2]) -> __m512 {
        // SAFETY: a token exists only where AVX-512 F and DQ were detected.
        unsafe { _mm512_insertf32x8::<1>(_mm512_castps256_ps512(halves[0]), halves[1]) }
    }
    #[inline(always)]
    fn halves(self, value: __m512) -> [__m256; 2] {
        // SAFETY: as for `both`.
        unsafe { [_mm512_castps512_ps256(value), _mm512_extractf32x8_ps::<1>(value)] }
    }
    #[inline(always)]
    fn load_wide(self, values: &[f32; 16]) -> __m512 {
        // SAFETY: as for `both`; the reference is to 64 readable bytes and the load asks for no alignment.
        unsafe { _mm512_loadu_ps(values.as_ptr()) }
    }
    #[inline(always)]
    fn columns(self, rows: &[&[f32; 4]; 16]) -> [__m512; 4] {
        let mut quads = [self.wide().splat(0.0); 4];
        for first in 0..4 {
            // SAFETY: as for `both`; every reference is to 16 readable bytes and the loads ask for no alignment.
            unsafe {
                let quad = _mm512_castps128_ps512(_mm_loadu_ps(rows[first].as_ptr()));
                let quad = _mm512_insertf32x4::<1>(quad, _mm_loadu_ps(rows[4 + first].as_ptr()));
                let quad = _mm512_insertf32x4::<2>(quad, _mm_loadu_ps(rows[8 + first].as_ptr()));
                quads[first] = _mm512_insertf32x4::<3>(quad, _mm_loadu_ps(rows[12 + first].as_ptr()));
            }
        }
        // SAFETY: as for `both`.
        unsafe {
            let a = _mm512_unpacklo_ps(quads[0], quads[1]);
            let b = _mm512_unpackhi_ps(quads[0], quads[1]);
            let c = _mm512_unpacklo_ps(quads[2], quads[3]);
            let d = _mm512_unpackhi_ps(quads[2], quads[3]);
            [
                _mm512_shuffle_ps::<0x44>(a, c),
                _mm512_shuffle_ps::<0xee>(a, c),
                _mm512_shuffle_ps::<0x44>(b, d),
                _mm512_shuffle_ps::<0xee>(b, d),
            ]
        }
    }
    #[inline(always)]
    fn store_wide(self, value: __m512) -> [f32; 16] {
        let mut values = [0.0; 16];
        // SAFETY: as for `both`; the array is 64 writable bytes and the store asks for no alignment.
        unsafe { _mm512_storeu_ps(values.as_mut_ptr(), value) };
        values
    }
    #[inline]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: a token exists only where every feature of `enter_avx512` was detected.
        unsafe { enter_avx512(self, kernel) }
    }
    vectors!();
    #[inline(always)]
    fn compact(self, masks: &[u8], bit: u32, ids: &[u16], out: &mut [u16]) -> usize {
        let mut count = 0;
        for (masks, ids) in masks.chunks_exact(MOST_GROUP).zip(ids.chunks_exact(MOST_GROUP)) {
            let out = &mut out[count..count + MOST_GROUP];
            // SAFETY: a token exists only where AVX-512 F, BW, VL and VBMI2 were detected; `masks` has 32 readable
            // bytes, `ids` 64 readable and `out` 64 writable ones, and no access asks for alignment.
            unsafe {
                let bits = _mm256_set1_epi8((1u8 << bit) as i8);
                let wanted = _mm256_test_epi8_mask(_mm256_loadu_si256(masks.as_ptr().cast()), bits);
                let chosen = _mm512_maskz_compress_epi16(wanted, _mm512_loadu_si512(ids.as_ptr().cast()));
                _mm512_storeu_si512(out.as_mut_ptr().cast(), chosen);
                count += wanted.count_ones() as usize;
            }
        }
        count
    }
}
