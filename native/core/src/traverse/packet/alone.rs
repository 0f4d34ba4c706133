//! Rays of a packet that go on one by one.

use super::{
    MOST,
    rays::{Packet, RAYS},
    walk::{Few, Walk},
};
use crate::{
    accel::structure::{NodeRef, Target, View},
    ray::MISS,
    simd::Simd,
    traverse::{
        frame::Frame,
        kernel,
        leaf::{Best, Search},
        probe::Silent,
        setup::Frames,
    },
};

/// The frames of a packet's rays, and where they are written one by one once some are wanted so.
pub struct Apart<'a, S: Simd> {
    pub frames: &'a [Frames<S::Wide>],
    pub written: &'a mut [Frame; MOST],
    /// A bit for each of `frames`.
    pub are_written: u32,
}

impl<S: Simd> Apart<'_, S> {
    /// That of a ray.
    #[inline(always)]
    fn frame(&mut self, simd: S, ray: usize) -> &Frame {
        let part = ray / RAYS;
        if self.are_written >> part & 1 == 0 {
            self.are_written |= 1 << part;
            let halves = Frames::halves(simd, &self.frames[part]);
            let (eights, _) = self.written.as_chunks_mut();
            halves[0].store(simd, &mut eights[2 * part]);
            halves[1].store(simd, &mut eights[2 * part + 1]);
        }
        &self.written[ray % MOST]
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
            let frame = walk.apart.frame(walk.simd, packet.place(lane as usize));
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
