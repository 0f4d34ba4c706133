//! Packets: some rays of a batch, as they come, walk the tree together where any hit will do. A node's children are
//! first compared with the box around the rays' segments, all eight at once, and only then with the rays: short rays
//! that begin side by side, as those of ambient occlusion, pass by most boxes together. After Wald, Slusallek, Benthin
//! and Wagner, "Interactive Rendering with Coherent Ray Tracing", Eurographics 2001, and Boulos, Wald and Shirley,
//! "Geometric and Arithmetic Culling Methods for Entire Ray Packets", University of Utah UUCS-06-010, 2006.
//!
//! A ray meets a child here if and only if it does so alone, to the bit: both planes of an axis are tested with the
//! bias that they have for the ray's direction, and the lesser is the near one. The box around the segments culls no
//! child and no triangle with a hit: with u and R as in [`super::frame`], a segment is cut off where the largest
//! component of its direction, at least 1, has taken it 2R far, outside the scene; its ends are within 5R of the centre
//! and off by two roundings, at most 9uR, and by another 5uR where the box is grown. What a triangle is hit at lies
//! within 22uR of the ray. From the first origin, corners of triangles are off by another 6uR, and the box's sides by
//! 6uR. The box is grown by 64uR.
//!
//! Closest hits were tried in such packets, too, with the parameters at which each ray enters a child kept beside it, and
//! children in the order of most rays' octant. Of 64 rays (Zen 5) bounces took 1.2 times (hospital, room) to 2.8 times
//! (Sibenik) as long as in streams, and still 1.02 to 2.1 times with the rays sorted as streams have them; any-hit rays so
//! sorted took 0.93 to 1.7 times as long as what is faster here of streams and packets.

mod leaf;
mod rays;

use bytemuck::Zeroable;

use self::rays::{Packet, RAYS};
use super::{
    Tracer,
    frame::{Domain, Frame},
    kernel::{self, Entry},
    leaf::{Best, Search},
    probe::Silent,
    setup::Frames,
    stream::warm,
    take::Take,
    weights::Triangles,
};
use crate::{
    Error, Mesh,
    accel::structure::{Node, NodeRef, Structure, Target, View},
    ray::{Eight, MISS, Rays},
    simd::{Kernel, Simd},
    triangle::{Block, LANES},
};

/// Fewer rays than this go on one by one from where they are. With AVX-512, 3 took 1.05 times as long, 6 took 1.03 times.
const FEW: u32 = 4;

/// Fewer rays than this are tested one by one against eight triangles, others all together against one after another.
const FEWEST: u32 = 3;

/// Vectors of sixteen rays in a packet where one is one register, and where it is two. The more there are, the less a
/// packet costs beside its arithmetic, in branches above all that nobody can predict. Against one (Zen 5), two took 1/1.16
/// of the time and four 1/1.2 with AVX-512, ambient occlusion in six scenes; with AVX2 two took 1/1.04 and four 1.02 times.
const PARTS: [usize; 2] = [4, 2];

/// Most rays of a packet.
const MOST: usize = RAYS * PARTS[0];

/// A subtree, and which rays are to visit it.
#[derive(Debug, Clone, Copy)]
struct Visit {
    node: NodeRef,
    rays: u64,
}

/// What packets remember things in, reused from one to the next.
pub struct Memory {
    visits: Vec<Visit>,
    frames: [Frame; MOST],
}

impl Default for Memory {
    fn default() -> Self {
        Self { visits: Vec::new(), frames: [Frame::zeroed(); MOST] }
    }
}

/// Rays of which is to be told whether they hit anything; `place` is that of the first one's answer.
pub struct Packets<'a, T: ?Sized, const GRIDS: bool> {
    pub tracer: Tracer<'a>,
    pub rays: &'a Rays<'a>,
    pub memory: &'a mut Memory,
    pub stack: &'a mut [Entry],
    pub to: &'a mut T,
    pub place: usize,
}

impl<T: Take + ?Sized, const GRIDS: bool> Kernel for Packets<'_, T, GRIDS> {
    /// [`Error::Ray`] for an unusable ray.
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let Self { tracer, rays, memory, stack, to, place } = self;
        if S::IS_WIDE {
            each_of::<S, T, GRIDS, { PARTS[0] }>(simd, tracer, rays, (memory, stack), (to, place))
        } else {
            each_of::<S, T, GRIDS, { PARTS[1] }>(simd, tracer, rays, (memory, stack), (to, place))
        }
    }
}

/// Trace rays in packets of so many parts.
#[inline(always)]
fn each_of<S: Simd, T: Take + ?Sized, const GRIDS: bool, const PARTS: usize>(
    simd: S,
    tracer: Tracer<'_>,
    rays: &Rays<'_>,
    (memory, stack): (&mut Memory, &mut [Entry]),
    (to, place): (&mut T, usize),
) -> Result<(), Error> {
    let Tracer { structure, mesh, .. } = tracer;
    let scene = (structure, structure.view());
    let (size, domain) = (RAYS * PARTS, &structure.domain);
    let mut frames = [Frames::none(simd.wide()); PARTS];
    for first in (0..rays.len()).step_by(size) {
        if set(simd, &mut frames, (rays, first), domain) {
            let hit = trace::<S, GRIDS, PARTS>(simd, scene, mesh, (&frames, rays, first), memory, stack);
            for eight in (0..size).step_by(LANES) {
                let mut hits = Eight::MISSES;
                for lane in 0..LANES {
                    hits.primitive[lane] = if hit >> (eight + lane) & 1 == 1 { 0 } else { MISS };
                }
                to.take_eight(place + first + eight, &hits);
            }
            continue;
        }
        for index in first..rays.len().min(first + size) {
            let frame = rays.frame(index, domain)?;
            let hit = kernel::trace::<S, Silent, GRIDS, true>(simd, scene, mesh, &frame, stack, &mut Silent);
            to.take(place + index, hit);
        }
    }
    Ok(())
}

/// Find the frames of the rays from `first` on; false where there are too few rays, or one has none. In place: to return
/// them would copy some kilobytes.
#[inline(always)]
fn set<S: Simd, const PARTS: usize>(
    simd: S,
    frames: &mut [Frames<S::Wide>; PARTS],
    (rays, first): (&Rays<'_>, usize),
    domain: &Domain,
) -> bool {
    if first + RAYS * PARTS > rays.len() {
        return false;
    }
    for part in 0..PARTS {
        match Frames::new(simd.wide(), &rays.sixteen(simd, first + RAYS * part), domain) {
            Some(found) => frames[part] = found,
            None => return false,
        }
    }
    true
}

/// Which of the rays from `first` on hit anything.
#[inline(always)]
fn trace<S: Simd, const GRIDS: bool, const PARTS: usize>(
    simd: S,
    (structure, root): (&Structure, View<'_>),
    mesh: &Mesh,
    (frames, rays, first): (&[Frames<S::Wide>; PARTS], &Rays<'_>, usize),
    memory: &mut Memory,
    stack: &mut [Entry],
) -> u64 {
    let packet = Packet::new(simd, frames, rays.origin(first), &structure.domain);
    let Memory { visits, frames: apart } = memory;
    let mut are_written = false;
    let all = packet.all();
    let mut open = all;
    visits.clear();
    visits.push(Visit { node: structure.root, rays: all });
    // Visits from `floor` up are in the lazy cell that the rays are in.
    let (mut here, mut floor) = (root, 0);
    loop {
        if GRIDS && visits.len() == floor {
            (here, floor) = (root, 0);
        }
        let Some(visit) = visits.pop() else { break };
        let going = visit.rays & open;
        let mut node = visit.node;
        if GRIDS
            && let Target::Lazy(cell) = node.target()
            && going != 0
            && let Some(cell) = structure.lazy.refine(cell as usize, mesh)
        {
            (here, floor, node) = (cell.view(), visits.len(), cell.root);
        }
        match node.target() {
            Target::Branch(index) if going.count_ones() >= FEW => {
                push(simd, &packet, here, &here.nodes[index as usize], going, visits);
            }
            Target::Leaf { block, count } if going.count_ones() >= FEWEST => {
                let block = &here.blocks[block as usize];
                let leaf = Leaf { block, count, rays, first, domain: &structure.domain };
                open &= !leaf.hit(simd, &packet, going);
            }
            _ if going == 0 => {}
            _ => {
                if !are_written {
                    write(simd, frames, apart);
                    are_written = true;
                }
                open &= !alone::<S, GRIDS>(simd, structure, mesh, (here, node), (apart, going), stack);
            }
        }
        if open == 0 {
            break;
        }
    }
    all & !open
}

/// Write the frames of rays one by one.
#[inline(always)]
fn write<S: Simd>(simd: S, frames: &[Frames<S::Wide>], to: &mut [Frame; MOST]) {
    let (eights, _) = to.as_chunks_mut();
    for (frames, eights) in frames.iter().zip(eights.chunks_exact_mut(2)) {
        let halves = Frames::halves(simd, frames);
        halves[0].store(simd, &mut eights[0]);
        halves[1].store(simd, &mut eights[1]);
    }
}

/// Remember the children that some of the rays `going` meet, leaves last, so that they are visited first, and among each
/// the largest last.
#[inline(always)]
fn push<S: Simd, const PARTS: usize>(
    simd: S,
    packet: &Packet<S, PARTS>,
    here: View<'_>,
    node: &Node,
    going: u64,
    visits: &mut Vec<Visit>,
) {
    let near = packet.near(simd, node);
    let leaves = node.leaves();
    for mut rest in [near & !leaves, near & leaves] {
        while rest != 0 {
            let child = rest.ilog2() as usize;
            rest &= !(1 << child);
            let rays = going & packet.meet(node, child);
            if rays != 0 {
                let node = node.child[child & (LANES - 1)];
                warm(simd, here, node);
                visits.push(Visit { node, rays });
            }
        }
    }
}

/// A block of triangles to be tested against the rays of a packet.
struct Leaf<'a> {
    block: &'a Block,
    /// Triangles in it.
    count: u32,
    /// A batch, and where in it the packet begins.
    rays: &'a Rays<'a>,
    first: usize,
    domain: &'a Domain,
}

impl Leaf<'_> {
    /// Which of the rays `going` hit one of the triangles.
    #[inline(always)]
    fn hit<S: Simd, const PARTS: usize>(&self, simd: S, packet: &Packet<S, PARTS>, going: u64) -> u64 {
        let mut near = leaf::near(simd, packet, self.block) & ((1 << self.count) - 1);
        if near == 0 {
            return 0;
        }
        let triangles = Triangles::new(simd, self.block, packet.first);
        let mut rest = going;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            let [sure, mut unclear] = leaf::hit(&triangles, packet, rest, lane);
            rest &= !sure;
            while unclear != 0 {
                let ray = unclear.trailing_zeros();
                unclear &= unclear - 1;
                rest &= !(u64::from(self.is_hit(lane, ray as usize)) << ray);
            }
            if rest == 0 {
                break;
            }
        }
        going & !rest
    }

    /// What the exact test says of a triangle and a ray.
    #[cold]
    #[inline(never)]
    fn is_hit(&self, lane: usize, ray: usize) -> bool {
        self.rays.frame(self.first + ray, self.domain).is_ok_and(|frame| self.block.intersect(lane, &frame).is_some())
    }
}

/// Let rays go on below a node one by one; tells which of them hit anything.
#[inline(always)]
fn alone<S: Simd, const GRIDS: bool>(
    simd: S,
    structure: &Structure,
    mesh: &Mesh,
    (here, node): (View<'_>, NodeRef),
    (apart, rays): (&[Frame; MOST], u64),
    stack: &mut [Entry],
) -> u64 {
    let (mut rest, mut hit) = (rays, 0);
    while rest != 0 {
        let lane = rest.trailing_zeros();
        rest &= rest - 1;
        let (frame, mut silent) = (&apart[lane as usize % MOST], Silent);
        let mut search = Search::new(simd, frame, mesh, &mut silent, Best::none(frame.tmax));
        if let Target::Leaf { block, count } = node.target() {
            search.block::<true>(&here.blocks[block as usize], count);
        } else {
            kernel::trace_below::<S, Silent, GRIDS, true>(&mut search, structure, (here, node), stack);
        }
        hit |= u64::from(search.best.primitive != MISS) << lane;
    }
    hit
}
