//! Scenes that ask for much more than their size.

use super::*;
use std::time::Instant;

#[test]
fn values_that_multiply_are_refused() {
    let mut text = String::from("<scene version=\"3.0.0\"><default name=\"a0\" value=\"0123456789\"/>\n");
    for i in 1..30 {
        let ten = format!("$a{}", i - 1).repeat(10);
        text.push_str(&format!("<default name=\"a{i}\" value=\"{ten}\"/>\n"));
    }
    text.push_str("</scene>");
    assert_eq!(messages(load(&text))[0].0, "scene::too-large");
    // Many values that are just short enough.
    let long = "x".repeat(1 << 19);
    let uses = "<string name=\"s\" value=\"$a\"/>".repeat(600);
    let text = scene(&format!("<default name=\"a\" value=\"{long}\"/><bsdf type=\"diffuse\">{uses}</bsdf>"));
    assert_eq!(messages(load(&text))[0].0, "scene::too-large");
}

#[test]
fn includes_that_multiply_are_refused_soon() {
    let files: Vec<(String, String)> = (0..40)
        .map(|i| {
            let next = format!("<include filename=\"i{}.xml\"/>", i + 1);
            (format!("i{i}.xml"), format!("<scene version=\"3.0.0\">{next}{next}</scene>"))
        })
        .chain([("i40.xml".to_owned(), "<scene version=\"3.0.0\"/>".to_owned())])
        .chain([("s.xml".to_owned(), scene("<include filename=\"i0.xml\"/>"))])
        .collect();
    let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let start = Instant::now();
    let found = messages(Files::new(&files).load(&LoadOptions::default()));
    assert_eq!(found.iter().map(|m| m.0).collect::<Vec<_>>(), ["scene::too-large"]);
    assert!(start.elapsed().as_secs() < 20);
}

/// A chain of files, each of which includes the next.
fn chain(length: usize) -> Result<(SceneDesc, Diagnostics), LoadFailure> {
    let mut files = vec![("s.xml".to_owned(), scene("<include filename=\"i0.xml\"/>"))];
    for i in 0..length {
        let inside = if i + 1 < length {
            format!("<include filename=\"i{}.xml\"/>", i + 1)
        } else {
            "<shape type=\"disk\"/>".into()
        };
        files.push((format!("i{i}.xml"), format!("<scene version=\"3.0.0\">{inside}</scene>")));
    }
    let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    Files::new(&files).load(&LoadOptions::default())
}

#[test]
fn includes_may_be_a_hundred_deep_and_not_a_thousand() {
    assert_eq!(chain(100).unwrap().0.shapes.len(), 2);
    assert_eq!(messages(chain(1000))[0].0, "scene::too-large");
}

#[test]
fn a_light_whose_picture_cannot_be_read_is_an_error() {
    let texture = "<texture name=\"radiance\" type=\"bitmap\"><string name=\"filename\" value=\"no.exr\"/></texture>";
    for (inside, io) in [
        ("<emitter type=\"envmap\"><string name=\"filename\" value=\"no.exr\"/></emitter>".to_owned(), true),
        ("<emitter type=\"envmap\"><string name=\"filename\" value=\"s.xml\"/></emitter>".to_owned(), false),
        (format!("<shape type=\"disk\"><emitter type=\"area\">{texture}</emitter></shape>"), true),
    ] {
        let e = load(&scene(&inside)).unwrap_err();
        assert_eq!((e.io, e.diagnostics.list.len(), e.diagnostics.list[0].code), (io, 1, "load::image"), "{inside}");
    }
    // Elsewhere a stand-in is shown, and said even under --quiet.
    let inside = format!("<bsdf type=\"diffuse\">{}</bsdf>", texture.replace("radiance", "reflectance"));
    let (_, found) = load(&scene(&inside)).unwrap();
    assert_eq!(found.changing_picture().list.len(), 1);
}

#[test]
fn merges_of_merges_do_not_multiply_without_end() {
    let merge = |i: usize, inside: &str| format!("<shape type=\"merge\" id=\"m{i}\">{inside}</shape>");
    // Each holds the one before twice: 2^40 shapes.
    let first = merge(0, "<shape type=\"rectangle\"/>");
    let doubled = |i: usize| merge(i, &format!("<ref id=\"m{}\"/><ref id=\"m{}\"/>", i - 1, i - 1));
    let many: String = (1..40).map(doubled).collect();
    let all = format!("{first}{many}");
    assert_eq!(messages(load(&scene(&all)))[0].0, "scene::too-large");
    let round = merge(0, "<ref id=\"m1\"/>") + &merge(1, "<ref id=\"m0\"/>");
    assert_eq!(messages(load(&scene(&round)))[0].0, "scene::circular-reference");
    let two = good(&merge(0, "<shape type=\"rectangle\"/><shape type=\"merge\"><shape type=\"disk\"/></shape>"));
    assert_eq!(two.shapes.len(), 3);
}
