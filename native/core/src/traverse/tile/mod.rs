//! Tiles: up to 256 rays of one origin walk the tree together as a bundle. Boxes and triangles are projected from the
//! origin once for all of them: a box becomes a rectangle of slopes, to be compared with those of groups of sixteen rays,
//! and a triangle three planes through the origin, so that each of its edge functions is two multiply-adds a ray.
//! After Wald, Slusallek, Benthin and Wagner, "Interactive Rendering with Coherent Ray Tracing", Eurographics 2001, and
//! Reshetov, Soupikov and Hurley, "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005.
//!
//! # What decides a hit
//! Nothing but [`triangle::intersect`](crate::triangle::intersect), yet it is rarely asked. A ray of direction d is
//! here its slopes s = d / d_z along the axis z of the tile; positions are relative to the origin, rounded as the exact
//! test rounds them. Write u = 2^-24, R for the largest coordinate of a triangle's corners, E for that of its edges.
//!
//! * *What the exact test may see otherwise.* Where z is the ray's steepest axis, its slopes are those of the exact
//!   test to the bit, and a sheared corner is off by one product and one difference: less than δ = 3uR in x and y. A
//!   ray may also be steeper along another axis, by at most 2: then its direction, and both roundings of it, differ by
//!   4u|d|, which moves corners by 8uR more, and shearing along z makes of that δ = 33uR.
//! * *Edge functions*, twice their value, are n·(s, 1) with n = (p + q) × (q - p), after Embree. In single precision
//!   n is off by 16uRE a component, and the function by 76uRE, with slopes up to 2 by 128uRE. The exact test's triangle
//!   lies within √2δ of this one, so it holds the ray (or not) with certainty where the ray is farther than that from
//!   every edge, inside (or from one, outside): where functions exceed the error by 2·√2δ·(edge), at most 24uRE, or
//!   400uRE. [`Slack::doubt`] exceeds the sums of both, and those of the cull by groups, whose sum of five terms is off
//!   by 60uRE instead of 28.
//! * *Facing.* Planes are turned so that the volume V = n_z·a of triangle and origin is positive; so rays that meet the
//!   plane in front have a positive determinant D = n·(s, 1), and functions all above zero. V is off by 40uE²R. If the
//!   exact test has a hit at t >= 0 where D is negative, then there is a point in front within √2δ of the ray on a plane
//!   that rises by at most 2√2E²/|D|, so V < 4δE², at most 132uE²R. Where V is less than [`Slack::blur`]·E²R, nothing
//!   is certain.
//! * *Depth* is z = V / D, off by 78uE²R/D; the exact test's triangle shifts it by at most 4/3·4δE²/D, if D exceeds
//!   1.5 times the doubt. [`Slack::blur`] is twice the sum of both.
//!
//! Of two candidates whose depths do not overlap with these errors the nearer wins; in every other case the exact test
//! decides at once. The winners' parameters and weights are computed at the end, by the exact arithmetic.

mod alone;
mod decide;
mod frustum;
mod gather;
mod held;
mod leaf;
mod pairs;
mod rays;
mod resolve;
mod spans;
mod tell;

use self::{
    alone::Alone,
    frustum::{Boxes, Projector},
    leaf::Planes,
};
use super::{frame::ROUNDING, kernel::Entry, stream};
use crate::{
    Mesh,
    accel::structure::{NodeRef, Structure, Target},
    simd::{Kernel, Simd},
    triangle::LANES,
};

pub use self::{gather::Gather, rays::Tile, tell::Tell};

/// Rays of a group.
pub const RAYS: usize = 16;

/// Groups of rays in a tile. In a prototype tiles of 16 and of 64 rays were slower than those of 256.
const GROUPS: usize = 16;

/// Groups whose slopes are compared with a box at once.
const BLOCKS: usize = GROUPS / LANES;

/// Tiles are used where half the scene's longest edge is in this range: outside, products of three lengths may leave
/// the range of single precision.
pub const EXTENTS: std::ops::RangeInclusive<f32> = 1e-9..=1e9;

/// See the module's text.
#[derive(Debug, Clone, Copy, Default)]
pub struct Slack {
    /// Edge functions within this share of R·E around zero decide nothing.
    doubt: f32,
    /// Depths are within this share of E²R over the determinant, and volumes of E²R itself.
    blur: f32,
}

impl Slack {
    /// Where the tile's axis is the steepest of every ray.
    const STEEP: Self = Self { doubt: 160.0 * ROUNDING, blur: 256.0 * ROUNDING };
    /// Where some rays are steeper along another one.
    const SLANTED: Self = Self { doubt: 640.0 * ROUNDING, blur: 1024.0 * ROUNDING };
}

/// A subtree to visit: its box as the rays see it, and the groups that may meet it.
#[derive(Debug, Clone, Copy)]
pub struct Visit {
    node: NodeRef,
    groups: u32,
    near: f32,
    low: [f32; 2],
    high: [f32; 2],
}

/// Most visits of a tile, eight a ray of a full one: a tile whose rays keep together makes some dozens, one that covers
/// much of a scene may make ten thousand, and streams trace its rays in a tenth of the time.
const MOST_VISITS: usize = 8 * GROUPS * RAYS;

/// The closest hits of a tile's rays, to be found; tells the number of visits, of which those of rays that go on one by one
/// are one each, or nothing where the others become [too many](MOST_VISITS): then the hits are not to be used. A kernel of
/// its own, as [`Gather`]: within the loop over a batch, camera rays took 1.03 times as long.
///
/// A part of the time goes by waiting for nodes and leaves: a second pass over the same tile, by which branches are learnt,
/// too, takes some 0.5 to 0.7 of the first. Two tiles that take turns at every node, so that what one has asked for arrives while the other is busy, took 1/1.03 to 1/1.05 of the time in
/// the dragon, stadium and room, and 1.00 to 1.07 times in seven other scenes; leaves that wait for the next leaf 1/1.04,
/// 1/1.06 and 1/1.01, and 1.00 to 1.02 times (Zen 5).
pub struct Trace<'a, const GRIDS: bool> {
    pub structure: &'a Structure,
    pub mesh: &'a Mesh,
    pub tile: &'a mut Tile,
    pub visits: &'a mut Vec<Visit>,
    pub stack: &'a mut [Entry],
}

impl<const GRIDS: bool> Kernel for Trace<'_, GRIDS> {
    type Output = Option<usize>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Option<usize> {
        let Self { structure, mesh, tile, visits, stack } = self;
        let projector = Projector::new(simd, tile);
        let mut planes = Planes::default();
        tile.held.clear();
        visits.clear();
        visits.push(tile.everything(structure.root));
        // Visits from `floor` up are in the lazy cell that the tile is in.
        let (mut here, mut floor, mut count, mut alone) = (structure.view(), 0, 0, 0);
        loop {
            if GRIDS && visits.len() == floor {
                (here, floor) = (structure.view(), 0);
            }
            let Some(visit) = visits.pop() else { return Some(count + alone) };
            count += 1;
            let mut groups = tile.meeting(simd, &visit);
            if tile.may_miss(&visit) {
                groups = tile.holding(simd, &visit, groups);
            }
            if groups == 0 {
                continue;
            }
            let mut node = visit.node;
            if GRIDS
                && let Target::Lazy(cell) = node.target()
                && let Some(cell) = structure.lazy.refine(cell as usize, mesh)
            {
                (here, floor, node) = (cell.view(), visits.len(), cell.root);
            }
            match node.target() {
                Target::Branch(_) if count > MOST_VISITS => return None,
                Target::Branch(index) => {
                    let node = &here.nodes[index as usize];
                    let boxes = projector.boxes(simd, tile, node);
                    let pushed = visits.len();
                    push(tile, &boxes, &node.child, node.order[tile.octant], groups, visits);
                    // Most children are visited; those that are not cost less than waiting for those that are.
                    for visit in &visits[pushed..] {
                        stream::warm(simd, here, visit.node);
                    }
                }
                Target::Leaf { block, count } => {
                    let block = &here.blocks[block as usize];
                    planes.set(simd, tile, block);
                    planes.test(simd, tile, block, count, groups);
                }
                _ => {
                    alone += groups.count_ones() as usize * RAYS;
                    let node = (here, node);
                    simd.run(Alone::<GRIDS> { tile, structure, mesh, node, groups, stack });
                }
            }
        }
    }
}

/// Remember the children that the tile meets, the nearest last.
#[inline(always)]
fn push(tile: &Tile, boxes: &Boxes, child: &[NodeRef; LANES], order: u32, groups: u32, visits: &mut Vec<Visit>) {
    let mut order = order;
    for _ in 0..LANES {
        let lane = (order & 7) as usize;
        order >>= 3;
        if boxes.met >> lane & 1 == 1 && boxes.near[lane] <= tile.far {
            let (low, high) = ([boxes.low[0][lane], boxes.low[1][lane]], [boxes.high[0][lane], boxes.high[1][lane]]);
            visits.push(Visit { node: child[lane], groups, near: boxes.near[lane], low, high });
        }
    }
}
