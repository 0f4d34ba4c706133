//! Clusters of few triangles, which stay together in a tree: half as many things to decide about. Along a Morton curve
//! neighbours that are each other's nearest are merged, after Meister and Bittner, "Parallel Locally-Ordered Clustering
//! for Bounding Volume Hierarchy Construction", TVCG 24(3), 2018; as its distance, the area of the box around both.
//!
//! Measured against the surface area heuristic over single triangles by the expected cost of the tree: 2% less (Sibenik,
//! vianney_house), equal (room, stadium, hospital, Sponza, soup, hair), 1 to 2.5% more (dragon, saw, horse, city, bunny).
//! Fetching the corners, which miss the cache, is two thirds of the time of clustering; fetching them in a loop of their own
//! did not help, nor did comparing with 8 neighbours to either side instead of 15.

use rayon::prelude::*;

use super::{
    ahead,
    morton::Key,
    nearest::{self, Neighbours},
    record::{Record, UnitCube},
};
use crate::{
    Error, Job, Mesh,
    arena::Arena,
    error,
    simd::{Kernel, Level, Simd},
};

/// Triangles are clustered in chunks of this size, so that all that is looked at fits the nearest cache.
const CHUNK: usize = nearest::MOST;

/// Rounds of merging: most triangles of a cluster after each, and how many times the area of their boxes together the
/// box around two clusters may have. Measured by the cost of the tree against no clusters at all: pairs are as good or
/// better, fours cost at most 2% (bunny), and the build takes 0.85 of the time of pairs; with growths of 1.5 and 1.3,
/// halls (Sponza) cost 6% more.
const ROUNDS: [(u32, f32); 2] = [(2, 1.0), (4, 1.0)];

/// So many triangles are moved as one, if a cluster has no more.
const FEW: usize = 4;

/// Most clusters in a cell.
const CELL: usize = 4;

/// A cell ends where the box around it would have more than this many times the area of its clusters together.
const CELL_GROWTH: f32 = 1.0;

/// Nor more than this many times that of its smallest cluster: in the box of a large one a small one counts as large,
/// and no plane can tell any more where it is. Without this bound, halls whose walls are few and whose ornaments are many
/// (Sponza, Sibenik) make 7 to 36% more steps; up to 16 times it is as good there, but not in Sibenik.
const CELL_SHARE: f32 = 4.0;

/// The clusters of a mesh, and cells of consecutive clusters, by which the upper part of a tree is decided.
#[derive(Debug, Default)]
pub struct Clusters {
    /// All triangles, those of a cluster together.
    pub triangles: Vec<u32>,
    chunks: Vec<Chunk>,
}

/// Clusters refer to [`Clusters::triangles`], cells to clusters, counted as if every chunk had as many as it can.
#[derive(Debug, Default, Clone)]
struct Chunk {
    clusters: Vec<Record>,
    cells: Vec<Record>,
}

impl Clusters {
    /// Of sorted triangles; none has more than `most`.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::OutOfMemory`].
    pub fn of(keys: &[Key], mesh: &Mesh, most: usize, job: &Job) -> Result<Self, Error> {
        let mut triangles = error::filled(keys.len(), 0, "the order of triangles")?;
        let most = most as u32;
        let clusterer = Clusterer { mesh, cube: UnitCube::new(&mesh.bounds()), level: Level::detect(), most };
        let chunks = keys.par_chunks(CHUNK).zip(triangles.par_chunks_mut(CHUNK)).enumerate();
        let chunks: Result<Vec<Chunk>, Error> = chunks
            .map_init(Room::default, |room, (index, (keys, triangles))| {
                job.check()?;
                let chunk = clusterer.chunk(index * CHUNK, keys, room, triangles);
                job.advance(keys.len() as u64);
                Ok(chunk)
            })
            .collect();
        Ok(Self { triangles, chunks: chunks? })
    }

    /// All cells, in order.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn cells(&self) -> Result<Arena<Record>, Error> {
        let mut cells = Arena::stale(self.chunks.iter().map(|chunk| chunk.cells.len()).sum(), "the cells")?;
        let mut rest = cells.as_mut_slice();
        for chunk in &self.chunks {
            let (these, others) = rest.split_at_mut(chunk.cells.len());
            these.copy_from_slice(&chunk.cells);
            rest = others;
        }
        Ok(cells)
    }

    /// The clusters of a cell.
    #[inline(always)]
    pub fn of_cell(&self, cell: &Record) -> &[Record] {
        let first = cell.range().start;
        let following = &self.chunks[first / CHUNK].clusters[first % CHUNK..];
        let (mut count, mut left) = (0, cell.count());
        while left > 0 && count < following.len() {
            left -= following[count].count();
            count += 1;
        }
        &following[..count]
    }
}

/// What a thread remembers things in, reused from chunk to chunk.
#[derive(Default)]
struct Room {
    neighbours: Neighbours,
    order: Vec<u32>,
    records: Vec<Record>,
}

struct Clusterer<'a> {
    mesh: &'a Mesh,
    cube: UnitCube,
    level: Level,
    /// Most triangles in a cluster.
    most: u32,
}

impl Clusterer<'_> {
    /// Cluster a chunk whose first triangle has the place `first` among all.
    fn chunk(&self, first: usize, keys: &[Key], room: &mut Room, triangles: &mut [u32]) -> Chunk {
        let Room { neighbours, order, records } = room;
        order.clear();
        order.extend(keys.iter().map(|key| key.triangle()));
        self.level.run(Fetch { mesh: self.mesh, cube: &self.cube, triangles: order, records });
        for (most, growth) in ROUNDS {
            neighbours.find(records, self.level);
            records.clear();
            let most = most.min(self.most);
            self.level.run(Merge { neighbours, most, growth, order, triangles, clusters: records });
            order.copy_from_slice(triangles);
        }
        let clusters: Vec<Record> = records.iter().map(|record| record.at(first + record.range().start)).collect();
        let cells = self.level.run(Group { first, clusters: &clusters });
        Chunk { clusters, cells }
    }
}

/// Makes a record of each triangle.
struct Fetch<'a> {
    mesh: &'a Mesh,
    cube: &'a UnitCube,
    triangles: &'a [u32],
    records: &'a mut Vec<Record>,
}

impl Kernel for Fetch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { mesh, cube, triangles, records } = self;
        let reader = mesh.reader();
        records.clear();
        records.reserve(triangles.len());
        for (index, &triangle) in triangles.iter().enumerate() {
            ahead::ask(simd, reader, index, |place| triangles.get(place).copied());
            records.push(Record::new(&cube.bounds(reader.corners(triangle)), index, 1));
        }
    }
}

/// Merges what is nearest to each other; triangles move so that those of a cluster stay together.
struct Merge<'a> {
    neighbours: &'a Neighbours,
    most: u32,
    growth: f32,
    order: &'a [u32],
    triangles: &'a mut [u32],
    clusters: &'a mut Vec<Record>,
}

impl Kernel for Merge<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let records = self.neighbours.records();
        let mut filled = 0;
        for (index, record) in records.iter().enumerate() {
            let Some((partner, both)) = self.partner(simd, index) else {
                self.clusters.push(record.at(filled));
                filled = self.take(record, filled);
                continue;
            };
            if partner > index {
                self.clusters.push(both.at(filled));
                filled = self.take(record, filled);
                filled = self.take(&records[partner], filled);
            }
        }
    }
}

impl Merge<'_> {
    /// Put the triangles of a cluster where `filled` others are; returns how many are there then.
    #[inline(always)]
    fn take(&mut self, record: &Record, filled: usize) -> usize {
        let (range, count) = (record.range(), record.count() as usize);
        let (from, to) = (&self.order[range.start..], &mut self.triangles[filled..]);
        // What follows is overwritten by those that come next. A length that varies would be a call for every few numbers.
        match (from.first_chunk::<FEW>(), to.first_chunk_mut()) {
            (Some(from), Some(to)) if count <= FEW => *to = *from,
            _ => to[..count].copy_from_slice(&from[..count]),
        }
        filled + count
    }

    /// Which cluster another one is merged with, and both together.
    #[inline(always)]
    fn partner<S: Simd>(&self, simd: S, index: usize) -> Option<(usize, Record)> {
        let partner = self.neighbours.mutual(index)?;
        let [one, other] = [index, partner].map(|index| &self.neighbours.records()[index]);
        let both = one.union(simd, other);
        let fit = both.count() <= self.most && both.half_area() <= self.growth * (one.half_area() + other.half_area());
        fit.then_some((partner, both))
    }
}

/// Groups consecutive clusters, the first of which has the number `first`.
struct Group<'a> {
    first: usize,
    clusters: &'a [Record],
}

impl Kernel for Group<'_> {
    type Output = Vec<Record>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<Record> {
        let Self { first, clusters } = self;
        let mut cells = Vec::with_capacity(clusters.len());
        let mut begin = 0;
        while begin < clusters.len() {
            let (mut cell, mut area) = (clusters[begin], clusters[begin].half_area());
            let (mut least, mut end) = (area, begin + 1);
            while end < clusters.len().min(begin + CELL) {
                let both = cell.union(simd, &clusters[end]);
                let next = clusters[end].half_area();
                (area, least) = (area + next, least.min(next));
                if both.half_area() > (CELL_GROWTH * area).min(CELL_SHARE * least) {
                    break;
                }
                (cell, end) = (both, end + 1);
            }
            cells.push(cell.at(first + begin));
            begin = end;
        }
        cells
    }
}
