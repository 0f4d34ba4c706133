//! Settings of builders to and from Python.

use espalier_core::{
    Config, Method,
    accel::method::{Finish, Hierarchy, Lattice, Recipe},
};
use pyo3::{
    prelude::*,
    types::{PyBool, PyDict, PyMapping},
};

use crate::errors::Kind;

/// A field of [`Config`]: how to read it and how to write it.
enum Field {
    /// A whole number that is not negative.
    Whole(fn(&Config) -> u64, fn(&mut Config, u64) -> Option<()>),
    /// A number.
    Real(fn(&Config) -> f64, fn(&mut Config, f64)),
}

/// Which methods read a setting. Those that all know may be without effect on some, so that a caller can give the same
/// to every method.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Readers {
    All,
    Sah,
    Splits,
    Clusters,
    Reinserted,
    Grids,
    Samples,
    Sequential,
    Window,
    Sampled,
    Gain,
    Cost,
    Recipe(Recipe),
}

impl Readers {
    fn include(self, method: Method) -> bool {
        let recipe = method.recipe();
        match self {
            Self::All => true,
            Self::Sah => matches!(
                recipe,
                Recipe::Hierarchy(Hierarchy::Sah | Hierarchy::Spatial, _)
                    | Recipe::Hapala
                    | Recipe::Fellner
                    | Recipe::Cheapest
            ),
            Self::Splits => matches!(recipe, Recipe::Hierarchy(Hierarchy::Spatial, _)),
            Self::Clusters => matches!(recipe, Recipe::Hierarchy(Hierarchy::LocallyOrdered, _)),
            Self::Reinserted => matches!(recipe, Recipe::Hierarchy(_, Finish::Reinserted)),
            Self::Grids => !matches!(recipe, Recipe::Hierarchy(..)),
            Self::Samples => matches!(recipe, Recipe::Sampled | Recipe::Cheapest | Recipe::Hapala),
            Self::Sequential => recipe == Recipe::Sequential,
            Self::Window => {
                matches!(recipe, Recipe::Sampled | Recipe::Sequential | Recipe::Cheapest | Recipe::Fellner)
            }
            Self::Sampled => matches!(recipe, Recipe::Sampled | Recipe::Sequential),
            Self::Gain => matches!(recipe, Recipe::Cheapest | Recipe::Fellner),
            Self::Cost => matches!(
                recipe,
                Recipe::Cheapest | Recipe::Lattice(Lattice::Irregular) | Recipe::Hapala | Recipe::Fellner
            ),
            Self::Recipe(wanted) => recipe == wanted,
        }
    }
}

macro_rules! whole {
    ($($path:ident).+) => {
        Field::Whole(|config| config.$($path).+ as u64, |config, value| {
            config.$($path).+ = value.try_into().ok()?;
            Some(())
        })
    };
}

macro_rules! real {
    ($($path:ident).+) => {
        Field::Real(|config| config.$($path).+, |config, value| config.$($path).+ = value)
    };
}

/// Every setting, by name.
const FIELDS: &[(&str, Readers, Field)] = &[
    ("seed", Readers::All, whole!(seed)),
    ("expected_rays", Readers::All, real!(expected_rays)),
    ("leaf_size", Readers::All, whole!(leaf_size)),
    ("sah_bins", Readers::Sah, whole!(sah_bins)),
    ("split_budget", Readers::Splits, real!(split_budget)),
    ("split_overlap", Readers::Splits, real!(split_overlap)),
    ("cluster_radius", Readers::Clusters, whole!(cluster_radius)),
    ("reinsert_rounds", Readers::Reinserted, whole!(reinsert_rounds)),
    ("grid_density", Readers::Grids, real!(grid_density)),
    ("grid_most_cells", Readers::Grids, whole!(grid_most_cells)),
    ("coarse_density", Readers::Recipe(Recipe::Lattice(Lattice::TwoLevel)), real!(coarse_density)),
    ("fine_density", Readers::Recipe(Recipe::Lattice(Lattice::TwoLevel)), real!(fine_density)),
    ("expansions", Readers::Recipe(Recipe::Lattice(Lattice::Irregular)), whole!(expansions)),
    ("nesting", Readers::Recipe(Recipe::Fellner), whole!(nesting)),
    ("hierarchy_nodes", Readers::Recipe(Recipe::Hapala), real!(hierarchy_nodes)),
    ("hierarchy_block_nodes", Readers::Recipe(Recipe::Hapala), real!(hierarchy_block_nodes)),
    ("hierarchy_blocks", Readers::Recipe(Recipe::Hapala), real!(hierarchy_blocks)),
    ("hierarchy_build", Readers::Recipe(Recipe::Hapala), real!(hierarchy_build)),
    ("sample_rays", Readers::Samples, real!(sample_rays)),
    ("sample_least", Readers::Samples, whole!(sample_least)),
    ("sample_most", Readers::Samples, whole!(sample_most)),
    ("confidence", Readers::Sequential, real!(confidence)),
    ("hit_threshold", Readers::Sampled, real!(hit_threshold)),
    ("spread_threshold", Readers::Sampled, real!(spread_threshold)),
    ("grid_least_triangles", Readers::Window, whole!(grid_least_triangles)),
    ("grid_most_triangles", Readers::Window, whole!(grid_most_triangles)),
    ("grid_gain", Readers::Gain, real!(grid_gain)),
    ("node_ns", Readers::Cost, real!(cost.node_ns)),
    ("block_ns", Readers::Cost, real!(cost.block_ns)),
    ("cell_ns", Readers::Cost, real!(cost.cell_ns)),
    ("gather_ns", Readers::Cost, real!(cost.gather_ns)),
    ("reference_ns", Readers::Cost, real!(cost.reference_ns)),
];

fn fields(method: Method) -> impl Iterator<Item = &'static (&'static str, Readers, Field)> {
    FIELDS.iter().filter(move |(_, readers, _)| readers.include(method))
}

/// The settings that `method` knows.
pub fn to_dict<'py>(py: Python<'py>, method: Method, config: &Config) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, _, field) in fields(method) {
        match field {
            Field::Whole(get, _) => dict.set_item(name, get(config))?,
            Field::Real(get, _) => dict.set_item(name, get(config))?,
        }
    }
    Ok(dict)
}

/// The settings that say what a traversal costs.
pub fn costs<'py>(py: Python<'py>, config: &Config) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, _, field) in FIELDS.iter().filter(|(name, _, _)| name.ends_with("_ns")) {
        if let Field::Real(get, _) = field {
            dict.set_item(name, get(config))?;
        }
    }
    Ok(dict)
}

/// The default settings, with those of a mapping instead.
///
/// # Errors
/// ConfigError for something that is not a mapping, a name that `method` does not know, or a value of another type.
pub fn from_mapping(py: Python<'_>, method: Method, mapping: Option<&Bound<'_, PyAny>>) -> PyResult<Config> {
    let mut config = Config::default();
    let Some(mapping) = mapping else { return Ok(config) };
    let mapping = mapping.cast::<PyMapping>().map_err(|_| {
        Kind::Config.error(py, format!("config must be a mapping of settings, or None; got {}", mapping.get_type()))
    })?;
    for item in mapping.items()? {
        let (name, value) = item.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>()?;
        set(&mut config, method, &name.str()?.to_string(), &value)?;
    }
    Ok(config)
}

fn set(config: &mut Config, method: Method, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let Some((_, _, field)) = fields(method).find(|(known, ..)| *known == name) else {
        let known: Vec<_> = fields(method).map(|(name, ..)| *name).collect();
        let message = format!("{} has no setting '{name}'; it has: {}", method.name(), known.join(", "));
        return Err(Kind::Config.error(value.py(), message));
    };
    let done = match field {
        _ if value.is_instance_of::<PyBool>() => None,
        Field::Whole(_, set) => value.extract().ok().and_then(|value| set(config, value)),
        Field::Real(_, set) => value.extract().ok().map(|value| set(config, value)),
    };
    done.ok_or_else(|| {
        let need = if matches!(field, Field::Whole(..)) { "a whole number, 0 or more" } else { "a number" };
        let got = value.repr().map_or_else(|_| value.get_type().to_string(), |text| text.to_string());
        Kind::Config.error(value.py(), format!("{name} must be {need}; got {got}"))
    })
}

/// More threads than this are a mistake.
const MOST_THREADS: i64 = 1024;

/// A number of threads, 0 for all the machine has.
///
/// # Errors
/// ConfigError.
pub fn threads(py: Python<'_>, threads: i64) -> PyResult<usize> {
    whole(py, "threads", threads, MOST_THREADS)
}

/// A whole number from 0 to `most`.
///
/// # Errors
/// ConfigError.
pub fn whole(py: Python<'_>, name: &str, value: i64, most: i64) -> PyResult<usize> {
    let fault = || Kind::Config.error(py, format!("{name} is {value}; it must be from 0 to {most}"));
    if value > most { Err(fault()) } else { value.try_into().map_err(|_| fault()) }
}
