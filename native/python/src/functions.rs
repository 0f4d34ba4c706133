//! The module's functions.

use espalier_core::{Method, simd::Level};
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

/// The instruction set that queries use on this processor: "avx2" or "portable".
#[pyfunction]
pub fn instruction_set() -> &'static str {
    Level::detect().name()
}

/// The settings of a method, with their default values: what `Accelerator.build` takes as `config`.
///
/// Raises ConfigError for an unknown method.
#[pyfunction]
pub fn default_config<'py>(py: Python<'py>, method: &str) -> PyResult<Bound<'py, PyDict>> {
    guard(py, || config::to_dict(py, Method::from_name(method).or_raise(py)?, &espalier_core::Config::default()))
}
