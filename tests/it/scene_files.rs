//! Scene files as people write them give the pictures that Mitsuba gives. Scenes, pictures and the means that Mitsuba
//! 3.9.1 renders are in tests/data/scene-files.

use crate::support::program::Sandbox;
use lightsieve::image::{Encoding, read_image};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/scene-files")
}

/// Mean of red, green and blue of a picture file.
fn mean(path: &Path) -> [f64; 3] {
    let image = read_image(path, Encoding::Linear).unwrap();
    let mut sum = [0.0; 3];
    for y in 0..image.height {
        for x in 0..image.width {
            let c = image.rgb(x, y);
            sum.iter_mut().zip([c.r, c.g, c.b]).for_each(|(s, c)| *s += f64::from(c));
        }
    }
    sum.map(|s| s / f64::from(image.width * image.height))
}

/// A line of means.txt: scene, definitions, means.
struct Reference {
    scene: String,
    definitions: String,
    mean: [f64; 3],
}

fn references() -> Vec<Reference> {
    let text = std::fs::read_to_string(folder().join("means.txt")).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let [scene, definitions, means] = line.split('|').map(str::trim).collect::<Vec<_>>()[..] else {
                panic!("{line}")
            };
            let definitions = definitions.split_whitespace().map(|d| format!(" -D {d}")).collect();
            let means: Vec<f64> = means.split_whitespace().map(|v| v.parse().unwrap()).collect();
            Reference { scene: scene.to_owned(), definitions, mean: means.try_into().unwrap() }
        })
        .collect()
}

#[test]
fn means_are_mitsubas() {
    let sandbox = Sandbox::new();
    let references = references();
    assert!(references.len() >= 16);
    for Reference { scene, definitions, mean: want } in references {
        let path = folder().join(&scene);
        let run = sandbox.run(&format!("render {}{definitions} --spp 4096 -o out.pfm", path.display()));
        run.expect(0, &[]);
        let got = mean(&sandbox.path("out.pfm"));
        for (g, w) in got.iter().zip(want) {
            assert!((g - w).abs() <= 0.005 * w + 1e-4, "{scene}{definitions}: {got:?} is not {want:?}");
        }
    }
}
