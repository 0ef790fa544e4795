//! Clear sky and sun.
//!
//! The sky is Hosek & Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance", eqs. 8 – 9, in its RGB
//! variant, evaluated exactly for every direction of the upper hemisphere; below the horizon it is black, as in Mitsuba
//! 3's `sunsky`. Its directions are drawn from a bilinear density over (azimuth, zenith angle). The sun is a cone of
//! uniform radiance; seen under another angle than the real one it gives the same irradiance.

use super::orientation::Orientation;
use super::sun_table::{FIRST, NODES, RADIANCE, STEP};
use super::{EmitError, in_range};
use crate::math::piecewise::PiecewiseBilinear;
use crate::math::trig::atan2;
use crate::math::{DMat4, DVec3, Frame, Rgb, SolidAnglePdf, Vec3};
use hw_skymodel::rgb::{SkyParams, SkyState};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// The model's values → those of Mitsuba's RGB mode: divided by ∫ ȳ dλ, in nanometres, of the CIE 1931 observer.
const TO_RGB_UNIT: f32 = 1.0 / 106.750_26;
/// Angle under which the sun's radiance is tabulated, degrees.
const REAL_APERTURE: f32 = 0.5358;
/// Grid of the sky's density: azimuth and zenith angle.
const GRID: [usize; 2] = [256, 96];
/// Every sky direction keeps this part of the mean density.
const FLOOR: f32 = 1e-3;
/// The sun's share of samples is its share of the flux, but no more than this: where the sun does not shine only the
/// sky counts.
const MAX_SUN_SHARE: f32 = 0.75;
/// See `envmap`.
const MIN_SIN: f32 = 1e-6;

/// The sun's disk.
#[derive(Clone, Copy, Debug)]
struct Sun {
    /// World direction towards its centre.
    frame: Frame,
    /// 1 − cos of its angular radius.
    one_minus_cos: f32,
    radiance: Rgb,
}

impl Sun {
    fn contains(&self, dir: Vec3) -> bool {
        // |a − b|² = 2 (1 − cos): a dot product of two nearly equal directions would lose half a percent of the disk.
        (dir - self.frame.n).length_squared() <= 2.0 * self.one_minus_cos * (1.0 + 1e-5)
    }

    fn solid_angle(&self) -> f32 {
        TAU * self.one_minus_cos
    }

    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let h = u[0] * self.one_minus_cos;
        let r = (h * (2.0 - h)).sqrt();
        let (sin, cos) = (TAU * u[1]).sin_cos();
        self.frame.to_world(Vec3::new(r * cos, r * sin, 1.0 - h)).normalize()
    }

    /// The numbers that [`Sun::sample`] maps to a direction of the disk.
    fn invert(&self, dir: Vec3) -> [f32; 2] {
        let local = self.frame.to_local(dir);
        let phi = atan2(local.y, local.x) / TAU;
        let h = 0.5 * (dir - self.frame.n).length_squared();
        [(h / self.one_minus_cos).min(1.0), phi - phi.floor()]
    }
}

/// The sky's dome.
#[derive(Clone, Debug)]
struct Sky {
    params: [f32; 27],
    scale: [f32; 3],
    sun_direction: Vec3,
    density: PiecewiseBilinear,
}

impl Sky {
    /// Radiance towards a direction of light space, +z being the zenith.
    fn radiance(&self, d: Vec3) -> Rgb {
        let cos_theta = d.z.max(0.0);
        let cos_gamma = d.dot(self.sun_direction).clamp(-1.0, 1.0);
        let gamma = cos_gamma.acos();
        let channel = |c: usize| {
            let Some(&[a, b, big_c, big_d, e, f, g, h, i]) = self.params[9 * c..].first_chunk::<9>() else {
                return 0.0;
            };
            let q = 1.0 + i * i - 2.0 * i * cos_gamma;
            let chi = (1.0 + cos_gamma * cos_gamma) / (q * q.sqrt());
            let horizon = 1.0 + a * (b / (cos_theta + 0.01)).exp();
            let glow = big_c + big_d * (e * gamma).exp() + f * cos_gamma * cos_gamma + g * chi + h * cos_theta.sqrt();
            (self.scale[c] * horizon * glow).max(0.0)
        };
        if d.z >= 0.0 { Rgb::new(channel(0), channel(1), channel(2)) } else { Rgb::BLACK }
    }
}

/// Sky and sun around the scene.
#[derive(Clone, Debug)]
pub struct SunSky {
    orientation: Orientation,
    sky: Option<Sky>,
    sun: Option<Sun>,
    /// Probability to sample the sun.
    sun_share: f32,
    integral: Rgb,
}

/// Parameters of [`SunSky`], with the units of the scene description.
#[derive(Clone, Copy, Debug)]
pub struct SunSkyParams {
    /// Light → world (its rotation counts); +z of light space is the zenith.
    pub to_world: DMat4,
    /// Towards the sun, in light space.
    pub sun_direction: DVec3,
    /// Haziness, 1 … 10.
    pub turbidity: f32,
    /// Ground albedo in [0, 1].
    pub albedo: Rgb,
    /// Multiplies the sky.
    pub sky_scale: f32,
    /// Multiplies the sun.
    pub sun_scale: f32,
    /// Angle in degrees under which the sun is seen.
    pub sun_aperture: f32,
}

impl SunSky {
    /// From its parameters. The sun's elevation counts as zero when it is below the horizon.
    pub fn new(params: &SunSkyParams) -> Result<SunSky, EmitError> {
        let p = params;
        let orientation = Orientation::new(p.to_world).ok_or(EmitError::Transform("sky"))?;
        let towards = p.sun_direction.try_normalize().ok_or(EmitError::Transform("sun"))?;
        in_range("turbidity", f64::from(p.turbidity), (1.0..=10.0).contains(&p.turbidity), "between 1 and 10")?;
        for channel in p.albedo.to_array() {
            in_range("albedo", f64::from(channel), (0.0..=1.0).contains(&channel), "between 0 and 1")?;
        }
        for (name, scale) in [("sky_scale", p.sky_scale), ("sun_scale", p.sun_scale)] {
            in_range(name, f64::from(scale), scale >= 0.0 && scale.is_finite(), "at least 0")?;
        }
        let aperture = f64::from(p.sun_aperture);
        in_range("sun_aperture", aperture, aperture > 0.0 && aperture < 360.0, "between 0 and 360 degrees")?;

        let elevation = (towards.z.asin().max(0.0) as f32).min(FRAC_PI_2);
        let sun = (p.sun_scale > 0.0).then(|| {
            let one_minus_cos = |degrees: f64| 2.0 * (0.25 * degrees.to_radians()).sin().powi(2);
            let spread = one_minus_cos(f64::from(REAL_APERTURE)) / one_minus_cos(aperture);
            let direction = orientation.to_world(towards.as_vec3()).normalize();
            let radiance = sun_radiance(elevation.to_degrees(), p.turbidity) * (p.sun_scale * spread as f32);
            Sun { frame: Frame::from_normal(direction), one_minus_cos: one_minus_cos(aperture) as f32, radiance }
        });
        let sky = if p.sky_scale > 0.0 {
            let albedo = p.albedo.to_array();
            let state = SkyState::new(&SkyParams { elevation, turbidity: p.turbidity, albedo }).map_err(|_| {
                EmitError::Range { name: "sun elevation", expected: "above the horizon", value: f64::from(elevation) }
            })?;
            let (params, radiances) = state.raw();
            let scale = radiances.map(|r| r * p.sky_scale * TO_RGB_UNIT);
            build_sky(params, scale, towards.as_vec3())
        } else {
            None
        };

        let sky_integral = sky.as_ref().map_or(Rgb::BLACK, |(_, integral)| *integral);
        let sun_integral = sun.as_ref().map_or(Rgb::BLACK, |s| s.radiance * s.solid_angle());
        let (a, b) = (sun_integral.luminance(), sky_integral.luminance());
        let sun_share = if a <= 0.0 {
            0.0
        } else if b <= 0.0 {
            1.0
        } else {
            (a / (a + b)).min(MAX_SUN_SHARE)
        };
        Ok(SunSky { orientation, sky: sky.map(|s| s.0), sun, sun_share, integral: sky_integral + sun_integral })
    }

    /// Radiance in the world direction `dir`.
    pub fn radiance(&self, dir: Vec3) -> Rgb {
        let local = self.orientation.to_local(dir);
        if local.z < 0.0 {
            return Rgb::BLACK;
        }
        let sky = self.sky.as_ref().map_or(Rgb::BLACK, |sky| sky.radiance(local));
        let sun = self.sun.as_ref().filter(|sun| sun.contains(dir)).map_or(Rgb::BLACK, |sun| sun.radiance);
        sky + sun
    }

    /// Draws a world direction; `None` without light or for a part of the sun below the horizon.
    pub fn sample(&self, u: [f32; 2]) -> Option<(Vec3, SolidAnglePdf)> {
        let dir = match (&self.sun, &self.sky) {
            (Some(sun), _) if u[0] < self.sun_share => sun.sample([(u[0] / self.sun_share).min(1.0), u[1]]),
            (_, Some(sky)) => {
                let u0 = (u[0] - self.sun_share) / (1.0 - self.sun_share);
                let ([phi, theta], _) = sky.density.sample([u0, u[1]]);
                let (sin_phi, cos_phi) = (TAU * phi).sin_cos();
                let (sin, cos) = (FRAC_PI_2 * theta).sin_cos();
                self.orientation.to_world(Vec3::new(sin * cos_phi, sin * sin_phi, cos.max(0.0))).normalize()
            }
            _ => return None,
        };
        let pdf = self.pdf(dir);
        (pdf.0 > 0.0 && self.orientation.to_local(dir).z >= 0.0).then_some((dir, pdf))
    }

    /// Density of [`SunSky::sample`] per steradian.
    pub fn pdf(&self, dir: Vec3) -> SolidAnglePdf {
        let [sun, sky] = self.pdfs(dir);
        SolidAnglePdf(sun + sky)
    }

    /// The parts of [`SunSky::pdf`] by which sun and sky are sampled.
    fn pdfs(&self, dir: Vec3) -> [f32; 2] {
        let local = self.orientation.to_local(dir);
        if local.z < 0.0 {
            return [0.0; 2];
        }
        let sun = self.sun.as_ref().filter(|sun| sun.contains(dir)).map_or(0.0, |sun| 1.0 / sun.solid_angle());
        let sky = self.sky.as_ref().map_or(0.0, |sky| {
            let (grid, sin) = sky_grid(local);
            sky.density.pdf(grid) / (PI * PI * sin.max(MIN_SIN))
        });
        [self.sun_share * sun, (1.0 - self.sun_share) * sky]
    }

    /// The numbers that [`SunSky::sample`] maps to `dir`, by way of the sun and by way of the sky, each with its part of
    /// the density.
    pub fn invert(&self, dir: Vec3) -> [(f32, [f32; 2]); 2] {
        let [sun_pdf, sky_pdf] = self.pdfs(dir);
        let by_sun = self.sun.as_ref().map_or([0.0; 2], |sun| {
            let [u, v] = sun.invert(dir);
            [u * self.sun_share, v]
        });
        let by_sky = self.sky.as_ref().map_or([0.0; 2], |sky| {
            let [u, v] = sky.density.invert(sky_grid(self.orientation.to_local(dir)).0);
            [self.sun_share + u * (1.0 - self.sun_share), v]
        });
        [(sun_pdf, by_sun), (sky_pdf, by_sky)]
    }

    /// ∫ radiance over the sphere.
    pub fn integral(&self) -> Rgb {
        self.integral
    }
}

/// Place of a direction of light space on the grid of the sky's density, and the sine of its zenith angle.
fn sky_grid(local: Vec3) -> ([f32; 2], f32) {
    let phi = atan2(local.y, local.x) / TAU;
    let sin = (local.x * local.x + local.y * local.y).sqrt();
    let theta = atan2(sin, local.z) / FRAC_PI_2;
    ([phi - phi.floor(), theta], sin)
}

/// The sky with its sampling density, and its integral over the dome; `None` if it is black.
fn build_sky(params: [f32; 27], scale: [f32; 3], sun_direction: Vec3) -> Option<(Sky, Rgb)> {
    let [nu, nv] = GRID;
    let flat = PiecewiseBilinear::new(&[1.0; 4], 2)?;
    let mut sky = Sky { params, scale, sun_direction, density: flat };
    let at = |sky: &Sky, phi: f32, theta: f32| {
        let ((sin_phi, cos_phi), (sin, cos)) = (phi.sin_cos(), theta.sin_cos());
        (sky.radiance(Vec3::new(sin * cos_phi, sin * sin_phi, cos.max(0.0))), sin)
    };
    let step = [TAU / nu as f32, FRAC_PI_2 / nv as f32];
    // The midpoint rule: the dome is smooth.
    let mut sum = [0.0f64; 3];
    for k in 0..nu * nv {
        let (radiance, sin) = at(&sky, ((k % nu) as f32 + 0.5) * step[0], ((k / nu) as f32 + 0.5) * step[1]);
        (0..3).for_each(|c| sum[c] += f64::from(radiance[c] * sin * step[0] * step[1]));
    }
    let integral = Rgb::from(sum.map(|s| s as f32));
    let floor = FLOOR * integral.luminance() / TAU;
    let mut weights = Vec::with_capacity((nu + 1) * (nv + 1));
    for j in 0..=nv {
        for i in 0..=nu {
            let (radiance, sin) = at(&sky, (i % nu) as f32 * step[0], j as f32 * step[1]);
            // At the zenith the mean of the sine around the node, not its zero.
            weights.push((radiance.luminance() + floor) * sin.max(step[1] / 6.0));
        }
    }
    sky.density = PiecewiseBilinear::new(&weights, nu + 1)?;
    Some((sky, integral))
}

/// Radiance of the sun's disk at an elevation in degrees.
fn sun_radiance(elevation: f32, turbidity: f32) -> Rgb {
    let x = ((elevation - FIRST) / STEP).clamp(0.0, (NODES - 1) as f32);
    let i = (x as usize).min(NODES - 2);
    let y = (turbidity - 1.0).clamp(0.0, 9.0);
    let j = (y as usize).min(8);
    let at = |j: usize| Rgb::from(RADIANCE[j][i]).lerp(Rgb::from(RADIANCE[j][i + 1]), x - i as f32);
    at(j).lerp(at(j + 1), y - j as f32).map(|v| v.max(0.0))
}
