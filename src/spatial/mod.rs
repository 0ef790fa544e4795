//! Finding things in space: nearest points, clusters of points, orders that keep neighbours together, and the middle of rooms.

pub mod morton;
pub mod nearest;
pub mod point_tree;
pub mod skeleton;

pub use nearest::NearestPoints;
pub use point_tree::PointTree;
pub use skeleton::Skeleton;
