//! Metals: Fresnel reflection with a complex index, smooth or by microfacets.

use super::dielectric::mirror;
use super::lobe::DeltaSample;
use super::microfacet::{Microfacets, half_vector};
use crate::math::fresnel::{conductor, reflect};
use crate::math::{Rgb, Vec3};

/// Optical constants and a tint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Metal {
    pub eta: Rgb,
    pub k: Rgb,
    pub tint: Rgb,
}

impl Metal {
    fn fresnel(&self, cos: f32) -> Rgb {
        conductor(cos, self.eta, self.k) * self.tint
    }

    /// Cosine-weighted mean over the hemisphere by Schlick's approximation from the reflectance at normal incidence.
    fn albedo(&self) -> Rgb {
        conductor(1.0, self.eta, self.k).map(crate::math::fresnel::schlick_average) * self.tint
    }
}

/// Polished metal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conductor {
    pub metal: Metal,
}

impl Conductor {
    pub fn sample(&self, a: Vec3) -> Option<DeltaSample> {
        (a.z > 0.0).then(|| mirror(a, self.metal.fresnel(a.z), 1.0))
    }

    pub fn albedo(&self) -> Rgb {
        self.metal.albedo()
    }
}

/// Rough metal: Walter et al. 2007, eq. 20.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughConductor {
    pub metal: Metal,
    pub facets: Microfacets,
}

impl RoughConductor {
    pub fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        match half_vector(&self.facets, a, b) {
            None => (Rgb::BLACK, 0.0),
            Some(facet) => {
                let value = self.metal.fresnel(a.dot(facet.m)) * facet.value(&self.facets, a, b);
                (value, facet.pdf(&self.facets, a))
            }
        }
    }

    pub fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        half_vector(&self.facets, a, b).map_or(0.0, |facet| facet.pdf(&self.facets, a))
    }

    pub fn sample_direction(&self, a: Vec3, u: [f32; 3]) -> Option<Vec3> {
        if a.z <= 0.0 {
            return None;
        }
        let b = reflect(a, self.facets.sample(a, [u[1], u[2]]));
        (b.z > 0.0).then_some(b)
    }

    pub fn albedo(&self) -> Rgb {
        self.metal.albedo()
    }
}
