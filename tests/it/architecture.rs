//! The rules of the architecture, enforced on the text of `src/`: rooms import only rooms before them, no integrator
//! imports another, `unsafe` is in one file, only `app` prints, files stay short, code that reads files or command
//! lines does not unwrap, and streams of random numbers are distinct. Comments, literals and code that is compiled for
//! tests alone do not count.

use crate::support::rust_source::{matches, mentioned_paths, tokens, without_tests};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const MAX_LINES: usize = 600;
/// The one file with unsafe code.
const UNSAFE_FILE: &str = "ray/embree.rs";
/// Rooms whose input comes from outside.
const NO_UNWRAP: [&str; 3] = ["load", "app", "image"];
const PRINTS: [&str; 5] = ["println", "eprintln", "print", "eprint", "dbg"];

/// Violations of the rules in one file; `path` is relative to `src`.
fn violations(path: &Path, source: &str, rooms: &[String]) -> Vec<String> {
    let mut found = Vec::new();
    let mut report = |line: usize, what: String| found.push(format!("src/{}:{line}: {what}", path.display()));
    if source.lines().count() > MAX_LINES {
        report(MAX_LINES + 1, format!("the file has more than {MAX_LINES} lines"));
    }

    let module = module_of(path);
    let room = module.first().map_or("", String::as_str);
    let (tokens, _) = without_tests(&tokens(source));
    let place = |name: &str| rooms.iter().position(|r| r == name);
    if let Some(own) = place(room) {
        for (path, line) in mentioned_paths(&tokens, &module) {
            let name = path[0].as_str();
            if place(name).is_some_and(|other| other > own) {
                report(line, format!("{room} uses {name}, which stands behind it"));
            }
            if name == "*" {
                report(line, "everything is imported from the crate's root".to_owned());
            }
        }
    } else if !room.is_empty() {
        report(1, format!("{room} is not in the list of rooms"));
    }
    for (i, token) in tokens.iter().enumerate() {
        let text = token.text.as_str();
        let next = |expected: &str| matches(&tokens, i + 1, &[expected]);
        if text == "unsafe" && path != Path::new(UNSAFE_FILE) {
            report(token.line, format!("unsafe outside {UNSAFE_FILE}"));
        }
        if PRINTS.contains(&text) && next("!") && room != "app" {
            report(token.line, format!("{text}! outside app"));
        }
        if ["unwrap", "expect"].contains(&text)
            && i > 0
            && tokens[i - 1].text == "."
            && next("(")
            && NO_UNWRAP.contains(&room)
        {
            report(token.line, format!("{text}() in {room}"));
        }
    }
    found.dedup();
    found
}

/// `image/flip.rs` → image, flip; `image/mod.rs` → image; `lib.rs` and `main.rs` → nothing.
fn module_of(path: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        path.with_extension("").components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    if names.last().is_some_and(|n| n == "mod") || names == ["lib"] || names == ["main"] {
        names.pop();
    }
    names
}

/// The rooms in the order in which the documentation of the library lists them.
fn documented_rooms(lib: &str) -> Vec<String> {
    let list = lib.lines().find(|l| l.starts_with("//! math →")).expect("src/lib.rs lists the rooms");
    list.trim_start_matches("//!").split('→').map(|r| r.trim().to_owned()).collect()
}

fn source_files(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            source_files(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

/// All files of `src` that are not for tests alone, by their paths in it.
fn sources() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    source_files(&root, &mut files);
    files.sort();
    let mut texts: Vec<(PathBuf, String)> = files
        .iter()
        .map(|f| (f.strip_prefix(&root).unwrap().to_owned(), std::fs::read_to_string(f).unwrap()))
        .collect();
    let mut only_tests: Vec<Vec<String>> = Vec::new();
    for (path, text) in &texts {
        let (_, modules) = without_tests(&tokens(text));
        only_tests.extend(modules.into_iter().map(|name| [module_of(path), vec![name]].concat()));
    }
    texts.retain(|(path, _)| !only_tests.iter().any(|test| module_of(path).starts_with(test)));
    texts
}

/// Which integrator's folder imports which other one's, with the place of the first such import.
fn imports_among_integrators(sources: &[(PathBuf, String)]) -> BTreeMap<(String, String), String> {
    let folder = |module: &[String]| (module.first()? == "integrators").then(|| module.get(1).cloned()).flatten();
    let folders: BTreeSet<String> = sources
        .iter()
        .filter(|(path, _)| path.components().count() > 2)
        .filter_map(|(p, _)| folder(&module_of(p)))
        // Declarations of parameters are shared by all.
        .filter(|f| f != "params")
        .collect();
    let mut found = BTreeMap::new();
    for (path, text) in sources {
        let Some(own) = folder(&module_of(path)).filter(|f| folders.contains(f)) else { continue };
        let (tokens, _) = without_tests(&tokens(text));
        for (mentioned, line) in mentioned_paths(&tokens, &module_of(path)) {
            if let Some(other) = folder(&mentioned).filter(|f| folders.contains(f) && *f != own) {
                found.entry((own.clone(), other)).or_insert_with(|| format!("src/{}:{line}", path.display()));
            }
        }
    }
    found
}

/// Declarations of random streams (constants named `STREAM` or `…_STREAM`) outside of the one list of streams.
fn stray_streams(sources: &[(PathBuf, String)]) -> Vec<String> {
    let mut found = vec![];
    for (path, text) in sources.iter().filter(|(path, _)| !path.ends_with("path/streams.rs")) {
        let (tokens, _) = without_tests(&tokens(text));
        for (i, token) in tokens.iter().enumerate() {
            let is_stream = token.text == "STREAM" || token.text.ends_with("_STREAM");
            if is_stream && i > 0 && tokens[i - 1].text == "const" {
                found.push(format!("src/{}: {}", path.display(), token.text));
            }
        }
    }
    found
}

#[test]
fn the_source_keeps_the_rules() {
    let rooms = documented_rooms(include_str!("../../src/lib.rs"));
    let found: Vec<String> = sources().iter().flat_map(|(path, text)| violations(path, text, &rooms)).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn integrators_do_not_import_each_other() {
    let found = imports_among_integrators(&sources());
    assert!(found.is_empty(), "an integrator imports another one: {found:?}");
}

#[test]
fn random_streams_are_in_one_list() {
    let found = stray_streams(&sources());
    assert!(found.is_empty(), "declared outside of path::streams: {found:?}");
}

#[test]
fn the_documented_rooms_are_the_modules_in_their_order() {
    let lib = include_str!("../../src/lib.rs");
    let tokens = tokens(lib);
    let declared: Vec<&str> = (0..tokens.len())
        .filter(|&i| matches(&tokens, i, &["pub", "mod"]))
        .map(|i| tokens[i + 2].text.as_str())
        .collect();
    assert_eq!(documented_rooms(lib), declared);
    assert!(declared.len() >= 14, "{declared:?}");
}

// From here on: the rules find what they should, and nothing else.

fn check(path: &str, source: &str) -> Vec<String> {
    let rooms: Vec<String> = ["math", "image", "scene", "load", "ray", "app"].map(str::to_owned).to_vec();
    violations(Path::new(path), source, &rooms)
}

#[test]
fn backward_imports_pass_and_forward_imports_are_found() {
    assert!(
        check("scene/desc.rs", "use crate::math::Rgb; use crate::{image::Image, math}; use super::diag;").is_empty()
    );
    for source in [
        "use crate::load::x;",
        "use crate::{math::{Rgb, Vec}, load};",
        "use crate::{math::{Rgb}, app::{a, b}, image};",
        "fn f() { crate::load::read(); }",
        "use {std::fs, crate::ray};",
        "use super::super::load;",
        "use super::super::{math, load::x};",
        "mod inner { use super::super::super::load; }",
        "mod a { mod b {} } use super::super::load;",
        "fn f<'a>(x: &'a str) -> char { '\"' } use crate::load; // \"",
        "fn f() -> &str { r#\"a \"quote\" // here\"# } use crate::load;",
        "/* outer /* inner */ still */ use crate::load;",
        "fn f() -> char { '\\'' } use crate::load; fn g() -> char { '\\'' }",
    ] {
        let found = check("scene/desc.rs", source);
        assert_eq!(found.len(), 1, "{source}: {found:?}");
        assert!(found[0].starts_with("src/scene/desc.rs:1: scene uses "), "{found:?}");
    }
    assert_eq!(check("scene/mod.rs", "use super::load;").len(), 1);
    assert_eq!(check("scene/a/b.rs", "\n\nuse super::super::super::ray;")[0].split(':').nth(1), Some("3"));
    assert_eq!(check("scene/desc.rs", "use crate::*;").len(), 1);
    assert_eq!(check("cellar/mod.rs", "").len(), 1, "a folder that is no room");
}

#[test]
fn paths_inside_a_room_are_no_imports() {
    assert!(check("scene/desc.rs", "use super::load; use self::ray::x; use std::app::y;").is_empty());
    assert!(check("scene/a/b.rs", "use super::super::load;").is_empty());
    assert!(check("scene/desc.rs", "mod inner { use super::super::load; }").is_empty());
    assert!(check("scene/desc.rs", "mod load { pub fn f() {} } fn g() { load::f() }").is_empty());
    assert!(check("scene/desc.rs", "pub(crate) fn f() {} pub(super) fn g() {}").is_empty());
}

#[test]
fn unsafe_code_is_found_outside_its_file_only() {
    let code = "fn f() {\n unsafe { g() }\n}";
    for path in ["math/a.rs", "ray/mod.rs", "ray/embree/mod.rs"] {
        assert_eq!(check(path, code), [format!("src/{path}:2: unsafe outside ray/embree.rs")]);
    }
    assert!(check("ray/embree.rs", "fn f() { unsafe { g() } }").is_empty());
    assert!(check("math/a.rs", "#![deny(unsafe_code)] // unsafe\n/* unsafe */ const S: &str = \"unsafe\";").is_empty());
}

#[test]
fn imports_among_integrators_are_found() {
    let pairs = |path: &str, text: &str| -> Vec<(String, String)> {
        let others = ["integrators/a/mod.rs", "integrators/b/mod.rs", "integrators/mod.rs", "integrators/params.rs"];
        let all = others.iter().map(|p| (PathBuf::from(p), String::new())).chain([(path.into(), text.into())]);
        imports_among_integrators(&all.collect::<Vec<_>>()).into_keys().collect()
    };
    let one = [("a".to_owned(), "b".to_owned())];
    for source in [
        "use crate::integrators::b::X;",
        "use crate::{math, integrators::{Params, b::{X, Y}}};",
        "use crate::integrators::{params::P, b};",
        "fn f() { super::super::b::g(); }",
        "mod inner { use super::super::super::b; }",
    ] {
        assert_eq!(pairs("integrators/a/x.rs", source), one, "{source}");
    }
    assert_eq!(pairs("integrators/a/mod.rs", "use super::b;"), one);
    for source in
        ["use crate::integrators::{a::X, params::P, Params};", "use super::b;", "use crate::b;", "use crate::mis::b;"]
    {
        assert!(pairs("integrators/a/x.rs", source).is_empty(), "{source}");
    }
    assert!(pairs("integrators/mod.rs", "use self::b; use crate::integrators::b::SPEC;").is_empty());
    assert!(pairs("integrators/a/x.rs", "#[cfg(test)] mod tests { use crate::integrators::b; }").is_empty());
}

#[test]
fn stray_streams_are_found() {
    let text = "const A_STREAM: u64 = 1; pub const STREAM: u64 = 1; const OTHER: u64 = 2;";
    assert_eq!(stray_streams(&[("a.rs".into(), text.into())]), ["src/a.rs: A_STREAM", "src/a.rs: STREAM"]);
    assert!(stray_streams(&[("path/streams.rs".into(), text.into())]).is_empty());
}

#[test]
fn printing_is_found_outside_app_only() {
    for name in PRINTS {
        assert_eq!(check("math/a.rs", &format!("fn f() {{ {name}!(\"x\"); }}")).len(), 1, "{name}");
        assert!(check("app/mod.rs", &format!("fn f() {{ {name}!(\"x\"); }}")).is_empty());
    }
    assert!(check("math/a.rs", "fn print() {} // println!(\"x\")\nconst S: &str = \"println!(\";").is_empty());
}

#[test]
fn unwrapping_is_found_where_input_comes_from_outside() {
    for room in NO_UNWRAP {
        let path = format!("{room}/a.rs");
        assert_eq!(check(&path, "fn f() { g().unwrap(); }").len(), 1);
        assert_eq!(check(&path, "fn f() { g()\n.expect(\"x\"); }")[0], format!("src/{path}:2: expect() in {room}"));
        assert!(check(&path, "fn f() { g().unwrap_or(1); h().unwrap_or_default(); expect(1); }").is_empty());
    }
    assert!(check("math/a.rs", "fn f() { g().unwrap(); }").is_empty());
}

#[test]
fn tests_are_left_out_and_what_follows_them_is_not() {
    let tests =
        "#[cfg(test)]\n#[allow(x)]\nmod tests { use crate::load; fn f() { a.unwrap(); println!(); unsafe {} } }\n";
    assert!(check("image/a.rs", tests).is_empty());
    assert_eq!(check("image/a.rs", &format!("{tests} use crate::load;")).len(), 1);
    assert_eq!(check("image/a.rs", "#[cfg(test)] use crate::app; use crate::load;").len(), 1);
    assert_eq!(check("image/a.rs", "#[cfg(test)] fn f(x: [u8; 2]) { a.unwrap() } fn g() { a.unwrap() }").len(), 1);
    assert_eq!(check("image/a.rs", "#[cfg(not(test))] use crate::load;").len(), 1);
    assert!(check("image/a.rs", "#[cfg(all(test, unix))] mod t { use crate::load; }").is_empty());
    assert!(check("image/a.rs", "#![cfg(test)] use crate::load;").is_empty());
    let (_, modules) = without_tests(&tokens("#[cfg(test)] mod tests; #[cfg(test)] pub(crate) mod oracle; mod real;"));
    assert_eq!(modules, ["tests", "oracle"]);
}

#[test]
fn long_files_are_found() {
    assert!(check("math/a.rs", &"\n".repeat(MAX_LINES)).is_empty());
    assert_eq!(check("math/a.rs", &"\n".repeat(MAX_LINES + 1)).len(), 1);
}
