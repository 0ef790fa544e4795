//! A folder of its own for every test, a scene small enough to render in milliseconds, and the program run in that folder.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::Duration;
use tempfile::TempDir;

/// A closed box of grey walls with a lamp under its ceiling, seen from inside; 16 x 16 pixels.
pub const BOX: &str = r#"<scene version="3.0.0">
    <default name="spp" value="4"/>
    <default name="red" value="0.6"/>
    <integrator type="path">
        <integer name="max_depth" value="5"/>
    </integrator>
    <sensor type="perspective">
        <float name="fov" value="60"/>
        <transform name="to_world">
            <lookat origin="0, 0, 0.9" target="0, 0, -1" up="0, 1, 0"/>
        </transform>
        <sampler type="independent">
            <integer name="sample_count" value="$spp"/>
        </sampler>
        <film type="hdrfilm">
            <integer name="width" value="16"/>
            <integer name="height" value="16"/>
        </film>
    </sensor>
    <bsdf type="twosided" id="grey">
        <bsdf type="diffuse">
            <rgb name="reflectance" value="$red, 0.5, 0.4"/>
        </bsdf>
    </bsdf>
    <shape type="cube">
        <ref id="grey"/>
    </shape>
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="0.4"/>
            <rotate x="1" angle="90"/>
            <translate y="0.95"/>
        </transform>
        <emitter type="area">
            <rgb name="radiance" value="5, 4, 3"/>
        </emitter>
    </shape>
</scene>
"#;

/// How the program ended and what it said.
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl From<Output> for Run {
    fn from(o: Output) -> Run {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("the program speaks UTF-8");
        let run = Run { code: o.status.code(), stdout: text(&o.stdout), stderr: text(&o.stderr) };
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
        run
    }
}

impl Run {
    /// The exit code must be `code`, and standard error must contain each of `parts`.
    #[track_caller]
    pub fn expect(self, code: i32, parts: &[&str]) -> Run {
        assert_eq!(self.code, Some(code), "{}", self.stderr);
        for part in parts {
            assert!(self.stderr.contains(part), "\"{part}\" is not in:\n{}", self.stderr);
        }
        self
    }
}

/// A folder that goes away with the test.
pub struct Sandbox {
    folder: TempDir,
}

impl Sandbox {
    /// With the box in `scene.xml`.
    pub fn new() -> Sandbox {
        let sandbox = Sandbox { folder: tempfile::tempdir().expect("a temporary folder") };
        sandbox.write("scene.xml", BOX);
        sandbox
    }

    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), contents).expect("the folder is writable");
    }

    /// # Panics
    /// If the file is not there.
    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Writes the box with `from` replaced by `to`, which must change it.
    pub fn write_box_with(&self, name: &str, from: &str, to: &str) {
        let changed = BOX.replacen(from, to, 1);
        assert_ne!(changed, BOX, "\"{from}\" is not in the scene");
        self.write(name, changed);
    }

    /// Runs `lightsieve` in the folder; arguments are separated by blanks.
    pub fn run(&self, arguments: &str) -> Run {
        let mut command = assert_cmd::cargo::cargo_bin_cmd!("lightsieve");
        command.current_dir(self.folder.path()).timeout(Duration::from_secs(60));
        command.args(arguments.split_whitespace());
        Run::from(command.output().expect("the program runs"))
    }
}
