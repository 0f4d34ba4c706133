//! `Accelerator.census()`.

use espalier_core::Accelerator;
use pyo3::{prelude::*, types::PyDict};

/// The census as a dictionary; `build_ms` is the wall time of the whole build.
pub fn to_dict<'py>(py: Python<'py>, accelerator: &Accelerator, build_ms: f64) -> PyResult<Bound<'py, PyDict>> {
    let census = py.detach(|| accelerator.census());
    let phases = PyDict::new(py);
    for phase in accelerator.phases() {
        let before = phases.get_item(phase.name)?.map_or(Ok(0.0), |value| value.extract::<f64>())?;
        phases.set_item(phase.name, before + phase.milliseconds)?;
    }
    let dict = PyDict::new(py);
    dict.set_item("method", accelerator.method().name())?;
    dict.set_item("triangles", accelerator.mesh().triangles().len())?;
    dict.set_item("nodes", census.nodes)?;
    dict.set_item("leaves", census.leaves)?;
    dict.set_item("grids", census.grids)?;
    dict.set_item("cells", census.cells)?;
    dict.set_item("empty_cells", census.empty_cells)?;
    dict.set_item("lazy_cells", census.lazy_cells)?;
    dict.set_item("refined_cells", census.refined_cells)?;
    dict.set_item("references", census.references)?;
    dict.set_item("bytes", census.bytes)?;
    dict.set_item("max_depth", census.max_depth)?;
    dict.set_item("depth_histogram", census.depth_histogram)?;
    dict.set_item("sah_cost", census.sah_cost)?;
    dict.set_item("phases", phases)?;
    dict.set_item("build_ms", build_ms)?;
    Ok(dict)
}
