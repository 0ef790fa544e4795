//! Writing the pyramid of techniques: linear EXR layers and a contact sheet.

use super::Failure;
use crate::film::Pyramid;
use crate::film::pyramid::Side;
use crate::image::{Layer, Picture, write_picture};
use crate::math::Rgb;
use std::path::{Path, PathBuf};

fn layer(name: String, pixels: &[Rgb]) -> Layer {
    let channel = |c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
    Layer { name, channels: vec![("R", channel(0)), ("G", channel(1)), ("B", channel(2))] }
}

/// Writes `raw.exr`, `weighted.exr` (one layer per technique; the main layer is their sum) and `sheet.png` to the folder, which is
/// made if it is not there. Returns what was written.
pub(crate) fn write(
    folder: &Path,
    pyramid: &Pyramid,
    metadata: &[(String, String)],
    exposure: f32,
) -> Result<Vec<PathBuf>, Failure> {
    std::fs::create_dir_all(folder).map_err(|e| Failure::Io(format!("{}: {e}", folder.display())))?;
    let [width, height] = pyramid.size();
    let mut written = vec![];
    for (name, side) in [("raw.exr", Side::Raw), ("weighted.exr", Side::Weighted)] {
        let mut sum = vec![Rgb::BLACK; width as usize * height as usize];
        let mut layers = vec![];
        for (k, s) in pyramid.techniques() {
            let pixels = pyramid.picture((k, s), side);
            sum.iter_mut().zip(&pixels).for_each(|(a, b)| *a += *b);
            layers.push(layer(format!("depth{k}_s{s}_t{}", k + 1 - s), &pixels));
        }
        layers.insert(0, layer(String::new(), &sum));
        let path = folder.join(name);
        write_picture(&path, &Picture { width, height, layers, metadata: metadata.to_vec() }, exposure)
            .map_err(Failure::io)?;
        written.push(path);
    }
    let (width, height, sheet) = pyramid.sheet();
    let path = folder.join("sheet.png");
    let picture = Picture { width, height, layers: vec![layer(String::new(), &sheet)], metadata: vec![] };
    write_picture(&path, &picture, exposure).map_err(Failure::io)?;
    written.push(path);
    Ok(written)
}
