//! The native core of Espalier: acceleration structures that mix bounding volume hierarchies and uniform grids, the
//! traversal of them, and the rendering of images through them.
//!
//! Data flows one way: [`mesh`] → [`accel`] (policy → tree → pack) → [`traverse`] → [`render`].

pub mod accel;
pub mod arena;
pub mod bounds;
mod cache;
pub mod error;
pub mod job;
pub mod mesh;
mod pages;
pub mod pool;
pub mod ray;
pub mod render;
pub mod simd;
pub mod traverse;
pub mod triangle;
pub mod work;

pub use accel::{Accelerator, Method, config::Config};
pub use error::Error;
pub use job::Job;
pub use mesh::Mesh;
pub use ray::{Column, Hits, HitsMut, Rays};
pub use traverse::Tracer;
