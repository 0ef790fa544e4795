//! Scene files in other encodings than UTF-8.

use super::*;
use crate::load::LoadFailure;

/// Loads the bytes of a scene file.
fn load_bytes(bytes: &[u8]) -> Result<(SceneDesc, Diagnostics), LoadFailure> {
    let files = Files::new(&[]);
    std::fs::write(files.0.path().join("s.xml"), bytes).unwrap();
    files.load(&LoadOptions::default())
}

fn named(declaration: &str) -> String {
    let shape = "<shape type=\"cube\" id=\"Würfel €\"/><emitter type=\"constant\"/><sensor type=\"perspective\"/>";
    format!("{declaration}\n<scene version=\"3.0.0\">{shape}</scene>")
}

#[track_caller]
fn is_read(bytes: &[u8]) {
    let (scene, found) = load_bytes(bytes).unwrap_or_else(|e| panic!("{e}"));
    assert!(found.list.is_empty(), "{}", found.list[0].message);
    assert_eq!(scene.shapes[0].name.as_deref(), Some("Würfel €"));
}

#[test]
fn every_encoding_is_read() {
    is_read(named("").as_bytes());
    is_read(format!("\u{feff}{}", named("<?xml version=\"1.0\" encoding=\"utf-8\"?>")).as_bytes());
    let text = named("<?xml version=\"1.0\" encoding=\"UTF-16\"?>");
    for mark in ["", "\u{feff}"] {
        let units: Vec<u16> = format!("{mark}{text}").encode_utf16().collect();
        is_read(&units.iter().flat_map(|u| u.to_le_bytes()).collect::<Vec<u8>>());
        is_read(&units.iter().flat_map(|u| u.to_be_bytes()).collect::<Vec<u8>>());
    }
    for label in ["ISO-8859-1", "latin1", "Windows-1252"] {
        let text = named(&format!("<?xml version=\"1.0\" encoding=\"{label}\"?>"));
        let byte = |c: char| if c == '€' { 0x80 } else { u8::try_from(u32::from(c)).unwrap() };
        is_read(&text.chars().map(byte).collect::<Vec<u8>>());
    }
}

#[test]
fn encodings_that_are_not_known_and_bytes_that_mean_nothing_are_told() {
    let unknown = named("<?xml version=\"1.0\" encoding=\"EBCDIC\"?>");
    assert_eq!(messages(load_bytes(unknown.as_bytes())), [("scene::unknown-encoding", 0, 0)]);
    let latin: Vec<u8> = named("").replace('€', "E").chars().map(|c| u32::from(c) as u8).collect();
    assert_eq!(messages(load_bytes(&latin)), [("scene::not-utf8", 0, 0)]);
}
