//! A rough reflection added to a diffuse base (Baek et al. 2018, without polarization; the `pplastic` of Mitsuba): the
//! base is lit and seen through a smooth interface, and light that the interface reflects from inside is lost.

use super::diffuse::{cosine_above, cosine_pdf};
use super::microfacet::{Microfacets, half_vector};
use super::model::{LobeSample, Model, PointLookup, TextureBinder, Textured, away_from_one, checked_ior, choose};
use super::plastic::specular_weight;
use crate::math::fresnel::{dielectric, normal_incidence, reflect, schlick_average};
use crate::math::{Rgb, Vec3};
use crate::scene::PolarizedPlasticParams;
use crate::shade::SurfacePoint;

/// A rough reflection added to a diffuse base.
#[derive(Clone, Copy, Debug)]
pub(super) struct PolarizedPlastic {
    facets: Microfacets,
    eta: f32,
    diffuse: Rgb,
    specular: Rgb,
    /// Probability of the specular lobe.
    specular_weight: f32,
}

impl PolarizedPlastic {
    /// Share of light that crosses the smooth interface at the cosine `cos` outside.
    fn transmittance(&self, cos: f32) -> f32 {
        1.0 - dielectric(cos, self.eta).reflectance
    }
}

impl Model for PolarizedPlastic {
    type Params = PolarizedPlasticParams;
    type Textured = PolarizedPlasticParams<Textured>;

    fn bind(
        params: &PolarizedPlasticParams,
        binder: &mut TextureBinder,
    ) -> Result<PolarizedPlasticParams<Textured>, String> {
        Ok(PolarizedPlasticParams { eta: away_from_one(checked_ior(params.eta)?), ..params.convert(binder) })
    }

    fn at(textured: &PolarizedPlasticParams<Textured>, point: &SurfacePoint) -> PolarizedPlastic {
        let params = textured.convert(&mut PointLookup(point));
        let (diffuse, specular) = (params.diffuse_reflectance, params.specular_reflectance);
        PolarizedPlastic {
            facets: Microfacets::from_roughness(&params.roughness),
            eta: params.eta,
            diffuse,
            specular,
            specular_weight: specular_weight(diffuse, specular),
        }
    }

    fn is_oriented(params: &PolarizedPlasticParams) -> bool {
        params.roughness.is_anisotropic()
    }

    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        if a.z <= 0.0 || b.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let cosine = cosine_pdf(b);
        let mut value = self.diffuse * (self.transmittance(a.z) * self.transmittance(b.z) * cosine);
        let mut pdf = (1.0 - self.specular_weight) * cosine;
        if let Some(facet) = half_vector(&self.facets, a, b) {
            let fresnel = dielectric(a.dot(facet.m), self.eta).reflectance;
            value += self.specular * (fresnel * facet.value(&self.facets, a, b));
            pdf += self.specular_weight * facet.pdf(&self.facets, a);
        }
        (value, pdf)
    }

    fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        if a.z <= 0.0 || b.z <= 0.0 {
            return 0.0;
        }
        let facet = half_vector(&self.facets, a, b).map_or(0.0, |facet| facet.pdf(&self.facets, a));
        self.specular_weight * facet + (1.0 - self.specular_weight) * cosine_pdf(b)
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        if a.z <= 0.0 {
            return None;
        }
        if choose(u[0], self.specular_weight).0 {
            let b = reflect(a, self.facets.sample(a, [u[1], u[2]]));
            (b.z > 0.0).then_some(LobeSample::Smooth(b))
        } else {
            cosine_above(a, u).map(LobeSample::Smooth)
        }
    }

    fn albedo(&self) -> Rgb {
        let f = schlick_average(normal_incidence(self.eta));
        self.specular * f + self.diffuse * ((1.0 - f) * (1.0 - f))
    }
}
