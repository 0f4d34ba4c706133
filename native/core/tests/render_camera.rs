//! Rays of cameras against values worked out by hand from Blender's rules.

use espalier_core::{
    Error,
    render::{Camera, CameraSettings, Projection, SensorFit},
};
use glam::{Mat4, Vec3};

fn camera(settings: CameraSettings) -> Camera {
    Camera::new(&settings).unwrap()
}

fn close(a: Vec3, b: Vec3) {
    assert!((a - b).abs().max_element() < 1e-5, "{a} is not {b}");
}

/// Where the ray through a point of the frame meets the plane at unit distance.
fn slope(camera: &Camera, x: f64, y: f64) -> Vec3 {
    let direction = camera.ray(x, y).direction;
    direction / -direction.z
}

#[test]
fn auto_fit_spans_the_longer_side_with_the_sensor_width() {
    let wide = camera(CameraSettings { resolution: [200, 100], ..Default::default() });
    close(slope(&wide, 200.0, 50.0), Vec3::new(18.0 / 50.0, 0.0, -1.0));
    close(slope(&wide, 100.0, 100.0), Vec3::new(0.0, 9.0 / 50.0, -1.0));
    let tall = camera(CameraSettings { resolution: [100, 200], ..Default::default() });
    close(slope(&tall, 50.0, 200.0), Vec3::new(0.0, 18.0 / 50.0, -1.0));
}

#[test]
fn fixed_fits_span_their_side_with_their_sensor() {
    let vertical = CameraSettings { resolution: [200, 100], fit: SensorFit::Vertical, ..Default::default() };
    close(slope(&camera(vertical), 200.0, 100.0), Vec3::new(24.0 / 50.0, 12.0 / 50.0, -1.0));
    let horizontal = CameraSettings { resolution: [100, 200], fit: SensorFit::Horizontal, ..Default::default() };
    close(slope(&camera(horizontal), 100.0, 200.0), Vec3::new(18.0 / 50.0, 36.0 / 50.0, -1.0));
}

#[test]
fn pixels_with_an_aspect_stretch_the_frame() {
    let settings = CameraSettings { resolution: [100, 100], pixel_aspect: [1.0, 2.0], ..Default::default() };
    close(slope(&camera(settings), 100.0, 100.0), Vec3::new(9.0 / 50.0, 18.0 / 50.0, -1.0));
}

#[test]
fn shifts_are_in_units_of_the_fitted_side() {
    let settings = CameraSettings { resolution: [200, 100], shift: [0.5, 0.25], ..Default::default() };
    close(slope(&camera(settings), 100.0, 50.0), Vec3::new(18.0 / 50.0, 9.0 / 50.0, -1.0));
}

#[test]
fn orthographic_rays_are_parallel_and_their_scale_spans_the_fitted_side() {
    let projection = Projection::Orthographic { scale: 6.0 };
    let ray = camera(CameraSettings { projection, resolution: [200, 100], ..Default::default() }).ray(200.0, 0.0);
    close(ray.origin, Vec3::new(3.0, -1.5, 0.0));
    close(ray.direction, -Vec3::Z);
    assert_eq!((ray.tmin, ray.tmax), (0.1, 1000.0));
}

#[test]
fn clip_distances_and_depth_are_along_the_view_axis() {
    let camera = camera(CameraSettings { resolution: [100, 100], ..Default::default() });
    let ray = camera.ray(0.0, 0.0);
    let stretch = (1.0 + 2.0 * 0.36f32 * 0.36).sqrt();
    assert!((ray.tmin - 0.1 * stretch).abs() < 1e-6 && (ray.tmax - 1000.0 * stretch).abs() < 1e-3);
    assert!((camera.depth(ray.direction, 5.0 * stretch) - 5.0).abs() < 1e-5);
}

#[test]
fn the_matrix_places_the_camera_and_its_scale_is_ignored() {
    let placed = Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0))
        * Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2)
        * Mat4::from_scale(Vec3::new(2.0, 3.0, 4.0));
    let ray = camera(CameraSettings { matrix: placed, resolution: [100, 100], ..Default::default() }).ray(50.0, 50.0);
    close(ray.origin, Vec3::new(1.0, 2.0, 3.0));
    close(ray.direction, Vec3::Y);
}

#[test]
fn a_border_is_a_window_of_the_same_frame() {
    let border = Some([0.25, 0.5, 0.75, 1.0]);
    let camera = camera(CameraSettings { border, resolution: [100, 50], ..Default::default() });
    assert_eq!((camera.size(), camera.window().first), ([50, 25], [25, 25]));
    let whole = Camera::new(&CameraSettings { resolution: [100, 50], ..Default::default() }).unwrap();
    assert_eq!(camera.ray(30.5, 30.5), whole.ray(30.5, 30.5));
}

#[test]
fn unusable_cameras_are_told_apart() {
    let refused = |settings: CameraSettings, word: &str| match Camera::new(&settings) {
        Err(Error::Scene(message)) => assert!(message.contains(word), "{message}"),
        other => panic!("{other:?}"),
    };
    let with = CameraSettings::default;
    refused(CameraSettings { resolution: [0, 10], ..with() }, "0 by 10");
    refused(CameraSettings { resolution: [10, 1 << 17], ..with() }, "pixels");
    refused(CameraSettings { border: Some([0.5, 0.5, 0.5, 1.0]), ..with() }, "border");
    refused(CameraSettings { border: Some([0.0, 0.0, f32::NAN, 1.0]), ..with() }, "border");
    refused(CameraSettings { matrix: Mat4::ZERO, ..with() }, "singular");
    refused(CameraSettings { matrix: Mat4::from_translation(Vec3::NAN), ..with() }, "finite");
    refused(CameraSettings { clip: [1.0, 1.0], ..with() }, "clip");
    refused(CameraSettings { clip: [0.1, f32::NAN], ..with() }, "clip");
    refused(CameraSettings { projection: Projection::Perspective { lens: 0.0 }, ..with() }, "lens");
    refused(CameraSettings { pixel_aspect: [1.0, -1.0], ..with() }, "pixel_aspect");
    refused(CameraSettings { shift: [f32::INFINITY, 0.0], ..with() }, "shift");
}
