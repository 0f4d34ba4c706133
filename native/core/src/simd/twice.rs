//! Sixteen lanes as two vectors of eight.

use super::{Arithmetic, Simd};

/// Proof of the instruction set whose vectors are taken in pairs.
#[derive(Debug, Clone, Copy)]
pub struct Twice<S>(pub S);

impl<S: Simd> Arithmetic for Twice<S> {
    const ALL: u32 = 0xffff;
    type F32 = [S::F32; 2];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F32 {
        [self.0.splat(value); 2]
    }
    #[inline(always)]
    fn add(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.add(a[0], b[0]), self.0.add(a[1], b[1])]
    }
    #[inline(always)]
    fn sub(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.sub(a[0], b[0]), self.0.sub(a[1], b[1])]
    }
    #[inline(always)]
    fn mul(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.mul(a[0], b[0]), self.0.mul(a[1], b[1])]
    }
    #[inline(always)]
    fn mul_add(self, a: Self::F32, b: Self::F32, c: Self::F32) -> Self::F32 {
        [self.0.mul_add(a[0], b[0], c[0]), self.0.mul_add(a[1], b[1], c[1])]
    }
    #[inline(always)]
    fn mul_sub(self, a: Self::F32, b: Self::F32, c: Self::F32) -> Self::F32 {
        [self.0.mul_sub(a[0], b[0], c[0]), self.0.mul_sub(a[1], b[1], c[1])]
    }
    #[inline(always)]
    fn min(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.min(a[0], b[0]), self.0.min(a[1], b[1])]
    }
    #[inline(always)]
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.max(a[0], b[0]), self.0.max(a[1], b[1])]
    }
    #[inline(always)]
    fn and(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.and(a[0], b[0]), self.0.and(a[1], b[1])]
    }
    #[inline(always)]
    fn xor(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.xor(a[0], b[0]), self.0.xor(a[1], b[1])]
    }
    #[inline(always)]
    fn div(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.div(a[0], b[0]), self.0.div(a[1], b[1])]
    }
    #[inline(always)]
    fn or(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.or(a[0], b[0]), self.0.or(a[1], b[1])]
    }
    #[inline(always)]
    fn sub_bits(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        [self.0.sub_bits(a[0], b[0]), self.0.sub_bits(a[1], b[1])]
    }
    #[inline(always)]
    fn if_ge(self, a: Self::F32, b: Self::F32, first: Self::F32, second: Self::F32) -> Self::F32 {
        [self.0.if_ge(a[0], b[0], first[0], second[0]), self.0.if_ge(a[1], b[1], first[1], second[1])]
    }
    #[inline(always)]
    fn le(self, a: Self::F32, b: Self::F32) -> u32 {
        self.0.le(a[0], b[0]) | self.0.le(a[1], b[1]) << 8
    }
    #[inline(always)]
    fn straddles_zero(self, a: Self::F32, b: Self::F32) -> u32 {
        self.0.straddles_zero(a[0], b[0]) | self.0.straddles_zero(a[1], b[1]) << 8
    }
    #[inline(always)]
    fn select(self, lanes: u32, first: Self::F32, second: Self::F32) -> Self::F32 {
        [self.0.select(lanes, first[0], second[0]), self.0.select(lanes >> 8, first[1], second[1])]
    }
}

/// The first and the last eight of sixteen numbers.
#[inline(always)]
pub fn halves(values: &[f32; 16]) -> &[[f32; 8]; 2] {
    bytemuck::cast_ref(values)
}
