//! The house rules, enforced on the text of `src/`: rooms import only rooms before them, `unsafe` lives in `ray`, only `app`
//! prints, files stay short, and what reads files or command lines does not unwrap. Comments, literals and code that is
//! compiled for tests alone do not count.

use std::path::{Path, PathBuf};

const MAX_LINES: usize = 600;
/// Rooms whose input comes from outside.
const NO_UNWRAP: [&str; 3] = ["load", "app", "image"];
const PRINTS: [&str; 5] = ["println", "eprintln", "print", "eprint", "dbg"];

/// A word, or one other character; with its line.
#[derive(Clone, Debug, PartialEq)]
struct Token {
    text: String,
    line: usize,
}

/// Rust source without comments, literals and white space.
fn tokens(source: &str) -> Vec<Token> {
    let chars: Vec<char> = source.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = Vec::new();
    let (mut i, mut line) = (0, 1);
    while i < chars.len() {
        let start = i;
        match at(i) {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1;
                }
            }
            '/' if at(i + 1) == '*' => {
                let mut depth = 0;
                loop {
                    match (at(i), at(i + 1)) {
                        ('/', '*') => (depth, i) = (depth + 1, i + 2),
                        ('*', '/') => (depth, i) = (depth - 1, i + 2),
                        _ => i += 1,
                    }
                    if depth == 0 || i >= chars.len() {
                        break;
                    }
                }
            }
            '"' => i = end_of_string(&chars, i),
            // 'x' and '\n' are characters, 'a without an end is a lifetime.
            '\'' if at(i + 1) == '\\' => {
                i += 3;
                while i < chars.len() && at(i) != '\'' {
                    i += 1;
                }
                i += 1;
            }
            '\'' if at(i + 2) == '\'' => i += 3,
            '\'' => {
                i += 1;
                while is_word(at(i)) {
                    i += 1;
                }
            }
            c if is_word(c) => {
                while is_word(at(i)) {
                    i += 1;
                }
                let word: String = chars[start..i].iter().collect();
                let hashes = (i..).take_while(|&k| at(k) == '#').count();
                if ["r", "br", "cr"].contains(&word.as_str()) && at(i + hashes) == '"' {
                    i += hashes + 1;
                    while i < chars.len() && !(at(i) == '"' && (1..=hashes).all(|k| at(i + k) == '#')) {
                        i += 1;
                    }
                    i += 1 + hashes;
                } else {
                    found.push(Token { text: word, line });
                }
            }
            c => {
                if !c.is_whitespace() {
                    found.push(Token { text: c.to_string(), line });
                }
                i += 1;
            }
        }
        i = i.min(chars.len());
        line += chars[start..i].iter().filter(|&&c| c == '\n').count();
    }
    found
}

/// Index after the closing quote of the string that opens at `i`.
fn end_of_string(chars: &[char], mut i: usize) -> usize {
    i += 1;
    while i < chars.len() && chars[i] != '"' {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

fn matches(tokens: &[Token], at: usize, texts: &[&str]) -> bool {
    texts.iter().enumerate().all(|(k, text)| tokens.get(at + k).is_some_and(|t| t.text == *text))
}

/// Index after the bracket that closes the one at `open`.
fn after_closing(tokens: &[Token], open: usize) -> usize {
    let mut depth = 0_usize;
    for (i, token) in tokens.iter().enumerate().skip(open) {
        match token.text.as_str() {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i + 1;
        }
    }
    tokens.len()
}

/// Length of `#[cfg(test)]`, `#[cfg(all(test, …))]` or `#[test]` at `at`, if one is there.
fn test_attribute(tokens: &[Token], at: usize) -> Option<usize> {
    let is = |texts: &[&str]| matches(tokens, at, texts);
    let only_tests = is(&["#", "[", "test", "]"])
        || is(&["#", "[", "cfg", "(", "test", ")", "]"])
        || is(&["#", "[", "cfg", "(", "all", "(", "test"]);
    only_tests.then(|| after_closing(tokens, at + 1) - at)
}

/// The program without its tests, and the names of modules in files of their own that are tests.
fn without_tests(tokens: &[Token]) -> (Vec<Token>, Vec<String>) {
    if matches(tokens, 0, &["#", "!", "[", "cfg", "(", "test", ")", "]"]) {
        return (Vec::new(), Vec::new());
    }
    let (mut kept, mut modules) = (Vec::new(), Vec::new());
    let mut i = 0;
    while i < tokens.len() {
        let Some(length) = test_attribute(tokens, i) else {
            kept.push(tokens[i].clone());
            i += 1;
            continue;
        };
        i += length;
        while matches(tokens, i, &["#", "["]) {
            i = after_closing(tokens, i + 1);
        }
        // The item ends at its semicolon or with its body.
        let item = i;
        while i < tokens.len() && tokens[i].text != ";" && tokens[i].text != "{" {
            i = if ["(", "["].contains(&tokens[i].text.as_str()) { after_closing(tokens, i) } else { i + 1 };
        }
        if tokens.get(i).is_some_and(|t| t.text == ";")
            && let Some(module) = (item..i).find(|&k| tokens[k].text == "mod")
        {
            modules.push(tokens[module + 1].text.clone());
        }
        i = if tokens.get(i).is_some_and(|t| t.text == "{") { after_closing(tokens, i) } else { i + 1 };
    }
    (kept, modules)
}

/// Names that a path goes on with after its `::` at `at`: one, or the first of each member of a group.
fn heads(tokens: &[Token], at: usize) -> Vec<(String, usize)> {
    let Some(first) = tokens.get(at) else { return Vec::new() };
    if first.text != "{" {
        return vec![(first.text.clone(), first.line)];
    }
    let end = after_closing(tokens, at);
    let mut names = Vec::new();
    let mut i = at + 1;
    let mut expected = true;
    while i + 1 < end {
        match tokens[i].text.as_str() {
            "{" => i = after_closing(tokens, i) - 1,
            "," => expected = true,
            name if expected => {
                names.push((name.to_owned(), tokens[i].line));
                expected = false;
            }
            _ => {}
        }
        i += 1;
    }
    names
}

/// Names directly below the crate's root that the module `module` (its path from the root) mentions, with lines.
fn root_names(tokens: &[Token], module: &[String]) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    // Depth of the inline modules around, and of the brace that closes each.
    let (mut depth, mut inline) = (0_usize, Vec::new());
    let mut i = 0;
    while i < tokens.len() {
        match tokens[i].text.as_str() {
            "mod" if tokens.get(i + 2).is_some_and(|t| t.text == "{") => inline.push(depth),
            "{" => depth += 1,
            "}" => {
                depth = depth.saturating_sub(1);
                inline.pop_if(|outer| *outer == depth);
            }
            "crate" if matches(tokens, i + 1, &[":", ":"]) => found.extend(heads(tokens, i + 3)),
            "super" => {
                let mut ups = 0;
                while matches(tokens, i, &["super", ":", ":"]) {
                    (ups, i) = (ups + 1, i + 3);
                }
                if ups > 0 && ups == module.len() + inline.len() {
                    found.extend(heads(tokens, i));
                }
                // The token at `i` has not been looked at yet, except if `super` stood alone.
                i += usize::from(ups == 0);
                continue;
            }
            _ => {}
        }
        i += 1;
    }
    found
}

/// What breaks the rules in one file; `path` is relative to `src`.
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
        for (name, line) in root_names(&tokens, &module) {
            if place(&name).is_some_and(|other| other > own) {
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
        if text == "unsafe" && room != "ray" {
            report(token.line, "unsafe outside ray".to_owned());
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

#[test]
fn the_source_keeps_the_rules() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let rooms = documented_rooms(&std::fs::read_to_string(root.join("lib.rs")).unwrap());
    let mut files = Vec::new();
    source_files(&root, &mut files);
    files.sort();
    let texts: Vec<(PathBuf, String)> = files
        .iter()
        .map(|f| (f.strip_prefix(&root).unwrap().to_owned(), std::fs::read_to_string(f).unwrap()))
        .collect();

    // Files that are modules for tests alone.
    let mut only_tests: Vec<Vec<String>> = Vec::new();
    for (path, text) in &texts {
        let (_, modules) = without_tests(&tokens(text));
        only_tests.extend(modules.into_iter().map(|name| [module_of(path), vec![name]].concat()));
    }
    let found: Vec<String> = texts
        .iter()
        .filter(|(path, _)| !only_tests.iter().any(|test| module_of(path).starts_with(test)))
        .flat_map(|(path, text)| violations(path, text, &rooms))
        .collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
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
fn unsafe_code_is_found_outside_ray_only() {
    assert_eq!(check("math/a.rs", "fn f() {\n unsafe { g() }\n}"), ["src/math/a.rs:2: unsafe outside ray"]);
    assert!(check("ray/embree.rs", "fn f() { unsafe { g() } }").is_empty());
    assert!(check("math/a.rs", "#![deny(unsafe_code)] // unsafe\n/* unsafe */ const S: &str = \"unsafe\";").is_empty());
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
