//! How the numbers in picture files are read.

use super::*;
use crate::image::Pixels;

/// A folder with a picture of one grey pixel, 128 of 255, as PNG and (0.5) as PFM.
fn folder(xml: &str) -> Files {
    let files = Files::new(&[("s.xml", xml)]);
    image::GrayImage::from_pixel(1, 1, image::Luma([128])).save(files.0.path().join("g.png")).unwrap();
    let mut pfm = b"Pf\n1 1\n-1.0\n".to_vec();
    pfm.extend(0.5f32.to_le_bytes());
    std::fs::write(files.0.path().join("g.pfm"), pfm).unwrap();
    files
}

/// The value of the only pixel of the only picture, and the messages.
fn pixel(xml: &str) -> (f32, Vec<(&'static str, usize, usize)>) {
    let (s, found) = folder(xml).load(&LoadOptions::default()).unwrap();
    assert_eq!(s.images.len(), 1);
    let value = match &s.images[0].image.pixels {
        Pixels::Srgb8(v) => crate::image::buffer::srgb_to_linear(f64::from(v[0]) / 255.0) as f32,
        Pixels::Linear8(v) => f32::from(v[0]) / 255.0,
        Pixels::F32(v) => v[0],
    };
    (value, messages(Ok((s, found))))
}

fn texture(file: &str, more: &str) -> String {
    format!("<texture type=\"bitmap\" name=\"T\"><string name=\"filename\" value=\"{file}\"/>{more}</texture>")
}

const RAW: &str = "<boolean name=\"raw\" value=\"true\"/>";
const NOT_RAW: &str = "<boolean name=\"raw\" value=\"false\"/>";

/// Where a picture gives numbers.
const NUMBERS: [&str; 4] = [
    "<bsdf type=\"mask\">opacity<bsdf type=\"diffuse\"/></bsdf>",
    "<bsdf type=\"roughconductor\">alpha</bsdf>",
    "<bsdf type=\"principled\">metallic</bsdf>",
    "<bsdf type=\"blendbsdf\">weight<bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></bsdf>",
];

#[test]
fn numbers_are_decoded_from_srgb_unless_raw() {
    for place in NUMBERS {
        let name = place.split(['>', '<']).nth(2).unwrap();
        for (more, want) in [("", 0.215_86), (NOT_RAW, 0.215_86), (RAW, 0.501_96)] {
            let inside = place.replace(name, &texture("g.png", more).replace("\"T\"", &format!("\"{name}\"")));
            let (value, found) = pixel(&scene(&inside));
            assert!((value - want).abs() < 1e-5 && found.is_empty(), "{inside}: {value}, {found:?}");
        }
    }
}

#[test]
fn decoding_a_normal_or_bump_map_is_said_unless_it_is_asked_for() {
    for plugin in ["normalmap", "bumpmap"] {
        for (file, more, want, said) in [
            ("g.png", "", 0.215_86, true),
            ("g.png", NOT_RAW, 0.215_86, false),
            ("g.png", RAW, 0.501_96, false),
            ("g.pfm", "", 0.5, false),
        ] {
            let map = texture(file, more).replace(" name=\"T\"", "");
            let (value, found) =
                pixel(&scene(&format!("<bsdf type=\"{plugin}\">{map}<bsdf type=\"diffuse\"/></bsdf>")));
            let codes: Vec<_> = found.iter().map(|m| m.0).collect();
            assert!((value - want).abs() < 1e-5, "{plugin} {file} {more}: {value}");
            assert_eq!(codes, if said { vec!["scene::decoded-data"] } else { vec![] }, "{plugin} {file} {more}");
        }
    }
}

#[test]
fn gamma_of_old_files_is_the_power_of_the_decoding() {
    for (gamma, png, pfm) in [
        ("1", 0.501_96, 0.5),
        ("-1", 0.215_86, 0.214_04),
        ("2", 0.251_96, 0.25),
        ("2.2", 0.219_52, 0.217_64),
        ("0", 0.215_86, 0.5),
    ] {
        for (file, want) in [("g.png", png), ("g.pfm", pfm)] {
            let more = format!("<float name=\"gamma\" value=\"{gamma}\"/>");
            let inside =
                format!("<bsdf type=\"diffuse\">{}</bsdf>", texture(file, &more).replace("\"T\"", "\"reflectance\""));
            let (value, found) = pixel(&scene(&inside).replacen("3.0.0", "0.5.0", 1));
            assert!((value - want).abs() < 1e-5 && found.is_empty(), "gamma {gamma} of {file}: {value} {found:?}");
            // Version 3 has `raw` in its place.
            let (_, found) = pixel(&scene(&inside));
            assert_eq!(found[0].0, "scene::unknown-property");
        }
    }
}
