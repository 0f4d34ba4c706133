//! Grids whose cells are nodes. A cell's node is searched by the loop of [`super::kernel`], and the walk is resumed
//! afterwards: as every crossing is computed from its plane (see [`super::dda`]), a walk is nothing but the cell it is
//! in, and waits as two entries of the stack, a [`Target::Resume`] above that cell. They are passed over like any other
//! where the best hit lies before the cell's end: a hit in what a cell holds may lie beyond the cell, and counts only
//! if no other cell before it has a nearer one.

use super::{dda::Walk, frame::Frame, kernel::Entry, probe::Probe};
use crate::accel::structure::{NodeRef, Structure, Target};

/// The next cell's node that the ray reaches before `limit`, from where a walk begins or waits, `depth` entries up the
/// stack. One function for all instruction sets: there is nothing to do eightfold.
#[inline(never)]
pub fn next<P: Probe>(
    (frame, probe, limit): (&Frame, &mut P, f32),
    structure: &Structure,
    target: Target,
    stack: &mut [Entry],
    depth: &mut usize,
) -> Option<NodeRef> {
    let nests = &structure.lattices.nests;
    let (nest, resumed) = match target {
        Target::Nest(nest) => (nest, None),
        Target::Resume(nest) => {
            *depth -= 1;
            (nest, Some(stack[*depth].node.cell()))
        }
        _ => return None,
    };
    let grid = &nests[nest as usize];
    let mut walk = match resumed {
        None => Walk::new(frame, grid, frame.enter(&grid.lower, &grid.upper, limit)?),
        Some(cell) => {
            let mut walk = Walk::at(cell, frame, grid);
            walk.advance(walk.next_axis(), frame, grid).then_some(walk)?
        }
    };
    let children = structure.lattices.children(grid);
    loop {
        probe.step();
        let child = children[walk.index as usize];
        let axis = walk.next_axis();
        let near = walk.crossing[axis];
        if child != NodeRef::EMPTY {
            stack[*depth] = Entry { near, node: NodeRef::of_cell(walk.cell) };
            stack[*depth + 1] = Entry { near, node: NodeRef::resume(nest) };
            *depth += 2;
            return Some(child);
        }
        if limit < near || !walk.advance(axis, frame, grid) {
            return None;
        }
    }
}
