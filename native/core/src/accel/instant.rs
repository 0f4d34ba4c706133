//! The builder for the first rays: a uniform grid divides the triangles in one linear pass, and a hierarchy of lazy
//! cells is made of what is in its cells.
//!
//! Triangles are sorted along a Morton curve over a grid of 1024 cells per axis; a cell that is crowded gets a grid of
//! its own. Aligned blocks of cells are divided until few triangles are together. The binned surface area heuristic
//! decides on the tree above large blocks, after Pantaleoni and Luebke, "HLBVH: Hierarchical LBVH Construction for
//! Real-Time Ray Tracing of Dynamic Geometry", HPG 2010; within them, small blocks are cut and joined in the order of
//! the curve. What is below is left to [`LazyCells`].
//!
//! Tried instead of the sort: one pass in the order of the mesh into 64 cells per axis, with their boxes, and a counting
//! sort by cell. On the dragon, most of whose triangles are then in crowded cells, that took 95 ms instead of 74, and
//! refining cells took a quarter longer, as each had to be sorted.

use std::ops::Range;

use glam::Vec3A;
use rayon::prelude::*;

use super::{
    ahead,
    bins::Bins,
    lazy::{Cell, LazyCells},
    morton::{self, Key},
    planner::{self, Set},
    record::{Record, UnitCube},
    structure::{Node, NodeRef, Structure, Target},
    sweep::{Item, Run, Sweep},
};
use crate::{
    Error, Job, Mesh,
    arena::Arena,
    bounds::{Bounds, BoundsA},
    error,
    simd::{Kernel, Level, Simd},
    traverse::frame::Domain,
    triangle::LANES,
};

/// Most triangles in a lazy cell. Fewer make the tree above cells the larger part of the build, more make the first ray
/// to reach a cell pay for triangles that no ray will meet.
const CELL: usize = 48;

/// Most triangles in a small block.
const SMALL: usize = 16;

/// Large blocks are as many as this, about, but have at least [`CELL`] and at most [`MOST_LARGE`] triangles.
const LARGE_BLOCKS: usize = 1 << 12;
const MOST_LARGE: usize = 1 << 10;

/// Sets of more large blocks are divided in parallel.
const SEQUENTIAL: usize = 1 << 6;

/// Small blocks whose boxes a thread finds between two looks at the job.
const PART: usize = 1 << 9;

const WHAT: &str = "the cells of the grid";

/// Build.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn build(mesh: &Mesh, job: &Job) -> Result<Structure, Error> {
    let domain = Domain::new(&mesh.bounds());
    let mut keys = morton::sorted(mesh, job)?;
    if keys.is_empty() {
        return Ok(Structure::of(NodeRef::EMPTY, domain));
    }
    let blocks = Blocks::new(mesh, &mut keys, job)?;
    let cube = UnitCube::new(&mesh.bounds());
    let mut records: Vec<Record> = error::reserve(blocks.large.len(), WHAT)?;
    let bounds = blocks.large.par_iter().map(|large| Run::new(&blocks.items, large.clone()).total.bounds);
    let bounds: Vec<BoundsA> = bounds.collect();
    // Every large block counts as one leaf.
    let record = |(index, bounds)| Record::new(&cube.mapped(bounds), index, LANES as u32);
    records.extend(bounds.iter().enumerate().map(record));
    let mut spare = error::filled(records.len(), Record::NONE, WHAT)?;
    let (centre, level) = (domain.centre.into(), Level::detect());
    let work = Work { keys: &keys, blocks: &blocks, centre, scale: cube.scale(), level, job };
    let (mut part, mut bins) = (Part::default(), Bins::EMPTY);
    let placed = work.above(Set::new(&mut records, &mut spare), &mut bins, &mut part)?;
    let nodes = Arena::copied(&part.nodes, "the nodes")?;
    let lazy = LazyCells::new(part.triangles, part.cells)?;
    // A subtree of so many triangles never has more entries on the stack than it has leaves beside the current one.
    Ok(Structure { nodes, lazy, stack_size: placed.stack_size + CELL, ..Structure::of(placed.root, domain) })
}

/// Triangles in blocks: those of the grid's cells, aligned to powers of two.
struct Blocks {
    /// Where the triangles of small blocks end in the order of keys.
    ends: Vec<u32>,
    /// Boxes and triangles of small blocks.
    items: Vec<Item>,
    /// Large blocks, by their small ones.
    large: Vec<Range<usize>>,
}

impl Blocks {
    fn new(mesh: &Mesh, keys: &mut [Key], job: &Job) -> Result<Self, Error> {
        let mut divider = Divider {
            mesh,
            most_large: (keys.len() / LARGE_BLOCKS).clamp(CELL, MOST_LARGE),
            ends: error::reserve(keys.len() / SMALL * 2 + 1, WHAT)?,
            large: Vec::new(),
        };
        divider.divide(keys, 0, true);
        let Divider { ends, large, .. } = divider;
        let mut items = error::filled(ends.len(), Item::NONE, WHAT)?;
        let (keys, level) = (&*keys, Level::detect());
        items.par_chunks_mut(PART).zip(ends.par_chunks(PART)).enumerate().try_for_each(
            |(part, (items, part_ends))| {
                job.check()?;
                let first = (part * PART).checked_sub(1).map_or(0, |before| ends[before]);
                level.run(Fetch { mesh, keys: &keys[first as usize..], ends: part_ends, first, items });
                Ok(())
            },
        )?;
        Ok(Self { ends, items, large })
    }
}

/// Finds the boxes of small blocks, the first of which begins where `keys` do.
struct Fetch<'a> {
    mesh: &'a Mesh,
    keys: &'a [Key],
    ends: &'a [u32],
    first: u32,
    items: &'a mut [Item],
}

impl Kernel for Fetch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { mesh, keys, ends, first, items } = self;
        let (mut place, reader) = (0, mesh.reader());
        for (item, &end) in items.iter_mut().zip(ends) {
            *item = Item { bounds: BoundsA::EMPTY, count: end - first - place as u32 };
            while place < (end - first) as usize {
                ahead::ask(simd, reader, place, |place| keys.get(place).map(|key| key.triangle()));
                let corners = reader.corners(keys[place].triangle());
                item.bounds = item.bounds.union(&BoundsA::of_aligned_corners(corners));
                place += 1;
            }
        }
    }
}

struct Divider<'a> {
    mesh: &'a Mesh,
    most_large: usize,
    ends: Vec<u32>,
    large: Vec<Range<usize>>,
}

impl Divider<'_> {
    /// Halve along the highest bit in which codes differ until blocks are small. `above` says that no large block has
    /// begun.
    fn divide(&mut self, keys: &mut [Key], first: usize, above: bool) {
        let begins = above && keys.len() <= self.most_large;
        let begin = self.ends.len();
        let (low, high) = (keys[0].code(), keys[keys.len() - 1].code());
        if keys.len() <= SMALL {
            self.ends.push((first + keys.len()) as u32);
        } else if low == high {
            self.crowded(keys, first, above && !begins);
        } else {
            let bit = (low ^ high).ilog2();
            let middle = keys.partition_point(|key| key.code() >> bit & 1 == 0);
            let (left, right) = keys.split_at_mut(middle);
            self.divide(left, first, above && !begins);
            self.divide(right, first + middle, above && !begins);
        }
        if begins {
            self.large.push(begin..self.ends.len());
        }
    }

    /// Give a cell with too many triangles a grid of its own, or, where their centres agree, halve them as they stand.
    fn crowded(&mut self, keys: &mut [Key], first: usize, above: bool) {
        let centre = |key: &Key| Bounds::of_points(self.mesh.corners(key.triangle())).centre();
        let cube = UnitCube::new(&Bounds::of_points(keys.iter().map(centre)));
        let reader = self.mesh.reader();
        keys.par_iter_mut()
            .with_min_len(PART)
            .for_each(|key| *key = morton::key(reader.corners(key.triangle()), &cube, key.triangle()));
        keys.par_sort_unstable();
        if keys[0].code() != keys[keys.len() - 1].code() {
            return self.divide(keys, first, above);
        }
        let (left, right) = keys.split_at_mut(keys.len() / 2);
        self.divide(left, first, above);
        self.divide(right, first + left.len(), above);
    }
}

/// What all parts of the tree are made from.
struct Work<'a> {
    keys: &'a [Key],
    blocks: &'a Blocks,
    centre: Vec3A,
    scale: f32,
    level: Level,
    job: &'a Job,
}

/// A part of the tree, numbered from zero.
#[derive(Debug, Default)]
struct Part {
    nodes: Vec<Node>,
    triangles: Vec<u32>,
    cells: Vec<Cell>,
    sweep: Sweep,
}

/// A subtree with what its parent needs to know.
#[derive(Debug, Clone, Copy)]
struct Placed {
    root: NodeRef,
    bounds: BoundsA,
    stack_size: usize,
}

type Children = [Placed; LANES];

impl Placed {
    const NOTHING: Self = Self { root: NodeRef::EMPTY, bounds: BoundsA::EMPTY, stack_size: 0 };
}

impl Work<'_> {
    /// The tree over large blocks.
    fn above(&self, set: Set<'_>, bins: &mut Bins, part: &mut Part) -> Result<Placed, Error> {
        if let [record] = set.records() {
            let items = self.blocks.large[record.range().start].clone();
            let run = Run::new(&self.blocks.items, items);
            self.job.advance(run.count() as u64);
            return Ok(self.within(run, part));
        }
        let slot = part.reserve_node();
        let is_large = set.records().len() > SEQUENTIAL;
        let sets = planner::open(set, LANES, bins, self.level);
        let children = if is_large { self.in_parallel(sets, part)? } else { self.in_turn(sets, bins, part)? };
        Ok(part.place(slot, &children, self.centre))
    }

    fn in_turn(&self, sets: [Option<Set<'_>>; LANES], bins: &mut Bins, part: &mut Part) -> Result<Children, Error> {
        let mut children = [Placed::NOTHING; LANES];
        for (child, set) in children.iter_mut().zip(sets.into_iter().flatten()) {
            *child = self.above(set, bins, part)?;
        }
        Ok(children)
    }

    fn in_parallel(&self, sets: [Option<Set<'_>>; LANES], part: &mut Part) -> Result<Children, Error> {
        self.job.check()?;
        let below = |set: Set<'_>| {
            let (mut part, mut bins) = (Part::default(), Bins::EMPTY);
            let placed = self.above(set, &mut bins, &mut part)?;
            Ok((placed, part))
        };
        let parts: Vec<_> = sets.into_par_iter().flatten().map(below).collect::<Result<_, Error>>()?;
        let mut children = [Placed::NOTHING; LANES];
        for (child, (placed, below)) in children.iter_mut().zip(parts) {
            *child = Placed { root: part.append(below, placed.root), ..placed };
        }
        Ok(children)
    }

    /// The tree over small blocks within a large one.
    fn within(&self, run: Run, part: &mut Part) -> Placed {
        if run.count() <= CELL || run.items.len() == 1 {
            return self.cell(&run, part);
        }
        let slot = part.reserve_node();
        let runs = part.sweep.open(&self.blocks.items, run, CELL, self.scale);
        let mut children = [Placed::NOTHING; LANES];
        for (child, run) in children.iter_mut().zip(runs) {
            *child = self.within(run, part);
        }
        part.place(slot, &children, self.centre)
    }

    fn cell(&self, run: &Run, part: &mut Part) -> Placed {
        let first = run.items.start.checked_sub(1).map_or(0, |before| self.blocks.ends[before]);
        let keys = &self.keys[first as usize..first as usize + run.count()];
        part.triangles.extend(keys.iter().map(|key| key.triangle()));
        let BoundsA { lower, upper } = run.total.bounds;
        let bounds = Bounds { lower: (lower - self.centre).into(), upper: (upper - self.centre).into() };
        part.cells.push(Cell { end: part.triangles.len() as u32, bounds });
        Placed { root: NodeRef::lazy(part.cells.len() - 1), bounds: run.total.bounds, stack_size: 0 }
    }
}

impl Part {
    fn reserve_node(&mut self) -> usize {
        self.nodes.push(Node::EMPTY);
        self.nodes.len() - 1
    }

    /// Write a node above its children.
    fn place(&mut self, slot: usize, children: &Children, centre: Vec3A) -> Placed {
        self.nodes[slot] = Node::new(children.map(|child| child.root), &children.map(|child| child.bounds), centre);
        let count = children.iter().filter(|child| child.root != NodeRef::EMPTY).count();
        let deepest = children.iter().map(|child| child.stack_size).max();
        Placed {
            root: NodeRef::branch(slot),
            bounds: children.iter().fold(BoundsA::EMPTY, |all, child| all.union(&child.bounds)),
            stack_size: count - 1 + deepest.unwrap_or(0),
        }
    }

    /// Take in another part, and say where its root now is.
    fn append(&mut self, other: Self, root: NodeRef) -> NodeRef {
        let (nodes, cells, triangles) = (self.nodes.len(), self.cells.len(), self.triangles.len() as u32);
        let moved = |child: NodeRef| match child.target() {
            Target::Lazy(index) => NodeRef::lazy(index as usize + cells),
            _ => child.moved(nodes, 0),
        };
        self.nodes.extend(other.nodes.iter().map(|node| Node { child: node.child.map(moved), ..*node }));
        self.triangles.extend(other.triangles);
        self.cells.extend(other.cells.iter().map(|cell| Cell { end: cell.end + triangles, ..*cell }));
        moved(root)
    }
}
