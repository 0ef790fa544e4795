//! One sample, run again and written down: explains a firefly or a value that is not finite.

use super::contribution::Contribution;
use super::endpoint::light_choice_normal;
use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::mis::oracle::FactorOf;
use crate::mis::{ConnectionFactor, Heuristic, MisContext, PathPdfs};
use crate::path::{FullPath, Interior, Origin, Place, Vertex};
use crate::prepared::PreparedScene;
use crate::ray::{Segment, Transmittance};
use crate::shade::BsdfSample;

/// All that happened in one sample of one pixel.
#[derive(Clone, Debug, Default)]
pub struct Replay {
    /// The pixel.
    pub pixel: (u32, u32),
    /// The eye sub-path, z_1 first.
    pub eye: Vec<VertexRecord>,
    /// The light sub-path, y_1 first.
    pub light: Vec<VertexRecord>,
    /// All contributions, blocked or not.
    pub contributions: Vec<ContributionRecord>,
}

/// Which of the two sub-paths of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubpathKind {
    /// From the camera.
    Eye,
    /// From a light.
    Light,
}

/// A vertex of a sub-path.
#[derive(Clone, Debug)]
pub struct VertexRecord {
    /// The point with what its densities need.
    pub interior: Interior,
    /// The shading normal, on a surface.
    pub shading_normal: Option<Vec3>,
    /// Unit direction back along the walk.
    pub wo: Vec3,
    /// Length of the edge to the vertex before.
    pub distance: f32,
    /// Density per steradian with which the direction of that edge was drawn (of a delta event its probability).
    pub pdf: SolidAnglePdf,
    /// Survival of Russian roulette at the vertex before.
    pub survival: f32,
    /// Throughput up to the vertex.
    pub throughput: Rgb,
}

/// A contribution with its path.
#[derive(Clone, Debug)]
pub struct ContributionRecord {
    /// Light vertices.
    pub s: usize,
    /// Eye vertices.
    pub t: usize,
    /// The pixel it goes to.
    pub pixel: (u32, u32),
    /// Estimate of the technique by itself.
    pub raw: Rgb,
    /// Its weight.
    pub weight: f32,
    /// Nothing is in the way.
    pub visible: bool,
    /// The path, where the integrator can tell.
    pub path: Option<FullPath>,
    /// ln n_s c_s p_s of every technique that makes the path, and their weights by definition; empty without `path`.
    pub techniques: Vec<(f64, f64)>,
}

impl ContributionRecord {
    /// A contribution of the technique (s, t), not yet known to be visible.
    pub fn new((s, t): (usize, usize), pixel: (u32, u32), raw: Rgb, weight: f32) -> ContributionRecord {
        ContributionRecord { s, t, pixel, raw, weight, visible: false, path: None, techniques: vec![] }
    }

    /// A contribution that is not yet known to be visible, seen through the masks on the connection `segment` if it has
    /// one.
    pub fn of(
        contribution: &Contribution,
        segment: Option<&Segment>,
        scene: &PreparedScene,
        heuristic: Heuristic,
    ) -> ContributionRecord {
        let transmittance = segment.map_or(Transmittance::ONE, |segment| scene.tracer().transmittance(segment));
        let seen = if transmittance.is_zero() { *contribution } else { contribution.through(transmittance, heuristic) };
        let technique = (usize::from(seen.s), usize::from(seen.t));
        ContributionRecord::new(technique, (seen.x, seen.y), seen.raw, seen.weight.own)
    }
}

impl Replay {
    fn subpath(&mut self, kind: SubpathKind) -> &mut Vec<VertexRecord> {
        match kind {
            SubpathKind::Eye => &mut self.eye,
            SubpathKind::Light => &mut self.light,
        }
    }

    /// Writes down a vertex of a walk.
    pub fn vertex(&mut self, kind: SubpathKind, scene: &PreparedScene, v: &Vertex) {
        let record = VertexRecord {
            interior: Interior {
                place: v.place.stored(),
                media: v.media,
                bsdf: v.scatter.bsdf().clone(),
                light_choice_normal: light_choice_normal(scene, v),
                delta: None,
            },
            shading_normal: match v.place {
                Place::Surface { point, .. } => Some(point.frame.n),
                Place::Medium(_) => None,
            },
            wo: v.wo,
            distance: v.edge.distance,
            pdf: v.edge.pdf,
            survival: v.edge.survival,
            throughput: v.throughput,
        };
        self.subpath(kind).push(record);
    }

    /// Writes down how a walk left its last vertex.
    pub fn leaving(&mut self, kind: SubpathKind, sample: &BsdfSample) {
        if let (Some(v), true) = (self.subpath(kind).last_mut(), sample.delta) {
            let (forward, reverse) = (sample.pdf, sample.pdf_reverse_delta);
            v.interior.delta = Some(match kind {
                SubpathKind::Eye => ([reverse, forward], sample.reverse_delta),
                SubpathKind::Light => ([forward, reverse], sample.value),
            });
        }
    }

    /// The path that connects the first s − 1 surface vertices of the light sub-path and the first `eye_vertices` of
    /// the eye sub-path.
    pub fn path(&self, origin: Origin, s: usize, eye_vertices: usize, lens: Vec3) -> FullPath {
        // The event at the end of a sub-path is the connection, if there is one, and not the event by which the walk
        // went on.
        let first = |records: &[VertexRecord], n: usize| {
            let mut part: Vec<Interior> = records[..n].iter().map(|v| v.interior.clone()).collect();
            if let (Some(v), true) = (part.last_mut(), s > 0) {
                v.delta = None;
            }
            part
        };
        let mut interior = first(&self.light, s.saturating_sub(1));
        interior.extend(first(&self.eye, eye_vertices).into_iter().rev());
        FullPath { origin, interior, lens }
    }

    /// Writes down a contribution and its path, with the weights of all techniques by definition; returns its number.
    pub fn contribution<F: ConnectionFactor>(
        &mut self,
        scene: &PreparedScene,
        mis: &MisContext<F>,
        factor_of: FactorOf,
        mut contribution: ContributionRecord,
        path: Option<FullPath>,
    ) -> u32 {
        if let Some(path) = &path {
            let pdfs = PathPdfs::new(scene, mis, factor_of, path);
            contribution.techniques = pdfs.log_effective_pdfs(mis).into_iter().zip(pdfs.weights(mis)).collect();
        }
        contribution.path = path;
        self.contributions.push(contribution);
        self.contributions.len() as u32 - 1
    }
}
