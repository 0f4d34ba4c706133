//! What rays hit, by column.

use bytemuck::Pod;

use crate::{
    simd::{Aligned, Simd},
    triangle::LANES,
};

/// The primitive of a ray that hit nothing.
pub const MISS: u32 = u32::MAX;

/// What a closest-hit query found, one element a ray.
///
/// The hit point is `(1-u-v)*v0 + u*v1 + v*v2`. A miss has t = infinity, primitive = [`MISS`] and u = v = 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hits {
    /// Ray parameter, in lengths of the direction.
    pub t: Vec<f32>,
    /// Index of the triangle in its mesh.
    pub primitive: Vec<u32>,
    /// Weight of the triangle's second corner.
    pub u: Vec<f32>,
    /// Weight of the triangle's third corner.
    pub v: Vec<f32>,
}

/// Where the hits of a batch are written.
#[derive(Debug)]
pub struct HitsMut<'a> {
    /// See [`Hits::t`].
    pub t: &'a mut [f32],
    /// See [`Hits::primitive`].
    pub primitive: &'a mut [u32],
    /// See [`Hits::u`].
    pub u: &'a mut [f32],
    /// See [`Hits::v`].
    pub v: &'a mut [f32],
}

impl<'a> HitsMut<'a> {
    /// How many rays there is room for.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there is room for none.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Consecutive parts of at most `size` rays.
    pub fn parts(self, size: usize) -> impl ExactSizeIterator<Item = HitsMut<'a>> + Send {
        let columns = self.t.chunks_mut(size).zip(self.primitive.chunks_mut(size));
        let columns = columns.zip(self.u.chunks_mut(size).zip(self.v.chunks_mut(size)));
        columns.map(|((t, primitive), (u, v))| HitsMut { t, primitive, u, v })
    }

    /// Write the hits of rays `index` to `index + 7`.
    #[inline(always)]
    pub(crate) fn set_eight(&mut self, index: usize, hits: &Eight) {
        self.t[index..index + LANES].copy_from_slice(&hits.t);
        self.primitive[index..index + LANES].copy_from_slice(&hits.primitive);
        self.u[index..index + LANES].copy_from_slice(&hits.u);
        self.v[index..index + LANES].copy_from_slice(&hits.v);
    }

    /// The hits of `count` rays from `index` on, to be written by [`Simd::stream`]; nothing where the columns do not begin as
    /// it asks for.
    #[inline(always)]
    pub(crate) fn aligned(&mut self, index: usize, count: usize) -> Option<AlignedHits<'_>> {
        Some(AlignedHits {
            t: aligned(&mut self.t[index..index + count])?,
            primitive: aligned(&mut self.primitive[index..index + count])?,
            u: aligned(&mut self.u[index..index + count])?,
            v: aligned(&mut self.v[index..index + count])?,
        })
    }

    /// Write one hit.
    #[inline(always)]
    pub fn set(&mut self, index: usize, hit: Hit) {
        self.t[index] = hit.t;
        self.primitive[index] = hit.primitive;
        self.u[index] = hit.u;
        self.v[index] = hit.v;
    }
}

/// Where hits are written that nobody reads soon, eight by eight.
pub(crate) struct AlignedHits<'a> {
    t: &'a mut [[Aligned; 2]],
    primitive: &'a mut [[Aligned; 2]],
    u: &'a mut [[Aligned; 2]],
    v: &'a mut [[Aligned; 2]],
}

impl AlignedHits<'_> {
    /// Write the hits of rays `index` to `index + 7` by [`Simd::stream`].
    #[inline(always)]
    pub fn set_eight<S: Simd>(&mut self, simd: S, index: usize, hits: &Eight) {
        let eight = index / LANES;
        simd.stream(&hits.t, &mut self.t[eight]);
        simd.stream(bytemuck::cast_ref(&hits.primitive), &mut self.primitive[eight]);
        simd.stream(&hits.u, &mut self.u[eight]);
        simd.stream(&hits.v, &mut self.v[eight]);
    }
}

#[inline(always)]
fn aligned<T: Pod>(column: &mut [T]) -> Option<&mut [[Aligned; 2]]> {
    bytemuck::try_cast_slice_mut(column).ok()
}

/// Eight hits by column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eight {
    /// See [`Hits::t`].
    pub t: [f32; LANES],
    /// See [`Hits::primitive`].
    pub primitive: [u32; LANES],
    /// See [`Hits::u`].
    pub u: [f32; LANES],
    /// See [`Hits::v`].
    pub v: [f32; LANES],
}

impl Eight {
    /// Nothing was hit.
    pub const MISSES: Self =
        Self { t: [f32::INFINITY; LANES], primitive: [MISS; LANES], u: [0.0; LANES], v: [0.0; LANES] };
}

/// One hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Triangle, or [`MISS`].
    pub primitive: u32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Self = Self { t: f32::INFINITY, primitive: MISS, u: 0.0, v: 0.0 };

    /// In a row; the triangle is bits.
    pub(crate) const fn to_row(self) -> [f32; 4] {
        [self.t, f32::from_bits(self.primitive), self.u, self.v]
    }

    /// From such a row.
    pub(crate) const fn of_row(&[t, primitive, u, v]: &[f32; 4]) -> Self {
        Self { t, primitive: primitive.to_bits(), u, v }
    }

    /// The order of hits along a ray: by t, and among equal t by primitive. Every accelerator reports the first in
    /// this order, so all of them agree to the bit.
    #[inline]
    pub fn precedes(&self, other: &Self) -> bool {
        self.t < other.t || (self.t == other.t && self.primitive < other.primitive)
    }
}

impl Hits {
    /// `count` misses.
    pub fn misses(count: usize) -> Self {
        Self { t: vec![f32::INFINITY; count], primitive: vec![MISS; count], u: vec![0.0; count], v: vec![0.0; count] }
    }

    /// Make room for `count` rays; what is in it is unspecified until a query writes it.
    pub fn resize(&mut self, count: usize) {
        self.t.resize(count, f32::INFINITY);
        self.primitive.resize(count, MISS);
        self.u.resize(count, 0.0);
        self.v.resize(count, 0.0);
    }

    /// For a query to write to.
    pub fn as_mut(&mut self) -> HitsMut<'_> {
        HitsMut { t: &mut self.t, primitive: &mut self.primitive, u: &mut self.u, v: &mut self.v }
    }

    /// How many rays this speaks of.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether it speaks of none.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// The hit of ray `index`.
    pub fn get(&self, index: usize) -> Hit {
        Hit { t: self.t[index], primitive: self.primitive[index], u: self.u[index], v: self.v[index] }
    }
}
