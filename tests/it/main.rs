//! Integration tests: the library and the program from outside, one module a topic. They are one crate, so that what
//! they share is compiled and linked once.

mod agreement;
mod architecture;
mod bad_input;
mod checkpoints;
mod cli;
mod cli_techniques;
mod coplanar;
mod factors;
mod fallback;
mod furnace;
mod fuzz;
mod image_metrics;
mod images;
mod kills;
mod leaks;
mod masks;
mod media;
mod measure;
mod options;
mod outputs;
mod rays;
mod regression;
mod resampling;
mod round;
mod scale;
mod scene_files;
mod shading_normals;
mod stress;
mod support;
mod techniques;
mod weights;
