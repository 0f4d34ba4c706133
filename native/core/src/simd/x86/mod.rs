//! x86-64: AVX2 with FMA, and the AVX-512 subsets of Ice Lake and Zen 4.

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
        /// Coordinate `k` of point `i` is number `3 * i + k`, so those of one axis stand in lanes of their own.
        #[inline(always)]
        fn load_points(self, points: &[f32; 24]) -> [__m256; 3] {
            let [a, b, c]: &[[f32; 8]; 3] = bytemuck::cast_ref(points);
            let (a, b, c) = (self.load(a), self.load(b), self.load(c));
            // SAFETY: as for `splat`; a token exists only where AVX2 was detected.
            unsafe {
                let x = _mm256_blend_ps::<0b00100100>(_mm256_blend_ps::<0b10010010>(a, b), c);
                let y = _mm256_blend_ps::<0b01001001>(_mm256_blend_ps::<0b00100100>(a, b), c);
                let z = _mm256_blend_ps::<0b10010010>(_mm256_blend_ps::<0b01001001>(a, b), c);
                [
                    _mm256_permutevar8x32_ps(x, _mm256_setr_epi32(0, 3, 6, 1, 4, 7, 2, 5)),
                    _mm256_permutevar8x32_ps(y, _mm256_setr_epi32(1, 4, 7, 2, 5, 0, 3, 6)),
                    _mm256_permutevar8x32_ps(z, _mm256_setr_epi32(2, 5, 0, 3, 6, 1, 4, 7)),
                ]
            }
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
        fn stream(self, from: &[f32; 8], to: &mut [Aligned; 2]) {
            let (from, to): (*const f32, *mut f32) = (from.as_ptr(), to.as_mut_ptr().cast());
            // SAFETY: as for `splat`; the references are to 32 bytes, and the type of the second begins where the stores ask for it.
            unsafe {
                _mm_stream_ps(to, _mm_loadu_ps(from));
                _mm_stream_ps(to.add(4), _mm_loadu_ps(from.add(4)));
            }
        }
        #[inline(always)]
        fn fence(self) {
            // SAFETY: every processor with AVX has it.
            unsafe { _mm_sfence() };
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
        fn div_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
            // SAFETY: as for `splat`.
            unsafe { [_mm256_div_pd(a[0], b[0]), _mm256_div_pd(a[1], b[1])] }
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

mod avx2;
mod avx512;
mod wide;

pub use avx2::Avx2;
pub use avx512::Avx512;
