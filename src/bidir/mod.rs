//! The core that all bidirectional methods share: light and eye sub-paths, the store of light vertices, connections,
//! next event, hits, connections to the lens, and the passes of an iteration.
//!
//! [`Bidirectional`] is the engine. Methods differ in a [`ConnectionStrategy`]: which light sub-paths an eye vertex is connected to; and in its
//! [`ConnectionFactor`](crate::mis::ConnectionFactor): what that does to the density of a connection. One iteration
//! goes through
//!
//! ```text
//! strategy.factor → light_pass: light_subpath → store   → strategy.prepare (pmfs)
//!                               └ lens → light image    → eye_subpath → strategy.draw → connection → film
//!                                                         └ endpoint (hits, next event) → film
//! ```
//!
//! A technique (s, t) is told by its ends: s = 0 the eye walk met a light; s = 1, t ≥ 2 next event; s ≥ 2, t ≥ 2 a
//! connection; t = 1 a splat of the light image, to which the light sub-paths of the full film contribute, also when
//! only part of it is rendered.
//!
//! Weights are `mis`'s. Visibility rays wait in queues and go out in packets; nothing depends on how these were filled.

pub mod allocation;
mod assignment;
mod connection;
pub mod contribution;
mod emission_training;
pub mod endpoint;
mod engine;
mod eye_subpath;
pub mod eye_vertices;
mod lens;
mod light_pass;
pub mod light_subpath;
pub mod replay;
pub mod scratch;
pub mod store;
pub mod strategy;
pub mod vertex;
pub mod warm_up;

pub use allocation::{AllocationOptimizer, ProbedEfficiency, RayCosts};
pub use engine::{BidirSettings, Bidirectional};
pub use light_subpath::LightSubpath;
pub use replay::{ContributionRecord, Replay};
pub use store::{VertexCount, VertexStore};
pub use strategy::{Candidate, ConnectionStrategy, EyeVertex, LightSubpaths, NoConnections};
pub use vertex::LightVertex;
pub use warm_up::WarmUp;
