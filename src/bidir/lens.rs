//! Techniques with t = 1: vertices of a light sub-path are connected to the lens, and land in whatever pixel sees them.

use super::contribution::Contribution;
use super::light_subpath::LightHooks;
use super::replay::ContributionRecord;
use super::strategy::{ConnectionStrategy, factor_of};
use crate::emit::{EmitterVertex, LensSample};
use crate::math::measure::area_jacobian;
use crate::math::sampler::{PathSampler, SampleSlot};
use crate::math::{AreaPdf, Rgb, SolidAnglePdf};
use crate::mis::{
    AdjacentVertices, ConnectedPath, ConnectionFactor, EndpointPdfs, MisWeight, ReversePath, ReverseTransport,
    VertexPdfs,
};
use crate::path::{DirectionSampler, Origin, Vertex, segment_flight};
use crate::ray::offset::{SegmentEnd, segment};
use crate::ray::{Segment, Tracer, Work};
use crate::shade::Transport;

/// A connection of y_{s−1} to the lens.
struct LensConnection<'a> {
    s: usize,
    lens: &'a LensSample,
    segment: Segment,
    /// Estimate of the technique by itself, without the filter of the pixel.
    raw: Rgb,
    weight: MisWeight,
    /// Where in the filter's support the splat lands.
    u: [f32; 2],
}

impl<S: ConnectionStrategy> LightHooks<'_, '_, S> {
    /// Number of light sub-paths, by which every splat is divided.
    fn light_paths(&self) -> f32 {
        self.rules.mis.techniques.light_paths()
    }

    /// Sends a contribution on its way to a pixel that the lens sees it through.
    fn splat(&mut self, connection: &LensConnection, tracer: &mut Tracer) {
        let LensConnection { s, lens, segment, raw, weight, u } = connection;
        let scene = self.rules.scene;
        let Some(([x, y], filter)) = scene.filter.splat(lens.raster, *u) else { return };
        let [width, height] = scene.film_size;
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if x >= width || y >= height {
            return;
        }
        let raw = *raw * filter;
        let path = self.purpose.number;
        let mut splat = Contribution { x, y, path, replay_index: 0, s: *s as u16, t: 1, raw, weight: *weight };
        splat.replay_index = self.record(lens, segment, &splat);
        let Some(splats) = &mut self.purpose.splats else { return };
        splats.push(segment, splat, tracer);
    }

    /// Writes a contribution down in a replay; returns its number there.
    fn record(&mut self, lens: &LensSample, segment: &Segment, splat: &Contribution) -> u32 {
        let Some(replay) = &mut self.purpose.replay else { return 0 };
        let s = usize::from(splat.s);
        // The edge that leaves the light is the connection itself if there is no other.
        let direction = if s == 1 && self.emission.ng.is_some() { lens.wi } else { self.emission.direction };
        let path = self.out.origin.map(|origin| replay.path(Origin { direction, ..origin }, s, 0, lens.p));
        let (scene, mis) = (self.rules.scene, self.rules.mis);
        let factor = |v: &AdjacentVertices| factor_of(scene, self.rules.strategy, mis, v);
        let record = ContributionRecord::of(splat, Some(segment), scene, mis.heuristic);
        replay.contribution(scene, mis, &factor, record, path)
    }

    /// (s, t) = (1, 1): the light itself as the lens sees it.
    pub(super) fn emitter_to_lens(&mut self, u: [f32; 2], tracer: &mut Tracer, sampler: &mut PathSampler) {
        if self.purpose.splats.is_none()
            || !self.rules.mis.techniques.uses(1, 1)
            || self.rules.mis.light_limits.max_edges < 1
            || !self.out.emitter.can_be_hit
            || self.rules.hide_emitters
        {
            return;
        }
        let (scene, emission) = (self.rules.scene, self.emission);
        let sample = match emission.end {
            EmitterVertex::Infinite => scene.camera.sample_lens_at_infinity(-emission.direction, u),
            _ => scene.camera.sample_lens(emission.origin, u),
        };
        let Some(lens) = sample else { return };
        let (emitted, cos, area_jacobian, segment) = match emission.end.segment_end() {
            None => {
                let to_light = -emission.direction;
                (emission.radiance, 1.0, 1.0, Segment { o: lens.p_near, d: to_light, t_max: lens.distance })
            }
            Some(from) => {
                let ng = emission.ng.unwrap_or(lens.wi);
                let cos = ng.dot(lens.wi).max(0.0);
                // The radiance of a textured light is the same in all directions of its front.
                let emitted = if cos > 0.0 { emission.radiance } else { Rgb::BLACK };
                let jacobian = area_jacobian(cos, lens.distance * lens.distance);
                (emitted, cos, jacobian, segment(&from, &SegmentEnd::Free(lens.p_near)))
            }
        };
        let origin = self.out.pdfs.first(1)[0];
        let raw = emitted * (cos * lens.weight / (origin.pdf_fwd.0 * self.light_paths()));
        if raw.is_black() {
            return;
        }
        let medium = match emission.end {
            EmitterVertex::Infinite => scene.surroundings.camera,
            _ => scene.medium_around(self.id),
        };
        let Some(flight) = segment_flight(scene, &segment, medium, tracer) else { return };
        let raw = raw * flight.light;
        let share = flight.transmittance.share();
        let weight = self.lens_weight(1, &lens, area_jacobian, SolidAnglePdf(0.0), share, tracer);
        let [u0, u1, ..] = sampler.rng().next_4();
        self.splat(&LensConnection { s: 1, lens: &lens, segment, raw, weight, u: [u0, u1] }, tracer);
    }

    /// (s, 1): a vertex as the lens sees it.
    pub(super) fn vertex_to_lens(&mut self, vertex: &Vertex, tracer: &mut Tracer, sampler: &mut PathSampler) {
        let s = vertex.index as usize + 1;
        let u = sampler.vertex(vertex.index, SampleSlot::Emitter);
        let p = vertex.position();
        let Some(lens) = self.rules.scene.camera.sample_lens(p, [u[0], u[1]]) else { return };
        let value = crate::path::Scattering::eval(&vertex.scatter, vertex.wo, lens.wi, Transport::Importance);
        let raw = vertex.throughput * value * (lens.weight / self.light_paths());
        if raw.is_black() {
            return;
        }
        let segment = segment(&vertex.place.segment_end(), &SegmentEnd::Free(lens.p_near));
        let (scene, medium) = (self.rules.scene, vertex.medium_towards(lens.wi));
        let Some(flight) = segment_flight(scene, &segment, medium, tracer) else { return };
        let raw = raw * flight.light;
        let rate = flight.edge(None, Some(&vertex.place.stored())).rate;
        let area_jacobian = vertex.place.area_jacobian(lens.wi, lens.distance * lens.distance) * rate;
        let directions = &self.rules.mis.directions;
        let pdf_rev = directions.pdf(p, &vertex.scatter, lens.wi, vertex.wo, Transport::Radiance);
        let share = flight.transmittance.share();
        let weight = self.lens_weight(s, &lens, area_jacobian, pdf_rev, share, tracer);
        self.splat(&LensConnection { s, lens: &lens, segment, raw, weight, u: [u[2], u[3]] }, tracer);
    }

    /// Weight of the technique (s, 1) that connects y_{s−1} with `lens`: `area_jacobian` turns a density per steradian
    /// at the lens into one per unit area at y_{s−1}, from where a walk that came from the lens would go on to the
    /// vertex before with the density `pdf_rev_prev`. `share` of the light passes the media between them.
    fn lens_weight(
        &self,
        s: usize,
        lens: &LensSample,
        area_jacobian: f32,
        pdf_rev_prev: SolidAnglePdf,
        share: f32,
        tracer: &mut Tracer,
    ) -> MisWeight {
        let path = ConnectedPath {
            light: self.out.pdfs.first(s),
            light_end: EndpointPdfs { pdf_rev: AreaPdf(lens.pdf_direction().0 * area_jacobian), pdf_rev_prev },
            eye: &[VertexPdfs::origin(lens.pdf)],
            eye_end: EndpointPdfs::NONE,
            emitter: self.out.emitter,
            connection_factor: 1.0 / share,
            reverse: ReversePath {
                vertices: &[ReverseTransport::default()],
                edges: &[<S::Factor as ConnectionFactor>::Edge::default()],
                last_edge: <S::Factor as ConnectionFactor>::Edge::default(),
                throughput: Rgb::BLACK,
                value: Rgb::BLACK,
            },
        };
        let started = tracer.begin(Work::Weights);
        let weight = self.rules.mis.weight(&path);
        tracer.end(Work::Weights, started);
        weight
    }
}
