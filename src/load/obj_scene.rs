//! A model without a scene around it: OBJ with its MTL materials, or a lone PLY. The camera comes from the options, the
//! light from emitting materials or, if there are none, from a sky of constant radiance.

use super::assets::Assets;
use super::mesh::{self, Dropped, LoadedMesh, MeshError, MeshOptions};
use super::obj::{self, Library, MaterialUse, ObjFile};
use super::obj_material::{self, Mtl};
use super::paths::{locate, locate_or_warn};
use super::report::Report;
use super::{LoadOptions, framing, ply};
use crate::image::{MAX_TEXT_BYTES, open_regular, read_regular};
use crate::math::Rgb;
use crate::scene::diag::{Diagnostic, Source, nearest};
use crate::scene::{
    AreaEmission, BsdfDesc, BsdfId, BsdfKind, ColorDesc, DiffuseParams, EmitterDesc, EmitterKind, MeshId, SceneDesc,
    ShapeDesc, ShapeGeometry, Span,
};
use glam::DMat4;
use materials::{BumpMap, Origin};
use std::collections::HashMap;
use std::io::BufReader;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

mod materials;

/// Reads a PLY file as a scene of one grey object.
pub(super) fn load_ply(path: &Path, options: &LoadOptions, report: &mut Report) -> Option<SceneDesc> {
    let LoadedMesh { mesh, dropped } =
        ply::read_ply(path, MeshOptions::default()).map_err(|e| unreadable(path, &e, report)).ok()?;
    warn_of_dropped(&dropped, path, report);
    let mut model = Model::default();
    let bsdf = model.grey();
    model.scene.meshes.push(mesh);
    model.shape(MeshId(0), bsdf, None, None);
    Some(model.finish(options, report))
}

/// Reads an OBJ file and its materials.
pub(super) fn load_obj(path: &Path, options: &LoadOptions, report: &mut Report) -> Option<SceneDesc> {
    let file = open_regular(path).map_err(MeshError::from).and_then(|(f, _)| obj::parse(BufReader::new(f)));
    let file = file.map_err(|e| unreadable(path, &e, report)).ok()?;
    let folder = folder_of(path);
    let mut materials: HashMap<String, (Mtl, Arc<Source>)> = HashMap::new();
    for library in &file.libraries {
        for name in library_files(&folder, library) {
            let library_path = locate_or_warn(std::slice::from_ref(&folder), &name, None, report);
            read_library(&library_path, path, library.line, &mut materials, report);
        }
    }

    let mut model = Model { assets: Assets::new(options.strict), ..Model::default() };
    warn_of_dropped(&file.dropped, path, report);
    for MaterialGroup { name, line, triangles } in by_material(&file) {
        let triangles = triangles.iter().flat_map(|range| &file.triangles[range.clone()]);
        let mut mesh = obj::mesh_of(&file, triangles);
        mesh::finish(&mut mesh, MeshOptions { flip_v: true, ..MeshOptions::default() });
        mesh.name = format!("{} ({name})", path.display());
        let found = materials.get(&name);
        if found.is_none() && !name.is_empty() {
            let mut d = Diagnostic::warning(
                "load::unknown-material",
                format!("`{}`, line {line}: there is no material `{name}`", path.display()),
            );
            d = match nearest(&name, materials.keys().map(String::as_str)) {
                Some(near) => d.help(format!("did you mean `{near}`? A grey one is used")),
                None => d.help("a grey one is used"),
            };
            report.push(d);
        }
        let span = found.map(|(mtl, source)| line_span(source, mtl.line));
        let (bsdf, emission) = match found {
            Some((mtl, source)) => {
                let folders = [folder_of(&source.path), folder.clone()];
                model.material(mtl, &mut Origin { folders: &folders, span: span.clone(), report })
            }
            None => (model.grey(), None),
        };
        model.scene.meshes.push(mesh);
        let mesh = MeshId((model.scene.meshes.len() - 1) as u32);
        model.shape(mesh, bsdf, emission, span);
    }
    drop(file);
    Some(model.finish(options, report))
}

fn folder_of(path: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).to_path_buf()
}

fn warn_of_dropped(dropped: &Dropped, path: &Path, report: &mut Report) {
    for message in dropped.messages(path) {
        report.push(Diagnostic::warning("load::mesh", message));
    }
}

fn unreadable(path: &Path, e: &MeshError, report: &mut Report) {
    let d = Diagnostic::error("load::mesh", format!("cannot read `{}`: {e}", path.display()));
    if matches!(e, MeshError::Io(_)) { report.push_io(d) } else { report.push(d) }
}

/// Files that a `mtllib` statement names, relative to `folder`. The format separates several files by blanks, while
/// many exporters write one name with blanks in it; a file that is there decides.
fn library_files(folder: &Path, library: &Library) -> Vec<String> {
    let names = library.names.clone();
    // The first of several that has a material wins: it is read last.
    let words: Vec<String> = names.split_ascii_whitespace().rev().map(str::to_owned).collect();
    let exists = |name: &str| locate(std::slice::from_ref(&folder.to_path_buf()), name).path.exists();
    if !exists(&names) && words.iter().any(|word| exists(word)) { words } else { vec![names] }
}

/// Reads an MTL file; one that is missing costs the colours only.
fn read_library(
    path: &Path,
    obj: &Path,
    line: u64,
    into: &mut HashMap<String, (Mtl, Arc<Source>)>,
    report: &mut Report,
) {
    let text = match read_regular(path, MAX_TEXT_BYTES) {
        Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
        Err(e) => {
            let message =
                format!("`{}`, line {line}: cannot read the materials `{}`: {e}", obj.display(), path.display());
            report.push(Diagnostic::warning("load::missing-mtl", message).help("everything that uses them is grey"));
            return;
        }
    };
    report.opened(path);
    let source = Arc::new(Source { path: path.to_path_buf(), text });
    // Reading from memory does not fail; a library without materials is like a missing one.
    let (materials, complaints) = obj_material::parse(source.text.as_bytes()).unwrap_or_default();
    for c in complaints {
        report.push(Diagnostic::warning("load::mtl", c.message).at(line_span(&source, c.line)));
    }
    for mtl in materials {
        into.insert(mtl.name.clone(), (mtl, source.clone()));
    }
}

fn line_span(source: &Arc<Source>, line: u64) -> Span {
    let start: usize = source.text.split_inclusive('\n').take(line.saturating_sub(1) as usize).map(str::len).sum();
    let length = source.text[start..].lines().next().unwrap_or("").len();
    Span { source: source.clone(), range: start..start + length }
}

/// All triangles of an OBJ file that have one material.
#[derive(Debug)]
pub(super) struct MaterialGroup {
    /// Empty for triangles before the first `usemtl`.
    pub name: String,
    /// Line of the first `usemtl` that has triangles, from 1; 0 if there is none.
    pub line: u64,
    /// Indices of triangles, ascending.
    pub triangles: Vec<Range<usize>>,
}

/// Triangles of an OBJ file by material, in the order of first use.
pub(super) fn by_material(file: &ObjFile) -> Vec<MaterialGroup> {
    let mut groups: Vec<MaterialGroup> = Vec::new();
    let mut known: HashMap<&str, usize> = HashMap::new();
    let unnamed = MaterialUse { name: String::new(), first_triangle: 0, line: 0 };
    let uses: Vec<&MaterialUse> = std::iter::once(&unnamed).chain(&file.materials).collect();
    for (i, MaterialUse { name, first_triangle, line }) in uses.iter().enumerate() {
        let end = uses.get(i + 1).map_or(file.triangles.len(), |next| next.first_triangle);
        if *first_triangle < end {
            let group = *known.entry(name).or_insert_with(|| {
                groups.push(MaterialGroup { name: name.clone(), line: *line, triangles: Vec::new() });
                groups.len() - 1
            });
            groups[group].triangles.push(*first_triangle..end);
        }
    }
    groups
}

/// A scene in the making.
#[derive(Default)]
struct Model {
    scene: SceneDesc,
    assets: Assets,
    /// Materials with a bump map, which may turn out to hold normals.
    bump_maps: Vec<BumpMap>,
}

impl Model {
    fn bsdf(&mut self, name: Option<&str>, kind: BsdfKind, span: Option<Span>) -> BsdfId {
        self.scene.bsdfs.push(BsdfDesc { name: name.map(str::to_owned), kind, span });
        BsdfId((self.scene.bsdfs.len() - 1) as u32)
    }

    fn grey(&mut self) -> BsdfId {
        let inner = self.bsdf(None, DiffuseParams { reflectance: ColorDesc::Constant(Rgb::grey(0.5)) }.into(), None);
        self.bsdf(None, BsdfKind::TwoSided { front: inner, back: inner }, None)
    }

    fn shape(&mut self, mesh: MeshId, bsdf: BsdfId, emission: Option<AreaEmission>, span: Option<Span>) {
        let shape = ShapeDesc {
            geometry: ShapeGeometry::Mesh(mesh),
            to_world: DMat4::IDENTITY,
            bsdf: Some(bsdf),
            emission,
            interface: None,
            flip_normals: false,
            name: None,
            span,
        };
        self.scene.shapes.push(shape);
    }

    /// Decodes textures, adds camera and, if need be, light.
    fn finish(mut self, options: &LoadOptions, report: &mut Report) -> SceneDesc {
        self.assets.decode_images(&mut self.scene, report);
        materials::replace_bump_maps_of_normals(&mut self.scene, &self.bump_maps, report);
        if self.scene.shapes.iter().all(|s| s.emission.is_none()) && !self.scene.shapes.is_empty() {
            report.push(Diagnostic::note(
                "load::added-sky",
                "nothing in this file shines: a sky of constant radiance 1 is added",
            ));
            self.scene.emitters.push(EmitterDesc {
                kind: EmitterKind::Constant { radiance: Rgb::WHITE },
                sampling_weight: 1.0,
                span: None,
            });
        }
        match framing::camera(&self.scene, &options.camera) {
            Ok(camera) => self.scene.sensors.push(camera),
            Err(message) => report.push(Diagnostic::error("load::camera", message)),
        }
        self.scene
    }
}

#[cfg(test)]
mod tests;
