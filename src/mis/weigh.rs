//! The weight of one sampled path among all techniques that make it.
//!
//! A path x̄ = v_0 … v_k with v_0 on a light and v_k on the lens is made by the techniques (s, k + 1 − s). Each takes n_s samples with the
//! density p_s = Π_{i<s} p_L(v_i) · Π_{i≥s} p_E(v_i) times a factor c_s, and gets the weight
//!
//! w_s = (n_s c_s p_s)^β / Σ_i (n_i c_i p_i)^β   (Veach 1997, eqs. 9.8 and 10.9).
//!
//! Neighbours differ by one vertex, p_{s+1} / p_s = p_L(v_s) / p_E(v_s), so the sum is taken over products of the ratios that the two
//! [`Side`](super::Side)s keep, going outwards from the connection. Only four ratios depend on the connection itself: those
//! of its two end vertices and of the two vertices behind them. What lies farther out is summed up once, as the sub-path is made
//! ([`Weigher::sum_up`]), so that a connection costs the same for sub-paths of any length.
//!
//! Factors: c_0 = 0 if no ray can meet the light by chance; c_1 = p_direct(v_0 | v_1) / p_L(v_0) where t ≥ 2, since those techniques
//! draw their light point as seen from v_1 (*next event*) and not as light sub-paths do; `mis::resampled` tells that of a
//! resampled connection; all others are 1, or 0 if an end of the connection is a delta event. Roulette is part of the densities: where it is played is counted from the end that walks.

use super::side::{Lit, Node};
use super::{Heuristic, Lengths, Proposals, Resampled, Targets, Techniques};
use crate::math::{AreaPdf, Rgb, SolidAnglePdf};
use crate::path::Limits;

/// How the last vertex of a side would have been walked through from the other end.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// Area density of that vertex, survival at the other side's last vertex included.
    pub arrival: AreaPdf,
    /// Density per steradian there of the direction to the vertex before it. (For a light that was hit: its emission's density of
    /// direction; of a light at infinity: the density of its disk.)
    pub departure: SolidAnglePdf,
}

/// A path as it was sampled.
#[derive(Clone, Copy, Debug)]
pub struct Split<'a> {
    /// The s vertices of the light sub-path that it uses.
    pub light: &'a [Node],
    /// How the eye sub-path would have gone on into them; unused if there are none.
    pub light_joint: Joint,
    /// The t vertices of the eye sub-path that it uses.
    pub eye: &'a [Node],
    /// What is known of the light at these vertices. Unused unless connections are resampled.
    pub eye_lit: &'a [Lit],
    /// Where each proposal of a resampled connection is a technique: for z_0 … z_{t−2} the cache points near the vertex before, as
    /// seen from it (none of those that are missing), and the ones near z_{t−2} as seen from z_{t−1}.
    pub eye_proposals: Option<(&'a [Proposals], &'a Proposals)>,
    /// How the light sub-path would have gone on into them; unused if t = 1.
    pub eye_joint: Joint,
    /// c_1: density of v_0 under next event from v_1 over its density as origin of a light sub-path.
    pub next_event: f32,
    /// c_0 = 1: rays can meet the light by chance.
    pub light_can_be_hit: bool,
    /// c of this connection, if it was resampled; else 1.
    pub factor: f32,
    /// Where connections are resampled: β_L of the light sub-path on arriving at z_{t−1}; if that is on the light itself, on arriving at
    /// z_{t−2}. Unused otherwise.
    pub arriving: Rgb,
    /// Where connections are resampled: value of z_{t−1} for a walk from the light, cosine weighted. Unused otherwise.
    pub adjoint: Rgb,
}

/// Everything that weights depend on besides the path.
#[derive(Clone, Debug)]
pub struct Weigher {
    /// Techniques and their samples.
    pub techniques: Techniques,
    /// β.
    pub heuristic: Heuristic,
    /// Roulette of eye sub-paths.
    pub eye_limits: Limits,
    /// Roulette of light sub-paths, which begin it at the same number of vertices from their end.
    pub light_limits: Limits,
    /// How connections with s ≥ 2 and t ≥ 2 are resampled, if they are and weights know of it.
    pub resampled: Option<Resampled>,
    /// What is known of each length, if sub-paths of each are resampled by themselves.
    pub lengths: Option<Lengths>,
}

/// The end of the path that a side begins at.
#[derive(Clone, Copy, Debug)]
pub enum End {
    /// The light.
    Light {
        /// c_0 = 1: rays can meet it by chance.
        can_be_hit: bool,
        /// c_1, from y_1 on; see [`Split::next_event`].
        next_event: f32,
    },
    /// The lens.
    Lens,
}

/// What a path's techniques weigh; all weights of a path sum to one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weight {
    /// The one that sampled it.
    pub own: f32,
    /// Those with t = 1.
    pub light_image: f32,
    /// Those with s ≥ 2 and t ≥ 2.
    pub connections: f32,
}

/// Sums by kind of technique.
const KINDS: usize = 3;
const OTHERS: usize = 0;
const LIGHT_IMAGE: usize = 1;
const CONNECTIONS: usize = 2;

impl Weigher {
    /// n_s c_s, connectability apart; of the light it is asked whether c_0 = 1, and c_1; `factor` is c where connections are resampled.
    #[inline]
    fn share(&self, s: usize, t: usize, (light_can_be_hit, next_event): (bool, f32), factor: f32) -> f32 {
        let n = self.techniques.count(s, t);
        match s {
            0 if !light_can_be_hit => 0.0,
            1 if t >= 2 => n * next_event,
            _ if s >= 2 && t >= 2 => n * factor,
            _ => n,
        }
    }

    /// c of a resampled connection to a light vertex, the last of `s`, at which the light β_L = `arriving` is; `proposals` is what the cache
    /// points or sites near the eye vertex said of it.
    pub fn asked(&self, resampled: &Resampled, arriving: Rgb, proposals: &Proposals, s: usize) -> f32 {
        match &self.lengths {
            Some(lengths) => lengths.factor(arriving, proposals, s),
            None => resampled.factor_of(arriving, proposals),
        }
    }

    /// Survival at a vertex that is number `index` counted from the other end.
    #[inline]
    fn survival(&self, node: &Node, index: usize) -> f32 {
        if index >= self.eye_limits.roulette_from as usize { node.survival } else { 1.0 }
    }

    /// Which sum a technique's share belongs to.
    #[inline]
    fn kind(s: usize, t: usize) -> usize {
        match (s, t) {
            (_, 1) => LIGHT_IMAGE,
            (2.., _) => CONNECTIONS,
            _ => OTHERS,
        }
    }

    /// Shares of techniques do not depend on what the other side is like, so that they can be summed up ahead.
    #[inline]
    fn sums_ahead(&self, end: &End) -> bool {
        // c of a resampled connection depends on the light that comes to the eye's vertices.
        self.techniques.regular() && (matches!(end, End::Light { .. }) || self.resampled.is_none())
    }

    /// Sums up, once a walk has left v_i, the last of `nodes`, the shares of the techniques that use n ≤ i of its vertices, each relative to
    /// the one that uses i of them and has the share 1: S_i = share(i) + r_{i−1} S_{i−1}, where r is p_other / p_own of a vertex. There are two
    /// sums, of connections and of all others, which are of one kind on each side.
    ///
    /// Roulette is taken as played at all these vertices; where S_i is used, it is.
    #[inline]
    pub fn sum_up(&self, nodes: &mut [Node], end: End) {
        if !self.sums_ahead(&end) {
            return;
        }
        let Some(i) = nodes.len().checked_sub(1) else { return };
        // Any number from two on stands for the other side's vertices.
        let (technique, light) = match end {
            End::Light { can_be_hit, next_event } => ((i, 2), (can_be_hit, next_event)),
            End::Lens => ((2, i), (false, 0.0)),
        };
        let mut sums = [0.0; 2];
        if i == 0 || nodes[i - 1].smooth && nodes[i].smooth {
            let share = self.share(technique.0, technique.1, light, nodes[i].factor);
            sums[usize::from(i >= 2)] = self.heuristic.power(share);
        }
        if i > 0 {
            let ratio = self.heuristic.power(nodes[i - 1].ratio * nodes[i].survival);
            for (sum, shorter) in sums.iter_mut().zip(nodes[i - 1].shorter) {
                // Nothing stays nothing, whatever the ratio.
                if shorter > 0.0 {
                    *sum += ratio * shorter;
                }
            }
        }
        nodes[i].shorter = sums;
    }

    /// Adds up, by kind, the shares of the techniques that have fewer than all vertices of `side`, relative to the one that has all of them and the
    /// factor 1; `other` is the number of vertices of the other side, `share(n)` the share of the technique with n vertices on this side,
    /// with its kind. `ahead` is the kind of what [`Weigher::sum_up`] has summed up beside connections, if it has.
    #[inline]
    fn outward(
        &self,
        side: &[Node],
        joint: &Joint,
        other: usize,
        ahead: Option<usize>,
        sums: &mut [f32; KINDS],
        mut share: impl FnMut(usize) -> (f32, usize),
    ) {
        let n = side.len();
        let mut product = 1.0;
        for i in (0..n).rev() {
            let ratio = if i + 1 == n {
                joint.arrival.0 / side[i].forward.0
            } else if i + 2 == n {
                let last = &side[n - 1];
                joint.departure.0 * self.survival(last, other) * last.spread / side[i].forward.0
            } else {
                side[i].ratio * self.survival(&side[i + 1], n - 2 - i + other)
            };
            product *= self.heuristic.power(ratio);
            if product == 0.0 {
                break;
            }
            if let Some(kind) = ahead
                && i + 2 < n
                && n - 2 - i + other >= self.eye_limits.roulette_from as usize
                && side[i].shorter.iter().all(|sum| sum.is_finite())
            {
                for (kind, sum) in [kind, CONNECTIONS].into_iter().zip(side[i].shorter) {
                    if sum > 0.0 {
                        sums[kind] += product * sum;
                    }
                }
                break;
            }
            // The technique's connection is the edge from vertex i − 1 to vertex i of this side.
            let smooth = i == 0 || (side[i - 1].smooth && (i + 1 == n || side[i].smooth));
            let (share, kind) = share(i);
            if smooth {
                let term = self.heuristic.power(share);
                if term > 0.0 {
                    sums[kind] += product * term;
                }
            }
        }
    }

    /// c of the technique with n eye vertices, asked for from the connection outwards: the sub-path that a light's walk would have
    /// made of the eye's vertices brings its light along.
    fn eye_factor(&self, resampled: &Resampled, path: &Split, n: usize, arriving: &mut Rgb) -> f32 {
        let (eye, s) = (path.eye, path.light.len());
        let (t, node, lit) = (eye.len(), &eye[n], &path.eye_lit[n]);
        let (adjoint, reverse) = match n + 1 == t {
            // z_{t−1} is on the light, and what arrives at z_{t−2} is given.
            true if s == 0 => return 1.0,
            true => (path.adjoint, path.eye_joint.departure.0),
            false => (lit.adjoint, lit.reverse),
        };
        let (scattered, before) = (*arriving * adjoint, *arriving);
        let brings = Targets {
            scattered: scattered.luminance() * node.spread,
            unscattered: arriving.luminance() * lit.cos * node.spread,
        };
        *arriving = scattered * (1.0 / (reverse * self.survival(node, t - 1 - n + s)));
        if n < 2 {
            return 1.0;
        }
        if resampled.form.asks() {
            let proposals =
                path.eye_proposals.and_then(|(others, last)| if n + 1 == t { Some(last) } else { others.get(n) });
            return self.asked(resampled, before, proposals.unwrap_or(&Proposals::NONE), s + t - n);
        }
        resampled.factor(brings, lit.distance2, path.eye_lit[n - 1].there)
    }

    /// The weight of the technique that sampled the path, and of kinds of techniques.
    #[inline]
    pub fn weight(&self, path: &Split) -> Weight {
        let (s, t) = (path.light.len(), path.eye.len());
        let edges = s + t;
        let light = (path.light_can_be_hit, path.next_event);
        let own = self.heuristic.power(self.share(s, t, light, path.factor));
        let mut sums = [0.0; KINDS];
        sums[Self::kind(s, t)] = own;
        let ahead = |end: End, kind: usize| self.sums_ahead(&end).then_some(kind);
        let begin = End::Light { can_be_hit: path.light_can_be_hit, next_event: path.next_event };
        self.outward(path.light, &path.light_joint, t, ahead(begin, OTHERS), &mut sums, |n| {
            (self.share(n, edges - n, light, path.light[n].factor), Self::kind(n, edges - n))
        });
        let mut arriving = path.arriving;
        self.outward(path.eye, &path.eye_joint, s, ahead(End::Lens, LIGHT_IMAGE), &mut sums, |n| {
            let factor = match &self.resampled {
                None => 1.0,
                Some(resampled) => self.eye_factor(resampled, path, n, &mut arriving),
            };
            (self.share(edges - n, n, light, factor), Self::kind(edges - n, n))
        });
        let scale = 1.0 / (sums[OTHERS] + sums[LIGHT_IMAGE] + sums[CONNECTIONS]);
        Weight { own: own * scale, light_image: sums[LIGHT_IMAGE] * scale, connections: sums[CONNECTIONS] * scale }
    }
}
