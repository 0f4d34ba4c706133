//! Batches of rays and hits in structure-of-arrays form.

mod column;
mod hits;

use glam::Vec3;

pub use self::column::Column;
use self::column::Points;
pub(crate) use self::hits::{AlignedHits, Eight};
pub use self::hits::{Hit, Hits, HitsMut, MISS};

use crate::{
    Error,
    simd::{Arithmetic, Simd, read_alone},
    traverse::frame::{Domain, Frame},
    triangle::LANES,
};

/// A batch of rays: origin, direction (any length but zero) and the parameter interval `[tmin, tmax]`, both ends
/// included, in lengths of the direction.
#[derive(Debug, Clone, Copy)]
pub struct Rays<'a> {
    origin: Points<'a>,
    direction: Points<'a>,
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
        let [origin, direction] = [origin, direction].map(|axes| Points::new(axes, count));
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
        let ([ox, oy, oz], [dx, dy, dz]) = (self.origin.eight(simd, index), self.direction.eight(simd, index));
        [ox, oy, oz, dx, dy, dz, self.tmin.eight(simd, index), self.tmax.eight(simd, index)]
    }

    /// Rays `index` to `index + 15`, likewise.
    #[inline(always)]
    pub(crate) fn sixteen<S: Simd>(&self, simd: S, index: usize) -> [<S::Wide as Arithmetic>::F32; 8] {
        let index = self.first + index;
        let ([ox, oy, oz], [dx, dy, dz]) = (self.origin.sixteen(simd, index), self.direction.sixteen(simd, index));
        [ox, oy, oz, dx, dy, dz, self.tmin.sixteen(simd, index), self.tmax.sixteen(simd, index)]
    }

    /// Whether rays `index` and `index + 7` are there and start at one point.
    #[inline(always)]
    pub(crate) fn is_common_origin(&self, index: usize) -> bool {
        let (first, last) = (self.first + index, self.first + index + LANES - 1);
        index + LANES <= self.count && self.origin.get(first) == self.origin.get(last)
    }

    /// Where ray `index` starts.
    #[inline(always)]
    pub(crate) fn origin(&self, index: usize) -> [f32; 3] {
        self.origin.get(self.first + index)
    }

    /// Gather ray `index`.
    #[inline]
    pub fn get(&self, index: usize) -> Ray {
        let index = self.first + index;
        Ray {
            origin: self.origin.get(index).into(),
            direction: self.direction.get(index).into(),
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
