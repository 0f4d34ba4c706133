//! The rays of a tile, and what is known of each.

use bytemuck::Zeroable;
use glam::{Vec3, Vec3A};

use super::{BLOCKS, GROUPS, RAYS, Slack, held::Held, pairs::Pairs, spans::Spans};
use crate::traverse::frame::{self, Domain, Frame};

/// Rays along a side of a square group.
pub const QUAD: usize = 4;

/// Four rays of a group that follow each other in the batch.
#[derive(Debug, Clone, Copy)]
pub struct Quad {
    pub group: usize,
    /// Its number in the group.
    pub quad: usize,
}

/// Sixteen rays, as boxes and triangles meet them. Depths are along the tile's axis, from the origin.
#[derive(Debug, Clone, Copy, Zeroable)]
#[repr(C, align(64))]
pub struct Group {
    /// Direction over its component along the axis.
    pub slope: [[f32; RAYS]; 2],
    /// Hits before this depth do not count.
    pub near: [f32; RAYS],
    /// Hits up to this depth are certainly before the best one, or the end of the interval.
    pub low: [f32; RAYS],
    /// Hits from this depth on are certainly behind the best one, or the end of the interval.
    pub high: [f32; RAYS],
    /// The place of the best hit's triangle among those [`held`](Tile::held), or [`MISS`](crate::ray::MISS), as bits that no
    /// vector operation changes.
    pub best: [f32; RAYS],
}

/// Sixteen rays, as the exact test needs them.
#[derive(Debug, Clone, Copy, Zeroable)]
#[repr(C, align(64))]
pub struct Exactly {
    /// See [`Frame::direction`].
    pub direction: [[f32; RAYS]; 3],
    /// See [`Frame::tmin`] and [`Frame::tmax`].
    pub interval: [[f32; RAYS]; 2],
    /// From the frame's units to the ray's.
    pub scale: [f32; RAYS],
}

/// Up to 256 consecutive rays of a batch that start at one point in similar directions. Boxed by its owner.
pub struct Tile {
    /// Groups in use.
    pub count: usize,
    /// Quads in the rows of rays that groups are squares of, as a power of two; 0 where groups are sixteen that follow each
    /// other in the batch. Squares meet fewer boxes and triangles than strips of one or two rows.
    pub(super) across: u32,
    /// Axes x, y and z; rays go along z, and the others follow in cyclic order.
    pub axes: [usize; 3],
    /// Whether rays rise (1) or fall (-1) along z.
    pub sign: f32,
    /// The common origin.
    pub origin: [f32; 3],
    /// The origin relative to the centre of the domain.
    pub local: Vec3,
    /// Largest component of that.
    pub reach: f32,
    /// Half of the longest edge of the scene's box.
    pub half_extent: f32,
    /// Signs of the first ray's direction, for the order of visits.
    pub octant: usize,
    /// Groups in which some ray is steeper along another axis.
    pub slanted: u32,
    /// How far single precision is trusted.
    pub slack: Slack,
    /// Least slopes.
    pub low: [f32; 2],
    /// Greatest slopes.
    pub high: [f32; 2],
    /// How far rays are from their neighbours where they make a square.
    pub step: [f32; 2],
    /// The farthest best hit.
    pub far: f32,
    /// The rays.
    pub groups: [Group; GROUPS],
    /// The same rays.
    pub exactly: [Exactly; GROUPS],
    pub(super) domain: Domain,
    /// What groups have in common, eight by eight.
    pub spans: [Spans; BLOCKS],
    /// The triangles of the best hits.
    pub held: Held,
    /// Room for the tests of a block.
    pub pairs: Pairs,
}

impl Default for Tile {
    fn default() -> Self {
        Self {
            count: 0,
            across: 0,
            axes: [0, 1, 2],
            sign: 1.0,
            origin: [0.0; 3],
            local: Vec3::ZERO,
            reach: 0.0,
            half_extent: 0.0,
            octant: 0,
            slanted: 0,
            slack: Slack::STEEP,
            low: [0.0; 2],
            high: [0.0; 2],
            step: [0.0; 2],
            far: 0.0,
            groups: [Group::zeroed(); GROUPS],
            exactly: [Exactly::zeroed(); GROUPS],
            domain: Domain { centre: Vec3::ZERO, half_extent: 0.0 },
            spans: [Spans::NOTHING; BLOCKS],
            held: Held::default(),
            pairs: Pairs::NONE,
        }
    }
}

impl Tile {
    /// Where four rays that follow each other in the batch are, by their number in the tile.
    #[inline(always)]
    pub fn quad(&self, number: usize) -> Quad {
        let (row, column) = (number >> self.across, number & ((1 << self.across) - 1));
        Quad { group: (((row / QUAD) << self.across) + column) % GROUPS, quad: row % QUAD }
    }

    /// The frame of a ray.
    pub fn frame(&self, group: usize, lane: usize) -> Frame {
        let Exactly { direction, interval: [tmin, tmax], scale } = &self.exactly[group];
        let direction = Vec3A::from_array(direction.map(|axis| axis[lane]));
        let interval = (tmin[lane], tmax[lane]);
        let mut frame = Frame::zeroed();
        let (origin, place) = (Vec3A::from(self.origin), (self.local.into(), self.reach));
        let directions = (direction, frame::inverse(direction, 1.0), direction.abs().max_element());
        frame.set_near(origin, place, directions, interval, &self.domain);
        frame.scale = scale[lane];
        frame
    }
}
