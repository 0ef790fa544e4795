//! Paths: vertices, the one random walk, and visibility rays on their way.
//!
//! Integrators never write a bounce loop: they give [`walk()`] an origin and hooks.

pub mod directions;
pub mod flight;
pub mod full;
pub mod iteration;
pub mod passage;
pub mod roulette;
pub mod streams;
pub mod vertex;
pub mod visibility;
pub mod walk;

pub use directions::{DirectionSampler, ScatterSampler};
pub use flight::{FreeFlight, SegmentFlight, segment_flight};
pub use full::{FullPath, Interior, Origin};
pub use iteration::Iteration;
pub use passage::first_seen;
pub use roulette::PathLimits;
pub use vertex::{Edge, Place, Scatter, Scattering, StoredPlace, Vertex};
pub use visibility::{ShadowQueue, direct_segment};
pub use walk::{CameraStart, WalkHooks, WalkRules, WalkStart, walk};
