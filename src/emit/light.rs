//! A light of any kind, seen through one set of functions.

use super::delta::{DirectionalLight, PointLight, SpotLight};
use super::environment::EnvironmentLight;
use super::projector::Projector;
use super::round::RoundLight;
use super::sample::{DirectSample, EmissionSample, EmitterVertex};
use super::triangle::TriangleLight;
use crate::math::{AreaPdf, Rgb, SolidAnglePdf, Vec3};
use crate::scene::RoundKind;
use crate::spatial::light_tree::{Aabb, Cone, LightBounds};
use std::f32::consts::{FRAC_PI_2, PI};

/// A light.
#[derive(Clone, Debug)]
pub enum Light {
    /// An emitting triangle.
    Triangle(TriangleLight),
    /// An emitting sphere, disk or cylinder.
    Round(Box<RoundLight>),
    /// A point that shines in all directions.
    Point(PointLight),
    /// A point that shines into a cone.
    Spot(Box<SpotLight>),
    /// A point that projects a picture.
    Projector(Box<Projector>),
    /// Parallel light.
    Directional(DirectionalLight),
    /// Radiance from all directions.
    Environment(Box<EnvironmentLight>),
}

impl Light {
    /// Samples the light as seen from `from`; `None` if no light can arrive from the sample. The density is for the
    /// light alone: multiply by the probability of having chosen it.
    #[inline]
    pub fn sample_direct(&self, from: Vec3, u: [f32; 2]) -> Option<DirectSample> {
        match self {
            Light::Triangle(l) => l.sample_direct(from, u),
            Light::Round(l) => l.sample_direct(from, u),
            Light::Point(l) => l.sample_direct(from),
            Light::Spot(l) => l.sample_direct(from),
            Light::Projector(l) => l.sample_direct(from),
            Light::Directional(l) => l.sample_direct(),
            Light::Environment(l) => l.sample_direct(u),
        }
    }

    /// Density per steradian with which [`Light::sample_direct`] draws the unit direction `wi`, along which a ray from
    /// `from` meets the light after `distance` (infinite for lights at infinity), where its unit normal is `ng` (any
    /// value for lights that are no surfaces). Zero for delta lights.
    #[inline]
    pub fn pdf_direct(&self, from: Vec3, ng: Vec3, wi: Vec3, distance: f32) -> SolidAnglePdf {
        match self {
            Light::Triangle(l) => l.pdf_direct(from, wi, distance),
            Light::Round(l) => l.pdf_direct(from, ng, wi, distance),
            Light::Environment(l) => l.pdf_direct(wi),
            _ => SolidAnglePdf(0.0),
        }
    }

    /// Radiance that leaves the light in the unit direction `wo`; `b` = barycentrics (b1, b2) of the point on a
    /// triangle, code of the point on a round shape, unused by other kinds. Black for delta lights: no ray meets them.
    #[inline]
    pub fn emitted(&self, b: [f32; 2], wo: Vec3) -> Rgb {
        match self {
            Light::Triangle(l) => l.emitted(b, wo),
            Light::Round(l) => l.emitted(b, wo),
            Light::Environment(l) => l.radiance(-wo),
            _ => Rgb::BLACK,
        }
    }

    /// Samples a ray that leaves the light.
    pub fn sample_emission(&self, u_pos: [f32; 2], u_dir: [f32; 2]) -> Option<EmissionSample> {
        match self {
            Light::Triangle(l) => l.sample_emission(u_pos, u_dir),
            Light::Round(l) => l.sample_emission(u_pos, u_dir),
            Light::Point(l) => Some(l.sample_emission(u_dir)),
            Light::Spot(l) => Some(l.sample_emission(u_dir)),
            Light::Projector(l) => Some(l.sample_emission(u_dir)),
            Light::Directional(l) => Some(l.sample_emission(u_pos)),
            Light::Environment(l) => l.sample_emission(u_pos, u_dir),
        }
    }

    /// Densities with which [`Light::sample_emission`] draws a ray in the unit direction `wo`: of its origin (per unit
    /// area, any point of the light or of the disk) and of its direction (per steradian). `ng` is the unit normal at
    /// the origin (any value for lights that are no surfaces). A delta factor is zero: no
    /// ray found in another way has that exact position or direction.
    pub fn pdf_emission(&self, ng: Vec3, wo: Vec3) -> (AreaPdf, SolidAnglePdf) {
        match self {
            Light::Triangle(l) => l.pdf_emission(wo),
            Light::Round(l) => l.pdf_emission(ng, wo),
            Light::Point(l) => (AreaPdf(0.0), l.pdf_direction()),
            Light::Spot(l) => (AreaPdf(0.0), l.pdf_direction(wo)),
            Light::Projector(l) => (AreaPdf(0.0), l.pdf_direction(wo)),
            Light::Directional(l) => (l.pdf_position(), SolidAnglePdf(0.0)),
            Light::Environment(l) => l.pdf_emission(wo),
        }
    }

    /// Densities of the emission ray in the direction `wo` from a vertex that is on the light by construction, as those
    /// of [`Light::sample_direct`] are: [`Light::pdf_emission`] with delta factors counted as 1, as MIS weights need
    /// them.
    pub fn pdf_emission_at_vertex(&self, ng: Vec3, wo: Vec3) -> (AreaPdf, SolidAnglePdf) {
        match self {
            Light::Point(l) => (AreaPdf(1.0), l.pdf_direction()),
            Light::Spot(l) => (AreaPdf(1.0), l.pdf_direction(wo)),
            Light::Projector(l) => (AreaPdf(1.0), l.pdf_direction(wo)),
            Light::Directional(l) => (l.pdf_position(), SolidAnglePdf(1.0)),
            _ => self.pdf_emission(ng, wo),
        }
    }

    /// [`Light::pdf_emission_at_vertex`] of the ray that runs back along `sample`, a result of
    /// [`Light::sample_direct`]. Of an environment the density of the direction is taken from the sample, which saves a
    /// look-up in the environment map.
    #[inline]
    pub fn pdf_emission_at_sample(&self, sample: &DirectSample) -> (AreaPdf, SolidAnglePdf) {
        match self {
            Light::Environment(l) => (l.pdf_position(), sample.pdf),
            _ => self.pdf_emission_at_vertex(sample.end.normal(), -sample.wi),
        }
    }

    /// Luminance of the emitted flux: the weight of the light when one is sampled by power. Positive wherever light is
    /// emitted.
    pub fn power(&self) -> f32 {
        match self {
            Light::Triangle(l) => l.power(),
            Light::Round(l) => l.power(),
            Light::Point(l) => l.power(),
            Light::Spot(l) => l.power(),
            Light::Projector(l) => l.power(),
            Light::Directional(l) => l.power(),
            Light::Environment(l) => l.power(),
        }
    }

    /// Bounds of the light's extent and emission; `None` if it is at infinity or has no power.
    pub fn bounds(&self) -> Option<LightBounds> {
        let power = self.power();
        if !(power > 0.0 && power.is_finite()) {
            return None;
        }
        let (aabb, cone) = match self {
            Light::Triangle(l) => (Aabb::of(l.corners()), Cone { axis: l.ng(), half_angle: 0.0, emission: FRAC_PI_2 }),
            Light::Round(l) => {
                let (lo, hi) = l.shape().bounds();
                // A disk has one normal; those of the others point all around.
                let (axis, half_angle) = match l.shape().kind {
                    RoundKind::Disk => (l.shape().point([0.0; 2]).ng, 0.0),
                    RoundKind::Sphere | RoundKind::Cylinder => (Vec3::Z, PI),
                };
                (Aabb::of([lo, hi]), Cone { axis, half_angle, emission: FRAC_PI_2 })
            }
            Light::Point(l) => (Aabb::of([l.position()]), Cone { axis: Vec3::Z, half_angle: PI, emission: FRAC_PI_2 }),
            // Nearly uniform inside: the whole cone counts as normals, and nothing lies beyond.
            Light::Spot(l) => {
                (Aabb::of([l.position()]), Cone { axis: l.axis(), half_angle: l.cutoff(), emission: 1e-3 })
            }
            Light::Projector(l) => {
                (Aabb::of([l.position()]), Cone { axis: l.axis(), half_angle: l.half_angle(), emission: 1e-3 })
            }
            Light::Directional(_) | Light::Environment(_) => return None,
        };
        Some(LightBounds { aabb, cone, power })
    }

    /// True if the light is at infinity: rays that escape from the scene may see it.
    pub fn is_infinite(&self) -> bool {
        matches!(self, Light::Directional(_) | Light::Environment(_))
    }

    /// True if no ray meets the light by chance.
    pub fn is_delta(&self) -> bool {
        self.delta_position() || self.delta_direction()
    }

    /// True if the light is a point in space.
    pub fn delta_position(&self) -> bool {
        matches!(self, Light::Point(_) | Light::Spot(_) | Light::Projector(_))
    }

    /// True if the light emits in one direction only.
    pub fn delta_direction(&self) -> bool {
        matches!(self, Light::Directional(_))
    }

    /// The light vertex of a ray that met the light at `p` with the unit normal `ng` (any value for lights at
    /// infinity); `error` bounds the rounding error of any component of `p`.
    pub fn end_at(&self, p: Vec3, error: f32, ng: Vec3) -> EmitterVertex {
        match self {
            Light::Triangle(l) => EmitterVertex::Surface { p, error, ng: l.ng() },
            Light::Round(_) => EmitterVertex::Surface { p, error, ng },
            Light::Point(l) => EmitterVertex::Point { p: l.position() },
            Light::Spot(l) => EmitterVertex::Point { p: l.position() },
            Light::Projector(l) => EmitterVertex::Point { p: l.position() },
            Light::Directional(_) | Light::Environment(_) => EmitterVertex::Infinite,
        }
    }
}
