//! Interaction of light with a surface point: BSDFs and textures, pure functions of a point.
//!
//! Conventions (all of the program relies on them):
//! * `wo` is the direction back along the walk (towards the camera on an eye sub-path, towards the light on a light
//!   sub-path), `wi` the direction in which it continues. Both are unit vectors that leave the point, in world space.
//! * Values are *cosine weighted*: `eval` returns f · |cos θ_i| with the cosine of `wi` to the *shading* normal.
//! * [`Transport`] says which quantity the walk carries. Light sub-paths carry importance-weighted flux and use the
//!   adjoint BSDF: no η² scaling at refraction, and with shading normals the factor |wo·ns| |wi·ng| / (|wo·ng| |wi·ns|)
//!   (Veach 1997, §5.3).
//! * A delta lobe never shows in `eval` or `pdf`, only in `sample`, where its density is a discrete probability.

pub mod bsdf;
pub mod phase;
pub mod point;
pub mod texture;

pub use bsdf::{Bsdf, BsdfPool, BsdfSample, BsdfView, Features, Material, MaterialSet, StoredBsdf};
pub use phase::{Phase, PhaseLobe, PhaseScattering};
pub use point::SurfacePoint;
pub use texture::{ColorTexture, ScalarTexture, Texture, TextureSet};

/// Which quantity a walk carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// From the camera: radiance.
    Radiance,
    /// From a light: importance (the adjoint BSDF).
    Importance,
}
