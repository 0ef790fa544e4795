//! The gallery: small scenes that between them have every feature, each with reference values from Mitsuba 3
//! (`pictures.py` and `reference.py` in their folder made them).

use lightsieve::load::{LoadOptions, load_scene};
use lightsieve::scene::SceneDesc;
use std::path::{Path, PathBuf};

/// Names of the scenes.
pub const GALLERY: [&str; 12] = [
    "bumps",
    "delta-lights",
    "environment",
    "glass",
    "instances",
    "lens",
    "masks",
    "normals",
    "principled",
    "room",
    "sunsky",
    "textures",
];

/// One of a scene's files.
pub fn file(name: &str, ending: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/gallery").join(format!("{name}.{ending}"))
}

/// A scene, which must be flawless.
pub fn exhibit(name: &str) -> SceneDesc {
    let (scene, diagnostics) =
        load_scene(&file(name, "xml"), &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert!(diagnostics.list.is_empty(), "{name}: {:?}", diagnostics.list);
    scene
}
