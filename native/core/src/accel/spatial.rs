//! Spatial splits: planes that cut triangles in two, after Stich, Friedrich and Dietrich, "Spatial Splits in Bounding
//! Volume Hierarchies", HPG 2009.

use rayon::prelude::*;

use super::{
    clip,
    sah::{Bin, MOST_BINS},
    tree::Item,
};
use crate::{Mesh, bounds::Bounds};

/// Larger sets of references are binned in parallel, in parts of this size.
const PART: usize = 1 << 13;

/// References in a slab between two planes.
#[derive(Clone, Copy)]
struct Slab {
    bounds: Bounds,
    /// References of which this is the first slab.
    entered: usize,
    /// References of which this is the last slab.
    left: usize,
}

impl Slab {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, entered: 0, left: 0 };
}

type Slabs = [[Slab; MOST_BINS]; 3];

/// A plane, and what would lie on either side.
#[derive(Clone, Copy)]
pub struct Cut {
    axis: usize,
    position: f32,
    /// Expected work, up to a constant, as for [`Plane`](super::sah::Plane).
    pub cost: f32,
    sides: [Bin; 2],
}

/// The planes between equal slabs of a box.
struct Ruler {
    bounds: Bounds,
    slabs: usize,
}

impl Ruler {
    /// The plane before a slab.
    fn position(&self, axis: usize, slab: usize) -> f32 {
        let share = slab as f32 / self.slabs as f32;
        self.bounds.lower[axis] * (1.0 - share) + self.bounds.upper[axis] * share
    }

    fn slab(&self, axis: usize, coordinate: f32) -> usize {
        let scale = self.slabs as f32 / (self.bounds.upper[axis] - self.bounds.lower[axis]);
        (((coordinate - self.bounds.lower[axis]) * scale) as usize).min(self.slabs - 1)
    }

    fn fill(&self, items: &[Item], mesh: &Mesh) -> Slabs {
        let mut slabs = [[Slab::EMPTY; MOST_BINS]; 3];
        for item in items {
            for (axis, row) in slabs.iter_mut().enumerate() {
                self.chop(item, mesh, axis, row);
            }
        }
        slabs
    }

    /// Put the parts of a reference into the slabs that it crosses.
    fn chop(&self, item: &Item, mesh: &Mesh, axis: usize, row: &mut [Slab; MOST_BINS]) {
        let (first, last) = (self.slab(axis, item.bounds.lower[axis]), self.slab(axis, item.bounds.upper[axis]));
        if first >= last {
            row[first].add(&item.bounds, true, true);
            return;
        }
        let corners = mesh.corners(item.primitive);
        let (mut rest, mut has_entered) = (*item, false);
        for slab in first..last {
            let [before, behind] = clip::cut(&rest, corners, axis, self.position(axis, slab + 1));
            if before.is_empty() {
                continue;
            }
            row[slab].add(&before, !has_entered, behind.is_empty());
            if behind.is_empty() {
                return;
            }
            (rest.bounds, has_entered) = (behind, true);
        }
        row[last].add(&rest.bounds, !has_entered, true);
    }

    /// The cheapest plane across an axis with references on both of its sides.
    fn cheapest(&self, axis: usize, row: &[Slab]) -> Option<Cut> {
        let mut behind = [Bin::EMPTY; MOST_BINS];
        let mut right = Bin::EMPTY;
        for slab in (1..row.len()).rev() {
            right.add(&Bin { bounds: row[slab].bounds, count: row[slab].left });
            behind[slab] = right;
        }
        let mut left = Bin::EMPTY;
        let cuts = (1..row.len()).filter_map(|slab| {
            left.add(&Bin { bounds: row[slab - 1].bounds, count: row[slab - 1].entered });
            let (sides, cost) = ([left, behind[slab]], left.cost() + behind[slab].cost());
            let divides = sides.iter().all(|side| side.count > 0) && cost.is_finite();
            divides.then(|| Cut { axis, position: self.position(axis, slab), cost, sides })
        });
        cuts.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }
}

impl Slab {
    fn add(&mut self, bounds: &Bounds, enters: bool, leaves: bool) {
        self.bounds = self.bounds.union(bounds);
        self.entered += usize::from(enters);
        self.left += usize::from(leaves);
    }

    fn merge(&mut self, other: &Self) {
        self.bounds = self.bounds.union(&other.bounds);
        self.entered += other.entered;
        self.left += other.left;
    }
}

/// The cheapest of the planes between `slabs` equal slabs of the items' box along every axis.
pub fn best_cut(items: &[Item], bounds: &Bounds, slabs: usize, mesh: &Mesh) -> Option<Cut> {
    let ruler = Ruler { bounds: *bounds, slabs };
    let rows = items.par_chunks(PART).map(|part| ruler.fill(part, mesh)).reduce_with(|mut a, b| {
        a.iter_mut().flatten().zip(b.iter().flatten()).for_each(|(a, b)| a.merge(b));
        a
    })?;
    let cuts = (0..3).filter_map(|axis| ruler.cheapest(axis, &rows[axis][..slabs]));
    cuts.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

impl Cut {
    /// The references on either side: those that the plane crosses go to both, or whole to one side where that costs
    /// less ("reference unsplitting", section 4.4) or where `most` have been doubled already. `None` where a side
    /// would get them all.
    pub fn divide(mut self, items: &[Item], mesh: &Mesh, most: usize) -> Option<[Vec<Item>; 2]> {
        let (mut parts, mut doubled) = ([Vec::new(), Vec::new()], 0);
        for item in items {
            let bounds = clip::cut(item, mesh.corners(item.primitive), self.axis, self.position);
            let halves = bounds.map(|bounds| Item { bounds, ..*item });
            match bounds.map(|part| part.is_empty()) {
                [true, _] => parts[1].push(*item),
                [_, true] => parts[0].push(*item),
                _ => match self.keeps_whole(&item.bounds, doubled < most) {
                    Some(side) => parts[side].push(*item),
                    None => {
                        doubled += 1;
                        parts.iter_mut().zip(halves).for_each(|(part, half)| part.push(half));
                    }
                },
            }
        }
        parts.iter().all(|part| part.len() < items.len()).then_some(parts)
    }

    /// The side that a crossed reference goes to as a whole, if that costs less than its parts on both.
    fn keeps_whole(&mut self, bounds: &Bounds, may_double: bool) -> Option<usize> {
        let areas = self.sides.map(|side| side.bounds.half_area());
        let counts = self.sides.map(|side| side.count as f32);
        let grown = self.sides.map(|side| side.bounds.union(bounds));
        let whole = |side: usize| grown[side].half_area() * counts[side] + areas[1 - side] * (counts[1 - side] - 1.0);
        let side = usize::from(whole(1) < whole(0));
        if may_double && areas[0] * counts[0] + areas[1] * counts[1] <= whole(side) {
            return None;
        }
        self.sides[side].bounds = grown[side];
        self.sides[1 - side].count = self.sides[1 - side].count.saturating_sub(1);
        Some(side)
    }
}
