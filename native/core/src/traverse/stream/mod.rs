//! Streams: many rays of one octant walk the tree together, so that every node and block is fetched once for all of
//! them, and its children come in one order for all. After Barringer and Akenine-Möller, "Dynamic Ray Stream
//! Traversal", ACM TOG 33(4), 2014, and Fuetterling, Lojewski, Pfreundt and Ebert, "Efficient Ray Tracing Kernels for
//! Modern CPU Architectures", JCGT 4(4), 2015.
//!
//! Every ray keeps its own interval, boxes and triangles are tested by the arithmetic of the single ray, and the first
//! hit in the order of [`Hit::precedes`] does not depend on the order of tests: results equal the single ray's.

mod leaf;
mod rays;

use std::{ops::Range, sync::LazyLock};

use bytemuck::Zeroable;

use self::{leaf::Leaf, rays::Standing};
use super::{
    frame::{Domain, Frame},
    kernel,
    leaf::{Best, Search},
    probe::Silent,
    setup::Frames,
    waiting::Waiting,
};
use crate::{
    Error, Mesh,
    accel::structure::{Node, NodeRef, Structure, Target, View},
    cache,
    ray::MISS,
    simd::{MOST_GROUP, Simd},
    triangle::LANES,
};

/// The least and the most rays that walk together.
const SIZES: [usize; 2] = [1 << 10, 1 << 12];

/// Rays that walk together, a power of two: as many as have frames in a quarter of the second-level cache. With 2 MiB of
/// it 4096 took 1/1.05 of the time of 1024 (the dragon 1/1.06, Sponza 1/1.13, the room 1.01 times), and 8192 as long as
/// 4096; with 512 KiB 4096 took up to 1.1 times as long on surfaces.
pub fn bin_size() -> usize {
    static SIZE: LazyLock<usize> = LazyLock::new(|| {
        let fitting = cache::second_level() / 4 / size_of::<Frame>();
        1 << fitting.clamp(SIZES[0], SIZES[1]).ilog2()
    });
    *SIZE
}

/// Fewer rays than this go on one by one from where they are; from 1 to 5, times differed by less than the noise on the
/// bunny and by up to 8% on the dragon, where waiting rays give the next nodes time to arrive.
const FEW: usize = 2;

/// Rays of one octant.
#[derive(Debug, Default)]
pub struct Bin {
    frames: Vec<Frame>,
    hits: Vec<Standing>,
    places: Range<usize>,
}

impl Bin {
    /// Take the rays of some places in the order of those that wait, at most [`bin_size`].
    ///
    /// # Errors
    /// [`Error::Ray`] for an unusable ray.
    #[inline(always)]
    pub fn fill<S: Simd>(
        &mut self,
        simd: S,
        waiting: &Waiting,
        places: Range<usize>,
        domain: &Domain,
    ) -> Result<(), Error> {
        self.frames.resize(bin_size(), Frame::zeroed());
        self.hits.clear();
        let (groups, _) = self.frames.as_chunks_mut();
        for (first, frames) in places.clone().step_by(LANES).zip(groups) {
            waiting.warm(simd, first + 2 * LANES);
            if let Some(eight) = Frames::new(simd, &waiting.eight(simd, first..places.end), domain) {
                eight.store(simd, frames);
            } else {
                for (place, frame) in (first..places.end).zip(&mut *frames) {
                    *frame = waiting.frame(place, domain)?;
                }
            }
            for frame in frames {
                self.hits.push(Standing::begin(frame));
            }
        }
        self.places = places;
        Ok(())
    }

    /// How many rays there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Place, frame and first hit of a ray.
    #[inline(always)]
    pub fn ray(&self, slot: usize) -> (usize, &Frame, Best) {
        (self.places.start + slot, &self.frames[slot], self.hits[slot].best())
    }

    /// Ask for the triangles that were hit, so that they are near when their hits are evaluated.
    #[inline(always)]
    pub fn warm<S: Simd>(&self, simd: S, mesh: &Mesh) {
        let (triangles, vertices) = (mesh.triangles(), mesh.vertices());
        let hits = self.hits[..self.len()].iter().map(Standing::best).filter(|best| best.primitive != MISS);
        for best in hits.clone() {
            simd.prefetch(&triangles[best.primitive as usize]);
        }
        for best in hits {
            let [corner, ..] = triangles[best.primitive as usize];
            simd.prefetch(&vertices[corner as usize]);
        }
    }
}

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
            let mut rays = lists.ids[ids.clone()].iter().map(|&id| &bin.frames[id as usize]);
            // Many a ray has ended since it met the cell: none of them is to refine what nobody sees.
            if !rays.any(|frame| structure.lazy.is_met(cell as usize, frame)) {
                continue;
            }
            if let Some(cell) = structure.lazy.refine(cell as usize, mesh) {
                (here, floor, node) = (cell.view(), lists.visits.len(), cell.root);
            }
        }
        match node.target() {
            Target::Branch(index) if ids.len() >= FEW => {
                branch::<S, ANY>(simd, here, index as usize, octant, ids, &bin.frames, lists);
            }
            Target::Leaf { block, count } => {
                let block = &here.blocks[block as usize];
                let leaf = Leaf { mesh, block, count };
                for &id in leaf.test::<S, ANY>(simd, &lists.ids[ids], bin, &mut lists.leaf) {
                    Single { bin, id: id as usize }.block::<S, ANY>(simd, &leaf);
                }
            }
            _ => {
                for &id in &lists.ids[ids] {
                    Single { bin, id: id as usize }.trace::<S, GRIDS, ANY>(simd, structure, mesh, (here, node), stack);
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
    frames: &[Frame],
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
    lists.masks[ids.len().next_multiple_of(LANES)..padded].fill(0);
    let (masks, _) = lists.masks.as_chunks_mut();
    let (eights, rest) = lists.ids[ids].as_chunks::<LANES>();
    for (masks, eight) in masks.iter_mut().zip(eights) {
        let met = planes.meet_by_eight(simd, frames, eight);
        any |= met;
        *masks = met.to_le_bytes();
    }
    if !rest.is_empty() {
        let mut met = 0;
        for (lane, &id) in rest.iter().enumerate() {
            met |= u64::from(planes.meet(simd, &frames[usize::from(id)])) << (8 * lane);
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

/// The planes of a node's children, near and far for one octant. Both in turns in vectors of 512 bits, which halves the
/// operations, took as long (0.96 to 1.04, bounces in six scenes): such vectors have fewer units.
struct OctantPlanes<S: Simd> {
    near: [S::F32; 3],
    far: [S::F32; 3],
}

impl<S: Simd> OctantPlanes<S> {
    #[inline(always)]
    fn new(simd: S, node: &Node, octant: usize) -> Self {
        let [mut near, mut far] = [[simd.splat(0.0); 3]; 2];
        for k in 0..3 {
            let side = 3 * (octant >> k & 1);
            near[k] = simd.load(&node.plane[k + side]);
            far[k] = simd.load(&node.plane[k + 3 - side]);
        }
        Self { near, far }
    }

    /// The children that eight rays meet within their intervals, a byte for each ray.
    #[inline(always)]
    fn meet_by_eight(&self, simd: S, frames: &[Frame], ids: &[u16; LANES]) -> u64 {
        let mut met = 0;
        for lane in 0..LANES {
            met |= u64::from(self.meet(simd, &frames[usize::from(ids[lane])])) << (8 * lane);
        }
        met
    }

    /// The children that a ray meets within its interval.
    #[inline(always)]
    fn meet(&self, simd: S, frame: &Frame) -> u32 {
        let (mut near, mut far) = (simd.splat(frame.tmin), simd.splat(frame.tmax));
        for k in 0..3 {
            let inverse = simd.splat(frame.inverse[k]);
            near = simd.max(simd.mul_add(self.near[k], inverse, simd.splat(frame.near_bias[k])), near);
            far = simd.min(simd.mul_add(self.far[k], inverse, simd.splat(frame.far_bias[k])), far);
        }
        simd.le(near, far)
    }
}

impl Bin {
    /// Nothing beyond the best hit of a ray is of interest any more; where any hit will do, nothing at all.
    #[inline(always)]
    fn keep<const ANY: bool>(&mut self, id: usize, best: Best) {
        let best = if ANY && best.primitive != MISS { Best { high: f32::NEG_INFINITY, ..best } } else { best };
        self.hits[id].set(best);
        self.frames[id].tmax = best.high;
    }
}

/// One ray of a bin.
struct Single<'a> {
    bin: &'a mut Bin,
    id: usize,
}

impl Single<'_> {
    /// Test a block.
    #[inline(always)]
    fn block<S: Simd, const ANY: bool>(self, simd: S, &Leaf { mesh, block, count }: &Leaf<'_>) {
        let frame = &self.bin.frames[self.id];
        if frame.tmin > frame.tmax {
            return;
        }
        let mut silent = Silent;
        let mut search = Search::new(simd, frame, mesh, &mut silent, self.bin.hits[self.id].best());
        search.block::<ANY>(block, count);
        let best = search.best;
        self.bin.keep::<ANY>(self.id, best);
    }

    /// Go on alone below a node.
    #[inline(always)]
    fn trace<S: Simd, const GRIDS: bool, const ANY: bool>(
        self,
        simd: S,
        structure: &Structure,
        mesh: &Mesh,
        node: (View<'_>, NodeRef),
        stack: &mut [kernel::Entry],
    ) {
        let frame = &self.bin.frames[self.id];
        if frame.tmin > frame.tmax {
            return;
        }
        let mut silent = Silent;
        let mut search = Search::new(simd, frame, mesh, &mut silent, self.bin.hits[self.id].best());
        kernel::trace_below::<S, Silent, GRIDS, ANY>(&mut search, structure, node, stack);
        let best = search.best;
        self.bin.keep::<ANY>(self.id, best);
    }
}
