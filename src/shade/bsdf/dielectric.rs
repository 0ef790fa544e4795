//! Smooth glass and thin panes: discrete reflection and transmission by Fresnel's equations.

use super::model::{
    AtPoint, DeltaSample, LobeSample, Model, PointLookup, TextureBinder, Textured, checked_ior, choose,
};
use crate::math::fresnel::{dielectric, normal_incidence, schlick_average};
use crate::math::{Rgb, Vec3};
use crate::scene::{DielectricParams, ThinDielectricParams};
use crate::shade::SurfacePoint;

/// Probability of reflection, if reflection and transmission carry the given fractions of radiance; `None` if neither
/// carries any. By reversibility the reversed events have the same probability.
fn reflection_probability(reflect: Rgb, transmit: Rgb) -> Option<f32> {
    let (r, t) = (reflect.max_component(), transmit.max_component());
    (r + t > 0.0).then(|| r / (r + t))
}

/// Smooth glass.
pub(super) type Dielectric = DielectricParams<AtPoint>;

impl Model for Dielectric {
    type Params = DielectricParams;
    type Textured = DielectricParams<Textured>;
    const SMOOTH: bool = false;
    const DELTA: bool = true;

    fn bind(params: &DielectricParams, binder: &mut TextureBinder) -> Result<DielectricParams<Textured>, String> {
        Ok(DielectricParams { eta: checked_ior(params.eta)?, ..params.convert(binder) })
    }

    fn at(textured: &DielectricParams<Textured>, point: &SurfacePoint) -> Dielectric {
        textured.convert(&mut PointLookup(point))
    }

    fn transmits(_: &DielectricParams) -> bool {
        true
    }

    fn eval_pdf(&self, _: Vec3, _: Vec3) -> (Rgb, f32) {
        (Rgb::BLACK, 0.0)
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        if a.z == 0.0 {
            return None;
        }
        let interface = dielectric(a.z, self.eta);
        let reflect = self.specular_reflectance * interface.reflectance;
        let transmit = self.specular_transmittance * (1.0 - interface.reflectance);
        let p = reflection_probability(reflect, transmit)?;
        if choose(u[0], p).0 {
            Some(LobeSample::Delta(mirror(a, reflect, p)))
        } else {
            let inv = 1.0 / interface.eta;
            let b = Vec3::new(-a.x * inv, -a.y * inv, interface.cos_t).normalize_or(-a);
            let value = transmit * (inv * inv);
            let pdf = 1.0 - p;
            Some(LobeSample::Delta(DeltaSample { b, value, pdf, pdf_reverse: pdf, eta: interface.eta }))
        }
    }

    fn albedo(&self) -> Rgb {
        let f = schlick_average(normal_incidence(self.eta));
        self.specular_reflectance * f + self.specular_transmittance * (1.0 - f)
    }

    fn eta(&self) -> f32 {
        self.eta
    }

    fn is_one_sided(&self) -> bool {
        false
    }
}

/// A pane so thin that light goes straight on, all internal reflections summed: R' = R + T² R / (1 − R²) = 2R / (1 +
/// R).
pub(super) type ThinDielectric = ThinDielectricParams<AtPoint>;

impl ThinDielectric {
    fn total_reflectance(&self, cos: f32) -> f32 {
        let r = dielectric(cos.abs(), self.eta).reflectance;
        2.0 * r / (1.0 + r)
    }
}

impl Model for ThinDielectric {
    type Params = ThinDielectricParams;
    type Textured = ThinDielectricParams<Textured>;
    const SMOOTH: bool = false;
    const DELTA: bool = true;

    fn bind(
        params: &ThinDielectricParams,
        binder: &mut TextureBinder,
    ) -> Result<ThinDielectricParams<Textured>, String> {
        Ok(ThinDielectricParams { eta: checked_ior(params.eta)?, ..params.convert(binder) })
    }

    fn at(textured: &ThinDielectricParams<Textured>, point: &SurfacePoint) -> ThinDielectric {
        textured.convert(&mut PointLookup(point))
    }

    fn transmits(_: &ThinDielectricParams) -> bool {
        true
    }

    fn eval_pdf(&self, _: Vec3, _: Vec3) -> (Rgb, f32) {
        (Rgb::BLACK, 0.0)
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        let r = self.total_reflectance(a.z);
        let (reflect, transmit) = (self.specular_reflectance * r, self.specular_transmittance * (1.0 - r));
        let p = reflection_probability(reflect, transmit)?;
        if choose(u[0], p).0 {
            Some(LobeSample::Delta(mirror(a, reflect, p)))
        } else {
            let pdf = 1.0 - p;
            let event = DeltaSample { b: -a, value: transmit, pdf, pdf_reverse: pdf, eta: 1.0 };
            Some(LobeSample::Delta(event))
        }
    }

    fn albedo(&self) -> Rgb {
        let r = schlick_average(normal_incidence(self.eta));
        let r = 2.0 * r / (1.0 + r);
        self.specular_reflectance * r + self.specular_transmittance * (1.0 - r)
    }

    fn is_one_sided(&self) -> bool {
        false
    }
}

/// Mirror reflection with the same probability in both directions.
pub(super) fn mirror(a: Vec3, value: Rgb, pdf: f32) -> DeltaSample {
    DeltaSample { b: Vec3::new(-a.x, -a.y, a.z), value, pdf, pdf_reverse: pdf, eta: 1.0 }
}
