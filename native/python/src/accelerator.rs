//! `Accelerator`.

use std::sync::Arc;

use espalier_core::{self as core, Error, Method, traverse::probe::Counts};
use pyo3::prelude::*;

use crate::{
    arrays::{self, List},
    config,
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
/// tmin, tmax: numbers or (n,) float32: the interval of interest, both ends included, in lengths of the direction.
/// threads: 0 for all the machine has.
/// job: to watch and cancel the query from another thread.
///
/// Arrays are read in place by any strides that are not negative, so columns of other arrays and
/// numpy.broadcast_to(origin, (n, 3)) cost no copy; other floats and integers of up to 16 bits are converted first. They
/// must not be written to during the call, which lets other Python threads run. Results depend on the rays alone, not
/// on the number of threads; among hits at equal t the triangle of least index is reported, by every method alike.
///
/// Queries raise RayError, which names the first ray at fault, ConfigError for a bad number of threads, Cancelled, and
/// OutOfMemory.
#[pyclass(frozen, module = "espalier_rt")]
pub struct Accelerator {
    accelerator: Arc<core::Accelerator>,
    mesh: Py<Mesh>,
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
    #[pyo3(signature = (mesh, method="hybrid-sampled", config=None, threads=0, job=None))]
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
            let accelerator = py.detach(|| core::Accelerator::build(core_mesh, method, &config, threads, &job));
            Ok(Self { accelerator: Arc::new(accelerator.or_raise(py)?), mesh: mesh.clone().unbind() })
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
        let mut counts = Vec::new();
        let bytes = rays.len().saturating_mul(size_of::<Counts>());
        counts.try_reserve_exact(rays.len()).map_err(|_| Error::OutOfMemory { what: "the rays' costs", bytes })?;
        counts.resize(rays.len(), Counts::default());
        self.core().counted(rays, &mut counts, threads, job)?;
        Ok(counts)
    }
}
