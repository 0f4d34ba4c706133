//! A subtree that is divided down to leaves, as a binary tree, of which the cheapest wide nodes are chosen once it is known
//! in how many places it is to be shown: the best root of a subtree may be several, side by side in a node above.

use super::{
    bins::Bins,
    collapse::{Binary, Collapse, Costs, Weighed},
    draft::{Draft, Root},
    planner::{MOST_DEPTH, Set, divide},
    record::Record,
    structure::{NodeRef, Target},
};
use crate::{
    Error,
    simd::{Kernel, Level, Simd},
    triangle::LANES,
};

/// See the module's text.
#[derive(Debug)]
pub struct Divided {
    shape: Shape,
    collapse: Collapse,
    costs: [f32; LANES],
    draft: Draft,
}

/// Room to divide in, reused from subtree to subtree.
#[derive(Debug)]
pub struct Divider {
    records: Vec<Record>,
    spare: Vec<Record>,
    links: Vec<Link>,
    costs: Costs,
    bins: Bins,
    level: Level,
}

impl Default for Divider {
    fn default() -> Self {
        let (records, spare, links) = (Vec::new(), Vec::new(), Vec::new());
        Self { records, spare, links, costs: Costs::default(), bins: Bins::EMPTY, level: Level::detect() }
    }
}

impl Divider {
    /// Divide a subtree over the records of some parts, `count` triangles of those listed in `triangles`. At most
    /// `leaf_size` triangles are together in a leaf, and no record has more. Costs are areas in units of `unit`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn divide<'a>(
        &mut self,
        parts: impl Iterator<Item = &'a [Record]>,
        (count, triangles): (usize, &[u32]),
        leaf_size: usize,
        unit: f32,
    ) -> Result<Divided, Error> {
        let Self { records, spare, links, costs, bins, level } = self;
        records.clear();
        records.reserve(count / 2);
        parts.for_each(|part| records.extend_from_slice(part));
        spare.resize(records.len().max(spare.len()), Record::NONE);
        links.clear();
        let mut draft = Draft::for_triangles(count);
        let set = Set::new(records, spare);
        level.run(Division { set, bins, triangles, leaf_size, links, draft: &mut draft });
        let collapse = Collapse::of(&links[..], unit, costs)?;
        let shape = Shape(links.iter().map(|link| link.target).collect());
        Ok(Divided { shape, collapse, costs: costs.of_root(), draft })
    }
}

impl Divided {
    /// How many triangles there are.
    pub fn triangles(&self) -> usize {
        self.draft.triangles
    }

    /// See [`Weighed::costs`].
    pub fn costs(&self) -> [f32; LANES] {
        self.costs
    }

    /// How many roots it has where it is shown in at most so many places.
    pub fn roots(&self, places: usize) -> usize {
        self.collapse.shown(&self.shape, places).1
    }

    /// The subtree, shown in at most so many places.
    pub fn widened(self, places: usize) -> Draft {
        let Self { shape, collapse, mut draft, .. } = self;
        let (roots, count) = collapse.shown(&shape, places);
        for &(root, _) in &roots[..count] {
            let root = Widening { shape: &shape, collapse: &collapse, draft: &mut draft }.subtree(root);
            draft.roots.push(root);
        }
        draft
    }
}

/// A node of a binary tree in preorder.
#[derive(Debug, Clone, Copy)]
struct Link {
    half_area: f32,
    target: NodeRef,
}

/// Leaves, and branches by their right child; the left one is the next node.
#[derive(Debug)]
struct Shape(Box<[NodeRef]>);

#[inline]
fn children(node: usize, target: NodeRef) -> Option<[usize; 2]> {
    match target.target() {
        Target::Branch(right) => Some([node + 1, right as usize]),
        _ => None,
    }
}

impl Binary for Shape {
    #[inline]
    fn children(&self, node: usize) -> Option<[usize; 2]> {
        children(node, self.0[node])
    }
}

impl Binary for [Link] {
    #[inline]
    fn children(&self, node: usize) -> Option<[usize; 2]> {
        children(node, self[node].target)
    }
}

impl Weighed for [Link] {
    fn count(&self) -> usize {
        self.len()
    }

    #[inline]
    fn half_area(&self, node: usize) -> f32 {
        self[node].half_area
    }
}

/// Divides a set down to leaves.
struct Division<'r, 'a> {
    set: Set<'r>,
    bins: &'a mut Bins,
    triangles: &'a [u32],
    leaf_size: usize,
    links: &'a mut Vec<Link>,
    draft: &'a mut Draft,
}

impl Kernel for Division<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { mut set, bins, triangles, leaf_size, links, draft } = self;
        // Right children, and whose.
        let mut waiting = Vec::with_capacity(2 * MOST_DEPTH);
        loop {
            let half_area = set.half_area();
            if set.count() > leaf_size {
                let [left, right] = divide(simd, set, bins);
                waiting.push((links.len(), right));
                links.push(Link { half_area, target: NodeRef::EMPTY });
                set = left;
                continue;
            }
            let places = set.records().iter().flat_map(|record| record.range());
            let target = draft.push_leaf(places.map(|place| triangles[place]));
            links.push(Link { half_area, target });
            let Some((parent, right)) = waiting.pop() else { return };
            links[parent].target = NodeRef::branch(links.len());
            set = right;
        }
    }
}

/// Makes wide nodes of the binary ones.
struct Widening<'a> {
    shape: &'a Shape,
    collapse: &'a Collapse,
    draft: &'a mut Draft,
}

impl Widening<'_> {
    fn subtree(&mut self, node: usize) -> Root {
        let Target::Branch(_) = self.shape.0[node].target() else {
            return Root { node: self.shape.0[node], stack_size: 0 };
        };
        let slot = self.draft.nodes.len();
        self.draft.nodes.push([NodeRef::EMPTY; LANES]);
        let (children, count) = self.collapse.children(self.shape, node);
        let mut deepest = 0;
        for (lane, &(child, _)) in children[..count].iter().enumerate() {
            let child = self.subtree(child);
            self.draft.nodes[slot][lane] = child.node;
            deepest = deepest.max(child.stack_size);
        }
        Root { node: NodeRef::branch(slot), stack_size: count - 1 + deepest }
    }
}
