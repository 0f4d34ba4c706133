//! Rays of a tile that go on one by one.

use super::{GROUPS, RAYS, ROUNDING, rays::Tile};
use crate::{
    Mesh,
    accel::structure::{NodeRef, Structure, View},
    ray::MISS,
    simd::{Kernel, Simd},
    traverse::{
        frame::Frame,
        kernel::{self, Entry},
        leaf::{Best, Search},
        probe::Silent,
    },
};

/// More than the share by which rounding is off where depths become parameters, or parameters depths.
pub const CONVERSION: f32 = 4.0 * ROUNDING;

/// Groups whose rays go on one by one below a node.
pub struct Alone<'a, const GRIDS: bool> {
    pub tile: &'a mut Tile,
    pub structure: &'a Structure,
    pub mesh: &'a Mesh,
    pub node: (View<'a>, NodeRef),
    pub groups: u32,
    pub stack: &'a mut [Entry],
}

impl<const GRIDS: bool> Kernel for Alone<'_, GRIDS> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { tile, structure, mesh, node, groups, stack } = self;
        for group in (0..GROUPS).filter(|group| groups >> group & 1 == 1) {
            for lane in 0..RAYS {
                let frame = tile.frame(group, lane);
                let before = tile.as_searched(group, lane, &frame);
                let mut silent = Silent;
                let mut search = Search::new(simd, &frame, mesh, &mut silent, before);
                kernel::trace_below::<S, Silent, GRIDS, false>(&mut search, structure, node, stack);
                let Best { low, high, primitive } = search.best;
                if primitive != before.primitive {
                    let place = tile.held.add(primitive, mesh.corners(primitive).map(|corner| corner.to_array()));
                    tile.keep(group, lane, place, tile.depths(group, lane, [low, high]));
                }
            }
        }
        tile.approach(simd, groups);
    }
}

impl Tile {
    /// The best hit of a ray, as one that walks alone knows it.
    fn as_searched(&self, group: usize, lane: usize, frame: &Frame) -> Best {
        let rays = &self.groups[group];
        let place = rays.best[lane].to_bits();
        if place == MISS {
            return Best::none(frame.tmax);
        }
        let primitive = self.held.get(place).primitive();
        let slant = frame.direction[self.axes[2]].abs();
        let [low, high] = [rays.low[lane] / slant * (1.0 - CONVERSION), rays.high[lane] / slant * (1.0 + CONVERSION)];
        Best { low, high, primitive }
    }

    fn keep(&mut self, group: usize, lane: usize, place: u32, [from, to]: [f32; 2]) {
        let rays = &mut self.groups[group];
        rays.low[lane] = from;
        rays.high[lane] = to;
        rays.best[lane] = f32::from_bits(place);
    }

    /// From which depth to which a hit is between two parameters.
    fn depths(&self, group: usize, lane: usize, [from, to]: [f32; 2]) -> [f32; 2] {
        let slant = self.exactly[group].direction[self.axes[2]][lane].abs();
        [from * slant * (1.0 - CONVERSION), to * slant * (1.0 + CONVERSION)]
    }
}
