//! Writes lightsieve's own scenes: `cargo run --release --example generate-scenes [-- OUT_DIR]`. The same program
//! writes the same bytes again.

mod bedroom;
mod cafe;
mod caustic;
mod cathedral;
mod classroom;
mod colonnade;
mod cornell;
mod door;
mod furniture;
mod house;
mod many_lamps;
mod mesh;
mod scene;
mod shapes;
mod texture;

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
    let out = PathBuf::from(env::args().nth(1).unwrap_or(default.into()));
    let scenes = [
        cornell::scene(),
        door::scene(),
        colonnade::scene(),
        bedroom::scene(),
        classroom::scene(),
        house::scene(),
        cathedral::scene(),
        cafe::scene(),
        caustic::scene(),
        many_lamps::scene(),
    ];
    let mut table = String::from(
        "# Scenes\n\nAll of these are written by the program in `generate/` \
         (`cargo run --release --example generate-scenes`), which writes the same bytes every time: change the program, \
         not the files. Mitsuba 3 XML, binary PLY, PNG and HDR; metres, y up.\n\n\
         | scene | what it is for | triangles | lights | size | licence |\n|---|---|---:|---|---:|---|\n",
    );
    for scene in scenes {
        for r in scene.write(&out)? {
            table += &format!(
                "| [{}]({}) | {} | {} | {} | {} kB | MIT OR Apache-2.0 |\n",
                r.name,
                r.file,
                r.purpose,
                r.triangles,
                r.lights,
                r.bytes.div_ceil(1000)
            );
        }
    }
    fs::write(out.join("README.md"), table)
}
