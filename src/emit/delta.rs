//! Lights without extent: point, spot, directional.

use super::sample::{DirectSample, EmissionSample, EmitterVertex};
use super::{EmitError, RadianceTexture, in_range};
use crate::math::warp::{SPHERE_PDF, cone_pdf, square_to_cone, square_to_sphere, versine};
use crate::math::{AreaPdf, DMat4, DVec3, Frame, Rgb, SolidAnglePdf, Vec2, Vec3};
use glam::{DMat3, Mat3};
use std::f32::consts::PI;
use std::sync::Arc;

use super::environment::{disk_before_scene, invert_disk};

/// A point that shines equally in all directions.
#[derive(Clone, Debug)]
pub struct PointLight {
    position: Vec3,
    intensity: Rgb,
}

/// Direct light from a point: inverse square law.
pub(super) fn direct_from_point(position: Vec3, from: Vec3, intensity: impl Fn(Vec3) -> Rgb) -> Option<DirectSample> {
    let to = position - from;
    let distance = to.length();
    if !(distance > 0.0 && distance.is_finite()) {
        return None;
    }
    let wi = to / distance;
    let radiance = intensity(-wi) / (distance * distance);
    if radiance.is_black() || !radiance.is_finite() {
        return None;
    }
    Some(DirectSample {
        wi,
        distance,
        end: EmitterVertex::Point { p: position },
        radiance,
        pdf: SolidAnglePdf(1.0),
        delta: true,
    })
}

/// An emission ray from a point.
pub(super) fn emission_from_point(
    position: Vec3,
    direction: Vec3,
    radiance: Rgb,
    pdf: SolidAnglePdf,
) -> EmissionSample {
    EmissionSample {
        origin: position,
        error: 0.0,
        ng: None,
        direction,
        radiance,
        pdf_position: AreaPdf(1.0),
        pdf_direction: pdf,
        delta_position: true,
        delta_direction: false,
        end: EmitterVertex::Point { p: position },
    }
}

impl PointLight {
    /// At the world position `position`, in a scene whose centre is `centre`; `intensity` in W/sr.
    pub fn new(position: DVec3, intensity: Rgb, centre: DVec3) -> PointLight {
        PointLight { position: (position - centre).as_vec3(), intensity }
    }

    /// Position, relative to the scene's centre.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// See [`super::Light::power`].
    pub fn power(&self) -> f32 {
        4.0 * PI * self.intensity.luminance()
    }

    /// See [`super::Light::sample_direct`].
    pub fn sample_direct(&self, from: Vec3) -> Option<DirectSample> {
        direct_from_point(self.position, from, |_| self.intensity)
    }

    /// See [`super::Light::sample_emission`].
    pub fn sample_emission(&self, u_dir: [f32; 2]) -> EmissionSample {
        emission_from_point(self.position, square_to_sphere(u_dir), self.intensity, self.pdf_direction())
    }

    /// Density of emission directions per steradian.
    pub fn pdf_direction(&self) -> SolidAnglePdf {
        SolidAnglePdf(SPHERE_PDF)
    }
}

/// A texture that a spot light projects.
#[derive(Clone, Debug)]
pub struct Projection {
    texture: Arc<dyn RadianceTexture>,
    /// World directions to the light's space, which has the axis along +z.
    world_to_light: Mat3,
    /// Half the side of the textured square at distance one.
    half_side: f32,
}

impl Projection {
    /// The texture laid over the square that just holds the cone of half angle `cutoff_angle` (degrees, < 90) around +z
    /// of the space of `to_world`; u runs along +x, v along +y.
    ///
    /// # Errors
    /// If the transform cannot be inverted, or the cone is too wide.
    pub fn new(texture: Arc<dyn RadianceTexture>, to_world: DMat4, cutoff_angle: f32) -> Result<Projection, EmitError> {
        let cutoff = f64::from(cutoff_angle);
        in_range("cutoff_angle", cutoff, cutoff > 0.0 && cutoff < 90.0, "between 0 and 90 degrees with a texture")?;
        let world_to_light = DMat3::from_mat4(to_world).inverse();
        if !world_to_light.is_finite() {
            return Err(EmitError::Transform("spot light"));
        }
        Ok(Projection {
            texture,
            world_to_light: world_to_light.as_mat3(),
            half_side: cutoff.to_radians().tan() as f32,
        })
    }

    /// The colour that the world direction `wo` gets.
    fn at(&self, wo: Vec3) -> Rgb {
        let local = self.world_to_light * wo;
        let scale = 0.5 / (local.z * self.half_side);
        self.texture.at(Vec2::new(0.5 + local.x * scale, 0.5 + local.y * scale))
    }
}

/// A point that shines into a cone: full strength up to one angle, then falling linearly in the angle to zero
/// (Mitsuba's `spot`).
#[derive(Clone, Debug)]
pub struct SpotLight {
    position: Vec3,
    frame: Frame,
    intensity: Rgb,
    cutoff: f32,
    beam: f32,
    /// 1 − cos of `cutoff`: of a narrow cone, the cosine itself is 1 in single precision.
    versine_cutoff: f32,
    /// 1 − cos of `beam`.
    versine_beam: f32,
    projection: Option<Projection>,
    /// Luminance of the flux with a projected texture.
    projected_power: f32,
}

/// Smallest half angle of a spot in degrees. The spacing of unit vectors in single precision is a hundredth of it.
const MIN_CUTOFF: f64 = 5e-4;

/// 1 − sin x / x.
fn one_minus_sinc(x: f64) -> f64 {
    let x2 = x * x;
    if x2 < 1e-2 { x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0))) } else { 1.0 - x.sin() / x }
}

/// Steps in either direction of the grid over the cone on which the power of a projected texture is summed.
const POWER_GRID: usize = 128;

impl SpotLight {
    /// Along +z of the space of `to_world`; half angles in degrees, 0.0005 ≤ `cutoff_angle` < 180. A beam wider than the
    /// cutoff is as wide as the cutoff.
    ///
    /// # Errors
    /// An angle outside of its range, or a transform without an axis.
    pub fn new(
        to_world: DMat4,
        intensity: Rgb,
        cutoff_angle: f32,
        beam_width: f32,
        centre: DVec3,
    ) -> Result<SpotLight, EmitError> {
        let cutoff = f64::from(cutoff_angle);
        in_range(
            "cutoff_angle",
            cutoff,
            (MIN_CUTOFF..180.0).contains(&cutoff),
            "at least 0.0005 and less than 180 degrees",
        )?;
        in_range("beam_width", f64::from(beam_width), beam_width >= 0.0, "at least 0 degrees")?;
        let position = (to_world.w_axis.truncate() - centre).as_vec3();
        let axis = to_world.z_axis.truncate().try_normalize().ok_or(EmitError::Transform("spot light"))?.as_vec3();
        if !position.is_finite() {
            return Err(EmitError::Transform("spot light"));
        }
        let (cutoff, beam) = (cutoff_angle.to_radians(), beam_width.min(cutoff_angle).to_radians());
        let frame = Frame::from_normal(axis.normalize());
        let [versine_cutoff, versine_beam] = [cutoff, beam].map(|angle| versine(f64::from(angle)) as f32);
        Ok(SpotLight {
            position,
            frame,
            intensity,
            cutoff,
            beam,
            versine_cutoff,
            versine_beam,
            projection: None,
            projected_power: 0.0,
        })
    }

    /// This light with a projected texture, which multiplies the intensity.
    pub fn with_projection(self, projection: Projection) -> SpotLight {
        let mut light = SpotLight { projection: Some(projection), ..self.clone() };
        let directions = (0..POWER_GRID * POWER_GRID).map(|i| {
            let u = [i % POWER_GRID, i / POWER_GRID].map(|i| (i as f32 + 0.5) / POWER_GRID as f32);
            light.frame.to_world(square_to_cone(u, light.versine_cutoff)).normalize()
        });
        let sum: f64 = directions.map(|wo| f64::from(light.intensity(wo).luminance())).sum();
        let solid_angle = 2.0 * std::f64::consts::PI * f64::from(light.versine_cutoff);
        // Never zero because a bright spot of the texture lies between the points of the grid.
        let least = light.projection.as_ref().map_or(0.0, |p| 1e-3 * self.power() * p.texture.mean().luminance());
        light.projected_power = ((sum / (POWER_GRID * POWER_GRID) as f64 * solid_angle) as f32).max(least);
        light
    }

    /// Position, relative to the scene's centre.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Unit direction of its axis.
    pub fn axis(&self) -> Vec3 {
        self.frame.n
    }

    /// Half angle in radians beyond which it is dark.
    pub fn cutoff(&self) -> f32 {
        self.cutoff
    }

    /// 1 − cos of the angle between the axis and the unit direction `wo`: half of the squared chord.
    fn versine_of(&self, wo: Vec3) -> f32 {
        0.5 * (wo - self.frame.n).length_squared()
    }

    /// Radiant intensity in the unit direction `wo`.
    pub fn intensity(&self, wo: Vec3) -> Rgb {
        let versine = self.versine_of(wo);
        if versine >= self.versine_cutoff {
            return Rgb::BLACK;
        }
        let intensity = match &self.projection {
            None => self.intensity,
            Some(projection) => self.intensity * projection.at(wo),
        };
        if versine <= self.versine_beam {
            intensity
        } else {
            let angle = 2.0 * (0.5 * versine).sqrt().min(1.0).asin();
            intensity * ((self.cutoff - angle) / (self.cutoff - self.beam)).clamp(0.0, 1.0)
        }
    }

    /// See [`super::Light::power`].
    pub fn power(&self) -> f32 {
        if self.projection.is_some() {
            return self.projected_power;
        }
        // ∫ I dω in closed form: the full cone, and by parts the ramp ∫ (c − θ) / (c − b) sin θ dθ. Together that is
        // 2π (1 − (sin c − sin b) / (c − b)), written with the middle of both angles and half of their difference so
        // that nothing cancels.
        let (b, c) = (f64::from(self.beam), f64::from(self.cutoff));
        let (middle, half) = (0.5 * (b + c), 0.5 * (c - b));
        let share = versine(middle) + middle.cos() * one_minus_sinc(half);
        (2.0 * std::f64::consts::PI * share) as f32 * self.intensity.luminance()
    }

    /// See [`super::Light::sample_direct`].
    pub fn sample_direct(&self, from: Vec3) -> Option<DirectSample> {
        direct_from_point(self.position, from, |wo| self.intensity(wo))
    }

    /// See [`super::Light::sample_emission`].
    pub fn sample_emission(&self, u_dir: [f32; 2]) -> EmissionSample {
        let direction = self.frame.to_world(square_to_cone(u_dir, self.versine_cutoff)).normalize();
        let pdf = SolidAnglePdf(cone_pdf(self.versine_cutoff));
        emission_from_point(self.position, direction, self.intensity(direction), pdf)
    }

    /// Density of emission directions per steradian.
    pub fn pdf_direction(&self, wo: Vec3) -> SolidAnglePdf {
        let inside = self.versine_of(wo) < self.versine_cutoff;
        SolidAnglePdf(if inside { cone_pdf(self.versine_cutoff) } else { 0.0 })
    }
}

/// Parallel light from beyond the scene.
#[derive(Clone, Debug)]
pub struct DirectionalLight {
    /// Direction of travel.
    direction: Vec3,
    irradiance: Rgb,
    radius: f32,
}

impl DirectionalLight {
    /// Travelling in the world direction `direction` through a scene whose bounding sphere around its centre has the
    /// radius `scene_radius`; `irradiance` in W/m² on a surface that faces it.
    pub fn new(direction: DVec3, irradiance: Rgb, scene_radius: f32) -> Result<DirectionalLight, EmitError> {
        let direction = direction.try_normalize().ok_or(EmitError::Transform("directional light"))?;
        let radius = super::environment::disk_radius(scene_radius);
        Ok(DirectionalLight { direction: direction.as_vec3().normalize(), irradiance, radius })
    }

    /// See [`super::Light::power`].
    pub fn power(&self) -> f32 {
        PI * self.radius * self.radius * self.irradiance.luminance()
    }

    /// See [`super::Light::sample_direct`].
    pub fn sample_direct(&self) -> Option<DirectSample> {
        (!self.irradiance.is_black()).then_some(DirectSample {
            wi: -self.direction,
            distance: f32::INFINITY,
            end: EmitterVertex::Infinite,
            radiance: self.irradiance,
            pdf: SolidAnglePdf(1.0),
            delta: true,
        })
    }

    /// See [`super::Light::sample_emission`].
    pub fn sample_emission(&self, u_pos: [f32; 2]) -> EmissionSample {
        EmissionSample {
            origin: disk_before_scene(u_pos, self.direction, self.radius),
            error: 0.0,
            ng: None,
            direction: self.direction,
            radiance: self.irradiance,
            pdf_position: self.pdf_position(),
            pdf_direction: SolidAnglePdf(1.0),
            delta_position: false,
            delta_direction: true,
            end: EmitterVertex::Infinite,
        }
    }

    /// Density of emission rays per unit area of the disk.
    pub fn pdf_position(&self) -> AreaPdf {
        AreaPdf(1.0 / (PI * self.radius * self.radius))
    }

    /// The numbers that [`DirectionalLight::sample_emission`] maps to the ray through `p`.
    pub(super) fn invert_emission(&self, p: Vec3) -> [f32; 2] {
        invert_disk(p, self.direction, self.radius)
    }
}
