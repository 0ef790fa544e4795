//! Support for tests of several topics.

pub mod gallery;
pub mod methods;
pub mod pictures;
pub mod program;
pub mod rust_source;
