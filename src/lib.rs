//! lightsieve: an offline, physically based renderer that sifts light paths.
//!
//! The library is a row of rooms; each imports only rooms that stand before it in this list (a test enforces it):
//!
//! ```text
//! math → image → scene → load → ray → shade → media → spatial → emit → prepared → skeleton → path → mis → film → bidir → integrators → render → measure → app
//! ```
//!
//! Data flows one way and can be read in [`render::job::render`], which is the table of contents of the program:
//!
//! ```text
//! file → SceneDesc → Plan    → PreparedScene → integrator.iterate(k) → Film → EXR / PNG / JSON
//!      load        resolve   prepare           run                          finish
//! ```
//!
//! A render of four samples per pixel:
//!
//! ```
//! use lightsieve::{film::Film, integrators, load, prepared, scene};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let file = std::path::Path::new("scenes/cornell/cornell.xml");
//! let (scene, _warnings) = load::load_scene(file, &load::LoadOptions::default())?;
//! let options = prepared::PrepareOptions {
//!     backend: lightsieve::ray::Backend::default_available(),
//!     threads: 1,
//!     size: Some([32, 18]),
//!     crop: None,
//! };
//! let scene = prepared::PreparedScene::build(scene, &options, &mut scene::Diagnostics::default())?;
//! let spec = integrators::find("path").ok_or("no such integrator")?;
//! let mut integrator = (spec.build)(&integrators::Params::defaults(spec));
//! let mut film = Film::new(scene.window);
//! for _ in 0..4 {
//!     let index = film.begin_iteration();
//!     integrator.iterate(&integrators::Iteration::new(&scene, 0, index), &mut film);
//! }
//! // Linear Rec. 709 radiance, row by row from the top.
//! let pixels = film.mean();
//! assert_eq!(pixels.len(), 32 * 18);
//! assert!(pixels.iter().any(|p| p.luminance() > 0.0));
//! # Ok(())
//! # }
//! ```
//!
//! Words and notation (used in names and docs): a full path x_0 … x_k runs from the light (x_0) to the camera (x_k);
//! `wo` is the direction a walk came from, `wi` the one it goes on in; a density says its measure in its type
//! ([`math::measure`]).

pub mod math;
pub mod image;
pub mod scene;
pub mod load;
pub mod ray;
pub mod shade;
pub mod media;
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
