//! `Camera`.

use espalier_core::render::{self, CameraSettings, Projection, SensorFit};
use pyo3::prelude::*;

use crate::{
    arrays::{self, Table},
    errors::{Kind, OrRaise, guard},
    fields,
};

/// A camera as Blender has it, immutable.
///
/// kind: "perspective" or "orthographic". matrix: (4, 4) camera to world; it looks along its -Z, up is +Y, and its
/// scale is ignored. resolution: width and height of the whole frame in pixels, resolution percentage applied. lens,
/// sensor_width, sensor_height: mm. sensor_fit: "auto", "horizontal" or "vertical". shift: in units of the fitted side,
/// (0, 0) if left out. ortho_scale: scene units along the fitted side. clip: nearest and farthest distance along the
/// view axis, (0.1, 1000) if left out. pixel_aspect: width and height of a pixel, (1, 1) if left out. border: (min_x,
/// min_y, max_x, max_y) in 0..1 of the frame; None for all.
///
/// Raises SceneError, which names the value at fault.
#[pyclass(frozen, module = "espalier_rt")]
pub struct Camera(render::Camera);

impl Camera {
    /// The core's camera.
    pub fn core(&self) -> &render::Camera {
        &self.0
    }
}

#[pymethods]
impl Camera {
    #[new]
    #[allow(clippy::too_many_arguments, reason = "they are keywords in Python")]
    #[pyo3(signature = (*, kind, matrix, resolution, lens=50.0, sensor_width=36.0, sensor_height=24.0,
        sensor_fit="auto", shift=(0.0, 0.0), ortho_scale=6.0, clip=(0.1, 1000.0), pixel_aspect=(1.0, 1.0),
        border=None))]
    fn new(
        kind: &str,
        matrix: &Bound<'_, PyAny>,
        resolution: (i64, i64),
        lens: f32,
        sensor_width: f32,
        sensor_height: f32,
        sensor_fit: &str,
        shift: (f32, f32),
        ortho_scale: f32,
        clip: (f32, f32),
        pixel_aspect: (f32, f32),
        border: Option<[f32; 4]>,
    ) -> PyResult<Self> {
        let py = matrix.py();
        guard(py, || {
            let settings = CameraSettings {
                projection: projection(py, kind, lens, ortho_scale)?,
                matrix: fields::matrix(matrix, "the camera's matrix")?,
                resolution: [pixels(py, resolution.0)?, pixels(py, resolution.1)?],
                sensor: [sensor_width, sensor_height],
                fit: fit(py, sensor_fit)?,
                shift: shift.into(),
                clip: clip.into(),
                pixel_aspect: pixel_aspect.into(),
                border,
            };
            render::Camera::new(&settings).map(Self).or_raise(py)
        })
    }

    /// Width and height of the picture that is rendered, in pixels: the frame, or the border's part of it.
    #[getter]
    fn size(&self) -> (usize, usize) {
        self.0.size().into()
    }

    /// Rays through the centres of all pixels of the picture, rows bottom-up: origins and unit directions, both
    /// (height * width, 3) float32. They are not limited by the clip range.
    fn rays(&self, py: Python<'_>) -> PyResult<(Table<f32>, Table<f32>)> {
        guard(py, || {
            let (camera, window) = (&self.0, self.0.window());
            let ray = |index| {
                let [x, y] = window.pixel(index).map(|pixel| f64::from(pixel) + 0.5);
                camera.ray(x, y)
            };
            let pixels = 0..window.count();
            let origins = arrays::table(py, pixels.clone().map(|index| ray(index).origin.to_array()))?;
            let directions = arrays::table(py, pixels.map(|index| ray(index).direction.to_array()))?;
            Ok((origins, directions))
        })
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.size();
        format!("Camera(size=({width}, {height}))")
    }
}

fn projection(py: Python<'_>, kind: &str, lens: f32, scale: f32) -> PyResult<Projection> {
    match kind {
        "perspective" => Ok(Projection::Perspective { lens }),
        "orthographic" => Ok(Projection::Orthographic { scale }),
        _ => {
            let message = format!("the camera's kind is '{kind}'; it must be 'perspective' or 'orthographic'");
            Err(Kind::Scene.error(py, message))
        }
    }
}

fn fit(py: Python<'_>, fit: &str) -> PyResult<SensorFit> {
    match fit {
        "auto" => Ok(SensorFit::Auto),
        "horizontal" => Ok(SensorFit::Horizontal),
        "vertical" => Ok(SensorFit::Vertical),
        _ => {
            let message = format!("the camera's sensor_fit is '{fit}'; it must be 'auto', 'horizontal' or 'vertical'");
            Err(Kind::Scene.error(py, message))
        }
    }
}

/// A side of the frame; the core checks its range.
fn pixels(py: Python<'_>, side: i64) -> PyResult<u32> {
    side.try_into()
        .map_err(|_| Kind::Scene.error(py, format!("a frame with a side of {side} pixels: it must be 1 or more")))
}
