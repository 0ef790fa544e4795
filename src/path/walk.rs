//! The random walk: the only bounce loop of the program.
//!
//! From an origin it traces, resolves the surface, shows the vertex to the hooks, draws the next direction from the BSDF and plays Russian
//! roulette, until a limit, a miss or a hook ends it. Whether it carries radiance or importance is [`Transport`]'s to say.
//!
//! Russian roulette starts at a vertex index counted from the sub-path's own origin and survives with a probability that depends on
//! the vertex alone (its albedo, not the throughput), so that the density of a path is known from either of its ends.

use super::vertex::{Edge, SurfaceVertex};
use crate::math::sampler::{PathSampler, Purpose};
use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::prepared::PreparedScene;
use crate::ray::{Ray, RayKind, T_MIN, Tracer, offset::offset_point};
use crate::shade::{Bsdf, BsdfSample, SurfacePoint, Transport};

/// Where a walk begins.
#[derive(Clone, Copy, Debug)]
pub struct WalkStart {
    /// The first ray; its direction has unit length.
    pub ray: Ray,
    /// Throughput of the first ray.
    pub throughput: Rgb,
    /// Density per steradian of its direction.
    pub pdf: SolidAnglePdf,
    /// The first ray comes from an origin that no other technique meets.
    pub delta: bool,
    /// What the first ray counts as.
    pub kind: RayKind,
}

/// How long a walk may be.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest number of edges of the sub-path.
    pub max_edges: u32,
    /// Vertex index from which Russian roulette is played; the first hit is 1.
    pub roulette_from: u32,
    /// Where roulette is played and the vertex is matt, survival is lower by this factor.
    pub keep: f32,
}

/// Survival probability of Russian roulette never exceeds this, so that walks between white mirrors end.
const MAX_SURVIVAL: f32 = 0.95;

/// Probability to go on after a vertex with the BSDF `bsdf` where roulette is played: the same from either end of the path.
#[inline]
fn survival(bsdf: &Bsdf) -> f32 {
    bsdf.albedo().max_component().min(MAX_SURVIVAL)
}

impl Limits {
    /// Probability to go on after vertex `index` with the BSDF `bsdf`; a function of the vertex alone.
    #[inline]
    pub fn survival(&self, index: u32, bsdf: &Bsdf) -> f32 {
        if index < self.roulette_from { 1.0 } else { self.roulette(bsdf) }
    }

    /// The same at a vertex where roulette is played.
    #[inline]
    pub fn roulette(&self, bsdf: &Bsdf) -> f32 {
        let survival = survival(bsdf);
        if self.keep < 1.0 && bsdf.is_lambertian() { survival * self.keep } else { survival }
    }
}

/// What an integrator does on the way.
pub trait WalkHooks {
    /// A surface was met. Returns whether to go on.
    fn surface(&mut self, vertex: &SurfaceVertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool;

    /// The walk goes on from the vertex in a drawn direction, roulette survived.
    #[inline]
    fn leaving(&mut self, _vertex: &SurfaceVertex, _sample: &BsdfSample) {}

    /// The ray left the scene in the direction `direction`; `throughput` and `edge` as for a vertex that would be there.
    fn escaped(&mut self, index: u32, direction: Vec3, throughput: Rgb, edge: &Edge);
}

/// Walks; see the module's head.
pub fn walk<H: WalkHooks>(
    scene: &PreparedScene,
    start: WalkStart,
    limits: &Limits,
    mode: Transport,
    tracer: &mut Tracer,
    sampler: &mut PathSampler,
    hooks: &mut H,
) {
    let WalkStart { ray, mut throughput, pdf, delta, mut kind } = start;
    let Ray { mut o, mut d, mut t_min, mut t_max } = ray;
    let mut edge = Edge { from: o, from_normal: None, pdf, delta, survival: 1.0, distance: f32::INFINITY };
    let mut point = SurfacePoint::default();
    let mut bsdf = Bsdf::empty(&point);
    for index in 1..=limits.max_edges {
        let Some(hit) = tracer.closest(&Ray { o, d, t_min, t_max }, kind) else {
            hooks.escaped(index, d, throughput, &edge);
            return;
        };
        edge.distance = hit.t;
        let wo = -d;
        let material = scene.surface_point_into(&hit, &mut point);
        material.resolve_into(&mut bsdf, &point, wo);
        let light_normal = if scene.lights.choice_depends_on_place() { light_normal(&point, &bsdf, wo) } else { None };
        let vertex =
            SurfaceVertex { index, hit: &hit, point: &point, bsdf: &bsdf, wo, throughput, edge: &edge, light_normal };
        if !hooks.surface(&vertex, tracer, sampler) || index == limits.max_edges {
            return;
        }

        let u = sampler.vertex(index, Purpose::Scatter);
        let Some(sample) = bsdf.sample(wo, [u[0], u[1], u[2]], mode) else { return };
        let survival = limits.survival(index, &bsdf);
        if u[3] >= survival {
            return;
        }
        throughput *= sample.value * (1.0 / (sample.pdf.0 * survival));
        if throughput.is_black() {
            return;
        }
        hooks.leaving(&vertex, &sample);
        edge = Edge {
            from: point.p,
            from_normal: light_normal,
            pdf: sample.pdf,
            delta: sample.delta,
            survival,
            distance: f32::INFINITY,
        };
        (o, d) = (offset_point(point.p, point.error, point.ng, sample.wi), sample.wi);
        (t_min, t_max) = (T_MIN, f32::INFINITY);
        kind = match mode {
            Transport::Radiance => RayKind::Bounce,
            Transport::Importance => RayKind::LightBounce,
        };
    }
}

/// See [`SurfaceVertex::light_normal`].
fn light_normal(point: &SurfacePoint, bsdf: &Bsdf, wo: Vec3) -> Option<Vec3> {
    let n = point.frame.n;
    (!bsdf.transmits()).then(|| if n.dot(wo) < 0.0 { -n } else { n })
}
