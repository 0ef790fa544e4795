//! Finding things in space: nearest points, clusters of points, and orders that keep neighbours together.

pub mod morton;
pub mod nearest;
pub mod point_tree;

pub use nearest::NearestPoints;
pub use point_tree::PointTree;
