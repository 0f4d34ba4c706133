//! What to measure: the JSON that `tests/bench/run.py` writes from its definitions.

use std::{
    num::NonZero,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// One scene, and the classes to measure on it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// The shared library of Embree; only racing needs it.
    pub library: Option<PathBuf>,
    /// Threads of both sides.
    pub threads: usize,
    /// Instruction set of both sides; each side's best where absent.
    pub isa: Option<String>,
    /// Rounds of a race; short ones have more.
    pub rounds: usize,
    /// A race ends after the round in which this much time has passed, but not before its third.
    pub seconds: f64,
    /// Methods that take this many times as long as the fastest leave the race after its second round; none where absent.
    #[serde(default)]
    pub hopeless: Option<f64>,
    /// Pixels along each side of the image, a multiple of 8.
    pub resolution: usize,
    /// Where given, [`Method::Fellner`](espalier_core::Method::Fellner) stands for a single grid over the whole scene, of
    /// so many cells a triangle, whose cells are leaves, or small hierarchies where more triangles than a leaf's lie in
    /// them. Such a grid has no method of its own; that one can make it.
    #[serde(default)]
    pub grid_of_leaves: Option<f64>,
    /// What is looked at.
    pub scene: SceneFile,
    /// What is measured.
    pub classes: Vec<Class>,
}

/// Where a scene's arrays are, and how it is looked at.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Its name in the results.
    pub name: String,
    /// File of little-endian float32 triples.
    pub vertices: PathBuf,
    /// File of little-endian uint32 triples.
    pub triangles: PathBuf,
    /// Seed of all random numbers that make its rays.
    pub seed: u64,
    /// Where the rays start.
    pub camera: CameraPlan,
}

/// A camera in terms that fit any mesh.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPlan {
    /// Half of the image's width over the focal length.
    pub slope: f64,
    /// The direction that is up in the image.
    pub up: [f64; 3],
    /// Where it stands.
    pub place: Place,
}

/// Where a camera stands.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Place {
    /// In this direction from the middle of the mesh, at the least distance from which all of it is in the image.
    Outside([f64; 3]),
    /// Between two points given in shares of the mesh's box: from the first it looks at the second.
    Inside([[f64; 3]; 2]),
}

/// Something to measure.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Class {
    /// Its name in the results.
    pub name: String,
    /// Our methods, each a row.
    pub methods: Vec<String>,
    /// What is done.
    pub kind: Kind,
    /// Embree's builds that count as the rival; the fastest in the end is quoted.
    pub rival: Vec<Quality>,
    /// Embree's builds that are shown beside it.
    #[serde(default)]
    pub beside: Vec<Quality>,
    /// What is traced; the rays of [`Kind::Image`] are the primary ones.
    #[serde(default)]
    pub rays: RayPlan,
    /// What is asked about each ray.
    #[serde(default)]
    pub query: Query,
    /// Rays of one call of ours; all of them where absent. A single one is traced by a walker.
    #[serde(default)]
    pub batch: Option<NonZero<usize>>,
}

/// What a class does with its rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Trace all rays with as few calls as each side likes.
    Batch,
    /// Trace all rays with one call each.
    Single,
    /// Build.
    Build,
    /// Build from raw arrays, then trace all rays.
    Image,
    /// Count the bytes of what was built.
    Memory,
}

/// How Embree builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quality {
    /// `RTC_BUILD_QUALITY_LOW`: Morton codes.
    Low,
    /// `RTC_BUILD_QUALITY_MEDIUM`: binned SAH.
    Medium,
    /// `RTC_BUILD_QUALITY_HIGH`: SAH with spatial splits.
    High,
    /// Medium with `RTC_SCENE_FLAG_ROBUST`.
    Robust,
}

/// Which rays a class traces.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum RayPlan {
    /// From the camera, one a pixel, in the order of 8 x 8 blocks.
    #[default]
    Primary,
    /// Cosine-distributed from where each primary ray hit; they end after this share of the diagonal of the mesh's
    /// box, or never.
    Bounce {
        /// Share of the diagonal.
        reach: Option<f64>,
    },
    /// In no order, from anywhere in the mesh's box to anywhere; they end as those of [`RayPlan::Bounce`] do.
    Inside {
        /// How many.
        count: usize,
        /// Share of the diagonal.
        reach: Option<f64>,
    },
}

/// What is asked about a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Query {
    /// The closest hit.
    #[default]
    Closest,
    /// Whether there is any.
    Any,
}

impl Plan {
    /// Read and check a plan.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::Plan`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.into(), source })?;
        let plan: Self = serde_json::from_str(&text).map_err(|error| Error::Plan(error.to_string()))?;
        let whole = plan.resolution > 0 && plan.resolution.is_multiple_of(8);
        if plan.threads == 0 || plan.rounds == 0 || !whole {
            return Err(Error::Plan(
                "threads, rounds and resolution must be above 0, resolution a multiple of 8".into(),
            ));
        }
        Ok(plan)
    }
}

impl Quality {
    /// As results name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::Robust => "robust",
        }
    }
}
