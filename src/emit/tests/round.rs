//! Emitting spheres, disks and cylinders against closed forms and against rays that meet them by chance.

use super::*;

const INTERVAL: [f32; 2] = [f32::MIN_POSITIVE, f32::INFINITY];

fn round(kind: RoundKind, to_world: DMat4, flip: bool) -> RoundLight {
    let shape = RoundShape::new(kind, to_world, flip, SurfaceMask::BLOCKERS);
    RoundLight::new(shape, RoundEmission::Constant(Rgb::WHITE))
}

fn sphere(centre: DVec3, radius: f64, flip: bool) -> RoundLight {
    round(RoundKind::Sphere, DMat4::from_translation(centre) * DMat4::from_scale(DVec3::splat(radius)), flip)
}

/// Irradiance at `from` on a surface with the unit normal `n`, by samples of the light.
fn irradiance(light: &RoundLight, from: Vec3, n: Vec3, stream: u64) -> f64 {
    let (count, mut rng) = (128u32, rng(stream));
    let mut sum = 0.0;
    for i in 0..count * count {
        let jitter = pair(&mut rng);
        let u = [((i % count) as f32 + jitter[0]) / count as f32, ((i / count) as f32 + jitter[1]) / count as f32];
        if let Some(s) = light.sample_direct(from, u) {
            sum += f64::from(s.radiance.g * s.wi.dot(n).max(0.0)) / f64::from(s.pdf.0);
        }
    }
    sum / f64::from(count * count)
}

/// Spheres from any distance: π L (r / d)² on a surface that faces the centre, π L inside.
#[test]
fn irradiance_from_spheres_is_that_of_the_closed_form() {
    let direction = Vec3::new(1.0, 2.0, -2.0) / 3.0;
    for radius in [1e-3, 1.0, 300.0] {
        for relative in [1.0001, 1.01, 2.0, 1e3, 1e5] {
            let centre = direction.as_dvec3() * relative * radius;
            for flip in [false, true] {
                let light = sphere(centre, radius, flip);
                let found = irradiance(&light, Vec3::ZERO, direction, 200);
                let exact = std::f64::consts::PI / (relative * relative);
                assert!((found / exact - 1.0).abs() < 2e-3, "{radius} {relative} {flip}: {found} {exact}");
            }
        }
        for relative in [0.0, 0.5, 0.999] {
            let centre = direction.as_dvec3() * relative * radius;
            let found = irradiance(&sphere(centre, radius, true), Vec3::ZERO, Vec3::Y, 201);
            assert!((found / std::f64::consts::PI - 1.0).abs() < 2e-3, "{radius} {relative}: {found}");
            assert!(sphere(centre, radius, false).sample_direct(Vec3::ZERO, [0.3, 0.4]).is_none());
        }
    }
}

/// A disk seen from its axis: π L r² / (r² + h²), from the front only.
#[test]
fn irradiance_from_a_disk_is_that_of_the_closed_form() {
    let to_world = DMat4::from_translation(DVec3::new(1.0, -2.0, 0.5)) * DMat4::from_rotation_y(0.8);
    let turn = |v: DVec3| to_world.transform_point3(v).as_vec3();
    let light = round(RoundKind::Disk, to_world * DMat4::from_scale(DVec3::splat(2.0)), false);
    for h in [0.5, 1.0, 10.0] {
        let n = (turn(DVec3::ZERO) - turn(DVec3::Z)).normalize();
        let found = irradiance(&light, turn(DVec3::Z * h), n, 202);
        let exact = std::f64::consts::PI * 4.0 / (4.0 + h * h);
        assert!((found / exact - 1.0).abs() < 1e-2, "{h}: {found} {exact}");
        assert!(light.sample_direct(turn(DVec3::Z * -h), [0.3, 0.4]).is_none());
    }
}

/// Points that rays meet by chance have the density with which samples are drawn: it integrates to the share of samples
/// that face the point, and both estimate the same irradiance.
#[test]
fn densities_of_hits_are_those_of_samples() {
    let tall = DMat4::from_rotation_x(0.4) * DMat4::from_scale(DVec3::new(0.7, 0.7, 2.0));
    let ellipse = DMat4::from_rotation_x(0.4) * DMat4::from_scale(DVec3::new(0.5, 1.5, 1.0));
    let from = Vec3::new(0.9, 0.4, 1.9);
    let cases = [
        ("cylinder", round(RoundKind::Cylinder, tall, false), from),
        ("inside of a cylinder", round(RoundKind::Cylinder, tall, true), Vec3::new(0.1, -0.2, 0.7)),
        ("disk", round(RoundKind::Disk, ellipse, false), from),
        ("sphere", sphere(DVec3::new(0.2, 0.0, 0.1), 1.2, false), from),
        ("inside of a sphere", sphere(DVec3::new(0.2, 0.0, 0.1), 3.0, true), from),
    ];
    let (count, n) = (600u32, Vec3::new(-2.0, 1.0, -2.0) / 3.0);
    for (name, light, from) in cases {
        let mut rng = rng(203);
        let (mut density, mut hits) = (0.0, 0.0);
        for i in 0..count * count {
            let jitter = pair(&mut rng);
            let u = [((i % count) as f32 + jitter[0]) / count as f32, ((i / count) as f32 + jitter[1]) / count as f32];
            let wi = crate::math::warp::square_to_sphere(u);
            // Whatever is met: on a cylinder the first point may be the dark side of the wall.
            let mut interval = INTERVAL;
            while let Some((t, code)) = light.shape().intersect(from, wi, interval) {
                let (ng, distance) = (light.shape().point(code).ng, t as f32);
                let emitted = light.emitted(code, -wi);
                let pdf = light.pdf_direct(from, ng, wi, distance);
                assert_eq!(emitted.is_black(), pdf.0 == 0.0, "{name}");
                density += f64::from(pdf.0);
                hits += f64::from(emitted.g * wi.dot(n).max(0.0));
                interval[0] = (t as f32 * 1.0001).max(1e-3);
            }
        }
        let share = 4.0 * std::f64::consts::PI / f64::from(count * count);
        let facing = (0..100_000).filter(|_| light.sample_direct(from, pair(&mut rng)).is_some()).count() as f64 / 1e5;
        assert!((density * share - facing).abs() < 0.01, "{name}: {} of {facing}", density * share);
        let sampled = irradiance(&light, from, n, 204);
        assert!((hits * share / sampled - 1.0).abs() < 0.01, "{name}: {} {sampled}", hits * share);
    }
}

/// Emission leaves the front, and its flux is the power.
#[test]
fn power_of_a_textured_sphere_is_that_of_its_emission() {
    let to_world = DMat4::from_rotation_x(1.1) * DMat4::from_scale(DVec3::splat(0.6));
    let shape = RoundShape::new(RoundKind::Sphere, to_world, false, SurfaceMask::BLOCKERS);
    let light = RoundLight::new(shape, RoundEmission::Textured(Arc::new(Ramp)));
    let (count, mut rng) = (200u32, rng(205));
    let mut flux = 0.0;
    for i in 0..count * count {
        let u = [i % count, i / count].map(|i| (i as f32 + 0.5) / count as f32);
        let s = light.sample_emission(u, pair(&mut rng)).unwrap();
        assert!(s.ng.is_some_and(|ng| ng.dot(s.direction) > 0.0 && ng.dot(s.origin) > 0.0));
        flux += f64::from(s.flux().luminance()) / f64::from(count * count);
    }
    assert!((flux / f64::from(light.power()) - 1.0).abs() < 5e-3, "{flux} {}", light.power());
}
