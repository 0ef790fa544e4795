//! lightsieve: an offline, physically based renderer that sifts light paths.
//!
//! The library is a row of rooms; each imports only rooms that stand before it in this list (a test enforces it):
//!
//! ```text
//! math → image → scene → load → ray → shade → spatial → emit → prepared → skeleton → path → mis → film → bidir → integrators → render → measure → app
//! ```
//!
//! Data flows one way and can be read in `render::driver`:
//!
//! ```text
//! file → SceneDesc → PreparedScene → integrator.iterate(k) → Film → EXR / PNG / JSON
//! ```
//!
//! Words and notation (used in names and docs): a full path x_0 … x_k runs from the light (x_0) to the camera (x_k); `wo` is
//! the direction a walk came from, `wi` the one it goes on in; a density says its measure in its type ([`math::measure`]).
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod math;
pub mod image;
pub mod scene;
pub mod load;
pub mod ray;
pub mod shade;
pub mod spatial;
pub mod emit;
pub mod prepared;
pub mod skeleton;
pub mod path;
pub mod mis;
pub mod film;
pub mod bidir;
pub mod integrators;
pub mod render;
pub mod measure;
#[cfg(feature = "cli")]
pub mod app;
