//! Finding what rays hit: one loop over branches, leaves and grids, and the batches that feed it.

mod answers;
mod batch;
mod crossing;
mod dda;
#[allow(dead_code)] // Whoever knows its triangle needs no verdict; the traversers that come next do.
mod exact;
pub mod frame;
mod irregular;
mod kernel;
mod leaf;
mod lists;
mod nest;
pub mod probe;
mod setup;
mod stream;
mod tetrahedra;

pub use batch::Tracer;
