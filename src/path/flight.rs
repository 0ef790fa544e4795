//! Edges of paths in scenes with participating media.
//!
//! A walk flies until light collides in a medium or a surface stops it, through `null` interfaces and the holes of masks;
//! where media begin and end, the surfaces between them say. The density of the next vertex has the factor E κ, and the
//! throughput T / (E κ) (see [`media`](crate::media)). A segment between two given vertices has the same T and E, which
//! [`segment_flight`] finds.

use super::passage::Passage;
use super::vertex::{Edge, StoredPlace};
use super::walk::WalkHooks;
use crate::math::Rgb;
use crate::math::sampler::PathSampler;
use crate::media::{Collision, Flight, FlightTarget, MediumNumber, MediumPoint, transmittance};
use crate::prepared::PreparedScene;
use crate::ray::offset::offset_point;
use crate::ray::transmittance::{MAX_CROSSINGS, beyond};
use crate::ray::{Hit, MaskLookup, MaskPoint, Ray, RayKind, Segment, SurfaceMask, Tracer, Transmittance};
use crate::shade::{Material, SurfacePoint};

/// Effect of free flight along an edge on throughputs and densities: none without media.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeFlight {
    /// T / E per channel.
    pub ratio: Rgb,
    /// κ of the vertex that the edge leads to.
    pub rate: f32,
    /// κ of the vertex that the edge comes from.
    pub rate_back: f32,
}

impl Default for FreeFlight {
    fn default() -> FreeFlight {
        FreeFlight::NONE
    }
}

impl FreeFlight {
    /// In vacuum, between two surfaces.
    pub const NONE: FreeFlight = FreeFlight { ratio: Rgb::WHITE, rate: 1.0, rate_back: 1.0 };

    /// T / (E κ), the factor of the throughput of a walk along the edge.
    #[inline]
    pub fn throughput(&self) -> Rgb {
        self.ratio * (1.0 / self.rate)
    }

    /// T / (E κ) of a walk along the edge from its other end.
    #[inline]
    pub fn throughput_back(&self) -> Rgb {
        self.ratio * (1.0 / self.rate_back)
    }
}

/// The light that passes a segment between two vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentFlight {
    /// Share of light that passes media and masks, per channel.
    pub light: Rgb,
    /// E times the share that passes the masks.
    pub transmittance: Transmittance,
    /// T, of media alone.
    passing: Rgb,
    /// The scene has media.
    has_media: bool,
}

impl SegmentFlight {
    /// A segment in a scene without media, of which masks are asked for elsewhere.
    pub const FREE: SegmentFlight =
        SegmentFlight { light: Rgb::WHITE, transmittance: Transmittance::ONE, passing: Rgb::WHITE, has_media: false };

    /// The scene has no media.
    #[inline]
    pub fn is_free(&self) -> bool {
        !self.has_media
    }

    /// Past masks of which all together let `holes` of the light through, and media of the transmittance `passing`.
    fn new(holes: f32, passing: Rgb) -> SegmentFlight {
        let mut transmittance = Transmittance::ONE;
        transmittance *= holes * passing.mean();
        SegmentFlight { light: passing * holes, transmittance, passing, has_media: true }
    }

    /// The flight along the segment as an edge from `from` to `to`; the lens and lights are `None`.
    #[inline]
    pub fn edge(&self, from: Option<&StoredPlace>, to: Option<&StoredPlace>) -> FreeFlight {
        if self.is_free() {
            return FreeFlight::NONE;
        }
        let rate = |place: Option<&StoredPlace>| place.map_or(1.0, |place| place.collision_rate(self.passing));
        FreeFlight { ratio: self.passing * (1.0 / self.passing.mean()), rate: rate(to), rate_back: rate(from) }
    }
}

/// The light that passes a segment on which nothing without holes is; the segment begins in `medium`. `None` if no light
/// passes.
#[inline]
pub fn segment_flight(
    scene: &PreparedScene,
    segment: &Segment,
    medium: MediumNumber,
    tracer: &mut Tracer,
) -> Option<SegmentFlight> {
    match scene.media.is_empty() {
        true => Some(SegmentFlight::FREE),
        false => gather(scene, segment, medium, tracer),
    }
}

fn gather(
    scene: &PreparedScene,
    segment: &Segment,
    mut medium: MediumNumber,
    tracer: &mut Tracer,
) -> Option<SegmentFlight> {
    let (mut depth, mut holes, mut rest) = (Rgb::BLACK, 1.0, *segment);
    let direction = segment.d.normalize();
    for _ in 0..MAX_CROSSINGS {
        let hit = match scene.has_crossings() {
            true => tracer.closest_of(&rest.ray(), SurfaceMask::MASKS, RayKind::Mask),
            false => None,
        };
        if let Some(medium) = scene.media.get(medium) {
            let length = rest.d.length() * hit.map_or(rest.t_max, |hit| hit.t);
            depth += medium.optical_depth(rest.o, direction, length);
        }
        let Some(hit) = hit else {
            let flight = SegmentFlight::new(holes, transmittance(depth));
            return (!flight.transmittance.is_zero()).then_some(flight);
        };
        let point = scene.mask_point(&hit);
        holes *= point.holes;
        if holes <= 0.0 {
            return None;
        }
        medium = scene.medium_beside(&hit, point.ng.dot(direction)).unwrap_or(medium);
        rest = segment.rest_from(offset_point(point.p, point.error, point.ng, rest.d));
    }
    tracer.stats.invalid += 1;
    None
}

/// How an edge of a walk ended.
pub(super) enum Arrival<'s> {
    /// It left the scene.
    Escaped,
    /// A surface stopped it.
    Surface(Hit, &'s Material),
    /// Light collided.
    Collided(MediumPoint),
}

/// An edge of a walk that is to be found.
pub(super) struct NextEdge<'s, 'a> {
    pub scene: &'s PreparedScene,
    pub ray: Ray,
    /// The medium around the walk; on arrival, that before the surface or around the collision.
    pub medium: MediumNumber,
    pub edge: &'a mut Edge,
    /// The point of the surface that stopped it.
    pub point: &'a mut SurfacePoint,
    /// σ_t at the vertex that the edge comes from, if that is in a medium.
    pub extinction_back: Option<Rgb>,
    /// Throughput at the beginning of the edge.
    pub throughput: Rgb,
    /// Number of the vertex that the edge leads to.
    pub index: u32,
}

impl<'s> NextEdge<'s, '_> {
    /// Meets a surface in a scene without media, behind the holes of masks if there are any. Emission that the walk
    /// passes is shown to the hooks.
    #[inline(always)]
    pub fn meet(
        self,
        has_masks: bool,
        kind: RayKind,
        tracer: &mut Tracer,
        sampler: &mut PathSampler,
        hooks: &mut impl WalkHooks,
    ) -> Arrival<'s> {
        let NextEdge { scene, ray, edge, point, index, throughput, .. } = self;
        let Some(hit) = tracer.closest(&ray, kind) else { return Arrival::Escaped };
        edge.distance = hit.t;
        let material = scene.surface_point_into(&hit, point);
        if !has_masks {
            return Arrival::Surface(hit, material);
        }
        let mut passage = Passage { scene, ray, edge, hit, point };
        let passed = |passage: &Passage| passage.show_emission(index, throughput, hooks);
        match passage.go_on(material, kind, tracer, sampler.rng(), passed) {
            Some((hit, material)) => Arrival::Surface(hit, material),
            None => Arrival::Escaped,
        }
    }

    /// Flies in a scene with media, and writes down the edge. Emission that the walk passes is shown to the hooks.
    #[cold]
    pub fn fly(
        &mut self,
        kind: RayKind,
        tracer: &mut Tracer,
        sampler: &mut PathSampler,
        hooks: &mut impl WalkHooks,
    ) -> Arrival<'s> {
        let target = FlightTarget::sample(sampler.flight(self.index));
        let (mut depth, mut holes) = (Rgb::BLACK, 1.0);
        for _ in 0..MAX_CROSSINGS {
            let hit = tracer.closest(&self.ray, kind);
            if let Some(medium) = self.scene.media.get(self.medium) {
                let Ray { o, d, t_min, .. } = self.ray;
                let (o, length) = (o + d * t_min, hit.map_or(self.ray.t_max, |hit| hit.t) - t_min);
                match medium.fly(o, d, length, target.after(depth)) {
                    Flight::Passed { depth: passed } => depth += passed,
                    Flight::Collided(Collision { t, depth: passed }) => {
                        let p = o + d * t;
                        let sigma_t = medium.coefficients(p).sigma_t;
                        self.arrive(depth + passed, holes, Some(sigma_t));
                        self.edge.distance = (p - self.edge.from).length();
                        return Arrival::Collided(MediumPoint { p, sigma_t, medium: self.medium });
                    }
                }
            }
            let Some(hit) = hit else {
                self.arrive(depth, holes, None);
                self.edge.distance = f32::INFINITY;
                return Arrival::Escaped;
            };
            let material = self.scene.surface_point_into(&hit, self.point);
            self.edge.distance = (self.point.p - self.edge.from).length();
            let through = if material.features().passes_through { material.holes(self.point) } else { 0.0 };
            // Numbers in [0, 1) are below one, and none is below zero.
            if through <= 0.0 || through < 1.0 && sampler.rng().next_f32() >= through {
                self.arrive(depth, holes, None);
                return Arrival::Surface(hit, material);
            }
            let (scene, ray) = (self.scene, self.ray);
            if scene.light_of(&hit).is_some() {
                self.arrive(depth, holes, None);
                let throughput = self.throughput * self.edge.flight.throughput();
                Passage { scene, ray, edge: self.edge, hit, point: self.point }
                    .show_emission(self.index, throughput, hooks);
            }
            holes *= through;
            let SurfacePoint { p, error, ng, .. } = *self.point;
            self.medium = scene.medium_beside(&hit, ng.dot(ray.d)).unwrap_or(self.medium);
            self.ray = beyond(&ray, hit.t, &MaskPoint { p, error, ng, holes: through });
        }
        tracer.stats.invalid += 1;
        Arrival::Escaped
    }

    /// Writes down the flight up to here.
    fn arrive(&mut self, depth: Rgb, holes: f32, extinction: Option<Rgb>) {
        let passing = transmittance(depth);
        let SegmentFlight { transmittance, .. } = SegmentFlight::new(holes, passing);
        self.edge.transmittance = transmittance;
        let rate = |sigma_t: Option<Rgb>| sigma_t.map_or(1.0, |s| crate::media::collision_rate(s, passing));
        let (rate, rate_back) = (rate(extinction), rate(self.extinction_back));
        self.edge.flight = match rate > 0.0 {
            true => FreeFlight { ratio: passing * (1.0 / passing.mean()), rate, rate_back },
            // The search in a grid ended by rounding where there is nothing: such a collision carries no light.
            false => FreeFlight { ratio: Rgb::BLACK, rate: 1.0, rate_back },
        };
    }
}
