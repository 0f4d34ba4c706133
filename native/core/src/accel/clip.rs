//! What remains of a reference to a triangle on either side of a plane across an axis.
//!
//! Both remains together contain all of the triangle that the reference's box contained. Corners are exact. A point
//! where an edge meets the plane is computed in double precision and rounded outwards: each of its coordinates is
//! wrong by at most 2^-51 times the largest coordinate, which for a mesh that single precision can tell from a point
//! is below 2^-26 half extents of it: under a unit of u·R in [`frame`](crate::traverse::frame), whose dilation of
//! boxes by 32uR has 10uR to spare. Remains that seem empty are not dropped: the other side then keeps the whole box.

use glam::{DVec3, Vec3};

use super::tree::Item;
use crate::bounds::Bounds;

/// The boxes before and behind the plane at `position` across `axis`; at most one of them is empty.
pub fn cut(item: &Item, corners: [Vec3; 3], axis: usize, position: f32) -> [Bounds; 2] {
    let mut parts = [Bounds::EMPTY; 2];
    for index in 0..3 {
        let (here, there) = (corners[index], corners[(index + 1) % 3]);
        let sides = [here[axis] <= position, here[axis] >= position];
        parts.iter_mut().zip(sides).filter(|(_, is_there)| *is_there).for_each(|(part, _)| add(part, here, here));
        if (here[axis] < position && position < there[axis]) || (there[axis] < position && position < here[axis]) {
            let [lower, upper] = crossing(here.as_dvec3(), there.as_dvec3(), axis, position);
            parts.iter_mut().for_each(|part| add(part, lower, upper));
        }
    }
    parts[0].upper[axis] = parts[0].upper[axis].min(position);
    parts[1].lower[axis] = parts[1].lower[axis].max(position);
    let parts = parts.map(|part| part.intersection(&item.bounds));
    match parts.map(|part| part.is_empty()) {
        [true, _] => [Bounds::EMPTY, item.bounds],
        [_, true] => [item.bounds, Bounds::EMPTY],
        _ => parts,
    }
}

fn add(bounds: &mut Bounds, lower: Vec3, upper: Vec3) {
    *bounds = bounds.union(&Bounds { lower, upper });
}

/// A box around the point between two corners in a plane.
fn crossing(here: DVec3, there: DVec3, axis: usize, position: f32) -> [Vec3; 2] {
    let share = (f64::from(position) - here[axis]) / (there[axis] - here[axis]);
    let point = here + (there - here) * share;
    let near = point.as_vec3().to_array();
    [near.map(f32::next_down), near.map(f32::next_up)].map(Vec3::from_array)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn whole(corners: [Vec3; 3]) -> Item {
        Item { bounds: Bounds::of_points(corners), primitive: 0 }
    }

    #[test]
    fn remains_fit_the_triangle() {
        let corners = [Vec3::ZERO, Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];
        let [left, right] = cut(&whole(corners), corners, 0, 1.0);
        assert_eq!((left.upper.x, right.lower.x, left.upper.y), (1.0, 1.0, 4.0));
        assert!((3.0..3.00001).contains(&right.upper.y) && right.upper.x == 4.0);
        assert_eq!((left.lower.z, left.upper.z), (0.0, 0.0));
    }

    #[test]
    fn remains_of_remains_shrink() {
        let corners = [Vec3::ZERO, Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];
        let [_, right] = cut(&whole(corners), corners, 0, 3.0);
        let [lower, upper] = cut(&Item { bounds: right, primitive: 0 }, corners, 1, 0.5);
        assert!(lower.upper.y == 0.5 && upper.lower.y == 0.5 && upper.upper.y < 1.00001);
        assert!((3.0..=4.0).contains(&upper.lower.x) && upper.upper.x < 3.50001);
    }

    #[test]
    fn where_one_side_seems_empty_the_other_keeps_the_whole_box() {
        let corners = [Vec3::ZERO, Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];
        let far = Bounds { lower: Vec3::new(3.0, 3.0, 0.0), upper: Vec3::new(4.0, 4.0, 0.0) };
        assert_eq!(cut(&Item { bounds: far, primitive: 0 }, corners, 0, 3.5), [far, Bounds::EMPTY]);
        let item = whole(corners);
        assert_eq!(cut(&item, corners, 0, -1.0), [Bounds::EMPTY, item.bounds]);
        assert_eq!(cut(&item, corners, 0, 9.0), [item.bounds, Bounds::EMPTY]);
    }
}
