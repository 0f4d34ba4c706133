//! What the rays of a tile hit, by the exact arithmetic, in their own units.

use super::{
    RAYS,
    rays::{QUAD, Quad, Tile},
    resolve::eight,
};
use crate::{
    Mesh,
    mesh::Reader,
    ray::Eight,
    simd::{Kernel, Simd},
    traverse::take::Take,
    triangle::LANES,
};

/// Tells the hits of a traced tile, whose rays are those of the batch from `first` on. A kernel of its own, for what it has
/// to do where it asks for triangles ahead would make the loop over a batch slower that seldom meets them.
pub struct Tell<'a, T: ?Sized, const AHEAD: bool> {
    pub tile: &'a Tile,
    pub mesh: &'a Mesh,
    pub to: &'a mut T,
    pub first: usize,
    /// Whether hits go [past the caches](Take::aligned).
    pub is_large: bool,
}

/// A tile meets many triangles where it makes a visit for every so many rays: then those that its rays hit are asked for
/// ahead. Where they are far, camera rays so took 1/1.04 to 1/1.1 of the time (dragon, soup, room), but 1.02 times as long
/// in meshes of [fewer](FAR), and 1.1 times where rays side by side hit the same one.
const MANY: usize = 3;

/// Meshes of at least so many triangles are far from the processor.
const FAR: usize = 1 << 17;

/// Whether triangles are to be asked for ahead, after a tile of `rays` rays made so many visits.
#[inline(always)]
pub fn asks_ahead(mesh: &Mesh, rays: usize, visits: usize) -> bool {
    visits * MANY > rays && mesh.triangles().len() >= FAR
}

/// Rays ahead of which indices are asked for, and, once those are there, first corners. All three corners, or twice as far:
/// as long.
const INDICES: usize = 4 * LANES;
const CORNERS: usize = 2 * LANES;

impl<T: Take + ?Sized, const AHEAD: bool> Kernel for Tell<'_, T, AHEAD> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { tile, mesh, to, first, is_large } = self;
        let (count, mesh) = (tile.count * RAYS, mesh.reader());
        if is_large && let Some(mut to) = to.aligned(first, count) {
            for ray in (0..count).step_by(LANES) {
                let mut hits = Eight::MISSES;
                tile.tell::<S, AHEAD>(simd, mesh, ray, &mut hits);
                to.set_eight(simd, ray, &hits);
            }
        } else {
            for ray in (0..count).step_by(LANES) {
                let mut hits = Eight::MISSES;
                tile.tell::<S, AHEAD>(simd, mesh, ray, &mut hits);
                to.take_eight(first + ray, &hits);
            }
        }
    }
}

impl Tile {
    /// Write the best hits of eight rays of the tile, from `first` on, over misses. To return them would copy them by
    /// vectors wider than those they were written by.
    #[inline(always)]
    fn tell<S: Simd, const AHEAD: bool>(&self, simd: S, mesh: Reader<'_>, first: usize, hits: &mut Eight) {
        if AHEAD {
            self.warm(simd, mesh, first);
        }
        let (quads, best) = self.winners(simd, first);
        // Of all these bits, those of MISS alone are not a number.
        let met = simd.le(best, best);
        if met != 0 {
            self.set_together(simd, mesh, quads, (best, met), hits);
        }
    }

    /// Ask for the triangles that are needed soon.
    #[inline(always)]
    fn warm<S: Simd>(&self, simd: S, mesh: Reader<'_>, first: usize) {
        let triangles: [u32; LANES] = bytemuck::cast(simd.store(self.winners(simd, first + INDICES).1));
        for triangle in triangles {
            mesh.warm_triangle(simd, triangle);
        }
        let triangles: [u32; LANES] = bytemuck::cast(simd.store(self.winners(simd, first + CORNERS).1));
        for triangle in triangles {
            mesh.warm_corners(simd, triangle);
        }
    }

    /// The triangles that eight rays from `first` on hit, as bits; behind the last ray, what stands there.
    #[inline(always)]
    fn winners<S: Simd>(&self, simd: S, first: usize) -> ([Quad; 2], S::F32) {
        let quads = [self.quad(first / QUAD), self.quad(first / QUAD + 1)];
        let [one, other] = quads;
        (quads, eight(simd, quads, [&self.groups[one.group].best, &self.groups[other.group].best]))
    }

    #[inline(always)]
    fn set_together<S: Simd>(
        &self,
        simd: S,
        mesh: Reader<'_>,
        quads: [Quad; 2],
        (best, met): (S::F32, u32),
        hits: &mut Eight,
    ) {
        let zero = simd.splat(0.0);
        let corners = self.corners(simd, mesh, quads, (best, met));
        let exact = self.exact(simd, quads, &corners);
        let [one, other] = quads;
        let scale = eight(simd, quads, [&self.exactly[one.group].scale, &self.exactly[other.group].scale]);
        let t = simd.mul(exact.t, scale);
        hits.primitive = bytemuck::cast(simd.store(best));
        hits.t = simd.store(simd.if_ge(best, zero, t, simd.splat(f32::INFINITY)));
        hits.u = simd.store(simd.if_ge(best, zero, exact.u, zero));
        hits.v = simd.store(simd.if_ge(best, zero, exact.v, zero));
    }
}
