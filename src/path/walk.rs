//! The random walk: the only bounce loop of the program.
//!
//! From an origin it traces, goes straight on through the holes of masks (`passage`) and through media until light
//! collides (`flight`), resolves the vertex, shows it to
//! the hooks, draws the next direction from the direction sampler and plays Russian roulette, until a limit, a miss or a
//! hook ends it. [`Transport`] says whether it carries radiance or importance.

use super::directions::DirectionSampler;
use super::flight::{Arrival, NextEdge};
use super::iteration::Iteration;
use super::roulette::PathLimits;
use super::vertex::{Edge, Place, Scatter, Vertex};
use crate::math::sampler::{PathSampler, SampleSlot};
use crate::math::{AreaPdf, Rgb, SolidAnglePdf, Vec3};
use crate::media::MediumNumber;
use crate::prepared::{Features, PreparedScene};
use crate::ray::{Ray, RayKind, T_MIN, Tracer};
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
    /// Statistics count the first ray as this kind.
    pub kind: RayKind,
    /// The medium that it begins in.
    pub medium: MediumNumber,
}

/// The start of a walk from the lens.
#[derive(Clone, Copy, Debug)]
pub struct CameraStart {
    /// The walk.
    pub walk: WalkStart,
    /// Density of the lens point per unit area.
    pub lens_pdf: AreaPdf,
}

impl WalkStart {
    /// Draws the camera ray of a sample of the pixel (x, y): a point of the pixel's filter and a point of the lens, by
    /// the first four numbers of `sampler`. The throughput is the filter's weight.
    #[inline]
    pub fn from_camera(iteration: &Iteration, (x, y): (u32, u32), sampler: &mut PathSampler) -> CameraStart {
        let scene = iteration.scene;
        let u = sampler.origin();
        let (offset, filter) = scene.filter.sample([u[0], u[1]]);
        let raster = [x as f32 + 0.5 + offset[0], y as f32 + 0.5 + offset[1]];
        WalkStart::from_lens(scene, raster, [u[2], u[3]], Rgb::grey(filter), RayKind::Camera)
    }

    /// Draws the camera ray through the point `raster` of the film (in pixels) and the point of the lens that `u` says.
    #[inline]
    pub fn from_lens(
        scene: &PreparedScene,
        raster: [f32; 2],
        u: [f32; 2],
        throughput: Rgb,
        kind: RayKind,
    ) -> CameraStart {
        let eye = scene.camera.sample_ray(raster, u);
        let (lens_pdf, pdf) = scene.camera.pdf_sampled_ray(eye.direction);
        let ray = Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far };
        CameraStart { walk: WalkStart { ray, throughput, pdf, kind, medium: scene.surroundings.camera }, lens_pdf }
    }
}

/// The actions of an integrator on the way.
pub trait WalkHooks {
    /// A vertex was met. Returns whether to go on.
    fn vertex(&mut self, vertex: &Vertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool;

    /// The walk goes straight on through a hole of a surface that emits. The vertex is the one that would be there, with
    /// a BSDF that scatters nothing.
    #[inline]
    fn passing(&mut self, _vertex: &Vertex) {}

    /// The walk goes on from the vertex in a drawn direction, roulette survived.
    #[inline]
    fn leaving(&mut self, _vertex: &Vertex, _sample: &BsdfSample) {}

    /// The ray left the scene in the unit direction `direction`; `throughput` and `edge` as for a vertex that would be
    /// there.
    fn escaped(&mut self, index: u32, direction: Vec3, throughput: Rgb, edge: &Edge);
}

/// The rules of a walk.
#[derive(Clone, Copy, Debug)]
pub struct WalkRules<'a, D> {
    /// How long it may be.
    pub limits: PathLimits,
    /// Which quantity it carries.
    pub mode: Transport,
    /// Where it goes on.
    pub directions: &'a D,
}

/// Walks; see the module's head.
#[inline]
pub fn walk<H: WalkHooks, D: DirectionSampler>(
    scene: &PreparedScene,
    start: WalkStart,
    rules: &WalkRules<D>,
    tracer: &mut Tracer,
    sampler: &mut PathSampler,
    hooks: &mut H,
) {
    let walk = Walk { scene, start, rules };
    match scene.media.is_empty() {
        true => walk.run::<false>(tracer, sampler, hooks),
        false => walk.run_in_media(tracer, sampler, hooks),
    }
}

/// A walk that is to be made.
struct Walk<'a, D> {
    scene: &'a PreparedScene,
    start: WalkStart,
    rules: &'a WalkRules<'a, D>,
}

impl<D: DirectionSampler> Walk<'_, D> {
    /// Walks in a scene with media. Out of line: the walk of all other scenes stays small.
    #[cold]
    #[inline(never)]
    fn run_in_media(self, tracer: &mut Tracer, sampler: &mut PathSampler, hooks: &mut impl WalkHooks) {
        self.run::<true>(tracer, sampler, hooks);
    }

    /// Walks in a scene with or without media.
    #[inline(always)]
    fn run<const MEDIA: bool>(self, tracer: &mut Tracer, sampler: &mut PathSampler, hooks: &mut impl WalkHooks) {
        let Walk { scene, start, rules } = self;
        let WalkStart { ray, mut throughput, pdf, mut kind, mut medium } = start;
        let WalkRules { limits, mode, directions } = *rules;
        let Ray { mut o, mut d, mut t_min, mut t_max } = ray;
        let mut edge = Edge::new(o, pdf);
        let has_masks = scene.features.contains(Features::MASKS);
        let mut extinction_back = None;
        let mut point = SurfacePoint::default();
        let mut bsdf = Bsdf::empty(&point);
        for index in 1..=limits.max_edges {
            let ray = Ray { o, d, t_min, t_max };
            let (wo, unattenuated) = (-d, throughput);
            let mut next =
                NextEdge { scene, ray, medium, edge: &mut edge, point: &mut point, extinction_back, throughput, index };
            let arrival = if MEDIA {
                let arrival = next.fly(kind, tracer, sampler, hooks);
                medium = next.medium;
                throughput *= edge.flight.throughput();
                arrival
            } else {
                next.meet(has_masks, kind, tracer, sampler, hooks)
            };
            let (hit, medium_point);
            let (place, media) = match arrival {
                Arrival::Escaped => {
                    hooks.escaped(index, d, throughput, &edge);
                    return;
                }
                Arrival::Surface(met, material) => {
                    hit = met;
                    material.resolve_into(&mut bsdf, &point, wo);
                    let media = if MEDIA { scene.media_beside(&hit, medium) } else { [MediumNumber::VACUUM; 2] };
                    (Place::Surface { point: &point, hit: &hit }, media)
                }
                Arrival::Collided(met) => {
                    medium_point = met;
                    bsdf.set_phase(scene.medium_scattering(&medium_point));
                    (Place::Medium(&medium_point), [medium; 2])
                }
            };
            let scatter = Scatter(&bsdf);
            let vertex = Vertex { index, place, scatter, wo, throughput, unattenuated, media, edge: &edge };
            if !hooks.vertex(&vertex, tracer, sampler) || index == limits.max_edges {
                return;
            }

            let u = sampler.vertex(index, SampleSlot::Scatter);
            let p = vertex.position();
            let Some(sample) = directions.sample(p, &vertex.scatter, wo, [u[0], u[1], u[2]], mode) else { return };
            let survival = limits.survival(index, &vertex.scatter);
            if u[3] >= survival {
                return;
            }
            throughput *= sample.value * (1.0 / (sample.pdf.0 * survival));
            if throughput.is_black() {
                return;
            }
            hooks.leaving(&vertex, &sample);
            if MEDIA {
                medium = vertex.medium_towards(sample.wi);
                extinction_back = vertex.place.extinction();
            }
            let end = vertex.place.segment_end();
            edge = Edge { delta: sample.delta, survival, ..Edge::new(p, sample.pdf) };
            (o, d) = (end.leaving(sample.wi), sample.wi);
            (t_min, t_max) = (T_MIN, f32::INFINITY);
            kind = match mode {
                Transport::Radiance => RayKind::Bounce,
                Transport::Importance => RayKind::LightBounce,
            };
        }
    }
}
