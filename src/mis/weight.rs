//! The weight of one sampled path among all techniques that make it.
//!
//! A path x̄ = v_0 … v_k with v_0 on a light and v_k on the lens is made by the techniques (s, k + 1 − s). Each takes
//! n_s samples with the density p_s = Π_{i<s} p_L(v_i) · Π_{i≥s} p_E(v_i) times a factor c_s, and gets the weight
//!
//! w_s = (n_s c_s p_s)^β / Σ_i (n_i c_i p_i)^β   (Veach 1997, eqs. 9.8 and 10.9).
//!
//! Neighbours differ by one vertex, p_{s+1} / p_s = p_L(v_s) / p_E(v_s), so the sum is taken over products of the
//! ratios that the two [`SubpathPdfs`](super::SubpathPdfs) keep, going outwards from the connection. Only four ratios
//! depend on the connection itself: those of its two end vertices and of the two vertices behind them. The terms of
//! techniques farther out are summed up once, as the sub-path is made ([`MisContext::accumulate_partial_sums`]), so
//! that a connection costs the same for sub-paths of any length.
//!
//! Factors: c_0 = 0 if no ray can meet the light by chance; c_1 = p_direct(v_0 | v_1) / p_L(v_0) where t ≥ 2, since
//! those techniques draw their light point as seen from v_1 (*next event*) and not as light sub-paths do; c of
//! connections is a [`ConnectionFactor`]; all others are 1, or 0 if an end of the connection is a delta event. Roulette
//! is part of the densities: its first vertex is counted from the end that walks.
//!
//! Masks: a walk makes an edge with a density that has the edge's transmittance τ as a factor, a connection does not
//! (`ray::transmittance`). All techniques of a path walk all of its edges but their own connection: c has the factor
//! 1/τ of that edge, and s = 0, which has none, no such factor. The edges of sub-paths know it; that of the connection
//! itself is found only after the weight, which [`MisWeight::through`] then corrects.

use super::factor::{ConnectionFactor, IncidentSubpath, ResamplingTarget};
use super::pdfs::{ReverseTransport, VertexPdfs};
use super::{Heuristic, Techniques};
use crate::emit::EmissionDistribution;
use crate::math::{AreaPdf, Rgb, SolidAnglePdf};
use crate::path::{PathLimits, ScatterSampler};
use crate::ray::Transmittance;

/// Densities with which the walk from the other end would have made the last two vertices of a sub-path.
#[derive(Clone, Copy, Debug)]
pub struct EndpointPdfs {
    /// Area density of the last vertex, survival at the other sub-path's last vertex included.
    pub pdf_rev: AreaPdf,
    /// Density per steradian at the last vertex of the direction to the vertex before it. (For a light that was hit:
    /// its emission's density of direction; of a light at infinity: the density of its disk.)
    pub pdf_rev_prev: SolidAnglePdf,
}

impl EndpointPdfs {
    /// The densities of a sub-path without vertices.
    pub const NONE: EndpointPdfs = EndpointPdfs { pdf_rev: AreaPdf(0.0), pdf_rev_prev: SolidAnglePdf(0.0) };
}

/// The factors of techniques in which a path's emitter is met by an eye sub-path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EmitterFactors {
    /// c_0 = 1: rays can meet the emitter by chance.
    pub can_be_hit: bool,
    /// c_1: density of v_0 under next event from v_1 over its density as origin of a light sub-path.
    pub next_event: f32,
}

/// c_1 of a light with extent: the density per steradian with which next event draws its point from the next vertex,
/// over the area density `origin` with which light sub-paths begin there; `area_jacobian` turns the one measure into
/// the other.
#[inline]
pub fn next_event_factor(direct: SolidAnglePdf, area_jacobian: f32, origin: AreaPdf) -> f32 {
    direct.0 * area_jacobian / origin.0
}

/// Light on its way up the eye sub-path of a path. Unused where all connection factors are one.
pub struct ReversePath<'a, F: ConnectionFactor> {
    /// Value and density at each eye vertex but the last.
    pub vertices: &'a [ReverseTransport],
    /// Arguments of the factor of the edge from each eye vertex but the last to the vertex before.
    pub edges: &'a [F::Edge],
    /// Argument of the factor of the edge from z_{t−1} to z_{t−2}.
    pub last_edge: F::Edge,
    /// β_L of the light sub-path on arriving at z_{t−1}; if that is on the light itself, on arriving at z_{t−2}.
    pub throughput: Rgb,
    /// Adjoint value of z_{t−1}, cosine weighted.
    pub value: Rgb,
}

/// A path as it was sampled: a light sub-path of s vertices and an eye sub-path of t vertices.
pub struct ConnectedPath<'a, F: ConnectionFactor> {
    /// The vertices of the light sub-path.
    pub light: &'a [VertexPdfs],
    /// How the eye sub-path would have gone on into them.
    pub light_end: EndpointPdfs,
    /// The vertices of the eye sub-path.
    pub eye: &'a [VertexPdfs],
    /// How the light sub-path would have gone on into them; unused if t = 1.
    pub eye_end: EndpointPdfs,
    /// c_0 and c_1.
    pub emitter: EmitterFactors,
    /// c of this connection, if s ≥ 2 and t ≥ 2, else 1; over the transmittance of its edge, where that is known (in
    /// scenes with media).
    pub connection_factor: f32,
    /// Arguments of the factors of connections along the eye sub-path.
    pub reverse: ReversePath<'a, F>,
}

/// All that weights depend on besides the path.
#[derive(Clone, Debug)]
pub struct MisContext<F> {
    /// Techniques and their samples.
    pub techniques: Techniques,
    /// β.
    pub heuristic: Heuristic,
    /// Limits of eye sub-paths. Their `rr_depth` is that of light sub-paths, too.
    pub eye_limits: PathLimits,
    /// Limits of light sub-paths.
    pub light_limits: PathLimits,
    /// How light sub-paths begin.
    pub emission: EmissionDistribution,
    /// How walks draw directions.
    pub directions: ScatterSampler,
    /// c of connections.
    pub factor: F,
}

/// The end of a path at which a sub-path begins.
#[derive(Clone, Copy, Debug)]
pub enum PathEnd {
    /// The light.
    Light(EmitterFactors),
    /// The lens.
    Lens,
}

/// Weights of the techniques of a path, which sum to one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MisWeight {
    /// The technique that sampled the path.
    pub own: f32,
    /// All techniques with t = 1.
    pub light_image: f32,
    /// All techniques with s ≥ 2 and t ≥ 2.
    pub connections: f32,
}

impl MisWeight {
    /// Weights of a path that the technique (s, t) has made by a connection of this transmittance, from those where it
    /// is one: the densities of all other techniques have it as a factor.
    pub fn through(self, transmittance: Transmittance, heuristic: Heuristic, (s, t): (usize, usize)) -> MisWeight {
        let power = heuristic.power(transmittance.share());
        let scale = 1.0 / (self.own + (1.0 - self.own) * power);
        let of = |of_group: f32, own: bool| match own {
            true => (self.own + (of_group - self.own) * power) * scale,
            false => of_group * power * scale,
        };
        MisWeight {
            own: self.own * scale,
            light_image: of(self.light_image, group(s, t) == LIGHT_IMAGE),
            connections: of(self.connections, group(s, t) == CONNECTIONS),
        }
    }
}

/// Sums of effective densities by group of techniques.
const GROUPS: usize = 3;
const OTHERS: usize = 0;
const LIGHT_IMAGE: usize = 1;
const CONNECTIONS: usize = 2;

/// The group of the technique (s, t).
#[inline]
fn group(s: usize, t: usize) -> usize {
    match (s, t) {
        (_, 1) => LIGHT_IMAGE,
        (2.., _) => CONNECTIONS,
        _ => OTHERS,
    }
}

/// n_s c_s of a technique, with its group.
struct Term {
    effective_count: f32,
    group: usize,
}

impl<F: ConnectionFactor> MisContext<F> {
    /// n_s c_s, connectability apart; `connection_factor` is 1/τ of the connection, times c where s ≥ 2 and t ≥ 2.
    #[inline]
    fn effective_count(&self, s: usize, t: usize, emitter: EmitterFactors, connection_factor: f32) -> f32 {
        let n = self.techniques.count(s, t);
        match s {
            0 if !emitter.can_be_hit => 0.0,
            0 => n,
            1 if t >= 2 => n * emitter.next_event * connection_factor,
            _ => n * connection_factor,
        }
    }

    /// Survival at a vertex that is number `index` counted from the other end.
    #[inline]
    fn survival(&self, vertex: &VertexPdfs, index: usize) -> f32 {
        if index >= self.eye_limits.rr_depth as usize { vertex.survival } else { 1.0 }
    }

    /// Effective counts do not depend on the other sub-path, so that partial sums can be taken.
    #[inline]
    fn has_partial_sums(&self, light: bool) -> bool {
        // Along an eye sub-path, c of a resampled connection depends on the light that arrives.
        self.techniques.regular() && (light || F::IS_ONE)
    }

    /// Sums up, once a walk has left v_i, the last of `vertices`, the effective densities of the techniques that use n
    /// ≤ i of its vertices, each relative to the density of the one that uses i of them, counted once:
    ///
    /// S_i = (n c)(i) + (p_rev / p_fwd)(v_{i−1}) S_{i−1}.
    ///
    /// There are two sums, of connections and of all others, which are of one group on each sub-path. Roulette is taken
    /// as played at all these vertices; where S_i is used, it is.
    #[inline]
    pub fn accumulate_partial_sums(&self, vertices: &mut [VertexPdfs], end: PathEnd) {
        if !self.has_partial_sums(matches!(end, PathEnd::Light(_))) {
            return;
        }
        let Some(i) = vertices.len().checked_sub(1) else { return };
        // Any number from two on stands for the vertices of the other sub-path.
        let (s, t, emitter) = match end {
            PathEnd::Light(emitter) => (i, 2, emitter),
            PathEnd::Lens => (2, i, EmitterFactors { can_be_hit: false, next_event: 0.0 }),
        };
        let mut sums = [0.0; 2];
        if i == 0 || vertices[i - 1].connectable && vertices[i].connectable {
            let count = self.effective_count(s, t, emitter, vertices[i].connection_factor);
            sums[usize::from(i >= 2)] = self.heuristic.power(count);
        }
        if i > 0 {
            let ratio = self.heuristic.power(vertices[i - 1].rev_over_fwd * vertices[i].survival);
            for (sum, before) in sums.iter_mut().zip(vertices[i - 1].partial_sums) {
                // Zero stays zero, also where the ratio is infinite.
                if before > 0.0 {
                    *sum += ratio * before;
                }
            }
        }
        vertices[i].partial_sums = sums;
    }

    /// Adds to `sums`, by group, the effective densities of the techniques that have fewer than all vertices of
    /// `subpath`, relative to the density of the technique that has all of them; `other` is the number of vertices of
    /// the other sub-path, `term(n)` the technique with n vertices of this one. `partial` is the group of the partial
    /// sums beside connections, where these exist.
    #[inline]
    fn add_outward(
        &self,
        subpath: &[VertexPdfs],
        end: &EndpointPdfs,
        other: usize,
        partial: Option<usize>,
        sums: &mut [f32; GROUPS],
        mut term: impl FnMut(usize) -> Term,
    ) {
        let n = subpath.len();
        let mut product = 1.0;
        for i in (0..n).rev() {
            // p_rev / p_fwd of vertex i.
            let ratio = if i + 1 == n {
                end.pdf_rev.0 / subpath[i].pdf_fwd.0
            } else if i + 2 == n {
                let last = &subpath[n - 1];
                end.pdf_rev_prev.0 * self.survival(last, other) * last.area_jacobian / subpath[i].pdf_fwd.0
            } else {
                subpath[i].rev_over_fwd * self.survival(&subpath[i + 1], n - 2 - i + other)
            };
            product *= self.heuristic.power(ratio);
            if product == 0.0 {
                break;
            }
            if let Some(partial) = partial
                && i + 2 < n
                && n - 2 - i + other >= self.eye_limits.rr_depth as usize
                && subpath[i].partial_sums.iter().all(|sum| sum.is_finite())
            {
                for (group, sum) in [partial, CONNECTIONS].into_iter().zip(subpath[i].partial_sums) {
                    if sum > 0.0 {
                        sums[group] += product * sum;
                    }
                }
                break;
            }
            // The technique's connection is the edge from vertex i − 1 to vertex i of this sub-path.
            let connectable = i == 0 || (subpath[i - 1].connectable && (i + 1 == n || subpath[i].connectable));
            let Term { effective_count, group } = term(i);
            if connectable {
                let power = self.heuristic.power(effective_count);
                if power > 0.0 {
                    sums[group] += product * power; // [Veach eq. 10.9]
                }
            }
        }
    }

    /// c of the technique with n eye vertices, asked for from the connection outwards: `throughput` is β_L of light on
    /// its way up the eye sub-path, on arriving at z_n, and is carried on to z_{n−1}.
    fn eye_factor(&self, path: &ConnectedPath<F>, n: usize, throughput: &mut Rgb) -> f32 {
        let (eye, s) = (path.eye, path.light.len());
        let (t, vertex, reverse) = (eye.len(), &eye[n], &path.reverse.vertices[n]);
        let (value, pdf) = match n + 1 == t {
            // z_{t−1} is on the light, and the throughput given is that at z_{t−2}.
            true if s == 0 => return 1.0,
            true => (path.reverse.value, path.eye_end.pdf_rev_prev.0),
            false => (reverse.value, reverse.pdf),
        };
        let (scattered, arriving) = (*throughput * value, *throughput);
        // Targets of resampling know nothing of media.
        let area_jacobian = vertex.area_jacobian / reverse.flight.rate_back;
        let target_over_pdf = ResamplingTarget {
            full: scattered.luminance() * area_jacobian,
            first_stage: arriving.luminance() * reverse.cos * area_jacobian,
        };
        let flight = reverse.flight.throughput_back();
        *throughput = scattered * flight * (1.0 / (pdf * self.survival(vertex, t - 1 - n + s)));
        if n < 2 {
            return 1.0;
        }
        let light =
            IncidentSubpath { s: s + t - n, throughput: arriving, target_over_pdf, distance2: reverse.distance2 };
        let edge = if n + 1 == t { &path.reverse.last_edge } else { &path.reverse.edges[n] };
        self.factor.c(&light, edge)
    }

    /// The weight of the technique that sampled the path, and of groups of techniques.
    #[inline]
    pub fn weight(&self, path: &ConnectedPath<F>) -> MisWeight {
        let (s, t) = (path.light.len(), path.eye.len());
        let vertices = s + t;
        let own = self.heuristic.power(self.effective_count(s, t, path.emitter, path.connection_factor));
        let mut sums = [0.0; GROUPS];
        sums[group(s, t)] = own;
        let partial = |light: bool, group: usize| self.has_partial_sums(light).then_some(group);
        self.add_outward(path.light, &path.light_end, t, partial(true, OTHERS), &mut sums, |n| Term {
            effective_count: self.effective_count(n, vertices - n, path.emitter, path.light[n].connection_factor),
            group: group(n, vertices - n),
        });
        let mut throughput = path.reverse.throughput;
        self.add_outward(path.eye, &path.eye_end, s, partial(false, LIGHT_IMAGE), &mut sums, |n| {
            let factor = if F::IS_ONE { 1.0 } else { self.eye_factor(path, n, &mut throughput) };
            let factor = factor * path.eye[n].connection_factor;
            let effective_count = self.effective_count(vertices - n, n, path.emitter, factor);
            Term { effective_count, group: group(vertices - n, n) }
        });
        let scale = 1.0 / (sums[OTHERS] + sums[LIGHT_IMAGE] + sums[CONNECTIONS]);
        MisWeight {
            own: own * scale, // [Veach eq. 9.8]
            light_image: sums[LIGHT_IMAGE] * scale,
            connections: sums[CONNECTIONS] * scale,
        }
    }
}
