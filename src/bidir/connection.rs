//! Connections with s ≥ 2 and t ≥ 2: the contribution β_L ρ(y_{s−1}) G V ρ(z_{t−1}) β_E.

use super::contribution::ContributionKind;
use super::eye_subpath::{EyeHooks, PathOrigin};
use super::scratch::ContributionSink;
use super::strategy::{Candidate, ConnectionStrategy};
use crate::math::{AreaPdf, Rgb, Vec3};
use crate::mis::{ConnectedPath, ConnectionFactor, EndpointPdfs, IncidentSubpath, ResamplingTarget};
use crate::path::{DirectionSampler, StoredPlace, Vertex, segment_flight};
use crate::ray::offset::segment;
use crate::ray::{Tracer, Work};
use crate::shade::Transport;

/// Unit direction from `z` to `y` and the square of their distance; `None` if they cannot be connected.
///
/// Points that cannot be told apart have no direction between them. A point that lies in the plane of the other up to
/// the rounding of both is on neither side of it: two sides of one wall would see each other.
#[inline]
fn edge_between(z: &StoredPlace, y: &StoredPlace) -> Option<(Vec3, f32)> {
    let offset = y.position() - z.position();
    let dist2 = offset.length_squared();
    if dist2 <= f32::MIN_POSITIVE {
        return None;
    }
    let (above_z, above_y) = (z.height(offset), y.height(offset));
    let clearance = 2.0 * (above_z.map_or(0.0, |h| h.1) + above_y.map_or(0.0, |h| h.1));
    let in_plane = |height: Option<(f32, f32)>| height.is_some_and(|(above, _)| above <= clearance);
    (!in_plane(above_z) && !in_plane(above_y)).then(|| (offset * (1.0 / dist2.sqrt()), dist2))
}

impl<S: ConnectionStrategy, K: ContributionSink> EyeHooks<'_, S, K> {
    /// (s, t) with s ≥ 2: to the last vertex of a light sub-path.
    pub(super) fn connect(&mut self, vertex: &Vertex, to: &Candidate<S::Lookup>, tracer: &mut Tracer) {
        let (y, z) = (to.vertex, vertex.place.stored());
        let Some((to_light, dist2)) = edge_between(&z, &y.place) else { return };
        let mis = self.rules.mis;
        let (p, q) = (z.position(), y.place.position());
        let (at_eye, eye_pdf) =
            mis.directions.eval_and_pdf(p, &vertex.scatter, vertex.wo, to_light, Transport::Radiance);
        if at_eye.is_black() {
            return;
        }
        let (at_light, light_pdf) = mis.directions.eval_and_pdf(q, &to.bsdf, y.wo, -to_light, Transport::Importance);
        let mut raw = vertex.throughput * at_eye * at_light * y.throughput * (to.scale / dist2); // [RISBPT eq. 6]
        if raw.is_black() {
            return;
        }
        let segment = segment(&z.segment_end(), &y.place.segment_end());
        let (scene, medium) = (self.rules.iteration.scene, vertex.medium_towards(to_light));
        let Some(passing) = segment_flight(scene, &segment, medium, tracer) else { return };
        let flight = passing.edge(Some(&y.place), Some(&z));
        raw *= passing.light;
        let eye_pdf = eye_pdf.0 * mis.eye_limits.survival(vertex.index, &vertex.scatter);
        let light_pdf = light_pdf.0 * y.survival;
        let (value, pdf_rev_prev) = self.reverse_scatter(vertex, to_light);
        let edge_before = self.edge_before(vertex, to_light);
        let scattered = y.throughput * at_light;
        let throughput = scattered * flight.throughput() * (1.0 / light_pdf);
        let jacobian_z = z.area_jacobian(to_light, dist2);
        let (connection_factor, share) = if S::Factor::IS_ONE {
            (1.0, 1.0)
        } else {
            let target_over_pdf = ResamplingTarget {
                full: scattered.luminance() * jacobian_z,
                first_stage: y.throughput.luminance() * y.place.cosine(to_light).abs() * jacobian_z,
            };
            let light = IncidentSubpath { s: y.length(), throughput: y.throughput, target_over_pdf, distance2: dist2 };
            self.connection_factor(vertex, to, to_light, &light, tracer)
        };
        if to.selected.is_some() {
            raw *= share;
        }
        let t = vertex.index as usize + 1;
        let path = ConnectedPath {
            light: to.pdfs,
            light_end: EndpointPdfs {
                pdf_rev: AreaPdf(eye_pdf * y.place.area_jacobian(to_light, dist2) * flight.rate_back),
                pdf_rev_prev: mis.directions.pdf(q, &to.bsdf, -to_light, y.wo, Transport::Radiance),
            },
            eye: self.pdfs.pdfs.first(t),
            eye_end: EndpointPdfs { pdf_rev: AreaPdf(light_pdf * jacobian_z * flight.rate), pdf_rev_prev },
            emitter: to.emitter,
            connection_factor: connection_factor / passing.transmittance.share(),
            reverse: self.reverse_path(t, edge_before, throughput, value),
        };
        let started = tracer.begin(Work::Weights);
        let weight = mis.weight(&path);
        tracer.end(Work::Weights, started);
        let origin = to.number.map_or(PathOrigin::Known(to.origin), PathOrigin::Stored);
        let contribution = self.contribution((y.length(), t), origin, (raw, weight), Some(&segment));
        let (sink, heuristic) = (&mut *self.sink, mis.heuristic);
        self.queues.connection.push(&segment, contribution, tracer, |c, transmittance| {
            sink.add(ContributionKind::Connection, c.through(transmittance, heuristic));
        });
    }

    /// c of a connection, and the share of it that belongs to the cache point that drew the candidate.
    fn connection_factor(
        &mut self,
        vertex: &Vertex,
        to: &Candidate<S::Lookup>,
        to_light: Vec3,
        light: &IncidentSubpath,
        tracer: &mut Tracer,
    ) -> (f32, f32) {
        let (y, strategy) = (to.vertex, self.rules.strategy);
        let lookup = to.lookup.unwrap_or_else(|| {
            let mut lookup = self.lookup(vertex, to_light);
            strategy.see(&mut lookup, &y.place.segment_end(), tracer);
            lookup
        });
        let value = |d: Vec3| -> Rgb { to.bsdf.eval(y.wo, d, Transport::Importance) };
        let edge = strategy.edge(&lookup, &y.place, value);
        match to.selected {
            Some(cache) => self.rules.mis.factor.c_and_share(light, &edge, cache),
            None => (self.rules.mis.factor.c(light, &edge), 1.0),
        }
    }
}
