//! Spatial indices for caches and lights.
