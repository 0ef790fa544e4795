//! Paths: vertices, the one random walk, and shadow rays on their way.
//!
//! Integrators never write a bounce loop: they give [`walk()`] an origin and hooks.

pub mod full;
pub mod shadow;
pub mod vertex;
pub mod walk;

pub use full::{FullPath, Interior, Origin};
pub use shadow::{ShadowQueue, direct_segment};
pub use vertex::{Edge, SurfaceVertex};
pub use walk::{Limits, WalkHooks, WalkStart, walk};
