//! Eye sub-paths: hits of lights, next event, and connections to a light sub-path.

use super::light_path::{LightPath, LightVertex};
use super::{Bidirectional, Found};
use crate::emit::LightId;
use crate::emit::{DirectSample, LightEnd};
use crate::integrators::Iteration;
use crate::integrators::replay::{Contribution, Replay};
use crate::integrators::resampling::Resampler;
use crate::integrators::resampling::near::Near;
use crate::integrators::resampling::store::LightStore;
use crate::math::sampler::{PathSampler, Purpose};
use crate::math::{AreaPdf, Rgb, SolidAnglePdf, Vec3};
use crate::mis::definition::Joined;
use crate::mis::{self, End, Joint, Node, Proposals, Resampled, Side, Split, Targets, There, Weight, spread};
use crate::path::{Edge, Origin, ShadowQueue, SurfaceVertex, WalkHooks, direct_segment};
use crate::prepared::PreparedScene;
use crate::ray::offset::{SegmentEnd, segment};
use crate::ray::{Tracer, Work};
use crate::shade::{BsdfRef, BsdfSample, SurfacePoint, Transport};

/// Where contributions of an eye sub-path wait and go.
pub(in crate::integrators) struct EyeQueues<'a> {
    pub direct: &'a mut ShadowQueue<Found>,
    pub connection: &'a mut ShadowQueue<Found>,
    /// Takes what has arrived.
    pub found: &'a mut dyn FnMut(Arrival, Found),
}

/// Of a light that was hit: no connection ends there.
static NO_PROPOSALS: Proposals = Proposals::NONE;

/// How a contribution was made known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrators) enum Arrival {
    Hit,
    Direct,
    Connection,
}

/// A light sub-path that an eye vertex is connected to.
pub(in crate::integrators) struct Candidate<'a> {
    /// Its last vertex, y_{s−1}.
    pub vertex: &'a LightVertex,
    /// Its BSDF.
    pub bsdf: BsdfRef<'a>,
    /// Its s vertices.
    pub nodes: &'a [Node],
    /// c_1 of paths with its first two vertices.
    pub next_event: f32,
    /// See `mis::weigh`.
    pub light_can_be_hit: bool,
    /// y_0; nothing if it was drawn from many.
    pub origin: Option<Origin>,
    /// Number of the sub-path among those of the iteration, if it was drawn from many.
    pub number: Option<u32>,
    /// The proposal that drew it, where each is a technique of its own.
    pub proposal: Option<usize>,
    /// The cache points near the eye vertex it was drawn for, and which of them see it, if weights ask and that is known.
    pub near: Option<(Near, u16)>,
    /// One over the expected number of times that this sub-path is drawn for one of its kind.
    pub scale: f32,
}

impl<'a> Candidate<'a> {
    /// A vertex of a sub-path that is joined as it is, and counts `scale` times.
    fn of(path: &'a LightPath, vertex: &'a LightVertex, scale: f32) -> Candidate<'a> {
        Candidate {
            vertex,
            bsdf: path.bsdfs.get(&vertex.bsdf, vertex.ng),
            nodes: path.side.first(vertex.length()),
            next_event: path.next_event,
            light_can_be_hit: path.light_can_be_hit,
            origin: path.origin,
            number: None,
            proposal: None,
            near: None,
            scale,
        }
    }
}

/// A set in which each number of 0 … 63 is by itself with the probability `effort`, a power of two of at most one.
#[inline]
fn thinned(effort: f32, sampler: &mut PathSampler) -> u64 {
    let (mut set, mut share) = (u64::MAX, 1.0);
    while share > effort {
        set &= sampler.rng().next_u64();
        share *= 0.5;
    }
    set
}

/// The hooks of an eye sub-path that is joined with `light`.
pub(in crate::integrators) struct EyeHooks<'a, 'q> {
    pub this: &'a Bidirectional,
    pub scene: &'a PreparedScene,
    pub iteration: &'a Iteration<'a>,
    pub light: &'a LightPath,
    pub side: &'a mut Side,
    /// What is known of the light at the last vertex, on either side of its surface, as far as it was asked for.
    pub known: [Option<There>; 2],
    /// The cache points near the vertex before the last, and which of them see the last, where weights ask for them.
    pub near_before: (Near, u16),
    pub pixel: (u32, u32),
    /// z_0.
    pub lens: Vec3,
    pub queues: &'a mut EyeQueues<'q>,
    pub record: Option<&'a mut Replay>,
}

impl EyeHooks<'_, '_> {
    /// A contribution of the technique (s, t) with its light vertex y_0 and, if its light sub-path was drawn from many, that one's number.
    fn found(
        &mut self,
        (s, t): (usize, usize),
        (origin, number): (Option<Origin>, Option<u32>),
        raw: Rgb,
        weight: Weight,
    ) -> Found {
        let (scene, weigher, pixel, lens) = (self.scene, &self.this.weigher, self.pixel, self.lens);
        let (this, iteration) = (self.this, self.iteration);
        let resampler = &this.resampler;
        let note = self.record.as_mut().map_or(0, |record| {
            // z_1 … z_{t−1}, of which the last is the light's vertex if the walk hit it.
            let n_eye = if s == 0 { t - 2 } else { t - 1 };
            let origin = number.map_or(origin, |number| {
                let (light, origin) = LightStore::retrace(this, iteration, number);
                record.light = light;
                origin
            });
            let path = origin.map(|origin| record.path(origin, s, n_eye, lens));
            let factor_of = |resampled: &Resampled, joined: &Joined| {
                resampler.as_ref().map_or(1.0, |r| r.factor_of(scene, weigher, resampled, joined))
            };
            record.found(scene, weigher, &factor_of, Contribution::new((s, t), pixel, raw, weight.own), path)
        });
        Found { x: pixel.0, y: pixel.1, path: 0, note, s: s as u16, t: t as u16, raw, weight }
    }

    /// (0, t): the walk met the light `id` in `direction`. The vertex on the light is the last of `side`.
    fn hit(&mut self, id: LightId, end: LightEnd, direction: Vec3, (throughput, emitted): (Rgb, Rgb), edge: &Edge) {
        let t = self.side.nodes().len();
        if !self.this.weigher.techniques.uses(0, t) || (t == 2 && self.this.hide_emitters) {
            return;
        }
        let lights = &self.scene.lights;
        let light = lights.get(id);
        let chosen = lights.pmf(id);
        let (position, emission) = light.pdf_emission(-direction);
        let (origin, departure) = (end.vertex_density(position, emission) * chosen, end.departure(position, emission));
        let origin_of = Origin {
            light: id,
            end,
            leaving: -direction,
            flux: end.flux(emitted, -direction, edge.distance, position.0 * emission.0 * chosen.0),
        };
        let next_event = if t >= 3 {
            let direct = light.pdf_direct(edge.from, direction, edge.distance)
                * lights.pmf_from(edge.from, edge.from_normal, id);
            // The direct density is per steradian at z_{t−2}, as the walk's own was before it was converted.
            let walked = edge.pdf.0 * edge.survival;
            let last = self.side.nodes()[t - 1].forward.0;
            mis::next_event(direct, last / walked, origin)
        } else {
            1.0
        };
        let split = Split {
            light: &[],
            light_joint: Joint { arrival: AreaPdf(0.0), departure: SolidAnglePdf(0.0) },
            eye: self.side.nodes(),
            eye_lit: self.side.lit(),
            eye_proposals: self.asks().map(|_| (self.side.proposals(), &NO_PROPOSALS)),
            eye_joint: Joint { arrival: origin, departure },
            next_event,
            light_can_be_hit: true,
            factor: 1.0,
            arriving: origin_of.flux,
            adjoint: Rgb::BLACK,
        };
        let weight = self.this.weigher.weight(&split);
        let found = self.found((0, t), (Some(origin_of), None), throughput * emitted, weight);
        (self.queues.found)(Arrival::Hit, found);
    }

    /// (1, t): a point of a light, drawn as seen from the eye vertex.
    fn next_event(&mut self, vertex: &SurfaceVertex, tracer: &mut Tracer, sampler: &mut PathSampler) {
        let t = vertex.index as usize + 1;
        let u = sampler.vertex(vertex.index, Purpose::Emitter);
        let (lights, point) = (&self.scene.lights, vertex.point);
        let Some((id, picked)) = lights.pick_from(point.p, vertex.light_normal, u[0]) else { return };
        let light = lights.get(id);
        let Some(sample) = light.sample_direct(point.p, [u[1], u[2]]) else { return };
        let (value, bsdf_pdf) = vertex.bsdf.eval_and_pdf(vertex.wo, sample.wi, Transport::Radiance);
        if value.is_black() {
            return;
        }
        let density = sample.pdf * picked;
        let raw = vertex.throughput * value * sample.radiance * (1.0 / density.0);
        if raw.is_black() {
            return;
        }
        let (position, emission) = light.pdf_emission_given_sample(&sample);
        let drawn = position.0 * emission.0 * lights.pmf(id).0;
        let origin = Origin {
            light: id,
            end: sample.end,
            leaving: -sample.wi,
            flux: sample.end.flux(sample.radiance, -sample.wi, sample.distance, drawn),
        };
        let started = tracer.begin(Work::Weights);
        let weight = self.direct_weight(vertex, &origin, &sample, (density, bsdf_pdf), (position, emission));
        tracer.end(Work::Weights, started);
        let segment = direct_segment(point, &sample);
        let found = self.found((1, t), (Some(origin), None), raw, weight);
        let arrived = &mut *self.queues.found;
        self.queues.direct.push(&segment, found, tracer, |f| arrived(Arrival::Direct, f));
    }

    /// Value and density at an eye vertex for light that comes along `from` and goes on to the vertex before; the value only if weights
    /// ask for it.
    fn back(&self, vertex: &SurfaceVertex, from: Vec3) -> (Rgb, SolidAnglePdf) {
        match self.this.weigher.resampled {
            Some(_) => vertex.bsdf.eval_and_pdf(from, vertex.wo, Transport::Importance),
            None => (Rgb::BLACK, vertex.bsdf.pdf(from, vertex.wo, Transport::Importance)),
        }
    }

    /// What is known of the light at the walk's last vertex, on the side of the direction `d`; looked up once.
    fn there(&mut self, point: &SurfacePoint, d: Vec3) -> There {
        let Some(resampler) = &self.this.resampler else { return There::default() };
        *self.known[usize::from(point.ng.dot(d) < 0.0)].get_or_insert_with(|| resampler.there(point, d))
    }

    /// How the cache points near the vertex before see `vertex`, from which they would get the light that comes along `from`; only if
    /// weights ask for it.
    #[inline]
    fn proposals_before(&self, vertex: &SurfaceVertex, from: Vec3) -> Option<Proposals> {
        let (near, seen) = &self.near_before;
        let value = |to: Vec3| vertex.bsdf.eval(from, to, Transport::Importance);
        let at = (vertex.point.p, vertex.point.ng);
        self.asks().map(|resampler| resampler.proposals(near, at, *seen, value))
    }

    /// The resampler, if weights ask cache points.
    #[inline]
    fn asks(&self) -> Option<&Resampler> {
        self.this.resampler.as_ref().filter(|resampler| resampler.settings.form.asks())
    }

    fn direct_weight(
        &self,
        vertex: &SurfaceVertex,
        from: &Origin,
        sample: &DirectSample,
        (density, bsdf_pdf): (SolidAnglePdf, SolidAnglePdf),
        (position, emission): (AreaPdf, SolidAnglePdf),
    ) -> Weight {
        let t = vertex.index as usize + 1;
        let point = vertex.point;
        let cos = point.ng.dot(sample.wi);
        let dist2 = sample.distance * sample.distance;
        let light = self.scene.lights.get(from.light);
        let chosen = self.scene.lights.pmf(from.light);
        // Per steradian at the eye vertex → per unit area at the light vertex.
        let to_area = sample.end.spread(sample.wi, dist2);
        let origin = sample.end.vertex_density(position, emission) * chosen;
        let walked = bsdf_pdf.0 * self.this.weigher.eye_limits.survival(vertex.index, vertex.bsdf);
        let (back, proposals) = (self.back(vertex, sample.wi), self.proposals_before(vertex, sample.wi));
        let split = Split {
            light: &[Node::origin(origin)],
            light_joint: Joint {
                arrival: AreaPdf(if light.is_delta() { 0.0 } else { walked * to_area }),
                departure: SolidAnglePdf(0.0),
            },
            eye: self.side.first(t),
            eye_lit: self.side.lit(),
            eye_proposals: proposals.as_ref().map(|last| (self.side.proposals(), last)),
            eye_joint: Joint { arrival: sample.end.next_density(position, emission, cos, dist2), departure: back.1 },
            next_event: mis::next_event(density, to_area, origin),
            light_can_be_hit: !light.is_delta(),
            factor: 1.0,
            arriving: from.flux,
            adjoint: back.0,
        };
        self.this.weigher.weight(&split)
    }

    /// (s, t) with s ≥ 2: to a vertex of the light sub-path.
    fn connect(&mut self, vertex: &SurfaceVertex, to: &Candidate, tracer: &mut Tracer) {
        let light = to.vertex;
        let t = vertex.index as usize + 1;
        let (z, y) = (vertex.point, light);
        let offset = y.p - z.p;
        let dist2 = offset.length_squared();
        // Points that cannot be told apart have no direction between them. And of a point that lies in another's plane up to the
        // rounding of both, nobody can say on which side it is: two sides of one wall would see each other.
        let clearance = 2.0 * (z.error + y.error);
        let (above_z, above_y) = (z.ng.dot(offset).abs(), y.ng.dot(offset).abs());
        if dist2 <= f32::MIN_POSITIVE || above_z <= clearance || above_y <= clearance {
            return;
        }
        let to_light = offset * (1.0 / dist2.sqrt());
        let (at_eye, eye_pdf) = vertex.bsdf.eval_and_pdf(vertex.wo, to_light, Transport::Radiance);
        if at_eye.is_black() {
            return;
        }
        let (at_light, light_pdf) = to.bsdf.eval_and_pdf(light.wo, -to_light, Transport::Importance);
        let mut raw = vertex.throughput * at_eye * at_light * light.throughput * (to.scale / dist2);
        if raw.is_black() {
            return;
        }
        let weigher = &self.this.weigher;
        let eye_pdf = eye_pdf.0 * weigher.eye_limits.survival(vertex.index, vertex.bsdf);
        let light_pdf = light_pdf.0 * light.survival;
        let (back, proposals) = (self.back(vertex, to_light), self.proposals_before(vertex, to_light));
        let scattered = light.throughput * at_light;
        let arriving = scattered * (1.0 / light_pdf);
        let spread_z = spread(z.ng.dot(to_light), dist2);
        let factor = weigher.resampled.map_or(1.0, |resampled| {
            if let Some(resampler) = self.asks() {
                let (near, seen) = to.near.unwrap_or_else(|| {
                    let near = resampler.near(z, to_light);
                    let seen = resampler.seen_by(&near, &y.end(), tracer);
                    (near, seen)
                });
                let proposals = resampler.proposals_of(&near, light, &to.bsdf, seen);
                // Of what all proposals make of the path, this one makes its share.
                if let Some(proposal) = to.proposal {
                    let shares = resampled.shares(light.throughput, &proposals);
                    raw *= shares.of(proposal) / shares.sum();
                    return shares.sum();
                }
                return weigher.asked(&resampled, light.throughput, &proposals, light.length());
            }
            let brings = Targets {
                scattered: scattered.luminance() * spread_z,
                unscattered: light.throughput.luminance() * y.ng.dot(to_light).abs() * spread_z,
            };
            resampled.factor(brings, dist2, self.there(z, to_light))
        });
        let split = Split {
            light: to.nodes,
            light_joint: Joint {
                arrival: AreaPdf(eye_pdf * spread(y.ng.dot(to_light), dist2)),
                departure: to.bsdf.pdf(-to_light, light.wo, Transport::Radiance),
            },
            eye: self.side.first(t),
            eye_lit: self.side.lit(),
            eye_proposals: proposals.as_ref().map(|last| (self.side.proposals(), last)),
            eye_joint: Joint { arrival: AreaPdf(light_pdf * spread_z), departure: back.1 },
            next_event: to.next_event,
            light_can_be_hit: to.light_can_be_hit,
            factor,
            arriving,
            adjoint: back.0,
        };
        let started = tracer.begin(Work::Weights);
        let weight = self.this.weigher.weight(&split);
        tracer.end(Work::Weights, started);
        let segment = segment(&SegmentEnd::Surface { p: z.p, error: z.error, ng: z.ng }, &y.end());
        let found = self.found((light.length(), t), (to.origin, to.number), raw, weight);
        let arrived = &mut *self.queues.found;
        self.queues.connection.push(&segment, found, tracer, |f| arrived(Arrival::Connection, f));
    }
}

impl WalkHooks for EyeHooks<'_, '_> {
    fn surface(&mut self, vertex: &SurfaceVertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool {
        let (point, edge) = (vertex.point, vertex.edge);
        self.known = [None; 2];
        self.side.arrive_on(vertex, self.this.weigher.light_limits.roulette(vertex.bsdf));
        if let Some(record) = &mut self.record {
            record.vertex(true, vertex);
        }
        if let Some(id) = self.scene.light_of(vertex.hit) {
            let light = self.scene.lights.get(id);
            let emitted = light.emitted([vertex.hit.u, vertex.hit.v], vertex.wo);
            if !emitted.is_black() {
                let end = light.end_at(point.p, point.error);
                self.hit(id, end, -vertex.wo, (vertex.throughput, emitted), edge);
            }
        }
        if vertex.bsdf.is_black() {
            return false;
        }
        if vertex.index > 1
            && let Some(resampler) = self.asks()
        {
            let end = SegmentEnd::Surface { p: point.p, error: point.error, ng: point.ng };
            self.near_before.1 = resampler.seen_by(&self.near_before.0, &end, tracer);
        }
        let max_edges = self.this.weigher.eye_limits.max_edges;
        if vertex.index < max_edges && vertex.bsdf.connectable() {
            let t = vertex.index as usize + 1;
            let this = self.this;
            let techniques = &this.weigher.techniques;
            if techniques.uses(1, t) {
                self.next_event(vertex, tracer, sampler);
            }
            let possible = |s: usize| (s + t - 1) as u64 <= u64::from(max_edges) && techniques.uses(s, t);
            let light = self.light;
            let started = tracer.begin(Work::Connections);
            match &this.resampler {
                None if light.vertices.is_empty() => {}
                None => {
                    let effort = this.effort.connections;
                    let chosen = thinned(effort, sampler);
                    for (number, y) in light.vertices.iter().enumerate() {
                        if chosen >> (number % 64) & 1 == 1 && possible(y.length()) {
                            self.connect(vertex, &Candidate::of(light, y, 1.0 / effort), tracer);
                        }
                    }
                }
                Some(resampler) => {
                    let (place, effort) = ((vertex.point, vertex.wo), this.effort.connections);
                    // Next event leaves the last of its numbers.
                    let [.., offset] = sampler.vertex(vertex.index, Purpose::Emitter);
                    resampler.draw_all(place, (offset, sampler.rng()), effort, possible, |candidate| {
                        self.connect(vertex, &candidate, tracer);
                    });
                }
            }
            tracer.end(Work::Connections, started);
        }
        (vertex.index as usize + 1) < self.this.most_eye_vertices
    }

    fn leaving(&mut self, vertex: &SurfaceVertex, sample: &BsdfSample) {
        let reverse = self.side.leave(vertex, sample, Transport::Importance);
        self.this.weigher.sum_up(self.side.nodes_mut(), End::Lens);
        // Nothing else asks for what light would do here on its way.
        if self.this.weigher.resampled.is_some() {
            let there = self.there(vertex.point, sample.wi);
            let value = if sample.delta {
                sample.reverse_delta
            } else {
                vertex.bsdf.eval(sample.wi, vertex.wo, Transport::Importance)
            };
            if let Some(lit) = self.side.last_lit_mut() {
                (lit.there, lit.adjoint, lit.reverse) = (there, value, reverse.0);
            }
        }
        if let Some(resampler) = self.asks() {
            let near = resampler.near(vertex.point, sample.wi);
            if vertex.index > 1
                && !sample.delta
                && let Some(proposals) = self.proposals_before(vertex, sample.wi)
            {
                self.side.propose(proposals);
            }
            self.near_before = (near, 0);
        }
        if let Some(record) = &mut self.record {
            record.leaving(true, sample);
        }
    }

    fn escaped(&mut self, _index: u32, direction: Vec3, throughput: Rgb, edge: &Edge) {
        let lights = &self.scene.lights;
        self.side.arrive_at_infinity(edge);
        for &id in lights.infinite() {
            let emitted = lights.get(id).emitted([0.0; 2], -direction);
            if !emitted.is_black() {
                self.hit(id, LightEnd::Infinite, direction, (throughput, emitted), edge);
            }
        }
    }
}
