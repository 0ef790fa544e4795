//! A camera for models that come without one.

use super::CameraOptions;
use super::mitsuba::look_at;
use crate::scene::{FilmDesc, FilterDesc, FovAxis, SceneDesc, SensorDesc};
use glam::DVec3;

/// A camera after the options; what they leave open is chosen so that the sphere around all shapes just fits into the
/// picture.
pub(super) fn camera(scene: &SceneDesc, options: &CameraOptions) -> Result<SensorDesc, String> {
    let (center, radius) = bounding_sphere(scene);
    let [width, height] = options.resolution.unwrap_or([1280, 720]);
    let fov = options.fov.unwrap_or(40.0);
    if !(fov > 0.0 && fov < 180.0) {
        return Err(format!("the field of view must be between 0 and 180 degrees, not {fov}"));
    }
    let target = options.target.unwrap_or(center);
    // The narrower of the two half angles decides.
    let half_x = (fov.to_radians() * 0.5).tan();
    let half = half_x.min(half_x * f64::from(height) / f64::from(width.max(1))).atan();
    let distance = radius / half.sin();
    let origin = options.origin.unwrap_or_else(|| center + DVec3::new(0.35, 0.25, 1.0).normalize() * distance);
    let forward = (target - origin).normalize_or_zero();
    let up = options.up.unwrap_or(if forward.y.abs() > 0.999 { DVec3::Z } else { DVec3::Y });
    let extent = (origin - center).length() + radius;
    Ok(SensorDesc {
        to_world: look_at(origin, target, up).map_err(|m| format!("the camera cannot be placed: {m}"))?,
        fov,
        fov_axis: FovAxis::X,
        principal_point: [0.0; 2],
        near_clip: extent * 1e-6,
        far_clip: extent * 10.0,
        aperture_radius: 0.0,
        focus_distance: extent,
        medium: None,
        film: FilmDesc { width, height, crop: None, filter: FilterDesc::Gaussian { stddev: 0.5 }, span: None },
        sample_count: None,
        span: None,
    })
}

/// Centre and radius of the sphere around the box around all shapes; a unit sphere if there is nothing.
fn bounding_sphere(scene: &SceneDesc) -> (DVec3, f64) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for shape in &scene.shapes {
        let Some(mesh) = shape.geometry.mesh() else { continue };
        for p in &scene.meshes[mesh.index()].positions {
            let p = shape.to_world.transform_point3(p.as_dvec3());
            low = low.min(p);
            high = high.max(p);
        }
    }
    let radius = (high - low).length() * 0.5;
    if radius.is_finite() && radius > 0.0 { ((low + high) * 0.5, radius) } else { (DVec3::ZERO, 1.0) }
}
