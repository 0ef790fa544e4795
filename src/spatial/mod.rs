//! Points in space: clusters of light sources, nearest points, and an order that keeps neighbours together.

pub mod hash_grid;
pub mod light_tree;
pub mod morton;
pub mod nearest;

pub use hash_grid::HashGrid;
pub use light_tree::{LightTree, VplTree};
pub use nearest::NearestPoints;
