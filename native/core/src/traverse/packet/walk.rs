//! The loop: rays of a packet against all that is below a node.

use super::{alone::Apart, leaf::Leaf, rays::Packet};
use crate::{
    Mesh,
    accel::structure::{Node, NodeRef, Structure, Target, View},
    ray::Rays,
    simd::Simd,
    traverse::{kernel::Entry, stream::warm},
    triangle::LANES,
};

/// A subtree, and which rays are to visit it.
#[derive(Debug, Clone, Copy)]
pub struct Visit {
    node: NodeRef,
    rays: u64,
}

/// How rays of a packet go on where few are left.
pub trait Few {
    /// Fewer rays than this are few.
    const FEW: u32;

    /// Which of the rays `going` hit anything below a node, where they are few or it is neither a branch nor a leaf.
    fn below<S: Simd, const GRIDS: bool, const PARTS: usize>(
        walk: &mut Walk<'_, S>,
        packet: &Packet<S, PARTS>,
        start: (View<'_>, NodeRef),
        going: u64,
    ) -> u64;
}

/// What packets walk through, and what they need to remember.
pub struct Walk<'a, S: Simd> {
    pub simd: S,
    pub structure: &'a Structure,
    pub mesh: &'a Mesh,
    /// The rays of a batch, and where in it the packet begins.
    pub batch: (&'a Rays<'a>, usize),
    pub visits: &'a mut Vec<Visit>,
    pub apart: Apart<'a>,
    pub stack: &'a mut [Entry],
}

impl<S: Simd> Walk<'_, S> {
    /// Which of the rays `all` hit anything below a node, which is one of those that `view` shows.
    #[inline(always)]
    pub fn below<const GRIDS: bool, const PARTS: usize, F: Few>(
        &mut self,
        packet: &Packet<S, PARTS>,
        (view, node): (View<'_>, NodeRef),
        all: u64,
    ) -> u64 {
        let base = self.visits.len();
        self.visits.push(Visit { node, rays: all });
        let mut open = all;
        // Visits from `floor` up are in the lazy cell that the rays are in.
        let (mut here, mut floor) = (view, base);
        loop {
            if GRIDS && self.visits.len() == floor {
                (here, floor) = (view, base);
            }
            if self.visits.len() == base {
                break;
            }
            let Some(visit) = self.visits.pop() else { break };
            let going = visit.rays & open;
            let mut node = visit.node;
            if GRIDS
                && let Target::Lazy(cell) = node.target()
                && going != 0
                && let Some(cell) = self.structure.lazy.refine(cell as usize, self.mesh)
            {
                (here, floor, node) = (cell.view(), self.visits.len(), cell.root);
            }
            match node.target() {
                Target::Branch(index) if going.count_ones() >= F::FEW => {
                    self.push(packet, here, &here.nodes[index as usize], going);
                }
                Target::Leaf { block, count } if going.count_ones() >= F::FEW => {
                    let (block, domain) = (&here.blocks[block as usize], &self.structure.domain);
                    let leaf = Leaf { block, count, batch: self.batch, domain };
                    open &= !leaf.hit(self.simd, packet, going);
                }
                _ if going == 0 => {}
                _ => open &= !F::below::<S, GRIDS, PARTS>(self, packet, (here, node), going),
            }
            if open == 0 {
                self.visits.truncate(base);
                break;
            }
        }
        all & !open
    }

    /// Remember the children that some of the rays `going` meet, leaves last, so that they are visited first, and among
    /// each the largest last.
    #[inline(always)]
    fn push<const PARTS: usize>(&mut self, packet: &Packet<S, PARTS>, here: View<'_>, node: &Node, going: u64) {
        let near = packet.near(self.simd, node);
        let leaves = node.leaves();
        for mut rest in [near & !leaves, near & leaves] {
            while rest != 0 {
                let child = rest.ilog2() as usize;
                rest &= !(1 << child);
                let rays = going & packet.meet(node, child);
                if rays != 0 {
                    let node = node.child[child & (LANES - 1)];
                    warm(self.simd, here, node);
                    self.visits.push(Visit { node, rays });
                }
            }
        }
    }
}
