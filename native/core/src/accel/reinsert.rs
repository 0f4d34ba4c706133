//! Insertion-based optimisation: subtrees are taken out of a binary hierarchy and put back where they add least to the
//! area of all boxes. Bittner, Hapala and Havran, "Fast Insertion-Based Optimization of Bounding Volume Hierarchies",
//! CGF 32(1), 2013; the search for places by branch and bound from the old place upwards, for all nodes at once, after
//! Meister and Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", CGF 37(2), 2018.
//!
//! Unlike theirs, moves are made one after the other, those that gain most first, so that the tree does not depend on
//! the number of threads: the search takes nearly all the time.
//!
//! Steps a ray, primary and diffuse together, over those of `bvh-sah` on Sponza, Sibenik and hair: `bvh-sah+reinsert`
//! 0.76, 0.84, 0.87; `sbvh+reinsert` 0.78, 0.85, 0.80; `ploc+reinsert` 0.68, 0.90, 0.90. Hair stays short of 0.85
//! without spatial splits: 4 rounds reach 0.875 there, and 16 no more than 0.874, for its triangles are long, thin and
//! slanted, so that most of a leaf's box is empty and overlaps others wherever the leaf is put; only cutting them helps.
//! On Sibenik `ploc+reinsert` stays short as it starts from a worse tree, and moves of single subtrees that each must
//! gain end where it is 6% behind `bvh-sah+reinsert`. Less area is not always fewer steps: on
//! Sponza 4 rounds over `bvh-sah` reach 0.72 with more area left than after 16, on Sibenik `sbvh` alone reaches 0.81.

use rayon::prelude::*;

use super::{
    config::Config,
    links::{Link, Links, NONE},
    tree::Tree,
};
use crate::{
    Error, Job,
    bounds::{Bounds, BoundsA},
    error,
};

/// Nodes that one thread searches places for between two looks at the job.
const PART: usize = 1 << 6;

/// Places that a search looks at before it takes the best so far: where boxes agree, no bound ends it.
const MOST_PLACES: usize = 1 << 11;

/// Gains below this share of a parent's area may be rounding errors.
const LEAST_GAIN: f32 = 1e-4;

/// A round that makes all areas together smaller by less than this share is the last.
const LEAST_PROGRESS: f64 = 1e-3;

/// Improve a tree without grids.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn improve(tree: Tree, scene: &Bounds, config: &Config, job: &Job, units: u64) -> Result<Tree, Error> {
    let mut left = units;
    if tree.nodes.len() > 3 {
        let mut links = Links::of(&tree, scene)?;
        for _ in 0..config.reinsert_rounds {
            let gain = links.round(job)?;
            let share = left.min(units / config.reinsert_rounds as u64);
            job.advance(share);
            left -= share;
            if gain < LEAST_PROGRESS {
                break;
            }
        }
        job.advance(left);
        return links.tree(&tree.items, config.leaf_size, job);
    }
    job.advance(left);
    Ok(tree)
}

/// A subtree, its new sibling, and by how much the sum of areas falls.
#[derive(Clone, Copy)]
struct Move {
    gain: f32,
    node: u32,
    sibling: u32,
}

impl Move {
    const NONE: Self = Self { gain: 0.0, node: NONE, sibling: NONE };
}

impl Links {
    /// Move what is better elsewhere. Returns by which share the sum of all inner areas fell.
    fn round(&mut self, job: &Job) -> Result<f64, Error> {
        let before = self.area();
        let mut moves = self.moves(job)?;
        moves.par_sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        let mut touched = error::filled(self.nodes.len(), false, "the marks of moved subtrees")?;
        for (index, step) in moves.iter().enumerate() {
            if index.is_multiple_of(1 << 12) {
                job.check()?;
            }
            self.make(step, &mut touched);
        }
        Ok(1.0 - self.area() / before)
    }

    fn area(&self) -> f64 {
        self.nodes.iter().filter(|link| !link.is_leaf()).map(|link| f64::from(link.bounds.half_area())).sum()
    }

    fn moves(&self, job: &Job) -> Result<Vec<Move>, Error> {
        let mut moves = error::filled(self.nodes.len(), Move::NONE, "the moves of subtrees")?;
        moves.par_chunks_mut(PART).enumerate().try_for_each_init(Vec::new, |open, (part, moves)| {
            job.check()?;
            for (offset, step) in moves.iter_mut().enumerate() {
                *step = self.best_move((part * PART + offset) as u32, open);
            }
            Ok::<_, Error>(())
        })?;
        moves.retain(|step| step.gain > 0.0);
        Ok(moves)
    }

    /// The best new place of a node, if one is better than where it is.
    fn best_move(&self, node: u32, open: &mut Vec<(f32, u32)>) -> Move {
        let parent = self.nodes[node as usize].parent;
        if parent == NONE || self.nodes[parent as usize].parent == NONE {
            return Move::NONE;
        }
        let mut search = Search::new(self, node, open);
        let (mut pivot, mut sibling) = (parent, self.sibling(node));
        // What remains of the pivot without the node, and by how much all areas up to it fall.
        let (mut rest, mut freed) = (BoundsA::EMPTY, self.nodes[parent as usize].bounds.half_area());
        search.least = freed * LEAST_GAIN;
        while search.places > 0 {
            search.below(sibling, freed);
            rest = rest.union(&self.nodes[sibling as usize].bounds);
            let above = self.nodes[pivot as usize].parent;
            if above == NONE {
                break;
            }
            if pivot != parent {
                freed += self.nodes[pivot as usize].bounds.half_area() - rest.half_area();
            }
            sibling = self.sibling(pivot);
            pivot = above;
        }
        search.best
    }

    /// Make a move, unless another of this round has changed what it starts from.
    fn make(&mut self, step: &Move, touched: &mut [bool]) {
        let Move { node, sibling: target, .. } = *step;
        let (parent, old) = (self.nodes[node as usize].parent, self.sibling(node));
        let (above_old, above_new) = (self.nodes[parent as usize].parent, self.nodes[target as usize].parent);
        let places = [node, parent, old, above_old, target, above_new];
        let is_stale = places.iter().any(|&place| place == NONE || touched[place as usize]);
        if is_stale || target == old || target == parent || self.is_below(target, node) {
            return;
        }
        places.iter().for_each(|&place| touched[place as usize] = true);
        self.replace(above_old, parent, old);
        let above_new = self.nodes[target as usize].parent;
        self.replace(above_new, target, parent);
        self.nodes[parent as usize].children = [target, node];
        self.nodes[target as usize].parent = parent;
        self.refit(above_old);
        let [moved, other] = [node, target].map(|child| self.nodes[child as usize].bounds);
        self.nodes[parent as usize].bounds = moved.union(&other);
        self.refit(above_new);
    }

    fn is_below(&self, mut node: u32, root: u32) -> bool {
        while node != NONE && node != root {
            node = self.nodes[node as usize].parent;
        }
        node == root
    }

    fn replace(&mut self, parent: u32, child: u32, other: u32) {
        self.nodes[parent as usize].children.iter_mut().filter(|slot| **slot == child).for_each(|slot| *slot = other);
        self.nodes[other as usize].parent = parent;
    }

    /// Fit the boxes of a node and of all above it, as far as they change.
    fn refit(&mut self, mut node: u32) {
        while node != NONE {
            let Link { children, parent, bounds, .. } = self.nodes[node as usize];
            let [left, right] = children.map(|child| self.nodes[child as usize].bounds);
            let fitted = left.union(&right);
            if fitted == bounds {
                break;
            }
            self.nodes[node as usize].bounds = fitted;
            node = parent;
        }
    }
}

/// A search for a new place.
struct Search<'a> {
    links: &'a Links,
    bounds: BoundsA,
    area: f32,
    /// Subtrees to look at, each with by how much all areas fall before the node's box is added to its root.
    open: &'a mut Vec<(f32, u32)>,
    /// Gains that do not exceed this are of no interest.
    least: f32,
    places: usize,
    best: Move,
}

impl<'a> Search<'a> {
    fn new(links: &'a Links, node: u32, open: &'a mut Vec<(f32, u32)>) -> Self {
        let bounds = links.nodes[node as usize].bounds;
        let best = Move { node, ..Move::NONE };
        Self { links, bounds, area: bounds.half_area(), open, least: 0.0, places: MOST_PLACES, best }
    }

    /// Look for a place at `root` or below.
    fn below(&mut self, root: u32, freed: f32) {
        self.open.clear();
        self.open.push((freed, root));
        while let Some((freed, place)) = self.open.pop() {
            if freed - self.area <= self.least || self.places == 0 {
                continue;
            }
            self.places -= 1;
            let link = &self.links.nodes[place as usize];
            let grown = link.bounds.union(&self.bounds).half_area();
            let gain = freed - grown;
            if gain > self.least {
                self.least = gain;
                self.best = Move { gain, sibling: place, ..self.best };
            }
            if !link.is_leaf() {
                let freed = gain + link.bounds.half_area();
                self.open.extend(link.children.map(|child| (freed, child)));
            }
        }
    }
}
