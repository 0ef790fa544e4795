//! Vertices, sub-paths and the one random walk.
