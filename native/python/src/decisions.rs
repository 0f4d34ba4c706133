//! `Accelerator.decisions()`.

use espalier_core::accel::decision::Decision;
use numpy::Element;
use pyo3::{prelude::*, types::PyDict};

use crate::arrays::{self, List};

/// Every field as an array, by name.
pub fn to_dict<'py>(py: Python<'py>, decisions: &[Decision]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("lower", arrays::table(py, decisions.iter().map(|d| d.bounds.lower.to_array()))?)?;
    dict.set_item("upper", arrays::table(py, decisions.iter().map(|d| d.bounds.upper.to_array()))?)?;
    dict.set_item("depth", column(py, decisions, |d| d.depth)?)?;
    dict.set_item("primitives", column(py, decisions, |d| d.primitives)?)?;
    dict.set_item("rays", column(py, decisions, |d| d.rays)?)?;
    dict.set_item("hits", column(py, decisions, |d| d.hits)?)?;
    dict.set_item("sparseness", column(py, decisions, |d| d.sparseness)?)?;
    dict.set_item("spread", column(py, decisions, |d| d.spread)?)?;
    dict.set_item("hit_threshold", column(py, decisions, |d| d.hit_threshold)?)?;
    dict.set_item("spread_threshold", column(py, decisions, |d| d.spread_threshold)?)?;
    dict.set_item("cost_grid", column(py, decisions, |d| d.cost_grid)?)?;
    dict.set_item("cost_bvh", column(py, decisions, |d| d.cost_bvh)?)?;
    dict.set_item("verdict", column(py, decisions, |d| d.verdict as u8)?)?;
    Ok(dict)
}

fn column<T: Element>(py: Python<'_>, decisions: &[Decision], field: fn(&Decision) -> T) -> PyResult<List<T>> {
    arrays::list(py, decisions.iter().map(field))
}
