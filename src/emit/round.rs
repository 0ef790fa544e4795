//! An emitting sphere, disk or cylinder: one light each.
//!
//! A sphere is sampled uniformly in the solid angle of the part that faces the reference point: seen from outside it
//! fills a cone, from inside all directions. Disks and cylinders are sampled uniformly in area.

use super::power::{diffuse_power, mean_radiance};
use super::sample::{DirectSample, EmissionSample, EmitterVertex};
use super::triangle::RadianceTexture;
use crate::math::warp::{cosine_hemisphere_pdf, square_to_cosine_hemisphere};
use crate::math::{AreaPdf, DVec3, Frame, Rgb, SolidAnglePdf, Vec3};
use crate::ray::{RoundPoint, RoundShape};
use crate::scene::RoundKind;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Radiance emitted by the front of a round shape.
#[derive(Clone, Debug)]
pub enum RoundEmission {
    /// Constant radiance.
    Constant(Rgb),
    /// Looked up by the shape's texture coordinates.
    Textured(Arc<dyn RadianceTexture>),
}

/// A round shape in the world (relative to the scene's centre) that emits from its front.
#[derive(Clone, Debug)]
pub struct RoundLight {
    shape: RoundShape,
    inv_area: f32,
    power: f32,
    emission: RoundEmission,
    /// Centre and radius of a sphere.
    ball: Option<Ball>,
}

/// A sphere, in double precision.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: DVec3,
    radius: f64,
    /// It emits to its outside.
    outward: bool,
}

/// How a reference point sees the emitting side of a sphere.
enum View {
    /// From outside: a cone, by 1 − cos of its half angle.
    Cone { axis: DVec3, distance: f64, versine: f64 },
    /// From inside: everywhere. The offset of the point from the centre.
    Inside { offset: DVec3 },
}

/// Points per side of the grid on which a textured shape's mean radiance is taken.
const POWER_GRID: u32 = 32;

/// Smallest 1 − cos of the half angle of a cone that is sampled.
const MIN_VERSINE: f64 = 1e-30;

impl Ball {
    /// `None` if the point sees the dark side only, or a sphere too far away to matter.
    fn view(&self, from: Vec3) -> Option<View> {
        let to_centre = self.centre - from.as_dvec3();
        let distance = to_centre.length();
        if distance > self.radius {
            let sin2 = (self.radius / distance).powi(2);
            let cos = ((distance - self.radius) * (distance + self.radius)).sqrt() / distance;
            let versine = sin2 / (1.0 + cos);
            // From farther away the density leaves single precision, and nothing arrives.
            (versine > MIN_VERSINE).then(|| View::Cone { axis: to_centre / distance, distance, versine })
        } else {
            (!self.outward).then_some(View::Inside { offset: -to_centre })
        }
    }

    /// Unit vector from the centre to the sampled point.
    fn sample(&self, view: &View, u: [f32; 2]) -> DVec3 {
        let [a, b] = u.map(f64::from);
        let (sin_phi, cos_phi) = (TAU * b).sin_cos();
        match *view {
            View::Cone { axis, distance, versine } => {
                let one_minus_cos = a * versine;
                let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
                let cos = 1.0 - one_minus_cos;
                let (s, t) = axis.any_orthonormal_pair();
                let direction = s * (sin * cos_phi) + t * (sin * sin_phi) + axis * cos;
                // The nearer point emits towards the outside, the farther one to the inside and through it.
                let half_chord = (self.radius.powi(2) - (distance * sin).powi(2)).max(0.0).sqrt();
                let along = if self.outward {
                    (distance - self.radius) * (distance + self.radius) / (distance * cos + half_chord)
                } else {
                    distance * cos + half_chord
                };
                (direction * along - axis * distance).normalize_or(-axis)
            }
            View::Inside { offset } => {
                let r = (4.0 * a * (1.0 - a)).max(0.0).sqrt();
                let direction = DVec3::new(r * cos_phi, r * sin_phi, 1.0 - 2.0 * a);
                let b = offset.dot(direction);
                let c = (self.radius - offset.length()) * (self.radius + offset.length());
                (offset + direction * ((b * b + c.max(0.0)).sqrt() - b)).normalize_or(direction)
            }
        }
    }

    fn pdf(view: &View) -> SolidAnglePdf {
        SolidAnglePdf(match view {
            View::Cone { versine, .. } => (1.0 / (TAU * versine)) as f32,
            View::Inside { .. } => (0.5 / TAU) as f32,
        })
    }
}

impl RoundLight {
    /// From a shape that keeps its kind in its place ([`RoundKind::is_kept_by`]).
    pub fn new(shape: RoundShape, emission: RoundEmission) -> RoundLight {
        let area = shape.area();
        let ball = (shape.kind == RoundKind::Sphere).then(|| Ball {
            centre: shape.origin(),
            radius: shape.axes()[0].length(),
            outward: shape.is_outward(),
        });
        let inv_area = if area > 0.0 { (1.0 / area) as f32 } else { 0.0 };
        let mut light = RoundLight { shape, inv_area, power: 0.0, emission, ball };
        light.power = diffuse_power(area as f32, light.mean_radiance());
        light
    }

    fn mean_radiance(&self) -> Rgb {
        match &self.emission {
            RoundEmission::Constant(radiance) => *radiance,
            RoundEmission::Textured(texture) => {
                let code = |u: [f32; 2]| self.shape.encode(self.shape.sample_unit(u));
                mean_radiance(POWER_GRID, &**texture, |u| self.radiance(code(u)))
            }
        }
    }

    /// The shape that emits.
    pub fn shape(&self) -> &RoundShape {
        &self.shape
    }

    /// Luminance of the flux: π · area · mean radiance.
    pub fn power(&self) -> f32 {
        self.power
    }

    /// Radiance at the point with the given code (see [`RoundShape`]).
    fn radiance(&self, code: [f32; 2]) -> Rgb {
        match &self.emission {
            RoundEmission::Constant(radiance) => *radiance,
            RoundEmission::Textured(texture) => texture.at(self.shape.parametrise(code).uv),
        }
    }

    /// Radiance of the point with the given code in the unit direction `wo`; black behind.
    pub fn emitted(&self, code: [f32; 2], wo: Vec3) -> Rgb {
        if self.shape.point(code).ng.dot(wo) > 0.0 { self.radiance(code) } else { Rgb::BLACK }
    }

    /// See [`super::Light::sample_direct`].
    pub fn sample_direct(&self, from: Vec3, u: [f32; 2]) -> Option<DirectSample> {
        let (x, pdf) = match &self.ball {
            Some(ball) => {
                let view = ball.view(from)?;
                (self.on_unit_sphere(ball.sample(&view, u)), Some(Ball::pdf(&view)))
            }
            None => (self.shape.sample_unit(u), None),
        };
        let RoundPoint { p, error, ng } = self.shape.point_of(x);
        let to = p - from;
        let distance = to.length();
        let wi = to / distance;
        let pdf = pdf.unwrap_or_else(|| self.area_pdf(ng, wi, distance));
        let radiance = if self.power > 0.0 { self.radiance(self.shape.encode(x)) } else { Rgb::BLACK };
        // A sphere's point faces the reference point by construction.
        if !(distance > 0.0 && pdf.0 > 0.0 && pdf.0.is_finite()) || radiance.is_black() {
            return None;
        }
        let end = EmitterVertex::Surface { p, error, ng };
        Some(DirectSample { wi, distance, end, radiance, pdf, delta: false })
    }

    /// The point of the unit sphere whose image lies in the unit direction `n` from the centre.
    fn on_unit_sphere(&self, n: DVec3) -> DVec3 {
        let axes = self.shape.axes();
        DVec3::from_array(axes.map(|axis| axis.dot(n))).normalize_or(DVec3::Z)
    }

    /// Density per steradian of a point that is sampled uniformly in area; zero from behind.
    fn area_pdf(&self, ng: Vec3, wi: Vec3, distance: f32) -> SolidAnglePdf {
        let cos = -ng.dot(wi);
        if cos > 0.0 { AreaPdf(self.inv_area).to_solid_angle(cos, distance * distance) } else { SolidAnglePdf(0.0) }
    }

    /// See [`super::Light::pdf_direct`].
    pub fn pdf_direct(&self, from: Vec3, ng: Vec3, wi: Vec3, distance: f32) -> SolidAnglePdf {
        if ng.dot(wi) >= 0.0 {
            return SolidAnglePdf(0.0);
        }
        match &self.ball {
            Some(ball) => ball.view(from).map_or(SolidAnglePdf(0.0), |view| Ball::pdf(&view)),
            None => self.area_pdf(ng, wi, distance),
        }
    }

    /// See [`super::Light::sample_emission`].
    pub fn sample_emission(&self, u_pos: [f32; 2], u_dir: [f32; 2]) -> Option<EmissionSample> {
        let x = self.shape.sample_unit(u_pos);
        let radiance = self.radiance(self.shape.encode(x));
        let local = square_to_cosine_hemisphere(u_dir);
        if radiance.is_black() || local.z <= 0.0 || self.inv_area <= 0.0 {
            return None;
        }
        let RoundPoint { p, error, ng } = self.shape.point_of(x);
        let direction = Frame::from_normal(ng).to_world(local).normalize();
        let (pdf_position, pdf_direction) = self.pdf_emission(ng, direction);
        (pdf_direction.0 > 0.0).then_some(EmissionSample {
            origin: p,
            error,
            ng: Some(ng),
            direction,
            radiance,
            pdf_position,
            pdf_direction,
            delta_position: false,
            delta_direction: false,
            end: EmitterVertex::Surface { p, error, ng },
        })
    }

    /// See [`super::Light::pdf_emission`].
    pub fn pdf_emission(&self, ng: Vec3, wo: Vec3) -> (AreaPdf, SolidAnglePdf) {
        (AreaPdf(self.inv_area), SolidAnglePdf(cosine_hemisphere_pdf(ng.dot(wo))))
    }
}
