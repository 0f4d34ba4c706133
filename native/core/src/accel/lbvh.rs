//! The linear hierarchy: a node divides where the Morton codes of its triangles first differ. After Lauterbach, Garland,
//! Sengupta, Luebke and Manocha, "Fast BVH Construction on GPUs", Eurographics 2009; from the sorted codes alone, as
//! Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", HPG 2012, but from the root
//! down, straight to wide nodes, and with leaves that are well filled.
//!
//! Rays through these trees take 1.2 times as long as through those of `bvh-clusters`, and that is in the leaves and just
//! above them. Tried, with what rays then took, camera rays and bounces together over six scenes (Zen 5):
//!
//! * the surface area heuristic above parts of 16 to 1024 triangles (Pantaleoni and Luebke, "HLBVH", HPG 2010): 1.03 times
//!   to 1/1.02, whatever the size of parts;
//! * codes of 36 bits: 1/1.00; codes with bits for sizes (Vinkler, Bittner and Havran, "Extended Morton Codes", HPG 2017):
//!   camera rays 1/1.025 over 13 scenes (room 1/1.13, soup 1.03 times), for a longer encoding;
//! * wide nodes closed from the leaves up whenever they are full, of which there are a third fewer: 1/1.00;
//! * the wide nodes of least area by true boxes: 1/1.06, but boxes would have to be known before nodes are planned, and by
//!   estimate the table takes longer than a million camera rays would gain.

use std::ops::Range;

use super::{
    curve::{Parts, Subtree, highest_change},
    draft::Draft,
    forest::{Child, SUBTREE, Top},
    morton::Key,
};
use crate::{Error, Job, simd::Level, work};

/// Plan the tree over sorted triangles.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn plan(keys: &[Key], leaf_size: usize, job: &Job) -> Result<(Top, Vec<Draft>), Error> {
    let (upper, level) = (Upper { keys, leaf_size }, Level::detect());
    let (mut top, mut subtrees) = (Top::default(), Vec::new());
    if !keys.is_empty() {
        upper.node(0..keys.len(), &mut top, &mut subtrees);
    }
    let drafts = work::largest_first(subtrees.into_iter(), Range::len, job, |changes: &mut Vec<f32>, range| {
        let mut draft = Draft::for_triangles(range.len());
        level.run(Subtree { keys: &keys[range], leaf_size, changes, draft: &mut draft });
        job.advance(draft.triangles as u64);
        Ok(draft)
    })?;
    Ok((top, drafts))
}

/// The part of the tree above its subtrees.
struct Upper<'a> {
    keys: &'a [Key],
    leaf_size: usize,
}

impl Upper<'_> {
    fn node(&self, range: Range<usize>, top: &mut Top, subtrees: &mut Vec<Range<usize>>) -> Child {
        if range.len() <= SUBTREE {
            subtrees.push(range);
            return Child::Root(subtrees.len() - 1);
        }
        let slot = top.nodes.len();
        top.nodes.push(Vec::new());
        let mut parts = Parts::of(range);
        while let Some(part) = parts.largest(self.leaf_size) {
            parts.cut(part, self.middle(parts.range(part)));
        }
        top.nodes[slot] = parts.each().map(|part| self.node(part, top, subtrees)).collect();
        Child::Top(slot)
    }

    /// Where the highest bit changes that changes at all; in the middle where none does.
    fn middle(&self, range: Range<usize>) -> usize {
        let keys = &self.keys[range.clone()];
        let Some(bit) = highest_change(keys) else { return range.start + keys.len() / 2 };
        range.start + keys.partition_point(|key| key.code() >> bit & 1 == 0)
    }
}
