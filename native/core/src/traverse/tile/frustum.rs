//! Boxes as a tile's rays see them: rectangles of slopes, and the depth at which they begin.
//!
//! A rectangle contains the slopes of all rays that meet the box in front of the origin: x / z is least, and greatest,
//! in a corner. Boxes are dilated as for any other ray, by [`DILATION`]; that covers what the exact test may see
//! otherwise (11uR), the rounding of planes (3uR), and that of the slopes (4u, where the dilation makes 32u).

use super::rays::Tile;
use crate::{accel::structure::Node, simd::Simd, traverse::frame::DILATION, triangle::LANES};

/// The part of a box nearer than this counts as this far: it makes every slope of a box around the origin huge.
const NEAREST: f32 = 1e-25;

/// A tile's constants for projecting boxes.
pub struct Projector<S: Simd> {
    sign: S::F32,
    /// Planes that give the least and the greatest depth, and those that give the least and greatest slopes.
    depth_planes: [usize; 2],
    slope_planes: [[usize; 2]; 2],
    depth_bias: [S::F32; 2],
    slope_bias: [[S::F32; 2]; 2],
}

/// The boxes of a node's children.
pub struct Boxes {
    /// Those that the tile meets.
    pub met: u32,
    /// Least depth.
    pub near: [f32; LANES],
    /// Least slopes.
    pub low: [[f32; LANES]; 2],
    /// Greatest slopes.
    pub high: [[f32; LANES]; 2],
}

impl<S: Simd> Projector<S> {
    #[inline(always)]
    pub fn new(simd: S, tile: &Tile) -> Self {
        let margin = DILATION * (tile.reach + tile.half_extent) + f32::MIN_POSITIVE;
        let [x, y, z] = tile.axes;
        let (local, sign) = (tile.local, tile.sign);
        let planes = |axis: usize| if sign > 0.0 { [axis, axis + 3] } else { [axis + 3, axis] };
        let depth_bias = [-sign * local[z] - margin, -sign * local[z] + margin];
        let sides = |axis: usize| [-sign * margin - local[axis], sign * margin - local[axis]];
        Self {
            sign: simd.splat(sign),
            depth_planes: planes(z),
            slope_planes: [planes(x), planes(y)],
            depth_bias: pair(simd, depth_bias),
            slope_bias: [pair(simd, sides(x)), pair(simd, sides(y))],
        }
    }

    /// The boxes of a node's children, and which of them the tile's frustum meets.
    #[inline(always)]
    pub fn boxes(&self, simd: S, tile: &Tile, node: &Node) -> Boxes {
        let near = simd.mul_add(simd.load(&node.plane[self.depth_planes[0]]), self.sign, self.depth_bias[0]);
        let far = simd.mul_add(simd.load(&node.plane[self.depth_planes[1]]), self.sign, self.depth_bias[1]);
        let in_front = simd.le(simd.splat(0.0), far);
        let nearest = simd.splat(NEAREST);
        let inverse = [simd.div(self.sign, simd.max(near, nearest)), simd.div(self.sign, simd.max(far, nearest))];
        let mut apart = simd.splat(f32::NEG_INFINITY);
        let [mut low, mut high] = [[apart; 2]; 2];
        for k in 0..2 {
            let [first, last] = self.slope_planes[k];
            let first = simd.add(simd.load(&node.plane[first]), self.slope_bias[k][0]);
            let last = simd.add(simd.load(&node.plane[last]), self.slope_bias[k][1]);
            low[k] = simd.min(simd.mul(first, inverse[0]), simd.mul(first, inverse[1]));
            high[k] = simd.max(simd.mul(last, inverse[0]), simd.mul(last, inverse[1]));
            apart = simd.max(simd.sub(low[k], simd.splat(tile.high[k])), apart);
            apart = simd.max(simd.sub(simd.splat(tile.low[k]), high[k]), apart);
        }
        Boxes {
            met: in_front & simd.le(apart, simd.splat(0.0)),
            near: simd.store(near),
            low: [simd.store(low[0]), simd.store(low[1])],
            high: [simd.store(high[0]), simd.store(high[1])],
        }
    }
}

#[inline(always)]
fn pair<S: Simd>(simd: S, [a, b]: [f32; 2]) -> [S::F32; 2] {
    [simd.splat(a), simd.splat(b)]
}
