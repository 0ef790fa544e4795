//! Frosted glass: reflection and refraction by microfacets (Walter et al. 2007, eqs. 20 and 21).

use super::microfacet::Microfacets;
use super::model::{LobeSample, Model, PointLookup, TextureBinder, Textured, away_from_one, checked_ior, choose};
use crate::math::fresnel::{dielectric, normal_incidence, reflect, refract, schlick_average};
use crate::math::{Rgb, Vec3};
use crate::scene::RoughDielectricParams;
use crate::shade::SurfacePoint;

/// Rough glass.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughDielectric {
    facets: Microfacets,
    eta: f32,
    reflectance: Rgb,
    transmittance: Rgb,
}

/// A facet that sends light between two directions, by reflection or refraction.
pub(super) struct Interaction {
    /// Its normal, on the front.
    pub m: Vec3,
    /// a · m and b · m.
    pub a_m: f32,
    pub b_m: f32,
    /// Index of the side of `b` / index of the side of `a` if the light is refracted; 1 otherwise.
    pub eta: f32,
    /// Both directions are on the same side.
    pub reflects: bool,
}

impl Interaction {
    /// The facet between `a` and `b` at an interface of index `eta`; `None` where surface and facet disagree about the
    /// sides.
    pub fn new(a: Vec3, b: Vec3, eta: f32) -> Option<Interaction> {
        let reflects = a.z * b.z > 0.0;
        if !reflects && a.z * b.z >= 0.0 {
            return None;
        }
        let eta = if reflects {
            1.0
        } else if a.z > 0.0 {
            eta
        } else {
            1.0 / eta
        };
        let m = (a + b * eta).try_normalize()?;
        let m = if m.z < 0.0 { -m } else { m };
        let (a_m, b_m) = (a.dot(m), b.dot(m));
        (a_m * a.z > 0.0 && b_m * b.z > 0.0).then_some(Interaction { m, a_m, b_m, eta, reflects })
    }

    /// |∂ω_m / ∂ω_b| / |a · m|: times [`Microfacets::pdf_over_dot`] it is the density of `b`.
    pub fn jacobian_times_dot(&self) -> f32 {
        if self.reflects {
            // 1 / (4 |b · m|) with a · m = b · m.
            0.25
        } else {
            let s = self.a_m + self.eta * self.b_m;
            (self.eta * self.eta * self.a_m * self.b_m).abs() / (s * s)
        }
    }

    /// D G |…| of reflection or refraction, cosine weighted, without the Fresnel factor and without (1/η)².
    pub fn value(&self, facets: &Microfacets, d: f32, a: Vec3, b: Vec3) -> f32 {
        d * facets.g1(a, self.m) * facets.g1(b, self.m) * self.jacobian_times_dot() / a.z.abs()
    }
}

impl RoughDielectric {
    /// Without visible normals, drawing from slightly wider facets bounds the weights (Walter et al. 2007, §5.3).
    fn sampled_facets(&self, a: Vec3) -> Microfacets {
        if self.facets.visible { self.facets } else { self.facets.scaled(1.2 - 0.2 * a.z.abs().sqrt()) }
    }

    fn facet_pdf(&self, a: Vec3, i: &Interaction) -> f32 {
        let facets = self.sampled_facets(a);
        let d = facets.d(i.m);
        if d > 0.0 { facets.pdf_over_dot(a * a.z.signum(), i.m, d) * i.jacobian_times_dot() } else { 0.0 }
    }
}

/// Indices nearer to one than this refract light by less than a narrow lobe is wide, whatever the roughness.
const NEAR_ONE: f32 = 0.01;

impl Model for RoughDielectric {
    type Params = RoughDielectricParams;
    type Textured = RoughDielectricParams<Textured>;

    fn bind(
        params: &RoughDielectricParams,
        binder: &mut TextureBinder,
    ) -> Result<RoughDielectricParams<Textured>, String> {
        let eta = away_from_one(checked_ior(params.eta)?);
        Ok(RoughDielectricParams { eta, ..params.convert(binder) })
    }

    fn at(textured: &RoughDielectricParams<Textured>, point: &SurfacePoint) -> RoughDielectric {
        let params = textured.convert(&mut PointLookup(point));
        RoughDielectric {
            facets: Microfacets::from_roughness(&params.roughness),
            eta: params.eta,
            reflectance: params.specular_reflectance,
            transmittance: params.specular_transmittance,
        }
    }

    fn transmits(_: &RoughDielectricParams) -> bool {
        true
    }

    fn is_oriented(params: &RoughDielectricParams) -> bool {
        params.roughness.is_anisotropic()
    }

    fn is_nearly_specular(params: &RoughDielectricParams) -> bool {
        params.roughness.is_nearly_specular() || (params.eta - 1.0).abs() < NEAR_ONE
    }

    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        let Some(i) = Interaction::new(a, b, self.eta) else {
            return (Rgb::BLACK, 0.0);
        };
        let f = dielectric(i.a_m, self.eta).reflectance;
        let d = self.facets.d(i.m);
        let common = i.value(&self.facets, d, a, b);
        let (value, share) = if i.reflects {
            (self.reflectance * (f * common), f)
        } else {
            (self.transmittance * ((1.0 - f) * common / (i.eta * i.eta)), 1.0 - f)
        };
        (value, share * self.facet_pdf(a, &i))
    }

    fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        let Some(i) = Interaction::new(a, b, self.eta) else {
            return 0.0;
        };
        let f = dielectric(i.a_m, self.eta).reflectance;
        (if i.reflects { f } else { 1.0 - f }) * self.facet_pdf(a, &i)
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        if a.z == 0.0 {
            return None;
        }
        let m = self.sampled_facets(a).sample(a * a.z.signum(), [u[1], u[2]]);
        if a.dot(m) * a.z <= 0.0 {
            // The facet is seen from behind, which happens if all normals are sampled and not only the visible ones.
            return None;
        }
        let interface = dielectric(a.dot(m), self.eta);
        if choose(u[0], interface.reflectance).0 {
            let b = reflect(a, m);
            (b.z * a.z > 0.0).then_some(LobeSample::Smooth(b))
        } else {
            let b = refract(a, m, &interface).try_normalize()?;
            (b.z * a.z < 0.0).then_some(LobeSample::Smooth(b))
        }
    }

    fn albedo(&self) -> Rgb {
        let f = schlick_average(normal_incidence(self.eta));
        self.reflectance * f + self.transmittance * (1.0 - f)
    }

    fn eta(&self) -> f32 {
        self.eta
    }

    fn is_one_sided(&self) -> bool {
        false
    }
}
