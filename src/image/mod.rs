//! Pictures in memory, in and out of files, and their comparison.

mod atomic;
pub mod buffer;
mod exr_in;
mod exr_out;
pub mod flip;
pub mod metrics;
mod netpbm;
pub mod read;
pub mod write;

pub use atomic::atomic_write;
pub use buffer::{Image, Pixels};
pub use metrics::{Report, SizeMismatch, compare};
pub use read::{Encoding, ImageError, ImageFault, read_image};
pub use write::{Layer, OutputFormat, Picture, WriteError, write_picture};
