//! What a scene file says, as plain data with source spans ([`desc`]), and what is wrong with it ([`diag`], [`validate`]).
//! No acceleration structures, nothing that renders.

pub mod desc;
pub mod diag;
pub mod validate;

pub use desc::*;
pub use diag::{Diagnostic, Diagnostics, Severity, Span};
