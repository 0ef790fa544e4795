//! Transforms that single precision cannot hold. Backends move every ray into an instance's space by a single precision
//! inverse: where that overflows, Embree ends the process, and where an instance shrinks to a point, the triangles of it
//! have one box and the tree over them takes quadratic time.

use crate::math::Vec3;
use crate::ray::{Geometry, Instance};
use crate::scene::{Diagnostic, Diagnostics, InstanceDesc};

/// Components of rays in the space of an instance stay below this; Embree's limit is 1.8e18.
const MAX_RAY: f64 = 1e18;
/// Determinants whose size is outside of this range lose digits or vanish when a backend inverts the map.
const DETERMINANT: std::ops::Range<f32> = 1e-36..1e36;
/// Size of an instance over its largest coordinate below which its points are not told apart.
const MIN_SIZE: f32 = 1.0 / (1 << 22) as f32;
/// Ray components are at most this many times the reach of the scene.
const RAY_SHARE: f64 = 16.0;
/// Largest distance of a scene's surfaces, camera and lights from its centre.
pub(super) const MAX_REACH: f32 = 1e17;

/// Adds an error for every instance in whose space single precision cannot hold rays or surfaces. `reach` is the largest
/// distance of a ray's origin from the scene's centre.
pub(super) fn check_instances(geometry: &Geometry, descs: &[InstanceDesc], reach: f32, out: &mut Diagnostics) {
    let boxes: Vec<_> = geometry.groups.iter().map(|group| geometry.bounds_of(group)).collect();
    for (instance, desc) in geometry.instances.iter().zip(descs) {
        let Some(bounds) = boxes.get(instance.group as usize).copied().flatten() else { continue };
        if let Some(problem) = problem(instance, bounds, reach) {
            let message = format!("the transform of this instance {problem}");
            out.push(Diagnostic::error("scene::bad-transform", message).at(desc.span.clone()));
        }
    }
}

fn problem(instance: &Instance, (lo, hi): (Vec3, Vec3), reach: f32) -> Option<&'static str> {
    let m = instance.to_world;
    let inverse = m.inverse();
    if !(m.is_finite() && inverse.is_finite() && DETERMINANT.contains(&m.matrix3.determinant().abs())) {
        return Some("or its inverse is beyond the range of single precision");
    }
    let columns = [inverse.matrix3.x_axis, inverse.matrix3.y_axis, inverse.matrix3.z_axis, inverse.translation];
    let largest = columns.iter().map(|c| c.abs().max_element()).fold(0.0, f32::max);
    if f64::from(largest) * RAY_SHARE * (f64::from(reach) + 1.0) >= MAX_RAY {
        return Some("is so small that rays in the space of its group are beyond the range of single precision");
    }
    let corner = |i: u32| {
        let pick = |bit: u32, lo: f32, hi: f32| if i >> bit & 1 == 0 { lo } else { hi };
        m.transform_point3(Vec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z)))
    };
    let (lo, hi) = (0..8).map(corner).fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let farthest = lo.abs().max(hi.abs()).max_element();
    // Written so that a coordinate that is not a number is a problem as well.
    let sound = farthest < MAX_REACH && (hi - lo).max_element() >= MIN_SIZE * farthest;
    (!sound).then_some("makes it smaller than single precision can show at its place, or puts it out of range")
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine3A, Mat3A, Vec3A};

    fn is_sound(scale: [f32; 3], translation: f32) -> bool {
        let matrix3 = Mat3A::from_diagonal(scale.into());
        let to_world = Affine3A { matrix3, translation: Vec3A::splat(translation) };
        problem(&Instance { group: 0, to_world }, (Vec3::splat(-1.0), Vec3::splat(1.0)), 10.0).is_none()
    }

    #[test]
    fn instances_scaled_to_nothing_are_told_from_small_ones() {
        for scale in [1.0, -1.0, 1e-3, 1e-10, 1e10] {
            assert!(is_sound([scale; 3], 0.0), "{scale}");
        }
        assert!(is_sound([1.0, 1.0, 1e-8], 0.0) && is_sound([1e-5; 3], 10.0) && is_sound([1.0; 3], 1e6));
        for scale in [0.0, 1e-15, 1e-20, 1e-40, 1e20, 1e38, f32::INFINITY, f32::NAN] {
            assert!(!is_sound([scale; 3], 0.0), "{scale}");
        }
        // One axis alone; an instance that is a single point at its place.
        assert!(!is_sound([1.0, 1.0, 1e-20], 0.0) && !is_sound([1e-9; 3], 10.0) && !is_sound([1.0; 3], 1e18));
    }
}
