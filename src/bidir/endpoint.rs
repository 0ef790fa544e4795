//! Emitters as an eye sub-path meets them: next event (s = 1) and hits (s = 0), for path tracing and all bidirectional
//! methods.

use crate::emit::{DirectSample, Light, LightId};
use crate::math::sampler::{PathSampler, SampleSlot};
use crate::math::{Pmf, Rgb, SolidAnglePdf, Vec3};
use crate::path::{DirectionSampler, Edge, Place, Vertex};
use crate::prepared::PreparedScene;
use crate::shade::Transport;

/// The normal by which a light is chosen at a vertex; none where the choice does not depend on the vertex.
#[inline]
pub fn light_choice_normal(scene: &PreparedScene, vertex: &Vertex) -> Option<Vec3> {
    if scene.lights.uses_light_tree() { vertex.light_choice_normal() } else { None }
}

/// Uses the samples of next event.
///
/// A method can be inlined everywhere by force, a closure cannot, and the walk's code stands at several places.
pub trait DirectSampleSink {
    /// Takes the sample, which was drawn from the light `id` of probability `pmf`.
    fn accept(&mut self, id: LightId, pmf: Pmf, sample: &DirectSample);
}

/// Draws a light and a point of it as seen from `vertex`, whose light choice normal is `normal`, and hands them over
/// with the probability of the light.
#[inline(always)]
pub fn sample_direct(
    scene: &PreparedScene,
    vertex: &Vertex,
    normal: Option<Vec3>,
    sampler: &mut PathSampler,
    sink: &mut impl DirectSampleSink,
) {
    let u = sampler.vertex(vertex.index, SampleSlot::Emitter);
    let p = vertex.position();
    let Some((id, pmf)) = scene.lights.sample_light_from(p, normal, u[0]) else { return };
    // Two copies of the caller's code: the sample of a triangle, by far the most common, stays in registers; others go
    // through memory.
    match scene.lights.get(id) {
        Light::Triangle(light) => {
            if let Some(sample) = light.sample_direct(p, [u[1], u[2]]) {
                sink.accept(id, pmf, &sample);
            }
        }
        light => {
            if let Some(sample) = light.sample_direct(p, [u[1], u[2]]) {
                sink.accept(id, pmf, &sample);
            }
        }
    }
}

/// Light that a sampled point of an emitter sends through a vertex, visibility not yet known.
#[derive(Clone, Copy, Debug)]
pub struct DirectLight {
    /// Density of the light's point per steradian at the vertex, the choice of the light included.
    pub pdf: SolidAnglePdf,
    /// Density per steradian with which the walk draws the direction, without survival of Russian roulette.
    pub scatter_pdf: SolidAnglePdf,
    /// Estimate of the technique by itself.
    pub raw: Rgb,
}

impl DirectLight {
    /// The light of `sample`, which was drawn from a light of probability `pmf`; `None` if the vertex scatters none of
    /// it.
    #[inline(always)]
    pub fn new(
        vertex: &Vertex,
        directions: &impl DirectionSampler,
        sample: &DirectSample,
        pmf: Pmf,
    ) -> Option<DirectLight> {
        let (value, scatter_pdf) =
            directions.eval_and_pdf(vertex.position(), &vertex.scatter, vertex.wo, sample.wi, Transport::Radiance);
        if value.is_black() {
            return None;
        }
        let pdf = sample.pdf * pmf;
        Some(DirectLight { pdf, scatter_pdf, raw: vertex.throughput * value * sample.radiance * (1.0 / pdf.0) })
    }
}

/// The light that a vertex is on and the radiance that it emits towards the vertex before, if there is any.
#[inline]
pub fn emitted_at(scene: &PreparedScene, vertex: &Vertex) -> Option<(LightId, Rgb)> {
    let Place::Surface { hit, .. } = vertex.place else { return None };
    let id = scene.light_of(hit)?;
    let emitted = scene.lights.get(id).emitted([hit.u, hit.v], vertex.wo);
    (!emitted.is_black()).then_some((id, emitted))
}

/// The lights at infinity that a ray in the unit direction `direction` meets, with their radiance.
#[inline]
pub fn for_each_background(scene: &PreparedScene, direction: Vec3, mut each: impl FnMut(LightId, Rgb)) {
    for &id in scene.lights.infinite() {
        let emitted = scene.lights.get(id).emitted([0.0; 2], -direction);
        if !emitted.is_black() {
            each(id, emitted);
        }
    }
}

/// Density per steradian with which next event at the start of `edge` would have drawn the point of the light `id` at
/// its end, in the unit direction `direction`; `normal` is the light choice normal there, `ng` the light's own unit
/// normal at its point.
#[inline]
pub fn next_event_pdf(
    scene: &PreparedScene,
    id: LightId,
    edge: &Edge,
    normal: Option<Vec3>,
    ng: Vec3,
    direction: Vec3,
) -> SolidAnglePdf {
    let lights = &scene.lights;
    lights.get(id).pdf_direct(edge.from, ng, direction, edge.distance) * lights.pmf_light_from(edge.from, normal, id)
}
