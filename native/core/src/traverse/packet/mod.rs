//! Packets: sixteen rays of a batch, as they come, walk the tree together where any hit will do. A node's children are
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
//! children in the order of the first ray's octant. Bounces took 1/1.28 of the time of streams in the hospital, but as
//! long or 1.07 times as long in the room, Sponza, city_blocks and vianney, and comparing both cost more than it gained.

mod leaf;
mod rays;

use bytemuck::Zeroable;

use self::rays::Packet;
use super::{
    Tracer,
    frame::{Domain, Frame},
    kernel::{self, Entry},
    leaf::{Best, Search},
    probe::Silent,
    setup::Frames,
    stream::warm,
    together::Take,
    weights::Triangles,
};
use crate::{
    Error, Mesh,
    accel::structure::{Node, NodeRef, Structure, Target, View},
    ray::{Eight, MISS, Rays},
    simd::Simd,
    triangle::{Block, LANES},
};

/// Fewer rays than this go on one by one from where they are. From 2 to 5, times differed by less than the noise.
const FEW: u32 = 4;

/// Fewer rays than this are tested one by one against eight triangles, others all together against one after another.
const FEWEST: u32 = 3;

/// Rays of a packet.
const SIZE: usize = 16;

/// A subtree, and which rays are to visit it.
#[derive(Debug, Clone, Copy)]
struct Visit {
    node: NodeRef,
    rays: u32,
}

/// What packets remember things in, reused from one to the next.
pub struct Memory {
    visits: Vec<Visit>,
    frames: [[Frame; LANES]; 2],
}

impl Default for Memory {
    fn default() -> Self {
        Self { visits: Vec::new(), frames: [[Frame::zeroed(); LANES]; 2] }
    }
}

/// Tell of every ray whether it hits anything; `place` is that of the first one's answer.
///
/// # Errors
/// [`Error::Ray`] for an unusable ray.
#[inline(always)]
pub fn each<S: Simd, T: Take + ?Sized, const GRIDS: bool>(
    simd: S,
    tracer: Tracer<'_>,
    rays: &Rays<'_>,
    (memory, stack): (&mut Memory, &mut [Entry]),
    (to, place): (&mut T, usize),
) -> Result<(), Error> {
    let Tracer { structure, mesh, .. } = tracer;
    let scene = (structure, structure.view());
    for first in (0..rays.len()).step_by(SIZE) {
        if first + SIZE <= rays.len()
            && let Some(frames) = Frames::new(simd.wide(), &rays.sixteen(simd, first), &structure.domain)
        {
            let hit = trace::<S, GRIDS>(simd, scene, mesh, (&frames, rays, first), memory, stack);
            for half in [0, LANES] {
                let mut hits = Eight::MISSES;
                for lane in 0..LANES {
                    hits.primitive[lane] = if hit >> (half + lane) & 1 == 1 { 0 } else { MISS };
                }
                to.take_eight(place + first + half, &hits);
            }
            continue;
        }
        for index in first..rays.len().min(first + SIZE) {
            let frame = rays.frame(index, &structure.domain)?;
            let hit = kernel::trace::<S, Silent, GRIDS, true>(simd, scene, mesh, &frame, stack, &mut Silent);
            to.take(place + index, hit);
        }
    }
    Ok(())
}

/// Which of sixteen rays, from `first` on, hit anything.
#[inline(always)]
fn trace<S: Simd, const GRIDS: bool>(
    simd: S,
    (structure, root): (&Structure, View<'_>),
    mesh: &Mesh,
    (frames, rays, first): (&Frames<S::Wide>, &Rays<'_>, usize),
    memory: &mut Memory,
    stack: &mut [Entry],
) -> u32 {
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
                    let halves = Frames::halves(simd, frames);
                    halves[0].store(simd, &mut apart[0]);
                    halves[1].store(simd, &mut apart[1]);
                    are_written = true;
                }
                open &= !alone::<S, GRIDS>(simd, structure, mesh, (here, node), (apart.as_flattened(), going), stack);
            }
        }
        if open == 0 {
            break;
        }
    }
    all & !open
}

/// Remember the children that some of the rays `going` meet, leaves last, so that they are visited first, and among each
/// the largest last.
#[inline(always)]
fn push<S: Simd>(simd: S, packet: &Packet<S>, here: View<'_>, node: &Node, going: u32, visits: &mut Vec<Visit>) {
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
    fn hit<S: Simd>(&self, simd: S, packet: &Packet<S>, going: u32) -> u32 {
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
                rest &= !(u32::from(self.is_hit(lane, ray as usize)) << ray);
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
    (apart, rays): (&[Frame], u32),
    stack: &mut [Entry],
) -> u32 {
    let (mut rest, mut hit) = (rays, 0);
    while rest != 0 {
        let lane = rest.trailing_zeros();
        rest &= rest - 1;
        let (frame, mut silent) = (&apart[lane as usize & (SIZE - 1)], Silent);
        let mut search = Search::new(simd, frame, mesh, &mut silent, Best::none(frame.tmax));
        if let Target::Leaf { block, count } = node.target() {
            search.block::<true>(&here.blocks[block as usize], count);
        } else {
            kernel::trace_below::<S, Silent, GRIDS, true>(&mut search, structure, (here, node), stack);
        }
        hit |= u32::from(search.best.primitive != MISS) << lane;
    }
    hit
}
