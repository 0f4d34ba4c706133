//! The surface area heuristic over boxes that stand in order along a curve, and keep it: a run is cut in two where that
//! is cheapest. With one order instead of one per axis, and no box moved, that takes a fraction of the time of bins, and
//! along a Morton curve most good cuts are among those looked at.

use std::ops::Range;

use crate::{bounds::BoundsA, triangle::LANES};

/// A box, and how many triangles are in it.
#[derive(Debug, Clone, Copy)]
pub struct Item {
    /// The box.
    pub bounds: BoundsA,
    /// Its triangles.
    pub count: u32,
}

impl Item {
    /// Nothing.
    pub const NONE: Self = Self { bounds: BoundsA::EMPTY, count: 0 };

    #[inline(always)]
    fn with(&self, other: &Self) -> Self {
        Self { bounds: self.bounds.union(&other.bounds), count: self.count + other.count }
    }

    /// Expected work, up to a constant.
    #[inline(always)]
    fn cost(&self, scale: f32) -> f32 {
        self.area(scale) * self.count.div_ceil(LANES as u32) as f32
    }

    #[inline(always)]
    fn area(&self, scale: f32) -> f32 {
        BoundsA { lower: self.bounds.lower * scale, upper: self.bounds.upper * scale }.half_area()
    }
}

/// Items that stand together, and what they are in all.
#[derive(Debug, Clone)]
pub struct Run {
    /// Which items.
    pub items: Range<usize>,
    /// Their box and triangles.
    pub total: Item,
}

impl Run {
    /// All of some items.
    pub fn new(all: &[Item], items: Range<usize>) -> Self {
        let total = all[items.clone()].iter().fold(Item::NONE, |total, item| total.with(item));
        Self { items, total }
    }

    /// How many triangles it has.
    pub fn count(&self) -> usize {
        self.total.count as usize
    }
}

/// Cuts one run after the other, in the same room.
#[derive(Debug, Default)]
pub struct Sweep {
    /// What stands from each item to the end of a run.
    behind: Vec<Item>,
}

impl Sweep {
    /// Up to eight parts of a run, side by side and in order: whichever has the largest box is cut first, those of at
    /// most `whole` triangles or of one item never. `scale` brings extents of boxes near to 1, so that no area
    /// overflows or vanishes.
    #[inline(always)]
    pub fn open(&mut self, items: &[Item], run: Run, whole: usize, scale: f32) -> impl Iterator<Item = Run> + use<> {
        let mut parts = [const { None::<Run> }; LANES];
        let mut areas = [-1.0; LANES];
        (areas[0], parts[0]) = (f32::MAX, Some(run));
        for count in 1..LANES {
            let largest = (1..count).fold(0, |best, part| if areas[part] > areas[best] { part } else { best });
            if areas[largest] < 0.0 {
                break;
            }
            let Some(run) = parts[largest].take() else { break };
            let [left, right] = self.cut(items, run, scale);
            parts[largest + 1..=count].rotate_right(1);
            areas[largest + 1..=count].rotate_right(1);
            let area = |run: &Run| {
                let may_be_cut = run.count() > whole && run.items.len() > 1;
                if may_be_cut { run.total.area(scale) } else { -1.0 }
            };
            (areas[largest], areas[largest + 1]) = (area(&left), area(&right));
            (parts[largest], parts[largest + 1]) = (Some(left), Some(right));
        }
        parts.into_iter().flatten()
    }

    /// The two parts of a run of at least two items that cost least.
    #[inline(always)]
    fn cut(&mut self, all: &[Item], run: Run, scale: f32) -> [Run; 2] {
        let items = &all[run.items.clone()];
        self.behind.clear();
        self.behind.resize(items.len(), Item::NONE);
        let mut right = Item::NONE;
        for (behind, item) in self.behind.iter_mut().zip(items).rev() {
            right = right.with(item);
            *behind = right;
        }
        let (mut best, mut least, mut best_left) = (0, f32::INFINITY, Item::NONE);
        let mut left = Item::NONE;
        for place in 1..items.len() {
            left = left.with(&items[place - 1]);
            let cost = left.cost(scale) + self.behind[place].cost(scale);
            if cost < least {
                (best, least, best_left) = (place, cost, left);
            }
        }
        let Range { start, end } = run.items;
        let middle = start + best;
        [Run { items: start..middle, total: best_left }, Run { items: middle..end, total: self.behind[best] }]
    }
}
