//! How many samples of each kind of technique a render takes, decided once from its first iterations.
//!
//! The first two iterations take all of them, and are part of the picture like any other. Their samples tell what other numbers would
//! cost and be worth (`mis::effort`); the best setting holds from then on. No kind is ever given up: what the first iterations did not
//! meet could be rare and bright, so that a sixteenth of the connections and a sixty-fourth of the light image always stay. The decision depends on
//! earlier iterations only, so every iteration is unbiased, and on counts of rays instead of times, so it is the same for any machine.

use super::Found;
use crate::film::{Film, TILE};
use crate::integrators::{ParamDefault, ParamSpec};
use crate::math::Rgb;
use crate::mis::{Costs, Effort, EffortStatistics, Together};
use crate::ray::{RayKind, RayStats};

/// Whether to decide at all.
pub(in crate::integrators) const fn parameter(default: &'static str) -> ParamSpec {
    ParamSpec {
        name: "skip",
        about: "auto: after two iterations, take fewer samples of connections and of light tracing where a scene is better off without",
        default: ParamDefault::Choice(default, &["auto", "never"]),
    }
}

/// Iterations at full effort.
const PROBED: u64 = 2;
/// Sub-paths whose contributions are looked at, about, in each of them.
const LOOKED_AT: u32 = 1 << 17;
/// What a ray costs with all that belongs to it, measured in rooms of many kinds: rays of eye sub-paths and to lights; of light sub-paths and
/// to the lens; connections with their weights.
const COSTS: [f64; 3] = [1.0, 1.1, 1.0];
/// The same where connections are drawn from many light sub-paths and weighed by what cache points know.
const COSTS_RESAMPLED: [f64; 3] = [1.0, 1.7, 3.0];

/// What the first iterations found, and what was decided.
#[derive(Debug)]
pub(in crate::integrators) struct Sizing {
    statistics: Option<EffortStatistics>,
    candidates: Vec<Effort>,
    /// A pixel's connections are all to its own light sub-path, if it has one.
    shared_light_paths: bool,
    costs: Costs,
    probed: u64,
    decided: Option<Effort>,
}

impl Sizing {
    /// Undecided. Light sub-paths that serve both the light image and connections are not told apart.
    pub fn new(shared_light_paths: bool) -> Sizing {
        let steps = [1.0, 0.25, 0.0625];
        let candidates = match shared_light_paths {
            true => steps.iter().map(|&both| Effort { light_image: both, connections: both }).collect(),
            false => [1.0, 0.25, 0.0625, 0.015_625]
                .into_iter()
                .flat_map(|light_image| steps.iter().map(move |&connections| Effort { light_image, connections }))
                .collect(),
        };
        Sizing { statistics: None, candidates, shared_light_paths, costs: Costs::default(), probed: 0, decided: None }
    }

    /// The effort of iteration `index`.
    pub fn effort(&self, index: u64) -> Effort {
        match self.decided {
            Some(effort) if index >= PROBED => effort,
            _ => Effort::FULL,
        }
    }

    /// Iteration `index` is one of the first: contributions of every n-th sub-path are wanted.
    pub fn every(&self, index: u64, sub_paths: u32) -> Option<u32> {
        (self.decided.is_none() && index < PROBED).then(|| sub_paths.div_ceil(LOOKED_AT).max(1))
    }

    /// Iterations that must have been looked at before this one can be repeated.
    pub fn missing(&self, index: u64) -> u64 {
        if self.decided.is_none() { index.min(PROBED) } else { 0 }
    }

    /// Takes in one of the first iterations, whose film it is; `found` are the visible contributions of every n-th sub-path. Decides
    /// after the last.
    pub fn learn<'a>(&mut self, film: &Film, found: impl Iterator<Item = &'a Found>, every: u32, stats: &RayStats) {
        let columns = film.width.div_ceil(TILE);
        let candidates = &self.candidates;
        let statistics =
            self.statistics.get_or_insert_with(|| EffortStatistics::new(candidates.clone(), film.tiles.len()));
        let region_of = |f: &Found| {
            let (x, y) = (f.x.wrapping_sub(film.x0), f.y.wrapping_sub(film.y0));
            (x < film.width && y < film.height).then(|| (y / TILE * columns + x / TILE) as usize)
        };
        let mut together = vec![];
        for f in found {
            let Some(region) = region_of(f) else { continue };
            let value = f.raw * f.weight.own;
            statistics.add(region, square(value) * f64::from(every), &f.weight);
            if self.shared_light_paths && f.t >= 2 {
                together.push(((f.y, f.x), region, Together { value, weight: f.weight, connection: f.s >= 2 }));
            }
        }
        together.sort_by_key(|(pixel, ..)| *pixel);
        for sample in together.chunk_by(|(a, ..), (b, ..)| a == b).filter(|sample| sample.len() > 1) {
            let contributions: Vec<Together> = sample.iter().map(|(.., c)| *c).collect();
            statistics.add_together(sample[0].1, &contributions, f64::from(every));
        }
        let rays = |kinds: &[RayKind]| kinds.iter().map(|k| stats.kinds[*k as usize].rays as f64).sum::<f64>();
        let each = if self.shared_light_paths { COSTS } else { COSTS_RESAMPLED };
        self.costs.base += each[0] * rays(&[RayKind::Camera, RayKind::Bounce, RayKind::ShadowDirect]);
        self.costs.light_image += each[1] * rays(&[RayKind::Light, RayKind::LightBounce, RayKind::ShadowLens]);
        self.costs.connections += each[2] * rays(&[RayKind::ShadowConnection]);
        self.probed += 1;
        if self.probed == PROBED && film.iterations == PROBED {
            self.decided = Some(statistics.best(&variances(film), &self.costs));
        }
    }

    /// What was decided, for people.
    pub fn note(&self) -> Option<String> {
        let Effort { light_image, connections } = self.decided?;
        Some(format!("samples of the light image x {light_image}, of connections x {connections}"))
    }

    /// Everything, to be saved.
    pub fn state(&self) -> Vec<f64> {
        let Costs { base, light_image, connections } = self.costs;
        let decided = self.decided.map_or([0.0; 2], |e| [e.light_image, e.connections].map(f64::from));
        let mut state = vec![self.probed as f64, base, light_image, connections, decided[0], decided[1]];
        if self.decided.is_none() {
            state.extend(self.statistics.iter().flat_map(EffortStatistics::sums));
        }
        state
    }

    /// Goes on from a saved state of a film with so many tiles; false if it is of something else.
    pub fn restore(&mut self, state: &[f64], tiles: usize) -> bool {
        let [probed, base, light_image, connections, decided_light, decided_connections, sums @ ..] = state else {
            return false;
        };
        (self.probed, self.costs) =
            (*probed as u64, Costs { base: *base, light_image: *light_image, connections: *connections });
        let decided = Effort { light_image: *decided_light as f32, connections: *decided_connections as f32 };
        self.decided = (decided.light_image > 0.0).then_some(decided);
        if sums.is_empty() {
            return true;
        }
        let mut statistics = EffortStatistics::new(self.candidates.clone(), tiles);
        let fits = statistics.restore(sums);
        self.statistics = Some(statistics);
        fits
    }
}

/// Mean square of the channels.
fn square(value: Rgb) -> f64 {
    value.to_array().iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / 3.0
}

/// For each tile the sum over samples of their variance, and its mean, squared.
fn variances(film: &Film) -> Vec<(f64, f64)> {
    let n = film.iterations as f64;
    film.tiles
        .iter()
        .map(|tile| {
            let (mut variance, mut sum) = (0.0, 0.0);
            for (s, q) in tile.sums.iter().flatten().zip(tile.squares.iter().flatten()) {
                // Each of the n samples has this variance.
                variance += (q - s * s / n).max(0.0) / (n - 1.0) * n / 3.0;
                sum += s / (3.0 * n);
            }
            (variance, (sum / f64::from(tile.pixels())).powi(2))
        })
        .collect()
}
