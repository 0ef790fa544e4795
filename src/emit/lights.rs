//! All lights of a scene, and the sampling of one.
//!
//! Light sub-paths sample a light in proportion to power. Direct light samples one for the point that is lit: lights
//! with a position by a [`WideLightTree`] unless they are few, lights at infinity with a probability of their own,
//! since their power (it grows with the scene's size) does not tell how much arrives at a point.

use super::light::Light;
use crate::math::cdf::PrefixSums;
use crate::math::discrete::AliasTable;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Pmf, Vec3};
use crate::spatial::light_tree::{LightBounds, OrientedSource, WideLightTree};
use std::ops::Range;

/// Index of a light in its [`LightSet`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LightId(pub u32);

impl LightId {
    /// As an index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// All lights of a scene.
#[derive(Debug, Default)]
pub struct LightSet {
    lights: Vec<Light>,
    infinite: Vec<LightId>,
    by_power: AliasTable,
    direct: Option<Direct>,
}

/// Probabilities for a lit point, where they differ from those by power.
#[derive(Debug)]
struct Direct {
    tree: WideLightTree,
    /// Probability of sampling one of the lights at infinity.
    infinite_share: f32,
    /// Lights at infinity by power; the probability of all other lights is zero.
    infinite: PrefixSums,
}

/// Fewest lights with a position for which a tree is built if no light is at infinity; fewer are sampled by power
/// alone.
const LIGHT_TREE_MIN: usize = 5;

impl Direct {
    fn new(lights: &[Light], powers: &[f32]) -> Option<Direct> {
        let count = |infinite: bool| {
            lights.iter().zip(powers).filter(|(l, p)| l.is_infinite() == infinite && **p > 0.0).count()
        };
        let (near, far) = (count(false), count(true));
        if near == 0 || (far == 0 && near < LIGHT_TREE_MIN) {
            return None;
        }
        let far_power = |(l, &p): (&Light, &f32)| if l.is_infinite() && p.is_finite() { p.max(0.0) } else { 0.0 };
        let infinite = PrefixSums::new(lights.iter().zip(powers).map(far_power));
        let infinite_share = far as f32 / (far + 1) as f32;
        let source = |(i, light): (usize, &Light)| {
            let bounds = light.bounds()?;
            let bounds = LightBounds { power: powers[i], ..bounds };
            (powers[i] > 0.0).then_some(OrientedSource { index: i as u32, bounds })
        };
        let tree = WideLightTree::new(lights.iter().enumerate().filter_map(source).collect());
        Some(Direct { tree, infinite_share, infinite })
    }

    /// All indices of lights.
    fn all(&self) -> Range<usize> {
        0..self.infinite.len()
    }

    /// Probability of a light at infinity.
    fn pmf_infinite(&self, id: LightId) -> Pmf {
        Pmf(self.infinite.pmf(&self.all(), id.index()) as f32) * Pmf(self.infinite_share)
    }

    fn sample(&self, p: Vec3, n: Option<Vec3>, u: f32) -> Option<(LightId, Pmf)> {
        let share = self.infinite_share;
        if u < share {
            let id = LightId(self.infinite.sample(&self.all(), f64::from((u / share).min(ONE_MINUS_EPSILON)))? as u32);
            Some((id, self.pmf_infinite(id)))
        } else {
            let (i, pmf) = self.tree.sample(p, n, (u - share) / (1.0 - share))?;
            Some((LightId(i), pmf * Pmf(1.0 - share)))
        }
    }
}

impl LightSet {
    /// From lights; the index of a light is its [`LightId`].
    pub fn new(lights: Vec<Light>) -> LightSet {
        let weights = vec![1.0; lights.len()];
        LightSet::weighted(lights, &weights)
    }

    /// From lights that are sampled by their powers times `weights`. A light of weight zero is never sampled: it shines
    /// only where rays meet it.
    pub fn weighted(lights: Vec<Light>, weights: &[f32]) -> LightSet {
        let powers: Vec<f32> = lights.iter().zip(weights).map(|(light, weight)| light.power() * weight).collect();
        let infinite = (0..lights.len()).filter(|&i| lights[i].is_infinite()).map(|i| LightId(i as u32)).collect();
        let direct = Direct::new(&lights, &powers);
        LightSet { infinite, by_power: AliasTable::new(&powers), direct, lights }
    }

    /// The light `id` of this set.
    ///
    /// # Panics
    /// If `id` is from a larger set.
    pub fn get(&self, id: LightId) -> &Light {
        &self.lights[id.index()]
    }

    /// All lights in the order of their ids.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (LightId, &Light)> {
        self.lights.iter().enumerate().map(|(i, l)| (LightId(i as u32), l))
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// True if there are no lights.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Sum of the lights' powers.
    pub fn power(&self) -> f64 {
        self.by_power.total()
    }

    /// Lights at infinity, which escaped rays may see.
    pub fn infinite(&self) -> &[LightId] {
        &self.infinite
    }

    /// Samples a light in proportion to power, for a light sub-path; `None` if no light has power.
    pub fn sample_light(&self, u: f32) -> Option<(LightId, Pmf)> {
        self.by_power.sample(u).map(|(i, p)| (LightId(i as u32), p))
    }

    /// Probability of [`LightSet::sample_light`].
    pub fn pmf_light(&self, id: LightId) -> Pmf {
        self.by_power.pmf(id.index())
    }

    /// True if [`LightSet::sample_light_from`] depends on the point.
    #[inline]
    pub fn uses_light_tree(&self) -> bool {
        self.direct.is_some()
    }

    /// Samples a light that may light the point `p`, for direct light. `n` is the unit geometric normal on the side
    /// where light is received; sets of lights wholly below its horizon have no probability. `None` if light is
    /// received from both sides, or in a volume.
    ///
    /// The probability is exactly [`LightSet::pmf_light_from`] with the same `p` and `n`. `None` is returned only if no
    /// light has power.
    #[inline]
    pub fn sample_light_from(&self, p: Vec3, n: Option<Vec3>, u: f32) -> Option<(LightId, Pmf)> {
        match &self.direct {
            None => self.sample_light(u),
            Some(direct) => direct.sample(p, n, u),
        }
    }

    /// Probability of [`LightSet::sample_light_from`] with the same `p` and `n`. They sum to one over all lights.
    #[inline]
    pub fn pmf_light_from(&self, p: Vec3, n: Option<Vec3>, id: LightId) -> Pmf {
        match &self.direct {
            None => self.pmf_light(id),
            Some(d) if self.lights.get(id.index()).is_some_and(Light::is_infinite) => d.pmf_infinite(id),
            Some(d) => d.tree.pmf(p, n, id.0) * Pmf(1.0 - d.infinite_share),
        }
    }
}
