//! Cameras exactly as Blender has them: which ray belongs to which point of the picture.
//!
//! The view plane follows `BKE_camera_params_compute_viewplane` of Blender: the sensor (or the orthographic scale) spans
//! the width or the height of the frame, whichever the fit names, and shifts are in units of that side. Pixel (0, 0) is
//! at the bottom left, as in Blender's images.

use glam::{DVec3, Mat4, Vec3};

use crate::{Error, mesh::MAX_COORDINATE, ray::Ray};

/// Longest side of a frame, in pixels.
pub const MOST_PIXELS: u32 = 1 << 16;

/// How rays leave the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// From one point; `lens` is the focal length in millimetres.
    Perspective {
        /// Focal length, mm.
        lens: f32,
    },
    /// Side by side; `scale` is the size of the frame's fitted side in scene units.
    Orthographic {
        /// Scene units along the fitted side.
        scale: f32,
    },
}

/// Which side of the frame the sensor spans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorFit {
    /// The longer one, always with the sensor's width.
    Auto,
    /// The horizontal one, with the sensor's width.
    Horizontal,
    /// The vertical one, with the sensor's height.
    Vertical,
}

/// Everything Blender knows of a camera and its frame.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSettings {
    /// How rays leave the camera.
    pub projection: Projection,
    /// Camera to world; the camera looks along its -Z, up is +Y. Its scale is ignored, as in Blender.
    pub matrix: Mat4,
    /// Width and height of the whole frame in pixels, resolution percentage applied.
    pub resolution: [u32; 2],
    /// Sensor width and height, mm.
    pub sensor: [f32; 2],
    /// Which side the sensor spans.
    pub fit: SensorFit,
    /// Shift of the picture, in units of the fitted side.
    pub shift: [f32; 2],
    /// Nearest and farthest distance along the view axis that is seen.
    pub clip: [f32; 2],
    /// Width and height of a pixel, relative to each other.
    pub pixel_aspect: [f32; 2],
    /// The part of the frame that is rendered: least x, least y, greatest x, greatest y, in 0 to 1; `None` for all.
    pub border: Option<[f32; 4]>,
}

impl Default for CameraSettings {
    /// Blender's new camera in a frame of 1920 by 1080.
    fn default() -> Self {
        Self {
            projection: Projection::Perspective { lens: 50.0 },
            matrix: Mat4::IDENTITY,
            resolution: [1920, 1080],
            sensor: [36.0, 24.0],
            fit: SensorFit::Auto,
            shift: [0.0; 2],
            clip: [0.1, 1000.0],
            pixel_aspect: [1.0; 2],
            border: None,
        }
    }
}

/// A camera, checked, with its view plane worked out.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    perspective: bool,
    clip: [f32; 2],
    /// Coordinates on the view plane of the frame's bottom left corner.
    corner: [f64; 2],
    /// Size of a pixel on the view plane.
    pixel: [f64; 2],
    window: Window,
}

/// A rectangle of the frame's pixels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Window {
    /// First column and row.
    pub first: [u32; 2],
    /// Columns and rows.
    pub size: [u32; 2],
}

impl Window {
    /// How many pixels it has.
    pub fn count(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// The frame's pixel of an index, row by row.
    #[inline]
    pub fn pixel(&self, index: usize) -> [u32; 2] {
        let (index, width) = (index as u32, self.size[0]);
        [self.first[0] + index % width, self.first[1] + index / width]
    }

    /// The index of a pixel of the frame that lies inside.
    #[inline]
    pub fn index(&self, pixel: [u32; 2]) -> usize {
        (pixel[1] - self.first[1]) as usize * self.size[0] as usize + (pixel[0] - self.first[0]) as usize
    }

    /// The same pixels in squares of at most `side` by `side`.
    pub fn tiles(&self, side: u32) -> Vec<Self> {
        let starts = |axis: usize| (0..self.size[axis]).step_by(side as usize);
        let tile = |x: u32, y: u32| Self {
            first: [self.first[0] + x, self.first[1] + y],
            size: [side.min(self.size[0] - x), side.min(self.size[1] - y)],
        };
        starts(1).flat_map(|y| starts(0).map(move |x| tile(x, y))).collect()
    }
}

impl Camera {
    /// Check settings and work out the view plane.
    ///
    /// # Errors
    /// [`Error::Scene`] for a frame without pixels or with a side of more than [`MOST_PIXELS`], a border without
    /// pixels, a matrix that is singular or not finite, and sizes, scales or clip distances out of their range.
    pub fn new(settings: &CameraSettings) -> Result<Self, Error> {
        check(settings)?;
        let [right, up, back] = axes(&settings.matrix)?;
        let (corner, pixel) = view_plane(settings);
        Ok(Self {
            position: settings.matrix.w_axis.truncate(),
            right,
            up,
            forward: -back,
            perspective: matches!(settings.projection, Projection::Perspective { .. }),
            clip: settings.clip,
            corner,
            pixel,
            window: window(settings)?,
        })
    }

    /// The pixels that are rendered.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Width and height of the picture that is rendered.
    pub fn size(&self) -> [usize; 2] {
        self.window.size.map(|side| side as usize)
    }

    /// The ray through a point of the frame, in pixels from its bottom left corner; pixel centres lie at halves. The
    /// direction has unit length; the interval is the clip range along the ray.
    #[inline]
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let across = (self.corner[0] + x * self.pixel[0]) as f32;
        let along = (self.corner[1] + y * self.pixel[1]) as f32;
        let offset = self.right * across + self.up * along;
        if self.perspective { self.diverging(offset) } else { self.parallel(offset) }
    }

    fn diverging(&self, offset: Vec3) -> Ray {
        let stretch = (self.forward + offset).length();
        let direction = (self.forward + offset) / stretch;
        let [tmin, tmax] = self.clip.map(|distance| distance * stretch);
        Ray { origin: self.position, direction, tmin, tmax }
    }

    fn parallel(&self, offset: Vec3) -> Ray {
        let [tmin, tmax] = self.clip;
        Ray { origin: self.position + offset, direction: self.forward, tmin, tmax }
    }

    /// Distance along the view axis of a point `t` along a ray of [`Camera::ray`]: what Blender calls depth.
    #[inline]
    pub fn depth(&self, direction: Vec3, t: f32) -> f32 {
        t * direction.dot(self.forward)
    }
}

/// The camera's axes in the world, each of unit length.
fn axes(matrix: &Mat4) -> Result<[Vec3; 3], Error> {
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|column| column.truncate().as_dvec3());
    let units: [DVec3; 3] = columns.map(DVec3::normalize_or_zero);
    let volume = units[0].cross(units[1]).dot(units[2]);
    if !(matrix.is_finite() && matrix.w_axis.abs().max_element() <= MAX_COORDINATE && volume.abs() >= 1e-6) {
        return Err(Error::Scene(format!(
            "the camera's matrix {matrix} is singular, not finite, or too far away: give it three independent axes and a place \
             within {MAX_COORDINATE:e}"
        )));
    }
    Ok(units.map(|unit| unit.as_vec3()))
}

/// The bottom left corner of the frame on the view plane, and the size of a pixel there. The plane is at unit distance
/// in perspective.
fn view_plane(settings: &CameraSettings) -> ([f64; 2], [f64; 2]) {
    let [width, height] = settings.resolution.map(f64::from);
    let aspect = f64::from(settings.pixel_aspect[1]) / f64::from(settings.pixel_aspect[0]);
    let horizontal = match settings.fit {
        SensorFit::Auto => width >= aspect * height,
        fit => fit == SensorFit::Horizontal,
    };
    let fitted = if horizontal { width } else { aspect * height };
    let scale = span(settings) / fitted;
    let [shift_x, shift_y] = settings.shift.map(|shift| f64::from(shift) * fitted);
    let corner = [(shift_x - 0.5 * width) * scale, (shift_y - 0.5 * aspect * height) * scale];
    (corner, [scale, aspect * scale])
}

/// How much of the view plane the fitted side spans.
fn span(settings: &CameraSettings) -> f64 {
    let vertical = settings.fit == SensorFit::Vertical;
    let sensor = f64::from(settings.sensor[usize::from(vertical)]);
    match settings.projection {
        Projection::Perspective { lens } => sensor / f64::from(lens),
        Projection::Orthographic { scale } => f64::from(scale),
    }
}

/// The border in whole pixels, cut off as Blender does.
fn window(settings: &CameraSettings) -> Result<Window, Error> {
    let [left, bottom, right, top] = settings.border.unwrap_or([0.0, 0.0, 1.0, 1.0]);
    let cut = |share: f32, axis: usize| (share.clamp(0.0, 1.0) * settings.resolution[axis] as f32) as u32;
    let (first, last) = ([cut(left, 0), cut(bottom, 1)], [cut(right, 0), cut(top, 1)]);
    if first[0] >= last[0] || first[1] >= last[1] {
        let [width, height] = settings.resolution;
        return Err(Error::Scene(format!(
            "the border ({left}, {bottom}, {right}, {top}) holds no pixel of a frame of {width} by {height}: enlarge it"
        )));
    }
    Ok(Window { first, size: [last[0] - first[0], last[1] - first[1]] })
}

fn check(settings: &CameraSettings) -> Result<(), Error> {
    let [width, height] = settings.resolution;
    if [width, height].iter().any(|side| !(1..=MOST_PIXELS).contains(side)) {
        return Err(Error::Scene(format!("a frame of {width} by {height} pixels; sides must be 1 to {MOST_PIXELS}")));
    }
    let size = match settings.projection {
        Projection::Perspective { lens } => ("lens", lens),
        Projection::Orthographic { scale } => ("ortho_scale", scale),
    };
    let sizes = [
        size,
        ("sensor_width", settings.sensor[0]),
        ("sensor_height", settings.sensor[1]),
        ("pixel_aspect x", settings.pixel_aspect[0]),
        ("pixel_aspect y", settings.pixel_aspect[1]),
    ];
    if let Some((name, value)) = sizes.into_iter().find(|(_, value)| !(1e-9..=1e9).contains(value)) {
        return Err(Error::Scene(format!("the camera's {name} is {value}; it must be from 1e-9 to 1e9")));
    }
    check_ranges(settings)
}

fn check_ranges(settings: &CameraSettings) -> Result<(), Error> {
    let [near, far] = settings.clip;
    if !(0.0 <= near && near < far) {
        return Err(Error::Scene(format!("the camera's clip range is {near} to {far}; it must rise, from 0 or more")));
    }
    if settings.shift.iter().any(|shift| !shift.is_finite())
        || settings.border.is_some_and(|b| b.iter().any(|v| v.is_nan()))
    {
        return Err(Error::Scene("the camera's shift or border is not a number: give finite values".into()));
    }
    Ok(())
}
