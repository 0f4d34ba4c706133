//! The Python module `espalier_rt`: conversions between numpy and the core, and errors. Nothing is computed here.
//!
//! `espalier_rt.pyi` beside the manifest says what Python sees.

mod accelerator;
mod arrays;
mod camera;
mod cells;
mod census;
mod config;
mod decisions;
mod errors;
mod fields;
mod functions;
mod hits;
mod indices;
mod job;
mod light;
mod material;
mod mesh;
mod paged;
mod rays;
mod render;
mod scene;

use pyo3::prelude::*;

/// The native core of Espalier: acceleration structures of branches, leaves and uniform grids, and rays through them.
#[pymodule]
mod espalier_rt {
    #[pymodule_export]
    use crate::{
        accelerator::Accelerator,
        camera::Camera,
        cells::Cells,
        functions::{calibrated, default_config, instruction_set, methods},
        hits::Hits,
        job::Job,
        mesh::Mesh,
        render::{Render, render},
        scene::Scene,
    };

    use pyo3::prelude::*;

    #[pymodule_export]
    const MISS: u32 = espalier_core::ray::MISS;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        crate::errors::add_to(module)
    }
}
