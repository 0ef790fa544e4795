//! An emitting triangle.
//!
//! As seen from a reference point it is sampled uniformly in solid angle when it is large (see `SPHERICAL_FROM`), and
//! uniformly in area when it is small and the two hardly differ. Which of them is a function of the point and the
//! triangle alone.

use super::power::{diffuse_power, mean_radiance};
use super::sample::{DirectSample, EmissionSample, EmitterVertex};
use super::spherical_triangle::SphericalTriangle;
use crate::math::warp::{cosine_hemisphere_pdf, square_to_cosine_hemisphere, square_to_triangle};
use crate::math::{AreaPdf, Frame, Rgb, SolidAnglePdf, Vec2, Vec3};
use crate::ray::offset::interpolation_error;
use std::sync::Arc;

/// A picture of radiance over texture space.
pub trait RadianceTexture: std::fmt::Debug + Send + Sync {
    /// Radiance at the texture coordinates `uv`.
    fn at(&self, uv: Vec2) -> Rgb;
    /// Mean over the whole texture. It must not be black unless the texture is black everywhere.
    fn mean(&self) -> Rgb;
}

/// Radiance emitted by the front of a triangle.
#[derive(Clone, Debug)]
pub enum TriangleEmission {
    /// Constant radiance.
    Constant(Rgb),
    /// Looked up.
    Textured(Box<TexturedEmission>),
}

/// Radiance from a texture.
#[derive(Clone, Debug)]
pub struct TexturedEmission {
    /// The texture.
    pub texture: Arc<dyn RadianceTexture>,
    /// Texture coordinates of the corners.
    pub uv: [Vec2; 3],
}

/// A triangle in the world (relative to the scene's centre) that emits on the side of its normal.
#[derive(Clone, Debug)]
pub struct TriangleLight {
    v: [Vec3; 3],
    ng: Vec3,
    area: f32,
    inv_area: f32,
    centre: Vec3,
    /// Squared distance from `centre` up to which the triangle is sampled by solid angle.
    spherical_until2: f32,
    power: f32,
    emission: TriangleEmission,
}

/// Points per edge of the grid on which a textured triangle's mean radiance is taken.
const POWER_GRID: u32 = 8;

/// Area over squared distance to the nearest point (the solid angle of a facing triangle) from which on a triangle is
/// sampled by solid angle. Sampling by area leaves the variation of cos/d² over the triangle in the estimate, which
/// near this size is little beside what the BSDF and visibility leave: in rooms, values of 0.3 and 1 gave the same
/// variance of the picture. A sample by solid angle costs as much as several rays, so only triangles that fill much of
/// the view get one.
const SPHERICAL_FROM: f32 = 1.0;
/// Below this solid angle (seen edge-on) the spherical triangle is too thin to be sampled with precision.
const MIN_SOLID_ANGLE: f64 = 1e-6;

impl TriangleLight {
    /// From corners in counter-clockwise order as seen from the emitting side; `flip` makes the other side emit. A
    /// triangle without area never emits.
    pub fn new(v: [Vec3; 3], flip: bool, emission: TriangleEmission) -> TriangleLight {
        let d = |i: usize| v[i].as_dvec3();
        let cross = (d(1) - d(0)).cross(d(2) - d(0)) * if flip { -1.0 } else { 1.0 };
        let length = cross.length();
        let ok = length.is_finite() && length > 0.0;
        let (ng, area) = if ok { ((cross / length).as_vec3(), (0.5 * length) as f32) } else { (Vec3::Z, 0.0) };
        let centre = (v[0] + v[1] + v[2]) / 3.0;
        let radius = v.iter().map(|p| p.distance(centre)).fold(0.0, f32::max);
        let spherical_until2 = (radius + (area / SPHERICAL_FROM).sqrt()).powi(2);
        let inv_area = if area > 0.0 { 1.0 / area } else { 0.0 };
        let mut light = TriangleLight { v, ng, area, inv_area, centre, spherical_until2, power: 0.0, emission };
        light.power = diffuse_power(area, light.mean_radiance());
        light
    }

    fn mean_radiance(&self) -> Rgb {
        match &self.emission {
            TriangleEmission::Constant(radiance) => *radiance,
            TriangleEmission::Textured(t) => {
                mean_radiance(POWER_GRID, &*t.texture, |u| self.radiance(square_to_triangle(u)))
            }
        }
    }

    /// Corners.
    pub fn corners(&self) -> [Vec3; 3] {
        self.v
    }

    /// Unit normal on the side that emits.
    pub fn ng(&self) -> Vec3 {
        self.ng
    }

    /// Area.
    pub fn area(&self) -> f32 {
        self.area
    }

    /// Luminance of the flux: π · area · mean radiance.
    pub fn power(&self) -> f32 {
        self.power
    }

    /// Radiance at the barycentrics (b1, b2).
    #[inline]
    fn radiance(&self, b: [f32; 2]) -> Rgb {
        match &self.emission {
            TriangleEmission::Constant(radiance) => *radiance,
            TriangleEmission::Textured(t) => {
                let [a, b1, b2] = [1.0 - b[0] - b[1], b[0], b[1]];
                t.texture.at(t.uv[0] * a + t.uv[1] * b1 + t.uv[2] * b2)
            }
        }
    }

    /// Radiance at the barycentrics `b` = (b1, b2) in the unit direction `wo`; black behind.
    #[inline]
    pub fn emitted(&self, b: [f32; 2], wo: Vec3) -> Rgb {
        if self.ng.dot(wo) > 0.0 { self.radiance(b) } else { Rgb::BLACK }
    }

    /// The point at the barycentrics (b1, b2), and the bound on the error of its components (as `ray::offset` has it
    /// for hits).
    #[inline]
    fn point(&self, b: [f32; 2]) -> (Vec3, f32) {
        let terms = [self.v[0] * (1.0 - b[0] - b[1]), self.v[1] * b[0], self.v[2] * b[1]];
        let bound = (terms[0].abs() + terms[1].abs() + terms[2].abs()).max_element();
        (terms[0] + terms[1] + terms[2], interpolation_error(bound))
    }

    /// The spherical triangle if it is to be sampled by solid angle from the point `from`.
    #[inline]
    fn spherical(&self, from: Vec3) -> Option<SphericalTriangle> {
        // Far away, where nearly all reference points are, one comparison decides.
        if from.distance_squared(self.centre) > self.spherical_until2 {
            return None;
        }
        SphericalTriangle::new(&self.v, from).filter(|t| t.solid_angle > MIN_SOLID_ANGLE)
    }

    /// See [`super::Light::sample_direct`].
    #[inline]
    pub fn sample_direct(&self, from: Vec3, u: [f32; 2]) -> Option<DirectSample> {
        if self.area <= 0.0 || self.ng.dot(from - self.v[0]) <= 0.0 {
            return None;
        }
        let spherical = self.spherical(from);
        let b = match &spherical {
            Some(t) => t.barycentrics(t.sample(u.map(f64::from))?),
            None => square_to_triangle(u),
        };
        let (p, error) = self.point(b);
        let to = p - from;
        let distance = to.length();
        let wi = to / distance;
        let pdf = self.pdf(spherical.as_ref(), wi, distance);
        let radiance = self.emitted(b, -wi);
        if !(pdf.0 > 0.0 && pdf.0.is_finite()) || radiance.is_black() {
            return None;
        }
        Some(DirectSample {
            wi,
            distance,
            end: EmitterVertex::Surface { p, error, ng: self.ng },
            radiance,
            pdf,
            delta: false,
        })
    }

    #[inline]
    fn pdf(&self, spherical: Option<&SphericalTriangle>, wi: Vec3, distance: f32) -> SolidAnglePdf {
        let cos = -self.ng.dot(wi);
        match spherical {
            _ if cos <= 0.0 => SolidAnglePdf(0.0),
            Some(t) => SolidAnglePdf((1.0 / t.solid_angle) as f32),
            None => AreaPdf(self.inv_area).to_solid_angle(cos, distance * distance),
        }
    }

    /// See [`super::Light::pdf_direct`].
    pub fn pdf_direct(&self, from: Vec3, wi: Vec3, distance: f32) -> SolidAnglePdf {
        if self.area <= 0.0 || self.ng.dot(from - self.v[0]) <= 0.0 || self.ng.dot(wi) >= 0.0 {
            return SolidAnglePdf(0.0);
        }
        self.pdf(self.spherical(from).as_ref(), wi, distance)
    }

    /// See [`super::Light::sample_emission`].
    pub fn sample_emission(&self, u_pos: [f32; 2], u_dir: [f32; 2]) -> Option<EmissionSample> {
        if self.area <= 0.0 {
            return None;
        }
        let b = square_to_triangle(u_pos);
        let radiance = self.radiance(b);
        let local = square_to_cosine_hemisphere(u_dir);
        if radiance.is_black() || local.z <= 0.0 {
            return None;
        }
        let (origin, error) = self.point(b);
        let direction = Frame::from_normal(self.ng).to_world(local).normalize();
        let (pdf_position, pdf_direction) = self.pdf_emission(direction);
        (pdf_direction.0 > 0.0).then_some(EmissionSample {
            origin,
            error,
            ng: Some(self.ng),
            direction,
            radiance,
            pdf_position,
            pdf_direction,
            delta_position: false,
            delta_direction: false,
            end: EmitterVertex::Surface { p: origin, error, ng: self.ng },
        })
    }

    /// See [`super::Light::pdf_emission`].
    pub fn pdf_emission(&self, wo: Vec3) -> (AreaPdf, SolidAnglePdf) {
        if self.area <= 0.0 {
            return (AreaPdf(0.0), SolidAnglePdf(0.0));
        }
        (AreaPdf(self.inv_area), SolidAnglePdf(cosine_hemisphere_pdf(self.ng.dot(wo))))
    }
}
