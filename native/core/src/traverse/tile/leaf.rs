//! Blocks of triangles against groups of rays.

use super::{
    GROUPS, RAYS, ROUNDING,
    decide::Decide,
    pairs::{Pair, PairSet},
    rays::{Group, Tile},
};
use crate::{
    simd::{Arithmetic, Simd},
    triangle::{Block, LANES},
};

/// Eight triangles as planes through the origin. Axes are the tile's; see the module's text for the rest.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct Planes {
    /// Normals of the planes through the edges opposite to the corners, turned inwards for rays that meet the front.
    edge: [[[f32; LANES]; 3]; 3],
    /// Normals of the triangles, turned likewise.
    face: [[f32; LANES]; 3],
    /// Volumes V.
    volume: [f32; LANES],
    /// Edge functions up to this decide nothing.
    doubt: [f32; LANES],
    /// Depths are off by this over the determinant.
    blur: [f32; LANES],
}

type Vector<S> = [<S as Arithmetic>::F32; 3];

impl Planes {
    /// The planes of a block.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, simd: S, tile: &Tile, block: &Block) {
        let a = relative(simd, tile, &block.corner[0]);
        let b = relative(simd, tile, &block.corner[1]);
        let c = relative(simd, tile, &block.corner[2]);
        let opposite = [difference(simd, b, c), difference(simd, c, a), difference(simd, a, b)];
        let face = cross(simd, opposite[2], opposite[1]);
        let volume = dot(simd, face, a);
        let volume = simd.mul(volume, simd.splat(tile.sign));
        let zero = simd.splat(0.0);
        let side = simd.if_ge(volume, zero, simd.splat(1.0), simd.splat(-1.0));

        let mut extent = zero;
        for edge in opposite {
            extent = simd.max(largest(simd, edge), extent);
        }
        let reach = simd.add(largest(simd, a), extent);
        let tiny = simd.splat(f32::MIN_POSITIVE);
        let area = simd.mul(extent, reach);
        let blur = simd.mul_add(simd.mul(extent, area), simd.splat(tile.slack.blur), tiny);
        let doubt = simd.mul_add(area, simd.splat(tile.slack.doubt), tiny);
        let volume = simd.abs(volume);
        self.doubt = simd.store(simd.if_ge(volume, blur, doubt, simd.splat(f32::INFINITY)));
        self.blur = simd.store(blur);
        self.volume = simd.store(volume);
        store(simd, scaled(simd, face, side), &mut self.face);
        for (e, (p, q)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
            let sum = [simd.add(p[0], q[0]), simd.add(p[1], q[1]), simd.add(p[2], q[2])];
            store(simd, cross(simd, sum, scaled(simd, opposite[e], side)), &mut self.edge[e]);
        }
    }

    /// Test the first `count` triangles against groups. Three times all pairs that are left are gone through, so that what
    /// nobody can predict is asked once a block: how many are left. With branches for every group and triangle instead,
    /// camera rays took 1.06 (room) to 1.3 times as long (soup; in the mean 1.15, on Zen 5).
    #[inline(always)]
    pub fn test<S: Simd>(&self, simd: S, tile: &mut Tile, block: &Block, count: u32, groups: u32) {
        let (mut near, mut rest) = (PairSet::default(), groups);
        while rest != 0 {
            let group = rest.trailing_zeros() as usize % GROUPS;
            rest &= rest - 1;
            near.add(group, self.near(simd, tile, group) & ((1 << count) - 1));
        }
        tile.pairs.clear();
        while let Some(pair) = near.take() {
            let (least, is_possible) = self.inside(simd, &tile.groups[pair.group()], pair.lane());
            tile.pairs.push_if(is_possible, pair, least);
        }
        let (first, mut nearer) = (tile.held.begin(), 0);
        for index in 0..tile.pairs.len() {
            let (pair, &least) = tile.pairs.get(index);
            nearer |= u32::from(self.triangle(simd, tile, (pair, &least), block, first)) << pair.group();
        }
        tile.held.keep_if(nearer != 0);
        tile.approach(simd, nearer);
    }

    /// The triangles that may be met by some ray with slopes between those of a group. Those behind the group's farthest
    /// hit are not told apart: to find each triangle's nearest corner and compare it took 1.02 times as long (Zen 4). Nor are
    /// those whose rectangle of slopes misses the group's: to find and compare it spared scans a third of the tests and took
    /// 1/1.01 of the time (soup 1/1.08, vianney 1.04 times).
    #[inline(always)]
    fn near<S: Simd>(&self, simd: S, tile: &Tile, group: usize) -> u32 {
        let (spans, group) = (&tile.spans[group / LANES], group % LANES);
        let middle = [simd.splat(spans.middle[0][group]), simd.splat(spans.middle[1][group])];
        let half = [simd.splat(spans.half[0][group]), simd.splat(spans.half[1][group])];
        let mut least = simd.splat(f32::INFINITY);
        for edge in &self.edge {
            let [x, y, z] = [simd.load(&edge[0]), simd.load(&edge[1]), simd.load(&edge[2])];
            let most = simd.mul_add(x, middle[0], simd.mul_add(y, middle[1], z));
            let most = simd.mul_add(simd.abs(x), half[0], most);
            let most = simd.mul_add(simd.abs(y), half[1], most);
            least = simd.min(most, least);
        }
        simd.le(simd.splat(0.0), simd.add(least, simd.load(&self.doubt)))
    }

    /// The least edge function of every ray of a group at a triangle, and whether some ray may hit it.
    #[inline(always)]
    fn inside<S: Simd>(&self, simd: S, rays: &Group, lane: usize) -> ([f32; RAYS], bool) {
        let wide = simd.wide();
        let slope = [simd.load_wide(&rays.slope[0]), simd.load_wide(&rays.slope[1])];
        let mut least = wide.splat(f32::INFINITY);
        for edge in &self.edge {
            least = wide.min(value(wide, edge, lane, slope), least);
        }
        let possible = wide.le(wide.splat(0.0), wide.add(least, wide.splat(self.doubt[lane])));
        (simd.store_wide(least), possible != 0)
    }

    /// Test one triangle of a block, for whose first there is a place, against a group; true where some best hit came nearer.
    #[inline(always)]
    fn triangle<S: Simd>(
        &self,
        simd: S,
        tile: &mut Tile,
        (pair, least): (Pair, &[f32; RAYS]),
        block: &Block,
        first: usize,
    ) -> bool {
        let (wide, group, lane) = (simd.wide(), pair.group(), pair.lane());
        let rays = &tile.groups[group];
        let slope = [simd.load_wide(&rays.slope[0]), simd.load_wide(&rays.slope[1])];
        let (least, doubt) = (simd.load_wide(least), wide.splat(self.doubt[lane]));
        let possible = wide.le(wide.splat(0.0), wide.add(least, doubt));
        let nothing = wide.splat(f32::NAN);
        let determinant = value(wide, &self.face, lane, slope);
        let inverse = wide.div(wide.splat(1.0), determinant);
        let depth = wide.mul(wide.splat(self.volume[lane]), inverse);
        let error = wide.mul_add(depth, wide.splat(8.0 * ROUNDING), wide.mul(wide.splat(self.blur[lane]), inverse));
        let error = wide.if_ge(determinant, wide.mul(doubt, wide.splat(1.5)), error, nothing);
        let (from, to) = (wide.sub(depth, error), wide.add(depth, error));
        let (near, low) = (simd.load_wide(&rays.near), simd.load_wide(&rays.low));
        let (high, best) = (simd.load_wide(&rays.high), simd.load_wide(&rays.best));
        let certain = wide.if_ge(from, near, wide.if_ge(least, doubt, to, nothing), nothing);
        let accepted = wide.le(certain, low);
        let beyond = wide.le(high, from) | wide.le(to, near);
        let place = (first + lane) as u32;
        // Also where none is accepted, which nobody can predict.
        tile.held.set(block, lane);
        let rays = &mut tile.groups[group];
        rays.low = simd.store_wide(wide.if_ge(low, certain, from, low));
        rays.high = simd.store_wide(wide.if_ge(low, certain, to, high));
        rays.best = simd.store_wide(wide.if_ge(low, certain, wide.splat(f32::from_bits(place)), best));
        let unclear = possible & !accepted & !beyond;
        let decided = unclear != 0 && simd.run(Decide { tile, group, lanes: unclear, block, triangle: lane, place });
        decided || accepted != 0
    }
}

#[inline(always)]
fn relative<S: Simd>(simd: S, tile: &Tile, corner: &[[f32; LANES]; 3]) -> Vector<S> {
    let [x, y, z] = tile.axes;
    let origin = tile.origin;
    [
        simd.sub(simd.load(&corner[x]), simd.splat(origin[x])),
        simd.sub(simd.load(&corner[y]), simd.splat(origin[y])),
        simd.sub(simd.load(&corner[z]), simd.splat(origin[z])),
    ]
}

/// q - p
#[inline(always)]
fn difference<S: Simd>(simd: S, q: Vector<S>, p: Vector<S>) -> Vector<S> {
    [simd.sub(q[0], p[0]), simd.sub(q[1], p[1]), simd.sub(q[2], p[2])]
}

#[inline(always)]
fn scaled<S: Simd>(simd: S, v: Vector<S>, by: S::F32) -> Vector<S> {
    [simd.mul(v[0], by), simd.mul(v[1], by), simd.mul(v[2], by)]
}

#[inline(always)]
fn cross<S: Simd>(simd: S, p: Vector<S>, q: Vector<S>) -> Vector<S> {
    [
        simd.mul_sub(p[1], q[2], simd.mul(p[2], q[1])),
        simd.mul_sub(p[2], q[0], simd.mul(p[0], q[2])),
        simd.mul_sub(p[0], q[1], simd.mul(p[1], q[0])),
    ]
}

#[inline(always)]
fn dot<S: Simd>(simd: S, p: Vector<S>, q: Vector<S>) -> S::F32 {
    simd.mul_add(p[0], q[0], simd.mul_add(p[1], q[1], simd.mul(p[2], q[2])))
}

#[inline(always)]
fn largest<S: Simd>(simd: S, v: Vector<S>) -> S::F32 {
    simd.max(simd.max(simd.abs(v[0]), simd.abs(v[1])), simd.abs(v[2]))
}

#[inline(always)]
fn store<S: Simd>(simd: S, v: Vector<S>, to: &mut [[f32; LANES]; 3]) {
    *to = [simd.store(v[0]), simd.store(v[1]), simd.store(v[2])];
}

/// The product of a normal and some directions.
#[inline(always)]
fn value<S: Arithmetic>(simd: S, normal: &[[f32; LANES]; 3], lane: usize, slope: [S::F32; 2]) -> S::F32 {
    let [x, y, z] = [simd.splat(normal[0][lane]), simd.splat(normal[1][lane]), simd.splat(normal[2][lane])];
    simd.mul_add(x, slope[0], simd.mul_add(y, slope[1], z))
}
