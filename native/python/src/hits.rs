//! `Hits`.

use std::sync::Arc;

use espalier_core::{Error, HitsMut, Job, Mesh, ray::MISS, work};
use numpy::{PyArrayMethods, PyReadwriteArray1};
use pyo3::{prelude::*, sync::PyOnceLock};

use crate::{
    arrays::{self, List, Table},
    errors::{OrRaise, guard},
    paged,
};

/// What a closest-hit query found, one element a ray, in read-only arrays.
///
/// The hit point of ray i is `origins[i] + t[i] * directions[i]`, and also `(1-u-v)*v0 + u*v1 + v*v2` over the corners
/// of triangle `primitive[i]`. A ray that hit nothing has t = inf, primitive = MISS (0xFFFFFFFF) and u = v = 0.
#[pyclass(frozen, module = "espalier_rt")]
pub struct Hits {
    mesh: Arc<Mesh>,
    threads: usize,
    /// (n,) float32: distance to the hit in lengths of the ray's direction; inf where nothing was hit.
    #[pyo3(get)]
    t: List<f32>,
    /// (n,) uint32: index of the triangle hit; MISS where nothing was hit.
    #[pyo3(get)]
    primitive: List<u32>,
    /// (n,) float32: weight of the triangle's second corner in the hit point.
    #[pyo3(get)]
    u: List<f32>,
    /// (n,) float32: weight of the triangle's third corner in the hit point.
    #[pyo3(get)]
    v: List<f32>,
    normal: PyOnceLock<Table<f32>>,
}

/// New arrays, for a query to write to.
pub struct Room<'py> {
    t: PyReadwriteArray1<'py, f32>,
    primitive: PyReadwriteArray1<'py, u32>,
    u: PyReadwriteArray1<'py, f32>,
    v: PyReadwriteArray1<'py, f32>,
}

impl<'py> Room<'py> {
    /// Room for the hits of `count` rays.
    pub fn new(py: Python<'py>, count: usize) -> PyResult<Self> {
        Ok(Self {
            t: paged::empty(py, count)?,
            primitive: paged::empty(py, count)?,
            u: paged::empty(py, count)?,
            v: paged::empty(py, count)?,
        })
    }

    /// The core's view of it.
    pub fn view(&mut self) -> PyResult<HitsMut<'_>> {
        Ok(HitsMut {
            t: self.t.as_slice_mut()?,
            primitive: self.primitive.as_slice_mut()?,
            u: self.u.as_slice_mut()?,
            v: self.v.as_slice_mut()?,
        })
    }

    /// The hits, once they are written.
    pub fn hits(self, mesh: Arc<Mesh>, threads: usize) -> Hits {
        Hits {
            mesh,
            threads,
            t: arrays::finished(self.t),
            primitive: arrays::finished(self.primitive),
            u: arrays::finished(self.u),
            v: arrays::finished(self.v),
            normal: PyOnceLock::new(),
        }
    }
}

#[pymethods]
impl Hits {
    /// (n, 3) float32: unit geometric normal of the triangle hit, by the right-hand rule over its corners; zero where
    /// nothing was hit. Computed on first use.
    #[getter]
    fn normal(&self, py: Python<'_>) -> PyResult<Table<f32>> {
        guard(py, || {
            let normal = self.normal.get_or_try_init(py, || self.normals(py))?;
            Ok(normal.clone_ref(py))
        })
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.t.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let primitive = self.primitive.bind(py).try_readonly().map_err(PyErr::from)?;
        let primitive = primitive.as_slice()?;
        let hit = primitive.iter().filter(|&&primitive| primitive != MISS).count();
        Ok(format!("Hits(rays={}, hit={hit})", primitive.len()))
    }
}

/// Normals that a thread computes at a time.
const PART: usize = 1 << 14;

impl Hits {
    fn normals(&self, py: Python<'_>) -> PyResult<Table<f32>> {
        let primitive = self.primitive.bind(py).try_readonly()?;
        let primitive = primitive.as_slice()?;
        let mut normal = arrays::empty_table::<f32>(py, primitive.len(), 3)?;
        let (rows, _) = normal.as_slice_mut()?.as_chunks_mut::<3>();
        let parts = primitive.chunks(PART).zip(rows.chunks_mut(PART));
        py.detach(|| work::for_each(self.threads, parts, &Job::new(), |(primitive, rows)| self.fill(primitive, rows)))
            .or_raise(py)?;
        Ok(arrays::finished(normal))
    }

    fn fill(&self, primitive: &[u32], normals: &mut [[f32; 3]]) -> Result<(), Error> {
        for (&primitive, normal) in primitive.iter().zip(normals) {
            *normal = if primitive == MISS { [0.0; 3] } else { self.mesh.normal(primitive).to_array() };
        }
        Ok(())
    }
}
