//! The exact test for eight rays of a tile at once.

use super::{
    RAYS,
    rays::{QUAD, Quad, Tile},
};
use crate::{
    simd::Simd,
    traverse::{exact::Exact, setup::Steepest},
    triangle::LANES,
};

/// Eight triangles.
pub(super) struct Found<S: Simd> {
    /// Their corners relative to the origin, as [`Tile::exact`] takes them.
    pub corners: [[S::F32; 3]; 3],
    /// Their numbers in the mesh, as bits.
    pub primitive: S::F32,
}

impl Tile {
    /// The order of axes in which [`Self::exact`] takes the corners: the tile's, or, where each ray has its own, that of
    /// the mesh.
    pub(super) fn order(&self, quads: [Quad; 2]) -> [usize; 3] {
        if self.is_slanted(quads) { [0, 1, 2] } else { self.axes }
    }

    fn is_slanted(&self, [one, other]: [Quad; 2]) -> bool {
        (self.slanted >> one.group | self.slanted >> other.group) & 1 == 1
    }

    /// The exact test of eight rays.
    #[inline(always)]
    pub(super) fn exact<S: Simd>(&self, simd: S, quads: [Quad; 2], corners: &[[S::F32; 3]; 3]) -> Exact<S> {
        if self.is_slanted(quads) {
            return self.exact_slanted(simd, quads, corners);
        }
        let [one, other] = quads;
        let (groups, exactly) = (&self.groups, &self.exactly);
        let ([a, b], [c, d]) = (&groups[one.group].slope, &groups[other.group].slope);
        let z = self.axes[2];
        let depth = [&exactly[one.group].direction[z], &exactly[other.group].direction[z]];
        let slope = [eight(simd, quads, [a, c]), eight(simd, quads, [b, d])];
        Exact::new(simd, corners, slope, eight(simd, quads, depth))
    }

    /// The same where every ray has an order of axes of its own.
    #[inline(always)]
    fn exact_slanted<S: Simd>(&self, simd: S, quads: [Quad; 2], corners: &[[S::F32; 3]; 3]) -> Exact<S> {
        let [one, other] = quads;
        let ([a, b, c], [d, e, f]) = (&self.exactly[one.group].direction, &self.exactly[other.group].direction);
        let direction = [eight(simd, quads, [a, d]), eight(simd, quads, [b, e]), eight(simd, quads, [c, f])];
        let steepest = Steepest::of(simd, direction);
        let [across, along, depth] = steepest.last(simd, direction);
        let inverse = simd.div(simd.splat(1.0), depth);
        let shear = [simd.mul(across, inverse), simd.mul(along, inverse)];
        let [a, b, c] = *corners;
        let corners = [steepest.last(simd, a), steepest.last(simd, b), steepest.last(simd, c)];
        Exact::new(simd, &corners, shear, depth)
    }

    /// The triangles at some places, of which those of the lanes `met` are wanted.
    #[inline(always)]
    pub(super) fn found<S: Simd>(&self, simd: S, quads: [Quad; 2], (best, met): (S::F32, u32)) -> Found<S> {
        let any = simd.store(best)[met.trailing_zeros() as usize % LANES];
        let places = simd.if_ge(best, simd.splat(0.0), best, simd.splat(any));
        let places: [u32; LANES] = bytemuck::cast(simd.store(places));
        // Compared as integers: a host may have told the processor to take all of these small numbers for zero.
        let mut differ = 0;
        for place in places {
            differ |= place ^ any.to_bits();
        }
        let order = self.order(quads);
        if differ == 0 {
            let triangle = self.held.get(any.to_bits());
            let corners = self.repeated(simd, order, triangle.corners().each_ref());
            return Found { corners, primitive: simd.splat(f32::from_bits(triangle.primitive())) };
        }
        self.gathered(simd, order, &places)
    }

    /// Eight triangles, their corners in an order of axes.
    #[inline(always)]
    fn gathered<S: Simd>(&self, simd: S, order: [usize; 3], places: &[u32; LANES]) -> Found<S> {
        let [mut first, mut last] = [[simd.splat(0.0); LANES]; 2];
        for lane in 0..LANES {
            let [a, b, c] = self.held.get(places[lane]).rows();
            first[lane] = simd.join(a, b);
            last[lane] = simd.join(c, c);
        }
        let (first, last) = (simd.transpose(first), simd.transpose(last));
        let mut corners = [[first[0], first[1], first[2]], [first[4], first[5], first[6]], [last[0], last[1], last[2]]];
        let places = corners;
        for c in 0..3 {
            for k in 0..3 {
                let axis = order[k];
                corners[c][k] = simd.sub(places[c][axis], simd.splat(self.origin[axis]));
            }
        }
        Found { corners, primitive: first[3] }
    }

    /// Corners of one triangle relative to the origin, in an order of axes, in every lane.
    #[inline(always)]
    pub(super) fn repeated<S: Simd>(&self, simd: S, order: [usize; 3], corners: [&[f32; 3]; 3]) -> [[S::F32; 3]; 3] {
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

/// Numbers of two quads, from all numbers of their groups.
#[inline(always)]
pub(super) fn eight<S: Simd>(simd: S, [one, other]: [Quad; 2], [of_one, of_other]: [&[f32; RAYS]; 2]) -> S::F32 {
    simd.join(four(of_one, one), four(of_other, other))
}

#[inline(always)]
fn four(numbers: &[f32; RAYS], quad: Quad) -> &[f32; QUAD] {
    &bytemuck::cast_ref::<_, [[f32; QUAD]; QUAD]>(numbers)[quad.quad]
}
