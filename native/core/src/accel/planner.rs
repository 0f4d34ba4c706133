//! The binned surface area heuristic straight to wide nodes: a node's largest child is divided until eight are side by
//! side. No binary tree is kept; the records move between two buffers, so that a division is one pass without a branch.

use std::ops::Range;

use super::{
    bins::{self, Bins, Mapping, Plane, Side},
    draft::Draft,
    record::Record,
    structure::NodeRef,
};
use crate::triangle::LANES;

/// What is left to decide on.
#[derive(Debug, Clone, Copy)]
pub struct Set {
    /// In which buffer its records are.
    buffer: usize,
    begin: usize,
    end: usize,
    depth: usize,
    side: Side,
}

impl Set {
    /// How many triangles it has.
    pub fn count(&self) -> usize {
        self.side.count as usize
    }

    fn range(&self) -> Range<usize> {
        self.begin..self.end
    }
}

/// Below this depth of divisions records are halved as they stand, which bounds the stack of every traversal.
const MOST_DEPTH: usize = 64;

/// Bins for a number of records: few records do not need the sixteen that Wald finds enough, and clearing and sweeping
/// bins is most of the work for them.
#[inline(always)]
pub fn bins_for(records: usize) -> usize {
    bins::MOST.min(4 + records / 32)
}

/// Room to plan in, reused from subtree to subtree.
#[derive(Debug, Clone)]
pub struct Planner {
    buffers: [Vec<Record>; 2],
    bins: Bins,
}

impl Default for Planner {
    fn default() -> Self {
        Self { buffers: [Vec::new(), Vec::new()], bins: Bins::EMPTY }
    }
}

impl Planner {
    /// Add a subtree over records to an empty draft; they refer to `triangles`. At most `leaf_size` triangles are
    /// together in a leaf, and no record has more.
    pub fn plan(
        &mut self,
        records: impl Iterator<Item = Record>,
        triangles: &[u32],
        leaf_size: usize,
        draft: &mut Draft,
    ) {
        self.buffers[0].clear();
        self.buffers[0].extend(records);
        let count = self.buffers[0].len();
        self.buffers[1].resize(count.max(self.buffers[1].len()), Record::NONE);
        let set = Set { buffer: 0, begin: 0, end: count, depth: 0, side: Side::of(&self.buffers[0]) };
        let mut work = Work { planner: self, triangles, leaf_size, draft };
        let root = work.subtree(&set);
        (draft.root, draft.stack_size) = root;
    }
}

struct Work<'a> {
    planner: &'a mut Planner,
    triangles: &'a [u32],
    leaf_size: usize,
    draft: &'a mut Draft,
}

impl Work<'_> {
    /// Returns where it is, and the entries a traversal needs on its stack.
    fn subtree(&mut self, set: &Set) -> (NodeRef, usize) {
        if set.count() <= self.leaf_size {
            return (self.leaf(set), 0);
        }
        let (children, count) = self.open(set);
        let slot = self.draft.nodes.len();
        self.draft.nodes.push([NodeRef::EMPTY; LANES]);
        let mut deepest = 0;
        for lane in 0..count {
            let (child, below) = self.subtree(&children[lane]);
            self.draft.nodes[slot][lane] = child;
            deepest = deepest.max(below);
        }
        (NodeRef::branch(slot), count - 1 + deepest)
    }

    fn leaf(&mut self, set: &Set) -> NodeRef {
        let records = &self.planner.buffers[set.buffer][set.range()];
        self.draft.push_leaf(records.iter().flat_map(|record| self.triangles[record.range()].iter().copied()))
    }

    /// Up to eight parts of a set.
    fn open(&mut self, set: &Set) -> ([Set; LANES], usize) {
        let (mut parts, mut areas, mut count) = ([*set; LANES], [0.0f32; LANES], 1);
        areas[0] = f32::MIN_POSITIVE;
        while count < LANES {
            let largest = (1..count).fold(0, |best, lane| if areas[lane] > areas[best] { lane } else { best });
            if areas[largest] < 0.0 {
                break;
            }
            let [left, right] = self.planner.divide(&parts[largest]);
            (parts[largest], parts[count]) = (left, right);
            (areas[largest], areas[count]) = (self.priority(&left), self.priority(&right));
            count += 1;
        }
        (parts, count)
    }

    /// The area of what may be divided; less than none for a leaf.
    fn priority(&self, set: &Set) -> f32 {
        if set.count() <= self.leaf_size { -1.0 } else { set.side.bounds.half_area() }
    }
}

impl Planner {
    fn divide(&mut self, set: &Set) -> [Set; 2] {
        let plane = if set.depth < MOST_DEPTH { self.best_plane(set) } else { None };
        match plane {
            Some((plane, mapping)) => self.partition(set, &plane, &mapping),
            None => self.halve(set),
        }
    }

    fn best_plane(&mut self, set: &Set) -> Option<(Plane, Mapping)> {
        let records = &self.buffers[set.buffer][set.range()];
        let used = bins_for(records.len());
        let mapping = Mapping::new(records, used);
        self.bins.fill(records, &mapping, used);
        Some((self.bins.cheapest()?, mapping))
    }

    fn partition(&mut self, set: &Set, plane: &Plane, mapping: &Mapping) -> [Set; 2] {
        let [left, right] = self.bins.sides(plane);
        let [first, second] = &mut self.buffers;
        let (from, to) = if set.buffer == 0 { (first, second) } else { (second, first) };
        let middle = set.begin + partition(&from[set.range()], &mut to[set.range()], plane, mapping);
        let set = Set { buffer: 1 - set.buffer, depth: set.depth + 1, ..*set };
        [Set { end: middle, side: left, ..set }, Set { begin: middle, side: right, ..set }]
    }

    fn halve(&mut self, set: &Set) -> [Set; 2] {
        let middle = (set.begin + set.end) / 2;
        let records = &self.buffers[set.buffer];
        let (left, right) = (Side::of(&records[set.begin..middle]), Side::of(&records[middle..set.end]));
        let set = Set { depth: set.depth + 1, ..*set };
        [Set { end: middle, side: left, ..set }, Set { begin: middle, side: right, ..set }]
    }
}

/// Copy what lies before a plane to the front and the rest, backwards, to the end; returns how many went to the front.
/// Both places are written to, so that nothing depends on a branch that nobody can predict.
#[inline(always)]
fn partition(from: &[Record], to: &mut [Record], plane: &Plane, mapping: &Mapping) -> usize {
    let (mut left, mut right) = (0, from.len());
    for record in from {
        to[left] = *record;
        to[right - 1] = *record;
        let is_left = mapping.is_left(record, plane);
        left += usize::from(is_left);
        right -= usize::from(!is_left);
    }
    left
}
