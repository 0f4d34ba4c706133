//! The camera of a benchmark: framed for any mesh by arithmetic that is the same on every machine (no trigonometry).

use glam::{DVec2, DVec3, Vec3};

use crate::plan::{CameraPlan, Place};

/// How much larger than the mesh the image is.
const MARGIN: f64 = 1.05;

/// A pinhole camera with a square image.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    eye: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

impl Camera {
    /// The camera that a plan asks for over these vertices, of which there is at least one.
    pub fn new(plan: &CameraPlan, vertices: &[Vec3]) -> Self {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let points = || vertices.iter().map(|vertex| vertex.as_dvec3());
        let (lower, upper) = points().fold(start, |(lower, upper), p| (lower.min(p), upper.max(p)));
        match plan.place {
            Place::Outside(direction) => {
                let middle = (lower + upper) / 2.0;
                let toward = Self::looking(middle, -DVec3::from(direction), plan);
                let distance = points().map(|point| toward.distance_to_see(point)).fold(0.0, f64::max);
                Self { eye: middle - toward.forward * distance, ..toward }
            }
            Place::Inside([eye, target]) => {
                let place = |share: [f64; 3]| lower + DVec3::from(share) * (upper - lower);
                Self::looking(place(eye), place(target) - place(eye), plan)
            }
        }
    }

    fn looking(eye: DVec3, direction: DVec3, plan: &CameraPlan) -> Self {
        let forward = direction.normalize();
        let right = forward.cross(DVec3::from(plan.up)).normalize();
        Self { eye, forward, right: right * plan.slope, up: right.cross(forward) * plan.slope }
    }

    /// How far the eye must step back for a point to be in the image.
    fn distance_to_see(&self, point: DVec3) -> f64 {
        let offset = point - self.eye;
        let aside = DVec2::new(offset.dot(self.right), offset.dot(self.up)).abs().max_element();
        aside / self.right.length_squared() * MARGIN - offset.dot(self.forward)
    }

    /// Where all rays start.
    pub fn eye(&self) -> Vec3 {
        self.eye.as_vec3()
    }

    /// The unit direction through a point of the image, both coordinates from -1 to 1, x right, y up.
    pub fn direction(&self, point: DVec2) -> Vec3 {
        (self.forward + self.right * point.x + self.up * point.y).normalize().as_vec3()
    }
}
