//! Triangles on their way into a tree: compact records that planners reorder.

use glam::{Vec3, Vec3A, Vec4};

use crate::bounds::{Bounds, BoundsA};

/// Some triangles that stay together, in 32 bytes: the box around them, where they are listed, and how many they are.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub struct Record {
    /// Fourth lane: the bits of the first place in the list.
    lower: Vec4,
    /// Fourth lane: the bits of the number of triangles.
    upper: Vec4,
}

impl Record {
    /// Fills buffers.
    pub const NONE: Self = Self { lower: Vec4::ZERO, upper: Vec4::ZERO };

    /// Of `count` triangles that are listed from `first` on.
    #[inline(always)]
    pub fn new(bounds: &BoundsA, first: u32, count: u32) -> Self {
        Self { lower: bounds.lower.extend(f32::from_bits(first)), upper: bounds.upper.extend(f32::from_bits(count)) }
    }

    /// The box around them.
    #[inline(always)]
    pub fn bounds(&self) -> BoundsA {
        BoundsA { lower: Vec3A::from_vec4(self.lower), upper: Vec3A::from_vec4(self.upper) }
    }

    /// Twice the middle of the box.
    #[inline(always)]
    pub fn centre(&self) -> Vec3A {
        Vec3A::from_vec4(self.lower + self.upper)
    }

    /// Where its triangles are listed.
    #[inline(always)]
    pub fn range(&self) -> std::ops::Range<usize> {
        let first = self.lower.w.to_bits() as usize;
        first..first + self.count() as usize
    }

    /// How many triangles it has.
    #[inline(always)]
    pub fn count(&self) -> u32 {
        self.upper.w.to_bits()
    }
}

/// Maps the box of a scene into the unit cube, by one scale for all axes, so that areas of boxes neither overflow nor
/// vanish, however large or small the scene. Planners decide by mapped boxes; what they decide on is then fitted to
/// the triangles themselves.
#[derive(Debug, Clone, Copy)]
pub struct UnitCube {
    lower: Vec3A,
    scale: f32,
}

impl UnitCube {
    /// Of a scene's box.
    pub fn new(bounds: &Bounds) -> Self {
        let scale = bounds.extent().max_element().recip().min(f32::MAX);
        Self { lower: bounds.lower.into(), scale }
    }

    /// What extents are multiplied by.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// The mapped box of a triangle.
    #[inline(always)]
    pub fn bounds(&self, corners: [Vec3; 3]) -> BoundsA {
        self.mapped(&BoundsA::of_corners(corners))
    }

    /// A mapped box.
    #[inline(always)]
    pub fn mapped(&self, bounds: &BoundsA) -> BoundsA {
        let mapped = |point: Vec3A| (point - self.lower) * self.scale;
        BoundsA { lower: mapped(bounds.lower), upper: mapped(bounds.upper) }
    }
}
