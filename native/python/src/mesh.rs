//! `Mesh`.

use std::sync::Arc;

use espalier_core::Column;
use glam::Vec3;
use pyo3::prelude::*;

use crate::{
    arrays::{self, Argument, Rows, Table},
    errors::{Kind, OrRaise, guard},
    indices::Indices,
};

/// A triangle mesh, checked and copied once; immutable, and safe to share between threads.
///
/// vertices: (n, 3) float32, finite. Read in place by any strides that are not negative; other floats and integers of
/// up to 16 bits are converted.
/// triangles: (m, 3) uint32, each below n. Other integers that are not negative are converted.
///
/// The arrays must not be written to during the call. Triangles of exactly zero area stay in the numbering and are
/// never hit. A mesh without triangles is allowed: every ray misses it.
///
/// Raises MeshError, naming the first vertex or triangle at fault, and OutOfMemory.
#[pyclass(frozen, module = "espalier_rt")]
pub struct Mesh(Arc<espalier_core::Mesh>);

impl Mesh {
    /// The core's mesh.
    pub fn core(&self) -> &Arc<espalier_core::Mesh> {
        &self.0
    }
}

#[pymethods]
impl Mesh {
    #[new]
    fn new(vertices: &Bound<'_, PyAny>, triangles: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = vertices.py();
        guard(py, || {
            let vertices = Rows::table(vertices, 3, Argument { name: "vertices", error: Kind::Mesh })?;
            let triangles = Indices::<3>::new(triangles, Argument { name: "triangles", error: Kind::Mesh })?;
            let (columns, count, view) = (vertices.columns(), vertices.len(), triangles.view());
            let mesh = py.detach(|| {
                espalier_core::Mesh::written(count, view.len(), |vertices, triangles| {
                    write(columns, vertices);
                    view.write(triangles)
                })
            });
            Ok(Self(Arc::new(mesh.or_raise(py)?)))
        })
    }

    /// How many vertices there are.
    #[getter]
    fn vertex_count(&self) -> usize {
        self.0.vertices().len()
    }

    /// How many triangles there are, those of zero area included.
    #[getter]
    fn triangle_count(&self) -> usize {
        self.0.triangles().len()
    }

    /// How many triangles have exactly zero area; no ray hits them.
    #[getter]
    fn degenerate_count(&self) -> usize {
        self.0.degenerate_count()
    }

    /// (2, 3) float32: the least and the greatest corner of the box around all triangles that can be hit; inf and -inf
    /// where there is none.
    #[getter]
    fn bounds(&self, py: Python<'_>) -> PyResult<Table<f32>> {
        guard(py, || {
            let bounds = self.0.bounds();
            arrays::table(py, [bounds.lower.to_array(), bounds.upper.to_array()].into_iter())
        })
    }

    fn __repr__(&self) -> String {
        format!("Mesh(vertices={}, triangles={})", self.vertex_count(), self.triangle_count())
    }
}

/// Points from their coordinates.
fn write(columns: [Column<'_>; 3], points: &mut [Vec3]) {
    for (index, point) in points.iter_mut().enumerate() {
        *point = Vec3::from_array(columns.map(|column| column.get(index)));
    }
}
