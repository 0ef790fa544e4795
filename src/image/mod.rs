//! Pictures in memory, in and out of files, and their comparison.

mod atomic;
pub mod buffer;
pub mod error_image;
mod exr_in;
pub mod exr_layers;
mod exr_out;
pub mod flip;
pub mod metrics;
mod netpbm;
pub mod read;
pub mod regions;
mod regular;
pub mod write;
pub mod z_test;

pub use atomic::{atomic_write, check_writable, check_writable_folder};
pub use buffer::{Image, Pixels};
pub use exr_layers::ExrFile;
pub use metrics::{Report, SizeMismatch, compare};
pub use read::{Encoding, ImageError, ImageFault, read_image};
pub use regions::RegionErrors;
pub use regular::{MAX_TEXT_BYTES, open_regular, read_regular, read_regular_text};
pub use write::{Layer, OutputFormat, Picture, WriteError, write_picture};
