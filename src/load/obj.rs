//! Wavefront OBJ: polygons with texture coordinates and normals, read in one pass over the lines.
//!
//! The crate `tobj` reads the same format and is not used here, for three reasons. Its errors have no line, its
//! materials lose their names where a library is missing, and what it makes of a file cannot be mended afterwards:
//! vertices are duplicated at every `o`, `g` and `usemtl` (generated normals would show seams there), and missing
//! normals are no longer told from given ones. A pass in front of it that finds the line of a mistake, joins continued
//! lines, cuts comments, completes corners and drops polylines would be this reader once more. Instead the tests in
//! `cross_check` hold the two readers against each other, and list where and why they differ.

use super::mesh::{self, Dropped, LoadedMesh, MeshError, MeshOptions, Place, UnknownStatements};
use super::polygon::{self, MAX_CONCAVE_CORNERS};
use crate::image::open_regular;
use crate::math::Rgb;
use crate::scene::MeshDesc;
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// A corner of a face: indices of position, texture coordinates and normal, [`NONE`] where it has none.
pub(super) type Corner = [u32; 3];
/// No index.
pub(super) const NONE: u32 = u32::MAX;
/// Some editors begin UTF-8 files with it.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// An OBJ file, faces as triangles in the order of the file.
#[derive(Debug, Default)]
pub(super) struct ObjFile {
    pub positions: Vec<Vec3>,
    /// As many as positions, or none.
    pub colors: Vec<Rgb>,
    pub uvs: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    pub triangles: Vec<[Corner; 3]>,
    pub materials: Vec<MaterialUse>,
    pub libraries: Vec<Library>,
    pub dropped: Dropped,
}

/// A `usemtl` statement.
#[derive(Debug, PartialEq)]
pub(super) struct MaterialUse {
    pub name: String,
    /// Index of the first triangle after the statement.
    pub first_triangle: usize,
    /// From 1.
    pub line: u64,
}

/// A `mtllib` statement.
#[derive(Debug)]
pub(super) struct Library {
    /// As written: a file's name, or several.
    pub names: String,
    /// From 1.
    pub line: u64,
}

/// Reads an OBJ file as one mesh.
pub(super) fn read_obj(path: &Path, options: MeshOptions) -> Result<LoadedMesh, MeshError> {
    let file = parse(BufReader::new(open_regular(path)?.0))?;
    let mut mesh = mesh_of(&file, &file.triangles);
    mesh::finish(&mut mesh, options);
    mesh.name = path.display().to_string();
    Ok(LoadedMesh { mesh, dropped: file.dropped })
}

/// Makes a mesh of some triangles of a file: one vertex for each combination of indices that occurs.
pub(super) fn mesh_of<'a>(file: &ObjFile, triangles: impl IntoIterator<Item = &'a [Corner; 3]> + Clone) -> MeshDesc {
    let all = || triangles.clone().into_iter().flatten();
    let has_uvs = all().any(|c| c[1] != NONE);
    // Normals on some corners only are of no use.
    let has_normals = all().all(|c| c[2] != NONE) && all().next().is_some();
    let mut mesh = MeshDesc::default();
    let mut known: HashMap<Corner, u32> = HashMap::new();
    for t in triangles {
        mesh.triangles.push(t.map(|mut corner| {
            if !has_normals {
                corner[2] = NONE;
            }
            *known.entry(corner).or_insert_with(|| {
                let [p, uv, n] = corner.map(|i| i as usize);
                mesh.positions.push(file.positions[p]);
                if let Some(color) = file.colors.get(p) {
                    mesh.colors.push(*color);
                }
                if has_uvs {
                    mesh.uvs.push(file.uvs.get(uv).copied().unwrap_or(Vec2::ZERO));
                }
                if has_normals {
                    mesh.normals.push(file.normals[n]);
                }
                (mesh.positions.len() - 1) as u32
            })
        }));
    }
    mesh
}

/// Parses an OBJ stream.
pub(super) fn parse(reader: impl BufRead) -> Result<ObjFile, MeshError> {
    let mut file = ObjFile::default();
    let mut corners = Vec::new();
    for_each_line(reader, |number, line| {
        statement(&mut file, &mut corners, number, line).map_err(|message| MeshError::new(Place::Line(number), message))
    })?;
    if let Some(UnknownStatements { first, line, .. }) = &file.dropped.statements
        && file.triangles.is_empty()
        && file.dropped.faces == 0
    {
        return Err(MeshError::new(Place::Line(*line), format!("unknown statement `{first}`: not an OBJ file?")));
    }
    if file.colors.len() != file.positions.len() {
        file.colors = Vec::new();
    }
    Ok(file)
}

/// Hands out lines with their numbers, comments cut off, lines that end in `\` joined with the next.
pub(super) fn for_each_line(
    mut reader: impl BufRead,
    mut each: impl FnMut(u64, &str) -> Result<(), MeshError>,
) -> Result<(), MeshError> {
    let (mut raw, mut joined, mut number) = (Vec::new(), String::new(), 0u64);
    loop {
        raw.clear();
        if reader.read_until(b'\n', &mut raw)? == 0 {
            break;
        }
        number += 1;
        // Names in old files are in any encoding; numbers are ASCII.
        let text = String::from_utf8_lossy(&raw);
        let text = if number == 1 { text.trim_start_matches(BYTE_ORDER_MARK) } else { &text };
        let text = without_comment(text).trim();
        if let Some(text) = text.strip_suffix('\\') {
            joined.push_str(text);
            joined.push(' ');
        } else if joined.is_empty() {
            each(number, text)?;
        } else {
            joined.push_str(text);
            each(number, &joined)?;
            joined.clear();
        }
    }
    if joined.is_empty() { Ok(()) } else { each(number, &joined) }
}

/// Cuts off a comment. It begins at a `#` anywhere, except that names may contain one (`usemtl Material #25`): after
/// a keyword that a name follows, only a `#` that is a word by itself begins a comment.
fn without_comment(line: &str) -> &str {
    let Some(first) = line.find('#') else { return line };
    let keyword = line.split_ascii_whitespace().next().unwrap_or("");
    if !(matches!(keyword, "usemtl" | "mtllib" | "newmtl" | "bump" | "norm") || keyword.starts_with("map_")) {
        return &line[..first];
    }
    let is_blank = |c: Option<char>| c.is_none_or(|c| c.is_ascii_whitespace());
    let alone =
        |&(at, _): &(usize, &str)| is_blank(line[..at].chars().next_back()) && is_blank(line[at + 1..].chars().next());
    line.match_indices('#').find(alone).map_or(line, |(at, _)| &line[..at])
}

fn statement(file: &mut ObjFile, corners: &mut Vec<Corner>, number: u64, line: &str) -> Result<(), String> {
    let (keyword, rest) = line.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((line, ""));
    match keyword {
        "v" => {
            let v: Vec<f32> = floats(rest, 3)?;
            file.positions.push(Vec3::new(v[0], v[1], v[2]));
            // x y z r g b: an extension that many exporters of scans write.
            if v.len() >= 6 {
                file.colors.push(Rgb::new(v[3], v[4], v[5]));
            }
        }
        "vt" => {
            let v = floats(rest, 1)?;
            file.uvs.push(Vec2::new(v[0], v.get(1).copied().unwrap_or(0.0)));
        }
        "vn" => {
            let v = floats(rest, 3)?;
            file.normals.push(Vec3::new(v[0], v[1], v[2]));
        }
        "f" => {
            corners.clear();
            for word in rest.split_ascii_whitespace() {
                corners.push(corner(file, word)?);
            }
            face(file, corners)?;
        }
        "usemtl" => {
            let (name, first_triangle) = (rest.trim().to_owned(), file.triangles.len());
            file.materials.push(MaterialUse { name, first_triangle, line: number });
        }
        "mtllib" => file.libraries.push(Library { names: rest.trim().to_owned(), line: number }),
        // Groups, names, smoothing, polylines and points, weights of bones, parameters of free-form surfaces: not
        // rendered.
        "" | "g" | "o" | "s" | "l" | "p" | "vp" | "vw" | "mg" | "lod" | "shadow_obj" | "trace_obj" | "bevel"
        | "c_interp" | "d_interp" | "usemap" | "maplib" => {}
        "cstype" | "deg" | "bmat" | "step" | "curv" | "curv2" | "surf" | "parm" | "trim" | "hole" | "scrv" | "sp"
        | "end" | "con" => {}
        other => match &mut file.dropped.statements {
            Some(unknown) => unknown.count += 1,
            none => {
                let first = other.chars().take(40).collect();
                *none = Some(UnknownStatements { count: 1, first, line: number });
            }
        },
    }
    Ok(())
}

/// Adds a face as triangles.
fn face(file: &mut ObjFile, corners: &[Corner]) -> Result<(), String> {
    match *corners {
        [] | [_] | [_, _] => file.dropped.faces += 1,
        [a, b, c] => file.triangles.push([a, b, c]),
        _ => {
            let points: Vec<Vec3> = corners.iter().map(|c| file.positions[c[0] as usize]).collect();
            polygon::triangulate(&points, |t| file.triangles.push(t.map(|i| corners[i]))).map_err(|_| {
                let n = corners.len();
                format!("a polygon of {n} corners that is not convex: at most {MAX_CONCAVE_CORNERS} are supported")
            })?;
        }
    }
    Ok(())
}

/// All numbers of a line, at least `least`.
fn floats(text: &str, least: usize) -> Result<Vec<f32>, String> {
    let all: Result<Vec<f32>, String> = text
        .split_ascii_whitespace()
        .map(|w| w.parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| format!("`{w}` is not a finite number")))
        .collect();
    let all = all?;
    if all.len() < least { Err(format!("expected {least} numbers, found {}", all.len())) } else { Ok(all) }
}

/// `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1, or from the end if negative.
fn corner(file: &ObjFile, word: &str) -> Result<Corner, String> {
    let counts = [file.positions.len(), file.uvs.len(), file.normals.len()];
    let names = ["vertex", "texture coordinate", "normal"];
    let mut out = [NONE; 3];
    for (i, part) in word.split('/').enumerate() {
        if i > 2 {
            return Err(format!("`{word}` is not a corner of a face: expected v, v/vt, v//vn or v/vt/vn"));
        }
        if part.is_empty() && i > 0 {
            continue;
        }
        let given: i64 = part
            .parse()
            .map_err(|_| format!("`{word}` is not a corner of a face: expected v, v/vt, v//vn or v/vt/vn"))?;
        let index = if given < 0 { counts[i] as i64 + given } else { given - 1 };
        if index < 0 || index >= counts[i] as i64 || index >= i64::from(NONE) {
            return Err(format!("there is no {} {given}: {} are defined so far", names[i], counts[i]));
        }
        out[i] = index as u32;
    }
    Ok(out)
}

#[cfg(test)]
mod cross_check;
#[cfg(test)]
mod tests;
