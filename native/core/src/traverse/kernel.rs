//! The loop: one ray against the whole structure, written once for every instruction set, probe, kind of query and
//! kind of node.

use super::{
    dda,
    frame::Frame,
    leaf::{Best, Search},
    lists, nest,
    probe::Probe,
};
use crate::{
    Mesh,
    accel::structure::{Node, NodeRef, Structure, Target, View},
    ray::Hit,
    simd::{Simd, guessed},
    triangle::LANES,
};

/// A subtree to visit, and where the ray enters it.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    pub(super) near: f32,
    pub(super) node: NodeRef,
}

impl Entry {
    /// Fills a stack.
    pub const NONE: Self = Self { near: f32::INFINITY, node: NodeRef::EMPTY };
}

/// A frame's constants in vectors, ready for node tests.
struct Planes<S: Simd> {
    sides: &'static [[Side; 3]; 2],
    inverse: [S::F32; 3],
    near_bias: [S::F32; 3],
    far_bias: [S::F32; 3],
    tmin: S::F32,
}

/// Where the planes of one side begin among the numbers of [`Node::plane`]. The compiler knows that no other number can
/// stand here, and so takes no test of the index.
#[derive(Debug, Clone, Copy)]
#[repr(usize)]
enum Side {
    LowerX = 0,
    LowerY = LANES,
    LowerZ = 2 * LANES,
    UpperX = 3 * LANES,
    UpperY = 4 * LANES,
    UpperZ = 5 * LANES,
}

/// For every octant, the sides that a ray meets first and those that it meets last, by axis.
const SIDES: &[[[Side; 3]; 2]; 8] = &{
    use Side::{LowerX, LowerY, LowerZ, UpperX, UpperY, UpperZ};
    let (mut sides, mut octant) = ([[[LowerX, LowerY, LowerZ], [UpperX, UpperY, UpperZ]]; 8], 0);
    while octant < 8 {
        let mut axis = 0;
        while axis < 3 {
            if octant >> axis & 1 == 1 {
                let [first, last] = sides[octant];
                (sides[octant][0][axis], sides[octant][1][axis]) = (last[axis], first[axis]);
            }
            axis += 1;
        }
        octant += 1;
    }
    sides
};

impl Side {
    /// Its planes.
    #[inline(always)]
    fn of(self, node: &Node) -> &[f32; LANES] {
        let planes: &[f32; 6 * LANES] = bytemuck::cast_ref(&node.plane);
        let (_, rest) = planes.split_at(self as usize);
        rest.first_chunk().expect("a side is a whole one")
    }
}

#[inline(always)]
fn splat<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> [S::F32; 3] {
    [simd.splat(x), simd.splat(y), simd.splat(z)]
}

impl<S: Simd> Planes<S> {
    #[inline(always)]
    fn new(simd: S, frame: &Frame) -> Self {
        Self {
            sides: &SIDES[frame.octant() & 7],
            inverse: splat(simd, frame.inverse),
            near_bias: splat(simd, frame.near_bias),
            far_bias: splat(simd, frame.far_bias),
            tmin: simd.splat(frame.tmin),
        }
    }

    /// The children that the ray meets before `limit`, and where.
    #[inline(always)]
    fn meet(&self, simd: S, node: &Node, limit: f32) -> (u32, [f32; LANES]) {
        let (mut near, mut far) = (self.tmin, simd.splat(limit));
        for k in 0..3 {
            let [first, last] = self.sides;
            let (first, last) = (simd.load(first[k].of(node)), simd.load(last[k].of(node)));
            near = simd.max(simd.mul_add(first, self.inverse[k], self.near_bias[k]), near);
            far = simd.min(simd.mul_add(last, self.inverse[k], self.far_bias[k]), far);
        }
        (simd.le(near, far), simd.store(near))
    }
}

/// The first hit along the ray in the frame's units, or, where `ANY`, some hit. `view` is the structure's own, and
/// `GRIDS` tells that it has grids.
#[inline(always)]
pub fn trace<S: Simd, P: Probe, const GRIDS: bool, const ANY: bool>(
    simd: S,
    (structure, view): (&Structure, View<'_>),
    mesh: &Mesh,
    frame: &Frame,
    stack: &mut [Entry],
    probe: &mut P,
) -> Hit {
    let mut search = Search::new(simd, frame, mesh, probe, Best::none(frame.tmax));
    trace_below::<S, P, GRIDS, ANY>(&mut search, structure, (view, structure.root), stack);
    search.answer::<ANY>()
}

/// Go on with a search below a node, which is one of those that `view` shows.
#[inline(always)]
pub fn trace_below<'a, S: Simd, P: Probe, const GRIDS: bool, const ANY: bool>(
    search: &mut Search<'a, S, P>,
    structure: &'a Structure,
    (view, node): (View<'a>, NodeRef),
    stack: &mut [Entry],
) {
    let simd = search.simd;
    let planes = Planes::new(simd, search.frame);
    // What lies on the stack from `floor` up is in the lazy cell that the search is in.
    let (mut here, mut floor) = (view, 0);
    let mut depth = 0;
    let mut current = node;
    loop {
        let found = match current.target() {
            Target::Branch(index) => {
                search.probe.step();
                let node = &here.nodes[index as usize];
                let (met, near) = planes.meet(simd, node, search.best.high);
                if met != 0 {
                    current = if ANY {
                        descend_anyhow(node, met, stack, &mut depth)
                    } else {
                        descend(node, met, &near, stack, &mut depth)
                    };
                    continue;
                }
                false
            }
            Target::Leaf { block, count } => search.block::<ANY>(&here.blocks[block as usize], count),
            Target::Grid(index) if GRIDS => dda::walk::<S, P, ANY>(search, structure, &structure.grids[index as usize]),
            Target::Lazy(index) if GRIDS => match structure.lazy.refine(index as usize, search.mesh) {
                Some(cell) => {
                    (here, floor, current) = (cell.view(), depth, cell.root);
                    continue;
                }
                None => search.gather::<ANY>(structure.lazy.triangles(index as usize)),
            },
            target @ (Target::Nest(_) | Target::Resume(_)) if GRIDS => {
                let ray = (search.frame, &mut *search.probe, search.best.high);
                if let Some(node) = nest::next(ray, structure, target, stack, &mut depth) {
                    current = node;
                    continue;
                }
                false
            }
            target @ (Target::Irregular(_) | Target::Tetrahedral(_)) if GRIDS => {
                lists::walk::<S, P, ANY>(search, structure, target)
            }
            _ => false,
        };
        if ANY && found {
            return;
        }
        current = loop {
            match pop(stack, &mut depth, floor, search.best.high) {
                Some(node) => break node,
                None if GRIDS && depth > 0 => (here, floor) = (view, 0),
                None => return,
            }
        };
    }
}

/// The nearest of the children met; the others go to the stack, the farthest first. With branches: the children of most
/// rays are guessed right, and the next node is read early. The others in the order of the octant, written all at once
/// without a branch (by permutation and compression of vectors), made single rays take 1.07 to 1.4 times as long.
#[inline(always)]
fn descend(node: &Node, met: u32, near: &[f32; LANES], stack: &mut [Entry], depth: &mut usize) -> NodeRef {
    let entry = |lane: usize| Entry { near: near[lane & 7], node: node.child[lane & 7] };
    let mut rest = met & (met - 1);
    let mut nearest = entry(guessed(met.trailing_zeros()));
    let base = *depth;
    while rest != 0 {
        let mut other = entry(guessed(rest.trailing_zeros()));
        rest &= rest - 1;
        if other.near < nearest.near {
            std::mem::swap(&mut other, &mut nearest);
        }
        let mut place = *depth;
        while place > base && stack[place - 1].near < other.near {
            stack[place] = stack[place - 1];
            place -= 1;
        }
        stack[place] = other;
        *depth += 1;
    }
    nearest.node
}

/// The largest of the children met; the others go to the stack, the smallest first. Where any hit will do, the nearest
/// is no better than another, and to sort them took up to 3.5% of the time.
#[inline(always)]
fn descend_anyhow(node: &Node, met: u32, stack: &mut [Entry], depth: &mut usize) -> NodeRef {
    let mut rest = met & (met - 1);
    while rest != 0 {
        let lane = rest.ilog2() as usize;
        rest &= !(1 << lane);
        stack[*depth] = Entry { near: f32::NEG_INFINITY, node: node.child[lane & 7] };
        *depth += 1;
    }
    node.child[met.trailing_zeros() as usize & 7]
}

/// The last entry from `floor` up that the ray still reaches before `limit`.
#[inline(always)]
fn pop(stack: &[Entry], depth: &mut usize, floor: usize, limit: f32) -> Option<NodeRef> {
    while *depth > floor {
        *depth -= 1;
        let entry = stack[*depth];
        if entry.near <= limit {
            return Some(entry.node);
        }
    }
    None
}
