//! Everything that can go wrong, by name, with what to do about it.

use thiserror::Error;

/// An error of the core. Every message says what is wrong with which input and what to do.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// The mesh is unusable.
    #[error("{0}")]
    Mesh(String),
    /// A ray is unusable.
    #[error("{0}")]
    Ray(String),
    /// A configuration value is out of its range.
    #[error("{0}")]
    Config(String),
    /// A material, texture, light or camera is unusable.
    #[error("{0}")]
    Scene(String),
    /// The caller asked for the work to stop.
    #[error("cancelled")]
    Cancelled,
    /// An allocation was refused.
    #[error("out of memory: {what} needs {bytes} bytes; simplify the scene or choose a method with fewer cells")]
    OutOfMemory {
        /// What was to be allocated.
        what: &'static str,
        /// How many bytes it needs.
        bytes: usize,
    },
}

/// A vector with room for `count` values, or [`Error::OutOfMemory`].
pub(crate) fn reserve<T>(count: usize, what: &'static str) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    let bytes = count.saturating_mul(size_of::<T>());
    values.try_reserve_exact(count).map_err(|_| Error::OutOfMemory { what, bytes })?;
    Ok(values)
}

/// A vector of `count` copies of `value`, or [`Error::OutOfMemory`].
pub(crate) fn filled<T: Clone>(count: usize, value: T, what: &'static str) -> Result<Vec<T>, Error> {
    let mut values = reserve(count, what)?;
    values.resize(count, value);
    Ok(values)
}
