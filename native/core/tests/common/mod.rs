//! What the tests share: batches of rays, brute force, closed meshes.
#![allow(dead_code)] // Each test file uses its own part.

use espalier_core::{
    Accelerator, Column, Hits, Job, Mesh, Rays,
    ray::{Hit, MISS, Ray},
    traverse::frame::{Domain, Frame},
    triangle,
};
use glam::Vec3;

/// Rays by column.
#[derive(Debug, Default, Clone)]
pub struct RayBatch {
    columns: [Vec<f32>; 8],
}

impl RayBatch {
    pub fn push(&mut self, origin: Vec3, direction: Vec3, tmin: f32, tmax: f32) {
        let [o, d] = [origin.to_array(), direction.to_array()];
        let values = [o[0], o[1], o[2], d[0], d[1], d[2], tmin, tmax];
        self.columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
    }

    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    pub fn rays(&self) -> Rays<'_> {
        let [ox, oy, oz, dx, dy, dz, tmin, tmax] = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| Column::new(&self.columns[i]));
        Rays::new([ox, oy, oz], [dx, dy, dz], tmin, tmax, self.len()).unwrap()
    }

    pub fn ray(&self, index: usize) -> Ray {
        self.rays().get(index)
    }
}

/// The first hit in the order of [`Hit::precedes`] among all triangles, tested one by one.
pub fn brute_force(mesh: &Mesh, rays: &RayBatch) -> Hits {
    let domain = Domain::new(&mesh.bounds());
    let mut hits = Hits::misses(rays.len());
    for index in 0..rays.len() {
        let frame = Frame::new(&rays.ray(index), &domain).unwrap();
        let tests = mesh
            .solid()
            .iter()
            .filter_map(|&t| triangle::intersect(&frame, mesh.corners(t).map(|corner| corner.to_array()), t));
        let best = tests.fold(Hit::MISS, |best, hit| if hit.precedes(&best) { hit } else { best });
        if best.primitive != MISS {
            hits.as_mut().set(index, Hit { t: frame.parameter(best.t), ..best });
        }
    }
    hits
}

pub fn closest(accelerator: &Accelerator, rays: &RayBatch) -> Hits {
    let mut hits = Hits::misses(rays.len());
    accelerator.closest(&rays.rays(), hits.as_mut(), 1, &Job::new()).unwrap();
    hits
}

pub fn occluded(accelerator: &Accelerator, rays: &RayBatch) -> Vec<bool> {
    let mut blocked = vec![false; rays.len()];
    accelerator.occluded(&rays.rays(), &mut blocked, 1, &Job::new()).unwrap();
    blocked
}
