//! Asking for the corners of triangles before they are needed: builders go through a mesh in an order that misses every
//! cache. Measured on 871K triangles, it halves the time of writing leaves.

use crate::{mesh::Reader, simd::Simd};

/// How many triangles ahead indices are asked for, and, once those are there, corners. Half as far, `lbvh` took 0.99 to
/// 1.07 times as long (Zen 5).
const INDICES: usize = 64;
const CORNERS: usize = 32;

/// Ask for what will be needed soon by who goes through triangles and is at `place`.
#[inline(always)]
pub fn ask<S: Simd>(simd: S, mesh: Reader<'_>, place: usize, triangle: impl Fn(usize) -> Option<u32>) {
    if let Some(triangle) = triangle(place + INDICES)
        && let Some(indices) = mesh.triangle(triangle)
    {
        simd.prefetch(indices);
    }
    if let Some(triangle) = triangle(place + CORNERS)
        && let Some(indices) = mesh.triangle(triangle)
    {
        for &index in indices {
            simd.prefetch(&mesh.numbers(index)[0]);
        }
    }
}
