//! A folder of its own for every test, a scene small enough to render in milliseconds, and the program run in that
//! folder.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
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

/// Longest time that a command of a test may take.
const TIMEOUT: Duration = Duration::from_secs(60);

/// A running `lightsieve`. It is killed and reaped when dropped, so that a failed assertion leaves no process behind.
pub struct Process {
    pub child: Child,
}

impl Process {
    /// Waits for the end of the process.
    ///
    /// # Panics
    /// If it has not ended after [`TIMEOUT`], or if it panicked.
    #[track_caller]
    pub fn finish(mut self) -> Run {
        let stdout = self.child.stdout.take().map(read_all);
        let stderr = self.child.stderr.take().map(read_all);
        let deadline = Instant::now() + TIMEOUT;
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("the process can be waited for") {
                break status;
            }
            assert!(Instant::now() < deadline, "the process has not ended after {TIMEOUT:?}");
            std::thread::sleep(Duration::from_millis(2));
        };
        let text = |reader: Option<JoinHandle<Vec<u8>>>| {
            let bytes = reader.map_or(Vec::new(), |r| r.join().expect("the pipe can be read"));
            String::from_utf8(bytes).expect("the program writes UTF-8")
        };
        let run = Run { code: status.code(), stdout: text(stdout), stderr: text(stderr) };
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
        run
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail if the process has been waited for already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads a pipe to its end on a thread of its own, as a full pipe would block the process.
fn read_all(mut pipe: impl Read + Send + 'static) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.read_to_end(&mut bytes).expect("the pipe can be read");
        bytes
    })
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

    /// Starts `lightsieve` in the folder; arguments are separated by blanks.
    pub fn start(&self, arguments: &str) -> Process {
        let child = Command::new(env!("CARGO_BIN_EXE_lightsieve"))
            .current_dir(self.folder.path())
            .args(arguments.split_whitespace())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        Process { child }
    }

    /// Runs `lightsieve` in the folder to its end; arguments are separated by blanks.
    #[track_caller]
    pub fn run(&self, arguments: &str) -> Run {
        self.start(arguments).finish()
    }
}
