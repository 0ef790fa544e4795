//! How many samples of each kind of technique a render takes, decided once from its first iterations.
//!
//! The first two iterations take all of them, and are part of the picture like any other. Their samples tell what other numbers would
//! cost and be worth (`mis::effort`); the best setting holds from then on. No kind is ever given up: what the first iterations did not
//! meet could be rare and bright, so that a sixteenth of the connections and a sixteenth or, where they serve the light image only,
//! a sixty-fourth of the light sub-paths always stay. Nor do too many pixels share one: their noise is alike, and no sum of squares
//! tells. The decision depends on earlier iterations only, so every iteration is unbiased, and on counts of rays instead of times, so it
//! is the same for any machine.

use super::Found;
use crate::film::{Film, TILE};
use crate::integrators::Params;
use crate::mis::{Contribution, Costs, Effort, EffortStatistics};
use crate::ray::{RayKind, RayStats};

/// Numbers of light sub-paths that may be decided, as fractions of the full number.
const LIGHT_PATHS: [f32; 3] = [1.0, 0.25, 0.0625];
/// Numbers of connections that may be decided, as fractions of the full number.
const CONNECTIONS: [f32; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];

/// What may be decided where connections are not resampled.
pub(super) fn candidates(params: &Params) -> Vec<Effort> {
    let full = params.choice("allocation") == "full";
    let candidates = |name: &str, all: &[f32]| match params.auto_float(name) {
        Some(fixed) => vec![nearest_power_of_two(fixed)],
        None if full => vec![1.0],
        None => all.to_vec(),
    };
    pairs(&candidates("light_paths", &LIGHT_PATHS), &candidates("connections", &CONNECTIONS))
}

/// The power of two with the nearest logarithm.
fn nearest_power_of_two(x: f64) -> f32 {
    x.log2().round().exp2() as f32
}

fn pairs(light_image: &[f32], connections: &[f32]) -> Vec<Effort> {
    light_image
        .iter()
        .flat_map(|&light_image| connections.iter().map(move |&connections| Effort { light_image, connections }))
        .collect()
}

/// Iterations at full effort.
const PROBED: u64 = 2;
/// Sub-paths whose contributions are looked at, about, in each of them.
const LOOKED_AT: u32 = 1 << 15;
/// What a ray costs with all that belongs to it, measured in rooms of many kinds: rays of eye sub-paths and to lights; of light sub-paths and
/// to the lens; connections with their weights.
const COSTS: [f64; 3] = [1.0, 1.2, 0.7];
/// The same where connections are drawn from many light sub-paths.
const COSTS_RESAMPLED: [f64; 3] = [1.0, 1.2, 1.0];

/// What the first iterations found, and what was decided.
#[derive(Debug)]
pub(in crate::integrators) struct Sizing {
    statistics: Option<EffortStatistics>,
    candidates: Vec<Effort>,
    /// What a ray costs.
    each: [f64; 3],
    costs: Costs,
    probed: u64,
    decided: Option<Effort>,
}

impl Sizing {
    /// Undecided among `candidates`.
    pub fn new(candidates: Vec<Effort>) -> Sizing {
        Sizing { statistics: None, candidates, each: COSTS, costs: Costs::default(), probed: 0, decided: None }
    }

    /// Undecided, where connections are resampled.
    pub fn resampled() -> Sizing {
        let candidates = pairs(&[1.0, 0.25, 0.0625, 0.015_625], &[1.0, 0.5, 0.25, 0.125, 0.0625]);
        Sizing { each: COSTS_RESAMPLED, ..Sizing::new(candidates) }
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

    /// Takes in one of the first iterations, whose film it is, of a picture of the size `full`; `found` are the visible contributions of every
    /// n-th sub-path. Decides after the last.
    pub fn learn<'a>(
        &mut self,
        (film, full): (&Film, [u32; 2]),
        found: impl Iterator<Item = &'a Found>,
        every: u32,
        stats: &RayStats,
    ) {
        let columns = film.width.div_ceil(TILE);
        let pixels = (full[0] * full[1]).div_ceil(every);
        let candidates = &self.candidates;
        let statistics = self
            .statistics
            .get_or_insert_with(|| EffortStatistics::new(candidates.clone(), film.tiles.len(), pixels as usize));
        let region_of = |(x, y): (u32, u32)| {
            let (x, y) = (x.wrapping_sub(film.x0), y.wrapping_sub(film.y0));
            (x < film.width && y < film.height).then(|| (y / TILE * columns + x / TILE) as usize)
        };
        let (mut of_pixels, times) = (vec![], f64::from(every));
        for f in found {
            let Some(region) = region_of((f.x, f.y)) else { continue };
            let contribution = Contribution { value: f.raw * f.weight.own, weight: f.weight, connection: f.s >= 2 };
            statistics.add(region, &contribution, times);
            if f.t >= 2 {
                of_pixels.push((f.y * full[0] + f.x, contribution));
            }
        }
        // In the order in which they were found, so that sums have the same bits.
        of_pixels.sort_by_key(|(pixel, _)| *pixel);
        let mut of_pixels = of_pixels.chunk_by(|(a, _), (b, _)| a == b).peekable();
        for number in 0..pixels {
            let pixel = number * every;
            let contributions: Vec<Contribution> = of_pixels
                .next_if(|sample| sample[0].0 == pixel)
                .map_or(vec![], |sample| sample.iter().map(|(_, c)| *c).collect());
            if let Some(region) = region_of((pixel % full[0], pixel / full[0])) {
                statistics.add_sample((region, number as usize), self.probed > 0, &contributions, times);
            }
        }
        let rays = |kinds: &[RayKind]| kinds.iter().map(|k| stats.kinds[*k as usize].rays as f64).sum::<f64>();
        let each = self.each;
        self.costs.base += each[0] * rays(&[RayKind::Camera, RayKind::Bounce, RayKind::ShadowDirect]);
        self.costs.light_image += each[1] * rays(&[RayKind::Light, RayKind::LightBounce, RayKind::ShadowLens]);
        self.costs.connections += each[2] * rays(&[RayKind::ShadowConnection]);
        self.probed += 1;
        if self.probed == PROBED && film.iterations() == PROBED {
            self.decided = Some(statistics.best(&variances(film), &self.costs));
            self.statistics = None;
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
            state.extend(self.statistics.iter().flat_map(EffortStatistics::saved));
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
        self.statistics = EffortStatistics::restored(self.candidates.clone(), tiles, sums);
        self.statistics.is_some()
    }
}

/// For each tile the sum over samples of their variance, and its mean, squared.
fn variances(film: &Film) -> Vec<(f64, f64)> {
    let n = film.iterations() as f64;
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
