//! Everything that can go wrong with a measurement.

use std::path::PathBuf;

use thiserror::Error;

/// An error of the harness.
#[derive(Debug, Error)]
pub enum Error {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The plan, or a file it names, makes no sense.
    #[error("bad plan: {0}")]
    Plan(String),
    /// Embree is missing or complains.
    #[error("{0}")]
    Embree(String),
    /// Espalier complains.
    #[error(transparent)]
    Core(#[from] espalier_core::Error),
}
