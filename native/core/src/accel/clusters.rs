//! Clusters of few triangles, which stay together in a tree: half as many things to decide about. Along a Morton curve
//! neighbours that are each other's nearest are merged, after Meister and Bittner, "Parallel Locally-Ordered Clustering
//! for Bounding Volume Hierarchy Construction", TVCG 24(3), 2018; as its distance, the area of the box around both.

use rayon::prelude::*;

use super::{
    morton::Key,
    nearest::{self, Neighbours},
    record::{Record, UnitCube},
};
use crate::{Error, Job, Mesh, bounds::BoundsA, error, simd::Level};

/// Triangles are clustered in chunks of this size, so that all that is looked at fits the nearest cache.
const CHUNK: usize = nearest::MOST;

/// Most triangles in a cluster. Pairs keep the tree as good as without clusters, fours would be built faster.
const CLUSTER: u32 = 2;

/// Two clusters merge only where the box around both has at most this many times the area of their boxes together.
const CLUSTER_GROWTH: f32 = 1.5;

/// Most clusters in a cell.
const CELL: usize = 4;

/// A cell ends where the box around it would have more than this many times the area of its clusters together.
const CELL_GROWTH: f32 = 1.6;

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
        let most = CLUSTER.min(most as u32);
        let clusterer = Clusterer { mesh, cube: UnitCube::new(&mesh.bounds()), level: Level::detect(), most };
        let chunks = keys.par_chunks(CHUNK).zip(triangles.par_chunks_mut(CHUNK)).enumerate();
        let chunks: Result<Vec<Chunk>, Error> = chunks
            .map_init(Neighbours::default, |neighbours, (index, (keys, triangles))| {
                job.check()?;
                let chunk = clusterer.chunk(index * CHUNK, keys, neighbours, triangles);
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
    pub fn cells(&self) -> Result<Vec<Record>, Error> {
        let mut cells = error::reserve(self.chunks.iter().map(|chunk| chunk.cells.len()).sum(), "the cells")?;
        self.chunks.iter().for_each(|chunk| cells.extend_from_slice(&chunk.cells));
        Ok(cells)
    }

    /// The clusters of a cell.
    #[inline(always)]
    pub fn of_cell(&self, cell: &Record) -> impl Iterator<Item = Record> + use<'_> {
        let (first, mut left) = (cell.range().start, cell.count());
        let clusters = self.chunks[first / CHUNK].clusters[first % CHUNK..].iter().copied();
        clusters.take_while(move |cluster| {
            let belongs = left > 0;
            left = left.saturating_sub(cluster.count());
            belongs
        })
    }
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
    fn chunk(&self, first: usize, keys: &[Key], neighbours: &mut Neighbours, triangles: &mut [u32]) -> Chunk {
        neighbours.clear();
        keys.iter().for_each(|key| neighbours.push(&self.cube.bounds(self.mesh.corners(key.triangle()))));
        neighbours.find(self.level);
        let mut clusters = Vec::with_capacity(keys.len() * 5 / 8);
        let mut filled = 0;
        for index in 0..keys.len() {
            let (partner, bounds) = match self.partner(neighbours, index) {
                Some((partner, _)) if partner < index => continue,
                Some((partner, bounds)) => (Some(partner), bounds),
                None => (None, neighbours.bounds(index)),
            };
            let place = first + filled;
            for member in std::iter::once(index).chain(partner) {
                triangles[filled] = keys[member].triangle();
                filled += 1;
            }
            clusters.push(Record::new(&bounds, place as u32, (first + filled - place) as u32));
        }
        let cells = cells(first, &clusters);
        Chunk { clusters, cells }
    }

    /// Who is clustered with a triangle, and the box around both.
    #[inline(always)]
    fn partner(&self, neighbours: &Neighbours, index: usize) -> Option<(usize, BoundsA)> {
        let partner = neighbours.mutual(index).filter(|_| self.most > 1)?;
        let (one, other) = (neighbours.bounds(index), neighbours.bounds(partner));
        let both = one.union(&other);
        let limit = CLUSTER_GROWTH * (one.half_area() + other.half_area());
        (both.half_area() <= limit).then_some((partner, both))
    }
}

/// Group consecutive clusters, the first of which has the number `first`.
fn cells(first: usize, clusters: &[Record]) -> Vec<Record> {
    let mut cells = Vec::with_capacity(clusters.len() / 2);
    let mut begin = 0;
    while begin < clusters.len() {
        let (mut bounds, mut count) = (clusters[begin].bounds(), clusters[begin].count());
        let (mut area, mut end) = (bounds.half_area(), begin + 1);
        while end < clusters.len().min(begin + CELL) {
            let next = clusters[end].bounds();
            let both = bounds.union(&next);
            area += next.half_area();
            if both.half_area() > CELL_GROWTH * area {
                break;
            }
            (bounds, count, end) = (both, count + clusters[end].count(), end + 1);
        }
        cells.push(Record::new(&bounds, (first + begin) as u32, count));
        begin = end;
    }
    cells
}
