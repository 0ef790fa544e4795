//! The engine of bidirectional methods: the passes of an iteration, saved states, and replays.

use super::allocation::{AllocationOptimizer, ProbedEfficiency, ProbedIteration, SavedAllocation};
use super::assignment::{BLOCK_SIDE, contains};
use super::emission_training::TrainingPaths;
use super::eye_subpath::{EyeHooks, EyeSubpathRules};
use super::light_pass::{LightPathPurpose, light_sampler};
use super::light_subpath::{LightSubpath, LightSubpathUse};
use super::replay::Replay;
use super::scratch::{ContributionSink, PassOutput, ProbeStride, ThreadScratch, TileOutput, TileSink};
use super::store::VertexStore;
use super::strategy::{ConnectionStrategy, LightSubpaths};
use super::warm_up::WarmUp;
use crate::emit::EmissionDistribution;
use crate::film::{Film, FilmTile, LightImage, Pyramid, SampleBuffer, tile_count};
use crate::math::sampler::PathSampler;
use crate::mis::{Heuristic, MisContext, SampleAllocation, Techniques};
use crate::path::{Iteration, Origin, PathLimits, ScatterSampler, WalkRules, WalkStart, streams, walk};
use crate::prepared::Features;
use crate::ray::{Phases, RayStats, Tracer};
use crate::shade::Transport;
use rayon::prelude::*;

/// Settings of a bidirectional method.
#[derive(Clone, Debug)]
pub struct BidirSettings {
    /// Techniques that are used.
    pub techniques: Techniques,
    /// How techniques share a path.
    pub heuristic: Heuristic,
    /// Limits of eye sub-paths.
    pub eye_limits: PathLimits,
    /// Limits of light sub-paths, with the same `rr_depth`.
    pub light_limits: PathLimits,
    /// Emitters that the camera sees directly are black.
    pub hide_emitters: bool,
    /// The rays of lights at infinity are guided.
    pub guided_emission: bool,
}

/// A bidirectional method at work.
pub struct Bidirectional<S: ConnectionStrategy> {
    pub(super) hide_emitters: bool,
    pub(super) mis: MisContext<S::Factor>,
    /// Eye sub-paths end where no technique uses more of their vertices.
    max_eye_vertices: usize,
    pub(super) strategy: S,
    store: VertexStore,
    /// The rays of lights at infinity are to be guided, and the guide has not been trained yet.
    train_emission: bool,
    /// The strategy has placed its cache points.
    placed: bool,
    /// How many samples of each group of techniques this iteration takes.
    pub(super) allocation: SampleAllocation,
    /// The allocation of all iterations, unless it is decided by the scene.
    fixed_allocation: SampleAllocation,
    optimizer: Option<AllocationOptimizer>,
    /// Which sub-paths are probed in this iteration.
    pub(super) probe_stride: ProbeStride,
    /// One for each tile of the film, kept for their memory.
    samples: Vec<SampleBuffer>,
    pyramid: Option<Pyramid>,
    /// Seed and number of the iteration that is ready to be replayed.
    ready_to_replay: Option<(u64, u64)>,
}

/// A saved state.
#[derive(serde::Serialize, serde::Deserialize)]
struct SavedState<A> {
    allocation: Option<A>,
    strategy: Vec<u8>,
}

impl<S: ConnectionStrategy> Bidirectional<S> {
    /// A method with the given strategy, at full allocation.
    pub fn new(settings: BidirSettings, strategy: S) -> Bidirectional<S> {
        let BidirSettings { techniques, heuristic, eye_limits, light_limits, hide_emitters, guided_emission } =
            settings;
        Bidirectional {
            hide_emitters,
            max_eye_vertices: techniques.most_eye_vertices(),
            mis: MisContext {
                techniques,
                heuristic,
                eye_limits,
                light_limits,
                emission: EmissionDistribution::default(),
                directions: ScatterSampler,
                factor: strategy.factor(),
            },
            strategy,
            store: VertexStore::default(),
            train_emission: guided_emission,
            placed: false,
            allocation: SampleAllocation::FULL,
            fixed_allocation: SampleAllocation::FULL,
            optimizer: None,
            probe_stride: ProbeStride(None),
            samples: vec![],
            pyramid: None,
            ready_to_replay: None,
        }
    }

    /// Takes numbers of samples as `allocation` says.
    #[must_use]
    pub fn with_allocation(self, allocation: SampleAllocation) -> Bidirectional<S> {
        Bidirectional { fixed_allocation: allocation, ..self }
    }

    /// Decides numbers of samples by the scene, if there is an optimizer.
    #[must_use]
    pub fn with_optimizer(self, optimizer: Option<AllocationOptimizer>) -> Bidirectional<S> {
        Bidirectional { optimizer, ..self }
    }

    /// Eye vertices are connected to light sub-paths.
    fn connects(&self) -> bool {
        self.mis.techniques.uses_connections()
    }

    /// Light sub-paths are traced before all eye sub-paths.
    fn shares_light_paths(&self) -> bool {
        matches!(self.strategy.light_subpaths(), LightSubpaths::Shared { .. })
    }

    /// Stored light sub-paths are drawn from.
    fn draws_stored(&self) -> bool {
        self.shares_light_paths() && self.connects() && self.mis.eye_limits.max_edges >= 3
    }

    /// Settles the numbers of samples of an iteration.
    fn begin(&mut self, iteration: &Iteration) {
        let (scene, index) = (iteration.scene, iteration.index);
        self.allocation = self.optimizer.as_ref().map_or(self.fixed_allocation, |o| o.allocation(index));
        let pixels = scene.film_size[0] * scene.film_size[1];
        self.probe_stride = ProbeStride(match &self.pyramid {
            Some(_) => Some(1),
            None => self.optimizer.as_ref().and_then(|o| o.probe_stride(index, pixels)),
        });
        let light_paths = self.light_paths(iteration);
        self.mis.techniques.set_light_paths(light_paths);
        self.ask_strategy();
    }

    /// Takes over the strategy's number of samples and its connection factor.
    fn ask_strategy(&mut self) {
        self.mis.techniques.set_connections(self.strategy.samples() * self.allocation.connections);
        self.mis.factor = self.strategy.factor();
    }

    /// Access of warm-ups to the scene, the seed, the limits and the distribution of emission.
    fn warm_up<'a>(mis: &'a MisContext<S::Factor>, iteration: &Iteration<'a>) -> WarmUp<'a> {
        let MisContext { eye_limits, light_limits, ref emission, .. } = *mis;
        WarmUp { iteration: iteration.with_index(0), eye_limits, light_limits, emission }
    }

    /// Guides the rays of lights, once; the guide is a function of scene, seed and longest path alone.
    fn train_emission(&mut self, iteration: &Iteration) -> RayStats {
        if !std::mem::take(&mut self.train_emission) || !self.mis.techniques.uses_light_paths() {
            return RayStats::default();
        }
        let paths = match self.mis.techniques.uses_eye_paths() {
            true => TrainingPaths::Indirect,
            false => TrainingPaths::Scattered,
        };
        let mut phases = Phases::default();
        let warm_up = Self::warm_up(&self.mis, iteration);
        let (emission, mut stats) = phases.time("guided emission", || warm_up.train_emission(paths));
        self.mis.emission = emission;
        stats.phases.merge(&phases);
        stats
    }

    /// Takes over the guide of another method for the same scene, seed and longest path, which is what this one would
    /// train.
    pub fn share_emission<T: ConnectionStrategy>(&mut self, other: &Bidirectional<T>) {
        if self.train_emission && !other.train_emission {
            self.mis.emission = other.mis.emission.clone();
            self.train_emission = false;
        }
    }

    /// Lets the strategy place its cache points, once; they are functions of scene and seed alone.
    fn place(&mut self, iteration: &Iteration) -> RayStats {
        if self.placed || !self.draws_stored() {
            return RayStats::default();
        }
        self.placed = true;
        self.strategy.place(&Self::warm_up(&self.mis, iteration))
    }

    /// Traces the light sub-paths that all eye sub-paths share, connects them to the lens, and finds the pmfs of their
    /// vertices.
    fn shared_light_pass(&mut self, iteration: &Iteration) -> PassOutput {
        let (mut output, mut phases) = (PassOutput::default(), Phases::default());
        output.stats = phases.time("placing caches", || self.place(iteration));
        // The strategy may have decided the number of light sub-paths when it placed its cache points.
        let (count, tree) = match self.strategy.light_subpaths() {
            LightSubpaths::Shared { count, tree } if self.draws_stored() => (count, tree),
            _ => (0, false),
        };
        self.ask_strategy();
        let mut store = std::mem::take(&mut self.store);
        output.add(phases.time("light paths", || self.light_pass(iteration, count, &mut store)));
        phases.time("light tree", || store.finish(count, tree));
        self.store = store;
        if count > 0 {
            let stats = phases.time("pmfs", || self.strategy.prepare(iteration, &self.store));
            output.stats.merge(&stats);
        }
        output.stats.phases.merge(&phases);
        output
    }

    /// The rules of the iteration's eye sub-paths.
    fn eye_rules<'a>(
        &'a self,
        iteration: &'a Iteration<'a>,
        retrace: &'a (dyn Fn(u32, &mut Replay) -> Option<Origin> + Sync),
    ) -> EyeSubpathRules<'a, S> {
        EyeSubpathRules {
            iteration,
            mis: &self.mis,
            strategy: &self.strategy,
            store: &self.store,
            connection_fraction: self.allocation.connections,
            max_eye_vertices: self.max_eye_vertices,
            hide_emitters: self.hide_emitters,
            retrace,
        }
    }

    /// One eye sub-path, connected to the light sub-path in the scratch memory or to stored ones.
    fn eye_path(
        &self,
        rules: &EyeSubpathRules<S>,
        pixel: (u32, u32),
        scratch: &mut ThreadScratch<S::Factor>,
        tracer: &mut Tracer,
        sink: &mut impl ContributionSink,
        replay: Option<&mut Replay>,
    ) {
        let iteration = rules.iteration;
        let index = iteration.pixel_index(pixel.0, pixel.1);
        let mut sampler = PathSampler::new(iteration.seed, streams::EYE, index, iteration.index);
        let start = WalkStart::from_camera(iteration, pixel, &mut sampler);
        scratch.eye.begin(start.lens_pdf);
        let mut hooks = EyeHooks {
            rules,
            light: &scratch.light,
            pdfs: &mut scratch.eye,
            pixel,
            lens: start.walk.ray.o,
            lookups: [None; 2],
            lookup_before: S::Lookup::default(),
            normal_before: None,
            queues: &mut scratch.queues,
            sink,
            replay,
        };
        let walk_rules =
            WalkRules { limits: self.mis.eye_limits, mode: Transport::Radiance, directions: &self.mis.directions };
        walk(iteration.scene, start.walk, &walk_rules, tracer, &mut sampler, &mut hooks);
    }

    /// The eye sub-paths of a tile, and light sub-paths of its pixels where these have their own.
    fn render_tile(
        &self,
        iteration: &Iteration,
        tile: &FilmTile,
        samples: &mut SampleBuffer,
        scratch: &mut ThreadScratch<S::Factor>,
    ) -> TileOutput {
        let mut tracer = iteration.tracer();
        samples.clear(tile.pixels());
        let (film_width, stride) = (iteration.scene.film_size[0], self.probe_stride);
        let mut sink = TileSink { samples, tile, film_width, stride, probed: vec![] };
        let rules = self.eye_rules(iteration, &|_, _| None);
        let eye_paths = self.mis.techniques.uses_eye_paths();
        if self.shares_light_paths() || !self.mis.techniques.uses_light_paths() {
            for pixel in (0..tile.pixels()).filter(|_| eye_paths) {
                self.eye_path(&rules, tile.pixel(pixel), scratch, &mut tracer, &mut sink, None);
            }
        } else {
            let window = [tile.x0, tile.y0, tile.width, tile.height];
            let assignment = self.assignment(iteration);
            for slot in assignment.slots_in(window) {
                let splats = contains(window, assignment.home_pixel(slot));
                let keep_vertices = self.connects();
                let is_used = keep_vertices && assignment.pixels(slot).any(|pixel| contains(window, pixel));
                if splats || is_used {
                    let purpose = LightPathPurpose { number: assignment.path(slot), keep_vertices, splats };
                    self.light_path(iteration, scratch, &mut tracer, purpose);
                }
                for [x, y] in assignment.pixels(slot).filter(|pixel| eye_paths && contains(window, *pixel)) {
                    self.eye_path(&rules, (x, y), scratch, &mut tracer, &mut sink, None);
                }
            }
        }
        scratch.queues.flush(&mut tracer, &mut sink);
        let probed = sink.probed;
        scratch.finish(tracer, probed)
    }

    /// Renders one iteration into the film.
    pub fn iterate(&mut self, iteration: &Iteration, film: &mut Film) -> RayStats {
        let scene = iteration.scene;
        let training = self.train_emission(iteration);
        self.begin(iteration);
        let mut output = match self.shares_light_paths() {
            true => self.shared_light_pass(iteration),
            false => PassOutput::default(),
        };
        let mut samples = std::mem::take(&mut self.samples);
        samples.resize_with(film.tiles.len(), SampleBuffer::default);
        let this = &*self;
        let scratch = || ThreadScratch::new(this.probe_stride, this.mis.heuristic);
        let mut phases = Phases::default();
        let tiles = film
            .tiles
            .par_iter()
            .zip(&mut samples)
            .with_max_len(1)
            .map_init(scratch, |scratch, (tile, samples)| this.render_tile(iteration, tile, samples, scratch));
        output.add(phases.time("sub-paths and connections", || tiles.collect()));
        let light_image = this.mis.techniques.uses_light_image().then(|| {
            if !this.shares_light_paths() && scene.features.contains(Features::CROP) {
                output.add(phases.time("light paths outside of the crop", || this.splats_outside(iteration)));
            }
            let splats = std::mem::take(&mut output.splats);
            phases.time("light image", || LightImage::new(scene.window, splats))
        });
        phases.time("film", || {
            film.tiles.par_iter_mut().zip(&samples).for_each(|(tile, samples)| {
                tile.commit(samples, light_image.as_ref(), iteration.index);
            });
        });
        output.stats.phases.merge(&phases);
        self.samples = samples;
        self.learn(iteration, film, &output);
        // Later iterations do not train again: their costs are predicted without it.
        output.stats.merge(&training);
        output.stats
    }

    /// Splats of the light sub-paths whose home pixels are outside of the crop window.
    fn splats_outside(&self, iteration: &Iteration) -> Vec<TileOutput> {
        let [width, height] = iteration.scene.film_size;
        let rows = (0..height.div_ceil(BLOCK_SIDE)).into_par_iter();
        rows.map_init(
            || ThreadScratch::new(self.probe_stride, self.mis.heuristic),
            |scratch, row| self.outside_splats(iteration, [0, row * BLOCK_SIDE, width, BLOCK_SIDE], scratch),
        )
        .collect()
    }

    /// The iteration is over: its findings may change later ones.
    fn learn(&mut self, iteration: &Iteration, film: &Film, output: &PassOutput) {
        if self.draws_stored() {
            self.strategy.learn(&self.store);
        }
        let [width, height] = iteration.scene.film_size.map(|n| n as f32);
        let stored_fraction = match self.strategy.light_subpaths() {
            LightSubpaths::Shared { count, .. } => count as f32 / (width * height),
            LightSubpaths::OfPixel => 0.0,
        };
        if let (Some(optimizer), ProbeStride(Some(stride))) = (&mut self.optimizer, self.probe_stride)
            && optimizer.probe_stride(iteration.index, 1).is_some()
        {
            optimizer.learn(&ProbedIteration {
                film,
                iterations: film.iterations(),
                film_size: iteration.scene.film_size,
                contributions: &output.probed,
                stride,
                stats: &output.stats,
                stored_fraction,
            });
        }
        if let Some(pyramid) = &mut self.pyramid {
            for c in output.probed.iter().flatten() {
                pyramid.add((c.s.into(), c.t.into()), (c.x, c.y), c.raw, c.weight.own);
            }
            pyramid.iterations += 1;
        }
    }

    /// Error and cost of later iterations as the first ones predict them, once after the allocation was decided.
    pub fn take_efficiency(&mut self) -> Option<ProbedEfficiency> {
        self.optimizer.as_mut().and_then(AllocationOptimizer::take_efficiency)
    }

    /// Iterations that must be rendered, in order, before iteration `index` can be replayed.
    pub fn missing_before(&self, index: u64) -> u64 {
        self.optimizer.as_ref().map_or(0, |o| o.missing(index))
    }

    /// Sentences about what was built and decided.
    pub fn notes(&self) -> Vec<String> {
        let optimizer = self.optimizer.as_ref().and_then(AllocationOptimizer::note);
        self.strategy.note().into_iter().chain(optimizer).collect()
    }

    /// Adds the picture of every technique to `pyramid`.
    pub fn keep_pyramid(&mut self, pyramid: Pyramid) {
        self.pyramid = Some(pyramid);
    }

    /// The pictures of all techniques.
    pub fn pyramid(&self) -> Option<&Pyramid> {
        self.pyramid.as_ref()
    }

    /// The state that must be saved to go on later, serialised.
    pub fn save(&self) -> Vec<u8> {
        let allocation = self.optimizer.as_ref().map(AllocationOptimizer::save);
        let strategy = self.strategy.save();
        if allocation.is_none() && strategy.is_empty() {
            return vec![];
        }
        postcard::to_allocvec(&SavedState { allocation, strategy }).unwrap_or_default()
    }

    /// Goes on from a saved state of the same scene, seed and settings; false if it is of something else.
    pub fn restore(&mut self, iteration: &Iteration, state: &[u8]) -> bool {
        if state.is_empty() {
            return true;
        }
        let Ok(saved) = postcard::from_bytes::<SavedState<SavedAllocation>>(state) else { return false };
        self.train_emission(iteration);
        // Rays that place cache points belong to the first iteration, whose costs are known already.
        self.place(iteration);
        let allocated = match (&mut self.optimizer, saved.allocation) {
            (Some(optimizer), Some(own)) => optimizer.restore(own, tile_count(iteration.scene.window)),
            (None, None) => true,
            _ => false,
        };
        allocated && self.strategy.restore(&saved.strategy)
    }

    /// Gets the stored light vertices of an iteration ready as they were when it was rendered; once for any number of
    /// pixels.
    fn prepare_replay(&mut self, iteration: &Iteration) {
        let wanted = (iteration.seed, iteration.index);
        if self.ready_to_replay == Some(wanted) || !self.draws_stored() {
            return;
        }
        self.strategy.reset();
        self.placed = false;
        // An iteration knows the findings of those before it.
        for index in 0..iteration.index {
            self.shared_light_pass(&iteration.with_index(index));
            self.strategy.learn(&self.store);
        }
        self.shared_light_pass(iteration);
        self.ready_to_replay = Some(wanted);
    }

    /// Runs the sample of one pixel again and writes it down.
    pub fn replay(&mut self, iteration: &Iteration, pixel: (u32, u32)) -> Replay {
        let scene = iteration.scene;
        let missing = self.missing_before(iteration.index);
        if missing >= 2 {
            let mut film = Film::new(scene.window);
            for _ in 0..missing {
                let index = film.begin_iteration();
                self.iterate(&iteration.with_index(index), &mut film);
            }
        }
        self.train_emission(iteration);
        self.begin(iteration);
        self.prepare_replay(iteration);
        let (mut scratch, mut tracer) = (ThreadScratch::new(ProbeStride(None), self.mis.heuristic), iteration.tracer());
        let mut replay = Replay { pixel, ..Replay::default() };
        let mut visible = self.replay_light_path(iteration, &mut scratch, &mut tracer, &mut replay);
        if self.mis.techniques.uses_eye_paths() {
            let retrace = |number: u32, replay: &mut Replay| self.retrace(iteration, number, replay);
            let rules = self.eye_rules(iteration, &retrace);
            self.eye_path(&rules, pixel, &mut scratch, &mut tracer, &mut visible, Some(&mut replay));
            scratch.queues.flush(&mut tracer, &mut visible);
        }
        for number in visible {
            replay.contributions[number as usize].visible = true;
        }
        replay
    }

    /// Replays the light sub-path of the replay's pixel; returns the numbers of its visible splats.
    fn replay_light_path(
        &self,
        iteration: &Iteration,
        scratch: &mut ThreadScratch<S::Factor>,
        tracer: &mut Tracer,
        replay: &mut Replay,
    ) -> Vec<u32> {
        let (x, y) = replay.pixel;
        // Where eye vertices draw from stored sub-paths, the first of these stand for those of the pixels.
        let (number, splats, keep_vertices) = match self.shares_light_paths() {
            true => {
                let number = iteration.pixel_index(x, y) as u32;
                (number, self.mis.techniques.light_paths() > number as f32, false)
            }
            false => {
                let assignment = self.assignment(iteration);
                let slot = assignment.slot_of([x, y]);
                (assignment.path(slot), assignment.home_pixel(slot) == [x, y], self.connects())
            }
        };
        let splats = splats && self.mis.techniques.uses_light_image();
        if !splats && !keep_vertices {
            return vec![];
        }
        let ThreadScratch { light, splats: queue, .. } = scratch;
        let purpose = LightSubpathUse { number, splats: splats.then_some(queue), keep_vertices, replay: Some(replay) };
        self.light_rules(iteration).trace(&mut light_sampler(iteration, number), tracer, light, purpose);
        scratch.splats.flush(tracer);
        scratch.splats.splats.drain(..).map(|splat| splat.replay_index).collect()
    }

    /// Writes down the vertices of the stored light sub-path `number`, and returns its origin.
    fn retrace(&self, iteration: &Iteration, number: u32, replay: &mut Replay) -> Option<Origin> {
        let (mut path, mut retraced) = (LightSubpath::default(), Replay::default());
        let purpose = LightSubpathUse { keep_vertices: true, replay: Some(&mut retraced), ..Default::default() };
        let mut sampler = light_sampler(iteration, number);
        self.light_rules(iteration).trace(&mut sampler, &mut iteration.tracer(), &mut path, purpose);
        replay.light = retraced.light;
        path.origin
    }
}
