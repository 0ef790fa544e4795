//! The pipeline from a scene file to pictures ([`job`]) and the loop over iterations ([`iterations`]), with
//! statistics, checkpoints and output. Everything that renders goes through these two.

pub mod aov;
pub mod checkpoint;
pub mod error_target;
pub mod estimator;
pub mod files;
pub mod iterations;
pub mod job;
pub mod memory;
pub mod method;
pub mod output;
pub mod request;
pub mod run;
pub mod runtime;
mod scene_hash;
pub mod schedule;
pub mod stats;

pub use aov::Aov;
pub use checkpoint::{CheckpointError, RenderIdentity};
pub use error_target::ErrorTarget;
pub use estimator::Estimator;
pub use files::OutputFiles;
pub use iterations::{Outcome, Progress, Schedule, Stop, run_iterations};
pub use job::{LoadedScene, PreparedJob, render};
pub use method::{Method, MethodRequest};
pub use output::Finished;
pub use request::{OutputRequest, Plan, PyramidRequest, RenderRequest, SceneRequest};
pub use run::Rendered;
pub use runtime::{JobError, Observer, Runtime};
pub use scene_hash::scene_hash;
pub use schedule::Budget;
pub use stats::RenderStats;
