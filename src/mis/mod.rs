//! Densities and weights of every technique; nothing else computes a weight.
