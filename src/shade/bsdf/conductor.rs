//! Metals: Fresnel reflection with a complex index, smooth or by microfacets.

use super::dielectric::mirror;
use super::microfacet::{Microfacets, half_vector};
use super::model::{AtPoint, LobeSample, Model, PointLookup, TextureBinder, Textured};
use crate::math::fresnel::{conductor, reflect, schlick_average};
use crate::math::{Rgb, Vec3};
use crate::scene::{ComplexIor, ConductorParams, RoughConductorParams};
use crate::shade::SurfacePoint;

impl ComplexIor<AtPoint> {
    fn fresnel(&self, cos: f32) -> Rgb {
        conductor(cos, self.eta, self.k)
    }

    /// Cosine-weighted mean over the hemisphere by Schlick's approximation from the reflectance at normal incidence.
    fn albedo(&self) -> Rgb {
        self.fresnel(1.0).map(schlick_average)
    }
}

/// Polished metal.
pub(super) type Conductor = ConductorParams<AtPoint>;

impl Model for Conductor {
    type Params = ConductorParams;
    type Textured = ConductorParams<Textured>;
    const SMOOTH: bool = false;
    const DELTA: bool = true;

    fn bind(params: &ConductorParams, binder: &mut TextureBinder) -> Result<ConductorParams<Textured>, String> {
        Ok(params.convert(binder))
    }

    fn at(textured: &ConductorParams<Textured>, point: &SurfacePoint) -> Conductor {
        textured.convert(&mut PointLookup(point))
    }

    fn eval_pdf(&self, _: Vec3, _: Vec3) -> (Rgb, f32) {
        (Rgb::BLACK, 0.0)
    }

    fn sample(&self, a: Vec3, _: [f32; 3]) -> Option<LobeSample> {
        let reflectance = (a.z > 0.0).then(|| self.ior.fresnel(a.z) * self.specular_reflectance)?;
        Some(LobeSample::Delta(mirror(a, reflectance, 1.0)))
    }

    fn albedo(&self) -> Rgb {
        self.ior.albedo() * self.specular_reflectance
    }
}

/// Rough metal: Walter et al. 2007, eq. 20.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughConductor {
    ior: ComplexIor<AtPoint>,
    tint: Rgb,
    facets: Microfacets,
}

impl Model for RoughConductor {
    type Params = RoughConductorParams;
    type Textured = RoughConductorParams<Textured>;

    fn bind(
        params: &RoughConductorParams,
        binder: &mut TextureBinder,
    ) -> Result<RoughConductorParams<Textured>, String> {
        Ok(params.convert(binder))
    }

    fn at(textured: &RoughConductorParams<Textured>, point: &SurfacePoint) -> RoughConductor {
        let params = textured.convert(&mut PointLookup(point));
        RoughConductor {
            ior: params.ior,
            tint: params.specular_reflectance,
            facets: Microfacets::from_roughness(&params.roughness),
        }
    }

    fn is_oriented(params: &RoughConductorParams) -> bool {
        params.roughness.is_anisotropic()
    }

    fn is_nearly_specular(params: &RoughConductorParams) -> bool {
        params.roughness.is_nearly_specular()
    }

    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        match half_vector(&self.facets, a, b) {
            None => (Rgb::BLACK, 0.0),
            Some(facet) => {
                let fresnel = self.ior.fresnel(a.dot(facet.m)) * self.tint;
                (fresnel * facet.value(&self.facets, a, b), facet.pdf(&self.facets, a))
            }
        }
    }

    fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        half_vector(&self.facets, a, b).map_or(0.0, |facet| facet.pdf(&self.facets, a))
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        if a.z <= 0.0 {
            return None;
        }
        let b = reflect(a, self.facets.sample(a, [u[1], u[2]]));
        (b.z > 0.0).then_some(LobeSample::Smooth(b))
    }

    fn albedo(&self) -> Rgb {
        self.ior.albedo() * self.tint
    }
}
