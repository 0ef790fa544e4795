//! Units of length. Single precision squares and multiplies lengths: radii of scenes, distances, densities per area.
//! Scenes of a size at which these leave its range are scaled to about unit size when they are prepared.

use super::placing::{bounds, bounds_of};
use crate::math::DVec3;
use crate::scene::{BsdfKind, EmitterKind, GroupDesc, ProjectorDesc, SceneDesc, SensorDesc, VolumeDesc};
use glam::DMat4;
use std::ops::RangeInclusive;

/// Half diagonals of scenes, in units of the file, that are rendered as they are.
const USUAL: RangeInclusive<f64> = 1e-6..=1e6;

/// Scales a scene of unusual size to about unit size; its picture stays what it is. Returns the length of the new unit
/// in units of the file, a power of two.
pub(super) fn to_usual_size(desc: &mut SceneDesc) -> f64 {
    let Some((lo, hi)) = bounds(desc) else { return 1.0 };
    let size = 0.5 * (hi - lo).length();
    if USUAL.contains(&size) || size == 0.0 || !size.is_finite() {
        return 1.0;
    }
    let unit = power_of_two_near(size);
    scale_scene(desc, 1.0 / unit);
    unit
}

fn power_of_two_near(size: f64) -> f64 {
    size.log2().round().clamp(-900.0, 900.0).exp2()
}

/// Scales all lengths of a scene around the origin. Lights of which the file gives an intensity shine so that the
/// irradiance of what they light stays.
fn scale_scene(desc: &mut SceneDesc, scale: f64) {
    desc.sensors.iter_mut().for_each(|sensor| scale_sensor(sensor, scale));
    let larger = DMat4::from_scale(DVec3::splat(scale));
    desc.shapes.iter_mut().for_each(|shape| shape.to_world = larger * shape.to_world);
    scale_groups(desc, larger);
    for bsdf in &mut desc.bsdfs {
        if let BsdfKind::BumpMap { scale: height, .. } = &mut bsdf.kind {
            *height = (f64::from(*height) * scale) as f32;
        }
    }
    for medium in &mut desc.media {
        medium.scale = (f64::from(medium.scale) / scale) as f32;
        for volume in [&mut medium.sigma_t, &mut medium.albedo] {
            if let VolumeDesc::Grid(grid) = volume {
                grid.to_world = larger * grid.to_world;
            }
        }
    }
    let squared = |intensity: &mut crate::math::Rgb| {
        // In steps: the square alone may leave the range of single precision.
        *intensity *= scale as f32;
        *intensity *= scale as f32;
    };
    for emitter in &mut desc.emitters {
        match &mut emitter.kind {
            EmitterKind::Point { position, intensity } => {
                *position *= scale;
                squared(intensity);
            }
            EmitterKind::Spot { to_world, intensity, .. } => {
                scale_place(to_world, scale);
                squared(intensity);
            }
            EmitterKind::Projector(ProjectorDesc { to_world, scale: brightness, .. }) => {
                scale_place(to_world, scale);
                *brightness *= scale as f32;
                *brightness *= scale as f32;
            }
            EmitterKind::Directional { .. }
            | EmitterKind::Constant { .. }
            | EmitterKind::Envmap { .. }
            | EmitterKind::SunSky { .. } => {}
        }
    }
}

/// Scales groups to about unit size in their own spaces, and the places of their instances accordingly: the maps between
/// them then hold no sizes that single precision could not.
fn scale_groups(desc: &mut SceneDesc, larger: DMat4) {
    let own_unit = |group: &GroupDesc| {
        let bounds = bounds_of(desc, group.shapes.iter().map(|shape| (shape, DMat4::IDENTITY)));
        let size = bounds.map_or(0.0, |(lo, hi)| 0.5 * (hi - lo).length());
        if size > 0.0 && size.is_finite() { power_of_two_near(size) } else { 1.0 }
    };
    let units: Vec<f64> = desc.groups.iter().map(own_unit).collect();
    for (group, unit) in desc.groups.iter_mut().zip(&units) {
        let to_unit = DMat4::from_scale(DVec3::splat(1.0 / unit));
        group.shapes.iter_mut().for_each(|shape| shape.to_world = to_unit * shape.to_world);
    }
    for instance in &mut desc.instances {
        let unit = units.get(instance.group.index()).copied().unwrap_or(1.0);
        instance.to_world = larger * instance.to_world * DMat4::from_scale(DVec3::splat(unit));
    }
}

fn scale_sensor(sensor: &mut SensorDesc, scale: f64) {
    scale_place(&mut sensor.to_world, scale);
    sensor.near_clip *= scale;
    sensor.far_clip *= scale;
    sensor.aperture_radius *= scale;
    sensor.focus_distance *= scale;
}

/// Scales where a frame stands, not the frame itself.
fn scale_place(frame: &mut DMat4, scale: f64) {
    frame.w_axis = (frame.w_axis.truncate() * scale).extend(frame.w_axis.w);
}
