//! The binned surface area heuristic over records, which move between two buffers, so that a division is one pass without
//! a branch. At the top of a tree a node's largest child is divided until eight are side by side; a subtree is divided
//! down to leaves as a binary tree, of which the cheapest wide nodes are chosen.

use rayon::prelude::*;

use super::{
    bins::{self, Bins, Centres, Mapping, Plane, Side},
    collapse::{Binary, Collapse},
    draft::Draft,
    record::Record,
    structure::NodeRef,
};
use crate::{
    Error,
    simd::{Kernel, Level, Simd},
    triangle::LANES,
};

/// What is left to decide on: records, as much room again, and what they are together.
#[derive(Debug)]
pub struct Set<'r> {
    records: &'r mut [Record],
    spare: &'r mut [Record],
    depth: usize,
    side: Side,
}

impl<'r> Set<'r> {
    /// All of some records; there must be as much spare room.
    pub fn new(records: &'r mut [Record], spare: &'r mut [Record]) -> Self {
        let side = Side::of(records);
        Self { records, spare, depth: 0, side }
    }

    /// How many triangles it has.
    pub fn count(&self) -> usize {
        self.side.count as usize
    }

    /// Its area where it may be divided; less than none where it has at most `whole` triangles.
    #[inline(always)]
    fn priority(&self, whole: usize) -> f32 {
        if self.count() <= whole { -1.0 } else { self.side.half_area() }
    }

    /// Its records.
    pub fn records(&self) -> &[Record] {
        self.records
    }

    /// Its records, for as long as they live.
    pub fn into_records(self) -> &'r [Record] {
        self.records
    }

    /// The first `middle` records, on `left`, and the others.
    #[inline(always)]
    fn split(self, middle: usize, [left, right]: [Side; 2]) -> [Self; 2] {
        let (records, spare) = (self.records.split_at_mut(middle), self.spare.split_at_mut(middle));
        let depth = self.depth + 1;
        [
            Self { records: records.0, spare: spare.0, depth, side: left },
            Self { records: records.1, spare: spare.1, depth, side: right },
        ]
    }
}

/// Below this depth of divisions records are halved as they stand, which bounds the stack of every traversal.
const MOST_DEPTH: usize = 64;

/// Larger sets are put into bins in parallel, in parts of this size.
const PART: usize = 1 << 14;

/// Bins for a number of records: few records do not need the sixteen that Wald finds enough, and clearing and sweeping
/// bins is most of the work for them. Measured, against sixteen always: the same cost of the tree to 0.5%, in 0.8 of the
/// time; with 4 + n / 32, up to 3% more, as leaves are filled less well.
#[inline(always)]
fn bins_for(records: usize) -> usize {
    bins::MOST.min(8 + records / 16)
}

/// Up to eight parts of a set, side by side: whichever has the largest box is divided first, those of at most `whole`
/// triangles never. After Wald, Benthin and Boulos, "Getting Rid of Packets", RT 2008.
pub fn open<'r>(set: Set<'r>, whole: usize, bins: &mut Bins, level: Level) -> [Option<Set<'r>>; LANES] {
    level.run(Open { set, whole, bins })
}

struct Open<'r, 'b> {
    set: Set<'r>,
    whole: usize,
    bins: &'b mut Bins,
}

impl<'r> Kernel for Open<'r, '_> {
    type Output = [Option<Set<'r>>; LANES];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let mut parts = [const { None::<Set<'r>> }; LANES];
        let mut areas = [-1.0; LANES];
        areas[0] = f32::MAX;
        parts[0] = Some(self.set);
        for count in 1..LANES {
            let mut largest = 0;
            for lane in 1..count {
                largest = if areas[lane] > areas[largest] { lane } else { largest };
            }
            if areas[largest] < 0.0 {
                break;
            }
            let Some(set) = parts[largest].take() else { break };
            let [left, right] = divide(simd, set, self.bins);
            (areas[largest], areas[count]) = (left.priority(self.whole), right.priority(self.whole));
            (parts[largest], parts[count]) = (Some(left), Some(right));
        }
        parts
    }
}

#[inline(always)]
fn divide<'r, S: Simd>(simd: S, set: Set<'r>, bins: &mut Bins) -> [Set<'r>; 2] {
    let plane = if set.depth < MOST_DEPTH { best_plane(simd, set.records, bins) } else { None };
    match plane {
        Some((plane, mapping)) => {
            let middle = partition(simd, set.records, set.spare, &plane, &mapping);
            let set = Set { records: set.spare, spare: set.records, ..set };
            set.split(middle, bins.sides(simd, &plane))
        }
        None => {
            let middle = set.records.len() / 2;
            let sides = [Side::of(&set.records[..middle]), Side::of(&set.records[middle..])];
            set.split(middle, sides)
        }
    }
}

#[inline(always)]
fn best_plane<S: Simd>(simd: S, records: &[Record], bins: &mut Bins) -> Option<(Plane, Mapping)> {
    let used = bins_for(records.len());
    let mapping = if records.len() <= PART {
        let mapping = Mapping::between(&Centres::of(records), used);
        bins.fill(simd, records, &mapping, used);
        mapping
    } else {
        fill_parallel(simd, records, bins, used)
    };
    Some((bins.cheapest()?, mapping))
}

fn fill_parallel<S: Simd>(simd: S, records: &[Record], bins: &mut Bins, used: usize) -> Mapping {
    let parts = records.par_chunks(PART);
    let both = |a: Centres, b: Centres| a.union(&b);
    let mapping = Mapping::between(&parts.clone().map(Centres::of).reduce(|| Centres::EMPTY, both), used);
    let filled = parts.map(|part| {
        let mut bins = Bins::EMPTY;
        simd.run(Fill { bins: &mut bins, part, mapping: &mapping, used });
        bins
    });
    *bins = filled.reduce_with(Bins::with).unwrap_or(Bins::EMPTY);
    mapping
}

struct Fill<'a> {
    bins: &'a mut Bins,
    part: &'a [Record],
    mapping: &'a Mapping,
    used: usize,
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.bins.fill(simd, self.part, self.mapping, self.used);
    }
}

/// Copy what lies before a plane to the front and the rest, backwards, to the end; returns how many went to the front.
/// Both places are written to, so that nothing depends on a branch that nobody can predict, and by vectors: a record that
/// is copied as such goes through memory first.
#[inline(always)]
fn partition<S: Simd>(simd: S, from: &[Record], to: &mut [Record], plane: &Plane, mapping: &Mapping) -> usize {
    let (mut left, mut right) = (0, from.len());
    let (lower, scale) = mapping.along(plane.axis);
    for record in from {
        let row = simd.load(&record.row);
        to[left].row = simd.store(row);
        to[right - 1].row = simd.store(row);
        let is_left = Mapping::is_left(lower, scale, record, plane);
        left += usize::from(is_left);
        right -= usize::from(!is_left);
    }
    left
}

/// Room to plan in, reused from subtree to subtree.
#[derive(Debug, Clone)]
pub struct Planner {
    records: Vec<Record>,
    spare: Vec<Record>,
    bins: Bins,
    links: Links,
    collapse: Collapse,
    level: Level,
}

impl Default for Planner {
    fn default() -> Self {
        Self {
            records: Vec::new(),
            spare: Vec::new(),
            bins: Bins::EMPTY,
            links: Links::default(),
            collapse: Collapse::default(),
            level: Level::detect(),
        }
    }
}

impl Planner {
    /// Fill an empty draft with the subtree over the records that are added, which refer to `triangles`. At most
    /// `leaf_size` triangles are together in a leaf, and no record has more.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn plan(
        &mut self,
        add_records: impl FnOnce(&mut Vec<Record>),
        triangles: &[u32],
        leaf_size: usize,
        draft: &mut Draft,
    ) -> Result<(), Error> {
        let Self { records, spare, bins, links, collapse, level } = self;
        records.clear();
        add_records(records);
        let count = records.len();
        spare.resize(count.max(spare.len()), Record::NONE);
        links.0.clear();
        let set = Set::new(records, &mut spare[..count]);
        level.run(Division { set, bins, triangles, leaf_size, links, draft });
        collapse.find(links)?;
        (draft.root, draft.stack_size) = Widening { links, collapse, draft }.subtree(0);
        Ok(())
    }
}

/// A binary tree in preorder.
#[derive(Debug, Default, Clone)]
struct Links(Vec<Link>);

#[derive(Debug, Clone, Copy)]
struct Link {
    half_area: f32,
    /// The right child; the left one is the next node.
    right: u32,
    /// What it is instead, where it is a leaf.
    leaf: NodeRef,
}

impl Binary for Links {
    fn count(&self) -> usize {
        self.0.len()
    }

    #[inline]
    fn children(&self, node: usize) -> Option<[usize; 2]> {
        let link = &self.0[node];
        (link.leaf == NodeRef::EMPTY).then_some([node + 1, link.right as usize])
    }

    #[inline]
    fn half_area(&self, node: usize) -> f32 {
        self.0[node].half_area
    }
}

/// Divides a set down to leaves.
struct Division<'r, 'a> {
    set: Set<'r>,
    bins: &'a mut Bins,
    triangles: &'a [u32],
    leaf_size: usize,
    links: &'a mut Links,
    draft: &'a mut Draft,
}

impl Kernel for Division<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { mut set, bins, triangles, leaf_size, links: Links(links), draft } = self;
        // Right children, and whose.
        let mut waiting = Vec::with_capacity(2 * MOST_DEPTH);
        loop {
            let half_area = set.side.half_area();
            if set.count() > leaf_size {
                let [left, right] = divide(simd, set, bins);
                waiting.push((links.len(), right));
                links.push(Link { half_area, right: 0, leaf: NodeRef::EMPTY });
                set = left;
                continue;
            }
            let places = set.records.iter().flat_map(|record| record.range());
            let leaf = draft.push_leaf(places.map(|place| triangles[place]));
            links.push(Link { half_area, right: 0, leaf });
            let Some((parent, right)) = waiting.pop() else { return };
            links[parent].right = links.len() as u32;
            set = right;
        }
    }
}

/// Makes wide nodes of the binary ones.
struct Widening<'a> {
    links: &'a Links,
    collapse: &'a Collapse,
    draft: &'a mut Draft,
}

impl Widening<'_> {
    /// Returns where it is, and the entries a traversal needs on its stack.
    fn subtree(&mut self, node: usize) -> (NodeRef, usize) {
        let leaf = self.links.0[node].leaf;
        if leaf != NodeRef::EMPTY {
            return (leaf, 0);
        }
        let slot = self.draft.nodes.len();
        self.draft.nodes.push([NodeRef::EMPTY; LANES]);
        let (children, count) = self.collapse.children(self.links, node);
        let mut deepest = 0;
        for (lane, &child) in children[..count].iter().enumerate() {
            let (child, below) = self.subtree(child);
            self.draft.nodes[slot][lane] = child;
            deepest = deepest.max(below);
        }
        (NodeRef::branch(slot), count - 1 + deepest)
    }
}
