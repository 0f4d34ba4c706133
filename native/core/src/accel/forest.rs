//! A large tree as it is planned and written in parallel: a few nodes at the top, and drafts of subtrees below them.
//! What belongs together stands together in the result, which does not depend on the number of threads.

use glam::Vec3A;

use super::{
    draft::{self, Boxes, Draft, Root, Site},
    structure::{Node, NodeRef, Structure},
};
use crate::{
    Error, Job, Mesh,
    arena::Arena,
    bounds::BoundsA,
    simd::Level,
    traverse::frame::Domain,
    triangle::{Block, LANES},
    work,
};

/// Subtrees of at most this many triangles are planned and written by one thread without a look at the job: some
/// milliseconds, and all they need at once fits a cache.
pub const SUBTREE: usize = 1 << 14;

/// A child of a node at the top.
#[derive(Debug, Clone, Copy)]
pub enum Child {
    /// Another of them.
    Top(usize),
    /// A root of a subtree: all roots of all drafts are numbered in order.
    Root(usize),
}

/// The nodes at the top, each before its children.
#[derive(Debug, Default)]
pub struct Top {
    /// The children of each; none where one root is all there is.
    pub nodes: Vec<Vec<Child>>,
}

/// A node or subtree that has been written.
#[derive(Debug, Clone, Copy)]
struct Written {
    root: NodeRef,
    bounds: BoundsA,
    stack_size: usize,
}

/// Write all of it.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn write(top: &Top, drafts: &[Draft], mesh: &Mesh, job: &Job) -> Result<Structure, Error> {
    let domain = Domain::new(&mesh.bounds());
    let total = |count: fn(&Draft) -> usize| drafts.iter().map(count).sum::<usize>();
    let mut nodes = Arena::stale(top.nodes.len() + total(|draft| draft.nodes.len()), "the nodes")?;
    let mut blocks = Arena::stale(total(|draft| draft.leaves.len()), "the leaves")?;
    let (top_nodes, below) = nodes.split_at_mut(top.nodes.len());
    let sites = sites(drafts, top.nodes.len(), below, &mut blocks);
    let size = |(_, draft): &(Site<'_>, &Draft)| draft.triangles;
    let subtrees =
        work::largest_first(sites.into_iter().zip(drafts), size, job, |boxes: &mut Boxes, (site, draft)| {
            let written = write_subtree(site, draft, mesh, domain.centre.into(), boxes);
            job.advance(draft.triangles as u64);
            Ok(written)
        })?;
    let root = write_top(top, &subtrees.concat(), top_nodes, domain.centre.into());
    let (root, stack_size) = root.map_or((NodeRef::EMPTY, 0), |root| (root.root, root.stack_size));
    Ok(Structure { nodes, blocks, stack_size, ..Structure::of(root, domain) })
}

fn sites<'a>(
    drafts: &[Draft],
    mut first_node: usize,
    mut nodes: &'a mut [Node],
    mut blocks: &'a mut [Block],
) -> Vec<Site<'a>> {
    let mut first_block = 0;
    let site = |draft: &Draft| {
        let (mine, rest) = std::mem::take(&mut nodes).split_at_mut(draft.nodes.len());
        nodes = rest;
        let (leaves, rest) = std::mem::take(&mut blocks).split_at_mut(draft.leaves.len());
        blocks = rest;
        let site = Site { nodes: mine, blocks: leaves, first_node, first_block };
        (first_node, first_block) = (first_node + draft.nodes.len(), first_block + draft.leaves.len());
        site
    };
    drafts.iter().map(site).collect()
}

fn write_subtree(mut site: Site<'_>, draft: &Draft, mesh: &Mesh, centre: Vec3A, boxes: &mut Boxes) -> Vec<Written> {
    draft::fit(draft, mesh, centre, &mut site, boxes, Level::detect());
    let written = |&Root { node, stack_size }: &Root| Written {
        root: node.moved(site.first_node, site.first_block),
        bounds: boxes.of(node),
        stack_size,
    };
    draft.roots.iter().map(written).collect()
}

/// Returns the root, if there is any.
fn write_top(top: &Top, roots: &[Written], nodes: &mut [Node], centre: Vec3A) -> Option<Written> {
    const NOTHING: Written = Written { root: NodeRef::EMPTY, bounds: BoundsA::EMPTY, stack_size: 0 };
    let mut written = vec![NOTHING; nodes.len()];
    for (index, children) in top.nodes.iter().enumerate().rev() {
        let mut all = [NOTHING; LANES];
        for (lane, child) in children.iter().enumerate() {
            all[lane] = match *child {
                Child::Top(node) => written[node],
                Child::Root(root) => roots[root],
            };
        }
        nodes[index] = Node::new(all.map(|child| child.root), &all.map(|child| child.bounds), centre);
        let deepest = all.iter().map(|child| child.stack_size).max();
        written[index] = Written {
            root: NodeRef::branch(index),
            bounds: all.iter().fold(BoundsA::EMPTY, |bounds, child| bounds.union(&child.bounds)),
            stack_size: children.len() - 1 + deepest.unwrap_or(0),
        };
    }
    written.first().or(roots.first()).copied()
}
