//! Arrays whose memory is kept for the next one. The only unsafe code of these bindings: numpy is lent memory.

#![allow(unsafe_code)]

use std::any::Any;

use bytemuck::Pod;
use espalier_core::arena::Arena;
use numpy::{Element, Ix1, PyArray, PyArrayMethods, PyReadwriteArray, ndarray::ArrayViewMut1};
use pyo3::prelude::*;

use crate::{
    arrays,
    errors::{Kind, OrRaise},
};

/// Shorter arrays, in bytes, are numpy's own.
const LEAST: usize = 1 << 16;

/// What an array's memory belongs to.
#[pyclass(frozen)]
struct Owner {
    _values: Box<dyn Any + Send + Sync>,
}

/// A new numpy array of shape (n,), contents unspecified, in pages that are kept for the next one. Those that the system
/// gives anew cost a sixth of the time that a million coherent rays take.
///
/// # Errors
/// MemoryError.
pub fn empty<T: Element + Pod>(py: Python<'_>, count: usize) -> PyResult<PyReadwriteArray<'_, T, Ix1>> {
    if count * size_of::<T>() < LEAST {
        return arrays::empty(py, count);
    }
    let mut values = Arena::<T>::stale(count, "an array").or_raise(py)?;
    let first = values.as_mut_slice().as_mut_ptr();
    let owner = Bound::new(py, Owner { _values: Box::new(values) })?.into_any();
    // SAFETY: `count` initialised values begin at `first`, in mapped memory that neither moves nor is given back before
    // `owner`, which the array holds, is dropped; and from here on nobody but the array reads or writes them.
    let array = unsafe { PyArray::borrow_from_array(&ArrayViewMut1::from_shape_ptr(count, first), owner) };
    array.try_readwrite().map_err(|error| Kind::Internal.error(py, error.to_string()))
}
