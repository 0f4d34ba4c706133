//! Lights in Blender's units, and how they are sampled.
//!
//! A light of P watts, normalised, has these strengths, which are those of Cycles (measured against it in the tests):
//! * point and spot: intensity P / (4π) W/sr. With a radius they are a disk that faces the lit point (soft falloff) or a
//!   sphere, of radiance P / (4π² r²).
//! * sun: P W/m² on a surface that faces it, from a cone of the given angle.
//! * area: radiance P / (π A) over an area A, on the front only. A spread below 180° puts a grid in front of it that
//!   hides light from the side and leaves the whole power unchanged.
//!
//! Not normalised, the power is one of each unit of the light's surface, and a point without radius counts as 4 of them.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI};

use glam::{Mat4, Vec3};

use super::sampler::{cone_direction, cosine_direction, disk_point, perpendiculars};
use crate::mesh::MAX_COORDINATE;

/// A light as Blender has it; it shines along its local -Z.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// What it is.
    pub kind: LightKind,
    /// Light to world.
    pub matrix: Mat4,
    /// Scene-linear RGB.
    pub color: Vec3,
    /// Watts; watts per square metre of a sun.
    pub power: f32,
    /// Whether its power is independent of its size.
    pub normalize: bool,
    /// Whether things cast shadows in it.
    pub shadow: bool,
}

/// Kinds of light. Angles are in radians, lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// In all directions.
    Point {
        /// Radius.
        bulb: Bulb,
    },
    /// From far away.
    Sun {
        /// Its diameter as an angle.
        angle: f32,
    },
    /// A point behind a cone.
    Spot {
        /// Radius.
        bulb: Bulb,
        /// The cone's whole angle.
        size: f32,
        /// How much of the cone is soft, 0 to 1.
        blend: f32,
    },
    /// A flat shape that shines to its front.
    Area {
        /// Whether it is an ellipse, not a rectangle.
        round: bool,
        /// Width and height, to be scaled by the matrix.
        size: [f32; 2],
        /// Whole angle into which it shines, up to π.
        spread: f32,
    },
}

/// The extent of a point or spot light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bulb {
    /// 0 for hard shadows; not scaled by the matrix.
    pub radius: f32,
    /// Blender's `use_soft_falloff`: a disk that always faces the lit point, not a sphere.
    pub soft_falloff: bool,
}

/// Light that arrives at a point from one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Incident {
    /// Towards the light, of unit length.
    pub direction: Vec3,
    /// How far; infinite for a sun.
    pub distance: f32,
    /// Radiance over the probability density of the direction: a surface's irradiance is its mean times the cosine.
    pub radiance: Vec3,
}

/// A light, ready to be sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct Emitter {
    shape: Shape,
    position: Vec3,
    /// Where it shines.
    axis: Vec3,
    /// Intensity of points and spots, irradiance of suns, radiance times area of areas; by colour.
    strength: Vec3,
    /// Whether things cast shadows in it.
    pub shadow: bool,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Bulb { bulb: Bulb, cone: Option<Cone> },
    Sun { one_minus_cosine: f32, projected: f32 },
    Area { half: [Vec3; 2], round: bool, spread: Option<Spread> },
}

/// A spot's cone; `rows` turn a direction into the cone's own space.
#[derive(Debug, Clone, PartialEq)]
struct Cone {
    rows: [Vec3; 3],
    cosine: f32,
    inverse_soft: f32,
}

/// An area's grid: light at tangent `t` from its axis is let through by `(tangent - t) * scale`.
#[derive(Debug, Clone, PartialEq)]
struct Spread {
    tangent: f32,
    scale: f32,
}

impl Emitter {
    /// Prepare a light; `None` where it gives no light.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn new(light: &Light) -> Result<Option<Self>, String> {
        check(light)?;
        let (shape, factor) = shape(light);
        let strength = light.color * light.power * factor;
        let axis = -light.matrix.z_axis.truncate().normalize();
        let position = light.matrix.w_axis.truncate();
        Ok((strength != Vec3::ZERO).then_some(Self { shape, position, axis, strength, shadow: light.shadow }))
    }

    /// How much light it gives, roughly: what many lights are chosen by. `radius` is the scene's.
    pub fn importance(&self, radius: f32) -> f32 {
        let whole = match self.shape {
            Shape::Bulb { .. } => 4.0 * PI,
            Shape::Sun { .. } => PI * radius * radius,
            Shape::Area { .. } => PI,
        };
        self.strength.abs().max_element() * whole
    }

    /// Light that arrives at `point` on a surface with normal `normal`; `random` gives two numbers in 0 to 1, and is
    /// not asked where light comes from one direction only.
    #[inline]
    pub fn sample(&self, point: Vec3, normal: Vec3, random: impl FnOnce() -> [f32; 2]) -> Option<Incident> {
        let random = if self.is_hard() { [0.0; 2] } else { random() };
        match &self.shape {
            Shape::Bulb { bulb, cone } => self.sample_bulb(*bulb, cone.as_ref(), point, normal, random),
            Shape::Sun { one_minus_cosine, projected } => Some(self.sample_sun(*one_minus_cosine, *projected, random)),
            Shape::Area { half, round, spread } => self.sample_area(half, *round, spread.as_ref(), point, random),
        }
    }

    fn is_hard(&self) -> bool {
        match self.shape {
            Shape::Bulb { bulb, .. } => bulb.radius == 0.0,
            Shape::Sun { projected, .. } => projected == 0.0,
            Shape::Area { .. } => false,
        }
    }

    fn sample_sun(&self, one_minus_cosine: f32, projected: f32, random: [f32; 2]) -> Incident {
        let direction = cone_direction(-self.axis, one_minus_cosine, random);
        let weight = if projected > 0.0 { 2.0 * PI * one_minus_cosine / projected } else { 1.0 };
        Incident { direction, distance: f32::INFINITY, radiance: self.strength * weight }
    }

    fn sample_bulb(
        &self,
        bulb: Bulb,
        cone: Option<&Cone>,
        point: Vec3,
        normal: Vec3,
        random: [f32; 2],
    ) -> Option<Incident> {
        let towards = self.position - point;
        let incident = if bulb.radius == 0.0 || bulb.soft_falloff {
            self.sample_disk(bulb.radius, towards, random)?
        } else if towards.length_squared() > bulb.radius * bulb.radius {
            self.sample_sphere(bulb.radius, towards, random)
        } else {
            return Some(self.sample_inside(bulb.radius, towards, normal, random));
        };
        let share = cone.map_or(1.0, |cone| cone.share(-incident.direction));
        (share > 0.0).then_some(Incident { radiance: incident.radiance * share, ..incident })
    }

    /// A disk that faces the point, sampled by area.
    fn sample_disk(&self, radius: f32, towards: Vec3, random: [f32; 2]) -> Option<Incident> {
        let facing = towards.try_normalize()?;
        let [u, v] = perpendiculars(facing);
        let [x, y] = disk_point(random).map(|coordinate| coordinate * radius);
        let to_sample = towards + u * x + v * y;
        let square = to_sample.length_squared();
        let distance = square.sqrt();
        let direction = to_sample / distance;
        Some(Incident { direction, distance, radiance: self.strength * (direction.dot(facing) / square) })
    }

    /// The part of a sphere that is seen from outside, sampled by solid angle.
    fn sample_sphere(&self, radius: f32, towards: Vec3, random: [f32; 2]) -> Incident {
        let distance = towards.length();
        let sine = radius / distance;
        let one_minus_cosine = sine * sine / (1.0 + (1.0 - sine * sine).sqrt());
        let direction = cone_direction(towards / distance, one_minus_cosine, random);
        let along = direction.dot(towards);
        let inside = radius * radius - (distance * distance - along * along);
        let weight = 2.0 * one_minus_cosine / (radius * radius);
        Incident { direction, distance: along - inside.max(0.0).sqrt(), radiance: self.strength * weight }
    }

    /// A sphere from within; the cone of a spot does not count there.
    fn sample_inside(&self, radius: f32, towards: Vec3, normal: Vec3, random: [f32; 2]) -> Incident {
        let (direction, cosine) = cosine_direction(normal, random);
        let along = direction.dot(towards);
        let inside = radius * radius - (towards.length_squared() - along * along);
        let weight = 1.0 / (radius * radius * cosine.max(1e-6));
        Incident { direction, distance: along + inside.max(0.0).sqrt(), radiance: self.strength * weight }
    }

    fn sample_area(
        &self,
        half: &[Vec3; 2],
        round: bool,
        spread: Option<&Spread>,
        point: Vec3,
        random: [f32; 2],
    ) -> Option<Incident> {
        let ([x, y], part) = match spread {
            Some(spread) => spread.place(half, round, point - self.position, self.axis, random)?,
            None if round => (disk_point(random), 1.0),
            None => (random.map(|value| 2.0 * value - 1.0), 1.0),
        };
        let to_sample = self.position + half[0] * x + half[1] * y - point;
        let square = to_sample.length_squared();
        let distance = square.sqrt();
        let direction = to_sample / distance;
        let cosine = -direction.dot(self.axis);
        let share = spread.map_or(1.0, |spread| spread.share(cosine));
        let radiance = self.strength * (part * share * cosine / square);
        (cosine > 0.0 && share > 0.0 && square > 0.0).then_some(Incident { direction, distance, radiance })
    }
}

impl Cone {
    fn new(matrix: &Mat4, size: f32, blend: f32) -> Self {
        let columns = [matrix.x_axis, matrix.y_axis, -matrix.z_axis].map(|column| column.truncate());
        let cosine = (0.5 * size).cos();
        Self {
            rows: columns.map(|column| column / column.length_squared()),
            cosine,
            inverse_soft: 1.0 / ((1.0 - cosine) * blend),
        }
    }

    /// How much of the light goes in a direction: Blender's blend of a spot.
    #[inline]
    fn share(&self, direction: Vec3) -> f32 {
        let local = Vec3::from_array(self.rows.map(|row| row.dot(direction))).normalize_or_zero();
        let inside = local.z - self.cosine;
        if inside <= 0.0 {
            return 0.0;
        }
        let x = (inside * self.inverse_soft).min(1.0);
        x * x * (3.0 - 2.0 * x)
    }
}

impl Spread {
    /// Narrower spreads are taken as this one, a tenth of a degree.
    const LEAST: f32 = 0.1 / 180.0 * PI;

    /// The scale keeps the power: ∫ cos x (1 - tan x / tan a) sin x from 0 to a is (tan a - a) / (2 tan a).
    fn new(angle: f32) -> Option<Self> {
        let half = 0.5 * f64::from(angle.max(Self::LEAST));
        let tangent = half.tan();
        (angle < PI).then(|| Self { tangent: tangent as f32, scale: (1.0 / (tangent - half)) as f32 })
    }

    /// A place on the light, -1 to 1 along each of its half edges, in the part that shines to a point; and that part's
    /// size over the light's. Without this, narrow spreads would be all noise.
    fn place(
        &self,
        half: &[Vec3; 2],
        round: bool,
        point: Vec3,
        axis: Vec3,
        random: [f32; 2],
    ) -> Option<([f32; 2], f32)> {
        let reach = point.dot(axis).max(0.0) * self.tangent;
        let range = half.map(|edge| {
            let (middle, radius) = (point.dot(edge) / edge.length_squared(), reach / edge.length());
            [(middle - radius).max(-1.0), (middle + radius).min(1.0)]
        });
        let [x, y] = [0, 1].map(|k| range[k][0] + random[k] * (range[k][1] - range[k][0]));
        let part = 0.25 * range.iter().map(|[least, most]| (most - least).max(0.0)).product::<f32>();
        let outside = round && x * x + y * y > 1.0;
        (part > 0.0 && !outside).then_some(([x, y], if round { part / FRAC_PI_4 } else { part }))
    }

    #[inline]
    fn share(&self, cosine: f32) -> f32 {
        let tangent = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
        ((self.tangent - tangent) * self.scale).max(0.0)
    }
}

/// A light's shape, and what power is to be multiplied with to become [`Emitter::strength`].
fn shape(light: &Light) -> (Shape, f32) {
    match light.kind {
        LightKind::Point { bulb } => (Shape::Bulb { bulb, cone: None }, bulb_factor(bulb, light.normalize)),
        LightKind::Spot { bulb, size, blend } => {
            let cone = Some(Cone::new(&light.matrix, size, blend));
            (Shape::Bulb { bulb, cone }, bulb_factor(bulb, light.normalize))
        }
        LightKind::Sun { angle } => sun(angle, light.normalize),
        LightKind::Area { round, size, spread } => area(light, round, size, spread),
    }
}

fn bulb_factor(bulb: Bulb, normalize: bool) -> f32 {
    let surface = if bulb.radius == 0.0 { 4.0 } else { 4.0 * PI * bulb.radius * bulb.radius };
    if normalize { 1.0 / (4.0 * PI) } else { surface / (4.0 * PI) }
}

fn sun(angle: f32, normalize: bool) -> (Shape, f32) {
    let half = 0.5 * angle;
    let quarter = (0.5 * half).sin();
    let projected = PI * half.sin() * half.sin();
    let factor = if normalize || angle == 0.0 { 1.0 } else { projected };
    (Shape::Sun { one_minus_cosine: 2.0 * quarter * quarter, projected }, factor)
}

fn area(light: &Light, round: bool, size: [f32; 2], spread: f32) -> (Shape, f32) {
    let columns = [light.matrix.x_axis, light.matrix.y_axis].map(|column| column.truncate());
    let half = [columns[0] * (0.5 * size[0]), columns[1] * (0.5 * size[1])];
    let rectangle = 4.0 * half[0].length() * half[1].length();
    let surface = rectangle * if round { FRAC_PI_4 } else { 1.0 };
    let power = match (light.normalize, surface > 0.0) {
        (true, true) => 1.0,
        (true, false) => 0.0, // Cycles' areas without surface are dark too.
        (false, _) => surface,
    };
    (Shape::Area { half, round, spread: Spread::new(spread) }, FRAC_1_PI * power)
}

fn check(light: &Light) -> Result<(), String> {
    if !(light.color.is_finite() && light.power.is_finite()) {
        return Err("its colour or power is not finite".into());
    }
    let m = &light.matrix;
    let columns = [m.x_axis, m.y_axis, m.z_axis].map(|column| column.truncate().as_dvec3().normalize_or_zero());
    let volume = columns[0].cross(columns[1]).dot(columns[2]);
    if !(m.is_finite() && m.w_axis.abs().max_element() <= MAX_COORDINATE && volume.abs() >= 1e-6) {
        return Err(format!("its matrix {m} is singular, not finite, or too far away: give it three independent axes"));
    }
    let check = |name: &str, value: f32, most: f32| {
        let good = (0.0..=most).contains(&value);
        if good { Ok(()) } else { Err(format!("its {name} is {value}; it must be from 0 to {most}")) }
    };
    const SLACK: f32 = 1e-4; // Blender's own angles are rounded.
    match light.kind {
        LightKind::Point { bulb } => check("radius", bulb.radius, 1e9),
        LightKind::Sun { angle } => check("angle", angle, PI + SLACK),
        LightKind::Spot { bulb, size, blend } => check("radius", bulb.radius, 1e9)
            .and_then(|()| check("spot_size", size, PI + SLACK))
            .and_then(|()| check("spot_blend", blend, 1.0)),
        LightKind::Area { size, spread, .. } => check("size", size[0], 1e9)
            .and_then(|()| check("size_y", size[1], 1e9))
            .and_then(|()| check("spread", spread, PI + SLACK)),
    }
}
