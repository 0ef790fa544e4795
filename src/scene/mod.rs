//! The content of a scene file, as plain data with source spans ([`desc`], materials in [`bsdf`]), and what is wrong
//! with it ([`diag`], [`validate`]). No acceleration structures, nothing that renders.

mod boundaries;
pub mod bsdf;
pub mod desc;
pub mod diag;
pub mod medium;
pub mod validate;

pub use bsdf::*;
pub use desc::*;
pub use diag::{Diagnostic, Diagnostics, Severity, Span};
pub use medium::*;
