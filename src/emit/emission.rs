//! The distribution of the rays that light sub-paths begin with.
//!
//! Unguided, a light is drawn by its power and a ray by [`Light::sample_emission`]. Most rays of a sun or a sky miss
//! the windows of a room then: what they carry is found by few sub-paths, and its noise is shared by all pixels. A
//! guided distribution has learnt from rays that brought light to the picture ([`EmissionRecord`]):
//!
//! * lights are drawn by a mixture of their shares in that light and in the power;
//! * the numbers u in [0, 1]⁴ from which [`Light::sample_emission`] of a light at infinity makes a ray (position on the
//!   disk, direction) are drawn from a density g ([`BoxTree`]). If the rays' own density is p, that of guided ones is
//!   p(ray) g(u); if more than one u make a ray, which happens where the sun stands before the sky, it is
//!   Σ_i p_i(ray) g(u_i), where p_i is the part of p that comes from u_i.
//!
//! The factor Σ p_i g(u_i) / p belongs to the density of the position. It depends on the direction, too, so that the
//! density of the position is one *given* the direction; weights use the product of the two alone, or quotients of
//! equal ones.
//!
//! Guiding by what eye sub-paths found is the idea of Jensen (1995), "Importance driven path tracing using the photon
//! map", and of Vorba et al. (2014), "On-line learning of parametric mixture models for light transport simulation",
//! for emission.

use super::light::Light;
use super::lights::{LightId, LightSet};
use super::sample::{DirectSample, EmissionSample};
use crate::math::box_tree::{BoxTree, BoxTreeFit, WeightedPoint};
use crate::math::discrete::AliasTable;
use crate::math::{AreaPdf, Pmf, SolidAnglePdf, Vec3};
use std::sync::Arc;

/// A ray of a light that brought light to the picture.
#[derive(Clone, Copy, Debug)]
pub struct EmissionRecord {
    /// The light.
    pub light: LightId,
    /// The first point of the scene that the ray meets.
    pub p: Vec3,
    /// Unit direction of travel.
    pub direction: Vec3,
    /// How much light it brought; positive.
    pub weight: f64,
}

/// Share of the probability of a light that is by power, and that every light at infinity and all others together get
/// in equal parts: what the records missed is still sampled.
const POWER_SHARE: f64 = 0.2;
const EQUAL_SHARE: f64 = 0.05;
/// Part of the rays of a light at infinity that is not guided.
const UNGUIDED_SHARE: f64 = 0.2;
/// A density with fewer points in a box is too noisy to follow.
const MIN_POINTS: f64 = 12.0;
/// 2^−18 of the unit cube: a box of a window that is a hundredth of the scene, seen in a hundredth of the directions.
const MAX_DEPTH: u32 = 18;

/// Learnt probabilities of lights and densities of their rays.
#[derive(Debug)]
struct Guide {
    by_learnt_share: AliasTable,
    /// By light; `None` where rays are not guided.
    rays: Vec<Option<BoxTree>>,
}

/// See the module's head.
#[derive(Clone, Debug, Default)]
pub struct EmissionDistribution(Option<Arc<Guide>>);

/// Densities of position and direction of a ray.
type RayPdfs = (AreaPdf, SolidAnglePdf);

impl EmissionDistribution {
    /// Guided by `records`; unguided if no light at infinity is among them.
    pub fn guided(lights: &LightSet, records: &[EmissionRecord]) -> EmissionDistribution {
        let is_infinite = |record: &&EmissionRecord| lights.get(record.light).is_infinite();
        if !records.iter().any(|record| is_infinite(&record)) {
            return EmissionDistribution(None);
        }
        let mut rays: Vec<Option<BoxTree>> = vec![None; lights.len()];
        for &id in lights.infinite() {
            let light = lights.get(id);
            let own = records.iter().filter(|record| record.light == id);
            let mut points: Vec<WeightedPoint> = own.filter_map(|record| weighted_point(light, record)).collect();
            let axes = if light.delta_direction() { 2 } else { 4 };
            let fit = BoxTreeFit { axes, even: UNGUIDED_SHARE, min_points: MIN_POINTS, max_depth: MAX_DEPTH };
            rays[id.index()] = BoxTree::fit(&mut points, &fit);
        }
        let by_learnt_share = AliasTable::new(&light_weights(lights, records));
        EmissionDistribution(Some(Arc::new(Guide { by_learnt_share, rays })))
    }

    /// Emission is guided.
    #[cfg(test)]
    pub fn is_guided(&self) -> bool {
        self.0.is_some()
    }

    /// Draws the light of a light sub-path; `None` if no light has power.
    pub fn sample_light(&self, lights: &LightSet, u: f32) -> Option<(LightId, Pmf)> {
        match &self.0 {
            None => lights.sample_light(u),
            Some(guide) => guide.by_learnt_share.sample(u).map(|(i, pmf)| (LightId(i as u32), pmf)),
        }
    }

    /// Probability of [`EmissionDistribution::sample_light`].
    pub fn pmf_light(&self, lights: &LightSet, id: LightId) -> Pmf {
        match &self.0 {
            None => lights.pmf_light(id),
            Some(guide) => guide.by_learnt_share.pmf(id.index()),
        }
    }

    /// Draws a ray that leaves the light `id`.
    pub fn sample_ray(
        &self,
        lights: &LightSet,
        id: LightId,
        u_pos: [f32; 2],
        u_dir: [f32; 2],
    ) -> Option<EmissionSample> {
        let light = lights.get(id);
        let Some(tree) = self.rays(id) else { return light.sample_emission(u_pos, u_dir) };
        let u = tree.sample([u_pos[0], u_pos[1], u_dir[0], u_dir[1]]);
        let mut sample = light.sample_emission([u[0], u[1]], [u[2], u[3]])?;
        sample.pdf_position.0 *= factor(tree, light, sample.origin, sample.direction);
        Some(sample)
    }

    /// Densities of [`EmissionDistribution::sample_ray`] for a ray in the unit direction `wo` to the point `next`; `ng`
    /// and delta factors as for [`Light::pdf_emission`].
    pub fn pdf_ray(&self, lights: &LightSet, id: LightId, ng: Vec3, wo: Vec3, next: Vec3) -> RayPdfs {
        let light = lights.get(id);
        self.with_factor(light.pdf_emission(ng, wo), light, id, wo, next)
    }

    /// [`EmissionDistribution::pdf_ray`], with delta factors as for [`Light::pdf_emission_at_vertex`].
    pub fn pdf_ray_at_vertex(&self, lights: &LightSet, id: LightId, ng: Vec3, wo: Vec3, next: Vec3) -> RayPdfs {
        let light = lights.get(id);
        self.with_factor(light.pdf_emission_at_vertex(ng, wo), light, id, wo, next)
    }

    /// [`EmissionDistribution::pdf_ray_at_vertex`] of the ray that runs back along `sample`, a result of
    /// [`Light::sample_direct`] from the point `next`.
    #[inline]
    pub fn pdf_ray_at_sample(&self, lights: &LightSet, id: LightId, sample: &DirectSample, next: Vec3) -> RayPdfs {
        let light = lights.get(id);
        self.with_factor(light.pdf_emission_at_sample(sample), light, id, -sample.wi, next)
    }

    #[inline]
    fn rays(&self, id: LightId) -> Option<&BoxTree> {
        self.0.as_ref()?.rays[id.index()].as_ref()
    }

    #[inline]
    fn with_factor(&self, pdfs: RayPdfs, light: &Light, id: LightId, wo: Vec3, next: Vec3) -> RayPdfs {
        match self.rays(id) {
            None => pdfs,
            Some(tree) => (AreaPdf(pdfs.0.0 * factor(tree, light, next, wo)), pdfs.1),
        }
    }
}

/// Σ p_i g(u_i) / Σ p_i over the numbers u_i that make the ray through `p` in the unit direction `wo`.
fn factor(tree: &BoxTree, light: &Light, p: Vec3, wo: Vec3) -> f32 {
    match light {
        Light::Directional(light) => {
            let [x, y] = light.invert_emission(p);
            tree.pdf([x, y, 0.5, 0.5])
        }
        Light::Environment(light) => {
            let ([x, y], directions) = light.invert_emission(p, wo);
            let (mut guided, mut unguided) = (0.0, 0.0);
            for (pdf, [u, v]) in directions.into_iter().filter(|(pdf, _)| *pdf > 0.0) {
                guided += pdf * tree.pdf([x, y, u, v]);
                unguided += pdf;
            }
            if unguided > 0.0 { guided / unguided } else { 1.0 }
        }
        _ => 1.0,
    }
}

/// The numbers that make a record's ray; of two, those that are more likely to.
fn weighted_point(light: &Light, record: &EmissionRecord) -> Option<WeightedPoint> {
    let ([x, y], [u, v]) = match light {
        Light::Directional(light) => (light.invert_emission(record.p), [0.5; 2]),
        Light::Environment(light) => {
            let (position, [first, second]) = light.invert_emission(record.p, record.direction);
            (position, if second.0 > first.0 { second.1 } else { first.1 })
        }
        _ => return None,
    };
    let at = [x, y, u, v];
    at.iter().all(|x| x.is_finite()).then_some(WeightedPoint { at, weight: record.weight })
}

/// Weights of the lights for light sub-paths: the mixture of shares. Lights with a position share what was learnt of
/// all of them by power.
fn light_weights(lights: &LightSet, records: &[EmissionRecord]) -> Vec<f32> {
    let mut learnt = vec![0.0; lights.len()];
    records.iter().for_each(|record| learnt[record.light.index()] += record.weight);
    let power = |id: LightId| f64::from(lights.pmf_light(id).0);
    // Sums over lights with a position.
    let (mut near_power, mut near_learnt) = (0.0, 0.0);
    for (id, _) in lights.iter().filter(|(_, light)| !light.is_infinite()) {
        near_power += power(id);
        near_learnt += learnt[id.index()];
    }
    let all_learnt: f64 = learnt.iter().sum();
    let shining = lights.infinite().iter().filter(|&&id| power(id) > 0.0).count();
    let equal_share = EQUAL_SHARE / (shining + usize::from(near_power > 0.0)) as f64;
    let weight = |(id, light): (LightId, &Light)| {
        // The light's part of its group, and what was learnt of the group.
        let (part, group_learnt) = match light.is_infinite() {
            true => (1.0, learnt[id.index()]),
            false => (power(id) / near_power, near_learnt),
        };
        let learnt_share = (1.0 - POWER_SHARE - EQUAL_SHARE) * group_learnt / all_learnt;
        if power(id) > 0.0 { (POWER_SHARE * power(id) + part * (learnt_share + equal_share)) as f32 } else { 0.0 }
    };
    lights.iter().map(weight).collect()
}
