//! Triangles' vertex indices from numpy integers of any type.

use espalier_core::Error;
use numpy::{Element, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::{
    arrays::{self, Argument},
    errors::Kind,
};

const ARGUMENT: Argument = Argument { name: "triangles", error: Kind::Mesh };
const NEED: &str = "a uint32 array of shape (m, 3)";

/// Vertex indices, borrowed from numpy. Types that are not here are copied to int64 first.
pub enum Indices<'py> {
    Unsigned(PyReadonlyArrayDyn<'py, u32>),
    Signed(PyReadonlyArrayDyn<'py, i32>),
    Long(PyReadonlyArrayDyn<'py, i64>),
    UnsignedLong(PyReadonlyArrayDyn<'py, u64>),
}

impl<'py> Indices<'py> {
    /// Borrow an integer array of shape (m, 3), copied first where its rows do not follow each other.
    ///
    /// # Errors
    /// MeshError for another shape or type.
    pub fn new(value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let py = value.py();
        let array = ARGUMENT.array(value, NEED)?;
        if array.ndim() != 2 || array.shape()[1] != 3 || !matches!(array.dtype().kind(), b'i' | b'u') {
            return Err(ARGUMENT.fault(py, NEED, &arrays::describe(&array)));
        }
        let array = py.import("numpy")?.call_method1("ascontiguousarray", (array,))?;
        if let Some(array) = borrow(&array)? {
            return Ok(Self::Unsigned(array));
        }
        if let Some(array) = borrow(&array)? {
            return Ok(Self::Signed(array));
        }
        if let Some(array) = borrow(&array)? {
            return Ok(Self::UnsignedLong(array));
        }
        let array = array.call_method1("astype", (numpy::dtype::<i64>(py),))?;
        borrow(&array)?.map(Self::Long).ok_or_else(|| ARGUMENT.fault(py, NEED, "something else"))
    }

    /// The triangles.
    pub fn view(&self) -> View<'_> {
        match self {
            Self::Unsigned(array) => View::Unsigned(array.as_slice().unwrap_or_default()),
            Self::Signed(array) => View::Signed(array.as_slice().unwrap_or_default()),
            Self::Long(array) => View::Long(array.as_slice().unwrap_or_default()),
            Self::UnsignedLong(array) => View::UnsignedLong(array.as_slice().unwrap_or_default()),
        }
    }
}

fn borrow<'py, T: Element>(array: &Bound<'py, PyAny>) -> PyResult<Option<PyReadonlyArrayDyn<'py, T>>> {
    let Ok(array) = array.cast::<PyArrayDyn<T>>() else { return Ok(None) };
    let borrowed = array.try_readonly();
    borrowed.map(Some).map_err(|_| ARGUMENT.fault(array.py(), NEED, "one that is being written to"))
}

/// [`Indices`] without Python.
pub enum View<'a> {
    Unsigned(&'a [u32]),
    Signed(&'a [i32]),
    Long(&'a [i64]),
    UnsignedLong(&'a [u64]),
}

impl View<'_> {
    /// The triangles, copied.
    ///
    /// # Errors
    /// [`Error::Mesh`] for an index below zero or beyond 32 bits; [`Error::OutOfMemory`].
    pub fn triangles(&self) -> Result<Vec<[u32; 3]>, Error> {
        match self {
            Self::Unsigned(values) => triangles(values),
            Self::Signed(values) => triangles(values),
            Self::Long(values) => triangles(values),
            Self::UnsignedLong(values) => triangles(values),
        }
    }
}

fn triangles<T: Copy + TryInto<u32> + std::fmt::Display>(values: &[T]) -> Result<Vec<[u32; 3]>, Error> {
    let (corners, _) = values.as_chunks::<3>();
    let mut triangles = Vec::new();
    let bytes = size_of_val(corners) * size_of::<u32>() / size_of::<T>();
    triangles
        .try_reserve_exact(corners.len())
        .map_err(|_| Error::OutOfMemory { what: "the list of triangles", bytes })?;
    for (index, &triangle) in corners.iter().enumerate() {
        let [Ok(a), Ok(b), Ok(c)] = triangle.map(T::try_into) else { return Err(fault(index, triangle)) };
        triangles.push([a, b, c]);
    }
    Ok(triangles)
}

fn fault<T: std::fmt::Display>(index: usize, [a, b, c]: [T; 3]) -> Error {
    Error::Mesh(format!("triangle {index} has vertex indices [{a}, {b}, {c}]; they must be from 0 to 2^32 - 1"))
}
