//! Pictures in memory, in and out of files, and their comparison.

pub mod buffer;
mod exr_in;
mod netpbm;
pub mod read;

pub use buffer::{Image, Pixels};
pub use read::{Encoding, ImageError, ImageFault, read_image};
