//! Pictures in memory, in and out of files, and their comparison.

pub mod buffer;
pub mod read;

pub use buffer::{Image, Pixels};
