//! Where samples become pixels.

use glam::Vec3;

use super::camera::Window;
use crate::{Error, error};

/// Depth where nothing was hit, as Blender has it.
pub const NO_DEPTH: f32 = 1e10;

/// One picture and its passes. Rows are bottom-up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: usize,
    /// Pixels up.
    pub height: usize,
    /// Scene-linear RGBA, premultiplied; 4 values a pixel.
    pub combined: Vec<f32>,
    /// Distance along the view axis at the pixel's first sample; [`NO_DEPTH`] where nothing was hit.
    pub depth: Vec<f32>,
    /// Mean shading normal in the world, zero where nothing was hit; 3 values a pixel.
    pub normal: Vec<f32>,
}

impl Film {
    /// A picture to be filled tile by tile.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new([width, height]: [usize; 2]) -> Result<Self, Error> {
        let pixels = width * height;
        let plane = |channels: usize| error::filled(pixels * channels, 0.0, "the picture");
        Ok(Self { width, height, combined: plane(4)?, depth: plane(1)?, normal: plane(3)? })
    }

    /// Put a finished tile into its place in the film of `window`.
    pub fn store(&mut self, tile: &Tile, window: Window, samples: u32) {
        let share = 1.0 / samples as f32;
        for index in 0..tile.window.count() {
            let place = window.index(tile.window.pixel(index));
            let rgba = (tile.color[index] * share).extend(tile.alpha[index] * share);
            self.combined[4 * place..4 * place + 4].copy_from_slice(&rgba.to_array());
            self.depth[place] = tile.depth[index];
            let normal = tile.normal[index] * share;
            self.normal[3 * place..3 * place + 3].copy_from_slice(&normal.to_array());
        }
    }
}

/// A small part of the picture, while it is summed up; one element a pixel, rows bottom-up.
#[derive(Debug, Default)]
pub struct Tile {
    /// Its pixels in the frame.
    pub window: Window,
    /// Sum of radiance.
    pub color: Vec<Vec3>,
    /// Sum of coverage.
    pub alpha: Vec<f32>,
    /// Depth of the first sample.
    pub depth: Vec<f32>,
    /// Sum of shading normals.
    pub normal: Vec<Vec3>,
}

/// Side of a tile in pixels. Its 1,024 rays a batch stay in the first-level caches with all that belongs to them, and
/// are few enough to look for a cancel between batches.
pub const TILE: u32 = 32;

impl Tile {
    /// Begin anew, with other pixels.
    pub fn reset(&mut self, window: Window) {
        let count = window.count();
        self.window = window;
        self.color.clear();
        self.color.resize(count, Vec3::ZERO);
        self.alpha.clear();
        self.alpha.resize(count, 0.0);
        self.depth.clear();
        self.depth.resize(count, NO_DEPTH);
        self.normal.clear();
        self.normal.resize(count, Vec3::ZERO);
    }
}
