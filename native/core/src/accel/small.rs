//! Small subtrees, by one thread, without a look at anything but their triangles: for what is built while rays wait.

use super::{
    draft::{self, Boxes, Draft, Site},
    planner::Planner,
    record::{Record, UnitCube},
    structure::{Node, NodeRef},
};
use crate::{
    Error, Mesh,
    bounds::Bounds,
    error,
    traverse::frame::Domain,
    triangle::{Block, LANES},
};

/// A finished subtree whose nodes and blocks are numbered from zero; [`NodeRef::moved`] brings its references to
/// wherever they are copied.
#[derive(Debug)]
pub struct Subtree {
    /// Where rays begin; [`NodeRef::EMPTY`] where there are no triangles.
    pub root: NodeRef,
    /// Every node before its children; none where one leaf is enough.
    pub nodes: Vec<Node>,
    /// The leaves.
    pub blocks: Vec<Block>,
    /// Most entries a traversal can put on its stack.
    pub stack_size: usize,
    /// The box around its triangles, in the mesh's own coordinates.
    pub bounds: Bounds,
}

/// Builds one subtree after the other, in the same room.
#[derive(Debug)]
pub struct SmallBuilder<'a> {
    mesh: &'a Mesh,
    domain: Domain,
    cube: UnitCube,
    room: Room,
}

/// What a builder needs to remember things in.
#[derive(Debug, Default)]
struct Room {
    planner: Planner,
    draft: Draft,
    boxes: Boxes,
}

impl<'a> SmallBuilder<'a> {
    /// For subtrees of a structure over a mesh.
    pub fn new(mesh: &'a Mesh) -> Self {
        let bounds = mesh.bounds();
        Self { mesh, domain: Domain::new(&bounds), cube: UnitCube::new(&bounds), room: Room::default() }
    }

    /// Build over some triangles, none of them without area, by the surface area heuristic. Depends on nothing but their
    /// order. Meant for dozens, right for any number.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn build(&mut self, triangles: &[u32]) -> Result<Subtree, Error> {
        let Room { planner, draft, boxes } = &mut self.room;
        draft.clear();
        if !triangles.is_empty() {
            let record = |(index, &triangle): (usize, &u32)| {
                Record::new(&self.cube.bounds(self.mesh.corners(triangle)), index as u32, 1)
            };
            planner.plan(triangles.iter().enumerate().map(record), triangles, LANES, draft);
        }
        let mut nodes = error::filled(draft.nodes.len(), Node::EMPTY, "the nodes of a subtree")?;
        let mut blocks = error::filled(draft.leaves.len(), Block::EMPTY, "the leaves of a subtree")?;
        let mut site = Site { nodes: &mut nodes, blocks: &mut blocks, first_node: 0, first_block: 0 };
        let bounds = draft::fit(draft, self.mesh, self.domain.centre.into(), &mut site, boxes).into();
        Ok(Subtree { root: draft.root, nodes, blocks, stack_size: draft.stack_size, bounds })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{accel::check::assert_well_formed, accel::structure::Structure, arena::Arena};

    fn mesh(count: u32) -> Mesh {
        let place = |i: u32| Vec3::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, (i * 71 % 89) as f32) * 0.01;
        let corners = |i: u32| [place(i), place(i) + Vec3::X * 0.03, place(i) + Vec3::new(0.0, 0.02, 0.04)];
        let vertices = (0..count).flat_map(corners).collect();
        Mesh::new(vertices, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()).unwrap()
    }

    fn arena<T: bytemuck::Pod>(values: &[T]) -> Arena<T> {
        let mut arena = Arena::with_capacity(values.len(), "a test").unwrap();
        values.iter().for_each(|&value| arena.push(value));
        arena
    }

    #[test]
    fn subtrees_of_any_size_are_well_formed() {
        for count in [0, 1, 8, 9, 64, 65, 3000] {
            let mesh = mesh(count);
            let Subtree { root, nodes, blocks, stack_size, bounds } =
                SmallBuilder::new(&mesh).build(mesh.solid()).unwrap();
            assert_eq!(bounds, mesh.bounds());
            let structure = Structure {
                root,
                domain: Domain::new(&mesh.bounds()),
                nodes: arena(&nodes),
                blocks: arena(&blocks),
                grids: Vec::new(),
                starts: Vec::new(),
                references: Vec::new(),
                stack_size,
            };
            assert_well_formed(&structure, &mesh);
        }
    }
}
