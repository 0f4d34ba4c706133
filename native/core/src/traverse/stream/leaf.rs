//! A block of triangles against the rays of a list, sixteen at once: one triangle after another, by the arithmetic that
//! one ray has with eight triangles, so that single precision decides as much. Which rays may hit which triangles is
//! found out first, without a branch, and then where.

use super::{
    Bin,
    rays::{RAYS, Sixteen},
};
use crate::{
    Mesh,
    simd::{Arithmetic, Simd},
    traverse::{
        crossing::{Sheared, Stored},
        leaf::Best,
    },
    triangle::{Block, LANES},
};

/// Fewer rays than this take less time one by one, against eight triangles each. With AVX-512, bounces took as long with
/// 8 and 16 as with 12, and 1.1 times as long on the dragon and in the soup with 5.
pub const FEW: usize = 12;

/// Room for a block's triangles before sixteen rays.
pub type Memory = [Stored; LANES];

/// The triangles of a leaf.
pub struct Leaf<'a> {
    pub mesh: &'a Mesh,
    pub block: &'a Block,
    /// Triangles in the block.
    pub count: u32,
}

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
        let corners = Corners::new(simd, self.block);
        while list.len() >= FEW {
            let (first, rest) = list.split_at(list.len().min(RAYS));
            self.sixteen::<S, ANY>(simd, &corners, first, bin, memory);
            list = rest;
        }
        list
    }

    #[inline(always)]
    fn sixteen<S: Simd, const ANY: bool>(
        &self,
        simd: S,
        corners: &Corners,
        list: &[u16],
        bin: &mut Bin,
        memory: &mut Memory,
    ) {
        let wide = simd.wide();
        let mut rays = Sixteen::new(simd, bin, list);
        let mut going = ((1 << list.len()) - 1) & wide.le(rays.tmin, rays.high);
        let (mut candidates, mut triangles) = ([0; LANES], 0);
        for triangle in 0..(self.count as usize).min(LANES) {
            let sheared = Sheared::new(wide, corners.in_order(wide, triangle, rays.axes), rays.origin, rays.shear);
            sheared.store(simd, &mut memory[triangle]);
            candidates[triangle] = going & !sheared.missed(wide);
            triangles |= u32::from(candidates[triangle] != 0) << triangle;
        }
        let mut changed = 0;
        while triangles != 0 {
            let triangle = triangles.trailing_zeros() as usize & (LANES - 1);
            triangles &= triangles - 1;
            let sheared = Sheared::load(simd, &memory[triangle]);
            let crossings = sheared.cross(wide, rays.steepness, rays.tmin, rays.high);
            let candidates = going & candidates[triangle] & !crossings.outside;
            let nearer = if ANY { u32::MAX } else { !wide.le(rays.low, crossings.high) };
            let hit = candidates & crossings.sure & nearer;
            let primitive = wide.splat(f32::from_bits(self.block.primitive[triangle]));
            rays.primitive = wide.select(hit, primitive, rays.primitive);
            if ANY {
                going &= !hit;
            } else {
                rays.low = wide.select(hit, crossings.low, rays.low);
                rays.high = wide.select(hit, crossings.high, rays.high);
            }
            changed |= hit;
            let unclear = candidates & !hit;
            if unclear != 0 {
                rays.write::<ANY>(simd, bin, changed);
                let decided = self.decide::<S, ANY>(&rays, bin, triangle, unclear);
                rays.read(simd, bin);
                changed = 0;
                if ANY {
                    going &= !decided;
                }
            }
            if ANY && going == 0 {
                break;
            }
        }
        rays.write::<ANY>(simd, bin, changed);
    }

    /// Ask the exact test of one triangle and the rays of some lanes; tells which of them hit it.
    #[cold]
    #[inline(never)]
    fn decide<S: Simd, const ANY: bool>(&self, rays: &Sixteen<S>, bin: &mut Bin, triangle: usize, lanes: u32) -> u32 {
        let (mut rest, mut hits) = (lanes, 0);
        while rest != 0 {
            let lane = rest.trailing_zeros();
            rest &= rest - 1;
            let id = rays.id(lane);
            let frame = &bin.frames[id];
            if let Some(hit) = self.block.intersect(triangle, frame) {
                let best = bin.hits[id].best().or(Best::exactly(&hit), frame, self.mesh);
                bin.keep::<ANY>(id, best);
                hits |= 1 << lane;
            }
        }
        hits
    }
}

/// A triangle's corners, and a number behind each.
type Rows = [[[f32; 4]; 2]; LANES];

/// Where the corners of a block's triangles are: the first two, then the third.
struct Corners(Rows, Rows);

impl Corners {
    #[inline(always)]
    fn new<S: Simd>(simd: S, block: &Block) -> Self {
        let [a, b, c] = [&block.corner[0], &block.corner[1], &block.corner[2]];
        Self(rows(simd, [a, b]), rows(simd, [c, c]))
    }

    /// One triangle's, each in the order of every ray's axes.
    #[inline(always)]
    fn in_order<W: Arithmetic>(&self, wide: W, triangle: usize, axes: [W::F32; 3]) -> [[W::F32; 3]; 3] {
        let ([a, b], [c, _]) = (&self.0[triangle & (LANES - 1)], &self.1[triangle & (LANES - 1)]);
        [in_order(wide, a, axes), in_order(wide, b, axes), in_order(wide, c, axes)]
    }
}

#[inline(always)]
fn rows<S: Simd>(simd: S, [a, b]: [&[[f32; LANES]; 3]; 2]) -> Rows {
    let (a, b) = (
        [simd.load(&a[0]), simd.load(&a[1]), simd.load(&a[2])],
        [simd.load(&b[0]), simd.load(&b[1]), simd.load(&b[2])],
    );
    let transposed = simd.transpose([a[0], a[1], a[2], a[2], b[0], b[1], b[2], b[2]]);
    let mut rows = [[[0.0; 4]; 2]; LANES];
    for lane in 0..LANES {
        rows[lane] = bytemuck::cast(simd.store(transposed[lane]));
    }
    rows
}

#[inline(always)]
fn in_order<W: Arithmetic>(wide: W, row: &[f32; 4], [x, y, z]: [W::F32; 3]) -> [W::F32; 3] {
    [wide.pick(row, x), wide.pick(row, y), wide.pick(row, z)]
}
