//! 256- and 512-bit vectors with mask registers and compression.

use std::arch::x86_64::*;

use super::{
    super::{Aligned, Arithmetic, Kernel, MOST_GROUP, Simd},
    Avx2,
    wide::Zmm,
};

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

/// Never inlined: a kernel that another one runs now and then is to keep its code and registers to itself.
#[inline(never)]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn enter_avx512<K: Kernel>(token: Avx512, kernel: K) -> K::Output {
    kernel.run(token)
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
    const IS_WIDE: bool = true;
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
    fn squares(self, [upper, lower]: [__m512; 2]) -> [__m512; 2] {
        // SAFETY: as for `both`.
        unsafe {
            [_mm512_shuffle_f32x4::<0b10_00_10_00>(upper, lower), _mm512_shuffle_f32x4::<0b11_01_11_01>(upper, lower)]
        }
    }
    #[inline(always)]
    fn load_wide(self, values: &[f32; 16]) -> __m512 {
        // SAFETY: as for `both`; the reference is to 64 readable bytes and the load asks for no alignment.
        unsafe { _mm512_loadu_ps(values.as_ptr()) }
    }
    /// As [`Avx2`] does it, sixteen at a time.
    #[inline(always)]
    fn load_points_wide(self, points: &[f32; 48]) -> [__m512; 3] {
        let [a, b, c]: &[[f32; 16]; 3] = bytemuck::cast_ref(points);
        let (a, b, c) = (self.load_wide(a), self.load_wide(b), self.load_wide(c));
        // SAFETY: as for `both`.
        unsafe {
            let x = _mm512_mask_blend_ps(0x2492, _mm512_mask_blend_ps(0x4924, a, b), c);
            let y = _mm512_mask_blend_ps(0x4924, _mm512_mask_blend_ps(0x9249, a, b), c);
            let z = _mm512_mask_blend_ps(0x9249, _mm512_mask_blend_ps(0x2492, a, b), c);
            let to_x = _mm512_setr_epi32(0, 3, 6, 9, 12, 15, 2, 5, 8, 11, 14, 1, 4, 7, 10, 13);
            let to_y = _mm512_setr_epi32(1, 4, 7, 10, 13, 0, 3, 6, 9, 12, 15, 2, 5, 8, 11, 14);
            let to_z = _mm512_setr_epi32(2, 5, 8, 11, 14, 1, 4, 7, 10, 13, 0, 3, 6, 9, 12, 15);
            [_mm512_permutexvar_ps(to_x, x), _mm512_permutexvar_ps(to_y, y), _mm512_permutexvar_ps(to_z, z)]
        }
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
    #[inline(always)]
    fn places(self, set: u64) -> [u32; 16] {
        const ALL: [u8; 64] = {
            let (mut all, mut place) = ([0; 64], 0);
            while place < 64 {
                all[place] = place as u8;
                place += 1;
            }
            all
        };
        // SAFETY: a token exists only where AVX-512 F and VBMI2 were detected; the array has 64 readable bytes.
        unsafe {
            let first = _mm512_maskz_compress_epi8(set, _mm512_loadu_si512(ALL.as_ptr().cast()));
            bytemuck::cast(self.store_wide(_mm512_castsi512_ps(_mm512_cvtepu8_epi32(_mm512_castsi512_si128(first)))))
        }
    }
    #[inline(always)]
    fn pick(self, [a, b, c, d]: [__m512; 4], places: &[u32; 16]) -> __m512 {
        let places = self.load_wide(bytemuck::cast_ref(places));
        // SAFETY: as for `both`.
        unsafe {
            let places = _mm512_castps_si512(places);
            let (low, high) = (_mm512_permutex2var_ps(a, places, b), _mm512_permutex2var_ps(c, places, d));
            _mm512_mask_blend_ps(_mm512_test_epi32_mask(places, _mm512_set1_epi32(32)), low, high)
        }
    }
    #[inline]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: a token exists only where every feature of `enter_avx512` was detected.
        unsafe { enter_avx512(self, kernel) }
    }
    vectors!();
    /// Near and far planes in turns, the latter with their sign changed, so that both are the greatest of four numbers: half
    /// of the operations. In streams that took as long on a Xeon (0.96 to 1.04), whose vectors of 512 bits have fewer units,
    /// and 1/1.05 of the time on a Zen 5.
    #[inline(always)]
    fn meet(
        self,
        [near, far]: &[[__m256; 3]; 2],
        inverse: &[f32; 3],
        bias: &[[f32; 2]; 3],
        interval: &[f32; 2],
    ) -> u32 {
        // SAFETY: as for `both`; a token exists only where BMI2 was detected, too.
        unsafe {
            let minus = _mm512_castsi512_ps(_mm512_set1_epi64(i64::MIN));
            let turns = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let mut ends = _mm512_xor_ps(in_turns(*interval), minus);
            for k in 0..3 {
                let (near, far) = (_mm512_castps256_ps512(near[k]), _mm512_castps256_ps512(far[k]));
                let planes = _mm512_xor_ps(_mm512_permutex2var_ps(near, turns, far), minus);
                let at = _mm512_fmsubadd_ps(planes, _mm512_set1_ps(inverse[k]), in_turns(bias[k]));
                ends = _mm512_max_ps(at, ends);
            }
            let swapped = _mm512_xor_ps(_mm512_permute_ps::<0xb1>(ends), _mm512_set1_ps(-0.0));
            let twice = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(ends, swapped);
            _pext_u32(twice.into(), 0x5555)
        }
    }
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

/// Two numbers in turns.
#[inline(always)]
fn in_turns(pair: [f32; 2]) -> __m512 {
    // SAFETY: called where a token proves AVX-512 F.
    unsafe { _mm512_castpd_ps(_mm512_set1_pd(bytemuck::cast(pair))) }
}
