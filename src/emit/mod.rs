//! Both ends of a path: lights and cameras.
//!
//! Every light can be sampled in both directions: a point (or direction) of the light as seen from a reference point
//! ([`Light::sample_direct`]) and a whole ray that leaves it ([`Light::sample_emission`]); so can the camera
//! ([`Camera::sample_ray`], [`Camera::sample_lens`]). Each sampling function has a density function that agrees with
//! it. Positions are single precision, relative to the scene's centre; constructors take the description in double
//! precision.

pub mod camera;
pub mod delta;
pub mod emission;
pub mod environment;
pub mod envmap;
pub mod filter;
pub mod light;
pub mod lights;
mod orientation;
mod power;
pub mod projector;
pub mod round;
pub mod sample;
mod spherical_triangle;
mod sun_table;
pub mod sunsky;
pub mod triangle;

#[cfg(test)]
mod tests;

pub use camera::{Camera, CameraRay, LensSample};
pub use delta::{DirectionalLight, PointLight, Projection, SpotLight};
pub use emission::{EmissionDistribution, EmissionRecord};
pub use environment::{Environment, EnvironmentLight};
pub use envmap::EnvMap;
pub use filter::PixelFilter;
pub use light::Light;
pub use lights::{LightId, LightSet};
pub use projector::Projector;
pub use round::{RoundEmission, RoundLight};
pub use sample::{DirectSample, EmissionSample, EmitterVertex};
pub use sunsky::{SunSky, SunSkyParams};
pub use triangle::{RadianceTexture, TexturedEmission, TriangleEmission, TriangleLight};

/// An error in the description of a light or camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EmitError {
    /// A transform that flattens space, or is not finite.
    #[error("the transform of the {0} is not invertible")]
    Transform(&'static str),
    /// A number outside of its range.
    #[error("{name} must be {expected}, not {value}")]
    Range {
        /// Name of the number.
        name: &'static str,
        /// The expected value or range.
        expected: &'static str,
        /// The given value.
        value: f64,
    },
}

/// `value`, if `ok`; otherwise the error that says what was expected.
fn in_range(name: &'static str, value: f64, ok: bool, expected: &'static str) -> Result<f64, EmitError> {
    if ok { Ok(value) } else { Err(EmitError::Range { name, expected, value }) }
}
