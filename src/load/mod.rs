//! Scene files to `SceneDesc`: Mitsuba XML, OBJ with MTL, a lone PLY. Knows nothing of rendering.
//!
//! Every loader collects diagnostics instead of stopping at the first; pictures and meshes are decoded in parallel once
//! the text has been read, and the whole scene is validated at the end.

mod assets;
mod framing;
mod mesh;
mod mitsuba;
mod normals;
mod obj;
mod obj_material;
mod obj_scene;
mod paths;
mod ply;
mod polygon;
mod primitives;
mod report;
mod serialized;
mod vol;

use crate::scene::diag::{Diagnostic, Diagnostics};
use crate::scene::{SceneDesc, validate};
use glam::DVec3;
use report::Report;
use std::path::Path;

/// Options of loading.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// `-D name=value`: replaces `$name` in an XML file and its `<default>`.
    pub definitions: Vec<(String, String)>,
    /// A missing or unreadable picture is an error instead of a magenta stand-in with a warning.
    pub strict: bool,
    /// Unsupported elements that would change the picture are warnings instead of errors.
    pub force: bool,
    /// Camera for files that have none (OBJ, PLY).
    pub camera: CameraOptions,
}

/// A camera for scene files that cannot describe one; what is `None` is chosen so that the whole model is seen.
#[derive(Clone, Copy, Debug, Default)]
pub struct CameraOptions {
    /// Where it stands.
    pub origin: Option<DVec3>,
    /// The point that the camera looks at.
    pub target: Option<DVec3>,
    /// The direction that is up in the picture (+y).
    pub up: Option<DVec3>,
    /// Horizontal field of view in degrees (40).
    pub fov: Option<f64>,
    /// Width and height of the film in pixels (1280 x 720).
    pub resolution: Option<[u32; 2]>,
}

impl CameraOptions {
    /// True if anything but the film is chosen.
    fn is_given(&self) -> bool {
        self.origin.is_some() || self.target.is_some() || self.up.is_some() || self.fov.is_some()
    }
}

/// Why a scene could not be loaded.
#[derive(Clone, Debug)]
pub struct LoadFailure {
    /// Every message, at least one of them an error.
    pub diagnostics: Diagnostics,
    /// True if a file could not be opened or read; false if what it says is wrong.
    pub io: bool,
}

impl std::fmt::Display for LoadFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        use crate::scene::Severity;
        let mut errors = self.diagnostics.list.iter().filter(|d| d.severity == Severity::Error);
        match errors.next() {
            Some(first) => {
                if let Some(span) = &first.span {
                    write!(f, "{}: ", span.location())?;
                }
                write!(f, "{}", first.message)?;
                match errors.count() {
                    0 => Ok(()),
                    more => write!(f, " (and {more} more)"),
                }
            }
            None => write!(f, "the scene could not be loaded"),
        }
    }
}

impl std::error::Error for LoadFailure {}

/// Loads the scene file `path`; its ending (`.xml`, `.obj`, `.ply`, in any case) says what it is.
///
/// # Errors
/// With every error found in the file and the files it names, up to a limit of twenty.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<(SceneDesc, Diagnostics), LoadFailure> {
    let mut report = Report::new(options.force);
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let mut scene = match ending.as_str() {
        "xml" => mitsuba::load(path, options, &mut report),
        "obj" => obj_scene::load_obj(path, options, &mut report),
        "ply" => obj_scene::load_ply(path, options, &mut report),
        _ => {
            report.push(
                Diagnostic::error("load::unknown-format", format!("`{}` is not a scene file", path.display()))
                    .help("scenes end in .xml (Mitsuba), .obj (Wavefront) or .ply"),
            );
            None
        }
    };
    if ending == "xml" && options.camera.is_given() {
        let d = Diagnostic::error("load::camera-options", "options for the camera have no effect on a scene file");
        report.push(d.help("a scene file (.xml) has a camera of its own; the options are for models (.obj, .ply)"));
    }
    if let Some(scene) = &mut scene {
        scene.path = path.to_path_buf();
        report.opened(path);
        scene.files = report.take_files();
        if ending != "xml" && !options.definitions.is_empty() {
            report.push(Diagnostic::warning(
                "load::unused-definition",
                "definitions (-D) have no use in this file format",
            ));
        }
        // A scene with holes in it would only raise errors that follow from the first ones.
        if !report.has_errors() {
            let mut found = Diagnostics::default();
            validate::validate(scene, &mut found);
            found.list.into_iter().for_each(|d| report.push(d));
        }
    }
    let (diagnostics, io) = report.finish();
    match scene {
        Some(scene) if !diagnostics.has_errors() => Ok((scene, diagnostics)),
        _ => Err(LoadFailure { diagnostics, io }),
    }
}
