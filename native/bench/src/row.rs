//! A line of results.

use std::{collections::BTreeMap, time::Duration};

use serde::Serialize;

use crate::{plan::Kind, verify::Comparison};

/// One class over one scene by one of our methods. A ratio above 1 means that Espalier is better.
#[derive(Debug, Default, Serialize)]
pub struct Row {
    /// Scene.
    pub scene: String,
    /// Class.
    pub class: String,
    /// Our method.
    pub method: &'static str,
    /// Our instruction set.
    pub isa: &'static str,
    /// Of `ours`, `embree` and `beside`.
    pub unit: &'static str,
    /// Our best round.
    pub ours: f64,
    /// The best round of Embree's best way.
    pub embree: f64,
    /// That way.
    pub embree_call: String,
    /// How many times better ours is.
    pub ratio: f64,
    /// Embree's other builds, the rest of the way as in `embree_call`.
    pub beside: BTreeMap<&'static str, f64>,
    /// How many rays there were.
    pub rays: usize,
    /// How many triangles there were.
    pub triangles: usize,
    /// How the answers compare.
    #[serde(flatten)]
    pub comparison: Comparison,
}

impl Row {
    /// A row that knows only its numbers.
    pub fn of(unit: Unit, ours: Duration, embree: Duration, beside: &[(&'static str, Duration)]) -> Self {
        Self {
            unit: unit.name(),
            ours: unit.value(ours),
            embree: unit.value(embree),
            ratio: embree.as_secs_f64() / ours.as_secs_f64(),
            beside: beside.iter().map(|&(name, time)| (name, unit.value(time))).collect(),
            ..Self::default()
        }
    }
}

/// One class over one scene by one of our methods, raced against the others of the class without Embree.
#[derive(Debug, Serialize)]
pub struct Turn {
    /// Scene.
    pub scene: String,
    /// Class.
    pub class: String,
    /// Our method.
    pub method: &'static str,
    /// Our instruction set.
    pub isa: &'static str,
    /// The best round.
    pub seconds: f64,
    /// How many rays there were.
    pub rays: usize,
    /// Of these, how many hit.
    pub hits: usize,
    /// How many are answered otherwise than by the class's first method.
    pub mismatches: usize,
    /// Traversal steps a ray, in the mean of a sample.
    pub steps: f64,
    /// Ray-triangle tests a ray, in the mean of the same sample.
    pub tests: f64,
}

/// What times are shown as.
#[derive(Debug, Clone, Copy)]
pub enum Unit {
    /// Millions of that many rays per second.
    Rate(usize),
    /// Milliseconds.
    Milliseconds,
    /// Bytes; in races a byte stands as a nanosecond.
    Bytes,
}

impl Unit {
    /// The unit of a class.
    pub fn new(kind: Kind, rays: usize) -> Self {
        match kind {
            Kind::Batch | Kind::Single => Self::Rate(rays),
            Kind::Build | Kind::Image => Self::Milliseconds,
            Kind::Memory => Self::Bytes,
        }
    }

    /// Bytes as a race takes them.
    pub fn weigh(bytes: usize) -> Duration {
        Duration::from_nanos(bytes as u64)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Rate(_) => "Mrays/s",
            Self::Milliseconds => "ms",
            Self::Bytes => "bytes",
        }
    }

    fn value(self, time: Duration) -> f64 {
        match self {
            Self::Rate(rays) => rays as f64 / time.as_secs_f64() / 1e6,
            Self::Milliseconds => time.as_secs_f64() * 1e3,
            Self::Bytes => time.as_nanos() as f64,
        }
    }
}
