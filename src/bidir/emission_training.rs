//! Training of guided emission: eye sub-paths before the first iteration find rays of lights that bring light to the
//! picture.
//!
//! A ray of a light matters by the light that it brings to the picture over paths that only sub-paths from the light find
//! well. An eye sub-path that is connected to a point of a light by next event, or meets a light after a specular
//! surface, has found a whole path, and with it the path's first ray from the light. Light that the camera sees after
//! one scattering event is found by next event anyway and does not count.

use super::endpoint::{
    DirectLight, DirectSampleSink, emitted_at, for_each_background, light_choice_normal, sample_direct,
};
use super::warm_up::WarmUp;
use crate::emit::{DirectSample, EmissionDistribution, EmissionRecord, LightId};
use crate::math::sampler::PathSampler;
use crate::math::{Pmf, Rgb, Vec3};
use crate::path::{
    Edge, PathLimits, ScatterSampler, ShadowQueue, Vertex, WalkHooks, WalkRules, WalkStart, direct_segment, streams,
    walk,
};
use crate::prepared::PreparedScene;
use crate::ray::{RayKind, RayStats, Tracer, Transmittance};
use crate::shade::Transport;
use rayon::prelude::*;

/// Eye sub-paths that are traced, at most: one for each pixel of a small picture.
const SUBPATHS: u64 = 32_768;
/// Eye sub-paths are as long as those of bidirectional path tracing, whatever the method's own are: methods that are
/// compared in a scene have one guide.
const RR_DEPTH: u32 = 2;
/// Eye sub-paths in a piece of work.
const CHUNK: u64 = 256;

/// Which whole paths count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainingPaths {
    /// All paths that scatter light: no technique but the light image is in use.
    Scattered,
    /// Paths that scatter light at least twice: next event finds the others.
    Indirect,
}

/// Finds rays along eye sub-paths.
struct Training<'a> {
    scene: &'a PreparedScene,
    /// Eye vertices from this number on count.
    first_vertex: u32,
    queue: ShadowQueue<Option<EmissionRecord>>,
    records: Vec<EmissionRecord>,
}

impl<'a> Training<'a> {
    fn new(scene: &'a PreparedScene, paths: TrainingPaths) -> Training<'a> {
        let first_vertex = match paths {
            TrainingPaths::Scattered => 1,
            TrainingPaths::Indirect => 2,
        };
        Training { scene, first_vertex, queue: ShadowQueue::new(RayKind::ShadowPmf), records: vec![] }
    }

    /// All finds.
    fn finish(mut self, tracer: &mut Tracer) -> Vec<EmissionRecord> {
        let records = &mut self.records;
        self.queue.flush(tracer, |record, transmittance| Training::arrive(records, record, transmittance));
        self.records
    }

    fn add(records: &mut Vec<EmissionRecord>, record: EmissionRecord) {
        if record.weight > 0.0 && record.weight.is_finite() {
            records.push(record);
        }
    }

    /// The segment of a record from the queue passes some light.
    fn arrive(records: &mut Vec<EmissionRecord>, record: Option<EmissionRecord>, transmittance: Transmittance) {
        if let Some(record) = record {
            let passed = f64::from((Rgb::WHITE * transmittance).luminance());
            Training::add(records, EmissionRecord { weight: record.weight * passed, ..record });
        }
    }

    /// A hit of a light is a find only if next event could not have made it.
    fn hit(&mut self, light: LightId, index: u32, direction: Vec3, raw: Rgb, edge: &Edge) {
        if index > self.first_vertex && edge.delta {
            let record =
                EmissionRecord { light, p: edge.from, direction: -direction, weight: f64::from(raw.luminance()) };
            Training::add(&mut self.records, record);
        }
    }
}

/// Next event at a vertex.
struct NextEvent<'a, 'g, 't> {
    training: &'a mut Training<'g>,
    vertex: &'a Vertex<'a>,
    tracer: &'a mut Tracer<'t>,
}

impl DirectSampleSink for NextEvent<'_, '_, '_> {
    fn accept(&mut self, light: LightId, pmf: Pmf, sample: &DirectSample) {
        let vertex = self.vertex;
        let Some(direct) = DirectLight::new(vertex, &ScatterSampler, sample, pmf) else { return };
        let weight = f64::from(direct.raw.luminance());
        let record = EmissionRecord { light, p: vertex.position(), direction: -sample.wi, weight };
        let segment = direct_segment(&vertex.place.segment_end(), sample);
        let Training { records, queue, .. } = &mut *self.training;
        queue.push(&segment, Some(record), self.tracer, |record, transmittance| {
            Training::arrive(records, record, transmittance);
        });
    }
}

impl WalkHooks for Training<'_> {
    fn vertex(&mut self, vertex: &Vertex, tracer: &mut Tracer, sampler: &mut PathSampler) -> bool {
        let scene = self.scene;
        if let Some((light, emitted)) = emitted_at(scene, vertex) {
            self.hit(light, vertex.index, -vertex.wo, vertex.throughput * emitted, vertex.edge);
        }
        if vertex.scatter.is_black() {
            return false;
        }
        if vertex.index >= self.first_vertex && vertex.scatter.connectable() {
            let normal = light_choice_normal(scene, vertex);
            sample_direct(scene, vertex, normal, sampler, &mut NextEvent { training: self, vertex, tracer });
        }
        true
    }

    fn escaped(&mut self, index: u32, direction: Vec3, throughput: Rgb, edge: &Edge) {
        for_each_background(self.scene, direction, |light, emitted| {
            self.hit(light, index, direction, throughput * emitted, edge);
        });
    }
}

impl WarmUp<'_> {
    /// The distribution of emission that eye sub-paths of the whole picture teach; unguided without lights at infinity.
    pub fn train_emission(&self, paths: TrainingPaths) -> (EmissionDistribution, RayStats) {
        let scene = self.iteration.scene;
        if scene.lights.infinite().is_empty() {
            return (EmissionDistribution::default(), RayStats::default());
        }
        let pixels = u64::from(scene.film_size[0]) * u64::from(scene.film_size[1]);
        let count = pixels.min(SUBPATHS);
        let pieces: Vec<(Vec<EmissionRecord>, RayStats)> = (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map(|piece| {
                let mut training = Training::new(scene, paths);
                let mut tracer = self.iteration.tracer();
                for number in piece * CHUNK..count.min((piece + 1) * CHUNK) {
                    // Pixels at equal distances.
                    self.train_by_pixel(number * pixels / count, &mut training, &mut tracer);
                }
                (training.finish(&mut tracer), tracer.stats)
            })
            .collect();
        let (mut records, mut stats) = (vec![], RayStats::default());
        for (found, s) in pieces {
            records.extend(found);
            stats.merge(&s);
        }
        // A ray that was found by a rare chance must not outweigh all others.
        let mean = records.iter().map(|record| record.weight).sum::<f64>() / count as f64;
        records.iter_mut().for_each(|record| record.weight /= record.weight + mean);
        (EmissionDistribution::guided(&scene.lights, &records), stats)
    }

    /// One eye sub-path of a pixel.
    fn train_by_pixel(&self, pixel: u64, training: &mut Training, tracer: &mut Tracer) {
        let scene = self.iteration.scene;
        let width = u64::from(scene.film_size[0]);
        let mut sampler = PathSampler::new(self.iteration.seed, streams::EMISSION_TRAINING, pixel, 0);
        let u = sampler.origin();
        let raster = [(pixel % width) as f32 + u[0], (pixel / width) as f32 + u[1]];
        let start = WalkStart::from_lens(scene, raster, [u[2], u[3]], Rgb::WHITE, RayKind::Cache);
        let limits = PathLimits { rr_depth: RR_DEPTH, rr_scale: 1.0, ..self.eye_limits };
        let rules = WalkRules { limits, mode: Transport::Radiance, directions: &ScatterSampler };
        walk(scene, start.walk, &rules, tracer, &mut sampler, training);
    }
}
