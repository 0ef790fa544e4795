//! One sample, run again and written down: the tool with which a firefly or a value that is not finite is explained.

use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::mis::definition::{Joined, densities};
use crate::mis::{Resampled, Weigher};
use crate::path::{FullPath, Interior, Origin, SurfaceVertex};
use crate::prepared::PreparedScene;
use crate::shade::BsdfSample;

/// What happened in one sample of one pixel.
#[derive(Clone, Debug, Default)]
pub struct Replay {
    /// The pixel whose sample it is.
    pub pixel: (u32, u32),
    /// The eye sub-path, z_1 first.
    pub eye: Vec<VertexRecord>,
    /// The light sub-path, y_1 first.
    pub light: Vec<VertexRecord>,
    /// Everything that was found, blocked or not.
    pub contributions: Vec<Contribution>,
}

/// A surface vertex of a sub-path.
#[derive(Clone, Debug)]
pub struct VertexRecord {
    /// The point with what its densities need.
    pub interior: Interior,
    /// Unit direction back along the walk.
    pub wo: Vec3,
    /// Length of the edge to the vertex before.
    pub distance: f32,
    /// Density per steradian with which that edge's direction was drawn (of a delta event its probability).
    pub pdf: SolidAnglePdf,
    /// Survival of roulette at the vertex before.
    pub survival: f32,
    /// Throughput up to the vertex.
    pub throughput: Rgb,
}

/// A path that was found.
#[derive(Clone, Debug)]
pub struct Contribution {
    /// Light vertices.
    pub s: usize,
    /// Eye vertices.
    pub t: usize,
    /// The pixel it goes to.
    pub pixel: (u32, u32),
    /// What the technique by itself estimates.
    pub raw: Rgb,
    /// Its weight.
    pub weight: f32,
    /// Nothing is in the way.
    pub visible: bool,
    /// The path, where the integrator can tell.
    pub path: Option<FullPath>,
    /// ln n_s c_s p_s of every technique that makes the path, and their weights by definition; empty where `path` is.
    pub techniques: Vec<(f64, f64)>,
}

impl Contribution {
    /// A contribution of the technique (s, t), not yet known to be visible.
    pub fn new((s, t): (usize, usize), pixel: (u32, u32), raw: Rgb, weight: f32) -> Contribution {
        Contribution { s, t, pixel, raw, weight, visible: false, path: None, techniques: vec![] }
    }
}

impl Replay {
    /// Notes a vertex of the eye's (`eye`) or the light's walk.
    pub fn vertex(&mut self, eye: bool, v: &SurfaceVertex) {
        let record = VertexRecord {
            interior: Interior { point: *v.point, bsdf: v.bsdf.clone(), light_normal: v.light_normal, delta: None },
            wo: v.wo,
            distance: v.edge.distance,
            pdf: v.edge.pdf,
            survival: v.edge.survival,
            throughput: v.throughput,
        };
        if eye { self.eye.push(record) } else { self.light.push(record) }
    }

    /// Notes how the walk left its last vertex.
    pub fn leaving(&mut self, eye: bool, sample: &BsdfSample) {
        let last = if eye { self.eye.last_mut() } else { self.light.last_mut() };
        if let (Some(v), true) = (last, sample.delta) {
            let (forward, reverse) = (sample.pdf, sample.pdf_reverse_delta);
            v.interior.delta =
                Some(if eye { ([reverse, forward], sample.reverse_delta) } else { ([forward, reverse], sample.value) });
        }
    }

    /// The path that joins the first s − 1 surface vertices of the light sub-path and the first `n_eye` of the eye sub-path.
    pub fn path(&self, origin: Origin, s: usize, n_eye: usize, lens: Vec3) -> FullPath {
        // The event at the end of a sub-path is the connection, if there is one, whatever the walk did there afterwards.
        let ending = |mut part: Vec<Interior>| {
            if let (Some(v), true) = (part.last_mut(), s > 0) {
                v.delta = None;
            }
            part
        };
        let part =
            |records: &[VertexRecord], n: usize| ending(records[..n].iter().map(|v| v.interior.clone()).collect());
        let mut interior = part(&self.light, s.saturating_sub(1));
        interior.extend(part(&self.eye, n_eye).into_iter().rev());
        FullPath { origin, interior, lens }
    }

    /// Notes a contribution and its path; returns its number.
    ///
    /// `factor_of` is c of a connection, of integrators whose weights know of resampling.
    pub fn found(
        &mut self,
        scene: &PreparedScene,
        weigher: &Weigher,
        factor_of: &dyn Fn(&Resampled, &Joined) -> f32,
        mut contribution: Contribution,
        path: Option<FullPath>,
    ) -> u32 {
        if let Some(path) = &path {
            let densities = densities(scene, weigher, factor_of, path);
            contribution.techniques =
                densities.log_shares(weigher).into_iter().zip(densities.weights(weigher)).collect();
        }
        contribution.path = path;
        self.contributions.push(contribution);
        self.contributions.len() as u32 - 1
    }
}
