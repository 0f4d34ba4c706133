//! Where a tile asks the exact test: for rays of which the planes decide nothing, below nodes that rays visit one by
//! one, and for the parameters and weights of all winners.

use super::{GROUPS, RAYS, ROUNDING, rays::Tile};
use crate::{
    Mesh,
    accel::structure::{NodeRef, Structure, View},
    mesh::Reader,
    ray::{Eight, Hit, MISS},
    simd::Simd,
    traverse::{
        exact::Exact,
        frame::Frame,
        kernel::{self, Entry},
        leaf::{Best, Search},
        probe::Silent,
        setup::Steepest,
    },
    triangle::{self, Block, LANES},
};

/// More than the share by which rounding is off where depths become parameters, or parameters depths.
const CONVERSION: f32 = 4.0 * ROUNDING;

impl Tile {
    /// Let the exact test decide about a triangle for some lanes of a group; true where some best hit came nearer.
    #[inline(always)]
    pub fn decide<S: Simd>(
        &mut self,
        simd: S,
        mesh: &Mesh,
        group: usize,
        lanes: u32,
        block: &Block,
        triangle: usize,
    ) -> bool {
        let corners = self.repeated(simd, self.order(group), block.corners(triangle).each_ref());
        let (mut nearer, mut unclear) = (false, 0);
        for first in [0, LANES] {
            let lanes = lanes >> first & 0xff;
            if lanes == 0 {
                continue;
            }
            let exact = self.exact(simd, group, first, &corners);
            let t = simd.store(exact.t);
            unclear |= (lanes & exact.unclear) << first;
            for lane in (0..LANES).filter(|lane| (lanes & exact.hit) >> lane & 1 == 1) {
                let hit = Hit { t: t[lane], primitive: block.primitive[triangle], ..Hit::MISS };
                let [tmin, tmax] = self.exactly[group].interval;
                if tmin[first + lane] <= hit.t && hit.t <= tmax[first + lane] {
                    nearer |= self.offer(mesh, group, first + lane, hit);
                }
            }
        }
        nearer | (unclear != 0 && self.decide_one_by_one(mesh, group, unclear, block, triangle))
    }

    /// The order of axes in which [`Self::exact`] takes the corners for a group: the tile's, or, where each ray has its
    /// own, that of the mesh.
    fn order(&self, group: usize) -> [usize; 3] {
        if self.slanted >> group & 1 == 1 { [0, 1, 2] } else { self.axes }
    }

    /// The exact test of eight rays, from `first` on, of a group.
    #[inline(always)]
    fn exact<S: Simd>(&self, simd: S, group: usize, first: usize, corners: &[[S::F32; 3]; 3]) -> Exact<S> {
        if self.slanted >> group & 1 == 1 {
            return self.exact_slanted(simd, group, first, corners);
        }
        let [x, y] = &self.groups[group].slope;
        let depth = &self.exactly[group].direction[self.axes[2]];
        let shear = [simd.load(eight(x, first)), simd.load(eight(y, first))];
        Exact::new(simd, corners, shear, simd.load(eight(depth, first)))
    }

    /// The same where every ray has an order of axes of its own.
    #[inline(always)]
    fn exact_slanted<S: Simd>(&self, simd: S, group: usize, first: usize, corners: &[[S::F32; 3]; 3]) -> Exact<S> {
        let [x, y, z] = &self.exactly[group].direction;
        let direction = [simd.load(eight(x, first)), simd.load(eight(y, first)), simd.load(eight(z, first))];
        let steepest = Steepest::of(simd, direction);
        let [across, along, depth] = steepest.last(simd, direction);
        let inverse = simd.div(simd.splat(1.0), depth);
        let shear = [simd.mul(across, inverse), simd.mul(along, inverse)];
        let [a, b, c] = *corners;
        let corners = [steepest.last(simd, a), steepest.last(simd, b), steepest.last(simd, c)];
        Exact::new(simd, &corners, shear, depth)
    }

    #[cold]
    #[inline(never)]
    fn decide_one_by_one(&mut self, mesh: &Mesh, group: usize, lanes: u32, block: &Block, triangle: usize) -> bool {
        let mut nearer = false;
        for lane in (0..RAYS).filter(|lane| lanes >> lane & 1 == 1) {
            if let Some(hit) = block.intersect(triangle, &self.frame(group, lane)) {
                nearer |= self.offer(mesh, group, lane, hit);
            }
        }
        nearer
    }

    /// Make an exact hit the best of its ray, if it is; only its parameter and triangle matter.
    #[inline(never)]
    fn offer(&mut self, mesh: &Mesh, group: usize, lane: usize, hit: Hit) -> bool {
        let [from, to] = self.depths(group, lane, [hit.t; 2]);
        let rays = &self.groups[group];
        let is_nearer = to < rays.low[lane]
            || (from <= rays.high[lane] && hit.precedes(&self.best(mesh, group, lane, &self.frame(group, lane))));
        if is_nearer {
            self.keep(group, lane, hit.primitive, [from, to]);
        }
        is_nearer
    }

    fn keep(&mut self, group: usize, lane: usize, primitive: u32, [from, to]: [f32; 2]) {
        let rays = &mut self.groups[group];
        rays.low[lane] = from;
        rays.high[lane] = to;
        rays.best[lane] = f32::from_bits(primitive);
    }

    /// From which depth to which a hit is between two parameters.
    fn depths(&self, group: usize, lane: usize, [from, to]: [f32; 2]) -> [f32; 2] {
        let slant = self.exactly[group].direction[self.axes[2]][lane].abs();
        [from * slant * (1.0 - CONVERSION), to * slant * (1.0 + CONVERSION)]
    }

    /// The best hit of a ray, in the frame's units, or the end of its interval.
    fn best(&self, mesh: &Mesh, group: usize, lane: usize, frame: &Frame) -> Hit {
        let primitive = self.groups[group].best[lane].to_bits();
        if primitive == MISS {
            return Hit { t: frame.tmax, ..Hit::MISS };
        }
        triangle::evaluate(frame, triangle::relative(frame, mesh.reader().places(primitive)), primitive)
    }

    /// Go on below a node ray by ray.
    #[inline(always)]
    pub fn one_by_one<S: Simd, const GRIDS: bool>(
        &mut self,
        simd: S,
        structure: &Structure,
        mesh: &Mesh,
        node: (View<'_>, NodeRef),
        groups: u32,
        stack: &mut [Entry],
    ) {
        for group in (0..GROUPS).filter(|group| groups >> group & 1 == 1) {
            for lane in 0..RAYS {
                let frame = self.frame(group, lane);
                let before = self.as_searched(group, lane, &frame);
                let mut silent = Silent;
                let mut search = Search::new(simd, &frame, mesh, &mut silent, before);
                kernel::trace_below::<S, Silent, GRIDS, false>(&mut search, structure, node, stack);
                let Best { low, high, primitive } = search.best;
                if primitive != before.primitive {
                    self.keep(group, lane, primitive, self.depths(group, lane, [low, high]));
                }
            }
            self.approach(simd, group);
        }
        self.update_far(simd);
    }

    /// The best hit of a ray, as one that walks alone knows it.
    fn as_searched(&self, group: usize, lane: usize, frame: &Frame) -> Best {
        let rays = &self.groups[group];
        let primitive = rays.best[lane].to_bits();
        if primitive == MISS {
            return Best::none(frame.tmax);
        }
        let slant = frame.direction[self.axes[2]].abs();
        let [low, high] = [rays.low[lane] / slant * (1.0 - CONVERSION), rays.high[lane] / slant * (1.0 + CONVERSION)];
        Best { low, high, primitive }
    }

    /// Write the best hits of eight rays of a group, from `first` on, in the rays' own units, over misses. To return them
    /// would copy them by vectors wider than those they were written by. Asking for triangles two groups ahead, as streams
    /// do, took 1/1.1 of the time where they miss every cache (soup, dragon), and up to 1.04 times as long elsewhere.
    #[inline(always)]
    pub fn hits<S: Simd>(&self, simd: S, mesh: &Mesh, group: usize, first: usize, hits: &mut Eight) {
        // Of all these bits, those of MISS alone are not a number.
        let best = simd.load(eight(&self.groups[group].best, first));
        let met = simd.le(best, best);
        if met != 0 {
            self.set_together(simd, mesh, (group, first), met, hits);
        }
    }

    #[inline(always)]
    fn set_together<S: Simd>(&self, simd: S, mesh: &Mesh, (group, start): (usize, usize), met: u32, hits: &mut Eight) {
        let bits = eight(&self.groups[group].best, start);
        let any = bits[met.trailing_zeros() as usize % LANES];
        let (best, first, zero) = (simd.load(bits), simd.splat(any), simd.splat(0.0));
        let triangles: [u32; LANES] = bytemuck::cast(simd.store(simd.if_ge(best, zero, best, first)));
        // Compared as integers: a host may have told the processor to take all of these small numbers for zero.
        let mut differ = 0;
        for triangle in triangles {
            differ |= triangle ^ any.to_bits();
        }
        let (mesh, order) = (mesh.reader(), self.order(group));
        let corners = if differ == 0 {
            self.repeated(simd, order, mesh.places(any.to_bits()))
        } else {
            self.gathered(simd, order, mesh, &triangles)
        };
        let exact = self.exact(simd, group, start, &corners);
        let t = simd.mul(exact.t, simd.load(eight(&self.exactly[group].scale, start)));
        hits.primitive = bytemuck::cast(*bits);
        hits.t = simd.store(simd.if_ge(best, zero, t, simd.splat(f32::INFINITY)));
        hits.u = simd.store(simd.if_ge(best, zero, exact.u, zero));
        hits.v = simd.store(simd.if_ge(best, zero, exact.v, zero));
    }

    /// Corners of eight triangles relative to the origin, in an order of axes.
    #[inline(always)]
    fn gathered<S: Simd>(
        &self,
        simd: S,
        order: [usize; 3],
        mesh: Reader<'_>,
        triangles: &[u32; LANES],
    ) -> [[S::F32; 3]; 3] {
        let [mut first, mut last] = [[simd.splat(0.0); LANES]; 2];
        for lane in 0..LANES {
            let [a, b, c] = mesh.rows(triangles[lane]);
            first[lane] = simd.join(a, b);
            last[lane] = simd.join(c, c);
        }
        let (first, last) = (simd.transpose(first), simd.transpose(last));
        let places = [[first[0], first[1], first[2]], [first[4], first[5], first[6]], [last[0], last[1], last[2]]];
        let mut relative = places;
        for c in 0..3 {
            for k in 0..3 {
                let axis = order[k];
                relative[c][k] = simd.sub(places[c][axis], simd.splat(self.origin[axis]));
            }
        }
        relative
    }

    /// Corners of one triangle relative to the origin, in an order of axes, in every lane.
    #[inline(always)]
    fn repeated<S: Simd>(&self, simd: S, order: [usize; 3], corners: [&[f32; 3]; 3]) -> [[S::F32; 3]; 3] {
        let mut relative = [[simd.splat(0.0); 3]; 3];
        for c in 0..3 {
            for k in 0..3 {
                let axis = order[k];
                relative[c][k] = simd.splat(corners[c][axis] - self.origin[axis]);
            }
        }
        relative
    }
}

/// Eight of a group's numbers, from `first` on.
#[inline(always)]
fn eight(numbers: &[f32; RAYS], first: usize) -> &[f32; LANES] {
    &bytemuck::cast_ref::<_, [[f32; LANES]; 2]>(numbers)[first / LANES]
}
