//! A batch of rays from numpy arrays.

use espalier_core::{Column, Error, Rays};
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::{
    arrays::{Argument, Rows},
    errors::Kind,
};

/// An argument, or `None` where it was left out.
pub struct Given<'py>(pub Option<Bound<'py, PyAny>>);

impl<'py> FromPyObject<'_, 'py> for Given<'py> {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(Some(value.to_owned())))
    }
}

/// Rays, borrowed from numpy.
pub struct RayArrays<'py> {
    origins: Rows<'py>,
    directions: Rows<'py>,
    tmin: Limit<'py>,
    tmax: Limit<'py>,
}

impl<'py> RayArrays<'py> {
    /// Borrow origins and directions of shape (n, 3), and limits that are numbers or of shape (n,).
    ///
    /// # Errors
    /// RayError says which array has which form, and which it needs.
    pub fn new(
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        tmin: &Given<'py>,
        tmax: &Given<'py>,
    ) -> PyResult<Self> {
        let py = origins.py();
        let origins = Rows::table(origins, 3, argument("origins"))?;
        let directions = Rows::table(directions, 3, argument("directions"))?;
        let count = origins.len();
        if directions.len() != count {
            let message = format!("{count} origins, but {} directions: every ray needs one of each", directions.len());
            return Err(Kind::Ray.error(py, message));
        }
        let tmin = Limit::new(tmin, 0.0, count, argument("tmin"))?;
        let tmax = Limit::new(tmax, f32::INFINITY, count, argument("tmax"))?;
        Ok(Self { origins, directions, tmin, tmax })
    }

    /// How many rays.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// The core's view of them.
    ///
    /// # Errors
    /// As [`Rays::new`].
    pub fn view(&self) -> Result<Rays<'_>, Error> {
        let (origins, directions) = (self.origins.columns(), self.directions.columns());
        Rays::new(origins, directions, self.tmin.column(), self.tmax.column(), self.len())
    }
}

fn argument(name: &str) -> Argument<'_> {
    Argument { name, error: Kind::Ray }
}

/// One number for all rays, or one each.
enum Limit<'py> {
    One(f32),
    Each(Rows<'py>),
}

impl<'py> Limit<'py> {
    fn new(given: &Given<'py>, default: f32, count: usize, argument: Argument<'_>) -> PyResult<Self> {
        let Some(value) = &given.0 else { return Ok(Self::One(default)) };
        let is_list = value.cast::<PyUntypedArray>().is_ok_and(|array| array.ndim() > 0);
        if !is_list && let Ok(number) = value.extract::<f64>() {
            return Ok(Self::One(number as f32));
        }
        let array = argument.array(value, &format!("a number or a float32 array of shape ({count},)"))?;
        Rows::list(array, count, argument).map(Self::Each)
    }

    fn column(&self) -> Column<'_> {
        match self {
            Self::One(value) => Column::constant(value),
            Self::Each(rows) => rows.column(0),
        }
    }
}
