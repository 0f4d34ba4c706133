//! Walking a tessellation of the box into tetrahedra, face to face: the cells that Zhang and Chiu, "Building a Hybrid
//! Approach to Space Division for Faster Raytracing", propose last.
//!
//! Every box of a grid, scaled to the unit cube, is divided into the six tetrahedra in which the coordinates have one
//! order (Freudenthal, "Simplizialzerlegungen von beschränkter Flachheit", Annals of Mathematics 43(3), 1942; Kuhn,
//! "Some Combinatorial Lemmas in Topology", IBM Journal 4(5), 1960): of equal volume, each the image of any other.
//! Their faces all lie in the planes where a coordinate, or the difference of two, is a whole number. So a tetrahedron
//! lies wholly on one side of each of these planes, and a walk from face to face is one through six families of
//! parallel planes, as a walk through boxes is one through three.
//!
//! Why no hit is lost. Let a ray cross the planes it meets where they are computed to be, each off by at most the
//! position error e (below). Claim: while a walk is in a tetrahedron, up to the least crossing of the faces by which it
//! can leave, the ray is within e of the inner side of all four faces. For a face that the ray moves towards, this is
//! what a crossing means: it lies ahead. A face that the ray moves away from has the walk on its inner side, and a walk
//! changes sides of a plane only by crossing a face in it. So either it began there, in the tetrahedron its first point
//! was found in, or it has crossed that plane, at a parameter that the walk has passed; in both cases the ray was
//! within e of the inner side then, and is farther inside by now. Errors of different steps do not add up, and
//! crossings out of order, by rounding near an edge, only make a step of no length. Every plane is crossed at most
//! once, in the ray's direction, so every walk ends.
//!
//! What is found, then, does not depend on rounding if a tetrahedron lists every triangle that reaches its inside with
//! all four faces moved outwards by e, which [`crate::accel::tetrahedra`] does, with [`Domain::margin`] along each axis
//! for e: by 32uR at the least. Needed are 10uR for a crossing (in boxes: 4u for origin and direction each,
//! as they are scaled, and 2u for the difference and the product with the inverse), and 8uR for the sheared triangle.
//!
//! [`Domain::margin`]: super::frame::Domain::margin

use super::{dda, frame::Frame, probe::Probe};
use crate::accel::{
    lattice::{ORDERS, TETRAHEDRA},
    structure::{Grid, Structure},
};

/// Differences of two speeds below this share of the largest speed are taken as zero: over the whole scene they move a
/// ray by far less than the margin, and their inverses stay finite.
const PARALLEL: f32 = 1e-18;

/// Where a ray is.
pub struct Walk<'a> {
    structure: &'a Structure,
    frame: &'a Frame,
    grid: &'a Grid,
    /// Origin and speeds, in boxes.
    origin: [f32; 3],
    /// For axes `a` and `b`, the inverse of how fast coordinate `a` falls behind `b`; infinite where it does not.
    falling: [[f32; 3]; 3],
    cell: [i32; 3],
    /// Axes by descending position within the box.
    order: [usize; 3],
    has_begun: bool,
}

/// A face of a tetrahedron, by what the ray does that leaves through it.
#[derive(Clone, Copy)]
enum Face {
    /// The first coordinate reaches the next box.
    Top,
    /// The second coordinate overtakes the first.
    Upper,
    /// The third coordinate overtakes the second.
    Lower,
    /// The last coordinate falls to the box before.
    Bottom,
}

impl<'a> Walk<'a> {
    /// In the first tetrahedron of a grid that the ray meets before `limit`, if any.
    #[inline(never)]
    pub fn new(frame: &'a Frame, structure: &'a Structure, index: u32, limit: f32) -> Option<Self> {
        let grid = &structure.lattices.tetrahedral[index as usize];
        let near = frame.enter(&grid.lower, &grid.upper, limit)?;
        let origin: [f32; 3] = std::array::from_fn(|k| (frame.local[k] - grid.lower[k]) * grid.inverse_cell[k]);
        let speed: [f32; 3] = std::array::from_fn(|k| frame.direction[k] * grid.inverse_cell[k]);
        let position: [f32; 3] = std::array::from_fn(|k| origin[k] + speed[k] * near);
        let cell: [i32; 3] = std::array::from_fn(|k| (position[k] as i32).clamp(0, grid.resolution[k] as i32 - 1));
        let rest: [f32; 3] = std::array::from_fn(|k| position[k] - cell[k] as f32);
        let falling = falling(speed);
        Some(Self { structure, frame, grid, origin, falling, cell, order: descending(rest), has_begun: false })
    }

    /// The triangles of the next tetrahedron that has any and that the ray reaches before `limit`.
    #[inline(never)]
    pub fn next<P: Probe>(&mut self, probe: &mut P, limit: f32) -> Option<&'a [u32]> {
        loop {
            if self.has_begun {
                let (face, exit) = self.exit();
                if limit < exit || exit == f32::INFINITY || !self.cross(face) {
                    return None;
                }
            }
            self.has_begun = true;
            probe.step();
            let list = self.structure.cell(self.grid, self.index());
            if !list.is_empty() {
                return Some(list);
            }
        }
    }

    #[inline(always)]
    fn index(&self) -> usize {
        let [columns, rows, _] = self.grid.resolution.map(|edge| edge as usize);
        let [x, y, z] = self.cell.map(|coordinate| coordinate as usize);
        let [first, second, third] = self.order;
        ((z * rows + y) * columns + x) * TETRAHEDRA + 2 * first + usize::from(second > third)
    }

    /// The face by which the ray leaves, and where it crosses it.
    #[inline(always)]
    fn exit(&self) -> (Face, f32) {
        let [first, second, third] = self.order;
        let (frame, grid) = (self.frame, self.grid);
        let mut exit = (Face::Upper, self.overtaking(first, second));
        let lower = self.overtaking(second, third);
        if lower < exit.1 {
            exit = (Face::Lower, lower);
        }
        if frame.inverse[first] >= 0.0 {
            let top = dda::crossing(self.cell[first] + 1, first, frame, grid);
            exit = if top < exit.1 { (Face::Top, top) } else { exit };
        }
        if frame.inverse[third] < 0.0 {
            let bottom = dda::crossing(self.cell[third], third, frame, grid);
            exit = if bottom < exit.1 { (Face::Bottom, bottom) } else { exit };
        }
        exit
    }

    /// Where coordinate `a`, now ahead of `b` within the box, has fallen back to it; infinite where it does not.
    #[inline(always)]
    fn overtaking(&self, a: usize, b: usize) -> f32 {
        let inverse = self.falling[a][b];
        if inverse == f32::INFINITY {
            return inverse;
        }
        let lead = self.origin[a] - self.origin[b] - (self.cell[a] - self.cell[b]) as f32;
        lead * inverse
    }

    /// Into the neighbour behind a face; false where the grid ends.
    #[inline(always)]
    fn cross(&mut self, face: Face) -> bool {
        let [first, second, third] = self.order;
        match face {
            Face::Upper => self.order = [second, first, third],
            Face::Lower => self.order = [first, third, second],
            Face::Top => {
                self.order = [second, third, first];
                self.cell[first] += 1;
                return (self.cell[first] as u32) < self.grid.resolution[first];
            }
            Face::Bottom => {
                self.order = [third, first, second];
                self.cell[third] -= 1;
                return self.cell[third] >= 0;
            }
        }
        true
    }
}

/// See [`Walk::falling`].
#[inline(always)]
fn falling(speed: [f32; 3]) -> [[f32; 3]; 3] {
    let fastest = speed.iter().fold(0.0f32, |fastest, speed| fastest.max(speed.abs()));
    let least = (fastest * PARALLEL).max(4.0 * f32::MIN_POSITIVE);
    speed.map(|a| speed.map(|b| if b - a > least { (b - a).recip() } else { f32::INFINITY }))
}

/// The axes, the one with the greatest coordinate first.
#[inline(always)]
fn descending([x, y, z]: [f32; 3]) -> [usize; 3] {
    match (x >= y, y >= z, x >= z) {
        (true, true, _) => ORDERS[0],
        (true, false, true) => ORDERS[1],
        (true, false, false) => ORDERS[4],
        (false, _, true) => ORDERS[2],
        (false, true, false) => ORDERS[3],
        (false, false, false) => ORDERS[5],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_have_their_numbers() {
        for (number, [first, second, third]) in ORDERS.into_iter().enumerate() {
            assert_eq!(number, 2 * first + usize::from(second > third));
            let mut position = [0.0; 3];
            (position[first], position[second], position[third]) = (0.9, 0.5, 0.1);
            assert_eq!(descending(position), [first, second, third]);
        }
    }
}
