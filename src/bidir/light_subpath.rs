//! Light sub-paths: their densities, the vertices that can be connected to, and their connections to the lens (`lens`).

use super::endpoint::light_choice_normal;
use super::replay::{Replay, SubpathKind};
use super::scratch::SplatQueue;
use super::strategy::ConnectionStrategy;
use super::vertex::LightVertex;
use crate::emit::{EmissionSample, EmitterVertex, LightId};
use crate::math::sampler::PathSampler;
use crate::math::{AreaPdf, Pmf, Rgb, Vec3};
use crate::media::MediumNumber;
use crate::mis::{
    ConnectionFactor, EmitterFactors, IncidentSubpath, MisContext, PathEnd, ResamplingTarget, SubpathPdfs,
    next_event_factor,
};
use crate::path::{Edge, Origin, PathLimits, Vertex, WalkHooks, WalkRules, WalkStart, walk};
use crate::prepared::PreparedScene;
use crate::ray::offset::offset_point;
use crate::ray::{Ray, RayKind, T_MIN, Tracer};
use crate::shade::{Bsdf, BsdfPool, BsdfSample, Transport};

/// A light sub-path, with what connections to it need.
#[derive(Clone, Debug, Default)]
pub struct LightSubpath {
    /// Densities of all its vertices.
    pub pdfs: SubpathPdfs,
    /// Vertices that can be connected to.
    pub vertices: Vec<LightVertex>,
    /// The BSDFs of these.
    pub bsdfs: BsdfPool,
    /// c_0 and c_1 of paths through y_1.
    pub emitter: EmitterFactors,
    /// y_0; `None` if no light was drawn.
    pub origin: Option<Origin>,
}

impl LightSubpath {
    /// Forgets the vertices, but keeps their memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.bsdfs.clear();
        self.origin = None;
    }
}

/// The uses of a light sub-path.
#[derive(Default)]
pub struct LightSubpathUse<'a> {
    /// Number of the sub-path among those of the iteration.
    pub number: u32,
    /// Takes the connections of its vertices to the lens, if they are wanted.
    pub splats: Option<&'a mut SplatQueue>,
    /// Vertices are kept for connections.
    pub keep_vertices: bool,
    /// Writes down everything.
    pub replay: Option<&'a mut Replay>,
}

/// The rules that the light sub-paths of an iteration follow.
pub struct LightSubpathTracer<'a, S: ConnectionStrategy> {
    /// The scene.
    pub scene: &'a PreparedScene,
    /// Limits and weights.
    pub mis: &'a MisContext<S::Factor>,
    /// Knowledge that connection factors ask for.
    pub strategy: &'a S,
    /// Emitters that the lens sees directly are black.
    pub hide_emitters: bool,
}

impl<S: ConnectionStrategy> LightSubpathTracer<'_, S> {
    /// Traces a light sub-path into `out`.
    pub fn trace(
        &self,
        sampler: &mut PathSampler,
        tracer: &mut Tracer,
        out: &mut LightSubpath,
        purpose: LightSubpathUse,
    ) {
        out.clear();
        let u = sampler.origin();
        let v = sampler.origin_direction();
        let (lights, distribution) = (&self.scene.lights, &self.mis.emission);
        let Some((id, chosen)) = distribution.sample_light(lights, u[0]) else { return };
        let light = lights.get(id);
        if self.scene.is_cut_off(light) {
            return;
        }
        let Some(emission) = distribution.sample_ray(lights, id, [u[1], u[2]], [v[0], v[1]]) else { return };
        out.pdfs.begin(emission.pdf_vertex() * chosen);
        out.emitter = EmitterFactors { can_be_hit: !light.is_delta(), next_event: 0.0 };
        self.mis.accumulate_partial_sums(out.pdfs.all_mut(), PathEnd::Light(out.emitter));
        let throughput = emission.flux() * (1.0 / chosen.0);
        out.origin = Some(Origin { light: id, end: emission.end, direction: emission.direction, throughput });
        // Factors that depend on light vertices need the vertex before each.
        let keep_vertices = purpose.keep_vertices || S::NEEDS_LIGHT_VERTEX;
        let purpose = LightSubpathUse { keep_vertices, ..purpose };
        let mut hooks =
            LightHooks { rules: self, id, chosen, emission: &emission, luminance_before: 0.0, out, purpose };
        hooks.emitter_to_lens([v[2], v[3]], tracer, sampler);
        if throughput.is_black() || self.mis.light_limits.max_edges < 2 {
            return;
        }
        // One edge of a path is left for the connection.
        let limits = PathLimits { max_edges: self.mis.light_limits.max_edges - 1, ..self.mis.light_limits };
        let rules = WalkRules { limits, mode: Transport::Importance, directions: &self.mis.directions };
        let medium = self.scene.medium_around(id);
        walk(self.scene, start(&emission, throughput, medium), &rules, tracer, sampler, &mut hooks);
    }
}

/// The walk that leaves a light.
fn start(emission: &EmissionSample, throughput: Rgb, medium: MediumNumber) -> WalkStart {
    let &EmissionSample { origin, error, ng, direction, .. } = emission;
    let o = ng.map_or(origin, |ng| offset_point(origin, error, ng, direction));
    let ray = Ray { o, d: direction, t_min: T_MIN, t_max: f32::INFINITY };
    WalkStart { ray, throughput, pdf: emission.pdf_direction, kind: RayKind::Light, medium }
}

/// The hooks of a light sub-path.
pub(super) struct LightHooks<'a, 'r, S: ConnectionStrategy> {
    pub rules: &'a LightSubpathTracer<'a, S>,
    pub id: LightId,
    /// Probability of the light.
    pub chosen: Pmf,
    pub emission: &'a EmissionSample,
    /// Luminance of β_L on arriving at the vertex before.
    pub luminance_before: f32,
    pub out: &'a mut LightSubpath,
    pub purpose: LightSubpathUse<'r>,
}

impl<S: ConnectionStrategy> LightHooks<'_, '_, S> {
    /// c of the connection of the vertex before to `vertex`, where the sub-path arrived with the area density
    /// `pdf_fwd`.
    #[inline]
    fn connection_factor(&self, vertex: &Vertex, pdf_fwd: AreaPdf, tracer: &mut Tracer) -> f32 {
        if S::Factor::IS_ONE {
            return 1.0;
        }
        let (strategy, factor) = (self.rules.strategy, &self.rules.mis.factor);
        let place = vertex.place.stored();
        let distance2 = vertex.edge.distance * vertex.edge.distance;
        let jacobian = place.area_jacobian(vertex.wo, distance2);
        // The light that the sub-path brings here is its throughput here times the density of having come here.
        let target_over_pdf = ResamplingTarget {
            full: vertex.unattenuated.luminance() * pdf_fwd.0,
            first_stage: self.luminance_before * self.out.pdfs.cos_leaving().abs() * jacobian,
        };
        let mut light =
            IncidentSubpath { s: vertex.index as usize, throughput: Rgb::BLACK, target_over_pdf, distance2 };
        let mut lookup = strategy.look_up(&place, vertex.wo);
        if !S::NEEDS_LIGHT_VERTEX {
            return factor.c(&light, &strategy.edge(&lookup, &place, |_| Rgb::BLACK));
        }
        // A vertex that cannot be connected to was not kept, and its factor is not used.
        let Some(y) = self.out.vertices.last().filter(|y| y.s == vertex.index) else { return 1.0 };
        let bsdf = y.bsdf_in(&self.out.bsdfs);
        strategy.see(&mut lookup, &y.place.segment_end(), tracer);
        light.throughput = y.throughput;
        factor.c(&light, &strategy.edge(&lookup, &y.place, |to| bsdf.eval(y.wo, to, Transport::Importance)))
    }

    /// c_1 of paths whose first two vertices are the light's and `vertex`; `area_jacobian` turns a density per
    /// steradian at `vertex` into one per unit area at the light.
    fn next_event_factor(&self, vertex: &Vertex, area_jacobian: f32) -> f32 {
        let (scene, p) = (self.rules.scene, vertex.position());
        let chosen = scene.lights.pmf_light_from(p, light_choice_normal(scene, vertex), self.id);
        let light = scene.lights.get(self.id);
        if light.is_delta() {
            return chosen.0 / self.chosen.0;
        }
        let distance = match self.emission.end {
            EmitterVertex::Infinite => f32::INFINITY,
            _ => vertex.edge.distance,
        };
        let direct = light.pdf_direct(p, self.emission.end.normal(), vertex.wo, distance) * chosen;
        next_event_factor(direct, area_jacobian, self.out.pdfs.first(1)[0].pdf_fwd)
    }

    /// Takes down the densities of the walk's arrival at `vertex`.
    fn arrive(&mut self, vertex: &Vertex, tracer: &mut Tracer) {
        let eye_survival = self.rules.mis.eye_limits.roulette_survival(&vertex.scatter);
        if vertex.index == 1 {
            let (emission, dist2) = (self.emission, vertex.edge.distance * vertex.edge.distance);
            let cos = vertex.place.cosine(vertex.wo);
            let pdf_fwd = emission.end.pdf_next_vertex(emission.pdf_position, emission.pdf_direction, cos, dist2);
            let to_light = emission.end.area_jacobian(emission.direction, dist2);
            self.out.pdfs.arrive_with(vertex.edge, pdf_fwd, to_light, eye_survival);
            self.out.emitter.next_event = self.next_event_factor(vertex, to_light);
        } else {
            let pdf_fwd = self.out.pdfs.arrive(vertex, eye_survival);
            let factor = self.connection_factor(vertex, pdf_fwd, tracer);
            if let Some(last) = self.out.pdfs.last_mut() {
                last.connection_factor *= factor;
            }
        }
    }

    fn keep(&mut self, vertex: &Vertex, bsdf: &Bsdf) {
        self.out.vertices.push(LightVertex {
            place: vertex.place.stored(),
            wo: vertex.wo,
            throughput: vertex.throughput,
            survival: self.rules.mis.light_limits.survival(vertex.index, &vertex.scatter),
            s: vertex.index + 1,
            bsdf: self.out.bsdfs.store(bsdf),
        });
    }
}

impl<S: ConnectionStrategy> WalkHooks for LightHooks<'_, '_, S> {
    #[inline(always)]
    fn vertex(&mut self, vertex: &Vertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool {
        self.arrive(vertex, tracer);
        if let Some(replay) = &mut self.purpose.replay {
            replay.vertex(SubpathKind::Light, self.rules.scene, vertex);
        }
        if vertex.scatter.is_black() {
            return false;
        }
        if vertex.scatter.connectable() {
            if self.purpose.splats.is_some() && self.rules.mis.techniques.uses(vertex.index as usize + 1, 1) {
                self.vertex_to_lens(vertex, tracer, sampler);
            }
            if self.purpose.keep_vertices {
                self.keep(vertex, vertex.scatter.bsdf());
            }
        }
        true
    }

    fn leaving(&mut self, vertex: &Vertex, sample: &BsdfSample) {
        let mis = self.rules.mis;
        self.luminance_before = vertex.throughput.luminance();
        self.out.pdfs.leave(vertex, sample, &mis.directions, Transport::Radiance);
        mis.accumulate_partial_sums(self.out.pdfs.all_mut(), PathEnd::Light(self.out.emitter));
        if let Some(replay) = &mut self.purpose.replay {
            replay.leaving(SubpathKind::Light, sample);
        }
    }

    fn escaped(&mut self, _index: u32, _direction: Vec3, _throughput: Rgb, _edge: &Edge) {}
}
