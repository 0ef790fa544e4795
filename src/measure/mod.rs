//! Measurements: error against time, profiles of the time, and the facts about the machine that a reader needs to
//! judge both.
//!
//! Nothing in this room prints or reads a command line. [`converge`] runs methods side by side, [`curve`] derives
//! mean curves and speed-ups from their runs, [`study`] puts these together, [`profile`] examines one method,
//! [`mod@bench`] compares with earlier measurements, [`merge`] adds renders up, and [`report`] writes everything into
//! one HTML file.

pub mod bench;
pub mod choice;
pub mod converge;
pub mod consensus;
pub mod curve;
pub mod machine;
pub mod merge;
pub mod method;
pub mod profile;
pub mod recorder;
pub mod reference;
pub mod report;
pub mod study;
pub mod visibility;

pub use machine::{LoadWatch, Machine};
pub use method::parse_methods;
pub use reference::Reference;
