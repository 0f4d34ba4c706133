//! Indices from numpy integers of any type.

use std::fmt::Debug;

use espalier_core::Error;
use numpy::{Element, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::{
    arrays::{self, Argument},
    errors::Kind,
};

/// Rows of N indices, borrowed from numpy.
pub struct Indices<'py, const N: usize> {
    integers: Integers<'py>,
    argument: Argument<'static>,
}

/// The types that are read in place; all others are copied to int64 first.
enum Integers<'py> {
    Unsigned(PyReadonlyArrayDyn<'py, u32>),
    Signed(PyReadonlyArrayDyn<'py, i32>),
    Long(PyReadonlyArrayDyn<'py, i64>),
    UnsignedLong(PyReadonlyArrayDyn<'py, u64>),
}

impl<'py, const N: usize> Indices<'py, N> {
    /// Borrow integers of shape (n, N), or (n,) where N is 1, copied first where they do not follow each other.
    ///
    /// # Errors
    /// The argument's for another shape or type.
    pub fn new(value: &Bound<'py, PyAny>, argument: Argument<'static>) -> PyResult<Self> {
        let (py, need) = (value.py(), need(N));
        let array = argument.array(value, &need)?;
        let fits = if N == 1 { array.ndim() == 1 } else { array.ndim() == 2 && array.shape()[1] == N };
        if !fits || !matches!(array.dtype().kind(), b'i' | b'u') {
            return Err(argument.fault(py, &need, &arrays::describe(&array)));
        }
        let array = py.import("numpy")?.call_method1("ascontiguousarray", (array,))?;
        Ok(Self { integers: Integers::borrow(&array, argument)?, argument })
    }

    /// The same without Python.
    pub fn view(&self) -> View<'_, N> {
        let integers = match &self.integers {
            Integers::Unsigned(array) => Slice::Unsigned(array.as_slice().unwrap_or_default()),
            Integers::Signed(array) => Slice::Signed(array.as_slice().unwrap_or_default()),
            Integers::Long(array) => Slice::Long(array.as_slice().unwrap_or_default()),
            Integers::UnsignedLong(array) => Slice::UnsignedLong(array.as_slice().unwrap_or_default()),
        };
        View { integers, argument: self.argument }
    }
}

fn need(columns: usize) -> String {
    if columns == 1 { "a uint32 array of shape (n,)".into() } else { format!("a uint32 array of shape (n, {columns})") }
}

impl<'py> Integers<'py> {
    fn borrow(array: &Bound<'py, PyAny>, argument: Argument<'static>) -> PyResult<Self> {
        if let Some(array) = borrow(array, argument)? {
            return Ok(Self::Unsigned(array));
        }
        if let Some(array) = borrow(array, argument)? {
            return Ok(Self::Signed(array));
        }
        if let Some(array) = borrow(array, argument)? {
            return Ok(Self::UnsignedLong(array));
        }
        let py = array.py();
        let array = array.call_method1("astype", (numpy::dtype::<i64>(py),))?;
        let array = borrow(&array, argument)?;
        array.map(Self::Long).ok_or_else(|| Kind::Internal.error(py, "numpy made no int64"))
    }
}

fn borrow<'py, T: Element>(
    array: &Bound<'py, PyAny>,
    argument: Argument<'static>,
) -> PyResult<Option<PyReadonlyArrayDyn<'py, T>>> {
    let Ok(array) = array.cast::<PyArrayDyn<T>>() else { return Ok(None) };
    array.try_readonly().map(Some).map_err(|_| argument.busy(array.py()))
}

/// Rows of N indices.
pub struct View<'a, const N: usize> {
    integers: Slice<'a>,
    argument: Argument<'static>,
}

enum Slice<'a> {
    Unsigned(&'a [u32]),
    Signed(&'a [i32]),
    Long(&'a [i64]),
    UnsignedLong(&'a [u64]),
}

impl<const N: usize> View<'_, N> {
    /// The rows, copied.
    ///
    /// # Errors
    /// The argument's for an index below zero or beyond 32 bits; [`Error::OutOfMemory`].
    pub fn rows(&self) -> Result<Vec<[u32; N]>, Error> {
        let mut rows = arrays::reserve(self.len(), self.argument.name)?;
        rows.resize(self.len(), [0; N]);
        self.write(&mut rows)?;
        Ok(rows)
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        let integers = match self.integers {
            Slice::Unsigned(values) => values.len(),
            Slice::Signed(values) => values.len(),
            Slice::Long(values) => values.len(),
            Slice::UnsignedLong(values) => values.len(),
        };
        integers / N
    }

    /// Write all rows to as many.
    ///
    /// # Errors
    /// The argument's for an index below zero or beyond 32 bits.
    pub fn write(&self, rows: &mut [[u32; N]]) -> Result<(), Error> {
        match self.integers {
            Slice::Unsigned(values) => write(values, self.argument, rows),
            Slice::Signed(values) => write(values, self.argument, rows),
            Slice::Long(values) => write(values, self.argument, rows),
            Slice::UnsignedLong(values) => write(values, self.argument, rows),
        }
    }
}

fn write<T: Copy + TryInto<u32> + Debug, const N: usize>(
    values: &[T],
    argument: Argument<'static>,
    rows: &mut [[u32; N]],
) -> Result<(), Error> {
    let (given, _) = values.as_chunks::<N>();
    for (index, (row, indices)) in given.iter().zip(rows).enumerate() {
        for (slot, value) in indices.iter_mut().zip(row) {
            *slot = (*value).try_into().map_err(|_| {
                let message = format!("{}[{index}] is {row:?}; indices must be from 0 to {}", argument.name, u32::MAX);
                argument.error.core(message)
            })?;
        }
    }
    Ok(())
}
