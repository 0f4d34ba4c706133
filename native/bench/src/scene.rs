//! A scene ready to be measured: its arrays, its mesh, what has been built over it, and the rays of its classes.

use std::{
    cell::{OnceCell, RefCell},
    collections::HashMap,
    path::Path,
    sync::Arc,
};

use espalier_core::{Accelerator, Config, Hits, Job, Mesh, Method, accel::config::CostConstants, simd::Level};
use glam::Vec3;

use crate::{
    camera::Camera,
    embree::Arrays,
    error::Error,
    plan::{Plan, RayPlan},
    rays::{self, RayColumns},
};

/// The method whose hits the bounces start from; all methods agree to the bit.
const REFERENCE: Method = Method::BvhSah;

/// See the module's text.
pub struct Scene<'a> {
    /// What to measure.
    pub plan: &'a Plan,
    /// As Embree and [`Scene::new_mesh`] read them.
    pub arrays: Arrays,
    /// As Espalier holds them.
    pub mesh: Arc<Mesh>,
    level: Level,
    primary: OnceCell<RayColumns>,
}

impl<'a> Scene<'a> {
    /// Read the arrays.
    ///
    /// # Errors
    /// [`Error::Read`]; [`Error::Plan`] for a mesh of no triangles or an instruction set we have not;
    /// [`Error::Core`].
    pub fn read(plan: &'a Plan) -> Result<Self, Error> {
        let vertices: Vec<[f32; 3]> = triples(&plan.scene.vertices, f32::from_le_bytes)?;
        let triangles: Vec<[u32; 3]> = triples(&plan.scene.triangles, u32::from_le_bytes)?;
        if triangles.is_empty() {
            return Err(Error::Plan(format!("{} has no triangles", plan.scene.name)));
        }
        let arrays = Arrays::new(&vertices, triangles);
        let mesh = new_mesh(&arrays)?;
        Ok(Self { plan, arrays, mesh, level: level(plan.isa.as_deref())?, primary: OnceCell::new() })
    }

    /// The instruction set of our side.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Build, as any caller would.
    ///
    /// # Errors
    /// [`Error::Core`].
    pub fn build(&self, mesh: Arc<Mesh>, method: Method) -> Result<Accelerator, Error> {
        let config = match (method, self.plan.grid_of_leaves) {
            (Method::Fellner, Some(density)) => grid_of_leaves(density, mesh.solid_count()),
            _ => Config::default(),
        };
        let built = Accelerator::build(mesh, method, &config, self.plan.threads, &Job::new())?;
        Ok(built.with_level(self.level))
    }

    /// The primary rays.
    pub fn primary(&self) -> &RayColumns {
        self.primary.get_or_init(|| {
            let camera = Camera::new(&self.plan.scene.camera, self.mesh.vertices());
            rays::primary(&camera, self.plan.resolution, self.plan.scene.seed)
        })
    }

    /// The rays of a class.
    ///
    /// # Errors
    /// [`Error::Core`].
    pub fn rays(&self, plan: RayPlan, built: &Built<'_>) -> Result<RayColumns, Error> {
        let seed = self.plan.scene.seed;
        let reach = match plan {
            RayPlan::Primary => return Ok(self.primary().clone()),
            RayPlan::Inside { count, reach } => return Ok(rays::inside(&self.mesh, count, reach, seed)),
            RayPlan::Bounce { reach } => reach,
        };
        let primary = self.primary();
        let mut hits = Hits::misses(primary.len());
        built.get(REFERENCE)?.closest(&primary.rays(), hits.as_mut(), self.plan.threads, &Job::new())?;
        Ok(rays::bounce(&self.mesh, &primary.rays(), &hits, reach, seed))
    }
}

/// A mesh from raw arrays, copied and checked.
///
/// # Errors
/// [`Error::Core`].
pub fn new_mesh(arrays: &Arrays) -> Result<Arc<Mesh>, Error> {
    let mesh = Mesh::written(arrays.vertices().len(), arrays.triangles().len(), |vertices, triangles| {
        let pairs = vertices.iter_mut().zip(arrays.vertices());
        pairs.for_each(|(to, &from)| *to = Vec3::from_array(from));
        triangles.copy_from_slice(arrays.triangles());
        Ok::<(), espalier_core::Error>(())
    });
    Ok(Arc::new(mesh?))
}

/// Our accelerators over a scene, each built once.
pub struct Built<'a> {
    scene: &'a Scene<'a>,
    accelerators: RefCell<HashMap<Method, Arc<Accelerator>>>,
}

impl<'a> Built<'a> {
    /// None yet.
    pub fn new(scene: &'a Scene<'a>) -> Self {
        Self { scene, accelerators: RefCell::default() }
    }

    /// The accelerator of a method.
    ///
    /// # Errors
    /// [`Error::Core`].
    pub fn get(&self, method: Method) -> Result<Arc<Accelerator>, Error> {
        if let Some(accelerator) = self.accelerators.borrow().get(&method) {
            return Ok(accelerator.clone());
        }
        let accelerator = Arc::new(self.scene.build(self.scene.mesh.clone(), method)?);
        let Plan { grid_of_leaves, .. } = self.scene.plan;
        if method == Method::Fellner && grid_of_leaves.is_some() && accelerator.census().grids != 1 {
            return Err(Error::Plan(format!("{} does not become one grid of leaves", self.scene.plan.scene.name)));
        }
        self.accelerators.borrow_mut().insert(method, accelerator.clone());
        Ok(accelerator)
    }
}

/// Settings with which [`Method::Fellner`] makes one grid of leaves of a scene: only its root may become a grid, and
/// nodes and lists are dear.
fn grid_of_leaves(density: f64, triangles: usize) -> Config {
    let cost = CostConstants { node_ns: 1e6, gather_ns: 1e6, block_ns: 0.1, cell_ns: 0.1, ..CostConstants::default() };
    Config {
        grid_density: density,
        grid_least_triangles: triangles,
        grid_most_triangles: triangles,
        grid_gain: 1.0,
        nesting: 1,
        cost,
        ..Config::default()
    }
}

fn level(isa: Option<&str>) -> Result<Level, Error> {
    let available = Level::available();
    let Some(isa) = isa else { return Ok(Level::detect()) };
    available.iter().copied().find(|level| level.name() == isa).ok_or_else(|| {
        let names = available.iter().map(|level| level.name()).collect::<Vec<_>>().join(", ");
        Error::Plan(format!("Espalier has no instruction set '{isa}' on this processor, only: {names}"))
    })
}

fn triples<T>(path: &Path, number: impl Fn([u8; 4]) -> T) -> Result<Vec<[T; 3]>, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::Read { path: path.into(), source })?;
    let (triples, rest) = bytes.as_chunks::<12>();
    if !rest.is_empty() {
        return Err(Error::Plan(format!("{} does not hold triples of four bytes", path.display())));
    }
    let part = |triple: &[u8; 12], k: usize| number([triple[k], triple[k + 1], triple[k + 2], triple[k + 3]]);
    Ok(triples.iter().map(|triple| [part(triple, 0), part(triple, 4), part(triple, 8)]).collect())
}
