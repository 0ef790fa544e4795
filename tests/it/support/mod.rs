//! What tests of several topics use.

pub mod gallery;
pub mod methods;
pub mod pictures;
pub mod program;
pub mod rust_source;
