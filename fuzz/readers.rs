//! Readers of files as functions of bytes, for fuzzing. Each must return: a panic, an abort or a hang is a fault. The
//! tests of the package and the targets of cargo-fuzz share this file.

use lightsieve::image::Encoding;
use lightsieve::image::read::decode;
use lightsieve::integrators::{Params, REGISTRY};
use lightsieve::load::{LoadOptions, load_scene};
use lightsieve::prepared::{PrepareOptions, PreparedScene};
use lightsieve::ray::Backend;
use lightsieve::render::method::find_integrator;
use lightsieve::render::run::run;
use lightsieve::render::{Budget, Method, Observer, Plan, RenderIdentity, Runtime};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// A reader and its name.
pub type Reader = (&'static str, fn(&[u8]));

/// Every reader.
pub const READERS: [Reader; 9] = [
    ("xml", xml),
    ("obj", obj),
    ("mtl", mtl),
    ("ply", ply),
    ("serialized", serialized),
    ("picture", picture),
    ("exr-layers", exr_layers),
    ("checkpoint", checkpoint),
    ("parameters", parameters),
];

/// A folder of this thread for the files that readers are given.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Folder {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let n = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("lightsieve-fuzz-{}-{n}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the temporary folder is writable");
        let files = [("mesh.obj", OBJ_WITH_LIBRARY), ("mesh.xml", SERIALIZED_SCENE), ("part.xml", PART)];
        files.iter().for_each(|(name, text)| std::fs::write(path.join(name), text).expect("a file can be written"));
        Folder(path)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).expect("a file can be written");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

thread_local! {
    static FOLDER: Folder = Folder::new();
}

const OBJ_WITH_LIBRARY: &str = "mtllib library.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
const PART: &str = "<scene version=\"3.0.0\"><shape type=\"sphere\"/></scene>";
const SERIALIZED_SCENE: &str = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"serialized\">\
    <string name=\"filename\" value=\"mesh.serialized\"/><integer name=\"shape_index\" value=\"0\"/></shape></scene>";

fn load(path: &Path) {
    let _ = load_scene(path, &LoadOptions::default());
}

/// Writes the bytes to a file of that name and loads the scene `scene` beside it.
fn load_with(name: &str, bytes: &[u8], scene: &str) {
    FOLDER.with(|folder| {
        let written = folder.write(name, bytes);
        load(&written.with_file_name(scene));
    });
}

/// A scene file.
pub fn xml(bytes: &[u8]) {
    load_with("scene.xml", bytes, "scene.xml");
}

/// A model.
pub fn obj(bytes: &[u8]) {
    load_with("model.obj", bytes, "model.obj");
}

/// A library of materials that a model names.
pub fn mtl(bytes: &[u8]) {
    load_with("library.mtl", bytes, "mesh.obj");
}

/// A mesh.
pub fn ply(bytes: &[u8]) {
    load_with("model.ply", bytes, "model.ply");
}

/// A mesh of Mitsuba's format that a scene names.
pub fn serialized(bytes: &[u8]) {
    load_with("mesh.serialized", bytes, "mesh.xml");
}

/// A picture of any format.
pub fn picture(bytes: &[u8]) {
    for (is_tga, encoding) in [(false, Encoding::Auto), (true, Encoding::Linear)] {
        let _ = decode(bytes, is_tga, encoding);
    }
}

/// All layers of an EXR file.
pub fn exr_layers(bytes: &[u8]) {
    FOLDER.with(|folder| {
        let _ = lightsieve::image::ExrFile::read(&folder.write("layers.exr", bytes));
    });
}

/// Names and values of parameters, `key=value` a line, for every integrator.
pub fn parameters(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    for spec in REGISTRY {
        let mut params = Params::defaults(spec);
        for (key, value) in text.lines().filter_map(|line| line.split_once('=')) {
            let _ = params.set(key, value);
        }
        drop((spec.build)(&params));
    }
}

/// Integrators whose checkpoints are read: each kind of state.
pub const STATES: [&str; 5] = ["path", "bdpt", "two-stage", "skeleton", "ic-bdpt"];

/// A scene of four pixels.
fn tiny_scene() -> &'static PreparedScene {
    static SCENE: OnceLock<PreparedScene> = OnceLock::new();
    SCENE.get_or_init(|| {
        let path = FOLDER.with(|folder| folder.write("tiny.xml", TINY.as_bytes()));
        let (desc, mut diagnostics) = load_scene(&path, &LoadOptions::default()).expect("the scene is right");
        let options = PrepareOptions { backend: Backend::default_available(), threads: 1, size: None, crop: None };
        PreparedScene::build(desc, &options, &mut diagnostics).expect("the scene is right")
    })
}

const TINY: &str = "<scene version=\"3.0.0\"><sensor type=\"perspective\"><film type=\"hdrfilm\">\
    <integer name=\"width\" value=\"2\"/><integer name=\"height\" value=\"2\"/></film></sensor>\
    <shape type=\"cube\"><transform name=\"to_world\"><scale value=\"3\"/></transform></shape>\
    <shape type=\"rectangle\"><transform name=\"to_world\"><translate z=\"2\"/></transform>\
    <emitter type=\"area\"><rgb name=\"radiance\" value=\"1\"/></emitter></shape></scene>";

struct Silent;

impl Observer for Silent {}

/// Runs the tiny scene up to `iterations` iterations, saving to `checkpoint` or going on from it.
fn run_tiny(integrator: &str, iterations: u64, checkpoint: Option<&Path>, resume: Option<&Path>) {
    static POOL: OnceLock<rayon::ThreadPool> = OnceLock::new();
    let pool =
        POOL.get_or_init(|| rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started"));
    let spec = find_integrator(integrator).expect("an integrator of that name");
    let mut params = Params::defaults(spec);
    // Few light sub-paths and voxels are enough; integrators without these parameters refuse them.
    for (key, value) in [("presampled_paths", "16"), ("voxel_resolution", "12")] {
        let _ = params.set(key, value);
    }
    let plan = Plan {
        budget: Budget { iterations: Some(iterations), time: None },
        checkpoint: checkpoint.map(Path::to_owned),
        resume: resume.map(Path::to_owned),
        ..Plan::new(Method { label: integrator.into(), spec, params }, 0)
    };
    let interrupt = AtomicBool::new(false);
    let _ = run(tiny_scene(), &plan, Runtime { pool, interrupt: &interrupt, observer: &Silent });
}

/// A checkpoint of the tiny scene by each of [`STATES`].
pub fn checkpoints() -> Vec<Vec<u8>> {
    let save = |integrator: &&str| {
        FOLDER.with(|folder| {
            let path = folder.0.join("saved");
            run_tiny(integrator, 3, Some(&path), None);
            std::fs::read(path).expect("the checkpoint was saved")
        })
    };
    STATES.iter().map(save).collect()
}

/// A checkpoint: as it is, and with the checksum of its contents, so that the decoder behind the checksum is reached.
pub fn checkpoint(bytes: &[u8]) {
    let mut summed = bytes.to_vec();
    if let Some((contents, checksum)) = summed.split_last_chunk_mut::<4>() {
        *checksum = crc32fast::hash(contents).to_le_bytes();
    }
    FOLDER.with(|folder| {
        let path = folder.write("checkpoint", &summed);
        // One that is accepted is rendered on from.
        STATES.iter().for_each(|integrator| run_tiny(integrator, 4, None, Some(&path)));
        let path = folder.write("checkpoint", bytes);
        let spec = find_integrator("path").expect("an integrator of that name");
        let method = Method { label: "path".into(), spec, params: Params::defaults(spec) };
        let _ = RenderIdentity::new(tiny_scene(), &Plan::new(method, 0)).load(&path);
    });
}
