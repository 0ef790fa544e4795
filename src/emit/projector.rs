//! Projectors: a picture thrown from a point through a rectangle (Mitsuba's `projector`), the counterpart of a pinhole
//! camera with the same mapping of pixels to directions.
//!
//! The picture stands for the irradiance E on the plane at distance one, up to a factor of π. A point there in the
//! direction of the cosine cos θ to the axis is 1 / cos θ away, hence the radiant intensity I = π E / cos³θ. Emission
//! rays are drawn uniformly on the rectangle of the area A: with the density 1 / (A cos³θ) per steradian.

use super::camera::half_extents;
use super::delta::{direct_from_point, emission_from_point};
use super::orientation::Orientation;
use super::sample::{DirectSample, EmissionSample};
use super::{EmitError, RadianceTexture, in_range};
use crate::math::{DVec3, Rgb, SolidAnglePdf, Vec2, Vec3};
use crate::scene::ProjectorDesc;
use std::f32::consts::PI;
use std::sync::Arc;

/// A point that projects a picture.
#[derive(Clone, Debug)]
pub struct Projector {
    position: Vec3,
    /// +x is to the left of the picture, +y up, +z into the scene.
    orientation: Orientation,
    /// Half extents of the picture at distance one.
    half: Vec2,
    picture: Arc<dyn RadianceTexture>,
    scale: f32,
}

impl Projector {
    /// From its description, with its picture, whose width over its height is `aspect`, in a scene whose centre is
    /// `centre`.
    ///
    /// # Errors
    /// An angle outside of its range, or a transform without axes.
    pub fn new(
        desc: &ProjectorDesc,
        picture: Arc<dyn RadianceTexture>,
        aspect: f64,
        centre: DVec3,
    ) -> Result<Projector, EmitError> {
        in_range("fov", desc.fov, desc.fov > 0.0 && desc.fov < 180.0, "between 0 and 180 degrees")?;
        let orientation = Orientation::new(desc.to_world).ok_or(EmitError::Transform("projector"))?;
        let position = (desc.to_world.w_axis.truncate() - centre).as_vec3();
        if !position.is_finite() {
            return Err(EmitError::Transform("projector"));
        }
        let half = half_extents(desc.fov, desc.fov_axis, aspect);
        Ok(Projector { position, orientation, half, picture, scale: desc.scale })
    }

    /// Position, relative to the scene's centre.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Unit direction of its axis.
    pub fn axis(&self) -> Vec3 {
        self.orientation.z()
    }

    /// Angle in radians between the axis and the corners of the picture.
    pub fn half_angle(&self) -> f32 {
        self.half.length().atan()
    }

    /// Area of the picture at distance one.
    fn area(&self) -> f32 {
        4.0 * self.half.x * self.half.y
    }

    /// Where the unit direction `wo` passes the picture, from the top left, and the cosine to the axis; `None` if it
    /// does not.
    fn texel(&self, wo: Vec3) -> Option<(Vec2, f32)> {
        let d = self.orientation.to_local(wo);
        if d.z <= 0.0 {
            return None;
        }
        let uv = (Vec2::ONE - d.truncate() / (self.half * d.z)) * 0.5;
        let inside = uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all();
        inside.then_some((uv, d.z))
    }

    /// Radiant intensity in the unit direction `wo`.
    pub fn intensity(&self, wo: Vec3) -> Rgb {
        match self.texel(wo) {
            Some((uv, cos)) => self.picture.at(uv) * (PI * self.scale / (cos * cos * cos)),
            None => Rgb::BLACK,
        }
    }

    /// See [`super::Light::power`].
    pub fn power(&self) -> f32 {
        PI * self.scale * self.area() * self.picture.mean().luminance()
    }

    /// See [`super::Light::sample_direct`].
    pub fn sample_direct(&self, from: Vec3) -> Option<DirectSample> {
        direct_from_point(self.position, from, |wo| self.intensity(wo))
    }

    /// See [`super::Light::sample_emission`].
    pub fn sample_emission(&self, u: [f32; 2]) -> EmissionSample {
        let uv = Vec2::from(u);
        let local = ((Vec2::ONE - uv * 2.0) * self.half).extend(1.0).normalize();
        let direction = self.orientation.to_world(local).normalize();
        let cubed = local.z * local.z * local.z;
        let radiance = self.picture.at(uv) * (PI * self.scale / cubed);
        emission_from_point(self.position, direction, radiance, SolidAnglePdf(1.0 / (self.area() * cubed)))
    }

    /// Density of emission directions per steradian.
    pub fn pdf_direction(&self, wo: Vec3) -> SolidAnglePdf {
        SolidAnglePdf(self.texel(wo).map_or(0.0, |(_, cos)| 1.0 / (self.area() * cos * cos * cos)))
    }
}
