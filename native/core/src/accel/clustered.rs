//! A hierarchy by the surface area heuristic over clusters: its upper part by cells of clusters, the subtrees below by
//! the clusters themselves, every division by all that it divides. The cheapest wide nodes are chosen for both together:
//! where the largest part at the top was opened first instead, trees cost 1.00 to 1.06 times as much.

use super::{
    bins::Bins,
    clusters::Clusters,
    collapse::{Binary, Collapse, Costs, Weighed},
    divided::{Divided, Divider},
    draft::Draft,
    forest::{Child, SUBTREE, Top},
    planner::{Set, halve},
    record::Record,
};
use crate::{Error, Job, arena::Arena, simd::Level, triangle::LANES, work};

/// Parts of at most this many triangles are divided by their clusters. With twice as many, trees of small meshes cost as
/// much, and took up to 1.06 times as long (vianney_house); with half as many the build took as long, and there are more
/// of them than threads want.
const MOST: usize = SUBTREE / 2;

/// Plan the tree over clusters.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn plan(clusters: &Clusters, leaf_size: usize, job: &Job) -> Result<(Top, Vec<Draft>), Error> {
    let mut cells = clusters.cells()?;
    if cells.is_empty() {
        return Ok((Top::default(), Vec::new()));
    }
    let mut spare = Arena::stale(cells.len(), "the cells")?;
    let all = Set::new(&mut cells, &mut spare);
    let unit = all.half_area();
    let (mut upper, mut parts) = (Upper::default(), Vec::new());
    divide(all, Level::detect(), job)?.list(&mut upper, &mut parts);
    let triangles = |cells: &[Record]| cells.iter().map(|cell| cell.count() as usize).sum();
    let size = |cells: &&[Record]| triangles(cells);
    upper.subtrees = work::largest_first(parts.into_iter(), size, job, |divider: &mut Divider, cells| {
        let count = triangles(cells);
        let parts = cells.iter().map(|cell| clusters.of_cell(cell));
        let subtree = divider.divide(parts, (count, &clusters.triangles), leaf_size, unit)?;
        job.advance(subtree.triangles() as u64);
        Ok(subtree)
    })?;
    upper.widened(unit, job)
}

/// A part of the upper part of a tree.
enum Part<'r> {
    Branch { half_area: f32, children: Box<[Part<'r>; 2]> },
    Subtree(&'r [Record]),
}

fn divide<'r>(set: Set<'r>, level: Level, job: &Job) -> Result<Part<'r>, Error> {
    if set.count() <= MOST {
        return Ok(Part::Subtree(set.into_records()));
    }
    job.check()?;
    let half_area = set.half_area();
    let [left, right] = halve(set, &mut Bins::EMPTY.clone(), level);
    let (left, right) = rayon::join(|| divide(left, level, job), || divide(right, level, job));
    Ok(Part::Branch { half_area, children: Box::new([left?, right?]) })
}

impl<'r> Part<'r> {
    /// List nodes and subtrees from the root down; returns where it is.
    fn list(self, upper: &mut Upper, subtrees: &mut Vec<&'r [Record]>) -> usize {
        let index = upper.nodes.len();
        match self {
            Self::Subtree(cells) => {
                upper.nodes.push(Node::Subtree(subtrees.len()));
                subtrees.push(cells);
            }
            Self::Branch { half_area, children } => {
                upper.nodes.push(Node::Branch { half_area, right: 0 });
                let [left, other] = *children;
                left.list(upper, subtrees);
                let right = other.list(upper, subtrees);
                upper.nodes[index] = Node::Branch { half_area, right };
            }
        }
        index
    }
}

/// The upper part of a tree, in preorder.
#[derive(Default)]
struct Upper {
    nodes: Vec<Node>,
    subtrees: Vec<Divided>,
}

/// A node of it.
enum Node {
    /// The left child is the next node.
    Branch { half_area: f32, right: usize },
    /// By its number.
    Subtree(usize),
}

impl Binary for Upper {
    fn children(&self, node: usize) -> Option<[usize; 2]> {
        match self.nodes[node] {
            Node::Branch { right, .. } => Some([node + 1, right]),
            Node::Subtree(_) => None,
        }
    }
}

impl Weighed for Upper {
    fn count(&self) -> usize {
        self.nodes.len()
    }

    fn half_area(&self, node: usize) -> f32 {
        match self.nodes[node] {
            Node::Branch { half_area, .. } => half_area,
            Node::Subtree(_) => 0.0,
        }
    }

    fn costs(&self, node: usize) -> [f32; LANES] {
        match self.nodes[node] {
            Node::Branch { .. } => [0.0; LANES],
            Node::Subtree(subtree) => self.subtrees[subtree].costs(),
        }
    }
}

impl Upper {
    /// The cheapest wide nodes of all.
    fn widened(self, unit: f32, job: &Job) -> Result<(Top, Vec<Draft>), Error> {
        let collapse = Collapse::of(&self, unit, &mut Costs::default())?;
        let mut widening = Widening { upper: &self, collapse, top: Top::default(), places: Vec::new(), roots: 0 };
        widening.place(0, 1);
        let Widening { top, places, .. } = widening;
        let size = |(subtree, _): &(Divided, usize)| subtree.triangles();
        let subtrees = self.subtrees.into_iter().zip(places);
        let drafts = work::largest_first(subtrees, size, job, |(), (subtree, places)| Ok(subtree.widened(places)))?;
        Ok((top, drafts))
    }
}

/// Makes wide nodes of the binary ones, in preorder, so that subtrees are met in order.
struct Widening<'a> {
    upper: &'a Upper,
    collapse: Collapse,
    top: Top,
    /// In how many places every subtree is shown.
    places: Vec<usize>,
    /// Roots of subtrees so far.
    roots: usize,
}

impl Widening<'_> {
    /// The children that a node is in so many places.
    fn place(&mut self, node: usize, count: usize) -> Vec<Child> {
        if let Node::Subtree(subtree) = self.upper.nodes[node] {
            let first = self.roots;
            self.roots += self.upper.subtrees[subtree].roots(count);
            self.places.push(count);
            return (first..self.roots).map(Child::Root).collect();
        }
        let slot = self.top.nodes.len();
        self.top.nodes.push(Vec::new());
        let (children, count) = self.collapse.children(self.upper, node);
        self.top.nodes[slot] = children[..count].iter().flat_map(|&(child, count)| self.place(child, count)).collect();
        vec![Child::Top(slot)]
    }
}
