//! The module's functions.

use espalier_core::{Config, Method, accel::calibrate, simd::Level};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    config,
    errors::{OrRaise, guard},
};

/// The names of all methods that build accelerators.
#[pyfunction]
pub fn methods() -> Vec<&'static str> {
    Method::ALL.map(Method::name).to_vec()
}

/// The instruction set that queries use on this processor: "avx512", "avx2", "neon" or "portable".
#[pyfunction]
pub fn instruction_set() -> &'static str {
    Level::detect().name()
}

/// The settings of a method, with their default values: what `Accelerator.build` takes as `config`.
///
/// Raises ConfigError for an unknown method.
#[pyfunction]
pub fn default_config<'py>(py: Python<'py>, method: &str) -> PyResult<Bound<'py, PyDict>> {
    guard(py, || config::to_dict(py, Method::from_name(method).or_raise(py)?, &Config::default()))
}

/// What the steps of a traversal take on this machine, in nanoseconds, measured on one thread in a fraction of a second:
/// the settings that "hybrid" decides by, for `Accelerator.build`'s `config`.
///
/// The result varies a little from call to call. Measure once a machine and keep it: equal settings give equal trees.
/// Raises OutOfMemory.
#[pyfunction(name = "calibrate")]
pub fn calibrated(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    guard(py, || {
        let cost = py.detach(calibrate::calibrate).or_raise(py)?;
        config::costs(py, &Config { cost, ..Config::default() })
    })
}
