use super::*;
use crate::math::hash::HashRng;
use crate::math::warp::square_to_sphere;
use glam::DQuat;

const KINDS: [RoundKind; 3] = [RoundKind::Sphere, RoundKind::Disk, RoundKind::Cylinder];

fn shape(kind: RoundKind, to_place: DMat4) -> RoundShape {
    RoundShape::new(kind, to_place, false, SurfaceMask::BLOCKERS)
}

fn placed_with(scale: DVec3, translation: DVec3) -> DMat4 {
    DMat4::from_scale_rotation_translation(
        scale,
        DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(-1.2),
        translation,
    )
}

fn ray_at(rng: &mut HashRng, shape: &RoundShape, distance: f64) -> (Vec3, Vec3) {
    let [a, b, c, d] = rng.next_4();
    let [target, _] = [[a, b], [b, c]].map(|u| shape.to_place.transform_point3(shape.sample_unit(u) * 0.9));
    let from = target + square_to_sphere([c, d]).as_dvec3() * distance;
    (from.as_vec3(), (target.as_vec3() - from.as_vec3()).normalize())
}

/// A hit's point is on the surface, up to the rounding of its coordinates, and on the ray, up to the rounding of ray
/// and code.
#[test]
fn points_of_hits_are_on_the_surface_and_on_the_ray() {
    let mut rng = HashRng::new(1, 2, 3, 4);
    let places = [
        (DVec3::ONE, DVec3::ZERO),
        (DVec3::splat(1000.0), DVec3::new(0.0, -1000.0, 0.0)),
        (DVec3::splat(1e-3), DVec3::new(3.0, -7.0, 5.0)),
        (DVec3::new(2.0, 0.5, -1.0), DVec3::new(-1.0, 2.0, 0.0)),
    ];
    for (kind, (scale, translation)) in KINDS.into_iter().flat_map(|k| places.map(|p| (k, p))) {
        let shape = shape(kind, placed_with(scale, translation));
        let size = scale.abs().max_element();
        let mut hits = 0;
        for _ in 0..2000 {
            let (o, d) = ray_at(&mut rng, &shape, 20.0 * size);
            let Some((t, code)) = shape.intersect(o, d, [f32::MIN_POSITIVE, f32::INFINITY]) else { continue };
            hits += 1;
            let RoundPoint { p, error, ng } = shape.point(code);
            let x = shape.from_place.transform_point3(p.as_dvec3());
            let height = match kind {
                RoundKind::Sphere => x.length() - 1.0,
                RoundKind::Disk => x.z,
                RoundKind::Cylinder => x.truncate().length() - 1.0,
            };
            // For ellipsoids the height is in another unit: the smallest axis has the largest.
            let unit = scale.abs().min_element();
            assert!(height.abs() * unit <= f64::from(error) * size / unit, "{kind:?} {scale} {height} {error}");
            assert!((ng.length() - 1.0).abs() < 1e-5);
            let on_ray = o.as_dvec3() + d.as_dvec3() * t;
            let tolerance = 3e-7 * size + f64::from(error) + 1e-12 * t;
            assert!((on_ray - p.as_dvec3()).length() <= tolerance, "{kind:?} {scale} {}", on_ray - p.as_dvec3());
        }
        assert!(hits > 1000, "{kind:?} {scale}: {hits}");
    }
}

/// Rays leave a surface to either side without meeting it where they left, and from the inside they meet it.
#[test]
fn rays_that_leave_a_surface_do_not_meet_it_at_once() {
    use crate::ray::offset::offset_point;
    let mut rng = HashRng::new(2, 2, 3, 4);
    for (radius, translation) in [(1.0, 0.0), (1000.0, -1000.0), (1e-3, 5.0), (1e-4, -1e-4)] {
        let sphere = shape(RoundKind::Sphere, placed_with(DVec3::splat(radius), DVec3::new(0.0, translation, 0.0)));
        let disk = shape(RoundKind::Disk, placed_with(DVec3::splat(radius), DVec3::new(0.0, translation, 0.0)));
        for _ in 0..20_000 {
            let [a, b, c, d] = rng.next_4();
            for shape in [&sphere, &disk] {
                let RoundPoint { p, error, ng } = shape.point(shape.encode(shape.sample_unit([a, b])));
                let direction = square_to_sphere([c, d]);
                let o = offset_point(p, error, ng, direction);
                let met = shape.intersect(o, direction, [f32::MIN_POSITIVE, f32::INFINITY]);
                let inwards = shape.kind == RoundKind::Sphere && direction.dot(ng) < 0.0;
                assert_eq!(met.is_some(), inwards, "{radius} {direction} {ng}");
                if let Some((t, _)) = met {
                    let chord = f64::from(-2.0 * direction.dot(ng)) * radius;
                    // The longest chord through the layer that the origin is moved by.
                    let layer = (30.0 * f64::from(error) * radius).sqrt();
                    assert!((t - chord).abs() < 1e-6 * radius + layer, "{t} {chord}");
                }
            }
        }
    }
}

#[test]
fn codes_name_points() {
    let mut rng = HashRng::new(3, 2, 3, 4);
    for kind in KINDS {
        let shape = shape(kind, DMat4::IDENTITY);
        for _ in 0..5000 {
            let x = shape.sample_unit([rng.next_f32(), rng.next_f32()]);
            assert!((shape.decode(shape.encode(x)) - x).length() < 2e-7, "{kind:?} {x}");
        }
    }
    let sphere = shape(RoundKind::Sphere, DMat4::IDENTITY);
    for pole in DVec3::AXES.into_iter().chain(DVec3::AXES.map(|a| -a)) {
        assert_eq!(sphere.decode(sphere.encode(pole)), pole);
    }
}

/// Texture coordinates, derivatives and normals of single hits by Mitsuba 3.9.1, scalar_rgb.
#[test]
fn parametrisations_are_mitsubas() {
    use RoundKind::{Cylinder, Disk, Sphere};
    use std::f32::consts::PI as HALF_TURN;
    let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let down = ([0.3, 0.5, 3.0], [0.0, 0.0, -1.0]);
    let across = ([3.0, 0.5, 0.3], [-1.0, 0.0, 0.0]);
    #[rustfmt::skip]
    let cases = [
        (Sphere, down, [0.163_989, 0.198_159], [0.3, 0.5, 0.812_404], [-HALF_TURN, 1.884_96, 0.0], [1.313_12, 2.188_53, -1.831_85]),
        (Disk, down, [0.583_095, 0.163_989], [0.0, 0.0, 1.0], [0.514_496, 0.857_493, 0.0], [-HALF_TURN, 1.884_96, 0.0]),
        (Cylinder, across, [0.083_333_4, 0.3], [0.866_025, 0.5, 0.0], [-HALF_TURN, 5.441_4, 0.0], [0.0, 0.0, 1.0]),
    ];
    for (kind, (o, d), uv, n, dpdu, dpdv) in cases {
        let [o, d, n, dpdu, dpdv] = [o, d, n, dpdu, dpdv].map(Vec3::from);
        for (to_place, sign) in [(DMat4::IDENTITY, 1.0), (mirror, -1.0)] {
            let turn = |v: Vec3| v.with_x(v.x * sign);
            for flip in [false, true] {
                let shape = RoundShape::new(kind, to_place, flip, SurfaceMask::BLOCKERS);
                let (_, code) = shape.intersect(turn(o), turn(d), [0.0, 10.0]).unwrap();
                let found = shape.parametrise(code);
                // A mirrored sphere is inside out.
                let side = if flip != (kind == Sphere && sign < 0.0) { -1.0 } else { 1.0 };
                assert!((shape.point(code).ng - turn(n) * side).length() < 2e-6, "{kind:?} {sign} {flip}");
                assert!((found.uv - Vec2::from(uv)).length() < 2e-6, "{kind:?}: {}", found.uv);
                assert!((found.dpdu - turn(dpdu)).length() < 2e-5, "{kind:?}: {}", found.dpdu);
                assert!((found.dpdv - turn(dpdv)).length() < 2e-5, "{kind:?}: {}", found.dpdv);
            }
        }
    }
}

#[test]
fn boxes_and_balls_hold_the_surface() {
    let mut rng = HashRng::new(4, 2, 3, 4);
    for kind in KINDS {
        let shape = shape(kind, placed_with(DVec3::new(2.0, 0.7, 1.5), DVec3::new(1.0, 2.0, -3.0)));
        let (lo, hi) = shape.bounds();
        let (mut seen_lo, mut seen_hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for _ in 0..20_000 {
            let p = shape.point_of(shape.sample_unit([rng.next_f32(), rng.next_f32()])).p;
            assert!(p.cmpge(lo).all() && p.cmple(hi).all(), "{kind:?} {p}");
            (seen_lo, seen_hi) = (seen_lo.min(p), seen_hi.max(p));
            let away = square_to_sphere([rng.next_f32(), rng.next_f32()]).as_dvec3() * 0.1;
            assert!(shape.may_touch_ball(p.as_dvec3() + away, 0.100_001));
        }
        assert!((seen_lo - lo).length() < 0.05 && (seen_hi - hi).length() < 0.05, "{kind:?}: not tight");
        let far = shape.origin() + DVec3::splat(30.0);
        assert!(!shape.may_touch_ball(far, 1.0));
    }
}

#[test]
fn only_kept_kinds_emit_by_formula() {
    let uniform = placed_with(DVec3::splat(-3.0), DVec3::X);
    let long = placed_with(DVec3::new(2.0, 2.0, 5.0), DVec3::X);
    let flat = placed_with(DVec3::new(2.0, 1.0, 2.0), DVec3::X);
    let sheared = DMat4::from_cols_array_2d(&[
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.5, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);
    let kept = |kind: RoundKind| [uniform, long, flat, sheared].map(|m| kind.is_kept_by(&m));
    assert_eq!(kept(RoundKind::Sphere), [true, false, false, false]);
    assert_eq!(kept(RoundKind::Cylinder), [true, true, false, false]);
    assert_eq!(kept(RoundKind::Disk), [true; 4]);
    for (kind, area) in [(RoundKind::Sphere, 36.0 * PI), (RoundKind::Disk, 9.0 * PI), (RoundKind::Cylinder, 18.0 * PI)]
    {
        assert!((shape(kind, uniform).area() / area - 1.0).abs() < 1e-12);
    }
}
