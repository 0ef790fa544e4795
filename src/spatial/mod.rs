//! Points in space: clusters of light sources, nearest points, and an order that keeps neighbours together.

pub mod morton;
pub mod nearest;
pub mod point_tree;

pub use nearest::NearestPoints;
pub use point_tree::PointTree;
