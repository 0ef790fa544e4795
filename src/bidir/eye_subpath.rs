//! Eye sub-paths: hits of lights, next event, and connections to light sub-paths (`connection`).

use super::contribution::{Contribution, ContributionKind};
use super::endpoint::{
    DirectLight, DirectSampleSink, emitted_at, for_each_background, light_choice_normal, next_event_pdf, sample_direct,
};
use super::light_subpath::LightSubpath;
use super::replay::{ContributionRecord, Replay, SubpathKind};
use super::scratch::{ContributionSink, EyeQueues};
use super::store::VertexStore;
use super::strategy::{ConnectionStrategy, EyeVertex, factor_of};
use crate::emit::{DirectSample, EmitterVertex, LightId};
use crate::math::sampler::PathSampler;
use crate::math::{AreaPdf, Pmf, Rgb, SolidAnglePdf, Vec3};
use crate::mis::{
    AdjacentVertices, ConnectedPath, ConnectionFactor, EmitterFactors, EndpointPdfs, EyeSubpathPdfs, MisContext,
    MisWeight, PathEnd, ReversePath, VertexPdfs, next_event_factor,
};
use crate::path::{
    DirectionSampler, Edge, Iteration, Origin, Scattering, SegmentFlight, Vertex, WalkHooks, direct_segment,
    segment_flight,
};
use crate::ray::{Segment, Tracer, Work};
use crate::shade::{BsdfSample, Transport};

/// c's knowledge about an edge, by strategy.
type EdgeOf<S> = <<S as ConnectionStrategy>::Factor as ConnectionFactor>::Edge;

/// The rules that the eye sub-paths of an iteration follow.
pub struct EyeSubpathRules<'a, S: ConnectionStrategy> {
    /// The iteration.
    pub iteration: &'a Iteration<'a>,
    /// Limits and weights.
    pub mis: &'a MisContext<S::Factor>,
    /// Which light sub-paths eye vertices are connected to.
    pub strategy: &'a S,
    /// The stored light vertices.
    pub store: &'a VertexStore,
    /// Fraction of the connections that is made.
    pub connection_fraction: f32,
    /// Eye sub-paths end where no technique uses more of their vertices.
    pub max_eye_vertices: usize,
    /// Emitters that the camera sees directly are black.
    pub hide_emitters: bool,
    /// Writes down the stored light sub-path of a number in a replay, and returns its origin.
    pub retrace: &'a (dyn Fn(u32, &mut Replay) -> Option<Origin> + Sync),
}

/// The hooks of an eye sub-path.
pub(super) struct EyeHooks<'a, S: ConnectionStrategy, K> {
    pub rules: &'a EyeSubpathRules<'a, S>,
    /// The light sub-path of the pixel.
    pub light: &'a LightSubpath,
    pub pdfs: &'a mut EyeSubpathPdfs<S::Factor>,
    pub pixel: (u32, u32),
    /// z_0.
    pub lens: Vec3,
    /// Knowledge about either side of the last vertex, as far as it was asked for.
    pub lookups: [Option<S::Lookup>; 2],
    /// Knowledge about the side of the vertex before the last from which the walk left, visibility of the last vertex
    /// included.
    pub lookup_before: S::Lookup,
    /// The light choice normal of the vertex before.
    pub normal_before: Option<Vec3>,
    pub queues: &'a mut EyeQueues,
    pub sink: &'a mut K,
    pub replay: Option<&'a mut Replay>,
}

/// Next event at an eye vertex.
struct NextEvent<'a, 'h, 't, S: ConnectionStrategy, K> {
    hooks: &'a mut EyeHooks<'h, S, K>,
    vertex: &'a Vertex<'a>,
    tracer: &'a mut Tracer<'t>,
}

impl<S: ConnectionStrategy, K: ContributionSink> DirectSampleSink for NextEvent<'_, '_, '_, S, K> {
    #[inline(always)]
    fn accept(&mut self, id: LightId, pmf: Pmf, sample: &DirectSample) {
        self.hooks.direct(self.vertex, id, pmf, sample, self.tracer);
    }
}

/// The light's end of a path that a contribution belongs to.
#[derive(Clone, Copy, Debug)]
pub(super) enum PathOrigin {
    /// It is known.
    Known(Option<Origin>),
    /// It is that of the stored light sub-path of this number.
    Stored(u32),
}

/// A hit of a light.
struct EmitterHit<'a> {
    light: LightId,
    end: EmitterVertex,
    /// Unit direction from the vertex before to the light.
    direction: Vec3,
    throughput: Rgb,
    emitted: Rgb,
    edge: &'a Edge,
}

/// A connection of an eye vertex to a sampled point of a light.
struct DirectConnection<'a> {
    sample: &'a DirectSample,
    light: DirectLight,
    origin: Origin,
    /// Emission densities of the light in the direction of the vertex: of position and direction.
    emission: (AreaPdf, SolidAnglePdf),
    /// Probability of the light as origin of a light sub-path.
    origin_pmf: Pmf,
    flight: &'a SegmentFlight,
    is_delta: bool,
}

impl<S: ConnectionStrategy, K: ContributionSink> EyeHooks<'_, S, K> {
    /// A contribution of the technique (s, t), with its value and weight as if all light passed the masks on its
    /// connection, `segment`, in scenes without media; written down if there is a replay.
    pub(super) fn contribution(
        &mut self,
        (s, t): (usize, usize),
        origin: PathOrigin,
        (raw, weight): (Rgb, MisWeight),
        segment: Option<&Segment>,
    ) -> Contribution {
        let (pixel, lens, rules) = (self.pixel, self.lens, self.rules);
        let open =
            Contribution { x: pixel.0, y: pixel.1, path: 0, replay_index: 0, s: s as u16, t: t as u16, raw, weight };
        let replay_index = self.replay.as_mut().map_or(0, |replay| {
            // z_1 … z_{t−1}, of which the last is the light's vertex if the walk hit it.
            let eye_vertices = if s == 0 { t - 2 } else { t - 1 };
            let origin = match origin {
                PathOrigin::Known(origin) => origin,
                PathOrigin::Stored(number) => (rules.retrace)(number, replay),
            };
            let path = origin.map(|origin| replay.path(origin, s, eye_vertices, lens));
            let scene = rules.iteration.scene;
            let factor = |v: &AdjacentVertices| factor_of(scene, rules.strategy, rules.mis, v);
            let record = ContributionRecord::of(&open, segment, scene, rules.mis.heuristic);
            replay.contribution(scene, rules.mis, &factor, record, path)
        });
        Contribution { replay_index, ..open }
    }

    /// (0, t): the walk met a light. The vertex on the light is the last of the sub-path.
    fn hit(&mut self, hit: &EmitterHit) {
        let EmitterHit { light: id, end, direction, throughput, emitted, edge } = *hit;
        let t = self.pdfs.pdfs.all().len();
        let (mis, scene) = (&self.rules.mis, self.rules.iteration.scene);
        if !mis.techniques.uses(0, t) || (t == 2 && self.rules.hide_emitters) {
            return;
        }
        let (lights, distribution) = (&scene.lights, &mis.emission);
        let chosen = distribution.pmf_light(lights, id);
        let (position, emission) = distribution.pdf_ray(lights, id, end.normal(), -direction, edge.from);
        let origin_pdf = end.pdf_vertex(position, emission) * chosen;
        let drawn = position.0 * emission.0 * chosen.0;
        let origin = Origin {
            light: id,
            end,
            direction: -direction,
            throughput: end.flux(emitted, -direction, edge.distance, drawn),
        };
        let next_event = if t >= 3 {
            let direct = next_event_pdf(scene, id, edge, self.normal_before, end.normal(), direction);
            // The direct density is per steradian at z_{t−2}, as the walk's own was before it was converted.
            let walked = edge.pdf_with_survival().0;
            let last = self.pdfs.pdfs.all()[t - 1].pdf_fwd.0;
            next_event_factor(direct, last / walked, origin_pdf)
        } else {
            1.0
        };
        let weight = mis.weight(&ConnectedPath {
            light: &[],
            light_end: EndpointPdfs::NONE,
            eye: self.pdfs.pdfs.all(),
            eye_end: EndpointPdfs { pdf_rev: origin_pdf, pdf_rev_prev: end.pdf_emission_dir(position, emission) },
            emitter: EmitterFactors { can_be_hit: true, next_event },
            connection_factor: 1.0,
            // No connection ends at the light.
            reverse: self.reverse_path(
                t,
                EdgeOf::<S>::default(),
                origin.throughput * edge.flight.throughput_back(),
                Rgb::BLACK,
            ),
        });
        let contribution =
            self.contribution((0, t), PathOrigin::Known(Some(origin)), (throughput * emitted, weight), None);
        self.sink.add(ContributionKind::Hit, contribution);
    }

    /// (0, t) if `vertex`, the last of the sub-path, is on a surface that emits.
    fn emission(&mut self, vertex: &Vertex) {
        let scene = self.rules.iteration.scene;
        if let Some((light, emitted)) = emitted_at(scene, vertex)
            && let crate::path::Place::Surface { point, .. } = vertex.place
        {
            let end = scene.lights.get(light).end_at(point.p, point.error, point.ng);
            let (direction, throughput) = (-vertex.wo, vertex.throughput);
            self.hit(&EmitterHit { light, end, direction, throughput, emitted, edge: vertex.edge });
        }
    }

    /// (1, t): a point of a light, drawn as seen from the eye vertex.
    #[inline(always)]
    fn next_event(&mut self, vertex: &Vertex, normal: Option<Vec3>, tracer: &mut Tracer, sampler: &mut PathSampler) {
        let scene = self.rules.iteration.scene;
        sample_direct(scene, vertex, normal, sampler, &mut NextEvent { hooks: self, vertex, tracer });
    }

    /// Queues the light of `sample`, which was drawn from the light `id` of probability `pmf`.
    fn direct(&mut self, vertex: &Vertex, id: LightId, pmf: Pmf, sample: &DirectSample, tracer: &mut Tracer) {
        let (t, scene) = (vertex.index as usize + 1, self.rules.iteration.scene);
        let Some(direct) = DirectLight::new(vertex, &self.rules.mis.directions, sample, pmf) else { return };
        if direct.raw.is_black() {
            return;
        }
        let segment = direct_segment(&vertex.place.segment_end(), sample);
        let Some(flight) = segment_flight(scene, &segment, vertex.medium_towards(sample.wi), tracer) else { return };
        let raw = direct.raw * flight.light;
        let light = scene.lights.get(id);
        let distribution = &self.rules.mis.emission;
        let (position, emission) = distribution.pdf_ray_at_sample(&scene.lights, id, sample, vertex.position());
        let origin_pmf = distribution.pmf_light(&scene.lights, id);
        let drawn = position.0 * emission.0 * origin_pmf.0;
        let origin = Origin {
            light: id,
            end: sample.end,
            direction: -sample.wi,
            throughput: sample.end.flux(sample.radiance, -sample.wi, sample.distance, drawn),
        };
        let started = tracer.begin(Work::Weights);
        let weight = self.direct_weight(
            vertex,
            &DirectConnection {
                sample,
                light: direct,
                origin,
                emission: (position, emission),
                origin_pmf,
                flight: &flight,
                is_delta: light.is_delta(),
            },
        );
        tracer.end(Work::Weights, started);
        let origin = PathOrigin::Known(Some(origin));
        let contribution = self.contribution((1, t), origin, (raw, weight), Some(&segment));
        let (sink, heuristic) = (&mut *self.sink, self.rules.mis.heuristic);
        self.queues.next_event.push(&segment, contribution, tracer, |c, transmittance| {
            sink.add(ContributionKind::NextEvent, c.through(transmittance, heuristic));
        });
    }

    fn direct_weight(&self, vertex: &Vertex, connection: &DirectConnection) -> MisWeight {
        let DirectConnection { sample, light, origin, emission, origin_pmf, flight, is_delta } = connection;
        let (t, mis, place) = (vertex.index as usize + 1, &self.rules.mis, &vertex.place);
        let (cos, dist2) = (place.cosine(sample.wi), sample.distance * sample.distance);
        let (position, emission) = *emission;
        // Per steradian at the eye vertex → per unit area at the light vertex.
        let area_jacobian = sample.end.area_jacobian(sample.wi, dist2);
        let origin_pdf = sample.end.pdf_vertex(position, emission) * *origin_pmf;
        let walked = light.scatter_pdf.0 * mis.eye_limits.survival(vertex.index, &vertex.scatter);
        let (value, pdf_rev_prev) = self.reverse_scatter(vertex, sample.wi);
        let edge = self.edge_before(vertex, sample.wi);
        let edge_flight = flight.edge(None, Some(&place.stored()));
        let next_vertex = sample.end.pdf_next_vertex(position, emission, cos, dist2);
        mis.weight(&ConnectedPath {
            light: &[VertexPdfs::origin(origin_pdf)],
            light_end: EndpointPdfs {
                pdf_rev: AreaPdf(if *is_delta { 0.0 } else { walked * area_jacobian }),
                pdf_rev_prev: SolidAnglePdf(0.0),
            },
            eye: self.pdfs.pdfs.first(t),
            eye_end: EndpointPdfs { pdf_rev: AreaPdf(next_vertex.0 * edge_flight.rate), pdf_rev_prev },
            emitter: EmitterFactors {
                can_be_hit: !is_delta,
                next_event: next_event_factor(light.pdf, area_jacobian, origin_pdf),
            },
            connection_factor: 1.0 / flight.transmittance.share(),
            reverse: self.reverse_path(t, edge, origin.throughput * edge_flight.throughput(), value),
        })
    }

    /// Light on its way up the first t vertices of the sub-path; see [`ReversePath`].
    #[inline]
    pub(super) fn reverse_path(
        &self,
        t: usize,
        last_edge: EdgeOf<S>,
        throughput: Rgb,
        value: Rgb,
    ) -> ReversePath<'_, S::Factor> {
        debug_assert!(S::Factor::IS_ONE || self.pdfs.reverse().len() >= t);
        ReversePath { vertices: self.pdfs.reverse(), edges: self.pdfs.edges(), last_edge, throughput, value }
    }

    /// Value and density at an eye vertex of light that comes along `from` and goes on to the vertex before; the value
    /// only if factors depend on it.
    #[inline]
    pub(super) fn reverse_scatter(&self, vertex: &Vertex, from: Vec3) -> (Rgb, SolidAnglePdf) {
        let (directions, p, mode) = (&self.rules.mis.directions, vertex.position(), Transport::Importance);
        match S::Factor::IS_ONE {
            true => (Rgb::BLACK, directions.pdf(p, &vertex.scatter, from, vertex.wo, mode)),
            false => directions.eval_and_pdf(p, &vertex.scatter, from, vertex.wo, mode),
        }
    }

    /// The argument of the factor of the edge from `vertex` to the vertex before, for light that comes to `vertex`
    /// along `from`.
    #[inline]
    pub(super) fn edge_before(&self, vertex: &Vertex, from: Vec3) -> EdgeOf<S> {
        let value = |to: Vec3| vertex.scatter.eval(from, to, Transport::Importance);
        self.rules.strategy.edge(&self.lookup_before, &vertex.place.stored(), value)
    }

    /// Knowledge about the side of the direction `d` of the walk's last vertex; looked up once.
    #[inline]
    pub(super) fn lookup(&mut self, vertex: &Vertex, d: Vec3) -> S::Lookup {
        let place = vertex.place.stored();
        let side = usize::from(place.cosine(d) < 0.0);
        *self.lookups[side].get_or_insert_with(|| self.rules.strategy.look_up(&place, d))
    }

    /// Connections of a vertex to light sub-paths.
    #[inline(always)]
    fn connections(&mut self, vertex: &Vertex, tracer: &mut Tracer, sampler: &mut PathSampler) {
        let (t, rules) = (vertex.index as usize + 1, self.rules);
        let (techniques, max_edges) = (&rules.mis.techniques, u64::from(rules.mis.eye_limits.max_edges));
        let wanted = |s: usize| (s + t - 1) as u64 <= max_edges && techniques.uses(s, t);
        let eye = EyeVertex { vertex, own: self.light, store: rules.store, fraction: rules.connection_fraction };
        let started = tracer.begin(Work::Connections);
        rules.strategy.draw(&eye, sampler, wanted, |candidate| self.connect(vertex, &candidate, tracer));
        tracer.end(Work::Connections, started);
    }
}

impl<S: ConnectionStrategy, K: ContributionSink> WalkHooks for EyeHooks<'_, S, K> {
    #[inline(always)]
    fn vertex(&mut self, vertex: &Vertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool {
        let (rules, scene) = (self.rules, self.rules.iteration.scene);
        self.lookups = [None; 2];
        self.pdfs.arrive(vertex, rules.mis.light_limits.roulette_survival(&vertex.scatter));
        if let Some(replay) = &mut self.replay {
            replay.vertex(SubpathKind::Eye, scene, vertex);
        }
        self.emission(vertex);
        let normal = light_choice_normal(scene, vertex);
        self.normal_before = normal;
        if vertex.scatter.is_black() {
            return false;
        }
        if vertex.index > 1 && S::NEEDS_LIGHT_VERTEX {
            rules.strategy.see(&mut self.lookup_before, &vertex.place.segment_end(), tracer);
        }
        if vertex.index < rules.mis.eye_limits.max_edges && vertex.scatter.connectable() {
            if rules.mis.techniques.uses(1, vertex.index as usize + 1) {
                self.next_event(vertex, normal, tracer, sampler);
            }
            self.connections(vertex, tracer, sampler);
        }
        (vertex.index as usize + 1) < rules.max_eye_vertices
    }

    fn passing(&mut self, vertex: &Vertex) {
        // The emission is the end of a path, and no part of those that go on.
        self.pdfs.arrive(vertex, 1.0);
        self.emission(vertex);
        self.pdfs.forget_arrival();
    }

    fn leaving(&mut self, vertex: &Vertex, sample: &BsdfSample) {
        let mis = self.rules.mis;
        let pdf_rev = self.pdfs.pdfs.leave(vertex, sample, &mis.directions, Transport::Importance);
        mis.accumulate_partial_sums(self.pdfs.pdfs.all_mut(), PathEnd::Lens);
        if !S::Factor::IS_ONE {
            let value = match sample.delta {
                true => sample.reverse_delta,
                false => vertex.scatter.eval(sample.wi, vertex.wo, Transport::Importance),
            };
            // Beside a delta event there are no connections.
            let edge = match sample.delta || vertex.index < 2 {
                true => EdgeOf::<S>::default(),
                false => self.edge_before(vertex, sample.wi),
            };
            self.pdfs.set_reverse(value, pdf_rev, edge);
            self.lookup_before = self.lookup(vertex, sample.wi);
        }
        if let Some(replay) = &mut self.replay {
            replay.leaving(SubpathKind::Eye, sample);
        }
    }

    fn escaped(&mut self, _index: u32, direction: Vec3, throughput: Rgb, edge: &Edge) {
        self.pdfs.arrive_at_infinity(edge);
        for_each_background(self.rules.iteration.scene, direction, |light, emitted| {
            self.hit(&EmitterHit { light, end: EmitterVertex::Infinite, direction, throughput, emitted, edge });
        });
    }
}
