//! Exact triangle-box overlap by separating axes, after Akenine-Möller, "Fast 3D Triangle-Box Overlap Testing",
//! Journal of Graphics Tools 6(1), 2001.

use glam::Vec3;

/// A triangle, with what does not depend on the box computed once.
#[derive(Debug, Clone, Copy)]
pub struct Separator {
    corners: [Vec3; 3],
    /// In units of about the longest: only their directions matter, and products of huge or tiny ones would leave the
    /// range of single precision, which made a cell list everything near.
    edges: [Vec3; 3],
    normal: Vec3,
}

/// A power of two that brings a positive number into [1, 2), or nearer to it where that one is out of range.
fn inverse_power(number: f32) -> f32 {
    f32::from_bits((254 - (number.to_bits() >> 23)).max(1) << 23)
}

impl Separator {
    /// Of the triangle with these corners.
    pub fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let edges = [b - a, c - b, a - c];
        let scale = inverse_power(edges.iter().fold(Vec3::ZERO, |longest, edge| longest.max(edge.abs())).max_element());
        let edges = edges.map(|edge| edge * scale);
        Self { corners, edges, normal: edges[0].cross(edges[1]) }
    }

    /// Whether the triangle touches the box; the triangle's bounds are known to. May say yes to a box that is missed
    /// by a rounding error, which callers make room for by dilating the box.
    pub fn overlaps(&self, centre: Vec3, half: Vec3) -> bool {
        let corners = self.corners.map(|corner| corner - centre);
        // Of all corners: the normal of a needle is made of rounding errors, and they are not in a plane across it.
        let meets = |axis: Vec3| {
            let [p, q, r] = corners.map(|corner| axis.dot(corner));
            let reach = axis.abs().dot(half);
            p.min(q).min(r) <= reach && p.max(q).max(r) >= -reach
        };
        meets(self.normal)
            && self.edges.iter().all(|&Vec3 { x, y, z }| {
                [Vec3::new(0.0, -z, y), Vec3::new(z, 0.0, -x), Vec3::new(-y, x, 0.0)].into_iter().all(meets)
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagonal_triangle_leaves_the_corner_boxes() {
        let triangle = Separator::new([Vec3::new(0.0, 0.0, 0.5), Vec3::new(4.0, 0.0, 0.5), Vec3::new(0.0, 4.0, 0.5)]);
        let cell = |x: f32, y: f32| triangle.overlaps(Vec3::new(x + 0.5, y + 0.5, 0.5), Vec3::splat(0.5));
        assert!(cell(0.0, 0.0) && cell(1.0, 2.0) && cell(3.0, 0.0) && cell(2.0, 2.0));
        assert!(!cell(3.0, 3.0) && !cell(3.0, 2.0));
    }

    #[test]
    fn scale_does_not_matter() {
        for scale in [1e-36, 1e-20, 1.0, 1e16, 2e17] {
            let corners = [Vec3::new(0.0, 0.0, 0.5), Vec3::new(4.0, 0.0, 0.5), Vec3::new(0.0, 4.0, 0.5)];
            let triangle = Separator::new(corners.map(|corner| corner * scale));
            let cell = |x: f32, y: f32, z: f32| {
                triangle.overlaps(Vec3::new(x + 0.5, y + 0.5, z) * scale, Vec3::splat(0.5) * scale)
            };
            assert!(cell(0.0, 0.0, 0.5) && cell(1.0, 2.0, 0.5));
            assert!(!cell(3.0, 3.0, 0.5) && !cell(1.0, 1.0, 1.1));
        }
    }

    #[test]
    fn a_needle_is_in_every_box_along_it() {
        let ends =
            [Vec3::new(-0.822_735_9, 0.746_449, 0.348_250_5), Vec3::new(-2.526_566_5, 1.611_180_3, -0.862_926_1)];
        let between = Vec3::new(-1.504_268_2, 1.092_341_5, -0.136_220_16);
        let triangle = Separator::new([ends[0], ends[1], between]);
        for step in 0..=100 {
            let place = ends[0].lerp(ends[1], step as f32 / 100.0);
            assert!(triangle.overlaps(place, Vec3::splat(1e-4)), "{step}");
        }
    }
}
