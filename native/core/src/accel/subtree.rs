//! One ray against a part of the binary tree, before it is packed: how the hybrids ask a node's own triangles.

use glam::Vec3;

use super::tree::{Tree, TreeNode};
use crate::{
    Mesh,
    bounds::Bounds,
    ray::{Hit, MISS},
    traverse::frame::{Domain, Frame},
    triangle,
};

/// Levels of the binary tree that one wide node stands for: it has 2^3 children.
const LEVELS_PER_NODE: f64 = 3.0;

/// What queries did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Branches of the binary tree visited.
    pub branches: u64,
    /// Leaves visited.
    pub blocks: u64,
}

impl Work {
    /// How many wide nodes the packed tree would have visited, about: where wide nodes begin is settled only by
    /// packing, and over all levels at which they could, this is the mean.
    pub fn nodes(&self) -> f64 {
        self.branches as f64 / LEVELS_PER_NODE
    }
}

/// Queries of subtrees, one after the other.
pub struct Walker<'a> {
    tree: &'a Tree,
    mesh: &'a Mesh,
    centre: Vec3,
    stack: Vec<Entry>,
    /// The sum over all queries so far.
    pub work: Work,
}

#[derive(Clone, Copy)]
struct Entry {
    node: u32,
    near: f32,
}

impl<'a> Walker<'a> {
    /// A walker over a tree of the domain's scene.
    pub fn new(tree: &'a Tree, mesh: &'a Mesh, domain: &Domain) -> Self {
        Self { tree, mesh, centre: domain.centre, stack: Vec::new(), work: Work::default() }
    }

    /// The first hit among the triangles below node `root`, or, where `ANY`, some hit.
    pub fn trace<const ANY: bool>(&mut self, root: usize, frame: &Frame) -> Hit {
        let mut best = Hit { t: frame.tmax, ..Hit::MISS };
        self.stack.clear();
        self.meet(root, frame, best.t);
        while let Some(entry) = self.stack.pop() {
            if entry.near > best.t {
                continue;
            }
            match self.tree.children(entry.node as usize) {
                Some(children) => {
                    self.work.branches += 1;
                    self.meet_both(children, frame, best.t);
                }
                None => {
                    self.work.blocks += 1;
                    self.test(&self.tree.nodes[entry.node as usize], frame, &mut best);
                    if ANY && best.primitive != MISS {
                        return best;
                    }
                }
            }
        }
        best
    }

    /// Put the children that the ray meets on the stack, the nearer one on top.
    fn meet_both(&mut self, [left, right]: [usize; 2], frame: &Frame, limit: f32) {
        let height = self.stack.len();
        self.meet(left, frame, limit);
        self.meet(right, frame, limit);
        if let [first, second] = &mut self.stack[height..]
            && first.near < second.near
        {
            std::mem::swap(first, second);
        }
    }

    fn meet(&mut self, node: usize, frame: &Frame, limit: f32) {
        if let Some(near) = enter(&self.tree.nodes[node].bounds, self.centre, frame, limit) {
            self.stack.push(Entry { node: node as u32, near });
        }
    }

    fn test(&self, node: &TreeNode, frame: &Frame, best: &mut Hit) {
        for item in self.tree.items_of(node) {
            if enter(&item.bounds, self.centre, frame, best.t).is_none() {
                continue;
            }
            let corners = self.mesh.corners(item.primitive).map(|corner| corner.to_array());
            if let Some(hit) = triangle::intersect(frame, corners, item.primitive)
                && hit.precedes(best)
            {
                *best = hit;
            }
        }
    }
}

/// Where the ray enters a dilated box, if it does before `limit`: the test of [`crate::traverse`]'s nodes.
#[inline]
fn enter(bounds: &Bounds, centre: Vec3, frame: &Frame, limit: f32) -> Option<f32> {
    cross(bounds, centre, frame, limit).map(|[near, _]| near)
}

/// Where the ray enters and leaves a dilated box, if it enters before `limit`, which also ends it.
#[inline]
pub fn cross(bounds: &Bounds, centre: Vec3, frame: &Frame, limit: f32) -> Option<[f32; 2]> {
    let (lower, upper) = (bounds.lower - centre, bounds.upper - centre);
    let (mut near, mut far) = (frame.tmin, limit);
    for k in 0..3 {
        let (first, last) = if frame.inverse[k] < 0.0 { (upper[k], lower[k]) } else { (lower[k], upper[k]) };
        near = near.max(first * frame.inverse[k] + frame.near_bias[k]);
        far = far.min(last * frame.inverse[k] + frame.far_bias[k]);
    }
    (near <= far).then_some([near, far])
}
