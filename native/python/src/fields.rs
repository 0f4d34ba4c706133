//! Mappings from names to values, such as a material, read field by field.

use espalier_core::Error;
use glam::{Mat4, Vec3};
use pyo3::{
    FromPyObject,
    prelude::*,
    types::{PyMapping, PySequence},
};

use crate::{
    arrays::{Argument, Dense},
    errors::Kind,
};

/// One mapping, and what it is called in errors, such as "material 3".
pub struct Fields<'py> {
    mapping: Bound<'py, PyMapping>,
    what: String,
}

impl<'py> Fields<'py> {
    /// Every item of a sequence of mappings, read by `read`.
    ///
    /// # Errors
    /// SceneError for something that is not a sequence of mappings, or a mapping with names that are not `known`; those
    /// of `read`.
    pub fn each<T>(
        items: &Bound<'py, PyAny>,
        what: &str,
        known: &[&str],
        read: impl Fn(&Self) -> PyResult<T>,
    ) -> PyResult<Vec<T>> {
        let sequence = items.cast::<PySequence>().map_err(|_| {
            let message = format!("{what}s must be a sequence of mappings; got {}", items.get_type());
            Kind::Scene.error(items.py(), message)
        })?;
        let numbered = sequence.try_iter()?.enumerate();
        numbered.map(|(index, item)| read(&Self::new(item?, format!("{what} {index}"), known)?)).collect()
    }

    fn new(item: Bound<'py, PyAny>, what: String, known: &[&str]) -> PyResult<Self> {
        let py = item.py();
        let mapping = item.cast_into::<PyMapping>().map_err(|error| {
            let kind = error.into_inner().get_type().to_string();
            Kind::Scene.error(py, format!("{what} must be a mapping of names to values; got {kind}"))
        })?;
        for key in mapping.keys()? {
            let key = key.str()?.to_string();
            if !known.contains(&&*key) {
                let message = format!("{what} has no '{key}'; it can have: {}", known.join(", "));
                return Err(Kind::Scene.error(py, message));
            }
        }
        Ok(Self { mapping, what })
    }

    /// For work that needs Python.
    pub fn py(&self) -> Python<'py> {
        self.mapping.py()
    }

    /// An error that says which mapping it is about.
    pub fn named(&self, error: Error) -> Error {
        match error {
            Error::Scene(message) => Error::Scene(format!("{}: {message}", self.what)),
            other => other,
        }
    }

    fn fault(&self, name: &str, need: &str, got: &Bound<'py, PyAny>) -> PyErr {
        let got = got.repr().map_or_else(|_| got.get_type().to_string(), |text| text.to_string());
        Kind::Scene.error(self.py(), format!("{}: {name} must be {need}; got {got}", self.what))
    }

    fn find(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        if self.mapping.contains(name)? { self.mapping.get_item(name).map(Some) } else { Ok(None) }
    }

    fn require(&self, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let missing = || Kind::Scene.error(self.py(), format!("{} has no {name}: give one", self.what));
        self.find(name)?.ok_or_else(missing)
    }

    fn read<T: for<'a> FromPyObject<'a, 'py>>(&self, name: &str, need: &str, default: T) -> PyResult<T> {
        let Some(value) = self.find(name)? else { return Ok(default) };
        value.extract().map_err(|_| self.fault(name, need, &value))
    }

    /// A number.
    ///
    /// # Errors
    /// SceneError for anything else; so do all below.
    pub fn number(&self, name: &str, default: f32) -> PyResult<f32> {
        self.read(name, "a number", default)
    }

    /// True or False.
    pub fn flag(&self, name: &str, default: bool) -> PyResult<bool> {
        self.read(name, "True or False", default)
    }

    /// Three numbers.
    pub fn color(&self, name: &str, default: Vec3) -> PyResult<Vec3> {
        self.read(name, "three numbers", default.to_array()).map(Vec3::from_array)
    }

    /// An index, or nothing where it is -1.
    pub fn index(&self, name: &str) -> PyResult<Option<u32>> {
        let need = "an index, or -1 for none";
        match self.read::<i64>(name, need, -1)? {
            -1 => Ok(None),
            index => u32::try_from(index).map(Some).or_else(|_| Err(self.fault(name, need, &self.require(name)?))),
        }
    }

    /// The value that stands beside one of some names.
    pub fn choice<T: Copy>(&self, name: &str, choices: &[(&str, T)], default: T) -> PyResult<T> {
        let Some(value) = self.find(name)? else { return Ok(default) };
        let chosen = value.extract::<String>().ok();
        let choice = chosen.and_then(|chosen| choices.iter().find(|(name, _)| *name == chosen));
        let names: Vec<_> = choices.iter().map(|(name, _)| format!("'{name}'")).collect();
        choice
            .map(|(_, choice)| *choice)
            .ok_or_else(|| self.fault(name, &format!("one of {}", names.join(", ")), &value))
    }

    /// The value that stands beside one of some names, which cannot be left out.
    pub fn required_choice<T: Copy>(&self, name: &str, choices: &[(&str, T)]) -> PyResult<T> {
        self.require(name)?;
        let (_, first) = choices[0];
        self.choice(name, choices, first)
    }

    /// A transformation of shape (4, 4), which cannot be left out.
    pub fn matrix(&self, name: &str) -> PyResult<Mat4> {
        matrix(&self.require(name)?, &format!("{}: {name}", self.what))
    }

    /// An array of any numbers, which cannot be left out.
    pub fn array(&self, name: &str, shape: &str, fits: impl Fn(&[usize]) -> bool) -> PyResult<Dense<'py>> {
        let name_in_full = format!("{}: {name}", self.what);
        Dense::new(&self.require(name)?, shape, fits, Argument { name: &name_in_full, error: Kind::Scene })
    }
}

/// A transformation of column vectors from an array of shape (4, 4).
///
/// # Errors
/// SceneError.
pub fn matrix(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Mat4> {
    let argument = Argument { name, error: Kind::Scene };
    let array = Dense::new(value, "(4, 4)", |shape| shape == [4, 4], argument)?;
    let values = array.values().try_into().unwrap_or(&[f32::NAN; 16]);
    Ok(Mat4::from_cols_array(values).transpose())
}
