//! Pixel sums and their output.
