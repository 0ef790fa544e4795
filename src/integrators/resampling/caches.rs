//! Cache points: places on surfaces where the question "which light sub-path matters here?" is answered for their surroundings.
//!
//! They are the vertices of a few eye sub-paths (a fixed share of the number of pixels), traced once. For every iteration each gets
//! a probability mass function over the light vertices of the iteration, proportional to what they bring to it, visibility
//! included; and each keeps a running mean of the sum of that, its irradiance Q.

use super::store::LightStore;
use crate::math::sampler::PathSampler;
use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::path::{Edge, Limits, SurfaceVertex, WalkHooks, WalkStart, walk};
use crate::prepared::PreparedScene;
use crate::ray::offset::{SegmentEnd, segment};
use crate::ray::{PACKET, Ray, RayKind, RayStats, SegmentPacket, Tracer};
use crate::shade::Transport;
use crate::spatial::{NearestPoints, morton};
use rayon::prelude::*;

/// The random stream of the eye sub-paths that make cache points.
const CACHE_STREAM: u64 = 4;

/// A fixed set of cache points with their estimates.
#[derive(Debug)]
pub(in crate::integrators) struct Caches {
    pub index: NearestPoints,
    errors: Vec<f32>,
    geometric: Vec<Vec3>,
    /// Sum over iterations of each point's irradiance, and their number.
    sums: Vec<f64>,
    iterations: u64,
}

/// Collects the connectable vertices of a walk.
struct Collect(Vec<(Vec3, Vec3, f32, Vec3)>);

impl WalkHooks for Collect {
    fn surface(&mut self, v: &SurfaceVertex, _tracer: &mut Tracer, _sampler: &mut PathSampler) -> bool {
        if v.bsdf.is_black() {
            return false;
        }
        if v.bsdf.connectable() {
            let ng = v.point.ng;
            let side = if ng.dot(v.wo) < 0.0 { -ng } else { ng };
            self.0.push((v.point.p, side, v.point.error, ng));
        }
        true
    }

    fn escaped(&mut self, _index: u32, _direction: Vec3, _throughput: Rgb, _edge: &Edge) {}
}

/// Every cache point's probabilities of an iteration's light vertices.
#[derive(Debug, Default)]
pub(in crate::integrators) struct Pmfs {
    /// Light vertices.
    pub vertices: usize,
    /// For each cache point and vertex, the sum of what the vertices up to it bring, over the whole: cumulative probabilities. All
    /// zero where nothing is brought.
    cdf: Vec<f32>,
}

impl Pmfs {
    /// Cumulative probabilities of one cache point; `None` if no light vertex brings it anything.
    #[inline]
    pub fn of(&self, cache: usize) -> Option<&[f32]> {
        let cdf = &self.cdf[cache * self.vertices..(cache + 1) * self.vertices];
        cdf.last().is_some_and(|&top| top > 0.0).then_some(cdf)
    }
}

impl Caches {
    /// The vertices of `fraction` times as many eye sub-paths as the full picture has pixels.
    pub fn new(scene: &PreparedScene, seed: u64, fraction: f64, limits: &Limits) -> (Caches, RayStats) {
        let [width, height] = scene.film_size.map(f64::from);
        let scale = fraction.sqrt();
        let [columns, rows] = [width, height].map(|s| ((s * scale).round() as u64).max(1));
        let pieces: Vec<(Collect, RayStats)> = (0..columns * rows)
            .into_par_iter()
            .map(|i| {
                let mut sampler = PathSampler::new(seed, CACHE_STREAM, i, 0);
                let u = sampler.origin();
                let at = [(i % columns) as f32 + u[0], (i / columns) as f32 + u[1]];
                let raster = [at[0] / columns as f32 * width as f32, at[1] / rows as f32 * height as f32];
                let eye = scene.camera.sample_ray(raster, [u[2], u[3]]);
                let start = WalkStart {
                    ray: Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far },
                    throughput: Rgb::WHITE,
                    pdf: SolidAnglePdf(1.0),
                    delta: false,
                    kind: RayKind::Cache,
                };
                let (mut collect, mut tracer) = (Collect(vec![]), Tracer::new(&*scene.query));
                walk(scene, start, limits, Transport::Radiance, &mut tracer, &mut sampler, &mut collect);
                (collect, tracer.stats)
            })
            .collect();
        let mut stats = RayStats::default();
        let mut all = vec![];
        for (collect, s) in pieces {
            stats.merge(&s);
            all.extend(collect.0);
        }
        // Neighbours in the list are neighbours in space: they share packets.
        let positions: Vec<Vec3> = all.iter().map(|c| c.0).collect();
        let all: Vec<_> = morton::order(&positions).into_iter().map(|i| all[i as usize]).collect();
        let index = NearestPoints::new(all.iter().map(|c| c.0).collect(), all.iter().map(|c| c.1).collect());
        let caches = Caches {
            index,
            errors: all.iter().map(|c| c.2).collect(),
            geometric: all.iter().map(|c| c.3).collect(),
            sums: vec![0.0; all.len()],
            iterations: 0,
        };
        (caches, stats)
    }

    /// Mean of the irradiance that iterations so far found at the cache points around `p` whose side is `n`.
    #[inline]
    pub fn irradiance(&self, p: Vec3, n: Vec3) -> f32 {
        if self.iterations == 0 {
            return 0.0;
        }
        let (mut sum, mut count) = (0.0, 0.0);
        for i in self.index.find(p, n) {
            sum += self.sums[i];
            count += self.iterations as f64;
        }
        if count > 0.0 { (sum / count) as f32 } else { 0.0 }
    }

    /// Probabilities of the vertices of `store`, by shadow rays from every cache point to every vertex. The irradiances that come with
    /// them are returned, and not yet part of the mean.
    pub fn pmfs(&self, scene: &PreparedScene, store: &LightStore) -> (Pmfs, Vec<f64>, RayStats) {
        let vertices = store.vertices.len();
        let mut cdf = vec![0.0f32; self.index.len() * vertices];
        let mut totals = vec![0.0f64; self.index.len()];
        if vertices == 0 {
            return (Pmfs { vertices, cdf }, totals, RayStats::default());
        }
        let stats = cdf
            .par_chunks_mut(PACKET * vertices)
            .zip(totals.par_chunks_mut(PACKET))
            .enumerate()
            .map(|(tile, (cdf, totals))| self.tile(scene, store, tile * PACKET, cdf, totals))
            .reduce(RayStats::default, |mut a, b| {
                a.merge(&b);
                a
            });
        (Pmfs { vertices, cdf }, totals, stats)
    }

    /// Up to sixteen neighbouring cache points from number `first` on.
    fn tile(
        &self,
        scene: &PreparedScene,
        store: &LightStore,
        first: usize,
        cdf: &mut [f32],
        totals: &mut [f64],
    ) -> RayStats {
        let mut tracer = Tracer::new(&*scene.query);
        let vertices = store.vertices.len();
        let (points, sides) = (&self.index.points()[first..], &self.index.normals()[first..]);
        for (v, y) in store.vertices.iter().enumerate() {
            let y = &y.vertex;
            let mut packet = SegmentPacket::default();
            let mut asked = [(0usize, 0.0f32); PACKET];
            for c in 0..totals.len() {
                let brings = y.brings(points[c], sides[c]);
                if brings > 0.0 && brings.is_finite() {
                    asked[packet.len] = (c, brings);
                    packet.push(&segment(
                        &SegmentEnd::Surface {
                            p: points[c],
                            error: self.errors[first + c],
                            ng: self.geometric[first + c],
                        },
                        &SegmentEnd::Surface { p: y.point.p, error: y.point.error, ng: y.point.ng },
                    ));
                }
            }
            if packet.len == 0 {
                continue;
            }
            let blocked = tracer.occluded_packet(&packet, RayKind::ShadowPmf);
            for (i, &(c, brings)) in asked[..packet.len].iter().enumerate() {
                if blocked >> i & 1 == 0 {
                    cdf[c * vertices + v] = brings;
                }
            }
        }
        for (cdf, total) in cdf.chunks_exact_mut(vertices).zip(totals) {
            let mut sum = 0.0f64;
            for c in cdf.iter_mut() {
                sum += f64::from(*c);
                *c = sum as f32;
            }
            if sum > 0.0 {
                cdf.iter_mut().for_each(|c| *c = (f64::from(*c) / sum) as f32);
            }
            *total = sum / store.paths_traced as f64;
        }
        tracer.stats
    }

    /// Adds an iteration's irradiances to the means.
    pub fn learn(&mut self, irradiances: &[f64]) {
        for (sum, q) in self.sums.iter_mut().zip(irradiances) {
            *sum += q;
        }
        self.iterations += 1;
    }

    /// What must be saved to go on later: the sums, and the number of iterations behind them.
    pub fn state(&self) -> (&[f64], u64) {
        (&self.sums, self.iterations)
    }

    /// Goes on from a saved state; false if it is of other cache points.
    pub fn restore(&mut self, sums: Vec<f64>, iterations: u64) -> bool {
        let fits = sums.len() == self.sums.len();
        if fits {
            (self.sums, self.iterations) = (sums, iterations);
        }
        fits
    }
}
