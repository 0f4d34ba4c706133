//! Packets: eight rays of a batch, as they come, walk the tree together where any hit will do. A node's children are
//! first compared with the box around the rays' segments, all eight at once, and only then with the rays: short rays
//! that begin side by side, as those of ambient occlusion, pass by most boxes together. After Wald, Slusallek, Benthin
//! and Wagner, "Interactive Rendering with Coherent Ray Tracing", Eurographics 2001, and Boulos, Wald and Shirley,
//! "Geometric and Arithmetic Culling Methods for Entire Ray Packets", University of Utah UUCS-06-010, 2006.
//!
//! A ray meets a child here if and only if it does so alone, to the bit: both planes of an axis are tested with the
//! bias that they have for the ray's direction, and the lesser is the near one. The box around the segments culls no
//! child with a hit: with u and R as in [`super::frame`], a segment is cut off where the largest component of its
//! direction, at least 1, has taken it 2R far, outside the scene; its ends are within 5R of the centre and off by two
//! roundings, at most 9uR, and by another 5uR where the box is grown. What a triangle is hit at lies within 22uR of the
//! ray. The box is grown by 64uR.

use bytemuck::Zeroable;

use super::{
    Tracer,
    frame::{Domain, Frame},
    kernel::{self, Entry},
    leaf::{Best, Search},
    probe::Silent,
    setup::Frames,
    stream::warm,
    together::Take,
};
use crate::{
    Error, Mesh,
    accel::structure::{Node, NodeRef, Structure, Target, View},
    ray::{Hit, MISS, Rays},
    simd::Simd,
    triangle::LANES,
};

/// Fewer rays than this go on one by one from where they are; 2 and 4 were up to 2% slower.
const FEW: u32 = 3;

/// 64u, see the module's text.
const MARGIN: f32 = 64.0 / (1 << 24) as f32;

/// A subtree, and which rays are to visit it.
#[derive(Debug, Clone, Copy)]
pub struct Visit {
    node: NodeRef,
    rays: u32,
}

/// Eight rays.
struct Packet<S: Simd> {
    inverse: [S::F32; 3],
    /// What is added to `plane * inverse` for lower and for upper planes.
    bias: [[S::F32; 3]; 2],
    tmin: S::F32,
    tmax: S::F32,
    /// The box around the segments: its lower sides, and its upper ones with their sign changed.
    sides: [f32; LANES],
}

impl<S: Simd> Packet<S> {
    #[inline(always)]
    fn new(simd: S, frames: &Frames<S>, domain: &Domain) -> Self {
        let zero = simd.splat(0.0);
        let mut reach = zero;
        for k in 0..3 {
            reach = simd.max(simd.abs(frames.local[k]), reach);
        }
        let size = simd.add(reach, simd.splat(domain.half_extent));
        let (most, least) = (simd.add(size, size), simd.sub(zero, simd.add(size, size)));
        let begin = simd.min(simd.max(frames.tmin, least), most);
        let end = simd.min(simd.max(frames.tmax, least), most);
        let margin = simd.mul(size, simd.splat(MARGIN));
        let mut bias = [[zero; 3]; 2];
        let mut sides = [zero; LANES];
        for k in 0..3 {
            let (near, far) = (frames.near_bias[k], frames.far_bias[k]);
            bias[0][k] = simd.if_ge(frames.inverse[k], zero, near, far);
            bias[1][k] = simd.if_ge(frames.inverse[k], zero, far, near);
            let from = simd.mul_add(frames.direction[k], begin, frames.local[k]);
            let to = simd.mul_add(frames.direction[k], end, frames.local[k]);
            sides[k] = simd.sub(simd.min(from, to), margin);
            sides[3 + k] = simd.sub(zero, simd.add(simd.max(from, to), margin));
        }
        let rows = simd.transpose(sides);
        let mut least = rows[0];
        for lane in 1..LANES {
            least = simd.min(rows[lane], least);
        }
        Self { inverse: frames.inverse, bias, tmin: frames.tmin, tmax: frames.tmax, sides: simd.store(least) }
    }

    /// The rays whose interval is not empty.
    #[inline(always)]
    fn all(&self, simd: S) -> u32 {
        simd.le(self.tmin, self.tmax)
    }

    /// The children whose boxes meet the one around the segments.
    #[inline(always)]
    fn near(&self, simd: S, node: &Node) -> u32 {
        let mut apart = simd.splat(0.0);
        for k in 0..3 {
            let (lower, upper) = (simd.load(&node.plane[k]), simd.load(&node.plane[3 + k]));
            apart = simd.max(simd.add(lower, simd.splat(self.sides[3 + k])), apart);
            apart = simd.max(simd.sub(simd.splat(self.sides[k]), upper), apart);
        }
        simd.le(apart, simd.splat(0.0))
    }

    /// The rays that meet a child.
    #[inline(always)]
    fn meet(&self, simd: S, node: &Node, child: usize) -> u32 {
        let (mut near, mut far) = (self.tmin, self.tmax);
        for k in 0..3 {
            let lower = simd.splat(node.plane[k][child & (LANES - 1)]);
            let upper = simd.splat(node.plane[3 + k][child & (LANES - 1)]);
            let lower = simd.mul_add(lower, self.inverse[k], self.bias[0][k]);
            let upper = simd.mul_add(upper, self.inverse[k], self.bias[1][k]);
            near = simd.max(simd.min(lower, upper), near);
            far = simd.min(simd.max(lower, upper), far);
        }
        simd.le(near, far)
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
    (visits, stack): (&mut Vec<Visit>, &mut [Entry]),
    (to, place): (&mut T, usize),
) -> Result<(), Error> {
    let Tracer { structure, mesh, .. } = tracer;
    let scene = (structure, structure.view());
    for first in (0..rays.len()).step_by(LANES) {
        if first + LANES <= rays.len()
            && let Some(frames) = Frames::new(simd, &rays.eight(simd, first), &structure.domain)
        {
            let hit = trace::<S, GRIDS>(simd, structure, mesh, &frames, visits, stack);
            for lane in 0..LANES {
                let primitive = if hit >> lane & 1 == 1 { 0 } else { MISS };
                to.take(place + first + lane, Hit { primitive, ..Hit::MISS });
            }
            continue;
        }
        for index in first..rays.len().min(first + LANES) {
            let frame = rays.frame(index, &structure.domain)?;
            let hit = kernel::trace::<S, Silent, GRIDS, true>(simd, scene, mesh, &frame, stack, &mut Silent);
            to.take(place + index, hit);
        }
    }
    Ok(())
}

/// Which of eight rays hit anything.
#[inline(always)]
fn trace<S: Simd, const GRIDS: bool>(
    simd: S,
    structure: &Structure,
    mesh: &Mesh,
    frames: &Frames<S>,
    visits: &mut Vec<Visit>,
    stack: &mut [Entry],
) -> u32 {
    let packet = Packet::new(simd, frames, &structure.domain);
    let mut rays = [Frame::zeroed(); LANES];
    frames.store(simd, &mut rays);
    let all = packet.all(simd);
    let mut open = all;
    visits.clear();
    visits.push(Visit { node: structure.root, rays: all });
    // Visits from `floor` up are in the lazy cell that the rays are in.
    let (mut here, mut floor) = (structure.view(), 0);
    loop {
        if GRIDS && visits.len() == floor {
            (here, floor) = (structure.view(), 0);
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
                let node = &here.nodes[index as usize];
                let near = packet.near(simd, node);
                let leaves = node.leaves();
                for mut rest in [near & !leaves, near & leaves] {
                    while rest != 0 {
                        let child = rest.ilog2() as usize;
                        rest &= !(1 << child);
                        let rays = going & packet.meet(simd, node, child);
                        if rays != 0 {
                            let node = node.child[child & (LANES - 1)];
                            warm(simd, here, node);
                            visits.push(Visit { node, rays });
                        }
                    }
                }
            }
            _ => open &= !alone::<S, GRIDS>(simd, structure, mesh, (here, node), (&rays, going), stack),
        }
        if open == 0 {
            break;
        }
    }
    all & !open
}

/// Let rays go on below a node one by one; tells which of them hit anything.
#[inline(always)]
fn alone<S: Simd, const GRIDS: bool>(
    simd: S,
    structure: &Structure,
    mesh: &Mesh,
    (here, node): (View<'_>, NodeRef),
    (frames, rays): (&[Frame; LANES], u32),
    stack: &mut [Entry],
) -> u32 {
    let (mut rest, mut hit) = (rays, 0);
    while rest != 0 {
        let lane = rest.trailing_zeros();
        rest &= rest - 1;
        let (frame, mut silent) = (&frames[lane as usize & (LANES - 1)], Silent);
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
