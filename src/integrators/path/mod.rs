//! `path`: unidirectional path tracing with next-event estimation (Kajiya 1986; Veach 1997, §9 and §10.2).
//!
//! Two techniques make every path of k edges that ends on a light with extent. Seen from its last vertex x before the light, *hit* draws
//! the direction from the BSDF, with density p_bsdf · q (q: survival of Russian roulette at x) per steradian, and *next event* draws a light
//! with probability P(l | x) and a direction to it with density p_l per steradian. Both weigh their paths by the heuristic
//! over these two densities, so the weights of a path sum to one. Delta lights are reached by next event alone, and what follows a
//! delta lobe by hits alone, each with weight one.

use super::params::shared::{HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_UNIDIRECTIONAL, heuristic};
use super::replay::{Contribution, Replay};
use super::{Integrator, IntegratorSpec, Iteration, Params};
use crate::emit::{DirectSample, Light};
use crate::film::{Film, FilmTile, Part, SampleBuffer};
use crate::math::sampler::{PathSampler, Purpose};
use crate::math::{Pmf, Rgb, SolidAnglePdf, Vec3};
use crate::mis::Heuristic;
use crate::path::{Edge, Limits, ShadowQueue, SurfaceVertex, WalkHooks, WalkStart, direct_segment, walk};
use crate::prepared::PreparedScene;
use crate::ray::{Phases, Ray, RayKind, RayStats, Tracer};
use crate::shade::Transport;
use rayon::prelude::*;

/// The registry's line.
pub static SPEC: IntegratorSpec = IntegratorSpec {
    name: "path",
    aliases: &["volpath", "volpathmis", "prb"],
    short: "Path tracing with next-event estimation",
    long: "Paths are traced from the camera. At every vertex a light is sampled, and the sample is combined with \
        hits of lights by multiple importance sampling. It is the simplest method and the best one where light is \
        easy to reach from what the camera sees.\n\n\
        Kajiya 1986, \"The rendering equation\"; Veach 1997, \"Robust Monte Carlo methods for light transport \
        simulation\", chapter 9 and section 10.2.",
    params: &[&[MAX_DEPTH, RR_DEPTH_UNIDIRECTIONAL, HIDE_EMITTERS, heuristic("power")]],
    unbiased: true,
    limitations: |_| None,
    build: |params| Box::new(PathTracer::new(params)),
};

/// The random stream of eye sub-paths.
const EYE_STREAM: u64 = 1;

struct PathTracer {
    limits: Limits,
    hide_emitters: bool,
    heuristic: Heuristic,
}

impl PathTracer {
    fn new(params: &Params) -> PathTracer {
        PathTracer {
            limits: Limits {
                max_edges: u32::try_from(params.int("max_depth")).unwrap_or(u32::MAX),
                roulette_from: params.int("rr_depth") as u32,
                keep: 1.0,
            },
            hide_emitters: params.bool("hide_emitters"),
            heuristic: if params.choice("heuristic") == "balance" { Heuristic::Balance } else { Heuristic::Power },
        }
    }

    /// One sample of the pixel (x, y), which is number `hooks.pixel` of its tile.
    fn sample(&self, iteration: &Iteration, (x, y): (u32, u32), tracer: &mut Tracer, hooks: &mut Gather) {
        let scene = iteration.scene;
        let index = u64::from(y) * u64::from(scene.film_size[0]) + u64::from(x);
        let mut sampler = PathSampler::new(iteration.seed, EYE_STREAM, index, iteration.index);
        let u = sampler.origin();
        let (offset, weight) = scene.filter.sample([u[0], u[1]]);
        let raster = [x as f32 + 0.5 + offset[0], y as f32 + 0.5 + offset[1]];
        let eye = scene.camera.sample_ray(raster, [u[2], u[3]]);
        let start = WalkStart {
            ray: Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far },
            throughput: Rgb::grey(weight),
            pdf: SolidAnglePdf(1.0),
            delta: true,
            kind: RayKind::Camera,
        };
        walk(scene, start, &self.limits, Transport::Radiance, tracer, &mut sampler, hooks);
    }

    fn render_tile(&self, iteration: &Iteration, tile: &mut FilmTile, samples: &mut SampleBuffer) -> RayStats {
        let scene = iteration.scene;
        let mut tracer = Tracer::new(&*scene.query);
        let mut queue = ShadowQueue::new(RayKind::ShadowDirect);
        samples.clear(tile.pixels());
        let mut hooks = Gather { tracer: self, scene, pixel: 0, samples, queue: &mut queue, record: None };
        for pixel in 0..tile.pixels() {
            hooks.pixel = pixel;
            self.sample(iteration, tile.pixel(pixel), &mut tracer, &mut hooks);
        }
        queue.flush(&mut tracer, |c| c.arrive(samples, None));
        tile.commit(samples, None, iteration.index);
        tracer.stats
    }
}

/// What a shadow ray carries.
#[derive(Clone, Copy, Default)]
struct Carried {
    /// Pixel of the tile.
    pixel: u32,
    /// Number of the contribution in a replay.
    note: u32,
    light: Rgb,
}

impl Carried {
    /// Nothing was in the way.
    #[inline]
    fn arrive(self, samples: &mut SampleBuffer, record: Option<&mut Replay>) {
        samples.add(Part::Direct, self.pixel, self.light);
        if let Some(record) = record {
            record.contributions[self.note as usize].visible = true;
        }
    }
}

impl Integrator for PathTracer {
    fn iterate(&mut self, iteration: &Iteration, film: &mut Film) -> RayStats {
        let this = &*self;
        let mut phases = Phases::default();
        // A tile is much more work than handing it over, and larger pieces leave threads idle at the end of an iteration.
        let tiles = film.tiles.par_iter_mut().with_max_len(1);
        let tiles = tiles.map_init(SampleBuffer::default, |samples, tile| this.render_tile(iteration, tile, samples));
        let sum = |mut a: RayStats, b: RayStats| {
            a.merge(&b);
            a
        };
        let stats = phases.time("eye paths and film", || tiles.reduce(RayStats::default, sum));
        RayStats { phases, ..stats }
    }

    fn replay(&mut self, iteration: &Iteration, pixel: (u32, u32)) -> Replay {
        let scene = iteration.scene;
        let (mut replay, mut samples) = (Replay { pixel, ..Replay::default() }, SampleBuffer::default());
        samples.clear(1);
        let (mut tracer, mut queue) = (Tracer::new(&*scene.query), ShadowQueue::new(RayKind::ShadowDirect));
        let mut hooks = Gather {
            tracer: self,
            scene,
            pixel: 0,
            samples: &mut samples,
            queue: &mut queue,
            record: Some(&mut replay),
        };
        self.sample(iteration, pixel, &mut tracer, &mut hooks);
        queue.flush(&mut tracer, |c| c.arrive(&mut samples, Some(&mut replay)));
        replay
    }
}

/// Collects light along one eye walk.
struct Gather<'a> {
    tracer: &'a PathTracer,
    scene: &'a PreparedScene,
    pixel: u32,
    samples: &'a mut SampleBuffer,
    queue: &'a mut ShadowQueue<Carried>,
    record: Option<&'a mut Replay>,
}

impl Gather<'_> {
    /// Weight of a hit whose direction next event would have drawn with the density `next_event`.
    fn hit_weight(&self, edge: &Edge, next_event: impl FnOnce() -> SolidAnglePdf) -> f32 {
        if edge.delta {
            1.0
        } else {
            self.tracer.heuristic.weight(SolidAnglePdf(edge.pdf.0 * edge.survival), next_event())
        }
    }

    fn hidden(&self, index: u32) -> bool {
        index == 1 && self.tracer.hide_emitters
    }

    /// Next event: queues the light that one sampled point of one light would bring.
    #[inline]
    fn next_event(&mut self, vertex: &SurfaceVertex, tracer: &mut Tracer, sampler: &mut PathSampler) {
        let u = sampler.vertex(vertex.index, Purpose::Emitter);
        let lights = &self.scene.lights;
        let point = vertex.point;
        let Some((id, chosen)) = lights.pick_from(point.p, vertex.light_normal, u[0]) else { return };
        // The same twice: the sample of a triangle, by far the most common, stays in registers; one of any kind goes through memory.
        match lights.get(id) {
            Light::Triangle(light) => {
                if let Some(light) = light.sample_direct(point.p, [u[1], u[2]]) {
                    self.connect(vertex, &light, chosen, tracer);
                }
            }
            light => {
                if let Some(light) = light.sample_direct(point.p, [u[1], u[2]]) {
                    self.connect(vertex, &light, chosen, tracer);
                }
            }
        }
    }

    /// Queues what the light sample `light` brings, which was drawn from a light chosen with probability `chosen`.
    #[inline(always)]
    fn connect(&mut self, vertex: &SurfaceVertex, light: &DirectSample, chosen: Pmf, tracer: &mut Tracer) {
        let point = vertex.point;
        let (value, bsdf_pdf) = vertex.bsdf.eval_and_pdf(vertex.wo, light.wi, Transport::Radiance);
        if value.is_black() {
            return;
        }
        let density = light.pdf * chosen;
        let weight = if light.delta {
            1.0
        } else {
            let survival = self.tracer.limits.survival(vertex.index, vertex.bsdf);
            self.tracer.heuristic.weight(density, SolidAnglePdf(bsdf_pdf.0 * survival))
        };
        let raw = vertex.throughput * value * light.radiance * (1.0 / density.0);
        let contribution = raw * weight;
        // A black contribution needs no ray; one that is not finite goes on to the film, which reports it.
        if contribution.is_black() {
            return;
        }
        let segment = direct_segment(point, light);
        let note = self.note((1, vertex.index as usize + 1), raw, weight, false);
        let carried = Carried { pixel: self.pixel, note, light: contribution };
        let (samples, record) = (&mut *self.samples, &mut self.record);
        self.queue.push(&segment, carried, tracer, |c| c.arrive(samples, record.as_deref_mut()));
    }

    /// Writes a contribution down if somebody wants to know; returns its number.
    #[inline]
    fn note(&mut self, technique: (usize, usize), raw: Rgb, weight: f32, visible: bool) -> u32 {
        match &mut self.record {
            None => 0,
            Some(record) => {
                let contribution = Contribution::new(technique, record.pixel, raw, weight);
                record.contributions.push(Contribution { visible, ..contribution });
                record.contributions.len() as u32 - 1
            }
        }
    }

    /// Adds what the walk met.
    fn hit(&mut self, t: usize, raw: Rgb, weight: f32) {
        self.note((0, t), raw, weight, true);
        self.samples.add(Part::AtOnce, self.pixel, raw * weight);
    }
}

impl WalkHooks for Gather<'_> {
    #[inline]
    fn surface(&mut self, vertex: &SurfaceVertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool {
        if let Some(record) = &mut self.record {
            record.vertex(true, vertex);
        }
        let lights = &self.scene.lights;
        if let Some(id) = self.scene.light_of(vertex.hit)
            && !self.hidden(vertex.index)
        {
            let light = lights.get(id);
            let emitted = light.emitted([vertex.hit.u, vertex.hit.v], vertex.wo);
            if !emitted.is_black() {
                let edge = vertex.edge;
                let weight = self.hit_weight(edge, || {
                    light.pdf_direct(edge.from, -vertex.wo, edge.distance)
                        * lights.pmf_from(edge.from, edge.from_normal, id)
                });
                self.hit(vertex.index as usize + 1, vertex.throughput * emitted, weight);
            }
        }
        if vertex.bsdf.is_black() {
            return false;
        }
        if vertex.index < self.tracer.limits.max_edges && vertex.bsdf.connectable() {
            self.next_event(vertex, tracer, sampler);
        }
        true
    }

    fn escaped(&mut self, index: u32, direction: Vec3, throughput: Rgb, edge: &Edge) {
        if self.hidden(index) {
            return;
        }
        let lights = &self.scene.lights;
        for &id in lights.infinite() {
            let light = lights.get(id);
            let emitted = light.emitted([0.0; 2], -direction);
            if !emitted.is_black() {
                let weight = self.hit_weight(edge, || {
                    light.pdf_direct(edge.from, direction, f32::INFINITY)
                        * lights.pmf_from(edge.from, edge.from_normal, id)
                });
                self.hit(index as usize + 1, throughput * emitted, weight);
            }
        }
    }
}
