//! A hierarchy by the surface area heuristic over clusters: its upper part by cells of clusters, the subtrees below by
//! the clusters themselves, every division by all that it divides.

use rayon::prelude::*;

use super::{
    bins::Bins,
    clusters::Clusters,
    draft::Draft,
    forest::{Child, SUBTREE, Top},
    planner::{Planner, Set, open},
    record::Record,
};
use crate::{Error, Job, arena::Arena, simd::Level};

/// Parts at the top of at most this many triangles are not divided further: their cells are too few to tell where.
const WHOLE: usize = SUBTREE / 4;

/// Plan the tree over clusters.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn plan(clusters: &Clusters, leaf_size: usize, job: &Job) -> Result<(Top, Vec<Draft>), Error> {
    let mut cells = clusters.cells()?;
    let mut spare = Arena::stale(cells.len(), "the cells")?;
    let (mut top, mut subtrees) = (Top::default(), Vec::new());
    if !cells.is_empty() {
        let upper = upper(Set::new(&mut cells, &mut spare), Level::detect(), job)?;
        upper.number(&mut top, &mut subtrees);
    }
    let drafts = subtrees.into_par_iter().map_init(Planner::default, |planner, cells| {
        job.check()?;
        let count = cells.iter().map(|cell| cell.count() as usize).sum();
        let mut draft = Draft::for_triangles(count);
        let expand = |records: &mut Vec<Record>| {
            records.reserve(count / 2);
            cells.iter().for_each(|cell| clusters.expand(cell, records));
        };
        planner.plan(expand, &clusters.triangles, leaf_size, &mut draft)?;
        job.advance(draft.triangles as u64);
        Ok(draft)
    });
    Ok((top, drafts.collect::<Result<_, Error>>()?))
}

/// The upper part of the tree.
enum Upper<'r> {
    Node(Vec<Upper<'r>>),
    Subtree(&'r [Record]),
}

fn upper<'r>(set: Set<'r>, level: Level, job: &Job) -> Result<Upper<'r>, Error> {
    if set.count() <= SUBTREE {
        return Ok(Upper::Subtree(set.into_records()));
    }
    job.check()?;
    let parts = open(set, WHOLE, &mut Bins::EMPTY.clone(), level);
    let parts: Vec<Set<'r>> = parts.into_iter().flatten().collect();
    Ok(Upper::Node(parts.into_par_iter().map(|part| upper(part, level, job)).collect::<Result<_, Error>>()?))
}

impl<'r> Upper<'r> {
    /// Number nodes and subtrees from the root down, every node before its children.
    fn number(self, top: &mut Top, subtrees: &mut Vec<&'r [Record]>) -> Child {
        match self {
            Self::Subtree(cells) => {
                subtrees.push(cells);
                Child::Subtree(subtrees.len() - 1)
            }
            Self::Node(children) => {
                let slot = top.nodes.len();
                top.nodes.push(Vec::new());
                let children = children.into_iter().map(|child| child.number(top, subtrees)).collect();
                top.nodes[slot] = children;
                Child::Top(slot)
            }
        }
    }
}
