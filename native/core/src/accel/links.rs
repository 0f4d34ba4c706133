//! A binary tree by links, for builders that work from the leaves up or move subtrees about. Its boxes are those of the
//! scene mapped into the unit cube, so that areas neither overflow nor vanish; the tree made of it has exact ones.

use super::{
    median::CyclingMedian,
    record::UnitCube,
    tree::{self, Item, Kind, Tree, TreeNode},
};
use crate::{
    Error, Job,
    bounds::{Bounds, BoundsA},
    error,
};

/// No node.
pub const NONE: u32 = u32::MAX;

const WHAT: &str = "the links of a hierarchy";

/// Below this depth subtrees are divided at medians, which bounds the stack of every traversal.
const MOST_DEPTH: usize = 64;

/// Nodes between two looks at the job.
const STEP: usize = 1 << 12;

/// A node.
#[derive(Debug, Clone, Copy)]
pub struct Link {
    /// Mapped box.
    pub bounds: BoundsA,
    /// The node above, or [`NONE`].
    pub parent: u32,
    /// The nodes below; two times [`NONE`] for a leaf.
    pub children: [u32; 2],
    /// A leaf's first item.
    pub first: u32,
    /// A leaf's number of items; 0 for others.
    pub count: u32,
}

impl Link {
    /// A leaf without a place.
    pub fn leaf(bounds: BoundsA, first: u32, count: u32) -> Self {
        Self { bounds, parent: NONE, children: [NONE; 2], first, count }
    }

    /// Whether nothing is below.
    pub fn is_leaf(&self) -> bool {
        self.count > 0
    }
}

/// Nodes in no particular order.
#[derive(Debug)]
pub struct Links {
    /// The nodes.
    pub nodes: Vec<Link>,
    /// The root's index.
    pub root: u32,
}

impl Links {
    /// The links of a tree without grids; its nodes keep their indices.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn of(tree: &Tree, scene: &Bounds) -> Result<Self, Error> {
        let cube = UnitCube::new(scene);
        let mut nodes: Vec<Link> = error::reserve(tree.nodes.len(), WHAT)?;
        nodes.extend(tree.nodes.iter().enumerate().map(|(index, node)| {
            let link = Link::leaf(cube.map(&node.bounds), node.first, node.count);
            tree.children(index).map_or(link, |children| Link {
                children: children.map(|c| c as u32),
                count: 0,
                ..link
            })
        }));
        for index in 0..nodes.len() {
            for child in nodes[index].children.into_iter().filter(|&child| child != NONE) {
                nodes[child as usize].parent = index as u32;
            }
        }
        Ok(Self { nodes, root: 0 })
    }

    /// The other child of a node's parent.
    pub fn sibling(&self, node: u32) -> u32 {
        let [left, right] = self.nodes[self.nodes[node as usize].parent as usize].children;
        if left == node { right } else { left }
    }

    /// Items below every node.
    fn counts(&self) -> Result<Vec<u32>, Error> {
        let mut counts = error::filled(self.nodes.len(), 0, WHAT)?;
        let mut order = error::reserve(self.nodes.len(), WHAT)?;
        order.push(self.root);
        let mut next = 0;
        while next < order.len() {
            let link = &self.nodes[order[next] as usize];
            order.extend(link.children.into_iter().filter(|&child| child != NONE));
            next += 1;
        }
        for &index in order.iter().rev() {
            let Link { children, count, .. } = self.nodes[index as usize];
            let below = children.iter().filter(|&&child| child != NONE).map(|&child| counts[child as usize]);
            counts[index as usize] = count + below.sum::<u32>();
        }
        Ok(counts)
    }

    /// The tree of these links over the items that their leaves refer to; at most `leaf_size` items are together, and
    /// nothing that may be a leaf is divided.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::OutOfMemory`].
    pub fn tree(&self, items: &[Item], leaf_size: usize, job: &Job) -> Result<Tree, Error> {
        let counts = self.counts()?;
        let tree = Tree {
            nodes: error::reserve(self.nodes.len(), WHAT)?,
            items: error::reserve(items.len(), WHAT)?,
            ..Tree::default()
        };
        let mut writer = Writer { links: self, items, counts: &counts, leaf_size, job, tree };
        writer.subtree(self.root, 0)?;
        Ok(writer.tree)
    }
}

struct Writer<'a> {
    links: &'a Links,
    items: &'a [Item],
    counts: &'a [u32],
    leaf_size: usize,
    job: &'a Job,
    tree: Tree,
}

impl Writer<'_> {
    fn subtree(&mut self, node: u32, depth: usize) -> Result<(), Error> {
        let index = self.tree.nodes.len();
        if index.is_multiple_of(STEP) {
            self.job.check()?;
        }
        let (first, count) = (self.tree.items.len() as u32, self.counts[node as usize]);
        let [left, right] = self.links.nodes[node as usize].children;
        if count as usize <= self.leaf_size || left == NONE || depth == MOST_DEPTH {
            return self.items_below(node);
        }
        self.tree.nodes.push(TreeNode { bounds: Bounds::EMPTY, first, count, kind: Kind::Leaf });
        self.subtree(left, depth + 1)?;
        let other = self.tree.nodes.len();
        self.subtree(right, depth + 1)?;
        let bounds = self.tree.nodes[index + 1].bounds.union(&self.tree.nodes[other].bounds);
        let kind = Kind::Branch { right: (other - index) as u32 };
        let count = self.tree.items.len() as u32 - first;
        self.tree.nodes[index] = TreeNode { bounds, first, count, kind };
        Ok(())
    }

    /// All triangles below a node, in one leaf if they fit, else divided at medians.
    fn items_below(&mut self, node: u32) -> Result<(), Error> {
        let (mut open, mut items) = (vec![node], Vec::new());
        while let Some(node) = open.pop() {
            let Link { children: [left, right], first, count, .. } = self.links.nodes[node as usize];
            items.extend_from_slice(&self.items[first as usize..(first + count) as usize]);
            open.extend([right, left].into_iter().filter(|&child| child != NONE));
        }
        let items = one_a_triangle(items);
        let first = self.tree.items.len() as u32;
        let median = CyclingMedian { job: self.job };
        let below = tree::build(items, self.leaf_size, &median, &Job::new())?;
        self.tree.nodes.extend(below.nodes.into_iter().map(|node| TreeNode { first: node.first + first, ..node }));
        self.tree.items.extend(below.items);
        Ok(())
    }
}

/// Parts of triangles that spatial splits took apart, and that came together again, are one reference.
fn one_a_triangle(mut items: Vec<Item>) -> Vec<Item> {
    items.sort_by_key(|item| item.primitive);
    items.dedup_by(|part, kept| {
        let is_same = part.primitive == kept.primitive;
        if is_same {
            kept.bounds = kept.bounds.union(&part.bounds);
        }
        is_same
    });
    items
}
