//! Cameras, from both ends.

use super::*;
use crate::scene::{FilmDesc, FilterDesc, FovAxis, SensorDesc};

pub(super) fn sensor(aperture_radius: f64) -> SensorDesc {
    SensorDesc {
        to_world: DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)) * tilted(),
        fov: 50.0,
        fov_axis: FovAxis::X,
        principal_point: [0.0; 2],
        near_clip: 0.5,
        far_clip: 100.0,
        aperture_radius,
        focus_distance: 4.0,
        medium: None,
        film: FilmDesc { width: 30, height: 20, crop: None, filter: FilterDesc::Box, span: None },
        sample_count: None,
        span: None,
    }
}

fn cameras() -> Vec<(SensorDesc, Camera)> {
    let mut shifted = sensor(0.0);
    shifted.principal_point = [0.1, -0.2];
    let mut mirrored = sensor(0.2);
    mirrored.to_world *= DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    [sensor(0.0), sensor(0.3), shifted, mirrored]
        .into_iter()
        .map(|s| (s.clone(), Camera::new(&s, DVec3::new(0.5, 1.0, -2.0)).unwrap()))
        .collect()
}

#[test]
fn a_point_on_a_ray_is_seen_where_the_ray_started() {
    let mut rng = rng(110);
    for (desc, camera) in cameras() {
        for _ in 0..500 {
            let raster = [rng.next_f32() * 30.0, rng.next_f32() * 20.0];
            let lens_u = pair(&mut rng);
            let ray = camera.sample_ray(raster, lens_u);
            assert!((ray.direction.length() - 1.0).abs() < 1e-6);
            // Clipping planes are perpendicular to the axis.
            assert!((ray.t_near * ray.direction.dot(camera.axis()) - 0.5).abs() < 1e-5);
            assert!((ray.t_far * ray.direction.dot(camera.axis()) - 100.0).abs() < 1e-3);

            let t = ray.t_near + rng.next_f32() * 20.0;
            let s = camera.sample_lens(ray.origin + ray.direction * t, lens_u).unwrap();
            assert!(
                (s.raster[0] - raster[0]).abs() < 1e-3 && (s.raster[1] - raster[1]).abs() < 1e-3,
                "{raster:?} {:?}",
                s.raster
            );
            assert!(
                (s.p - ray.origin).length() < 1e-5
                    && (s.distance - t).abs() < 1e-4
                    && (s.wi + ray.direction).length() < 1e-4
            );
            assert!((s.p_near - (ray.origin + ray.direction * ray.t_near)).length() < 1e-4);
            // Throughput of a camera ray is one.
            let (lens, direction) = camera.pdf_ray(ray.origin, ray.direction);
            assert!((s.importance * s.cos / (lens.0 * direction.0) - 1.0).abs() < 1e-4);
            assert_eq!(camera.is_pinhole(), desc.aperture_radius == 0.0);
        }
    }
}

/// A wall of unit radiance, seen by connecting its points to the lens: every pixel must get one, and directions must
/// integrate to one per pixel too.
#[test]
fn a_pixel_measures_mean_radiance() {
    for (desc, camera) in cameras() {
        let mut rng = rng(120);
        let depth = desc.focus_distance as f32;
        let n = 600;
        let (mut film, mut pixel) = (0.0, 0.0);
        // A tilted wall around the film's image, in coordinates of the camera.
        let half = 2.6;
        let m = desc.to_world.as_mat4();
        let (right, up, axis) = (m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate());
        let slope = 0.2;
        let normal = (axis - right * slope).normalize();
        let stretch = (1.0f32 + slope * slope).sqrt();
        for i in 0..n * n {
            let x = ((i % n) as f32 + 0.5) / n as f32 * 2.0 * half - half;
            let y = ((i / n) as f32 + 0.5) / n as f32 * 2.0 * half - half;
            let p = camera.position() + right * x + up * y + axis * (depth + slope * x);
            if let Some(s) = camera.sample_lens(p, pair(&mut rng)) {
                let area = f64::from(2.0 * half / n as f32).powi(2) * f64::from(stretch);
                let value = f64::from(s.weight * s.wi.dot(normal).abs()) * area;
                film += value;
                if s.raster[0].floor() == 14.0 && s.raster[1].floor() == 7.0 {
                    pixel += value;
                }
            }
        }
        assert!((film / 600.0 - 1.0).abs() < 1e-2, "{film}");
        assert!((pixel - 1.0).abs() < 0.1, "{pixel}");

        let count = 1200;
        let ray = camera.sample_ray([15.0, 10.0], [0.7, 0.4]);
        let mut directions = 0.0;
        for i in 0..count * count {
            let u = [((i % count) as f32 + 0.5) / count as f32, ((i / count) as f32 + 0.5) / count as f32];
            let wi = crate::math::warp::square_to_sphere(u);
            directions +=
                f64::from(camera.pdf_ray(ray.origin, wi).1.0) * 4.0 * std::f64::consts::PI / f64::from(count * count);
        }
        assert!((directions / 600.0 - 1.0).abs() < 5e-3, "{directions}");
    }
}

#[test]
fn a_lens_focuses_on_its_plane() {
    let camera = Camera::new(&sensor(0.3), DVec3::ZERO).unwrap();
    let mut rng = rng(130);
    let at = |lens_u, depth: f32| {
        let ray = camera.sample_ray([22.0, 5.0], lens_u);
        ray.origin + ray.direction * (depth / ray.direction.dot(camera.axis()))
    };
    let (sharp, blurred) = (at([0.5; 2], 4.0), at([0.5; 2], 8.0));
    let mut spread = 0.0f32;
    for _ in 0..200 {
        let lens_u = pair(&mut rng);
        assert!((at(lens_u, 4.0) - sharp).length() < 1e-5);
        spread = spread.max((at(lens_u, 8.0) - blurred).length());
    }
    // Twice the distance in focus: the lens's image is as large as the lens.
    assert!((spread - 0.3).abs() < 0.02, "{spread}");
}

#[test]
fn only_the_cropped_picture_is_connected() {
    let mut desc = sensor(0.0);
    desc.film.crop = Some([10, 5, 8, 6]);
    desc.film.filter = FilterDesc::Tent { radius: 1.0 };
    let camera = Camera::new(&desc, DVec3::ZERO).unwrap();
    let seen = |raster: [f32; 2], t: f32| {
        let ray = camera.sample_ray(raster, [0.5; 2]);
        camera.sample_lens(ray.origin + ray.direction * t, [0.5; 2]).is_some()
    };
    assert!(seen([11.0, 6.0], 5.0) && seen([9.6, 5.0], 5.0) && seen([18.4, 11.4], 5.0));
    assert!(!seen([9.4, 6.0], 5.0) && !seen([11.0, 11.6], 5.0));
    // Before the near and beyond the far clipping plane, and behind.
    assert!(
        !seen([11.0, 6.0], 0.4) && !seen([11.0, 6.0], 200.0) && !seen([11.0, 6.0], -5.0) && !seen([11.0, 6.0], 0.0)
    );
}

#[test]
fn bad_cameras_are_refused() {
    let changes: [fn(&mut SensorDesc); 8] = [
        |s| s.fov = 180.0,
        |s| s.fov = f64::NAN,
        |s| s.film.width = 0,
        |s| s.far_clip = 0.1,
        |s| s.aperture_radius = -1.0,
        |s| (s.aperture_radius, s.focus_distance) = (1.0, 0.0),
        |s| s.to_world = DMat4::ZERO,
        |s| s.to_world.w_axis.x = f64::INFINITY,
    ];
    for (i, change) in changes.iter().enumerate() {
        let mut desc = sensor(0.0);
        change(&mut desc);
        assert!(Camera::new(&desc, DVec3::ZERO).is_err(), "change {i}");
    }
}

/// The far-away scene: coordinates are relative to its centre, subtracted in double precision.
#[test]
fn cameras_far_from_the_origin_keep_their_precision() {
    let far = DVec3::new(1e7, -3e6, 5e6);
    let mut desc = sensor(0.0);
    let near = Camera::new(&desc, DVec3::ZERO).unwrap();
    desc.to_world = DMat4::from_translation(far) * desc.to_world;
    let moved = Camera::new(&desc, far).unwrap();
    assert!((near.position() - moved.position()).length() < 1e-6);
}
