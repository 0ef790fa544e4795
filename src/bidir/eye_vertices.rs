//! The vertices of a few eye sub-paths, at which strategies place cache points and importance records.

use super::warm_up::WarmUp;
use crate::math::sampler::PathSampler;
use crate::math::{Rgb, Vec3};
use crate::path::{Edge, ScatterSampler, StoredPlace, Vertex, WalkHooks, WalkRules, WalkStart, streams, walk};
use crate::ray::{RayKind, RayStats, Tracer};
use crate::shade::{BsdfPool, StoredBsdf, Transport};
use rayon::prelude::*;

/// A connectable vertex of an eye sub-path.
#[derive(Clone, Copy, Debug)]
pub struct EyeSubpathVertex {
    /// Place.
    pub place: StoredPlace,
    /// Unit geometric normal on the side from which the sub-path came; zero in a medium.
    pub side: Vec3,
    /// Unit direction towards the vertex before.
    pub wo: Vec3,
    /// The BSDF, in the pool of all vertices.
    pub bsdf: StoredBsdf,
}

impl EyeSubpathVertex {
    /// Position.
    pub fn position(&self) -> Vec3 {
        self.place.position()
    }
}

/// Vertices with their BSDFs.
#[derive(Debug, Default)]
pub struct EyeSubpathVertices {
    /// In the order of the sub-paths.
    pub vertices: Vec<EyeSubpathVertex>,
    /// Their BSDFs.
    pub bsdfs: BsdfPool,
}

impl WalkHooks for EyeSubpathVertices {
    fn vertex(&mut self, v: &Vertex, _tracer: &mut Tracer, _sampler: &mut PathSampler) -> bool {
        if v.scatter.is_black() {
            return false;
        }
        if v.scatter.connectable() {
            let place = v.place.stored();
            let bsdf = self.bsdfs.store(v.scatter.bsdf());
            self.vertices.push(EyeSubpathVertex { place, side: place.side_normal(v.wo), wo: v.wo, bsdf });
        }
        true
    }

    fn escaped(&mut self, _index: u32, _direction: Vec3, _throughput: Rgb, _edge: &Edge) {}
}

impl WarmUp<'_> {
    /// The connectable vertices of `fraction` times as many eye sub-paths as the full picture has pixels, stratified
    /// over the picture.
    pub fn eye_vertices(&self, fraction: f64) -> (EyeSubpathVertices, RayStats) {
        let (scene, seed) = (self.iteration.scene, self.iteration.seed);
        let [width, height] = scene.film_size.map(f64::from);
        let scale = fraction.sqrt();
        let [columns, rows] = [width, height].map(|s| ((s * scale).round() as u64).max(1));
        let rules = WalkRules { limits: self.eye_limits, mode: Transport::Radiance, directions: &ScatterSampler };
        let pieces: Vec<(EyeSubpathVertices, RayStats)> = (0..columns * rows)
            .into_par_iter()
            .map(|i| {
                let mut sampler = PathSampler::new(seed, streams::CACHE, i, 0);
                let u = sampler.origin();
                let at = [(i % columns) as f32 + u[0], (i / columns) as f32 + u[1]];
                let raster = [at[0] / columns as f32 * width as f32, at[1] / rows as f32 * height as f32];
                let start = WalkStart::from_lens(scene, raster, [u[2], u[3]], Rgb::WHITE, RayKind::Cache);
                let (mut found, mut tracer) = (EyeSubpathVertices::default(), self.iteration.tracer());
                walk(scene, start.walk, &rules, &mut tracer, &mut sampler, &mut found);
                (found, tracer.stats)
            })
            .collect();
        let (mut all, mut stats) = (EyeSubpathVertices::default(), RayStats::default());
        for (piece, s) in pieces {
            stats.merge(&s);
            let offset = all.bsdfs.append(&piece.bsdfs);
            all.vertices
                .extend(piece.vertices.into_iter().map(|v| EyeSubpathVertex { bsdf: v.bsdf.offset_by(offset), ..v }));
        }
        (all, stats)
    }
}
