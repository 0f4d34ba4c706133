//! Parallel locally ordered clustering: Meister and Bittner, "Parallel Locally-Ordered Clustering for Bounding Volume
//! Hierarchy Construction", TVCG 24(3), 2018. Clusters lie along the Morton curve; in every round each looks for the
//! neighbour with which it has the smallest box, and those that choose each other become one.

use glam::Vec3A;
use rayon::prelude::*;

use super::{
    config::Config,
    links::{Link, Links},
    record::UnitCube,
    tree::{Item, Tree},
};
use crate::{
    Error, Job,
    bounds::{Bounds, BoundsA},
    error,
};

const WHAT: &str = "the clusters of a hierarchy";

/// Clusters that one thread looks after between two looks at the job.
const PART: usize = 1 << 10;

/// A subtree without a parent yet.
#[derive(Clone, Copy)]
struct Cluster {
    bounds: BoundsA,
    node: u32,
}

/// Cluster items, which lie in the scene's box. The result is the same on any number of threads.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn build(items: Vec<Item>, scene: &Bounds, config: &Config, job: &Job) -> Result<Tree, Error> {
    if items.is_empty() {
        return Ok(Tree::default());
    }
    let cube = UnitCube::new(scene);
    let items = along_the_curve(items, &cube, job)?;
    let mut clusters: Vec<Cluster> = error::reserve(items.len(), WHAT)?;
    clusters.par_extend(
        items.par_iter().enumerate().map(|(i, item)| Cluster { bounds: cube.map(&item.bounds), node: i as u32 }),
    );
    let mut nodes: Vec<Link> = error::reserve(2 * items.len(), WHAT)?;
    nodes.par_extend(clusters.par_iter().map(|cluster| Link::leaf(cluster.bounds, cluster.node, 1)));
    let mut choices = error::filled(items.len(), 0, WHAT)?;
    while clusters.len() > 1 {
        let before = clusters.len();
        choose(&clusters, config.cluster_radius, &mut choices[..before], job)?;
        merge(&mut clusters, &choices, &mut nodes);
        job.advance((before - clusters.len()) as u64);
    }
    job.advance(1);
    let root = nodes.len() as u32 - 1;
    Links { nodes, root }.tree(&items, config.leaf_size, job)
}

/// The items in the order of the Morton codes of their centres; equal codes go by primitive.
fn along_the_curve(items: Vec<Item>, cube: &UnitCube, job: &Job) -> Result<Vec<Item>, Error> {
    job.check()?;
    let mut keys: Vec<(u64, u32)> = error::reserve(items.len(), WHAT)?;
    let code = |item: &Item| {
        let bounds = cube.map(&item.bounds);
        morton((bounds.lower + bounds.upper) * 0.5)
    };
    keys.par_extend(items.par_iter().enumerate().map(|(index, item)| (code(item), index as u32)));
    keys.par_sort_unstable();
    job.check()?;
    let mut sorted = error::reserve(items.len(), WHAT)?;
    sorted.par_extend(keys.par_iter().map(|&(_, index)| items[index as usize]));
    Ok(sorted)
}

/// 21 bits of each coordinate of a point in the unit cube, interleaved.
fn morton(point: Vec3A) -> u64 {
    let cell = |coordinate: f32| spread((coordinate * (1 << 21) as f32).clamp(0.0, ((1 << 21) - 1) as f32) as u64);
    cell(point.x) | cell(point.y) << 1 | cell(point.z) << 2
}

/// Two zeros after every one of the 21 lowest bits.
fn spread(bits: u64) -> u64 {
    let bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
    let bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
    let bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
    let bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
    (bits | bits << 2) & 0x1249_2492_4924_9249
}

/// Every cluster's choice among its neighbours.
fn choose(clusters: &[Cluster], radius: usize, choices: &mut [u32], job: &Job) -> Result<(), Error> {
    choices.par_chunks_mut(PART).enumerate().try_for_each(|(part, choices)| {
        job.check()?;
        for (offset, choice) in choices.iter_mut().enumerate() {
            *choice = nearest(clusters, part * PART + offset, radius);
        }
        Ok(())
    })
}

/// The neighbour with which a cluster has the smallest box.
///
/// Pairs of equal boxes go by the exclusive or of the places: so the order of pairs is strict, at least one pair is
/// mutual in every round, and where all boxes agree every cluster has a partner.
fn nearest(clusters: &[Cluster], place: usize, radius: usize) -> u32 {
    let bounds = clusters[place].bounds;
    let (first, last) = (place.saturating_sub(radius), (place + radius).min(clusters.len() - 1));
    let (mut best, mut least) = (place, f32::INFINITY);
    for other in (first..place).chain(place + 1..=last) {
        let area = bounds.union(&clusters[other].bounds).half_area();
        if area < least || (area == least && other ^ place < best ^ place) {
            (best, least) = (other, area);
        }
    }
    best as u32
}

/// Make one of every two clusters that chose each other, in the place of the first.
fn merge(clusters: &mut Vec<Cluster>, choices: &[u32], nodes: &mut Vec<Link>) {
    let mut kept = 0;
    for place in 0..clusters.len() {
        let (cluster, other) = (clusters[place], choices[place] as usize);
        let is_mutual = choices[other] as usize == place;
        if is_mutual && other < place {
            continue;
        }
        clusters[kept] = if is_mutual { joined(cluster, clusters[other], nodes) } else { cluster };
        kept += 1;
    }
    clusters.truncate(kept);
}

fn joined(left: Cluster, right: Cluster, nodes: &mut Vec<Link>) -> Cluster {
    let (bounds, node) = (left.bounds.union(&right.bounds), nodes.len() as u32);
    let children = [left.node, right.node];
    children.iter().for_each(|&child| nodes[child as usize].parent = node);
    nodes.push(Link { children, ..Link::leaf(bounds, 0, 0) });
    Cluster { bounds, node }
}
