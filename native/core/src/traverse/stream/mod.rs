//! Streams: many rays of one octant walk the tree together, so that every node and block is fetched once for all of
//! them, and its children come in one order for all. After Barringer and Akenine-Möller, "Dynamic Ray Stream
//! Traversal", ACM TOG 33(4), 2014, and Fuetterling, Lojewski, Pfreundt and Ebert, "Efficient Ray Tracing Kernels for
//! Modern CPU Architectures", JCGT 4(4), 2015.
//!
//! Every ray keeps its own interval, boxes are tested by the arithmetic of the single ray and triangles with certified
//! errors, and the first hit in the order of [`Hit::precedes`] does not depend on the order of tests: results equal the
//! single ray's.
//!
//! [`Hit::precedes`]: crate::ray::Hit::precedes

mod bin;
mod leaf;
mod rays;

use std::ops::Range;

pub use self::bin::{Bin, bin_size};
use self::leaf::Leaf;
use super::{frame::Slabs, kernel, leaf::Search, probe::Silent, tile::EXTENTS};
use crate::{
    Mesh,
    accel::structure::{Node, NodeRef, Structure, Target, View},
    simd::{Kernel, MOST_GROUP, Simd},
    triangle::LANES,
};

/// Fewer rays than this go on one by one from where they are; from 1 to 5, times differed by less than the noise on the
/// bunny and by up to 8% on the dragon, where waiting rays give the next nodes time to arrive.
const FEW: usize = 2;

/// A subtree, and which of [`Lists::ids`] are to visit it.
#[derive(Debug, Clone, Copy)]
struct Visit {
    node: NodeRef,
    start: u32,
    count: u32,
}

/// Room for lists of ray ids, reused from bin to bin.
#[derive(Debug, Default)]
pub struct Lists {
    visits: Vec<Visit>,
    ids: Vec<u16>,
    masks: Vec<u8>,
    leaf: Box<leaf::Memory>,
}

/// Trace all rays of a bin; `octant` is theirs.
#[inline(always)]
pub fn trace<S: Simd, const GRIDS: bool, const ANY: bool>(
    simd: S,
    structure: &Structure,
    mesh: &Mesh,
    octant: usize,
    bin: &mut Bin,
    lists: &mut Lists,
    stack: &mut [kernel::Entry],
) {
    lists.begin(structure.root, bin.len());
    // Visits from `floor` up are in the lazy cell that the rays are in.
    let (mut here, mut floor) = (structure.view(), 0);
    loop {
        if GRIDS && lists.visits.len() == floor {
            (here, floor) = (structure.view(), 0);
        }
        let Some(visit) = lists.visits.pop() else { return };
        let ids = visit.start as usize..(visit.start + visit.count) as usize;
        let mut node = visit.node;
        if GRIDS
            && let Target::Lazy(cell) = node.target()
            && ids.len() >= FEW
        {
            let mut rays = lists.ids[ids.clone()].iter().map(|&id| bin.frame(id as usize));
            // Many a ray has ended since it met the cell: none of them is to refine what nobody sees.
            if !rays.any(|frame| structure.lazy.is_met(cell as usize, &frame)) {
                continue;
            }
            if let Some(cell) = structure.lazy.refine(cell as usize, mesh) {
                (here, floor, node) = (cell.view(), lists.visits.len(), cell.root);
            }
        }
        match node.target() {
            Target::Branch(index) if ids.len() >= FEW => {
                branch::<S, ANY>(simd, here, index as usize, octant, ids, bin.slabs(), lists);
            }
            Target::Leaf { block, count } => {
                let block = &here.blocks[block as usize];
                let leaf = Leaf { mesh, block, count };
                let mut rest = &lists.ids[ids];
                if EXTENTS.contains(&structure.domain.half_extent) {
                    rest = leaf.test::<S, ANY>(simd, rest, bin, &mut lists.leaf);
                }
                for &id in rest {
                    leaf.one::<S, ANY>(simd, bin, id.into());
                }
            }
            _ => {
                for &id in &lists.ids[ids] {
                    simd.run(Single::<GRIDS, ANY> { bin, id: id as usize, structure, mesh, node: (here, node), stack });
                }
            }
        }
    }
}

/// Ask for what will be visited soon, so that it is near by then.
#[inline(always)]
pub fn warm<S: Simd>(simd: S, here: View<'_>, node: NodeRef) {
    match node.target() {
        Target::Branch(index) => simd.prefetch(&here.nodes[index as usize]),
        Target::Leaf { block, .. } => simd.prefetch(&here.blocks[block as usize]),
        _ => {}
    }
}

/// Divide the rays at a node among its children, the nearest child's on top. Where any hit will do, the leaves' are on
/// top of the branches', since the rays that they stop need not go deeper, and among each the largest child's, which
/// stops the most: in closed rooms endless rays take 1/1.3 (Sponza) and 1/1.4 (Sibenik) of the time, elsewhere as long.
#[inline(always)]
fn branch<S: Simd, const ANY: bool>(
    simd: S,
    here: View<'_>,
    index: usize,
    octant: usize,
    ids: Range<usize>,
    slabs: &[Slabs],
    lists: &mut Lists,
) {
    let node = &here.nodes[index];
    let padded = ids.len().next_multiple_of(S::GROUP);
    let (start, mut end) = (ids.start, ids.start + padded);
    lists.make_room(end + LANES * padded);
    let planes = OctantPlanes::new(simd, node, octant);
    // Eight masks are written at once: read eightfold soon after, single bytes would have to be waited for. All groups but
    // the last are eight rays, and their loop is unrolled.
    let mut any = 0;
    if let Some(group) = lists.masks[..padded].last_chunk_mut::<MOST_GROUP>() {
        *group = [0; MOST_GROUP];
    }
    let (masks, _) = lists.masks.as_chunks_mut();
    let (eights, rest) = lists.ids[ids].as_chunks::<LANES>();
    for (masks, eight) in masks.iter_mut().zip(eights) {
        let met = planes.meet_by_eight(simd, slabs, eight);
        any |= met;
        *masks = met.to_le_bytes();
    }
    if !rest.is_empty() {
        let mut met = 0;
        for (lane, &id) in rest.iter().enumerate() {
            met |= u64::from(planes.meet(simd, &slabs[usize::from(id)])) << (8 * lane);
        }
        any |= met;
        masks[eights.len()] = met.to_le_bytes();
    }
    any |= any >> 32;
    any |= any >> 16;
    any |= any >> 8;
    let any = any as u32 & 0xff;
    let leaves = if ANY { node.leaves() } else { 0 };
    for mut rest in [any & !leaves, any & leaves] {
        let mut order = node.order[octant];
        while rest != 0 {
            let child = if ANY { rest.ilog2() } else { order & 7 };
            order >>= 3;
            if rest >> child & 1 == 0 {
                continue;
            }
            rest &= !(1 << child);
            let (from, to) = lists.ids.split_at_mut(end);
            let count = simd.compact(&lists.masks[..padded], child, &from[start..start + padded], &mut to[..padded]);
            warm(simd, here, node.child[child as usize]);
            lists.visits.push(Visit { node: node.child[child as usize], start: end as u32, count: count as u32 });
            end += count;
        }
    }
}

impl Lists {
    fn begin(&mut self, root: NodeRef, count: usize) {
        self.masks.resize((bin_size() + LANES).next_multiple_of(MOST_GROUP), 0);
        self.make_room(2 * bin_size());
        for (id, slot) in self.ids[..count].iter_mut().enumerate() {
            *slot = id as u16;
        }
        self.visits.push(Visit { node: root, start: 0, count: count as u32 });
    }

    #[inline(always)]
    fn make_room(&mut self, length: usize) {
        if self.ids.len() < length {
            self.ids.resize(2 * length, 0);
        }
    }
}

/// The planes of a node's children, near and far for one octant.
struct OctantPlanes<S: Simd>([[S::F32; 3]; 2]);

impl<S: Simd> OctantPlanes<S> {
    #[inline(always)]
    fn new(simd: S, node: &Node, octant: usize) -> Self {
        let [mut near, mut far] = [[simd.splat(0.0); 3]; 2];
        for k in 0..3 {
            let side = 3 * (octant >> k & 1);
            near[k] = simd.load(&node.plane[k + side]);
            far[k] = simd.load(&node.plane[k + 3 - side]);
        }
        Self([near, far])
    }

    /// The children that eight rays meet within their intervals, a byte for each ray. Unrolled it took 1.01 times as long.
    #[inline(always)]
    fn meet_by_eight(&self, simd: S, slabs: &[Slabs], ids: &[u16; LANES]) -> u64 {
        let mut met = 0;
        for lane in 0..LANES {
            met |= u64::from(self.meet(simd, &slabs[usize::from(ids[lane])])) << (8 * lane);
        }
        met
    }

    /// The children that a ray meets within its interval.
    #[inline(always)]
    fn meet(&self, simd: S, slabs: &Slabs) -> u32 {
        simd.meet(&self.0, &slabs.inverse, &slabs.bias, slabs.interval())
    }
}

/// One ray of a bin that goes on alone below a node.
struct Single<'a, const GRIDS: bool, const ANY: bool> {
    bin: &'a mut Bin,
    id: usize,
    structure: &'a Structure,
    mesh: &'a Mesh,
    node: (View<'a>, NodeRef),
    stack: &'a mut [kernel::Entry],
}

impl<const GRIDS: bool, const ANY: bool> Kernel for Single<'_, GRIDS, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { bin, id, structure, mesh, node, stack } = self;
        if bin.has_ended(id) {
            return;
        }
        let frame = &bin.frame(id);
        let mut silent = Silent;
        let mut search = Search::new(simd, frame, mesh, &mut silent, bin.best(id));
        kernel::trace_below::<S, Silent, GRIDS, ANY>(&mut search, structure, node, stack);
        let best = search.best;
        bin.keep::<ANY>(id, best);
    }
}
