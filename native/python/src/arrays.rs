//! numpy arrays in, as strided columns without a copy where their form allows, and new numpy arrays out.
//!
//! The rule for numbers: native float32 in rows or columns with strides that are whole and not negative is read in
//! place, whatever lies between the elements. Everything else that is a float (float16, float64, longdouble, foreign
//! byte order, reversed or unaligned memory) and integers that float32 holds exactly (8 and 16 bits) is first copied to
//! float32, rounded to nearest. Any other type raises, since the conversion may change values silently.

use espalier_core::{Column, Error};
use numpy::{
    Element, Ix1, Ix2, PyArray, PyArrayDescr, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn,
    PyReadwriteArray, PyUntypedArray, PyUntypedArrayMethods,
    ndarray::{Dimension, IntoDimension},
};
use pyo3::{prelude::*, sync::PyOnceLock, types::PyDict};

use crate::errors::Kind;

/// What an argument is called, and which exception speaks of it.
#[derive(Debug, Clone, Copy)]
pub struct Argument<'a> {
    pub name: &'a str,
    pub error: Kind,
}

impl Argument<'_> {
    /// "origins must be ..., got ..."
    pub fn fault(self, py: Python<'_>, need: &str, got: &str) -> PyErr {
        self.error.error(py, format!("{} must be {need}; got {got}", self.name))
    }

    /// The array is borrowed for writing.
    pub fn busy(self, py: Python<'_>) -> PyErr {
        self.error.error(py, format!("{} is being written to by other native code: wait until it is done", self.name))
    }

    /// `value` as a numpy array: itself, or what numpy.asarray makes of it.
    pub fn array<'py>(self, value: &Bound<'py, PyAny>, need: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
        if let Ok(array) = value.cast::<PyUntypedArray>() {
            return Ok(array.clone());
        }
        let py = value.py();
        let array = numpy_function(py, "asarray")?.call1((value,));
        array.and_then(|array| Ok(array.cast_into::<PyUntypedArray>()?)).map_err(|error| {
            let kind = value.get_type();
            self.fault(py, need, &format!("{kind}, of which numpy makes no array: {}", error.value(py)))
        })
    }
}

/// "float64 of shape (3, 2)"
pub fn describe(array: &Bound<'_, PyUntypedArray>) -> String {
    let sizes: Vec<_> = array.shape().iter().map(ToString::to_string).collect();
    let comma = if sizes.len() == 1 { "," } else { "" };
    format!("{} of shape ({}{comma})", array.dtype(), sizes.join(", "))
}

/// Rows of float32 numbers, borrowed from numpy and read where they are: shape (n,) counts as (n, 1).
pub struct Rows<'py> {
    memory: PyReadonlyArrayDyn<'py, f32>,
    count: usize,
    row_stride: usize,
    column_stride: usize,
}

impl<'py> Rows<'py> {
    /// Borrow an array of shape (n, columns).
    ///
    /// # Errors
    /// The argument's, for another shape, a type outside the rule above, or an array borrowed for writing.
    pub fn table(value: &Bound<'py, PyAny>, columns: usize, argument: Argument<'_>) -> PyResult<Self> {
        let need = format!("a float32 array of shape (n, {columns})");
        let array = argument.array(value, &need)?;
        if array.ndim() != 2 || array.shape()[1] != columns {
            return Err(argument.fault(value.py(), &need, &describe(&array)));
        }
        Self::new(array, &need, argument)
    }

    /// Borrow an array of shape (n,).
    ///
    /// # Errors
    /// As [`Rows::table`].
    pub fn list(array: Bound<'py, PyUntypedArray>, count: usize, argument: Argument<'_>) -> PyResult<Self> {
        let need = format!("a number or a float32 array of shape ({count},)");
        if array.shape() != [count] {
            return Err(argument.fault(array.py(), &need, &describe(&array)));
        }
        Self::new(array, &need, argument)
    }

    fn new(array: Bound<'py, PyUntypedArray>, need: &str, argument: Argument<'_>) -> PyResult<Self> {
        let py = array.py();
        let array = as_float32(array, need, argument)?;
        let count = array.shape()[0];
        let [row_stride, column_stride] = strides(&array);
        let memory = if array.is_contiguous() { array } else { covering(&array)? };
        let memory = memory.try_readonly().map_err(|_| argument.busy(py))?;
        Ok(Self { memory, count, row_stride, column_stride })
    }

    /// How many rows.
    pub fn len(&self) -> usize {
        self.count
    }

    /// One column.
    pub fn column(&self, index: usize) -> Column<'_> {
        let values = self.memory.as_slice().unwrap_or_default();
        Column::strided(values.get(index * self.column_stride..).unwrap_or_default(), self.row_stride)
    }

    /// The first three columns.
    pub fn columns(&self) -> [Column<'_>; 3] {
        [0, 1, 2].map(|index| self.column(index))
    }
}

/// Float32 numbers of any shape that follow each other, borrowed from numpy or, where they do not, from a copy.
pub struct Dense<'py> {
    memory: PyReadonlyArrayDyn<'py, f32>,
}

impl<'py> Dense<'py> {
    /// Borrow an array of a shape in words, which `fits` knows.
    ///
    /// # Errors
    /// As [`Rows::table`].
    pub fn new(
        value: &Bound<'py, PyAny>,
        shape: &str,
        fits: impl Fn(&[usize]) -> bool,
        argument: Argument<'_>,
    ) -> PyResult<Self> {
        let (py, need) = (value.py(), format!("a float32 array of shape {shape}"));
        let array = argument.array(value, &need)?;
        if !fits(array.shape()) {
            return Err(argument.fault(py, &need, &describe(&array)));
        }
        let array = as_float32(array, &need, argument)?;
        let array = numpy_function(py, "ascontiguousarray")?.call1((array,))?.cast_into::<PyArrayDyn<f32>>()?;
        let memory = array.try_readonly().map_err(|_| argument.busy(py))?;
        Ok(Self { memory })
    }

    /// Its shape.
    pub fn shape(&self) -> &[usize] {
        self.memory.shape()
    }

    /// All numbers, the last axis fastest.
    pub fn values(&self) -> &[f32] {
        self.memory.as_slice().unwrap_or_default()
    }
}

/// The array as aligned native float32 with strides that are whole and not negative: itself, or a copy by the rule.
fn as_float32<'py>(
    array: Bound<'py, PyUntypedArray>,
    need: &str,
    argument: Argument<'_>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let py = array.py();
    let walkable = array.shape().iter().zip(array.strides()).all(|(&n, &s)| n < 2 || (s >= 0 && s % 4 == 0));
    let array = match array.into_any().cast_into::<PyArrayDyn<f32>>() {
        Ok(array) if walkable && array.is_aligned() => return Ok(array),
        Ok(array) => array.into_any(),
        Err(error) => error.into_inner(),
    };
    let array = array.cast_into::<PyUntypedArray>()?;
    if !converts(&array.dtype()) {
        return Err(argument.fault(py, need, &format!("{}: convert it with .astype('float32')", describe(&array))));
    }
    let options = PyDict::new(py);
    options.set_item("order", "C")?;
    let copy = array.call_method("astype", (numpy::dtype::<f32>(py),), Some(&options))?;
    Ok(copy.cast_into::<PyArrayDyn<f32>>()?)
}

/// Floats, and integers that float32 holds exactly.
fn converts(dtype: &Bound<'_, PyArrayDescr>) -> bool {
    match dtype.kind() {
        b'f' => true,
        b'i' | b'u' => dtype.itemsize() <= 2,
        _ => false,
    }
}

/// Strides in elements; 0 along an axis with at most one element, where numpy leaves them unspecified.
fn strides(array: &Bound<'_, PyArrayDyn<f32>>) -> [usize; 2] {
    let mut strides = [0; 2];
    for (stride, (&count, &bytes)) in strides.iter_mut().zip(array.shape().iter().zip(array.strides())) {
        *stride = if count < 2 { 0 } else { bytes.unsigned_abs() / size_of::<f32>() };
    }
    strides
}

/// A contiguous view of all memory from the array's first element to its last.
fn covering<'py>(array: &Bound<'py, PyArrayDyn<f32>>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    static AS_STRIDED: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let steps = array.shape().iter().zip(strides(array)).map(|(&count, stride)| count.saturating_sub(1) * stride);
    let span = steps.sum::<usize>() + 1;
    let as_strided = AS_STRIDED.import(array.py(), "numpy.lib.stride_tricks", "as_strided")?;
    let options = PyDict::new(array.py());
    options.set_item("writeable", false)?;
    let view = as_strided.call((array, (span,), (size_of::<f32>(),)), Some(&options))?;
    Ok(view.cast_into::<PyArrayDyn<f32>>()?)
}

/// An array of shape (n,), on its way out.
pub type List<T> = Py<PyArray<T, Ix1>>;
/// An array of shape (n, columns), on its way out.
pub type Table<T> = Py<PyArray<T, Ix2>>;

/// A vector as an array of a shape, without a copy.
pub fn shaped<D: Dimension>(
    py: Python<'_>,
    values: Vec<f32>,
    shape: impl IntoDimension<Dim = D>,
) -> PyResult<Py<PyArray<f32, D>>> {
    Ok(PyArray::from_vec(py, values).reshape(shape)?.unbind())
}

/// A new read-only array of shape (n,).
pub fn list<T: Element>(py: Python<'_>, values: impl ExactSizeIterator<Item = T> + Send) -> PyResult<List<T>> {
    let mut array = empty(py, values.len())?;
    let slots = array.as_slice_mut()?;
    py.detach(|| slots.iter_mut().zip(values).for_each(|(slot, value)| *slot = value));
    Ok(finished(array))
}

/// A new read-only array of shape (n, 3).
pub fn table<T: Element>(py: Python<'_>, rows: impl ExactSizeIterator<Item = [T; 3]> + Send) -> PyResult<Table<T>> {
    let mut array = empty_table(py, rows.len(), 3)?;
    let (slots, _) = array.as_slice_mut()?.as_chunks_mut::<3>();
    py.detach(|| slots.iter_mut().zip(rows).for_each(|(slot, row)| *slot = row));
    Ok(finished(array))
}

/// A new numpy array of shape (n,), contents unspecified.
pub fn empty<T: Element>(py: Python<'_>, count: usize) -> PyResult<PyReadwriteArray<'_, T, Ix1>> {
    let array = numpy_function(py, "empty")?.call1((count, numpy::dtype::<T>(py)))?;
    writable(array.cast_into::<PyArray<T, Ix1>>()?)
}

/// A new numpy array of shape (n, columns), contents unspecified.
pub fn empty_table<T: Element>(py: Python<'_>, count: usize, columns: usize) -> PyResult<PyReadwriteArray<'_, T, Ix2>> {
    let array = numpy_function(py, "empty")?.call1(((count, columns), numpy::dtype::<T>(py)))?;
    writable(array.cast_into::<PyArray<T, Ix2>>()?)
}

fn writable<T: Element, D: Dimension>(array: Bound<'_, PyArray<T, D>>) -> PyResult<PyReadwriteArray<'_, T, D>> {
    let py = array.py();
    array.try_readwrite().map_err(|error| Kind::Internal.error(py, error.to_string()))
}

/// The array, for the caller to do with as it likes.
pub fn returned<T: Element, D: Dimension>(array: PyReadwriteArray<'_, T, D>) -> Py<PyArray<T, D>> {
    let array: &Bound<'_, PyArray<T, D>> = &array;
    array.clone().unbind()
}

/// The array, which nobody is to write to any more.
pub fn finished<T: Element, D: Dimension>(array: PyReadwriteArray<'_, T, D>) -> Py<PyArray<T, D>> {
    let array: &Bound<'_, PyArray<T, D>> = &array.make_nonwriteable();
    array.clone().unbind()
}

fn numpy_function<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("numpy")?.getattr(name)
}

/// Groups of N numbers, each made into something, in a new vector.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn grouped<T, const N: usize>(
    values: &[f32],
    what: &'static str,
    make: impl Fn(&[f32; N]) -> T,
) -> Result<Vec<T>, Error> {
    let (groups, _) = values.as_chunks::<N>();
    let mut made = reserve(groups.len(), what)?;
    made.extend(groups.iter().map(make));
    Ok(made)
}

/// A vector with room for `count` values.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn reserve<T>(count: usize, what: &'static str) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    let bytes = count.saturating_mul(size_of::<T>());
    values.try_reserve_exact(count).map_err(|_| Error::OutOfMemory { what, bytes })?;
    Ok(values)
}
