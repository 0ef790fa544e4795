//! The "principled" material: Burley 2012, "Physically Based Shading at Disney", and 2015, "Extending the Disney BRDF
//! to a BSDF", with the parameters and the combination of lobes of Mitsuba 3.
//!
//! Lobes: a diffuse base with retro-reflection, fake subsurface scattering ("flatness") and sheen; a GGX reflection
//! whose Fresnel factor blends dielectric, tinted and metallic; GGX refraction; a GTR1 clear coat. The back is
//! a plain rough dielectric, weighted by the fraction of refraction.

use super::diffuse::{cosine_above, cosine_pdf};
use super::microfacet::Microfacets;
use super::model::{
    AtPoint, LobeSample, Model, PointLookup, TextureBinder, Textured, away_from_one, checked_ior, choose,
};
use super::rough_dielectric::Interaction;
use crate::math::fresnel::{dielectric, normal_incidence, reflect, refract, schlick_average};
use crate::math::{Rgb, Vec3};
use crate::scene::{Distribution, PrincipledParams, ScalarDesc};
use crate::shade::SurfacePoint;
use std::f32::consts::{FRAC_1_PI, PI};

/// The principled material at a point.
pub(super) type Principled = PrincipledParams<AtPoint>;

/// Roughness of the coat's shadowing, fixed by Burley 2012.
const COAT_SHADOWING_ALPHA: f32 = 0.25;
/// Least α of the main lobes.
const MIN_ALPHA: f32 = 1e-3;

/// (1 − cos)⁵.
fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Weight of white in Schlick's approximation; from the denser side the transmitted cosine counts.
fn schlick_mix(cos: f32, eta: f32) -> f32 {
    let eta_it = if cos >= 0.0 { eta } else { 1.0 / eta };
    if eta_it > 1.0 { schlick_weight(cos.abs()) } else { schlick_weight(dielectric(cos, eta).cos_t.abs()) }
}

fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Probabilities of the lobes; refraction and reflection share `specular`.
struct Shares {
    diffuse: f32,
    coat: f32,
    specular: f32,
}

impl Principled {
    /// Some light is refracted.
    fn refracts(&self) -> bool {
        self.refraction() > 0.0
    }

    /// Weight of the refracting dielectric.
    fn refraction(&self) -> f32 {
        (1.0 - self.metallic) * self.spec_trans
    }

    /// Weight of the diffuse base.
    fn diffuse(&self) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.spec_trans)
    }

    fn facets(&self) -> Microfacets {
        let alpha = self.roughness * self.roughness;
        let aspect = (1.0 - 0.9 * self.anisotropic).max(0.0).sqrt();
        let (u, v) = ((alpha / aspect).max(MIN_ALPHA), (alpha * aspect).max(MIN_ALPHA));
        Microfacets::new(Distribution::Ggx, u, v, true)
    }

    fn coat_alpha(&self) -> f32 {
        mix(0.1, 0.001, self.clearcoat_gloss)
    }

    /// The base colour with its luminance divided out.
    fn tint(&self) -> Rgb {
        let luminance = self.base_color.luminance();
        if luminance > 0.0 { self.base_color / luminance } else { Rgb::WHITE }
    }

    fn shares(&self, front: bool) -> Shares {
        if !front {
            return Shares { diffuse: 0.0, coat: 0.0, specular: 1.0 };
        }
        let (diffuse, coat) = (self.diffuse(), 0.25 * self.clearcoat);
        let inv = 1.0 / (1.0 + diffuse + coat);
        Shares { diffuse: diffuse * inv, coat: coat * inv, specular: inv }
    }

    /// Given the main facet, the probability that it reflects.
    fn reflects_share(&self, front: bool, f: f32) -> f32 {
        if front { 1.0 - self.refraction() * (1.0 - f) } else { f }
    }

    /// The Fresnel factor of the main reflection; `cos` is signed, the direction to the facet.
    fn fresnel(&self, f: f32, cos: f32, front: bool) -> Rgb {
        if !front {
            return Rgb::grey(self.refraction() * f);
        }
        let mut total = Rgb::grey((1.0 - self.metallic) * (1.0 - self.spec_tint) * f);
        if self.metallic > 0.0 || self.spec_tint > 0.0 {
            let t = schlick_mix(cos, self.eta);
            total += self.base_color.lerp(Rgb::WHITE, t) * self.metallic;
            let eta_it = if cos >= 0.0 { self.eta } else { 1.0 / self.eta };
            let tinted = self.tint() * normal_incidence(eta_it);
            total += tinted.lerp(Rgb::WHITE, t) * ((1.0 - self.metallic) * self.spec_tint);
        }
        total
    }

    /// GTR1 of Burley 2012, appendix B, eq. 4.
    fn coat_d(&self, cos: f32) -> f32 {
        let a2 = self.coat_alpha() * self.coat_alpha();
        (a2 - 1.0) / (PI * a2.ln() * (1.0 + (a2 - 1.0) * cos * cos))
    }

    /// Value of diffuse base and sheen. `h_b` is the cosine between half vector and `b`.
    fn diffuse_value(&self, a: Vec3, b: Vec3, h_b: f32) -> Rgb {
        let (w_a, w_b) = (schlick_weight(a.z), schlick_weight(b.z));
        let lambert = (1.0 - 0.5 * w_a) * (1.0 - 0.5 * w_b);
        let r = 2.0 * self.roughness * h_b * h_b;
        let retro = r * (w_a + w_b + w_a * w_b * (r - 1.0));
        let f90 = 0.5 * r;
        let subsurface = 1.25 * (mix(1.0, f90, w_b) * mix(1.0, f90, w_a) * (1.0 / (a.z + b.z) - 0.5) + 0.5);
        let base = mix(lambert + retro, subsurface, self.flatness) * self.diffuse() * FRAC_1_PI;
        let sheen =
            if self.diffuse() > 0.0 { self.sheen * (1.0 - self.metallic) * schlick_weight(h_b.abs()) } else { 0.0 };
        (self.base_color * base + Rgb::WHITE.lerp(self.tint(), self.sheen_tint) * sheen) * b.z
    }

    fn coat_eval_pdf(&self, a: Vec3, b: Vec3, i: &Interaction) -> (f32, f32) {
        let d = self.coat_d(i.m.z);
        let f = mix(0.04, 1.0, schlick_mix(i.a_m, self.eta));
        let shadowing = Microfacets::new(Distribution::Ggx, COAT_SHADOWING_ALPHA, COAT_SHADOWING_ALPHA, true);
        let g = shadowing.g1(a, i.m) * shadowing.g1(b, i.m);
        (0.25 * self.clearcoat * f * d * g * b.z, d * i.m.z / (4.0 * i.b_m))
    }

    /// Burley 2012, appendix B, eq. 5.
    fn sample_coat(&self, u: [f32; 2]) -> Vec3 {
        let a2 = self.coat_alpha() * self.coat_alpha();
        let cos2 = ((1.0 - a2.powf(1.0 - u[1])) / (1.0 - a2)).clamp(0.0, 1.0);
        let (sin, cos) = (2.0 * PI * u[0]).sin_cos();
        let r = (1.0 - cos2).sqrt();
        Vec3::new(r * cos, r * sin, cos2.sqrt())
    }
}

impl Model for Principled {
    type Params = PrincipledParams;
    /// Boxed: these are many more parameters than other models have.
    type Textured = Box<PrincipledParams<Textured>>;

    fn bind(params: &PrincipledParams, binder: &mut TextureBinder) -> Result<Self::Textured, String> {
        let eta = checked_ior(params.eta)?;
        let eta = if Principled::transmits(params) { away_from_one(eta) } else { eta };
        Ok(Box::new(PrincipledParams { eta, ..params.convert(binder) }))
    }

    fn at(textured: &Self::Textured, point: &SurfacePoint) -> Principled {
        textured.convert(&mut PointLookup(point))
    }

    fn transmits(params: &PrincipledParams) -> bool {
        params.spec_trans != ScalarDesc::Constant(0.0)
    }

    fn is_oriented(params: &PrincipledParams) -> bool {
        params.anisotropic != ScalarDesc::Constant(0.0)
    }

    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        let front = a.z > 0.0;
        if a.z * b.z == 0.0 || !(front || self.refracts()) {
            return (Rgb::BLACK, 0.0);
        }
        let shares = self.shares(front);
        let (mut value, mut pdf) = (Rgb::BLACK, 0.0);
        let both_in_front = front && b.z > 0.0;
        if both_in_front && let Some(h) = (a + b).try_normalize() {
            value += self.diffuse_value(a, b, h.dot(b));
            pdf += shares.diffuse * cosine_pdf(b);
        }
        if let Some(i) = Interaction::new(a, b, self.eta) {
            let f = dielectric(i.a_m, self.eta).reflectance;
            let facets = self.facets();
            let d = facets.d(i.m);
            let reflects = self.reflects_share(front, f);
            if d > 0.0 {
                let density = facets.pdf_over_dot(a * a.z.signum(), i.m, d) * i.jacobian_times_dot() * shares.specular;
                if i.reflects {
                    // An interface of index 1 reflects nothing, metallic or not (as in Mitsuba).
                    let f_total = if f > 0.0 { self.fresnel(f, i.a_m, front) } else { Rgb::BLACK };
                    value += f_total * i.value(&facets, d, a, b);
                    pdf += reflects * density;
                } else {
                    let scale = self.refraction() * (1.0 - f) / (i.eta * i.eta);
                    value += self.base_color.map(|c| c.max(0.0).sqrt()) * (scale * i.value(&facets, d, a, b));
                    pdf += (1.0 - reflects) * density;
                }
            }
            if both_in_front && self.clearcoat > 0.0 {
                let (coat_value, coat_pdf) = self.coat_eval_pdf(a, b, &i);
                value += Rgb::grey(coat_value);
                pdf += shares.coat * coat_pdf;
            }
        }
        (value, pdf)
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        let front = a.z > 0.0;
        if a.z == 0.0 || !(front || self.refracts()) {
            return None;
        }
        let shares = self.shares(front);
        let (is_diffuse, rest) = choose(u[0], shares.diffuse);
        if is_diffuse {
            return cosine_above(a, u).map(LobeSample::Smooth);
        }
        let (is_coat, rest) = choose(rest, shares.coat / (1.0 - shares.diffuse));
        if is_coat {
            let b = reflect(a, self.sample_coat([u[1], u[2]]));
            return (b.z > 0.0).then_some(LobeSample::Smooth(b));
        }
        let m = self.facets().sample(a * a.z.signum(), [u[1], u[2]]);
        if a.dot(m) * a.z <= 0.0 {
            return None;
        }
        let interface = dielectric(a.dot(m), self.eta);
        if choose(rest, self.reflects_share(front, interface.reflectance)).0 {
            let b = reflect(a, m);
            (b.z * a.z > 0.0).then_some(LobeSample::Smooth(b))
        } else {
            let b = refract(a, m, &interface).try_normalize()?;
            (b.z * a.z < 0.0).then_some(LobeSample::Smooth(b))
        }
    }

    fn albedo(&self) -> Rgb {
        let f0 = normal_incidence(self.eta);
        let specular = (self.tint() * f0).lerp(Rgb::grey(f0), 1.0 - self.spec_tint).map(schlick_average);
        let base = self.base_color * self.diffuse()
            + self.base_color.map(|c| c.max(0.0).sqrt()) * self.refraction()
            + self.base_color * self.metallic;
        base + specular * (1.0 - self.metallic) + Rgb::grey(0.05 * self.sheen * (1.0 - self.metallic))
    }

    fn eta(&self) -> f32 {
        self.eta
    }

    fn is_one_sided(&self) -> bool {
        !self.refracts()
    }
}
