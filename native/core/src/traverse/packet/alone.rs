//! Rays of a packet that go on one by one.

use super::{
    MOST,
    rays::Packet,
    walk::{Few, Walk},
};
use crate::{
    accel::structure::{NodeRef, Target, View},
    ray::{MISS, Rays},
    simd::Simd,
    traverse::{
        frame::{Domain, Frame},
        kernel,
        leaf::{Best, Search},
        probe::Silent,
        setup::Frames,
    },
    triangle::LANES,
};

/// The frames of rays that have gone on one by one, and of their neighbours. They are found again: to write those of every
/// packet, six kilobytes, took 1.07 to 1.14 times as long in all (ambient occlusion in hospital, room and vianney, Zen 5).
pub struct Apart<'a> {
    pub frames: &'a mut [Frame; MOST],
    /// A bit for every eight of them.
    pub are_written: u32,
}

impl Apart<'_> {
    /// That of a ray of a batch's, counted from where the packet begins.
    #[inline(always)]
    fn frame<S: Simd>(&mut self, simd: S, (rays, first): (&Rays<'_>, usize), domain: &Domain, ray: usize) -> &Frame {
        let eight = ray % MOST / LANES;
        if self.are_written >> eight & 1 == 0 {
            self.are_written |= 1 << eight;
            let frames = Frames::new(simd, &rays.eight(simd, first + LANES * eight), domain);
            let (eights, _) = self.frames.as_chunks_mut();
            frames.expect("a packet's rays have frames").store(simd, &mut eights[eight]);
        }
        &self.frames[ray % MOST]
    }
}

/// One by one from where they are, with what the exact test says of eight triangles at a time.
pub struct Alone;

impl Few for Alone {
    /// With 2 and with 4, ambient occlusion in seven scenes took as long in the mean, within 1/80.
    const FEW: u32 = 3;

    #[inline(always)]
    fn below<S: Simd, const GRIDS: bool, const PARTS: usize>(
        walk: &mut Walk<'_, S>,
        packet: &Packet<S, PARTS>,
        (here, node): (View<'_>, NodeRef),
        going: u64,
    ) -> u64 {
        let (mut rest, mut hit) = (going, 0);
        while rest != 0 {
            let lane = rest.trailing_zeros();
            rest &= rest - 1;
            let place = packet.place(lane as usize);
            let frame = walk.apart.frame(walk.simd, walk.batch, &walk.structure.domain, place);
            let mut silent = Silent;
            let mut search = Search::new(walk.simd, frame, walk.mesh, &mut silent, Best::none(frame.tmax));
            if let Target::Leaf { block, count } = node.target() {
                search.block::<true>(&here.blocks[block as usize], count);
            } else {
                kernel::trace_below::<S, Silent, GRIDS, true>(&mut search, walk.structure, (here, node), walk.stack);
            }
            hit |= u64::from(search.best.primitive != MISS) << lane;
        }
        hit
    }
}
