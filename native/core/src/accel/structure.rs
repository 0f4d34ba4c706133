//! The packed tree that rays walk: wide nodes, blocks of triangles, grids. Data only; builders and traversal know it,
//! it knows neither.

use bytemuck::{Pod, Zeroable};
use glam::Vec3A;

use super::{lattice::Lattices, lazy::LazyCells};
use crate::{
    arena::Arena,
    bounds::BoundsA,
    traverse::frame::Domain,
    triangle::{Block, LANES},
};

/// A tagged index: what a child of a node is, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct NodeRef(u32);

/// A [`NodeRef`], taken apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Index into [`Structure::nodes`].
    Branch(u32),
    /// Index into [`Structure::blocks`], and how many of its lanes are used.
    Leaf {
        /// The block.
        block: u32,
        /// Used lanes, 1 to 8; they come first.
        count: u32,
    },
    /// Index into [`Structure::grids`].
    Grid(u32),
    /// Index into [`Structure::lazy`].
    Lazy(u32),
    /// Index into [`Lattices::nests`](super::lattice::Lattices::nests).
    Nest(u32),
    /// A nest whose walk waits on a traversal's stack, above the cell it has reached; in no structure.
    Resume(u32),
    /// Index into [`Lattices::irregular`](super::lattice::Lattices::irregular).
    Irregular(u32),
    /// Index into [`Lattices::tetrahedral`](super::lattice::Lattices::tetrahedral).
    Tetrahedral(u32),
    /// Nothing.
    Empty,
}

impl NodeRef {
    const TAG: u32 = 30;
    const COUNT: u32 = 27;
    /// Stands where a leaf has its count.
    const LAZY: u32 = 1;
    /// Which kind of grid one is stands where a leaf has its count.
    const NEST: u32 = 1;
    const RESUME: u32 = 2;
    const IRREGULAR: u32 = 3;
    const TETRAHEDRAL: u32 = 4;
    /// Indices are below this; [`crate::Mesh`] bounds the number of triangles by it, and every builder makes at most
    /// one block or node a triangle.
    const INDEX: u32 = (1 << Self::COUNT) - 1;

    /// Nothing.
    pub const EMPTY: Self = Self(3 << Self::TAG);

    /// A wide node.
    pub fn branch(index: usize) -> Self {
        assert!(index <= Self::INDEX as usize);
        Self(index as u32)
    }

    /// A block with `count` triangles.
    pub fn leaf(block: usize, count: usize) -> Self {
        assert!(block <= Self::INDEX as usize && (1..=LANES).contains(&count));
        Self(1 << Self::TAG | (count as u32 - 1) << Self::COUNT | block as u32)
    }

    /// A grid.
    pub fn grid(index: usize) -> Self {
        Self::of_kind(0, index)
    }

    /// A grid whose cells are nodes.
    pub fn nest(index: usize) -> Self {
        Self::of_kind(Self::NEST, index)
    }

    /// A grid of merged cells.
    pub fn irregular(index: usize) -> Self {
        Self::of_kind(Self::IRREGULAR, index)
    }

    /// A grid of tetrahedra.
    pub fn tetrahedral(index: usize) -> Self {
        Self::of_kind(Self::TETRAHEDRAL, index)
    }

    fn of_kind(kind: u32, index: usize) -> Self {
        assert!(index <= Self::INDEX as usize);
        Self(2 << Self::TAG | kind << Self::COUNT | index as u32)
    }

    /// What waits on the stack while a cell of a nest is searched: the nest, to be gone on with.
    #[inline(always)]
    pub fn resume(nest: u32) -> Self {
        Self(2 << Self::TAG | Self::RESUME << Self::COUNT | nest)
    }

    /// What lies below it on the stack: the cell, each coordinate below [`MOST_NEST_EDGE`]. No target at all.
    #[inline(always)]
    pub fn of_cell([x, y, z]: [i32; 3]) -> Self {
        Self((x | y << CELL_BITS | z << (2 * CELL_BITS)) as u32)
    }

    /// The cell that [`NodeRef::of_cell`] was given.
    #[inline(always)]
    pub fn cell(self) -> [i32; 3] {
        [0, CELL_BITS, 2 * CELL_BITS].map(|shift| (self.0 >> shift) as i32 & (MOST_NEST_EDGE as i32 - 1))
    }

    /// A cell that becomes a subtree when a ray reaches it.
    pub fn lazy(index: usize) -> Self {
        assert!(index <= Self::INDEX as usize);
        Self(3 << Self::TAG | Self::LAZY << Self::COUNT | index as u32)
    }

    /// The same child where the nodes and blocks of its subtree stand so many places farther on.
    #[inline(always)]
    pub fn moved(self, nodes: usize, blocks: usize) -> Self {
        match self.target() {
            Target::Branch(index) => Self::branch(index as usize + nodes),
            Target::Leaf { block, count } => Self::leaf(block as usize + blocks, count as usize),
            _ => self,
        }
    }

    /// 1 for a leaf, else 0.
    #[inline(always)]
    fn is_leaf(self) -> u32 {
        u32::from(self.0 >> Self::TAG == 1)
    }

    /// What it refers to.
    #[inline(always)]
    pub fn target(self) -> Target {
        match self.0 >> Self::TAG {
            0 => Target::Branch(self.0),
            1 => Target::Leaf { block: self.0 & Self::INDEX, count: (self.0 >> Self::COUNT & 7) + 1 },
            2 => self.grid_target(),
            _ if self == Self::EMPTY => Target::Empty,
            _ => Target::Lazy(self.0 & Self::INDEX),
        }
    }

    #[inline(always)]
    fn grid_target(self) -> Target {
        let index = self.0 & Self::INDEX;
        match self.0 >> Self::COUNT & 7 {
            Self::NEST => Target::Nest(index),
            Self::RESUME => Target::Resume(index),
            Self::IRREGULAR => Target::Irregular(index),
            Self::TETRAHEDRAL => Target::Tetrahedral(index),
            _ => Target::Grid(index),
        }
    }
}

const CELL_BITS: u32 = 10;

/// Cells of a nest along an axis: three coordinates fit into a reference.
pub const MOST_NEST_EDGE: u32 = 1 << CELL_BITS;

/// Entries that a walk through a nest takes on the stack while a cell is searched.
pub const NEST_STACK: usize = 2;

/// Eight children with their boxes, relative to the centre of the domain.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Node {
    /// `plane[k][lane]` is the lower, `plane[3 + k][lane]` the upper side along axis k; +inf and -inf where empty.
    pub plane: [[f32; LANES]; 6],
    /// The children, the largest first and the unused ones last.
    pub child: [NodeRef; LANES],
    /// For rays of each octant (see [`Frame::octant`](crate::traverse::frame::Frame::octant)) the eight lanes, three
    /// bits each, the one to visit last in the lowest bits. In the highest eight bits of each word, the lanes that are
    /// leaves.
    pub order: [u32; LANES],
}

/// Where the leaves stand in a word of [`Node::order`].
const LEAVES: u32 = 24;

impl Node {
    /// A node without children.
    pub const EMPTY: Self = Self {
        plane: [
            [f32::INFINITY; LANES],
            [f32::INFINITY; LANES],
            [f32::INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
        ],
        child: [NodeRef::EMPTY; LANES],
        order: [0; LANES],
    };

    /// A node with these children in any order, whose boxes are in coordinates of the mesh; the boxes of
    /// [`NodeRef::EMPTY`] are empty.
    #[inline(always)]
    pub fn new(child: [NodeRef; LANES], bounds: &[BoundsA; LANES], centre: Vec3A) -> Self {
        let mut smallness = [f32::INFINITY; LANES];
        for lane in 0..LANES {
            if child[lane] != NodeRef::EMPTY {
                smallness[lane] = -bounds[lane].half_area();
            }
        }
        let (lanes, mut node) = (ranks(&smallness), Self::EMPTY);
        for (from, bounds) in bounds.iter().enumerate() {
            let lane = lanes[from] as usize % LANES;
            let (lower, upper) = (bounds.lower - centre, bounds.upper - centre);
            node.child[lane] = child[from];
            for k in 0..3 {
                node.plane[k][lane] = lower[k];
                node.plane[3 + k][lane] = upper[k];
            }
        }
        node.set_order();
        node
    }

    /// Set the order of visits from the children and their boxes: by where their centres lie along the octant's
    /// diagonal. What comes first in an octant comes last in the opposite one.
    #[inline(always)]
    pub fn set_order(&mut self) {
        let leaves = self.child.iter().enumerate().fold(0, |leaves, (lane, child)| leaves | child.is_leaf() << lane);
        let [x, y, z]: [[f32; LANES]; 3] =
            std::array::from_fn(|k| std::array::from_fn(|lane| self.plane[k][lane] + self.plane[3 + k][lane]));
        for octant in 0..4 {
            let (sx, sy) = (sign(octant & 1), sign(octant >> 1));
            let depth: [f32; LANES] = std::array::from_fn(|lane| sx * x[lane] + sy * y[lane] + z[lane]);
            let forward = ranks(&depth);
            self.order[octant] = leaves << LEAVES | in_order(&forward);
            self.order[7 - octant] = leaves << LEAVES | in_order(&forward.map(|rank| LANES as u32 - 1 - rank));
        }
    }

    /// The lanes that are leaves.
    #[inline(always)]
    pub fn leaves(&self) -> u32 {
        self.order[0] >> LEAVES
    }

    /// How many children it has.
    pub fn len(&self) -> usize {
        self.child.iter().take_while(|&&child| child != NodeRef::EMPTY).count()
    }

    /// Whether it has no child.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

fn sign(negative: usize) -> f32 {
    if negative == 1 { -1.0 } else { 1.0 }
}

/// How many lanes come before each: those of less depth, and of equal depth those of lesser number. A lane whose depth
/// is not a number comes after all that have one.
#[inline(always)]
fn ranks(depth: &[f32; LANES]) -> [u32; LANES] {
    let depth = depth.map(|depth| if depth.is_nan() { f32::INFINITY } else { depth });
    let mut ranks = [0; LANES];
    for other in 0..LANES {
        for lane in 0..LANES {
            let tie = (depth[other] == depth[lane]) & (other < lane);
            ranks[lane] += u32::from((depth[other] < depth[lane]) | tie);
        }
    }
    ranks
}

/// The order of visits in a word of [`Node::order`].
#[inline(always)]
fn in_order(ranks: &[u32; LANES]) -> u32 {
    ranks.iter().enumerate().fold(0, |order, (lane, rank)| order | (lane as u32) << (3 * (LANES as u32 - 1 - rank)))
}

/// A uniform grid over a box. Cell `(x, y, z)` has index `(z * resolution[1] + y) * resolution[0] + x`; its references
/// are those from `starts[first + index]` to `starts[first + index + 1]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Lower corner, relative to the centre of the domain.
    pub lower: [f32; 3],
    /// Upper corner, likewise.
    pub upper: [f32; 3],
    /// Edge lengths of a cell.
    pub cell: [f32; 3],
    /// Their inverses.
    pub inverse_cell: [f32; 3],
    /// Cells along each axis.
    pub resolution: [u32; 3],
    /// Where its row of [`Structure::starts`] begins.
    pub first: usize,
}

impl Grid {
    /// How many cells it has.
    pub fn cell_count(&self) -> usize {
        self.resolution.iter().map(|&r| r as usize).product()
    }
}

/// A finished accelerator's data.
#[derive(Debug)]
pub struct Structure {
    /// Where rays begin.
    pub root: NodeRef,
    /// The arithmetic's frame of reference.
    pub domain: Domain,
    /// Wide nodes, each before its children.
    pub nodes: Arena<Node>,
    /// Leaves.
    pub blocks: Arena<Block>,
    /// Grids.
    pub grids: Vec<Grid>,
    /// For the cells of all grids, where their references begin in `references`, and after each grid's last cell
    /// where they end.
    pub starts: Vec<u32>,
    /// Triangles of all grid cells.
    pub references: Vec<u32>,
    /// Cells that become subtrees when a ray reaches them.
    pub lazy: LazyCells,
    /// Grids of other kinds.
    pub lattices: Lattices,
    /// No traversal holds more entries on its stack.
    pub stack_size: usize,
}

/// The nodes and blocks that the references within a part of a structure mean: its own, or those of a lazy cell.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// What [`Target::Branch`] means.
    pub nodes: &'a [Node],
    /// What [`Target::Leaf`] means.
    pub blocks: &'a [Block],
}

impl Structure {
    /// Nothing but a root.
    pub fn of(root: NodeRef, domain: Domain) -> Self {
        Self {
            root,
            domain,
            nodes: Arena::empty(),
            blocks: Arena::empty(),
            grids: Vec::new(),
            starts: Vec::new(),
            references: Vec::new(),
            lazy: LazyCells::default(),
            lattices: Lattices::default(),
            stack_size: 0,
        }
    }

    /// Its own nodes and blocks.
    #[inline(always)]
    pub fn view(&self) -> View<'_> {
        View { nodes: &self.nodes, blocks: &self.blocks }
    }

    /// Whether rays may meet anything but branches and leaves.
    pub fn has_grids(&self) -> bool {
        !self.grids.is_empty() || !self.lattices.is_empty() || !self.lazy.is_empty()
    }

    /// The triangles in a cell of a grid.
    #[inline(always)]
    pub fn cell(&self, grid: &Grid, index: usize) -> &[u32] {
        let start = self.starts[grid.first + index] as usize;
        let end = self.starts[grid.first + index + 1] as usize;
        &self.references[start..end]
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
            + size_of_val(&*self.blocks)
            + size_of_val(&*self.grids)
            + size_of_val(&*self.starts)
            + size_of_val(&*self.references)
            + self.lazy.bytes()
            + self.lattices.bytes()
    }
}
