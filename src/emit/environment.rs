//! Radiance from beyond the scene, in every direction.

use super::envmap::EnvMap;
use super::sample::{DirectSample, EmissionSample, EmitterVertex};
use super::sunsky::SunSky;
use crate::math::warp::{SPHERE_PDF, disk_to_square, sphere_to_square, square_to_disk, square_to_sphere};
use crate::math::{AreaPdf, Frame, Rgb, SolidAnglePdf, Vec2, Vec3};
use std::f32::consts::PI;

/// Radiance around the scene. Directions are unit vectors in the world, from the scene outwards.
#[derive(Clone, Debug)]
pub enum Environment {
    /// Constant radiance.
    Constant(Rgb),
    /// A picture.
    Map(Box<EnvMap>),
    /// Clear sky and sun.
    SunSky(Box<SunSky>),
}

impl Environment {
    /// Radiance seen in the direction `dir`.
    pub fn radiance(&self, dir: Vec3) -> Rgb {
        match self {
            Environment::Constant(radiance) => *radiance,
            Environment::Map(map) => map.radiance(dir),
            Environment::SunSky(sky) => sky.radiance(dir),
        }
    }

    /// Draws a direction roughly in proportion to radiance, with its density per steradian; `None` if there is no light
    /// there.
    pub fn sample(&self, u: [f32; 2]) -> Option<(Vec3, SolidAnglePdf)> {
        match self {
            Environment::Constant(_) => Some((square_to_sphere(u), SolidAnglePdf(SPHERE_PDF))),
            Environment::Map(map) => map.sample(u),
            Environment::SunSky(sky) => sky.sample(u),
        }
    }

    /// [`Environment::sample`], with the radiance of the direction.
    pub fn sample_radiance(&self, u: [f32; 2]) -> Option<(Vec3, SolidAnglePdf, Rgb)> {
        match self {
            Environment::Map(map) => map.sample_radiance(u),
            _ => self.sample(u).map(|(dir, pdf)| (dir, pdf, self.radiance(dir))),
        }
    }

    /// Density of [`Environment::sample`] per steradian; positive wherever there is light.
    pub fn pdf(&self, dir: Vec3) -> SolidAnglePdf {
        match self {
            Environment::Constant(_) => SolidAnglePdf(SPHERE_PDF),
            Environment::Map(map) => map.pdf(dir),
            Environment::SunSky(sky) => sky.pdf(dir),
        }
    }

    /// The numbers that [`Environment::sample`] maps to `dir`: up to two pairs, each with its part of the density, which
    /// sum to [`Environment::pdf`].
    pub fn invert(&self, dir: Vec3) -> [(f32, [f32; 2]); 2] {
        let nothing = (0.0, [0.0; 2]);
        match self {
            Environment::Constant(_) => [(SPHERE_PDF, sphere_to_square(dir)), nothing],
            Environment::Map(map) => [map.invert(dir).map_or(nothing, |u| (map.pdf(dir).0, u)), nothing],
            Environment::SunSky(sky) => sky.invert(dir),
        }
    }

    /// ∫ radiance over the sphere.
    pub fn integral(&self) -> Rgb {
        match self {
            Environment::Constant(radiance) => *radiance * (4.0 * PI),
            Environment::Map(map) => map.integral(),
            Environment::SunSky(sky) => sky.integral(),
        }
    }
}

/// Radius of the disk that emission rays of lights at infinity start on: that of the scene, and a little more so that
/// rounding leaves no rim unlit; positive even for an empty scene.
pub(super) fn disk_radius(scene_radius: f32) -> f32 {
    if scene_radius.is_finite() && scene_radius > 0.0 { scene_radius * 1.0001 } else { 1.0 }
}

/// A point of the disk before the scene that is perpendicular to the direction of travel, uniform in area.
pub(super) fn disk_before_scene(u: [f32; 2], direction: Vec3, radius: f32) -> Vec3 {
    let d = square_to_disk(u) * radius;
    let frame = Frame::from_normal(direction);
    frame.s * d.x + frame.t * d.y - direction * radius
}

/// The numbers that [`disk_before_scene`] maps to the line through `p` in the unit direction `direction`.
pub(super) fn invert_disk(p: Vec3, direction: Vec3, radius: f32) -> [f32; 2] {
    let frame = Frame::from_normal(direction);
    disk_to_square(Vec2::new(frame.s.dot(p), frame.t.dot(p)) / radius)
}

/// An environment as a light of a scene.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    environment: Environment,
    radius: f32,
    power: f32,
}

impl EnvironmentLight {
    /// Around a scene whose bounding sphere around the origin has the radius `scene_radius`.
    pub fn new(environment: Environment, scene_radius: f32) -> EnvironmentLight {
        let radius = disk_radius(scene_radius);
        let power = PI * radius * radius * environment.integral().luminance();
        EnvironmentLight { environment, radius, power: if power.is_finite() { power.max(0.0) } else { 0.0 } }
    }

    /// Radiance that a ray sees which escapes in the unit direction `dir`.
    pub fn radiance(&self, dir: Vec3) -> Rgb {
        self.environment.radiance(dir)
    }

    /// See [`super::Light::power`].
    pub fn power(&self) -> f32 {
        self.power
    }

    /// See [`super::Light::sample_direct`].
    pub fn sample_direct(&self, u: [f32; 2]) -> Option<DirectSample> {
        let (wi, pdf, radiance) = self.environment.sample_radiance(u)?;
        (!radiance.is_black() && pdf.0 > 0.0 && pdf.0.is_finite()).then_some(DirectSample {
            wi,
            distance: f32::INFINITY,
            end: EmitterVertex::Infinite,
            radiance,
            pdf,
            delta: false,
        })
    }

    /// See [`super::Light::pdf_direct`].
    pub fn pdf_direct(&self, wi: Vec3) -> SolidAnglePdf {
        self.environment.pdf(wi)
    }

    /// See [`super::Light::sample_emission`].
    pub fn sample_emission(&self, u_pos: [f32; 2], u_dir: [f32; 2]) -> Option<EmissionSample> {
        let direct = self.sample_direct(u_dir)?;
        let direction = -direct.wi;
        Some(EmissionSample {
            origin: disk_before_scene(u_pos, direction, self.radius),
            error: 0.0,
            ng: None,
            direction,
            radiance: direct.radiance,
            pdf_position: self.pdf_position(),
            pdf_direction: direct.pdf,
            delta_position: false,
            delta_direction: false,
            end: EmitterVertex::Infinite,
        })
    }

    /// Density per unit area of the place on the disk that an emitted ray starts on.
    pub(super) fn pdf_position(&self) -> AreaPdf {
        AreaPdf(1.0 / (PI * self.radius * self.radius))
    }

    /// See [`super::Light::pdf_emission`].
    pub fn pdf_emission(&self, wo: Vec3) -> (AreaPdf, SolidAnglePdf) {
        (self.pdf_position(), self.environment.pdf(-wo))
    }
    /// The numbers that [`EnvironmentLight::sample_emission`] maps to the ray through `p` in the unit direction `wo`: of
    /// the position, and the pairs of [`Environment::invert`] for the direction.
    pub(super) fn invert_emission(&self, p: Vec3, wo: Vec3) -> ([f32; 2], [(f32, [f32; 2]); 2]) {
        (invert_disk(p, wo, self.radius), self.environment.invert(-wo))
    }
}
