//! The table of plugins and parameters holds: a scene is loaded for each row.

use super::super::plugins::{TABLE, columns};
use super::*;

#[derive(Clone, Copy)]
struct Row {
    element: &'static str,
    plugin: &'static str,
    parameter: &'static str,
    support: &'static str,
    version: &'static str,
    note: &'static str,
    /// Elements inside of the plugin: in a plugin's own row those that it always needs, else the parameter.
    example: &'static str,
}

fn rows() -> Vec<Row> {
    let lines = TABLE.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let [element, plugin, parameter, support, version, note, example] = columns(line);
            Row { element, plugin, parameter, support, version, note, example }
        })
        .collect()
}

/// A scene with the plugin of a row in its place.
fn scene_of(row: &Row, rows: &[Row]) -> String {
    let own = |r: &&Row| r.element == row.element && r.plugin == row.plugin && r.parameter.is_empty();
    let base = rows.iter().find(own).unwrap_or_else(|| panic!("`{}` has no row of its own", row.plugin)).example;
    let parameter = if row.parameter.is_empty() { "" } else { row.example };
    // A thin lens without its radius is a mistake; alternatives exclude each other.
    let base = if row.parameter == "aperture_radius" { "" } else { base };
    let element = row.element;
    let name = match element {
        "texture" => " name=\"reflectance\"",
        "medium" => " name=\"interior\"",
        "volume" => " name=\"albedo\"",
        _ => "",
    };
    let object = format!("<{element} type=\"{}\"{name}>{base}{parameter}</{element}>", row.plugin);
    let inside = match (element, row.plugin) {
        ("texture", _) => format!("<bsdf type=\"diffuse\">{object}</bsdf>"),
        ("emitter", "area") | ("medium", _) => format!("<shape type=\"cube\">{object}</shape>"),
        ("phase" | "volume", _) => {
            format!("<shape type=\"cube\"><medium name=\"interior\" type=\"homogeneous\">{object}</medium></shape>")
        }
        ("film" | "sampler", _) => format!("<sensor type=\"perspective\">{object}</sensor>"),
        ("rfilter", _) => format!("<sensor type=\"perspective\"><film type=\"hdrfilm\">{object}</film></sensor>"),
        _ => object,
    };
    scene(&inside).replacen("3.0.0", if row.version == "3" { "3.0.0" } else { "0.6.0" }, 1)
}

/// The files that examples name.
fn folder() -> Files {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let files = Files::new(&[("a.obj", obj), ("a.ply", ply)]);
    let serialized = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/meshes/version4.serialized");
    std::fs::copy(serialized, files.0.path().join("a.serialized")).unwrap();
    let volume = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes/mitsuba.vol");
    std::fs::copy(volume, files.0.path().join("a.vol")).unwrap();
    image::GrayImage::from_pixel(2, 2, image::Luma([128])).save(files.0.path().join("a.png")).unwrap();
    files
}

fn is_unsupported(d: &Diagnostic) -> bool {
    d.code == "scene::unsupported" && d.changes_picture
}

/// The fault of a row, if it has one.
fn fault(row: &Row, xml: &str, files: &Files) -> Option<String> {
    std::fs::write(files.0.path().join("s.xml"), xml).unwrap();
    let loaded = files.load(&LoadOptions::default());
    if let ("refused", "integrator", Ok((scene, found))) = (row.support, row.element, &loaded) {
        // Said where it would be used: the command line may name another one.
        let refused = scene.integrator.as_ref().and_then(|i| i.refused.as_ref()).is_some_and(is_unsupported);
        return (!refused || !found.list.is_empty()).then(|| "it is not refused".to_owned());
    }
    let force = LoadOptions { force: true, ..LoadOptions::default() };
    match (row.support, loaded) {
        ("supported" | "ignored", Ok((_, found))) => found.list.first().map(|d| d.message.clone()),
        ("replaced", Ok((_, found))) => {
            let said = found.list.len() == 1 && found.list[0].changes_picture;
            (!said).then(|| format!("{} messages", found.list.len()))
        }
        (support, Err(e)) if support.starts_with("refused") && e.diagnostics.list.iter().all(is_unsupported) => {
            match files.load(&force) {
                Ok((_, found)) if found.list.iter().any(is_unsupported) => None,
                Ok(_) => Some("nothing is said when the scene is forced to load".to_owned()),
                Err(e) => Some(format!("it cannot be forced to load: {e}")),
            }
        }
        (_, Ok(_)) => Some("it loads".to_owned()),
        (_, Err(e)) => Some(e.to_string()),
    }
}

#[test]
fn every_row_is_true() {
    let (rows, files) = (rows(), folder());
    assert!(rows.len() > 300);
    let faults: Vec<String> = rows
        .iter()
        .filter_map(|row| {
            let xml = scene_of(row, &rows);
            let fault = fault(row, &xml, &files)?;
            Some(format!("{} {} {}: {}: {fault}", row.element, row.plugin, row.parameter, row.support))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A refused parameter with the value that changes nothing is no mistake.
#[test]
fn parameters_are_refused_for_what_they_change() {
    let (rows, files) = (rows(), folder());
    for row in rows.iter().filter(|r| r.support.starts_with("refused unless ")) {
        let value = row.support.trim_start_matches("refused unless ");
        let start = row.example.find("value=\"").unwrap() + 7;
        let example = format!("{}{value}\"/>", &row.example[..start]);
        let xml = scene_of(&Row { example: Box::leak(example.into_boxed_str()), ..*row }, &rows);
        std::fs::write(files.0.path().join("s.xml"), xml).unwrap();
        let (_, found) = files.load(&LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert!(found.list.is_empty(), "{} {}", row.plugin, row.parameter);
    }
}

/// A name that nobody documents may be a slip or a remark: it stays a warning.
#[test]
fn names_that_nobody_documents_are_warned_of() {
    let inside = "<bsdf type=\"diffuse\"><float name=\"reflectanse\" value=\"1\"/></bsdf>";
    assert_eq!(messages(load(&scene(inside))), [("scene::unknown-property", 2, 35)]);
}

/// Kinds of integrators that are missing here are rendered by the nearest one, and the others are errors.
#[test]
fn integrators_are_translated() {
    let integrator = |xml: &str| good(xml).integrator.unwrap();
    let direct = integrator("<integrator type=\"direct\"/>");
    assert_eq!(
        (direct.name.as_str(), direct.params[0].0.as_str(), direct.params[0].1.as_str()),
        ("path", "max_depth", "2")
    );
    let depth = "<integer name=\"max_depth\" value=\"7\"/>";
    assert_eq!(integrator(&format!("<integrator type=\"volpath\">{depth}</integrator>")).params[0].1, "7");
    let nested = format!("<integrator type=\"aov\"><integrator type=\"bdpt\">{depth}</integrator></integrator>");
    let (scene, found) = load(&scene(&nested)).unwrap();
    assert_eq!((scene.integrator.unwrap().name.as_str(), found.list[0].code), ("bdpt", "scene::layers"));
}

#[test]
fn rows_say_why_or_how() {
    for row in rows() {
        let known = ["supported", "ignored", "replaced", "refused"].contains(&row.support);
        assert!(known || row.support.starts_with("refused unless "), "{}", row.plugin);
        let explained = row.support == "supported" || !row.note.is_empty();
        assert!(explained, "{} {} {}", row.element, row.plugin, row.parameter);
        assert!(row.parameter.is_empty() || !row.example.is_empty(), "{} {}", row.plugin, row.parameter);
        assert!(["3", "0.6"].contains(&row.version), "{}", row.plugin);
    }
    // Every scattering model has its row.
    for model in MODELS {
        assert!(rows().iter().any(|r| r.element == "bsdf" && r.plugin == model.name), "{}", model.name);
    }
}
