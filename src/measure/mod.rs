//! Measuring: error against time, where the time goes, and what a stranger needs to check either.
//!
//! Nothing in here prints or reads a command line. [`converge`] runs methods side by side, [`curve`] makes answers of what they
//! left and [`study`] puts them together, [`profile`] looks into one method, [`mod@bench`] compares with an earlier day, [`merge`] adds renders up, [`report`]
//! writes it all into one file that a browser opens.

pub mod bench;
pub mod converge;
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
pub use method::Contender;
pub use reference::Reference;
