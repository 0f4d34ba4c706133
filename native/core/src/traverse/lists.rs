//! Grids whose cells list triangles, but are no boxes side by side: merged cells, and tetrahedra.
//!
//! Each kind has a walk of its own that tells list after list. None does anything eightfold, so one function of each
//! serves all instruction sets.

use super::{irregular, leaf::Search, probe::Probe, tetrahedra};
use crate::{
    accel::structure::{Structure, Target},
    simd::Simd,
};

/// Search a grid; true once there is any hit, where `ANY` is wanted.
#[inline(always)]
pub fn walk<S: Simd, P: Probe, const ANY: bool>(
    search: &mut Search<'_, S, P>,
    structure: &Structure,
    target: Target,
) -> bool {
    let mut walk = match target {
        Target::Irregular(index) => {
            irregular::Walk::new(search.frame, structure, index, search.best.high).map(Walk::Irregular)
        }
        Target::Tetrahedral(index) => {
            tetrahedra::Walk::new(search.frame, structure, index, search.best.high).map(Walk::Tetrahedra)
        }
        _ => None,
    };
    while let Some(list) = walk.as_mut().and_then(|walk| walk.next(search.probe, search.best.high)) {
        if search.gather::<ANY>(list) {
            return true;
        }
    }
    false
}

enum Walk<'a> {
    Irregular(irregular::Walk<'a>),
    Tetrahedra(tetrahedra::Walk<'a>),
}

impl<'a> Walk<'a> {
    /// The triangles of the next cell that has any and that the ray reaches before `limit`.
    #[inline(always)]
    fn next<P: Probe>(&mut self, probe: &mut P, limit: f32) -> Option<&'a [u32]> {
        match self {
            Self::Irregular(walk) => walk.next(probe, limit),
            Self::Tetrahedra(walk) => walk.next(probe, limit),
        }
    }
}
