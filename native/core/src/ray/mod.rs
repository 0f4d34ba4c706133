//! Batches of rays and hits in structure-of-arrays form.

mod hits;

use glam::Vec3;

pub(crate) use self::hits::{AlignedHits, Eight};
pub use self::hits::{Hit, Hits, HitsMut, MISS};

use crate::{
    Error,
    simd::{Arithmetic, Simd, read_alone},
    traverse::frame::{Domain, Frame},
    triangle::LANES,
};

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
