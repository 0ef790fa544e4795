//! The modified Phong model (Lafortune & Willems 1994): a cosine power around the mirror direction over a diffuse base.

use super::diffuse::{cosine_above, cosine_pdf};
use super::model::{LobeSample, Model, PointLookup, TextureBinder, Textured, choose};
use super::plastic::specular_weight;
use crate::math::{Frame, Rgb, Vec3};
use crate::scene::PhongParams;
use crate::shade::SurfacePoint;
use std::f32::consts::{FRAC_1_PI, PI};

/// Modified Phong.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phong {
    exponent: f32,
    specular: Rgb,
    diffuse: Rgb,
    specular_weight: f32,
}

/// Scales two albedos down together until they sum to at most one in every channel.
pub(super) fn conserve(diffuse: Rgb, specular: Rgb) -> (Rgb, Rgb) {
    let scale = 1.0 / (diffuse + specular).max_component().max(1.0);
    (diffuse * scale, specular * scale)
}

fn mirrored(a: Vec3) -> Vec3 {
    Vec3::new(-a.x, -a.y, a.z)
}

impl Phong {
    /// cos^n of the angle to the mirror direction.
    fn power(&self, a: Vec3, b: Vec3) -> f32 {
        let cos = b.dot(mirrored(a));
        if cos > 0.0 { cos.min(1.0).powf(self.exponent) } else { 0.0 }
    }
}

impl Model for Phong {
    type Params = PhongParams;
    type Textured = PhongParams<Textured>;

    fn bind(params: &PhongParams, binder: &mut TextureBinder) -> Result<PhongParams<Textured>, String> {
        Ok(params.convert(binder))
    }

    fn at(textured: &PhongParams<Textured>, point: &SurfacePoint) -> Phong {
        let params = textured.convert(&mut PointLookup(point));
        let (diffuse, specular) = conserve(params.diffuse_reflectance, params.specular_reflectance);
        let exponent = params.exponent.max(0.0);
        Phong { exponent, specular, diffuse, specular_weight: specular_weight(diffuse, specular) }
    }

    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        if a.z <= 0.0 || b.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let lobe = self.power(a, b) * 0.5 * FRAC_1_PI;
        let cosine = cosine_pdf(b);
        let value = self.diffuse * cosine + self.specular * (lobe * (self.exponent + 2.0) * b.z);
        let w = self.specular_weight;
        (value, w * lobe * (self.exponent + 1.0) + (1.0 - w) * cosine)
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        if a.z <= 0.0 {
            return None;
        }
        if choose(u[0], self.specular_weight).0 {
            let cos = u[1].powf(1.0 / (self.exponent + 1.0));
            let r = (1.0 - cos * cos).max(0.0).sqrt();
            let (s, c) = (2.0 * PI * u[2]).sin_cos();
            let b = Frame::from_normal(mirrored(a)).to_world(Vec3::new(r * c, r * s, cos));
            (b.z > 0.0).then_some(LobeSample::Smooth(b))
        } else {
            cosine_above(a, u).map(LobeSample::Smooth)
        }
    }

    fn albedo(&self) -> Rgb {
        self.diffuse + self.specular
    }
}
