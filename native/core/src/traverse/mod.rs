//! Finding what rays hit: one loop over branches, leaves and grids, and the batches that feed it.

mod batch;
mod dda;
pub mod frame;
mod kernel;
mod leaf;
pub mod probe;
mod setup;
mod stream;

pub use batch::Tracer;
