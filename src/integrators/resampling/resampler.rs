//! What resampled connections know in an iteration: candidates, how to draw from them, and what weights need.

use super::distributions::UNIFORM;
use super::near::Near;
use super::places::{AtCaches, AtSites, Places};
use super::pmfs::Choice;
use super::store::LightStore;
use super::{Settings, Weights};
use crate::integrators::bdpt::eye_path::Candidate;
use crate::math::Vec3;
use crate::math::hash::HashRng;
use crate::mis::definition::Joined;
use crate::mis::{Form, Lengths, Resampled, There, Weigher};
use crate::prepared::PreparedScene;
use crate::ray::Tracer;
use crate::ray::offset::SegmentEnd;
use crate::shade::{SurfacePoint, Transport};

/// The fraction of the golden ratio: its multiples fill a circle evenly.
const GOLDEN: f32 = 0.618_034;

/// The candidates of an iteration and how to draw from them.
#[derive(Debug)]
pub(in crate::integrators) struct Resampler {
    pub settings: Settings,
    pub(super) places: Places,
    pub(super) store: LightStore,
    /// Sum over sets of the number of vertices, and of sub-paths.
    pub(super) seen: [u64; 2],
    /// Seed and number of the iteration that is ready to be replayed.
    pub(super) ready: Option<(u64, u64)>,
}

/// The side of a point's surface on which the direction `d` leaves it.
#[inline]
pub(super) fn side(point: &SurfacePoint, d: Vec3) -> Vec3 {
    if point.ng.dot(d) < 0.0 { -point.ng } else { point.ng }
}

impl Resampler {
    pub fn new(settings: Settings) -> Resampler {
        Resampler { settings, places: Places::None, store: LightStore::default(), seen: [0; 2], ready: None }
    }

    /// What is known of the light at a point, on the side of the direction `d`.
    #[inline]
    pub fn there(&self, point: &SurfacePoint, d: Vec3) -> There {
        if self.settings.weights == Weights::Balance || self.settings.form.asks() {
            return There::default();
        }
        match &self.places {
            Places::None => There::default(),
            Places::Caches(at) => at.caches.there(point.p, side(point, d)),
            Places::Sites(at) => at.there(self.near(point, d).caches(), self.vertices_per_path()),
        }
    }

    /// c of a connection by its definition.
    pub fn factor_of(&self, scene: &PreparedScene, weigher: &Weigher, resampled: &Resampled, joined: &Joined) -> f32 {
        let Joined { s, y, from, z, to, distance2, arriving, brings } = joined;
        if !resampled.form.asks() {
            return resampled.factor(*brings, *distance2, self.there(&z.point, -*to));
        }
        let near = self.near(&z.point, -*to);
        let end = SegmentEnd::Surface { p: y.point.p, error: y.point.error, ng: y.point.ng };
        let seen = self.seen_by(&near, &end, &mut Tracer::new(&*scene.query));
        let value = |to: Vec3| y.bsdf.eval(*from, to, Transport::Importance);
        weigher.asked(resampled, *arriving, &self.proposals(&near, (y.point.p, y.point.ng), seen, value), *s)
    }

    /// L, an estimate; 0 if nothing is known yet.
    fn vertices_per_path(&self) -> f64 {
        let [vertices, paths] = self.seen;
        if paths > 0 { vertices as f64 / paths as f64 } else { 0.0 }
    }

    /// What weights know.
    pub(super) fn resampled(&self) -> Option<Resampled> {
        let Settings { second_stage, .. } = self.settings;
        let (paths_counted, second_stage) = match (self.settings.weights, second_stage) {
            (Weights::Balance, _) => return None,
            (Weights::TwoStage, _) | (Weights::OneStage, None) => (self.settings.paths, second_stage),
            (Weights::OneStage, Some(clusters)) => (clusters.min(self.settings.paths), None),
        };
        Some(Resampled {
            paths: paths_counted as f32,
            second_stage: second_stage.map(|m2| m2 as f32),
            epsilon: self.settings.epsilon,
            doubt: self.settings.doubt,
            uniform: match self.places {
                Places::Sites(_) => UNIFORM as f32,
                _ => 1.0 / (self.settings.neighbours + 1) as f32,
            },
            vertices_per_path: self.vertices_per_path() as f32,
            form: self.settings.form,
        })
    }

    /// What weights know of each length, where each is drawn from by itself.
    pub(super) fn by_length(&self) -> Option<Lengths> {
        let Places::Sites(at) = &self.places else { return None };
        let numbers = at.lengths.iter().map(|share| share * self.settings.paths as f32);
        self.settings.form.asks().then(|| at.learnt.lengths(numbers.collect(), self.settings.epsilon))
    }

    /// Draws candidates for an eye vertex at `point` that looks from the side of `wo`, and hands them to `connect`. Only a share `effort` of
    /// draws is made. `possible` says which numbers of light vertices are wanted.
    ///
    /// The draws of a vertex are systematic: all cut cumulative probabilities at the same place of their own part, which `offset` tells.
    /// Light vertices that are neighbours in these are neighbours in space.
    #[inline]
    pub fn draw_all<'a>(
        &'a self,
        (point, wo): (&SurfacePoint, Vec3),
        (offset, rng): (f32, &mut HashRng),
        effort: f32,
        possible: impl Fn(usize) -> bool,
        mut connect: impl FnMut(Candidate<'a>),
    ) {
        if self.store.is_empty() {
            return;
        }
        let near = self.near(point, wo);
        match &self.places {
            Places::None => {}
            Places::Caches(at) => {
                for number in 0..self.settings.samples {
                    let [proposal, present, ..] = rng.next_4();
                    if present < effort
                        && let Some(candidate) = self.draw(at, &near, [proposal, self.cut(number, offset)], effort)
                        && possible(candidate.vertex.length())
                    {
                        connect(candidate);
                    }
                }
            }
            Places::Sites(at) => self.draw_at_sites(at, &near, (offset, rng), effort, possible, connect),
        }
    }

    /// Where draw `number` of a vertex cuts cumulative probabilities.
    #[inline]
    fn cut(&self, number: u32, offset: f32) -> f32 {
        // Rounding must not make it one.
        ((number as f32 + offset) / self.settings.samples as f32).min(1.0 - f32::EPSILON)
    }

    /// The same at sites of importance caching, from each of their classes by itself.
    fn draw_at_sites<'a>(
        &'a self,
        at: &AtSites,
        near: &Near,
        (offset, rng): (f32, &mut HashRng),
        effort: f32,
        possible: impl Fn(usize) -> bool,
        mut connect: impl FnMut(Candidate<'a>),
    ) {
        for class in 0..at.combined.classes() {
            let length = at.combined.length(class);
            if length.is_some_and(|s| !possible(s)) {
                continue;
            }
            // Long sub-paths are rare and dim: no more of them are connected to than a pixel's own sub-path would have. A sub-path is then
            // as likely to be met as by the pixel's own: in weights, such connections count as one.
            let effort = effort * length.map_or(1.0, |s| at.share_of_length(s));
            // Classes have their own cuts, or what is drawn of them would be alike.
            let offset = (offset + class as f32 * GOLDEN).fract();
            for number in 0..self.settings.samples {
                let [site, present, ..] = rng.next_4();
                if present >= effort {
                    continue;
                }
                let drawn = at.combined.draw(class, near.caches(), [site, self.cut(number, offset)]);
                let number = self.settings.paths as f32 * self.settings.samples as f32;
                let candidate = self.store.candidate(drawn.vertex, 1.0 / (drawn.probability * number * effort));
                if possible(candidate.vertex.length()) {
                    connect(candidate);
                }
            }
        }
    }

    /// Draws a candidate by the cache points `near`; `None` if there are none. Only a share `effort` of draws is made.
    #[inline]
    fn draw(&self, at: &AtCaches, near: &Near, u: [f32; 2], effort: f32) -> Option<Candidate<'_>> {
        let (proposal, Choice { entry, vertex, probability }) = match near.caches() {
            _ if self.settings.form == Form::Split => {
                self.draw_split(&at.pmfs, near, u).map(|(proposal, choice)| (Some(proposal), choice))?
            }
            [] => (None, self.draw_anything(u[1])?),
            caches => (None, at.pmfs.draw(caches, u)?),
        };
        let scale = 1.0 / (probability * self.settings.paths as f32 * self.settings.samples as f32 * effort);
        let near = self.settings.form.asks().then(|| (*near, at.pmfs.seen(near.caches(), entry)));
        Some(Candidate { proposal, near, ..self.store.candidate(vertex, scale) })
    }

    /// Far from all cache points: uniformly or, as a first stage would, by f_y/p.
    pub(super) fn draw_anything(&self, u: f32) -> Option<Choice> {
        let all = self.store.len();
        if self.settings.second_stage.is_none() {
            let vertex = ((u * all as f32) as usize).min(all - 1);
            return Some(Choice { entry: vertex, vertex, probability: 1.0 / all as f32 });
        }
        let (vertex, p) = self.store.tree.draw(&(0..all), u)?;
        Some(Choice { entry: vertex, vertex, probability: p as f32 })
    }

    /// What there is to draw by and from, for people.
    pub fn note(&self) -> Option<String> {
        let note = self.places.note()?;
        Some(format!("{note}, {} light sub-paths", self.settings.paths))
    }

    /// What must be saved to go on later, as bytes.
    pub fn state(&self) -> Vec<u8> {
        let (sums, iterations) = self.places.state();
        if sums.is_empty() {
            return vec![];
        }
        let mut words = vec![iterations, self.seen[0], self.seen[1]];
        words.extend(sums.iter().map(|s| s.to_bits()));
        words.into_iter().flat_map(u64::to_le_bytes).collect()
    }
}
