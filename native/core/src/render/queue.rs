//! Rays by column, each with what belongs to it: the buffers of the wavefront.

use glam::Vec3;

use crate::{
    Error,
    ray::{Column, Ray, Rays},
};

/// Rays as structure of arrays, and a tag for each. Clearing keeps the memory.
#[derive(Debug)]
pub struct RayQueue<T> {
    columns: [Vec<f32>; 8],
    tags: Vec<T>,
}

impl<T> Default for RayQueue<T> {
    fn default() -> Self {
        Self { columns: Default::default(), tags: Vec::new() }
    }
}

impl<T> RayQueue<T> {
    /// Add a ray.
    #[inline]
    pub fn push(&mut self, ray: &Ray, tag: T) {
        let (o, d) = (ray.origin, ray.direction);
        let values = [o.x, o.y, o.z, d.x, d.y, d.z, ray.tmin, ray.tmax];
        self.columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
        self.tags.push(tag);
    }

    /// Forget all rays.
    pub fn clear(&mut self) {
        self.columns.iter_mut().for_each(Vec::clear);
        self.tags.clear();
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.tags.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.tags.is_empty()
    }

    /// The tags, ray by ray.
    pub fn tags(&self) -> &[T] {
        &self.tags
    }

    /// The direction of a ray.
    #[inline]
    pub fn direction(&self, index: usize) -> Vec3 {
        Vec3::new(self.columns[3][index], self.columns[4][index], self.columns[5][index])
    }

    /// For the accelerator.
    ///
    /// # Errors
    /// None: the columns are of one length.
    pub fn rays(&self) -> Result<Rays<'_>, Error> {
        let [ox, oy, oz, dx, dy, dz, tmin, tmax] = self.columns.each_ref().map(|column| Column::new(column));
        Rays::new([ox, oy, oz], [dx, dy, dz], tmin, tmax, self.len())
    }
}
