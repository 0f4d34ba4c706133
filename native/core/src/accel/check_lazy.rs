//! What every lazy cell must satisfy: it becomes a subtree that holds its triangles, each once.

use super::{
    check::{assert_contains, assert_leaf, triangle_bounds},
    structure::{NodeRef, Structure, Target, View},
};
use crate::{Mesh, bounds::Bounds};

/// Refine a cell, and give the triangles of its subtree.
///
/// # Panics
/// With what is wrong.
pub(super) fn assert_cell(structure: &Structure, mesh: &Mesh, cell: usize, bounds: &Bounds) -> Vec<u32> {
    let refined = structure.lazy.refine(cell, mesh).expect("memory for a lazy cell");
    let mut triangles = assert_subtree(structure, mesh, refined.view(), refined.root, bounds);
    triangles.sort_unstable();
    let mut listed = structure.lazy.triangles(cell).to_vec();
    listed.sort_unstable();
    assert_eq!(triangles, listed, "the triangles of lazy cell {cell}");
    triangles
}

fn assert_subtree(structure: &Structure, mesh: &Mesh, view: View<'_>, root: NodeRef, bounds: &Bounds) -> Vec<u32> {
    match root.target() {
        Target::Branch(index) => {
            let node = &view.nodes[index as usize];
            assert!(node.len() >= 2, "node {index} of a lazy cell has {} children", node.len());
            let below = (0..node.len()).flat_map(|lane| {
                assert_contains(bounds, &node.bounds(lane));
                assert_subtree(structure, mesh, view, node.child[lane], &node.bounds(lane))
            });
            below.collect()
        }
        Target::Leaf { block, count } => {
            let triangles = assert_leaf(view, mesh, block as usize, count as usize);
            for &triangle in &triangles {
                assert_contains(bounds, &triangle_bounds(structure, mesh, triangle));
            }
            triangles
        }
        _ => panic!("{:?} in a lazy cell", root.target()),
    }
}
