//! Finding things in space: nearest points, and orders that keep neighbours together.

pub mod morton;
pub mod nearest;

pub use nearest::NearestPoints;
