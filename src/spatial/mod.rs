//! Finding things in space: nearest points, orders that keep neighbours together, and the skeleton of empty space.

pub mod morton;
pub mod nearest;
pub mod skeleton;

pub use nearest::NearestPoints;
pub use skeleton::Skeleton;
