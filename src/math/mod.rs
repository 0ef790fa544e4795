//! Mathematics without any project types: colours, frames, warps with densities and inverses, hashed random streams,
//! discrete and piecewise distributions, error-bounded floats, statistics.

pub mod box_tree;
pub mod cdf;
pub mod discrete;
pub mod erf;
pub mod float;
pub mod frame;
pub mod fresnel;
pub mod hash;
pub mod measure;
pub mod piecewise;
pub mod rgb;
pub mod sampler;
pub mod trig;
pub mod warp;

pub use frame::Frame;
pub use glam::{DAffine3, DMat4, DVec3, Vec2, Vec3};
pub use measure::{AreaPdf, Pmf, SolidAnglePdf};
pub use rgb::Rgb;
