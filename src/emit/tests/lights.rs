//! Samples against densities and quadrature.

use super::*;
use crate::math::warp::triangle_to_square;

/// Barycentrics (b1, b2) of a point of a triangle.
fn barycentrics(v: [Vec3; 3], p: Vec3) -> [f32; 2] {
    let n = (v[1] - v[0]).cross(v[2] - v[0]);
    let part = |a: Vec3, b: Vec3| (a - p).cross(b - p).dot(n) / n.length_squared();
    [part(v[2], v[0]), part(v[0], v[1])]
}

/// Near, far, almost in the plane, and just before the triangle.
fn triangles() -> Vec<(TriangleLight, Vec3)> {
    let corners = [[0.1, -0.3, 1.0], [0.2, 0.8, 1.5], [1.4, 0.1, 1.2]];
    let light = triangle(corners, Rgb::WHITE);
    let centre = (light.corners()[0] + light.corners()[1] + light.corners()[2]) / 3.0;
    let along = light.corners()[1] - light.corners()[0];
    [0.02, 0.3, 1.0, 3.0, 30.0]
        .map(|d| (light.clone(), centre + light.ng() * d))
        .into_iter()
        .chain([
            (light.clone(), centre + along * 2.0 + light.ng() * 0.2),
            (light.clone(), light.corners()[0] + light.ng() * 0.1),
        ])
        .collect()
}

/// Reference points from which the light is seen in any way.
fn reference_points() -> Vec<Vec3> {
    vec![
        Vec3::ZERO,
        Vec3::new(0.4, 0.2, 3.0),
        Vec3::new(0.5, 0.2, 1.0),
        Vec3::new(-1.0, 0.3, 0.2),
        Vec3::new(0.0, 0.0, 40.0),
    ]
}

#[test]
fn direct_densities_agree_with_their_samples() {
    for (name, light) in all_lights() {
        let mut rng = rng(1);
        let mut seen = 0;
        for from in reference_points() {
            for _ in 0..300 {
                let Some(s) = light.sample_direct(from, pair(&mut rng)) else { continue };
                seen += 1;
                assert!((s.wi.length() - 1.0).abs() < 1e-5 && s.radiance.is_finite(), "{name}");
                assert_eq!(s.delta, light.is_delta(), "{name}");
                assert_eq!(s.distance.is_infinite(), light.is_infinite(), "{name}");
                let pdf = light.pdf_direct(from, s.end.normal(), s.wi, s.distance);
                if s.delta {
                    assert_eq!((s.pdf.0, pdf.0), (1.0, 0.0), "{name}");
                    continue;
                }
                assert!(s.pdf.0 > 0.0 && (pdf.0 / s.pdf.0 - 1.0).abs() < 1e-6, "{name} {} {}", s.pdf.0, pdf.0);
                let b = match (&light, s.end) {
                    (Light::Triangle(t), EmitterVertex::Surface { p, error, ng }) => {
                        assert!((from + s.wi * s.distance - p).abs().max_element() < 1e-5 * (1.0 + s.distance));
                        assert!(ng.dot(s.wi) < 0.0 && error > 0.0 && error < 1e-5);
                        barycentrics(t.corners(), p)
                    }
                    (Light::Round(l), EmitterVertex::Surface { p, error, ng }) => {
                        assert!((from + s.wi * s.distance - p).abs().max_element() < 1e-5 * (1.0 + s.distance));
                        assert!(ng.dot(s.wi) < 1e-6 && error > 0.0 && error < 1e-5);
                        l.shape().code_of(p)
                    }
                    _ => [0.0; 2],
                };
                let radiance = light.emitted(b, -s.wi);
                assert!(
                    (radiance.r - s.radiance.r).abs() < 1e-4 * (1.0 + radiance.r),
                    "{name} {radiance:?} {:?}",
                    s.radiance
                );
            }
        }
        assert!(seen > 100, "{name} was hardly seen");
    }
}

/// χ² of points on triangles (in the unit square that is folded onto them) against the integral of the density, which
/// must also be 1.
#[test]
fn points_on_triangles_are_distributed_as_their_density() {
    const CELLS: usize = 6;
    const SUB: usize = 24;
    let cases = triangles();
    let alpha = significance(cases.len() as u32);
    for (k, (light, from)) in cases.into_iter().enumerate() {
        let v = light.corners();
        let mut expected = vec![0.0; CELLS * CELLS];
        let side = CELLS * SUB;
        for i in 0..side * side {
            let (x, y) = (i % side, i / side);
            let u = [(x as f32 + 0.5) / side as f32, (y as f32 + 0.5) / side as f32];
            let b = crate::math::warp::square_to_triangle(u);
            let p = v[0] * (1.0 - b[0] - b[1]) + v[1] * b[0] + v[2] * b[1];
            let d = p.distance(from);
            let wi = (p - from) / d;
            let area = light.pdf_direct(from, wi, d).to_area(light.ng().dot(wi), d * d);
            expected[y / SUB * CELLS + x / SUB] += f64::from(area.0 * light.area()) / (side * side) as f64;
        }
        let total: f64 = expected.iter().sum();
        // The quadrature is coarse where the point nearly touches the triangle.
        assert!((total - 1.0).abs() < if k == 0 { 0.05 } else { 2e-3 }, "case {k}: density integrates to {total}");

        let n = 40_000;
        let mut observed = vec![0.0; CELLS * CELLS];
        let mut rng = rng(10 + k as u64);
        for _ in 0..n {
            let s = light.sample_direct(from, pair(&mut rng)).unwrap();
            let EmitterVertex::Surface { p, .. } = s.end else { panic!("a triangle is a surface") };
            let u =
                triangle_to_square(barycentrics(v, p)).map(|u| ((u * CELLS as f32).max(0.0) as usize).min(CELLS - 1));
            observed[u[1] * CELLS + u[0]] += 1.0;
        }
        if k == 0 {
            continue;
        }
        let scaled: Vec<f64> = expected.iter().map(|e| e / total * f64::from(n)).collect();
        let p = chi2_p_value(&observed, &scaled);
        assert!(p > alpha, "case {k}: p = {p}");
    }
}

/// χ² of directions over bins of the sphere against the integral of the density, which must also be 1.
#[test]
fn directions_to_environments_are_distributed_as_their_density() {
    const BINS: [usize; 2] = [24, 12];
    const SUB: usize = 20;
    let cases: Vec<_> = all_lights()
        .into_iter()
        .filter(|(n, _)| ["constant", "map", "large map", "single texel", "sky"].contains(n))
        .collect();
    let alpha = significance(cases.len() as u32);
    for (k, (name, light)) in cases.into_iter().enumerate() {
        let side = [BINS[0] * SUB, BINS[1] * SUB];
        let mut expected = vec![0.0; BINS[0] * BINS[1]];
        for i in 0..side[0] * side[1] {
            let (x, y) = (i % side[0], i / side[0]);
            // Equal areas: z and azimuth, in the world.
            let z = 1.0 - 2.0 * (y as f32 + 0.5) / side[1] as f32;
            let (sin, cos) = (std::f32::consts::TAU * (x as f32 + 0.5) / side[0] as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let pdf = light.pdf_direct(Vec3::ZERO, Vec3::ZERO, Vec3::new(r * cos, r * sin, z), f32::INFINITY);
            expected[y / SUB * BINS[0] + x / SUB] +=
                f64::from(pdf.0) * 4.0 * std::f64::consts::PI / (side[0] * side[1]) as f64;
        }
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 5e-3, "{name}: density integrates to {total}");

        let n = 40_000;
        let mut observed = vec![0.0; BINS[0] * BINS[1]];
        let mut rng = rng(30 + k as u64);
        let mut drawn = 0.0;
        for _ in 0..n {
            // Directions of black texels' neighbours are kept: only exactly black ones are dropped.
            let Some(s) = light.sample_direct(Vec3::ZERO, pair(&mut rng)) else { continue };
            drawn += 1.0;
            let u = crate::math::warp::sphere_to_square(s.wi);
            let y = ((u[0] * BINS[1] as f32) as usize).min(BINS[1] - 1);
            let x = ((u[1] * BINS[0] as f32) as usize).min(BINS[0] - 1);
            observed[y * BINS[0] + x] += 1.0;
        }
        assert!(drawn > 0.999 * f64::from(n), "{name}: {drawn} of {n}");
        let scaled: Vec<f64> = expected.iter().map(|e| e / total * drawn).collect();
        let p = chi2_p_value(&observed, &scaled);
        assert!(p > alpha, "{name}: p = {p}");
    }
}

/// The sun's disk: uniform in 1 − cos, hence in the squared chord, and every sample is inside.
#[test]
fn directions_to_the_sun_are_uniform() {
    let Environment::SunSky(sun) = sun_sky(0.0, 1.0) else { panic!("that is a sky") };
    let towards = tilted().transform_vector3(DVec3::new(0.5, 0.2, 0.6)).normalize();
    let max = 4.0 * (0.25 * 0.5358f64.to_radians()).sin().powi(2);
    let mut rng = rng(50);
    let n = 20_000;
    let mut observed = vec![0.0; 10];
    for _ in 0..n {
        let (dir, pdf) = sun.sample(pair(&mut rng)).unwrap();
        assert!((f64::from(pdf.0) * max * std::f64::consts::PI - 1.0).abs() < 1e-5);
        let chord2 = (dir.as_dvec3() - towards).length_squared();
        observed[((chord2 / max * 10.0) as usize).min(9)] += 1.0;
    }
    let p = chi2_p_value(&observed, &[f64::from(n) / 10.0; 10]);
    assert!(p > significance(1), "p = {p}");
}

/// Irradiance of a triangle wholly above the horizon of `n` (Lambert's formula for polygons).
fn lambert(v: [Vec3; 3], from: Vec3, n: Vec3) -> f64 {
    let d = v.map(|p| (p.as_dvec3() - from.as_dvec3()).normalize());
    let sum: DVec3 = (0..3)
        .map(|i| {
            let (a, b) = (d[i], d[(i + 1) % 3]);
            a.cross(b).normalize() * a.dot(b).acos()
        })
        .sum();
    0.5 * sum.dot(n.as_dvec3()).abs()
}

#[test]
fn irradiance_from_triangles_is_lamberts() {
    for (k, (light, from)) in triangles().into_iter().enumerate() {
        let n = -light.ng();
        let count = 64u32;
        let mut sum = 0.0;
        for i in 0..count * count {
            let u = [((i % count) as f32 + 0.5) / count as f32, ((i / count) as f32 + 0.5) / count as f32];
            let s = light.sample_direct(from, u).unwrap();
            sum += f64::from(s.radiance.g * s.wi.dot(n) / s.pdf.0);
        }
        let estimate = sum / f64::from(count * count);
        let exact = lambert(light.corners(), from, n);
        assert!((estimate / exact - 1.0).abs() < 3e-3, "case {k}: {estimate} {exact}");
    }
}

#[test]
fn irradiance_from_environments_is_their_quadrature() {
    for (name, light) in all_lights() {
        if !light.is_infinite() || light.is_delta() || name.contains("sun") {
            continue;
        }
        let n = Vec3::new(0.3, 0.5, 0.8).normalize();
        let (mut sampled, mut exact) = (0.0, 0.0);
        let count = 300u32;
        for i in 0..count * count {
            let u = [((i % count) as f32 + 0.5) / count as f32, ((i / count) as f32 + 0.5) / count as f32];
            if let Some(s) = light.sample_direct(Vec3::ZERO, u) {
                sampled += f64::from(s.radiance.luminance() * s.wi.dot(n).max(0.0) / s.pdf.0);
            }
            let wi = crate::math::warp::square_to_sphere(u);
            exact +=
                f64::from(light.emitted([0.0; 2], -wi).luminance() * wi.dot(n).max(0.0)) * 4.0 * std::f64::consts::PI;
        }
        assert!((sampled / exact - 1.0).abs() < 5e-3, "{name}: {sampled} {exact}");
    }
}

#[test]
fn irradiance_from_delta_lights_is_the_inverse_square_law() {
    let lights = all_lights();
    let get = |name: &str| {
        lights.iter().find(|(n, _)| *n == name).unwrap().1.sample_direct(Vec3::new(0.3, 0.2, 0.1), [0.5; 2])
    };
    let point = get("point").unwrap();
    assert!(
        (point.distance - 1.0).abs() < 1e-6
            && (point.radiance.b - 3.0).abs() < 1e-5
            && (point.wi - Vec3::Z).length() < 1e-6
    );
    let sun = get("directional").unwrap();
    assert!(
        (sun.wi - Vec3::new(-1.0, 2.0, 3.0).normalize()).length() < 1e-6 && sun.radiance == Rgb::new(1.0, 0.5, 2.0)
    );
}

/// The flux of a spot is the integral of its intensity over directions at every cutoff angle, by its power and by its
/// emission samples.
#[test]
fn power_of_a_narrow_spot_is_that_of_a_wide_one() {
    let at = DVec3::new(0.1, 0.2, 0.3);
    for beam_share in [1.0, 0.75] {
        for cutoff in [30.0f32, 3.0, 0.5, 0.1, 0.02, 0.01, 0.003] {
            let intensity = Rgb::grey((1.0 / (2.0 * (f64::from(cutoff).to_radians() * 0.5).sin().powi(2))) as f32);
            let turned = DMat4::from_translation(at) * DMat4::from_rotation_x(0.7);
            let spot = SpotLight::new(turned, intensity, cutoff, cutoff * beam_share, DVec3::ZERO).unwrap();
            // ∫ by midpoints over the angle, in double precision.
            let (b, c) = (f64::from(cutoff * beam_share).to_radians(), f64::from(cutoff).to_radians());
            let n = 4000;
            let ring = |i: u32| {
                let angle = c * (f64::from(i) + 0.5) / f64::from(n);
                let ramp = if angle <= b { 1.0 } else { (c - angle) / (c - b) };
                2.0 * std::f64::consts::PI * ramp * angle.sin() * c / f64::from(n)
            };
            let exact = (0..n).map(ring).sum::<f64>() * f64::from(intensity.g);
            assert!((f64::from(spot.power()) / exact - 1.0).abs() < 1e-5, "{cutoff}: {} {exact}", spot.power());
            let light = Light::Spot(Box::new(spot));
            let mut rng = rng(61);
            let flux = |_| light.sample_emission([0.5; 2], pair(&mut rng)).map_or(0.0, |s| f64::from(s.flux().g));
            let mean = (0..20_000).map(flux).sum::<f64>() / 20_000.0;
            assert!((mean / exact - 1.0).abs() < 0.01, "{cutoff} {beam_share}: {mean} {exact}");
        }
    }
    assert!(SpotLight::new(DMat4::IDENTITY, Rgb::WHITE, 1e-4, 0.0, DVec3::ZERO).is_err());
}

#[test]
fn emission_carries_the_power_and_agrees_with_its_densities() {
    for (name, light) in all_lights() {
        let mut rng = rng(60);
        let n = 256u32;
        let mut flux = 0.0;
        for i in 0..n * n {
            // The positions of a textured triangle and the directions of the others are stratified.
            let strata = [((i % n) as f32 + rng.next_f32()) / n as f32, ((i / n) as f32 + rng.next_f32()) / n as f32];
            let (u_pos, u_dir) = if name == "textured" { (strata, pair(&mut rng)) } else { (pair(&mut rng), strata) };
            let Some(s) = light.sample_emission(u_pos, u_dir) else { continue };
            flux += f64::from(s.flux().luminance()) / f64::from(n * n);
            assert_eq!(
                (s.delta_position, s.delta_direction),
                (light.delta_position(), light.delta_direction()),
                "{name}"
            );
            let (position, direction) = light.pdf_emission_at_vertex(s.end.normal(), s.direction);
            assert!((position.0 / s.pdf_position.0 - 1.0).abs() < 1e-6, "{name}");
            assert!((direction.0 / s.pdf_direction.0 - 1.0).abs() < 1e-3, "{name} {direction:?} {:?}", s.pdf_direction);
            if let (true, EmitterVertex::Infinite) = (light.is_infinite(), s.end) {
                // The ray enters the scene's bounding sphere of radius 2 and starts before it.
                assert!(s.origin.dot(s.direction) <= -2.0 && s.origin.cross(s.direction).length() <= 2.001, "{name}");
                assert_eq!(s.pdf_vertex().0, s.pdf_direction.0);
            } else {
                assert_eq!(s.pdf_vertex().0, s.pdf_position.0);
            }
        }
        let expected = f64::from(light.power());
        // The textured triangle's power comes from a coarse grid.
        assert!((flux / expected - 1.0).abs() < 1e-2, "{name}: {flux} {expected}");
    }
}

/// Densities agree in both orders: the area density of the vertex after the light, times the light vertex's, is the
/// Jacobian of the same pair of points.
#[test]
fn infinite_lights_follow_the_vertex_conventions() {
    let (_, light) = all_lights().into_iter().find(|(n, _)| *n == "map").unwrap();
    let s = light.sample_emission([0.3, 0.6], [0.2, 0.7]).unwrap();
    let cos = 0.25;
    let area = std::f32::consts::PI * (2.0f32 * 1.0001).powi(2);
    assert!((s.end.pdf_next_vertex(s.pdf_position, s.pdf_direction, cos, 9.0).0 * area - cos).abs() < 1e-6);
}

#[test]
fn no_reference_point_makes_nan() {
    for (name, light) in all_lights() {
        let mut points = reference_points();
        points.extend([Vec3::new(0.3, 0.2, 1.1), Vec3::new(0.1, -0.3, 1.0), Vec3::splat(1e30), Vec3::splat(-1e-30)]);
        if let Light::Triangle(t) = &light {
            let [a, b, c] = t.corners();
            let on = (a + b + c) / 3.0;
            points.extend([
                a,
                b,
                c,
                on,
                (a + b) * 0.5,
                a * 2.0 - b,
                on + t.ng() * 1e-7,
                on - t.ng() * 1e-7,
                on - t.ng(),
            ]);
        }
        let mut rng = rng(70);
        for from in points {
            for u in [[0.0, 0.0], [0.999_999_9, 0.999_999_9], [0.0, 0.999_999_9], pair(&mut rng), pair(&mut rng)] {
                if let Some(s) = light.sample_direct(from, u) {
                    assert!(s.wi.is_finite() && s.radiance.is_finite() && !s.distance.is_nan(), "{name} {from}");
                    assert!(s.pdf.0 > 0.0 && s.pdf.0.is_finite(), "{name} {from}");
                }
                let wi = random_direction(&mut rng);
                let pdf = light.pdf_direct(from, random_direction(&mut rng), wi, 1.0).0;
                assert!(pdf >= 0.0 && pdf.is_finite(), "{name} {from} {pdf}");
                if let Some(e) = light.sample_emission(u, u) {
                    assert!(e.origin.is_finite() && e.direction.is_finite() && e.flux().is_finite(), "{name}");
                }
            }
        }
        if let Light::Triangle(t) = &light {
            let behind = t.corners()[0] - t.ng();
            assert!(light.sample_direct(behind, [0.3, 0.4]).is_none());
        }
    }
    // Wherever a picture is lit there is density, next to black texels and at the poles too.
    let map = EnvMap::new(&test_image(7, 5), 1.0, DMat4::IDENTITY).unwrap();
    let mut rng = rng(71);
    for d in (0..5000).map(|_| random_direction(&mut rng)).chain([Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z]) {
        assert_eq!(map.radiance(d).is_black(), map.pdf(d).0 == 0.0, "{d}");
    }
}

#[test]
fn bad_descriptions_are_refused() {
    let map = |image: &Image, scale, m| EnvMap::new(image, scale, m).is_err();
    assert!(map(&test_image(3, 3), 1.0, DMat4::ZERO) && map(&test_image(3, 3), f32::NAN, DMat4::IDENTITY));
    assert!(map(&test_image(0, 3), 1.0, DMat4::IDENTITY));
    assert!(SpotLight::new(DMat4::IDENTITY, Rgb::WHITE, 0.0, 0.0, DVec3::ZERO).is_err());
    assert!(SpotLight::new(DMat4::ZERO, Rgb::WHITE, 20.0, 10.0, DVec3::ZERO).is_err());
    assert!(DirectionalLight::new(DVec3::ZERO, Rgb::WHITE, 1.0).is_err());
    let flat = triangle([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], Rgb::WHITE);
    assert!(flat.power() == 0.0 && flat.sample_direct(Vec3::Z, [0.5; 2]).is_none());
    assert!(flat.sample_emission([0.5; 2], [0.5; 2]).is_none());
}
