//! Points inside participating media and the phase functions that scatter light there.
//!
//! No scene can contain a medium yet. Both types have no values: every `match` over kinds of vertices already has an
//! arm for media, and the compiler removes that arm.

/// A point inside a participating medium.
#[derive(Clone, Copy, Debug)]
pub enum MediumPoint {}

/// A phase function at a point of a medium.
#[derive(Clone, Copy, Debug)]
pub enum Phase {}
