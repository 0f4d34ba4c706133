//! Finding what rays hit: one loop over branches, leaves and grids, and the batches that feed it.

mod answers;
mod batch;
mod crossing;
mod dda;
mod exact;
pub mod frame;
mod irregular;
mod kernel;
mod leaf;
mod lists;
mod nest;
mod pace;
mod packet;
pub mod probe;
mod setup;
mod single;
mod stream;
mod take;
mod tetrahedra;
mod tile;
mod together;
mod waiting;
mod weights;

pub use batch::Tracer;
pub use single::Walker;
