//! Axis-aligned bounding boxes.

use glam::{Vec3, Vec3A, Vec3Swizzles};

/// A box from `lower` to `upper`; empty where lower exceeds upper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least corner.
    pub lower: Vec3,
    /// Greatest corner.
    pub upper: Vec3,
}

impl Bounds {
    /// The box that contains nothing and is neutral under [`Bounds::union`].
    pub const EMPTY: Self = Self { lower: Vec3::INFINITY, upper: Vec3::NEG_INFINITY };

    /// The smallest box around some points.
    pub fn of_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |bounds, point| bounds.union(&Self { lower: point, upper: point }))
    }

    /// The smallest box around both.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// What lies in both; empty where nothing does.
    #[inline]
    pub fn intersection(&self, other: &Self) -> Self {
        Self { lower: self.lower.max(other.lower), upper: self.upper.min(other.upper) }
    }

    /// Whether no point is inside.
    pub fn is_empty(&self) -> bool {
        self.lower.cmpgt(self.upper).any()
    }

    /// Edge lengths; zero for an empty box.
    #[inline]
    pub fn extent(&self) -> Vec3 {
        (self.upper - self.lower).max(Vec3::ZERO)
    }

    /// The middle.
    #[inline]
    pub fn centre(&self) -> Vec3 {
        self.lower * 0.5 + self.upper * 0.5
    }

    /// Half the surface area: what the surface area heuristic compares.
    #[inline]
    pub fn half_area(&self) -> f32 {
        let e = self.extent();
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// Product of the edge lengths.
    pub fn volume(&self) -> f64 {
        let e = self.extent().as_dvec3();
        e.x * e.y * e.z
    }

    /// The box grown by `margin` on every side.
    pub fn dilated(&self, margin: f32) -> Self {
        Self { lower: self.lower - Vec3::splat(margin), upper: self.upper + Vec3::splat(margin) }
    }
}

/// [`Bounds`] in two aligned vectors, for builders that go through many: as [`Vec3A`] is to [`Vec3`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundsA {
    /// Least corner.
    pub lower: Vec3A,
    /// Greatest corner.
    pub upper: Vec3A,
}

impl BoundsA {
    /// The box that contains nothing and is neutral under [`BoundsA::union`].
    pub const EMPTY: Self = Self { lower: Vec3A::INFINITY, upper: Vec3A::NEG_INFINITY };

    /// The smallest box around a triangle.
    #[inline(always)]
    pub fn of_corners(corners: [Vec3; 3]) -> Self {
        Self::of_aligned_corners(corners.map(Vec3A::from))
    }

    /// The smallest box around a triangle.
    #[inline(always)]
    pub fn of_aligned_corners([a, b, c]: [Vec3A; 3]) -> Self {
        Self { lower: a.min(b).min(c), upper: a.max(b).max(c) }
    }

    /// The smallest box around both.
    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// Half the surface area of a box that is not empty.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let e = self.upper - self.lower;
        (e * e.yzx()).element_sum()
    }
}

impl From<Bounds> for BoundsA {
    fn from(bounds: Bounds) -> Self {
        Self { lower: bounds.lower.into(), upper: bounds.upper.into() }
    }
}

impl From<BoundsA> for Bounds {
    fn from(bounds: BoundsA) -> Self {
        Self { lower: bounds.lower.into(), upper: bounds.upper.into() }
    }
}
