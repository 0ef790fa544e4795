//! Settings of methods that resample connections at cache points.

use crate::spatial::nearest::Metric;

/// Most cache points of a group: the bits of a mask that tells which of them see a light vertex.
pub(super) const MAX_GROUP: usize = u16::BITS as usize;

/// Settings that users decide.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResamplingSettings {
    /// M; 0: decided by the scene.
    pub paths: u32,
    /// M₂, if there are two stages.
    pub second_stage: Option<u32>,
    /// N, draws of an eye vertex.
    pub samples: u32,
    /// N_c, cache points that an eye vertex draws by.
    pub neighbors: usize,
    /// Eye sub-paths that make cache points, per pixel.
    pub cache_fraction: f64,
    /// Cache points of a group, which share the candidates of the second stage.
    pub group_size: usize,
    /// ε, the lower bound of p/q in weights.
    pub epsilon: f32,
    /// Lower bound of the fraction of light that weights take to be unseen by cache points.
    pub min_unseen_fraction: f32,
    /// Weights take no more light to be unseen than that bound.
    pub trusted: bool,
    /// Which cache points are near.
    pub metric: Metric,
    /// Pmfs at cache points count the BSDF there.
    pub radiance: bool,
    /// Each cache point is a technique of its own.
    pub per_cache: bool,
    /// Cuts of the first of two stages go by visibility learned in earlier iterations.
    pub learned_visibility: bool,
    /// Weights know of the second stage; otherwise they take M₂ for the number of candidates.
    pub two_stage_weights: bool,
}
