//! Triangles on their way into a tree: compact records that planners reorder.

use glam::{Vec3, Vec3A, Vec4};

use crate::{
    bounds::{Bounds, BoundsA},
    simd::Simd,
    triangle::LANES,
};

/// Some triangles that stay together, in 32 bytes: the box around them, where they are listed, and how many they are.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub struct Record {
    /// Least corner, then the first place in the list; greatest corner, negated, then the number of triangles. So the box
    /// around two is the lesser of each pair of numbers.
    pub row: [f32; LANES],
}

/// A whole number below 2^27 as the bits of a normal float: it goes through arithmetic beside the corners, which denormal
/// numbers make twice as slow.
const NUMBER: u32 = 0x4000_0000;

fn number(value: u32) -> f32 {
    f32::from_bits(NUMBER | value)
}

impl Record {
    /// Contains nothing.
    pub const NONE: Self = Self { row: [f32::INFINITY; LANES] };

    /// Of `count` triangles that are listed from `first` on.
    #[inline(always)]
    pub fn new(bounds: &BoundsA, first: usize, count: u32) -> Self {
        let (lower, upper) = (bounds.lower.to_array(), (-bounds.upper).to_array());
        let [first, count] = [number(first as u32), number(count)];
        Self { row: [lower[0], lower[1], lower[2], first, upper[0], upper[1], upper[2], count] }
    }

    /// The same, listed from `first` on.
    #[inline(always)]
    pub fn at(mut self, first: usize) -> Self {
        self.row[3] = number(first as u32);
        self
    }

    /// The box around the triangles of both, and how many they are; where they are listed is to be [told](Record::at).
    #[inline(always)]
    pub fn union<S: Simd>(&self, simd: S, other: &Self) -> Self {
        let mut row = simd.store(simd.min(simd.load(&self.row), simd.load(&other.row)));
        row[7] = number(self.count() + other.count());
        Self { row }
    }

    /// The box around them.
    #[inline(always)]
    pub fn bounds(&self) -> BoundsA {
        let [lower, upper] = self.corners();
        BoundsA { lower: Vec3A::from_vec4(lower), upper: -Vec3A::from_vec4(upper) }
    }

    #[inline(always)]
    fn corners(&self) -> [Vec4; 2] {
        halves(&self.row)
    }

    /// Twice the middle of the box.
    #[inline(always)]
    pub fn centre(&self) -> Vec3A {
        let [lower, upper] = self.corners();
        Vec3A::from_vec4(lower - upper)
    }

    /// The same along one axis.
    #[inline(always)]
    pub fn centre_along(&self, axis: usize) -> f32 {
        self.row[axis & 3] - self.row[4 + (axis & 3)]
    }

    /// Half the surface area of the box.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        half_area(&self.row)
    }

    /// Where its triangles are listed.
    #[inline(always)]
    pub fn range(&self) -> std::ops::Range<usize> {
        let first = (self.row[3].to_bits() ^ NUMBER) as usize;
        first..first + self.count() as usize
    }

    /// How many triangles it has.
    #[inline(always)]
    pub fn count(&self) -> u32 {
        self.row[7].to_bits() ^ NUMBER
    }
}

/// The four numbers of either corner in a [`Record::row`].
#[inline(always)]
pub fn halves(row: &[f32; LANES]) -> [Vec4; 2] {
    bytemuck::cast(*row)
}

/// Half the surface area of the box in a [`Record::row`].
#[inline(always)]
pub fn half_area(row: &[f32; LANES]) -> f32 {
    let [x, y, z] = [row[0] + row[4], row[1] + row[5], row[2] + row[6]];
    x * (y + z) + y * z
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

    /// A mapped box.
    #[inline(always)]
    pub fn map(&self, bounds: &Bounds) -> BoundsA {
        let mapped = |point: Vec3| (Vec3A::from(point) - self.lower) * self.scale;
        BoundsA { lower: mapped(bounds.lower), upper: mapped(bounds.upper) }
    }

    /// The mapped box of a triangle.
    #[inline(always)]
    pub fn bounds(&self, corners: [Vec3A; 3]) -> BoundsA {
        self.mapped(&BoundsA::of_aligned_corners(corners))
    }

    /// A mapped box.
    #[inline(always)]
    pub fn mapped(&self, bounds: &BoundsA) -> BoundsA {
        let mapped = |point: Vec3A| (point - self.lower) * self.scale;
        BoundsA { lower: mapped(bounds.lower), upper: mapped(bounds.upper) }
    }
}
