//! `bdpt`: bidirectional path tracing (Lafortune & Willems 1993; Veach & Guibas 1994; Veach 1997, §10).
//!
//! Every pixel of every iteration traces one eye sub-path z_0 … and one light sub-path y_0 … and joins every prefix of one with every
//! prefix of the other. What a pair (s, t) is depends on its ends:
//!
//! * s = 0: the eye walk met a light;
//! * s = 1, t ≥ 2: next event, a light point drawn as seen from z_{t−1};
//! * s ≥ 2, t ≥ 2: a connection, the contribution β_L ρ(y_{s−1}) G V ρ(z_{t−1}) β_E;
//! * t = 1: y_{s−1} is connected to the lens and lands in whatever pixel sees it: the light image, to which all W · H light
//!   sub-paths of the full film contribute, also when only part of the picture is rendered.
//!
//! By default pixels share light sub-paths, and only some are connected, where more would not pay (`sizing`, `sharing`); weights know.
//!
//! Weights are `mis`'s. Shadow rays wait in queues and go out in packets; nothing depends on how these were filled.

pub(super) mod eye_path;
mod light_pass;
pub(super) mod light_path;
mod params;
mod sharing;
mod sizing;
mod worker;

use super::params::shared::{ALLOCATION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, TECHNIQUES, heuristic};
use super::resampling::Resampler;
use super::{Integrator, IntegratorSpec, Iteration, Params, Replay};
use crate::film::{Film, FilmTile, LightImage, Pyramid, SampleBuffer};
use crate::math::Rgb;
use crate::math::sampler::PathSampler;
use crate::mis::{Effort, Heuristic, Techniques, Weigher, Weight};
use crate::path::{Limits, WalkStart, walk};
use crate::prepared::Features;
use crate::ray::{Phases, Ray, RayKind, RayStats, Tracer};
use crate::shade::Transport;
use eye_path::{Arrival, EyeHooks, EyeQueues};
use rayon::prelude::*;
use sharing::contains;
use sizing::Sizing;
pub(super) use worker::Piece;
use worker::{Harvest, Worker, add_to};

/// The registry's line.
pub static SPEC: IntegratorSpec = IntegratorSpec {
    name: "bdpt",
    aliases: &[],
    short: "Bidirectional path tracing",
    long: "A sub-path from the camera and one from a light are connected in every possible way, and the techniques \
        are combined by multiple importance sampling. It renders caustics and light that arrives by way of other \
        rooms. By default pixels share light sub-paths and evaluate some of the connections only, where that pays; \
        allocation=full is the published method.\n\n\
        Lafortune and Willems 1993, \"Bi-directional path tracing\"; Veach and Guibas 1994, \"Bidirectional \
        estimators for light transport\"; Veach 1997, chapter 10.",
    params: &[
        &[MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, HIDE_EMITTERS, heuristic("balance"), TECHNIQUES],
        &[ALLOCATION, params::LIGHT_PATHS, params::CONNECTIONS],
    ],
    unbiased: true,
    limitations: |_| None,
    build: |params| {
        let heuristic = if params.choice("heuristic") == "balance" { Heuristic::Balance } else { Heuristic::Power };
        let mut this = Bidirectional::new(params, heuristic, params.techniques("techniques"));
        let mut candidates = sizing::candidates(params);
        if heuristic == Heuristic::Power {
            // What is known of other numbers of samples holds for the balance heuristic.
            candidates.truncate(1);
        }
        match candidates[..] {
            [only] => this.settled = only,
            _ => this.sizing = Some(Sizing::new(candidates)),
        }
        Box::new(this)
    },
};

/// The random streams of sub-paths.
const EYE_STREAM: u64 = 1;
const LIGHT_STREAM: u64 = 3;
/// The random stream of the choice which pixels have light sub-paths.
const CHOICE_STREAM: u64 = 7;
/// Light sub-paths in a piece of work that has no eye sub-paths.
const LIGHT_PATHS_AT_ONCE: u32 = 512;

/// A contribution with its technique.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    /// Pixel, in pixels of the full picture.
    pub x: u32,
    pub y: u32,
    /// Light sub-path, if it is a splat.
    pub path: u32,
    /// Number of the contribution in a replay.
    pub note: u32,
    /// Light vertices.
    pub s: u16,
    /// Eye vertices.
    pub t: u16,
    /// Contribution of the technique by itself.
    pub raw: Rgb,
    /// Its weight, with those of kinds of techniques.
    pub weight: Weight,
}

/// Bidirectional path tracing with any set of techniques; light tracing is one of them.
pub(super) struct Bidirectional {
    hide_emitters: bool,
    pub(super) weigher: Weigher,
    /// Eye sub-paths end where no technique uses more of their vertices.
    pub(super) most_eye_vertices: usize,
    /// The light sub-path of a pixel is connected to its eye sub-path.
    pub(super) connects: bool,
    /// Connections are drawn from many light sub-paths instead.
    pub(super) resampler: Option<Resampler>,
    /// How many samples of each kind of technique this iteration takes.
    pub(super) effort: Effort,
    /// The same for all iterations, unless it is decided.
    settled: Effort,
    /// Where it is decided.
    sizing: Option<Sizing>,
    /// Contributions of every n-th sub-path are wanted by themselves in this iteration.
    every: Option<u32>,
    /// One for each tile of the film, kept for their memory.
    samples: Vec<SampleBuffer>,
    pyramid: Option<Pyramid>,
}

impl Bidirectional {
    pub(super) fn new(params: &Params, heuristic: Heuristic, techniques: Techniques) -> Bidirectional {
        let limits = Limits {
            max_edges: u32::try_from(params.int("max_depth")).unwrap_or(u32::MAX),
            roulette_from: params.int("rr_depth") as u32,
            keep: 1.0,
        };
        Bidirectional {
            hide_emitters: params.bool("hide_emitters"),
            most_eye_vertices: techniques.most_eye_vertices(),
            connects: techniques.uses_connections(),
            weigher: Weigher {
                techniques,
                heuristic,
                eye_limits: limits,
                light_limits: limits,
                resampled: None,
                lengths: None,
            },
            resampler: None,
            effort: Effort::FULL,
            settled: Effort::FULL,
            sizing: None,
            every: None,
            samples: vec![],
            pyramid: None,
        }
    }

    /// From now on, numbers of samples of resampled connections and of splats are decided by the scene.
    pub(super) fn size_by_scene(&mut self) {
        self.sizing = Some(Sizing::resampled());
    }

    /// Settles the effort of iteration `index`.
    fn begin(&mut self, iteration: &Iteration) {
        let (scene, index) = (iteration.scene, iteration.index);
        self.effort = self.sizing.as_ref().map_or(self.settled, |s| s.effort(index));
        let pixels = scene.film_size[0] * scene.film_size[1];
        self.every = match &self.pyramid {
            Some(_) => Some(1),
            None => self.sizing.as_ref().and_then(|s| s.every(index, pixels)),
        };
        let samples = self.resampler.as_ref().map_or(1, |r| r.settings.samples);
        let techniques = &mut self.weigher.techniques;
        techniques.set_connections(samples as f32 * self.effort.connections);
        let light_paths = self.light_paths(iteration);
        self.weigher.techniques.set_light_paths(light_paths);
    }

    /// Contributions of sub-path `number` are wanted by themselves.
    #[inline]
    fn wants(&self, number: u32) -> bool {
        self.every.is_some_and(|n| number.is_multiple_of(n))
    }

    /// One eye sub-path, joined with the worker's light sub-path.
    fn eye_path(
        &self,
        iteration: &Iteration,
        (x, y): (u32, u32),
        worker: &mut Worker,
        tracer: &mut Tracer,
        found: &mut dyn FnMut(Arrival, Found),
        record: Option<&mut Replay>,
    ) {
        let scene = iteration.scene;
        let index = u64::from(y) * u64::from(scene.film_size[0]) + u64::from(x);
        let mut sampler = PathSampler::new(iteration.seed, EYE_STREAM, index, iteration.index);
        let u = sampler.origin();
        let (offset, filter) = scene.filter.sample([u[0], u[1]]);
        let raster = [x as f32 + 0.5 + offset[0], y as f32 + 0.5 + offset[1]];
        let eye = scene.camera.sample_ray(raster, [u[2], u[3]]);
        let (lens, direction) = scene.camera.pdf_sampled_ray(eye.direction);
        worker.eye.begin(lens, self.weigher.resampled.is_some());
        let mut hooks = EyeHooks {
            this: self,
            scene,
            iteration,
            light: &worker.light,
            side: &mut worker.eye,
            known: [None; 2],
            near_before: Default::default(),
            pixel: (x, y),
            lens: eye.origin,
            record,
            queues: &mut EyeQueues { direct: &mut worker.direct, connection: &mut worker.connection, found },
        };
        let start = WalkStart {
            ray: Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far },
            throughput: Rgb::grey(filter),
            pdf: direction,
            delta: false,
            kind: RayKind::Camera,
        };
        walk(scene, start, &self.weigher.eye_limits, Transport::Radiance, tracer, &mut sampler, &mut hooks);
    }

    fn render_tile(
        &self,
        iteration: &Iteration,
        tile: &FilmTile,
        samples: &mut SampleBuffer,
        worker: &mut Worker,
    ) -> Piece {
        let scene = iteration.scene;
        let mut tracer = Tracer::new(&*scene.query);
        samples.clear(tile.pixels());
        let mut all = vec![];
        let mut found = |arrival: Arrival, found: Found| {
            add_to(samples, tile, arrival, &found);
            if self.wants(found.y * scene.film_size[0] + found.x) {
                all.push(found);
            }
        };
        let eye_paths = self.weigher.techniques.uses_eye_paths();
        if self.resamples() || !self.uses_light_paths() {
            for pixel in (0..tile.pixels()).filter(|_| eye_paths) {
                self.eye_path(iteration, tile.pixel(pixel), worker, &mut tracer, &mut found, None);
            }
        } else {
            let window = [tile.x0, tile.y0, tile.width, tile.height];
            let sharing = self.sharing(iteration);
            for slot in sharing.slots_in(window) {
                let splats_it = contains(window, sharing.owner(slot));
                let wants_it = self.connects && sharing.pixels(slot).any(|pixel| contains(window, pixel));
                if splats_it || wants_it {
                    let path = sharing.path(slot);
                    self.light_path(iteration, path, worker, &mut tracer, None, (self.connects, splats_it));
                }
                for [x, y] in sharing.pixels(slot).filter(|pixel| eye_paths && contains(window, *pixel)) {
                    self.eye_path(iteration, (x, y), worker, &mut tracer, &mut found, None);
                }
            }
        }
        worker.direct.flush(&mut tracer, |f| found(Arrival::Direct, f));
        worker.connection.flush(&mut tracer, |f| found(Arrival::Connection, f));
        worker.found.extend(all);
        worker.finish(self, tracer)
    }
}

impl Integrator for Bidirectional {
    fn iterate(&mut self, iteration: &Iteration, film: &mut Film) -> RayStats {
        let scene = iteration.scene;
        self.begin(iteration);
        let mut harvest = Harvest::default();
        if self.resamples() {
            let (stats, pieces) = self.prepare_resampling(iteration);
            harvest.stats = stats;
            harvest.add(pieces);
        }
        let mut samples = std::mem::take(&mut self.samples);
        samples.resize_with(film.tiles.len(), SampleBuffer::default);
        let this = &*self;
        let tiles = film
            .tiles
            .par_iter()
            .zip(&mut samples)
            .with_max_len(1)
            .map_init(Worker::new, |worker, (tile, samples)| this.render_tile(iteration, tile, samples, worker));
        let mut phases = Phases::default();
        harvest.add(phases.time("sub-paths and connections", || tiles.collect()));

        let light_image = this.weigher.techniques.uses_light_image().then(|| {
            if !this.resamples() && scene.features.contains(Features::CROP) {
                let [width, height] = scene.film_size;
                let outside =
                    (0..height.div_ceil(sharing::SIDE)).into_par_iter().map_init(Worker::new, |worker, row| {
                        this.light_only(iteration, [0, row * sharing::SIDE, width, sharing::SIDE], worker)
                    });
                harvest.add(phases.time("light paths outside of the crop", || outside.collect()));
            }
            phases.time("light image", || LightImage::new(scene.window, std::mem::take(&mut harvest.splats)))
        });
        phases.time("film", || {
            film.tiles.par_iter_mut().zip(&samples).for_each(|(tile, samples)| {
                tile.commit(samples, light_image.as_ref(), iteration.index);
            });
        });
        harvest.stats.phases.merge(&phases);
        self.samples = samples;
        if self.resamples() {
            self.learn();
        }
        if let (Some(sizing), Some(every)) = (&mut self.sizing, self.every)
            && sizing.every(iteration.index, 1).is_some()
        {
            sizing.learn((film, scene.film_size), harvest.found.iter().flatten(), every, &harvest.stats);
        }
        if let Some(pyramid) = &mut self.pyramid {
            for f in harvest.found.iter().flatten() {
                pyramid.add((f.s.into(), f.t.into()), (f.x, f.y), f.raw, f.weight.own);
            }
            pyramid.iterations += 1;
        }
        harvest.stats
    }

    fn notes(&self) -> Vec<String> {
        let sites = self.resampler.as_ref().and_then(Resampler::note);
        sites.into_iter().chain(self.sizing.as_ref().and_then(Sizing::note)).collect()
    }

    fn keep_pyramid(&mut self, window: [u32; 4], max_edges: usize) -> bool {
        self.pyramid = Some(Pyramid::new(window, max_edges));
        true
    }

    fn pyramid(&self) -> Option<&Pyramid> {
        self.pyramid.as_ref()
    }

    fn state(&self) -> Vec<u8> {
        let sizing = self.sizing.as_ref().map_or(vec![], Sizing::state);
        let resampler = self.resampler.as_ref().map_or(vec![], Resampler::state);
        if sizing.is_empty() && resampler.is_empty() {
            return vec![];
        }
        let mut state = (sizing.len() as u64).to_le_bytes().to_vec();
        state.extend(sizing.into_iter().flat_map(f64::to_le_bytes));
        state.extend(resampler);
        state
    }

    fn restore(&mut self, iteration: &Iteration, state: &[u8]) -> bool {
        let Some((length, rest)) = state.split_first_chunk::<8>() else { return state.is_empty() };
        let Some(length) = usize::try_from(u64::from_le_bytes(*length)).ok().and_then(|n| n.checked_mul(8)) else {
            return false;
        };
        let Some((sizing, resampler)) = rest.split_at_checked(length) else { return false };
        let sums: Vec<f64> = sizing.as_chunks::<8>().0.iter().map(|c| f64::from_le_bytes(*c)).collect();
        let tiles = Film::new(iteration.scene.window).tiles.len();
        let sized = match &mut self.sizing {
            Some(own) => own.restore(&sums, tiles),
            None => sums.is_empty(),
        };
        sized && self.restore_resampling(iteration, resampler)
    }

    fn replay(&mut self, iteration: &Iteration, (x, y): (u32, u32)) -> Replay {
        let scene = iteration.scene;
        let missing = self.sizing.as_ref().map_or(0, |s| s.missing(iteration.index));
        if missing >= 2 {
            let mut film = Film::new(scene.window);
            for _ in 0..missing {
                let index = film.begin_iteration();
                self.iterate(&Iteration { index, ..*iteration }, &mut film);
            }
        }
        self.begin(iteration);
        self.prepare_replay(iteration);
        let (mut worker, mut tracer, mut replay) =
            (Worker::new(), Tracer::new(&*scene.query), Replay { pixel: (x, y), ..Replay::default() });
        let mut seen = vec![];
        let sharing = self.sharing(iteration);
        let slot = sharing.slot_of([x, y]);
        // The first sub-paths of all stand for those that candidates are drawn from.
        let (path, own) = if self.resamples() {
            let path = y * scene.film_size[0] + x;
            (path, self.weigher.techniques.light_paths() > path as f32)
        } else {
            (sharing.path(slot), sharing.owner(slot) == [x, y])
        };
        if (own || self.connects) && self.uses_light_paths() {
            let wanted = (self.connects, own);
            self.light_path(iteration, path, &mut worker, &mut tracer, Some(&mut replay), wanted);
            // One sub-path may fill a packet and more: what has been answered already is among the splats.
            seen.extend(worker.splats.drain(..).map(|s| s.note));
            worker.lens.flush(&mut tracer, |f| seen.push(f.note));
        }
        if self.weigher.techniques.uses_eye_paths() {
            let mut found = |_: Arrival, f: Found| seen.push(f.note);
            self.eye_path(iteration, (x, y), &mut worker, &mut tracer, &mut found, Some(&mut replay));
            worker.direct.flush(&mut tracer, |f| seen.push(f.note));
            worker.connection.flush(&mut tracer, |f| seen.push(f.note));
        }
        for note in seen {
            replay.contributions[note as usize].visible = true;
        }
        replay
    }
}
