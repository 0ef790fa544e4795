//! Light sub-paths: their densities, the vertices that can be connected to, and their connections to the lens.

use super::{Bidirectional, Found};
use crate::emit::{EmissionSample, LensSample, LightEnd, LightId};
use crate::integrators::replay::{Contribution, Replay};
use crate::math::sampler::{PathSampler, Purpose};
use crate::math::{AreaPdf, Pmf, Rgb, SolidAnglePdf, Vec3};
use crate::mis::definition::Joined;
use crate::mis::{self, End, Joint, Lit, Node, Resampled, Side, Split, Targets, Weigher, Weight, spread};
use crate::path::{Edge, Origin, ShadowQueue, SurfaceVertex, WalkHooks, WalkStart, walk};
use crate::prepared::PreparedScene;
use crate::ray::offset::{SegmentEnd, offset_point, segment};
use crate::ray::{Ray, RayKind, Segment, T_MIN, Tracer, Work};
use crate::shade::{BsdfPool, BsdfSample, KeptBsdf, Transport};

/// A vertex y_{s−1} of a light sub-path, s ≥ 2, that eye vertices can be connected to. There are many of them: this is all that is needed.
#[derive(Clone, Copy, Debug)]
pub(in crate::integrators) struct LightVertex {
    pub p: Vec3,
    /// Bound on the error of any component of `p`.
    pub error: f32,
    /// Unit geometric normal.
    pub ng: Vec3,
    /// Unit direction towards y_{s−2}.
    pub wo: Vec3,
    /// β_L: everything of the measurement contribution up to the vertex, over its density.
    pub throughput: Rgb,
    /// Survival of a light sub-path here.
    pub survival: f32,
    /// s: the vertices of the sub-path up to this one.
    pub s: u32,
    /// The BSDF, seen from `wo`; its lobes are where the vertex is.
    pub bsdf: KeptBsdf,
}

impl LightVertex {
    /// Its end of a shadow ray.
    #[inline]
    pub fn end(&self) -> SegmentEnd {
        SegmentEnd::Surface { p: self.p, error: self.error, ng: self.ng }
    }

    /// Number of vertices of the sub-path.
    #[inline]
    pub fn length(&self) -> usize {
        self.s as usize
    }
}

/// A light sub-path, with what connections to it need.
#[derive(Clone, Debug, Default)]
pub(in crate::integrators) struct LightPath {
    /// Densities of all its vertices.
    pub side: Side,
    /// Those of its vertices that can be connected to.
    pub vertices: Vec<LightVertex>,
    /// Their BSDFs.
    pub bsdfs: BsdfPool,
    /// c_1 of paths through y_1, see `mis::weigh`.
    pub next_event: f32,
    /// Rays can meet the light by chance.
    pub light_can_be_hit: bool,
    /// y_0; nothing if no light was drawn.
    pub origin: Option<Origin>,
}

impl LightPath {
    /// Sums up shares for weights of paths that go beyond its last vertex, which the walk has just left.
    #[inline]
    fn sum_up(&mut self, weigher: &Weigher) {
        let end = End::Light { can_be_hit: self.light_can_be_hit, next_event: self.next_event };
        weigher.sum_up(self.side.nodes_mut(), end);
    }

    /// Forgets its vertices, but not its memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.bsdfs.clear();
        self.origin = None;
    }
}

/// Traces a light sub-path and connects its vertices to the lens, if `lens` takes that. It leaves its densities in `out`, and its
/// vertices if `keep` says so.
#[allow(clippy::too_many_arguments)]
pub(in crate::integrators) fn trace(
    this: &Bidirectional,
    scene: &PreparedScene,
    sampler: &mut PathSampler,
    tracer: &mut Tracer,
    out: &mut LightPath,
    lens: Option<&mut LensQueue>,
    record: Option<&mut Replay>,
    keep: bool,
) {
    out.clear();
    let u = sampler.origin();
    let v = sampler.origin_direction();
    let Some((id, chosen)) = scene.lights.pick(u[0]) else { return };
    let light = scene.lights.get(id);
    let Some(emission) = light.sample_emission([u[1], u[2]], [v[0], v[1]]) else { return };
    let origin = emission.vertex_density() * chosen;
    out.side.begin(origin, false);
    out.light_can_be_hit = !light.is_delta();
    out.next_event = 0.0;
    out.sum_up(&this.weigher);
    let flux = emission.flux() * (1.0 / chosen.0);
    out.origin = Some(Origin { light: id, end: emission.end, leaving: emission.direction, flux });
    // Cache points near a vertex are asked about the vertex before.
    let keep = keep || this.resampler.as_ref().is_some_and(|r| r.settings.form.asks());
    let mut hooks =
        LightHooks { this, scene, id, chosen, emission: &emission, luminance_before: 0.0, out, lens, record, keep };
    hooks.emitter_to_lens([v[2], v[3]], tracer, sampler);
    if flux.is_black() || this.weigher.light_limits.max_edges < 2 {
        return;
    }
    let start = WalkStart {
        ray: Ray {
            o: emission
                .ng
                .map_or(emission.origin, |ng| offset_point(emission.origin, emission.error, ng, emission.direction)),
            d: emission.direction,
            t_min: T_MIN,
            t_max: f32::INFINITY,
        },
        throughput: flux,
        pdf: emission.pdf_direction,
        delta: false,
        kind: RayKind::Light,
    };
    // One edge of a path is left for the connection.
    let limits =
        crate::path::Limits { max_edges: this.weigher.light_limits.max_edges - 1, ..this.weigher.light_limits };
    walk(scene, start, &limits, Transport::Importance, tracer, sampler, &mut hooks);
}

/// Connections to the lens on their way.
pub(in crate::integrators) struct LensQueue<'a> {
    pub queue: &'a mut ShadowQueue<Found>,
    pub found: &'a mut dyn FnMut(Found),
    /// Number of the light sub-path.
    pub path: u32,
}

struct LightHooks<'a, 'q> {
    this: &'a Bidirectional,
    scene: &'a PreparedScene,
    id: LightId,
    chosen: Pmf,
    emission: &'a EmissionSample,
    /// Luminance of β_L on arriving at the vertex before.
    luminance_before: f32,
    out: &'a mut LightPath,
    lens: Option<&'a mut LensQueue<'q>>,
    record: Option<&'a mut Replay>,
    /// Vertices are kept for connections.
    keep: bool,
}

impl LightHooks<'_, '_> {
    /// Number of light sub-paths, by which every splat is divided.
    fn paths(&self) -> f32 {
        self.this.weigher.techniques.light_paths()
    }

    /// Sends a contribution on its way to the pixel where the lens sees it.
    fn splat(
        &mut self,
        s: usize,
        lens: &LensSample,
        segment: &Segment,
        (raw, weight): (Rgb, Weight),
        u: [f32; 2],
        tracer: &mut Tracer,
    ) {
        // The edge that leaves the light is the connection itself if there is no other.
        let leaving = if s == 1 && self.emission.ng.is_some() { lens.wi } else { self.emission.direction };
        let Some(([x, y], filter)) = self.scene.filter.splat(lens.raster, u) else { return };
        let [width, height] = self.scene.film_size;
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if x >= width || y >= height {
            return;
        }
        let raw = raw * filter;
        let (scene, weigher) = (self.scene, &self.this.weigher);
        let (origin, resampler) = (self.out.origin, &self.this.resampler);
        let note = self.record.as_mut().map_or(0, |record| {
            let path = origin.map(|o| record.path(Origin { leaving, ..o }, s, 0, lens.p));
            let factor_of = |resampled: &Resampled, joined: &Joined| {
                resampler.as_ref().map_or(1.0, |r| r.factor_of(scene, weigher, resampled, joined))
            };
            record.found(scene, weigher, &factor_of, Contribution::new((s, 1), (x, y), raw, weight.own), path)
        });
        let Some(queue) = &mut self.lens else { return };
        let found = Found { x, y, note, path: queue.path, s: s as u16, t: 1, raw, weight };
        let arrived = &mut *queue.found;
        queue.queue.push(segment, found, tracer, arrived);
    }

    /// (s, t) = (1, 1): the light itself as the lens sees it.
    fn emitter_to_lens(&mut self, u: [f32; 2], tracer: &mut Tracer, sampler: &mut PathSampler) {
        if self.lens.is_none()
            || !self.this.weigher.techniques.uses(1, 1)
            || !self.out.light_can_be_hit
            || self.this.hide_emitters
        {
            return;
        }
        let (scene, emission) = (self.scene, self.emission);
        let sample = match emission.end {
            LightEnd::Infinite => scene.camera.sample_lens_at_infinity(-emission.direction, u),
            _ => scene.camera.sample_lens(emission.origin, u),
        };
        let Some(lens) = sample else { return };
        let (emitted, cos, to_area, segment) = match emission.end.segment_end() {
            None => {
                let to_light = -emission.direction;
                (emission.radiance, 1.0, 1.0, Segment { o: lens.p_near, d: to_light, t_max: lens.distance })
            }
            Some(from) => {
                let ng = emission.ng.unwrap_or(lens.wi);
                let cos = ng.dot(lens.wi).max(0.0);
                // The radiance of a textured light is the same in all directions of its front.
                let emitted = if cos > 0.0 { emission.radiance } else { Rgb::BLACK };
                (
                    emitted,
                    cos,
                    spread(cos, lens.distance * lens.distance),
                    segment(&from, &SegmentEnd::Free(lens.p_near)),
                )
            }
        };
        let origin = self.out.side.first(1)[0];
        let raw = emitted * (cos * lens.weight / (origin.forward.0 * self.paths()));
        if raw.is_black() {
            return;
        }
        let weight = self.lens_weight(1, &lens, to_area, SolidAnglePdf(0.0), tracer);
        let filter = sampler.rng().next_4();
        self.splat(1, &lens, &segment, (raw, weight), [filter[0], filter[1]], tracer);
    }

    /// (s, 1): a surface vertex as the lens sees it.
    fn vertex_to_lens(&mut self, vertex: &SurfaceVertex, tracer: &mut Tracer, sampler: &mut PathSampler) {
        let s = vertex.index as usize + 1;
        let u = sampler.vertex(vertex.index, Purpose::Emitter);
        let point = vertex.point;
        let Some(lens) = self.scene.camera.sample_lens(point.p, [u[0], u[1]]) else { return };
        let value = vertex.bsdf.eval(vertex.wo, lens.wi, Transport::Importance);
        let raw = vertex.throughput * value * (lens.weight / self.paths());
        if raw.is_black() {
            return;
        }
        let to_area = spread(point.ng.dot(lens.wi), lens.distance * lens.distance);
        let back = vertex.bsdf.pdf(lens.wi, vertex.wo, Transport::Radiance);
        let weight = self.lens_weight(s, &lens, to_area, back, tracer);
        let from = SegmentEnd::Surface { p: point.p, error: point.error, ng: point.ng };
        let segment = segment(&from, &SegmentEnd::Free(lens.p_near));
        self.splat(s, &lens, &segment, (raw, weight), [u[2], u[3]], tracer);
    }

    /// Weight of the technique (s, 1) that joins y_{s−1} with `lens`: `to_area` turns a density per steradian at the lens into one per unit
    /// area at y_{s−1}, from where a walk that came from the lens would go on to the vertex before with the density `back`.
    fn lens_weight(
        &self,
        s: usize,
        lens: &LensSample,
        to_area: f32,
        back: SolidAnglePdf,
        tracer: &mut Tracer,
    ) -> Weight {
        let split = Split {
            light: self.out.side.first(s),
            light_joint: Joint { arrival: AreaPdf(lens.pdf_direction().0 * to_area), departure: back },
            eye: &[Node::origin(lens.pdf)],
            eye_lit: &[Lit::default()],
            eye_proposals: None,
            eye_joint: Joint { arrival: AreaPdf(0.0), departure: SolidAnglePdf(0.0) },
            next_event: self.out.next_event,
            light_can_be_hit: self.out.light_can_be_hit,
            factor: 1.0,
            arriving: Rgb::BLACK,
            adjoint: Rgb::BLACK,
        };
        let started = tracer.begin(Work::Weights);
        let weight = self.this.weigher.weight(&split);
        tracer.end(Work::Weights, started);
        weight
    }

    /// c of the connection that ends at `vertex`, where the sub-path came with the area density `forward`.
    #[inline]
    fn factor(&self, vertex: &SurfaceVertex, forward: AreaPdf, tracer: &mut Tracer) -> f32 {
        let (Some(resampler), Some(resampled)) = (&self.this.resampler, &self.this.weigher.resampled) else {
            return 1.0;
        };
        let (point, distance) = (vertex.point, vertex.edge.distance);
        if resampled.form.asks() {
            let near = resampler.near(point, vertex.wo);
            // A vertex that cannot be connected to was not kept, and has no proposals.
            let before = self.out.vertices.last().filter(|y| y.s == vertex.index);
            return before.map_or(1.0, |y| {
                let bsdf = self.out.bsdfs.get(&y.bsdf, y.ng);
                let seen = resampler.seen_by(&near, &y.end(), tracer);
                self.this.weigher.asked(
                    resampled,
                    y.throughput,
                    &resampler.proposals_of(&near, y, &bsdf, seen),
                    y.length(),
                )
            });
        }
        let dist2 = distance * distance;
        let here = spread(point.ng.dot(vertex.wo), dist2);
        // What the sub-path brings here is its throughput times the density of having come here.
        let brings = Targets {
            scattered: vertex.throughput.luminance() * forward.0,
            unscattered: self.luminance_before * self.out.side.cos_leaving().abs() * here,
        };
        resampled.factor(brings, dist2, resampler.there(point, vertex.wo))
    }

    /// c_1 of paths whose first two vertices are the light's and `vertex`.
    fn next_event(&self, vertex: &SurfaceVertex, to_area: f32) -> f32 {
        let lights = &self.scene.lights;
        let picked = lights.pmf_from(vertex.point.p, vertex.light_normal, self.id);
        let light = lights.get(self.id);
        if light.is_delta() {
            return picked.0 / self.chosen.0;
        }
        let distance = match self.emission.end {
            LightEnd::Infinite => f32::INFINITY,
            _ => vertex.edge.distance,
        };
        let direct = light.pdf_direct(vertex.point.p, vertex.wo, distance) * picked;
        mis::next_event(direct, to_area, self.out.side.first(1)[0].forward)
    }
}

impl WalkHooks for LightHooks<'_, '_> {
    fn surface(&mut self, vertex: &SurfaceVertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool {
        let (index, point, edge) = (vertex.index, vertex.point, vertex.edge);
        let dist2 = edge.distance * edge.distance;
        let cos = point.ng.dot(vertex.wo);
        let eye_survival = self.this.weigher.eye_limits.roulette(vertex.bsdf);
        if index == 1 {
            let emission = self.emission;
            let forward = emission.end.next_density(emission.pdf_position, emission.pdf_direction, cos, dist2);
            let to_light = emission.end.spread(emission.direction, dist2);
            self.out.side.arrive(forward, to_light, eye_survival);
            self.out.next_event = self.next_event(vertex, to_light);
        } else {
            let forward = self.out.side.arrive_on(vertex, eye_survival);
            let factor = self.factor(vertex, forward, tracer);
            if let Some(node) = self.out.side.last_mut() {
                node.factor = factor;
            }
        }
        if let Some(record) = &mut self.record {
            record.vertex(false, vertex);
        }
        if vertex.bsdf.is_black() {
            return false;
        }
        let s = index as usize + 1;
        if vertex.bsdf.connectable() {
            if self.lens.is_some() && self.this.weigher.techniques.uses(s, 1) {
                self.vertex_to_lens(vertex, tracer, sampler);
            }
            if self.keep {
                self.out.vertices.push(LightVertex {
                    p: point.p,
                    error: point.error,
                    ng: point.ng,
                    wo: vertex.wo,
                    throughput: vertex.throughput,
                    survival: self.this.weigher.light_limits.survival(index, vertex.bsdf),
                    s: index + 1,
                    bsdf: self.out.bsdfs.keep(vertex.bsdf),
                });
            }
        }
        true
    }

    fn leaving(&mut self, vertex: &SurfaceVertex, sample: &BsdfSample) {
        self.luminance_before = vertex.throughput.luminance();
        self.out.side.leave(vertex, sample, Transport::Radiance);
        self.out.sum_up(&self.this.weigher);
        if let Some(record) = &mut self.record {
            record.leaving(false, sample);
        }
    }

    fn escaped(&mut self, _index: u32, _direction: Vec3, _throughput: Rgb, _edge: &Edge) {}
}
