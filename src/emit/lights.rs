//! All lights of a scene, and the choice of one.

use super::light::Light;
use crate::math::discrete::AliasTable;
use crate::math::{Pmf, Vec3};

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
}

impl LightSet {
    /// From lights; the index of a light is its [`LightId`].
    pub fn new(lights: Vec<Light>) -> LightSet {
        let powers: Vec<f32> = lights.iter().map(Light::power).collect();
        let infinite = (0..lights.len()).filter(|&i| lights[i].is_infinite()).map(|i| LightId(i as u32)).collect();
        LightSet { infinite, by_power: AliasTable::new(&powers), lights }
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

    /// Lights at infinity: what escaped rays may see.
    pub fn infinite(&self) -> &[LightId] {
        &self.infinite
    }

    /// Chooses a light in proportion to power, the choice of light sub-paths; `None` if no light has any.
    pub fn pick(&self, u: f32) -> Option<(LightId, Pmf)> {
        self.by_power.sample(u).map(|(i, p)| (LightId(i as u32), p))
    }

    /// Probability of [`LightSet::pick`].
    pub fn pmf(&self, id: LightId) -> Pmf {
        self.by_power.pmf(id.index())
    }

    /// Chooses a light for the point `p`, whose normal is `n` if it has one: the choice for direct light.
    pub fn pick_from(&self, _p: Vec3, _n: Option<Vec3>, u: f32) -> Option<(LightId, Pmf)> {
        self.pick(u)
    }

    /// Probability of [`LightSet::pick_from`] with the same `p` and `n`.
    pub fn pmf_from(&self, _p: Vec3, _n: Option<Vec3>, id: LightId) -> Pmf {
        self.pmf(id)
    }
}
