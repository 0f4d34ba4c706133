//! Image textures.

use glam::{Vec2, Vec3, Vec4};

use crate::Error;

/// How a colour between pixels is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Between the four nearest pixels.
    Linear,
    /// Of the pixel the point lies in.
    Closest,
}

/// What lies outside the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extension {
    /// The picture again.
    Repeat,
    /// Its outermost pixels.
    Extend,
    /// Black.
    Clip,
}

/// A picture to be looked up by texture coordinates; (0, 0) is its bottom left corner, (1, 1) its top right.
#[derive(Debug, Clone)]
pub struct Texture {
    size: [usize; 2],
    pixels: Vec<Vec4>,
    interpolation: Interpolation,
    extension: Extension,
}

impl Texture {
    /// A picture of `width` by `height` scene-linear RGBA pixels, rows bottom-up.
    ///
    /// # Errors
    /// [`Error::Scene`] for a picture without pixels, a wrong number of them, or one that is not finite.
    pub fn new(
        [width, height]: [usize; 2],
        pixels: Vec<Vec4>,
        interpolation: Interpolation,
        extension: Extension,
    ) -> Result<Self, Error> {
        if width == 0 || height == 0 || width.checked_mul(height) != Some(pixels.len()) {
            return Err(Error::Scene(format!(
                "a texture of {width} by {height} with {} pixels: give at least one, and as many as its size says",
                pixels.len()
            )));
        }
        if let Some(index) = pixels.iter().position(|pixel| !pixel.is_finite()) {
            let (x, y) = (index % width, index / width);
            return Err(Error::Scene(format!("texture pixel ({x}, {y}) is not finite: mend the image")));
        }
        Ok(Self { size: [width, height], pixels, interpolation, extension })
    }

    /// The colour at texture coordinates.
    #[inline]
    pub fn color(&self, uv: Vec2) -> Vec3 {
        let [x, y] = [uv.x * self.size[0] as f32, uv.y * self.size[1] as f32];
        match self.interpolation {
            Interpolation::Closest => self.pixel(x.floor(), y.floor()),
            Interpolation::Linear => self.between(x - 0.5, y - 0.5),
        }
    }

    fn between(&self, x: f32, y: f32) -> Vec3 {
        let (left, bottom) = (x.floor(), y.floor());
        let row = |y: f32| self.pixel(left, y).lerp(self.pixel(left + 1.0, y), x - left);
        row(bottom).lerp(row(bottom + 1.0), y - bottom)
    }

    fn pixel(&self, x: f32, y: f32) -> Vec3 {
        let place = |value: f32, axis: usize| extended(value, self.size[axis], self.extension);
        match (place(x, 0), place(y, 1)) {
            (Some(x), Some(y)) => self.pixels[y * self.size[0] + x].truncate(),
            _ => Vec3::ZERO,
        }
    }
}

/// The pixel that stands for pixel `index` of a row of `count`.
#[inline]
fn extended(index: f32, count: usize, extension: Extension) -> Option<usize> {
    let index = index as i64; // Saturates: coordinates that are far out or not numbers stay in range below.
    let last = count as i64 - 1;
    match extension {
        Extension::Repeat => Some(index.rem_euclid(count as i64) as usize),
        Extension::Extend => Some(index.clamp(0, last) as usize),
        Extension::Clip => (0..=last).contains(&index).then_some(index as usize),
    }
}
