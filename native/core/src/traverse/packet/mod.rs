//! Packets: some rays of a batch, as they come, walk the tree together where any hit will do. A node's children are
//! first compared with the box around the rays' segments, all eight at once, and only then with the rays: short rays
//! that begin side by side, as those of ambient occlusion, pass by most boxes together. After Wald, Slusallek, Benthin
//! and Wagner, "Interactive Rendering with Coherent Ray Tracing", Eurographics 2001, and Boulos, Wald and Shirley,
//! "Geometric and Arithmetic Culling Methods for Entire Ray Packets", University of Utah UUCS-06-010, 2006. Rays that are
//! left over for a subtree go on in a packet of one vector ([`narrow`]), or one by one ([`alone`]).
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
//!
//! Copies of one and the same program file differ by up to a fifth in the cheapest of these (vianney, hospital; camera rays
//! and bounces by less than a twentieth), each copy every time it runs: it is where in memory the system has put its pages.

mod alone;
mod leaf;
mod narrow;
mod rays;
mod walk;

use bytemuck::Zeroable;

use self::{
    alone::{Alone, Apart},
    narrow::Narrow,
    rays::{Packet, RAYS},
    walk::{Visit, Walk},
};
use super::{
    Tracer,
    frame::Frame,
    kernel::{self, Entry},
    probe::Silent,
    take::Take,
};
use crate::{
    Error, Mesh,
    accel::structure::{Structure, View},
    ray::{Eight, MISS, Rays},
    simd::{Kernel, Simd},
    triangle::LANES,
};

/// Vectors of sixteen rays in a packet where one is one register, and where it is two. The more there are, the less a
/// packet costs beside its arithmetic, in branches above all that nobody can predict. Against one (Zen 5), two took 1/1.16
/// of the time and four 1/1.2 with AVX-512, ambient occlusion in six scenes; with AVX2 two took 1/1.04 and four 1.02 times.
const PARTS: [usize; 2] = [4, 2];

/// Most rays of a packet.
const MOST: usize = RAYS * PARTS[0];

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
    let mut packet = Packet::none(simd);
    for first in (0..rays.len()).step_by(size) {
        if packet.set(simd, (rays, first), domain) {
            let hit = trace::<S, GRIDS, PARTS>(simd, scene, mesh, (&packet, rays, first), memory, stack);
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

/// Which rays of a packet, those of a batch's from `first` on, hit anything.
#[inline(always)]
fn trace<S: Simd, const GRIDS: bool, const PARTS: usize>(
    simd: S,
    (structure, root): (&Structure, View<'_>),
    mesh: &Mesh,
    (packet, rays, first): (&Packet<S, PARTS>, &Rays<'_>, usize),
    memory: &mut Memory,
    stack: &mut [Entry],
) -> u64 {
    let Memory { visits, frames } = memory;
    visits.clear();
    let apart = Apart { frames, are_written: 0 };
    let mut walk = Walk { simd, structure, mesh, batch: (rays, first), visits, apart, stack };
    let start = (root, structure.root);
    if S::IS_WIDE {
        walk.below::<GRIDS, PARTS, Narrow>(packet, start, packet.all())
    } else {
        walk.below::<GRIDS, PARTS, Alone>(packet, start, packet.all())
    }
}
