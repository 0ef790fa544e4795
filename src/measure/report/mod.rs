//! One HTML file that holds everything and opens without a network: tables, plots, and pictures in floats to flip
//! between.

pub mod encode;
pub mod html;
pub mod pictures;
pub mod plot;
pub mod table;

pub use html::Page;
pub use pictures::{Shown, picture_group};
pub use plot::{Line, Plot};
pub use table::Table;
