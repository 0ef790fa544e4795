//! The cache points near a vertex, asked by weights: which light vertices they see, and what it is to draw by one of them alone.
//!
//! See `mis::proposals` for what weights make of it. A weight is wanted before its path's own shadow ray is sent, so the rays between
//! cache points and vertices are traced at once and not queued. Those to a vertex that was drawn are not traced at all: the
//! probabilities at the cache points know their answers.

use super::caches::Caches;
use super::places::Places;
use super::pmfs::{Choice, Pmfs};
use super::resampler::{Resampler, side};
use super::store::direction_to;
use crate::integrators::bdpt::light_path::LightVertex;
use crate::math::{Rgb, Vec3};
use crate::mis::{Proposal, Proposals};
use crate::ray::offset::{SegmentEnd, segment};
use crate::ray::{RayKind, SegmentPacket, Tracer};
use crate::shade::{BsdfRef, SurfacePoint, Transport};
use crate::spatial::nearest::MOST;

/// The cache points near a place.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::integrators) struct Near {
    count: usize,
    caches: [usize; MOST],
}

impl Near {
    /// These.
    pub(super) fn caches(&self) -> &[usize] {
        &self.caches[..self.count]
    }
}

impl Resampler {
    /// The cache points near a point, on the side of the direction `d`. (Where weights ask them the side does not matter.)
    #[inline]
    pub fn near(&self, point: &SurfacePoint, d: Vec3) -> Near {
        let n = side(point, d);
        let mut near = Near::default();
        let most = self.settings.neighbours;
        match &self.places {
            Places::None => {}
            Places::Caches(at) => {
                for i in at.caches.index.find(point.p, n).take(most) {
                    near.caches[near.count] = i;
                    near.count += 1;
                }
            }
            Places::Sites(at) => near.count = at.sites.find(point.p, n, most, &mut near.caches),
        }
        near
    }

    /// Bit `i` set: nothing is between cache point `i` of `near` and the vertex whose end of a shadow ray is `y`. These are the rays that
    /// the cache points' probabilities know.
    pub fn seen_by(&self, near: &Near, y: &SegmentEnd, tracer: &mut Tracer) -> u16 {
        let mut packet = SegmentPacket::default();
        for &c in near.caches() {
            self.places.end(c).into_iter().for_each(|end| packet.push(&segment(end, y)));
        }
        if packet.len == 0 {
            return 0;
        }
        !tracer.occluded_packet(&packet, RayKind::ShadowWeight)
    }

    /// The cache points `near` as seen from the vertex at `p` with the geometric normal `ng`, whose value for the direction to one is `value`
    /// and of which those with a bit in `seen` see it.
    pub fn proposals(&self, near: &Near, (p, ng): (Vec3, Vec3), seen: u16, value: impl Fn(Vec3) -> Rgb) -> Proposals {
        let mut proposals = Proposals { count: near.count, ..Proposals::default() };
        for (i, (proposal, &place)) in proposals.each.iter_mut().zip(near.caches()).enumerate() {
            let sees = seen >> i & 1 == 1;
            match &self.places {
                Places::None => {}
                Places::Caches(at) => {
                    proposal.all = at.caches.all(place);
                    if let Some((towards, spread)) = at.caches.towards(place, p) {
                        let scattered = if sees { value(towards) * spread } else { Rgb::BLACK };
                        let unscattered = ng.dot(towards).abs() * spread;
                        if scattered.luminance().is_finite() && unscattered.is_finite() {
                            *proposal = Proposal { scattered, unscattered, ..*proposal };
                        }
                    }
                }
                Places::Sites(at) => {
                    let open = Some(at.sites.reached(place, at.draws.from, p, &value))
                        .filter(|open| open.luminance().is_finite());
                    proposal.site = place as u32;
                    proposal.open = open.unwrap_or(Rgb::BLACK);
                    proposal.scattered = if sees { proposal.open } else { Rgb::BLACK };
                }
            }
        }
        proposals
    }

    /// The cache points `near` as seen from the light vertex `y`, whose BSDF is `bsdf`.
    pub fn proposals_of(&self, near: &Near, y: &LightVertex, bsdf: &BsdfRef, seen: u16) -> Proposals {
        self.proposals(near, (y.p, y.ng), seen, |to| bsdf.eval(y.wo, to, Transport::Importance))
    }

    /// Chooses a proposal, one of the cache points `near` or the virtual one, and draws by it alone: the number of the proposal, and what was
    /// drawn with what probability, the choice of the proposal included. `None` where there is nothing to draw.
    pub(super) fn draw_split(&self, pmfs: &Pmfs, near: &Near, u: [f32; 2]) -> Option<(usize, Choice)> {
        let n = near.count;
        let proposal = ((u[0] * (n + 1) as f32) as usize).min(n);
        let choice = match near.caches().get(proposal) {
            Some(&cache) => pmfs.draw_at(cache, u[1])?,
            None => match near.caches().first() {
                Some(&cache) => pmfs.draw_uniformly(cache, u[1])?,
                None => self.draw_anything(u[1])?,
            },
        };
        Some((proposal, Choice { probability: choice.probability / (n + 1) as f32, ..choice }))
    }
}

impl Caches {
    /// Unit direction from `p` to a cache point, and |cos| / distance² there; none if it is not in front of it.
    fn towards(&self, cache: usize, p: Vec3) -> Option<(Vec3, f32)> {
        direction_to(p, self.index.points()[cache], self.index.normals()[cache])
    }
}
