//! `Accelerator`.

use std::{sync::Arc, time::Instant};

use espalier_core::{self as core, Error, Method, accel::cells::CellFilter, traverse::probe::Counts};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, List},
    cells::Cells,
    census, config, decisions,
    errors::{OrRaise, guard},
    hits::{Hits, Room},
    job::Job,
    mesh::Mesh,
    rays::{Given, RayArrays},
};

/// A mesh with a structure that rays walk. Immutable, and safe to share between threads; make one with `build`.
///
/// All queries take the same rays:
///
/// origins, directions: (n, 3) float32, finite; a direction may have any length but zero.
/// tmin, tmax: numbers or (n,) float32: the interval of interest, both ends included, in lengths of
/// the direction; from 0 to infinity if left out.
/// threads: 0 for all the machine has.
/// job: to watch and cancel the query from another thread.
///
/// Arrays are read in place by any strides that are not negative, so columns of other arrays and
/// numpy.broadcast_to(origin, (n, 3)) cost no copy; other floats and integers of up to 16 bits are converted first.
/// They must not be written to during the call, which lets other Python threads run. Results depend on the rays alone,
/// not on the number of threads; among hits at equal t the triangle of least index is reported, by every method alike.
///
/// Queries raise RayError, which names the first ray at fault, ConfigError for a bad number of threads, Cancelled, and
/// OutOfMemory.
#[pyclass(frozen, module = "espalier_rt")]
pub struct Accelerator {
    accelerator: Arc<core::Accelerator>,
    mesh: Py<Mesh>,
    build_ms: f64,
}

#[pymethods]
impl Accelerator {
    /// Build the structure of a mesh.
    ///
    /// method: one of methods().
    /// config: settings by name, those left out as in default_config(method).
    /// threads: 0 for all the machine has; the structure does not depend on it.
    /// job: to watch and cancel the build from another thread.
    ///
    /// Raises ConfigError for an unknown method or setting or a value out of range, Cancelled, and OutOfMemory.
    #[staticmethod]
    #[pyo3(signature = (mesh, method="hybrid", config=None, threads=0, job=None))]
    fn build(
        mesh: &Bound<'_, Mesh>,
        method: &str,
        config: Option<&Bound<'_, PyAny>>,
        threads: i64,
        job: Option<&Bound<'_, Job>>,
    ) -> PyResult<Self> {
        let py = mesh.py();
        guard(py, || {
            let method = Method::from_name(method).or_raise(py)?;
            let config = config::from_mapping(py, method, config)?;
            let (threads, job) = (config::threads(py, threads)?, Job::shared(job));
            let core_mesh = Arc::clone(mesh.get().core());
            let start = Instant::now();
            let accelerator = py.detach(|| core::Accelerator::build(core_mesh, method, &config, threads, &job));
            let build_ms = start.elapsed().as_secs_f64() * 1e3;
            Ok(Self { accelerator: Arc::new(accelerator.or_raise(py)?), mesh: mesh.clone().unbind(), build_ms })
        })
    }

    /// The name of the method it was built by.
    #[getter]
    fn method(&self) -> &'static str {
        self.accelerator.method().name()
    }

    /// The mesh it was built over.
    #[getter]
    fn mesh(&self, py: Python<'_>) -> Py<Mesh> {
        self.mesh.clone_ref(py)
    }

    /// The closest hit of every ray in its interval. See the class for the rays and for errors.
    #[pyo3(signature = (origins, directions, tmin=Given(None), tmax=Given(None), *, threads=0, job=None))]
    fn closest(
        &self,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        tmin: Given<'_>,
        tmax: Given<'_>,
        threads: i64,
        job: Option<&Bound<'_, Job>>,
    ) -> PyResult<Hits> {
        let py = origins.py();
        guard(py, || {
            let rays = RayArrays::new(origins, directions, &tmin, &tmax)?;
            let (threads, job) = (config::threads(py, threads)?, Job::shared(job));
            let mut room = Room::new(py, rays.len())?;
            let (batch, hits) = (rays.view().or_raise(py)?, room.view()?);
            py.detach(|| self.accelerator.closest(&batch, hits, threads, &job)).or_raise(py)?;
            Ok(room.hits(Arc::clone(self.accelerator.mesh()), threads))
        })
    }

    /// Whether anything lies in the interval of every ray: (n,) bool. See the class for the rays and for errors.
    #[pyo3(signature = (origins, directions, tmin=Given(None), tmax=Given(None), *, threads=0, job=None))]
    fn occluded(
        &self,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        tmin: Given<'_>,
        tmax: Given<'_>,
        threads: i64,
        job: Option<&Bound<'_, Job>>,
    ) -> PyResult<List<bool>> {
        let py = origins.py();
        guard(py, || {
            let rays = RayArrays::new(origins, directions, &tmin, &tmax)?;
            let (threads, job) = (config::threads(py, threads)?, Job::shared(job));
            let mut occluded = arrays::empty(py, rays.len())?;
            let (batch, out) = (rays.view().or_raise(py)?, occluded.as_slice_mut()?);
            py.detach(|| self.accelerator.occluded(&batch, out, threads, &job)).or_raise(py)?;
            Ok(arrays::returned(occluded))
        })
    }

    /// What the closest-hit query of every ray costs: traversal steps (nodes and grid cells visited) and ray-triangle
    /// tests, both (n,) uint32. See the class for the rays and for errors.
    #[pyo3(signature = (origins, directions, tmin=Given(None), tmax=Given(None), *, threads=0, job=None))]
    fn counted(
        &self,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        tmin: Given<'_>,
        tmax: Given<'_>,
        threads: i64,
        job: Option<&Bound<'_, Job>>,
    ) -> PyResult<(List<u32>, List<u32>)> {
        let py = origins.py();
        guard(py, || {
            let rays = RayArrays::new(origins, directions, &tmin, &tmax)?;
            let (threads, job) = (config::threads(py, threads)?, Job::shared(job));
            let (mut steps, mut tests) = (arrays::empty(py, rays.len())?, arrays::empty(py, rays.len())?);
            let batch = rays.view().or_raise(py)?;
            let (step_slice, test_slice) = (steps.as_slice_mut()?, tests.as_slice_mut()?);
            let work = || -> Result<(), Error> {
                let counts = self.counts(&batch, threads, &job)?;
                for ((count, steps), tests) in counts.iter().zip(step_slice).zip(test_slice) {
                    (*steps, *tests) = (count.steps, count.tests);
                }
                Ok(())
            };
            py.detach(work).or_raise(py)?;
            Ok((arrays::returned(steps), arrays::returned(tests)))
        })
    }

    /// What the structure consists of and what its build took, in numbers, by name:
    ///
    /// method; triangles of the mesh; nodes (wide branches), leaves, grids; cells of all grids and empty_cells among
    /// them; references (triangles in leaves and cells, each as often as it occurs); bytes held without the mesh;
    /// max_depth and depth_histogram (branches, leaves and grids at every depth, the root's first); sah_cost (what a
    /// line through the scene's box costs, in visits of a wide node); phases (milliseconds of wall time by name) and
    /// build_ms (of the whole build).
    fn census<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        guard(py, || census::to_dict(py, &self.accelerator, self.build_ms))
    }

    /// The boxes of the structure, for drawing: see Cells.
    ///
    /// max_depth: no box below this depth, where the root has 0; None for all.
    /// occupied_only: no grid cell without a triangle.
    /// max_count: no more boxes than this; those nearest to the root are kept, and Cells.truncated tells. None for all.
    ///
    /// Raises ConfigError for a number below 0, and OutOfMemory.
    #[pyo3(signature = (*, max_depth=None, occupied_only=false, max_count=None))]
    fn cells(
        &self,
        py: Python<'_>,
        max_depth: Option<i64>,
        occupied_only: bool,
        max_count: Option<i64>,
    ) -> PyResult<Cells> {
        guard(py, || {
            let whole = |name, value: Option<i64>| value.map(|v| config::whole(py, name, v, i64::MAX)).transpose();
            let filter = CellFilter {
                max_depth: whole("max_depth", max_depth)?,
                occupied_only,
                max_count: whole("max_count", max_count)?,
            };
            Cells::new(py, &py.detach(|| self.accelerator.cells(&filter)).or_raise(py)?)
        })
    }

    /// The evidence of a hybrid's decisions, one row a node it decided on, from the root down; no rows for other
    /// methods. Read-only arrays by name:
    ///
    /// lower, upper (k, 3) float32: tight box. depth (k,) uint32: the root has 0. primitives (k,) uint32: triangles.
    /// rays, hits (k,) uint32: sample rays traced and how many hit. spread (k,) float32: index of dispersion of the
    /// hits over the strata. hit_threshold, spread_threshold (k,) float32: what they were compared with. cost_grid,
    /// cost_bvh (k,) float32: expected nanoseconds. verdict (k,) uint8: 0 split on, 1 grid, 2 leaf. Numbers without use
    /// are nan.
    fn decisions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        guard(py, || decisions::to_dict(py, self.accelerator.decisions()))
    }

    /// What each builder that `hybrid` chose from was expected to cost: nanoseconds of building and of tracing the rays to
    /// come (`expected_rays` of the config), by name, the least first, which was taken. The builders are "lazy" (cells that
    /// become hierarchies when a ray reaches them) and those of "lbvh", "bvh-clusters" and "bvh-sah", the last with grids
    /// where they pay. Empty for other methods.
    fn choice<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        guard(py, || {
            let dict = PyDict::new(py);
            for estimate in self.accelerator.choice() {
                dict.set_item(estimate.builder.name(), estimate.nanoseconds)?;
            }
            Ok(dict)
        })
    }

    fn __repr__(&self) -> String {
        let mesh = self.accelerator.mesh();
        format!("Accelerator(method='{}', triangles={})", self.method(), mesh.triangles().len())
    }
}

impl Accelerator {
    /// The core's accelerator.
    pub fn core(&self) -> &core::Accelerator {
        &self.accelerator
    }

    fn counts(&self, rays: &core::Rays<'_>, threads: usize, job: &core::Job) -> Result<Vec<Counts>, Error> {
        let mut counts = arrays::reserve(rays.len(), "the rays' costs")?;
        counts.resize(rays.len(), Counts::default());
        self.core().counted(rays, &mut counts, threads, job)?;
        Ok(counts)
    }
}
