//! A block of triangles against the rays of a list: sixteen rays at once, one triangle after another, or, where they are
//! few, one ray against all triangles. Of sixteen, [`weights`] tells without a branch which may hit which triangle, and
//! then where; what that leaves open [`crossing`] decides, as for one ray, and what is left then the exact test.
//!
//! [`weights`]: crate::traverse::weights
//! [`crossing`]: crate::traverse::crossing

use super::{
    Bin,
    rays::{RAYS, Sixteen},
};
use crate::{
    Mesh,
    simd::{Arithmetic, Simd},
    traverse::{
        crossing::{Crossings, Sheared},
        leaf::Best,
        weights::{Triangles, Weights},
    },
    triangle::{Block, LANES},
};

/// Fewer rays than this take less time one by one, against eight triangles each. With AVX-512, bounces took 1/1.01 of the
/// time of 12 (bunny2 1/1.03, room 1/1.04; Sponza 1.02 times), and as long with 4 (1.01 times).
pub const FEW: usize = 6;

/// The triangles of a leaf.
pub struct Leaf<'a> {
    pub mesh: &'a Mesh,
    pub block: &'a Block,
    /// Triangles in the block.
    pub count: u32,
}

/// What is known of a triangle before sixteen rays, for a second look.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub struct Seen {
    least: [f32; RAYS],
    determinant: [f32; RAYS],
    side: [f32; RAYS],
    doubt: [f32; RAYS],
}

/// Room for a block's triangles.
pub type Memory = [Seen; LANES];

impl Leaf<'_> {
    /// Test the triangles against the rays of a list, sixteen by sixteen; returns those that are left, fewer than [`FEW`].
    #[inline(always)]
    pub fn test<'a, S: Simd, const ANY: bool>(
        &self,
        simd: S,
        mut list: &'a [u16],
        bin: &mut Bin,
        memory: &mut Memory,
    ) -> &'a [u16] {
        if list.len() < FEW {
            return list;
        }
        let [x, y, z] = &self.block.corner[0];
        let from = [x[0], y[0], z[0]];
        let triangles = Triangles::new(simd, self.block, from);
        while list.len() >= FEW {
            let (first, rest) = list.split_at(list.len().min(RAYS));
            self.sixteen::<S, ANY>(simd, (&triangles, from), first, bin, memory);
            list = rest;
        }
        list
    }

    #[inline(always)]
    fn sixteen<S: Simd, const ANY: bool>(
        &self,
        simd: S,
        (triangles, from): (&Triangles, [f32; 3]),
        list: &[u16],
        bin: &mut Bin,
        memory: &mut Memory,
    ) {
        let wide = simd.wide();
        let mut rays = Sixteen::new(simd, bin, list);
        let away = rays.away(wide, from);
        let mut going = ((1 << list.len()) - 1) & wide.le(rays.tmin, rays.high);
        let (mut candidates, mut rest) = ([0; LANES], 0);
        for lane in 0..(self.count as usize).min(LANES) {
            let weights = triangles.weigh(wide, lane, (rays.origin, rays.direction), away);
            candidates[lane] = wide.le(wide.splat(0.0), wide.add(weights.least, weights.doubt));
            rest |= u32::from(candidates[lane] & going != 0) << lane;
            memory[lane] = Seen {
                least: simd.store_wide(weights.least),
                determinant: simd.store_wide(weights.determinant),
                side: simd.store_wide(weights.side),
                doubt: simd.store_wide(weights.doubt),
            };
        }
        let mut changed = 0;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize & (LANES - 1);
            rest &= rest - 1;
            let weights = memory[lane].weights(simd);
            let depth = (triangles.depth(wide, lane, rays.origin, weights.side), triangles.blur(wide, lane, away));
            let crossings = weights.cross(wide, depth, (rays.tmin, rays.high));
            let mut unclear = going & candidates[lane] & !crossings.outside;
            let mut hit = rays.take::<_, ANY>(wide, unclear, &crossings, self.block.primitive[lane]);
            unclear &= !hit;
            if unclear != 0 {
                let (crossings, missed) = self.look_again(simd, bin, &rays, lane);
                unclear &= !(missed | crossings.outside);
                let more = rays.take::<_, ANY>(wide, unclear, &crossings, self.block.primitive[lane]);
                unclear &= !more;
                hit |= more;
            }
            changed |= hit;
            if unclear != 0 {
                rays.write::<ANY>(simd, bin, changed);
                hit |= self.decide::<S, ANY>(&rays, bin, lane, unclear);
                rays.read(simd, bin);
                changed = 0;
            }
            if ANY {
                going &= !hit;
                if going == 0 {
                    break;
                }
            }
        }
        rays.write::<ANY>(simd, bin, changed);
    }

    /// The crossings with one triangle by the arithmetic of the single ray, and which rays surely miss it.
    #[inline(always)]
    fn look_again<S: Simd>(&self, simd: S, bin: &Bin, rays: &Sixteen<S>, lane: usize) -> (Crossings<S::Wide>, u32) {
        let wide = simd.wide();
        let (shear, axes) = rays.shear(simd, bin);
        let sheared = Sheared::new(wide, self.block.corners(lane).each_ref(), rays.origin, axes, shear);
        (sheared.cross(wide, rays.steepness, rays.tmin, rays.high), sheared.missed(wide))
    }

    /// Ask the exact test of one triangle and the rays of some lanes; tells which of them hit it.
    #[cold]
    #[inline(never)]
    fn decide<S: Simd, const ANY: bool>(&self, rays: &Sixteen<S>, bin: &mut Bin, lane: usize, of: u32) -> u32 {
        let (mut rest, mut hits) = (of, 0);
        while rest != 0 {
            let ray = rest.trailing_zeros();
            rest &= rest - 1;
            if self.decide_one::<ANY>(bin, rays.id(ray), lane) {
                hits |= 1 << ray;
            }
        }
        hits
    }

    /// The same for one ray.
    #[cold]
    #[inline(never)]
    fn decide_one<const ANY: bool>(&self, bin: &mut Bin, id: usize, lane: usize) -> bool {
        let frame = &bin.frame(id);
        let hit = self.block.intersect(lane, frame);
        if let Some(hit) = &hit {
            let best = bin.best(id).or(Best::exactly(hit), frame, self.mesh);
            bin.keep::<ANY>(id, best);
        }
        hit.is_some()
    }

    /// Test the triangles against one ray: what [`Search`](crate::traverse::leaf::Search) does, from two lines that lie
    /// apart. Copied to one frame for it, they made this take a fifth of the time of bunny2's bounces, and a tenth before.
    #[inline(always)]
    pub fn one<S: Simd, const ANY: bool>(&self, simd: S, bin: &mut Bin, id: usize) {
        if bin.has_ended(id) {
            return;
        }
        let (slabs, shears) = (&bin.slabs()[id], &bin.shears()[id]);
        let sheared = Sheared::of_block(simd, shears, self.block);
        let mut candidates = !sheared.missed(simd) & ((1 << self.count) - 1);
        if candidates == 0 {
            return;
        }
        let (tmin, tmax) = (simd.splat(slabs.tmin), simd.splat(slabs.tmax));
        let crossings = sheared.cross(simd, simd.splat(shears.steepness), tmin, tmax);
        candidates &= !crossings.outside;
        let (low, high) = (simd.store(crossings.low), simd.store(crossings.high));
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize & (LANES - 1);
            candidates &= candidates - 1;
            let best = bin.best(id);
            let is_sure = crossings.sure >> lane & 1 == 1;
            let hit = if is_sure && (ANY || high[lane] < best.low) {
                let hit = Best { low: low[lane], high: high[lane], primitive: self.block.primitive[lane] };
                bin.keep::<ANY>(id, hit);
                true
            } else if low[lane] > best.high {
                false
            } else {
                self.decide_one::<ANY>(bin, id, lane)
            };
            if ANY && hit {
                return;
            }
        }
    }
}

impl Seen {
    #[inline(always)]
    fn weights<S: Simd>(&self, simd: S) -> Weights<S::Wide> {
        let Self { least, determinant, side, doubt } = self;
        Weights {
            least: simd.load_wide(least),
            determinant: simd.load_wide(determinant),
            side: simd.load_wide(side),
            doubt: simd.load_wide(doubt),
        }
    }
}
