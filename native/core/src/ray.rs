//! Batches of rays and hits in structure-of-arrays form.

use bytemuck::Pod;
use glam::Vec3;

use crate::{
    Error,
    simd::{Aligned, Arithmetic, Simd, read_alone},
    traverse::frame::{Domain, Frame},
    triangle::LANES,
};

/// The primitive of a ray that hit nothing.
pub const MISS: u32 = u32::MAX;

/// A strided, read-only column of numbers: element `i` stands at `i * stride`. Stride 0 repeats one value.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    values: &'a [f32],
    stride: usize,
}

impl<'a> Column<'a> {
    /// A contiguous column.
    pub fn new(values: &'a [f32]) -> Self {
        Self { values, stride: 1 }
    }

    /// A column whose elements are `stride` apart in `values`.
    pub fn strided(values: &'a [f32], stride: usize) -> Self {
        Self { values, stride }
    }

    /// One value for every ray.
    pub fn constant(value: &'a f32) -> Self {
        Self { values: std::slice::from_ref(value), stride: 0 }
    }

    /// How many rays it can serve.
    fn capacity(&self) -> usize {
        if self.stride == 0 { usize::MAX } else { self.values.len().div_ceil(self.stride) }
    }

    /// The values of rays `index` to `index + 7`.
    #[inline(always)]
    fn eight<S: Simd>(&self, simd: S, index: usize) -> S::F32 {
        match self.stride {
            0 => simd.splat(self.values[0]),
            1 => simd.load(self.span(index)),
            3 => simd.load(&spread::<22, 3>(self.span(3 * index))),
            stride => {
                let mut eight = [0.0; 8];
                for lane in 0..8 {
                    eight[lane] = self.values[(index + lane) * stride];
                }
                simd.load(&eight)
            }
        }
    }

    /// The values of rays `index` to `index + 15`.
    #[inline(always)]
    fn sixteen<S: Simd>(&self, simd: S, index: usize) -> <S::Wide as Arithmetic>::F32 {
        match self.stride {
            0 => simd.wide().splat(self.values[0]),
            1 => simd.load_wide(self.span(index)),
            _ => simd.both([self.eight(simd, index), self.eight(simd, index + LANES)]),
        }
    }

    /// The values from one on.
    #[inline(always)]
    fn span<const N: usize>(&self, first: usize) -> &[f32; N] {
        self.values[first..].first_chunk().expect("every column has a value for every ray")
    }

    /// The value of ray `index`.
    #[inline(always)]
    pub fn get(&self, index: usize) -> f32 {
        self.values[index * self.stride]
    }
}

/// Eight numbers that stand so many places apart, as coordinates of points do in rows.
#[inline(always)]
fn spread<const N: usize, const STRIDE: usize>(values: &[f32; N]) -> [f32; 8] {
    let mut eight = [0.0; 8];
    for lane in 0..8 {
        eight[lane] = values[STRIDE * lane];
    }
    eight
}

/// A batch of rays: origin, direction (any length but zero) and the parameter interval `[tmin, tmax]`, both ends
/// included, in lengths of the direction.
#[derive(Debug, Clone, Copy)]
pub struct Rays<'a> {
    origin: [Column<'a>; 3],
    direction: [Column<'a>; 3],
    tmin: Column<'a>,
    tmax: Column<'a>,
    first: usize,
    count: usize,
}

/// One ray, gathered from its batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; its length is the unit of `tmin`, `tmax` and of every hit's `t`.
    pub direction: Vec3,
    /// Nearest parameter of interest.
    pub tmin: f32,
    /// Farthest parameter of interest.
    pub tmax: f32,
}

impl Ray {
    /// A copy, read number by number; see [`read_alone`].
    #[inline(always)]
    pub(crate) fn read_alone(&self) -> Self {
        let vector = |v: &Vec3| Vec3::new(read_alone(&v.x), read_alone(&v.y), read_alone(&v.z));
        let Self { origin, direction, tmin, tmax } = self;
        Self { origin: vector(origin), direction: vector(direction), tmin: read_alone(tmin), tmax: read_alone(tmax) }
    }
}

impl<'a> Rays<'a> {
    /// A batch of `count` rays.
    ///
    /// # Errors
    /// [`Error::Ray`] where a column is too short.
    pub fn new(
        origin: [Column<'a>; 3],
        direction: [Column<'a>; 3],
        tmin: Column<'a>,
        tmax: Column<'a>,
        count: usize,
    ) -> Result<Self, Error> {
        let columns = origin.iter().chain(&direction).chain([&tmin, &tmax]);
        let shortest = columns.map(Column::capacity).min().unwrap_or(0);
        if shortest < count {
            return Err(Error::Ray(format!("{count} rays, but one of the columns holds only {shortest}")));
        }
        Ok(Self { origin, direction, tmin, tmax, first: 0, count })
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The part of the batch that begins at ray `first` and has at most `count` rays.
    pub fn part(&self, first: usize, count: usize) -> Self {
        let first = first.min(self.count);
        Self { first: self.first + first, count: count.min(self.count - first), ..*self }
    }

    /// Ray `index` as the kernels see it.
    ///
    /// # Errors
    /// [`Error::Ray`] where [`Frame::new`](crate::traverse::frame::Frame::new) has none for it.
    #[inline(always)]
    pub(crate) fn frame(&self, index: usize, domain: &Domain) -> Result<Frame, Error> {
        Frame::new(&self.get(index), domain).ok_or_else(|| self.fault(index))
    }

    /// Why ray `index` cannot be traced.
    #[cold]
    pub(crate) fn fault(&self, index: usize) -> Error {
        self.get(index).fault(self.first + index)
    }

    /// Rays `index` to `index + 7`, by column: origin, direction, tmin, tmax.
    #[inline(always)]
    pub(crate) fn eight<S: Simd>(&self, simd: S, index: usize) -> [S::F32; 8] {
        let index = self.first + index;
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &self.direction);
        [
            ox.eight(simd, index),
            oy.eight(simd, index),
            oz.eight(simd, index),
            dx.eight(simd, index),
            dy.eight(simd, index),
            dz.eight(simd, index),
            self.tmin.eight(simd, index),
            self.tmax.eight(simd, index),
        ]
    }

    /// Rays `index` to `index + 15`, likewise.
    #[inline(always)]
    pub(crate) fn sixteen<S: Simd>(&self, simd: S, index: usize) -> [<S::Wide as Arithmetic>::F32; 8] {
        let index = self.first + index;
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &self.direction);
        [
            ox.sixteen(simd, index),
            oy.sixteen(simd, index),
            oz.sixteen(simd, index),
            dx.sixteen(simd, index),
            dy.sixteen(simd, index),
            dz.sixteen(simd, index),
            self.tmin.sixteen(simd, index),
            self.tmax.sixteen(simd, index),
        ]
    }

    /// Whether rays `index` and `index + 7` are there and start at one point.
    #[inline(always)]
    pub(crate) fn is_common_origin(&self, index: usize) -> bool {
        let (first, last) = (self.first + index, self.first + index + LANES - 1);
        index + LANES <= self.count && self.origin.iter().all(|axis| axis.get(first) == axis.get(last))
    }

    /// Where ray `index` starts.
    #[inline(always)]
    pub(crate) fn origin(&self, index: usize) -> [f32; 3] {
        let [x, y, z] = &self.origin;
        let index = self.first + index;
        [x.get(index), y.get(index), z.get(index)]
    }

    /// Gather ray `index`.
    #[inline]
    pub fn get(&self, index: usize) -> Ray {
        let index = self.first + index;
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &self.direction);
        Ray {
            origin: Vec3::new(ox.get(index), oy.get(index), oz.get(index)),
            direction: Vec3::new(dx.get(index), dy.get(index), dz.get(index)),
            tmin: self.tmin.get(index),
            tmax: self.tmax.get(index),
        }
    }
}

impl Ray {
    /// Origin, direction, tmin, tmax.
    pub(crate) fn to_row(self) -> [f32; 8] {
        let ([ox, oy, oz], [dx, dy, dz]) = (self.origin.to_array(), self.direction.to_array());
        [ox, oy, oz, dx, dy, dz, self.tmin, self.tmax]
    }

    /// Why this ray cannot be traced, in words; `None` where it can.
    #[cold]
    pub fn fault(&self, index: usize) -> Error {
        let Self { origin, direction, tmin, tmax } = self;
        let reason = if !origin.is_finite() {
            format!("has origin {origin}, which is not finite")
        } else if !direction.is_finite() {
            format!("has direction {direction}, which is not finite")
        } else if tmin.is_nan() || tmax.is_nan() {
            format!("has the interval [{tmin}, {tmax}], which is not a number")
        } else {
            format!("has direction {direction}, which is zero or too short: its largest component must reach 1e-37")
        };
        Error::Ray(format!("ray {index} {reason}; mend or drop such rays before tracing"))
    }
}

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
