//! Tests of the whole room: against Mitsuba, against quadrature, and of every sample against its density.

mod camera;
mod choice;
mod emission;
mod lights;
mod mitsuba;
mod round;

use super::*;
use crate::image::{Image, Pixels};
use crate::math::hash::HashRng;
use crate::math::{DMat4, DVec3, Rgb, Vec2, Vec3};
use crate::ray::{RoundShape, SurfaceMask};
use crate::scene::{ColorDesc, FovAxis, ProjectorDesc, RoundKind};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::sync::Arc;

/// p-value of observed counts against expected ones; bins with little expectation are pooled.
fn chi2_p_value(observed: &[f64], expected: &[f64]) -> f64 {
    let (mut statistic, mut bins, mut pool) = (0.0, 0, [0.0, 0.0]);
    for (&o, &e) in observed.iter().zip(expected) {
        if e >= 5.0 {
            statistic += (o - e) * (o - e) / e;
            bins += 1;
        } else {
            pool[0] += o;
            pool[1] += e;
        }
    }
    if pool[1] >= 5.0 {
        statistic += (pool[0] - pool[1]) * (pool[0] - pool[1]) / pool[1];
        bins += 1;
    } else {
        // Almost no expectation: nearly nothing may be seen there (Poisson, far beyond five deviations).
        assert!(pool[0] <= pool[1] + 5.0 * pool[1].sqrt() + 5.0, "{} seen where {} expected", pool[0], pool[1]);
    }
    assert!(bins > 1, "nothing to test");
    1.0 - ChiSquared::new(f64::from(bins - 1)).unwrap().cdf(statistic)
}

/// Significance of each of `tests` tests whose joint significance is 1 % (Šidák).
fn significance(tests: u32) -> f64 {
    1.0 - 0.99f64.powf(1.0 / f64::from(tests))
}

/// A picture with unlike texels, some black, one bright.
fn test_image(width: u32, height: u32) -> Image {
    let value = |x: u32, y: u32, c: u32| {
        if (x, y) == (2, 1) {
            60.0
        } else if (x + 2 * y) % 5 == 4 {
            0.0
        } else {
            ((x * 31 + y * 17 + c * 7 + x * y * 5) % 23 + 1) as f32 / 8.0
        }
    };
    let pixels = (0..width * height * 3).map(|i| value(i / 3 % width, i / 3 / width, i % 3)).collect();
    Image { width, height, channels: 3, pixels: Pixels::F32(pixels) }
}

/// A texture that is bright in one corner.
#[derive(Debug)]
struct Ramp;

impl RadianceTexture for Ramp {
    fn at(&self, uv: Vec2) -> Rgb {
        Rgb::new(uv.x, uv.y * uv.y, 0.5)
    }
    fn mean(&self) -> Rgb {
        Rgb::new(0.5, 1.0 / 3.0, 0.5)
    }
}

fn triangle(v: [[f32; 3]; 3], radiance: Rgb) -> TriangleLight {
    TriangleLight::new(v.map(Vec3::from), false, TriangleEmission::Constant(radiance))
}

fn environment(environment: Environment) -> Light {
    Light::Environment(Box::new(EnvironmentLight::new(environment, 2.0)))
}

fn tilted() -> DMat4 {
    DMat4::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7)
}

fn sun_sky(sky_scale: f32, sun_scale: f32) -> Environment {
    let params = SunSkyParams {
        to_world: tilted(),
        sun_direction: DVec3::new(0.5, 0.2, 0.6),
        turbidity: 4.3,
        albedo: Rgb::new(0.1, 0.3, 0.2),
        sky_scale,
        sun_scale,
        sun_aperture: 0.5358,
    };
    Environment::SunSky(Box::new(SunSky::new(&params).unwrap()))
}

/// One light of each kind.
fn all_lights() -> Vec<(&'static str, Light)> {
    let corners = [[0.1, -0.3, 1.0], [0.2, 0.8, 1.5], [1.4, 0.1, 1.2]];
    let textured = TexturedEmission {
        texture: Arc::new(Ramp),
        uv: [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.2), Vec2::new(0.3, 0.9)],
    };
    let emission = TriangleEmission::Textured(Box::new(textured));
    let map = |w, h| Environment::Map(Box::new(EnvMap::new(&test_image(w, h), 1.5, tilted()).unwrap()));
    let spot = SpotLight::new(tilted(), Rgb::new(3.0, 2.0, 1.0), 35.0, 20.0, DVec3::new(0.3, 0.1, 0.0)).unwrap();
    let projection = Projection::new(Arc::new(Ramp), tilted(), 35.0).unwrap();
    let directional = DirectionalLight::new(DVec3::new(1.0, -2.0, -3.0), Rgb::new(1.0, 0.5, 2.0), 2.0).unwrap();
    vec![
        ("triangle", Light::Triangle(triangle(corners, Rgb::new(2.0, 1.0, 0.5)))),
        ("textured", Light::Triangle(TriangleLight::new(corners.map(Vec3::from), true, emission))),
        ("sphere", round(RoundKind::Sphere, false)),
        ("textured sphere", round(RoundKind::Sphere, true)),
        ("disk", round(RoundKind::Disk, true)),
        ("cylinder", round(RoundKind::Cylinder, true)),
        ("point", Light::Point(PointLight::new(DVec3::new(0.3, 0.2, 1.1), Rgb::new(1.0, 2.0, 3.0), DVec3::ZERO))),
        ("spot with a texture", Light::Spot(Box::new(spot.clone().with_projection(projection)))),
        ("spot", Light::Spot(Box::new(spot))),
        ("projector", Light::Projector(Box::new(projector(Arc::new(Ramp), FovAxis::X, 1.5)))),
        ("directional", Light::Directional(directional)),
        ("constant", environment(Environment::Constant(Rgb::new(0.2, 0.4, 0.8)))),
        ("map", environment(map(7, 5))),
        ("large map", environment(map(64, 33))),
        ("single texel", environment(map(1, 1))),
        ("sky", environment(sun_sky(1.0, 0.0))),
        ("sun", environment(sun_sky(0.0, 1.0))),
        ("sun and sky", environment(sun_sky(1.0, 0.001))),
    ]
}

fn projector(picture: Arc<dyn RadianceTexture>, fov_axis: FovAxis, aspect: f64) -> Projector {
    let irradiance = ColorDesc::Constant(Rgb::WHITE);
    let desc = ProjectorDesc { to_world: tilted(), irradiance, scale: 2.0, fov: 50.0, fov_axis };
    Projector::new(&desc, picture, aspect, DVec3::new(0.3, 0.1, 0.0)).unwrap()
}

fn round(kind: RoundKind, textured: bool) -> Light {
    let to_world =
        DMat4::from_translation(DVec3::new(0.2, -0.1, 1.5)) * tilted() * DMat4::from_scale(DVec3::splat(0.4));
    let shape = RoundShape::new(kind, to_world, kind == RoundKind::Disk, SurfaceMask::BLOCKERS);
    let emission = if textured {
        RoundEmission::Textured(Arc::new(Ramp))
    } else {
        RoundEmission::Constant(Rgb::new(2.0, 1.0, 0.5))
    };
    Light::Round(Box::new(RoundLight::new(shape, emission)))
}

/// Numbers of one test.
fn rng(stream: u64) -> HashRng {
    HashRng::new(2024, stream, 0, 0)
}

fn pair(rng: &mut HashRng) -> [f32; 2] {
    [rng.next_f32(), rng.next_f32()]
}

fn random_direction(rng: &mut HashRng) -> Vec3 {
    crate::math::warp::square_to_sphere(pair(rng))
}
