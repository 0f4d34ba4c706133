//! The methods: what each is called and what it builds, in one table.

use super::layout::Opening;
use crate::Error;

/// How a structure is decided on: a row of [`ROWS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// Median splits along cycling axes: the paper's benchmark.
    BvhMedian,
    /// The same, then improved by reinsertion.
    BvhMedianReinsert,
    /// Binned surface area heuristic.
    BvhSah,
    /// The same, then improved by reinsertion.
    BvhSahReinsert,
    /// Surface area heuristic with spatial splits.
    Sbvh,
    /// The same, then improved by reinsertion.
    SbvhReinsert,
    /// Locally ordered clustering.
    Ploc,
    /// The same, then improved by reinsertion.
    PlocReinsert,
    /// The same over clusters of neighbours.
    BvhClusters,
    /// Divided where Morton codes first differ.
    Lbvh,
    /// One uniform grid.
    Grid,
    /// A coarse grid whose cells are grids.
    GridTwoLevel,
    /// A grid whose cells were merged.
    GridIrregular,
    /// A grid of tetrahedra.
    GridTetrahedral,
    /// A grid, replaced by a hierarchy where a test of it finds that worth while.
    Hapala,
    /// Hierarchies in grids in hierarchies, by surface areas.
    Fellner,
    /// The paper's hybrid: sampled rays decide which nodes become grids.
    HybridSampled,
    /// The same on as many rays as certainty takes.
    HybridSequential,
    /// Lazy cells of a grid, a quick hierarchy or a good one with grids in it, by least expected cost.
    Hybrid,
}

/// Which binary tree a hierarchy starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hierarchy {
    /// [`median`](super::median)
    Median,
    /// [`sah`](super::sah)
    Sah,
    /// [`sbvh`](super::sbvh)
    Spatial,
    /// [`ploc`](super::ploc)
    LocallyOrdered,
}

/// Which kind of grid stands over everything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lattice {
    /// [`two_level`](super::two_level)
    TwoLevel,
    /// [`irregular`](super::irregular)
    Irregular,
    /// [`tetrahedra`](super::tetrahedra)
    Tetrahedral,
}

/// What becomes of a binary tree before it is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finish {
    /// Nothing.
    Plain,
    /// [`reinsert`](super::reinsert)
    Reinserted,
}

/// What a method builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recipe {
    /// A binary tree, packed.
    Hierarchy(Hierarchy, Finish),
    /// Straight to wide nodes, [over clusters](super::clustered).
    Clustered,
    /// Straight to wide nodes, [by Morton codes](super::lbvh).
    Linear,
    /// One grid over everything.
    Grid,
    /// One grid of another kind.
    Lattice(Lattice),
    /// [`hapala`](super::hapala)
    Hapala,
    /// [`fellner`](super::fellner)
    Fellner,
    /// A median tree, some of whose nodes become [grids](super::hybrid::Sampled).
    Sampled,
    /// The same, by [another judge](super::sequential::Sequential).
    Sequential,
    /// What is expected to [cost least](super::choice).
    Cheapest,
}

impl Recipe {
    /// How a tree is packed: well where the build takes its time anyway.
    pub(super) fn opening(self) -> Opening {
        match self {
            Self::Hierarchy(Hierarchy::Sah | Hierarchy::Spatial | Hierarchy::LocallyOrdered, _)
            | Self::Hierarchy(_, Finish::Reinserted) => Opening::Cheapest,
            _ => Opening::Largest,
        }
    }
}

/// All that there is to know about a method.
#[derive(Debug, Clone, Copy)]
struct Row {
    method: Method,
    /// As users write it.
    name: &'static str,
    recipe: Recipe,
    /// How often a build goes through all triangles: to divide them, to judge or improve, to pack them.
    passes: u64,
}

/// A method with its name, its recipe and its passes. Adding one takes a variant, a row, and its name in the tests'
/// list of walks.
#[rustfmt::skip]
const ROWS: &[Row] = &[
    row(Method::BvhMedian, "bvh-median", Recipe::Hierarchy(Hierarchy::Median, Finish::Plain), 2),
    row(Method::BvhMedianReinsert, "bvh-median+reinsert", Recipe::Hierarchy(Hierarchy::Median, Finish::Reinserted), 3),
    row(Method::BvhSah, "bvh-sah", Recipe::Hierarchy(Hierarchy::Sah, Finish::Plain), 2),
    row(Method::BvhSahReinsert, "bvh-sah+reinsert", Recipe::Hierarchy(Hierarchy::Sah, Finish::Reinserted), 3),
    row(Method::Sbvh, "sbvh", Recipe::Hierarchy(Hierarchy::Spatial, Finish::Plain), 2),
    row(Method::SbvhReinsert, "sbvh+reinsert", Recipe::Hierarchy(Hierarchy::Spatial, Finish::Reinserted), 3),
    row(Method::Ploc, "ploc", Recipe::Hierarchy(Hierarchy::LocallyOrdered, Finish::Plain), 2),
    row(Method::PlocReinsert, "ploc+reinsert", Recipe::Hierarchy(Hierarchy::LocallyOrdered, Finish::Reinserted), 3),
    row(Method::BvhClusters, "bvh-clusters", Recipe::Clustered, 3),
    row(Method::Lbvh, "lbvh", Recipe::Linear, 2),
    row(Method::Grid, "grid", Recipe::Grid, 2),
    row(Method::GridTwoLevel, "grid-two-level", Recipe::Lattice(Lattice::TwoLevel), 2),
    row(Method::GridIrregular, "grid-irregular", Recipe::Lattice(Lattice::Irregular), 2),
    row(Method::GridTetrahedral, "grid-tetrahedral", Recipe::Lattice(Lattice::Tetrahedral), 1),
    row(Method::Hapala, "hapala", Recipe::Hapala, 3),
    row(Method::Fellner, "fellner", Recipe::Fellner, 3),
    row(Method::HybridSampled, "hybrid-sampled", Recipe::Sampled, 3),
    row(Method::HybridSequential, "hybrid-sequential", Recipe::Sequential, 3),
    row(Method::Hybrid, "hybrid", Recipe::Cheapest, 3),
];

const fn row(method: Method, name: &'static str, recipe: Recipe, passes: u64) -> Row {
    Row { method, name, recipe, passes }
}

impl Method {
    /// All of them, in the order of their table.
    pub const ALL: [Self; ROWS.len()] = {
        let mut all = [Self::BvhMedian; ROWS.len()];
        let mut index = 0;
        while index < ROWS.len() {
            assert!(ROWS[index].method as usize == index, "variants and rows stand in the same order");
            all[index] = ROWS[index].method;
            index += 1;
        }
        all
    };

    fn row(self) -> &'static Row {
        &ROWS[self as usize]
    }

    /// Its name, as users write it.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// What it builds.
    pub fn recipe(self) -> Recipe {
        self.row().recipe
    }

    /// How often a build goes through all triangles.
    pub(super) fn passes(self) -> u64 {
        self.row().passes
    }

    /// The method of that name.
    ///
    /// # Errors
    /// [`Error::Config`] lists the names there are.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|method| method.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::Config(format!("there is no method '{name}'; choose one of: {names}"))
        })
    }
}
