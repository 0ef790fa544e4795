//! The driver: iterations until a budget is used up, with statistics, checkpoints and output.

pub mod aov;
pub mod checkpoint;
pub mod driver;
pub mod error_target;
pub mod output;
mod scene_hash;
pub mod stats;

pub use aov::Aov;
pub use checkpoint::{Checkpoint, CheckpointError};
pub use driver::{Budget, Outcome, Progress, Stop, render};
pub use error_target::{ErrorTarget, render_to_target};
pub use scene_hash::scene_hash;
pub use stats::RenderStats;
