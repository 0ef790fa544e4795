//! `path`: unidirectional path tracing with next-event estimation (Kajiya 1986; Veach 1997, §9 and §10.2).
//!
//! Two techniques make every path of k edges that ends on a light with extent. Seen from its last vertex x before the
//! light, *hit* draws the direction from the BSDF, with density p_bsdf · q (q: survival of Russian roulette at x) per
//! steradian, and *next event* draws a light with probability P(l | x) and a direction to it with density p_l per
//! steradian. Both weigh their paths by the heuristic over these two densities, so the weights of a path sum to one. A
//! hit walks through the holes of the masks between, so its density is τ p_bsdf · q (`ray::transmittance`).
//! Delta lights are reached by next event alone, and after a delta event or from the camera lights are hit alone, each
//! with weight one.

use super::params::shared::{HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_UNIDIRECTIONAL, heuristic};
use super::{Integrator, IntegratorSpec, Iteration, ParamDefault, Params};
use crate::bidir::endpoint::{
    DirectLight, DirectSampleSink, emitted_at, for_each_background, light_choice_normal, next_event_pdf, sample_direct,
};
use crate::bidir::replay::{ContributionRecord, Replay, SubpathKind};
use crate::emit::{DirectSample, LightId};
use crate::film::{ContributionKind, Film, FilmTile, SampleBuffer};
use crate::math::sampler::PathSampler;
use crate::math::{Pmf, Rgb, SolidAnglePdf, Vec3};
use crate::mis::Heuristic;
use crate::path::{
    Edge, PathLimits, ScatterSampler, SegmentFlight, ShadowQueue, Vertex, WalkHooks, WalkRules, WalkStart,
    direct_segment, segment_flight, streams, walk,
};
use crate::prepared::{Features, PreparedScene};
use crate::ray::{Phases, RayKind, RayStats, Tracer, Transmittance};
use crate::shade::Transport;
use rayon::prelude::*;

/// The registry's line.
pub static SPEC: IntegratorSpec = IntegratorSpec {
    name: "path",
    aliases: &["volpath", "volpathmis", "prb"],
    short: "Path tracing with next-event estimation",
    long: "Paths are traced from the camera. At every vertex a light is sampled, and the sample is combined with hits of lights \
        by multiple importance sampling. It is the simplest method and the best one where light is easy to reach from \
        what the camera sees.\n\n\
        Kajiya 1986, \"The rendering equation\"; Veach 1997, \"Robust Monte Carlo methods for light transport simulation\", \
        chapter 9 and section 10.2.",
    params: &[&[MAX_DEPTH, RR_DEPTH_UNIDIRECTIONAL, HIDE_EMITTERS, heuristic("power")]],
    unbiased: true,
    limitations: |features| {
        PathTracer::is_blind(features).then(|| {
            "light of point, spot and directional lights that comes by way of mirrors or through glass is missing: these \
            lights are found by connections alone, which mirrors and glass block"
                .into()
        })
    },
    build: |params| Box::new(PathTracer::new(params)),
};

/// Every n-th pixel of a tile is probed. The number has no common factor with a tile's side, so that rows differ.
const PROBE_STRIDE: u32 = 7;
/// Samples of each probed pixel.
const PROBE_SAMPLES: u64 = 4;

/// How well the path tracer does in a scene.
#[derive(Clone, Debug)]
pub struct PathProbe {
    /// For each tile of the film, the sum over its pixels of the variance of a sample, the mean of the channels.
    pub variances: Vec<f64>,
    /// Rays of one sample of every pixel.
    pub rays: f64,
    /// Rays of the probe itself.
    pub stats: RayStats,
}

/// The path tracer at work.
pub struct PathTracer {
    limits: PathLimits,
    hide_emitters: bool,
    heuristic: Heuristic,
}

impl PathTracer {
    fn new(params: &Params) -> PathTracer {
        let heuristic = if params.is("heuristic", "balance") { Heuristic::Balance } else { Heuristic::Power };
        PathTracer { heuristic, ..PathTracer::with_limits(params, params.int("rr_depth") as u32) }
    }

    /// The path tracer with its defaults, as far as the parameters of another method do not say otherwise.
    pub fn beside(params: &Params) -> PathTracer {
        let ParamDefault::Int { default, .. } = RR_DEPTH_UNIDIRECTIONAL.default else { unreachable!() };
        PathTracer::with_limits(params, default as u32)
    }

    fn with_limits(params: &Params, rr_depth: u32) -> PathTracer {
        let max_edges = u32::try_from(params.int("max_depth")).unwrap_or(u32::MAX);
        PathTracer {
            limits: PathLimits { max_edges, rr_depth, rr_scale: 1.0 },
            hide_emitters: params.bool("hide_emitters"),
            heuristic: Heuristic::Power,
        }
    }

    /// Light that no path of this method brings in a scene with these features: it meets a delta light only by next
    /// event, which mirrors and glass block.
    pub fn is_blind(features: Features) -> bool {
        features.contains(Features::DELTA_LIGHTS) && features.contains(Features::SPECULAR)
    }

    /// Samples some pixels of every tile a few times, by random numbers of their own.
    pub fn probe(&self, iteration: &Iteration) -> PathProbe {
        let mut film = Film::new(iteration.scene.window);
        let mut stats = RayStats::default();
        for _ in 0..PROBE_SAMPLES {
            let iteration = iteration.with_index(film.begin_iteration());
            stats.merge(&self.render(&iteration, &mut film, &PixelChoice::PROBE));
        }
        let (all, probed) = film
            .tiles
            .iter()
            .fold((0, 0), |(all, probed), tile| (all + tile.pixels(), probed + tile.pixels().div_ceil(PROBE_STRIDE)));
        let share = |tile: &FilmTile| f64::from(tile.pixels()) / f64::from(tile.pixels().div_ceil(PROBE_STRIDE));
        PathProbe {
            variances: film.tiles.iter().map(|t| t.sample_variance(PROBE_SAMPLES) * share(t)).collect(),
            rays: stats.rays_with_masks(&[RayKind::Camera, RayKind::Bounce, RayKind::ShadowDirect]) * f64::from(all)
                / (f64::from(probed) * PROBE_SAMPLES as f64),
            stats,
        }
    }

    /// One sample of a pixel, which is number `hooks.pixel` of its tile.
    fn sample(&self, iteration: &Iteration, stream: u64, pixel: (u32, u32), tracer: &mut Tracer, hooks: &mut Gather) {
        let index = iteration.pixel_index(pixel.0, pixel.1);
        let mut sampler = PathSampler::new(iteration.seed, stream, index, iteration.index);
        let start = WalkStart::from_camera(iteration, pixel, &mut sampler).walk;
        let rules = WalkRules { limits: self.limits, mode: Transport::Radiance, directions: &ScatterSampler };
        hooks.normal_before = None;
        walk(iteration.scene, start, &rules, tracer, &mut sampler, hooks);
    }

    fn render(&self, iteration: &Iteration, film: &mut Film, choice: &PixelChoice) -> RayStats {
        let mut phases = Phases::default();
        // A tile is much more work than handing it over, and larger pieces leave threads idle at the end of an
        // iteration.
        let tiles = film.tiles.par_iter_mut().with_max_len(1);
        let render = |samples: &mut SampleBuffer, tile| self.render_tile(iteration, choice, tile, samples);
        let tiles = tiles.map_init(SampleBuffer::default, render);
        let sum = |mut a: RayStats, b: RayStats| {
            a.merge(&b);
            a
        };
        let stats = phases.time("eye paths and film", || tiles.reduce(RayStats::default, sum));
        RayStats { phases, ..stats }
    }

    fn render_tile(
        &self,
        iteration: &Iteration,
        choice: &PixelChoice,
        tile: &mut FilmTile,
        samples: &mut SampleBuffer,
    ) -> RayStats {
        let scene = iteration.scene;
        let mut tracer = iteration.tracer();
        let mut queue = ShadowQueue::new(RayKind::ShadowDirect);
        samples.clear(tile.pixels());
        let mut hooks = Gather::new(self, scene, samples, &mut queue);
        for pixel in (0..tile.pixels()).step_by(choice.stride) {
            hooks.pixel = pixel;
            self.sample(iteration, choice.stream, tile.pixel(pixel), &mut tracer, &mut hooks);
        }
        queue.flush(&mut tracer, |light, transmittance| {
            light.through(transmittance, self.heuristic).arrive(samples, None);
        });
        tile.commit(samples, None, iteration.index);
        tracer.stats
    }
}

/// Which pixels of a tile are sampled, and by which random numbers.
struct PixelChoice {
    stride: usize,
    stream: u64,
}

impl PixelChoice {
    const ALL: PixelChoice = PixelChoice { stride: 1, stream: streams::PATH };
    const PROBE: PixelChoice = PixelChoice { stride: PROBE_STRIDE as usize, stream: streams::PATH_PROBE };
}

/// The payload of a shadow ray.
#[derive(Clone, Copy, Default)]
struct QueuedLight {
    /// Pixel of the tile.
    pixel: u32,
    /// Number of the contribution in a replay.
    replay_index: u32,
    /// Estimate of the technique by itself.
    raw: Rgb,
    weight: f32,
}

impl QueuedLight {
    /// The light behind the masks on the segment.
    #[inline]
    fn through(self, transmittance: Transmittance, heuristic: Heuristic) -> QueuedLight {
        let weight = heuristic.weight_through(self.weight, transmittance);
        QueuedLight { raw: self.raw * transmittance, weight, ..self }
    }

    /// The light that passes the media on the segment, and the masks beside them.
    #[inline]
    fn along(self, flight: &SegmentFlight, heuristic: Heuristic) -> QueuedLight {
        let weight = heuristic.weight_through(self.weight, flight.transmittance);
        QueuedLight { raw: self.raw * flight.light, weight, ..self }
    }

    /// Nothing blocked the ray.
    #[inline]
    fn arrive(self, samples: &mut SampleBuffer, replay: Option<&mut Replay>) {
        let QueuedLight { pixel, replay_index, raw, weight } = self;
        samples.add(ContributionKind::NextEvent, pixel, raw * weight);
        if let Some(replay) = replay {
            let contribution = &mut replay.contributions[replay_index as usize];
            (contribution.raw, contribution.weight, contribution.visible) = (raw, weight, true);
        }
    }
}

impl Integrator for PathTracer {
    fn iterate(&mut self, iteration: &Iteration, film: &mut Film) -> RayStats {
        self.render(iteration, film, &PixelChoice::ALL)
    }

    fn replay(&mut self, iteration: &Iteration, pixel: (u32, u32)) -> Replay {
        let (mut replay, mut samples) = (Replay { pixel, ..Replay::default() }, SampleBuffer::default());
        samples.clear(1);
        let (mut tracer, mut queue) = (iteration.tracer(), ShadowQueue::new(RayKind::ShadowDirect));
        let mut hooks = Gather::new(self, iteration.scene, &mut samples, &mut queue);
        hooks.replay = Some(&mut replay);
        self.sample(iteration, streams::PATH, pixel, &mut tracer, &mut hooks);
        queue.flush(&mut tracer, |light, transmittance| {
            light.through(transmittance, self.heuristic).arrive(&mut samples, Some(&mut replay));
        });
        replay
    }
}

/// Gathers light along one eye walk.
struct Gather<'a> {
    rules: &'a PathTracer,
    scene: &'a PreparedScene,
    pixel: u32,
    /// The light choice normal of the vertex before.
    normal_before: Option<Vec3>,
    samples: &'a mut SampleBuffer,
    queue: &'a mut ShadowQueue<QueuedLight>,
    replay: Option<&'a mut Replay>,
}

/// A hit of a light.
struct EmitterHit<'a> {
    light: LightId,
    /// Number of the vertex on the light.
    index: u32,
    /// Unit direction from the vertex before to the light.
    direction: Vec3,
    /// Unit normal of the light there; zero at infinity.
    ng: Vec3,
    /// Throughput times emitted radiance.
    raw: Rgb,
    edge: &'a Edge,
}

impl<'a> Gather<'a> {
    fn new(
        rules: &'a PathTracer,
        scene: &'a PreparedScene,
        samples: &'a mut SampleBuffer,
        queue: &'a mut ShadowQueue<QueuedLight>,
    ) -> Gather<'a> {
        Gather { rules, scene, pixel: 0, normal_before: None, samples, queue, replay: None }
    }

    fn hidden(&self, index: u32) -> bool {
        index == 1 && self.rules.hide_emitters
    }

    /// Queues the light of `sample`, which was drawn from a light of probability `pmf`.
    #[inline(always)]
    fn next_event(&mut self, vertex: &Vertex, sample: &DirectSample, pmf: Pmf, tracer: &mut Tracer) {
        let Some(direct) = DirectLight::new(vertex, &ScatterSampler, sample, pmf) else { return };
        let weight = if sample.delta {
            1.0
        } else {
            let survival = self.rules.limits.survival(vertex.index, &vertex.scatter);
            self.rules.heuristic.weight(direct.pdf, SolidAnglePdf(direct.scatter_pdf.0 * survival))
        };
        // A black contribution needs no ray; one that is not finite goes on to the film, which reports it.
        if (direct.raw * weight).is_black() {
            return;
        }
        let segment = direct_segment(&vertex.place.segment_end(), sample);
        let Some(flight) = segment_flight(self.scene, &segment, vertex.medium_towards(sample.wi), tracer) else {
            return;
        };
        let replay_index = self.record((1, vertex.index as usize + 1), direct.raw, weight, false);
        let queued = QueuedLight { pixel: self.pixel, replay_index, raw: direct.raw, weight };
        let queued = if flight.is_free() { queued } else { queued.along(&flight, self.rules.heuristic) };
        let (samples, replay, heuristic) = (&mut *self.samples, &mut self.replay, self.rules.heuristic);
        self.queue.push(&segment, queued, tracer, |light, transmittance| {
            light.through(transmittance, heuristic).arrive(samples, replay.as_deref_mut());
        });
    }

    /// Adds the emission of the surface that `vertex` is on.
    #[inline]
    fn emission(&mut self, vertex: &Vertex) {
        if !self.hidden(vertex.index)
            && let Some((light, emitted)) = emitted_at(self.scene, vertex)
        {
            let (direction, raw, ng) = (-vertex.wo, vertex.throughput * emitted, vertex.place.normal());
            self.hit(&EmitterHit { light, index: vertex.index, direction, ng, raw, edge: vertex.edge });
        }
    }

    /// Adds the light of a hit.
    #[inline]
    fn hit(&mut self, hit: &EmitterHit) {
        let EmitterHit { light, index, direction, ng, raw, edge } = *hit;
        // No other technique finds what the camera sees, or what follows a delta event.
        let weight = if index == 1 || edge.delta {
            1.0
        } else {
            let next_event = next_event_pdf(self.scene, light, edge, self.normal_before, ng, direction);
            let walked = SolidAnglePdf(edge.pdf_with_survival().0 * edge.transmittance.share());
            self.rules.heuristic.weight(walked, next_event)
        };
        self.record((0, index as usize + 1), raw, weight, true);
        self.samples.add(ContributionKind::Hit, self.pixel, raw * weight);
    }

    /// Writes a contribution down in a replay; returns its number.
    #[inline]
    fn record(&mut self, technique: (usize, usize), raw: Rgb, weight: f32, visible: bool) -> u32 {
        match &mut self.replay {
            None => 0,
            Some(replay) => {
                let contribution = ContributionRecord::new(technique, replay.pixel, raw, weight);
                replay.contributions.push(ContributionRecord { visible, ..contribution });
                replay.contributions.len() as u32 - 1
            }
        }
    }
}

/// Next event at a vertex.
struct NextEvent<'a, 'g, 't> {
    gather: &'a mut Gather<'g>,
    vertex: &'a Vertex<'a>,
    tracer: &'a mut Tracer<'t>,
}

impl DirectSampleSink for NextEvent<'_, '_, '_> {
    #[inline(always)]
    fn accept(&mut self, _id: LightId, pmf: Pmf, sample: &DirectSample) {
        self.gather.next_event(self.vertex, sample, pmf, self.tracer);
    }
}

impl WalkHooks for Gather<'_> {
    // Walks with and without media are two places that call it.
    #[inline(always)]
    fn vertex(&mut self, vertex: &Vertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool {
        let (scene, index) = (self.scene, vertex.index);
        if let Some(replay) = &mut self.replay {
            replay.vertex(SubpathKind::Eye, scene, vertex);
        }
        self.emission(vertex);
        if vertex.scatter.is_black() {
            return false;
        }
        let normal = light_choice_normal(scene, vertex);
        self.normal_before = normal;
        if index < self.rules.limits.max_edges && vertex.scatter.connectable() {
            sample_direct(scene, vertex, normal, sampler, &mut NextEvent { gather: self, vertex, tracer });
        }
        true
    }

    fn passing(&mut self, vertex: &Vertex) {
        self.emission(vertex);
    }

    fn escaped(&mut self, index: u32, direction: Vec3, throughput: Rgb, edge: &Edge) {
        if self.hidden(index) {
            return;
        }
        for_each_background(self.scene, direction, |light, emitted| {
            let raw = throughput * emitted;
            self.hit(&EmitterHit { light, index, direction, ng: Vec3::ZERO, raw, edge });
        });
    }
}
