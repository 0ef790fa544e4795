//! A model without a scene around it: OBJ with its MTL materials, or a lone PLY. The camera comes from the options, the
//! light from emitting materials or, if there are none, from a sky of constant radiance.

use super::assets::{Assets, ImageUse};
use super::mesh::{self, LoadedMesh, MeshError, MeshOptions};
use super::obj::{self, Library, MaterialUse, ObjFile};
use super::obj_material::{self, Map, Mtl};
use super::report::Report;
use super::{LoadOptions, framing, ply};
use crate::image::{MAX_TEXT_BYTES, open_regular, read_regular};
use crate::math::Rgb;
use crate::scene::diag::{Diagnostic, Source, nearest};
use crate::scene::{
    AreaEmission, BsdfDesc, BsdfId, BsdfKind, ColorDesc, ComplexIor, ConductorParams, DielectricParams, DiffuseParams,
    EmitterDesc, EmitterKind, MeshId, PhongParams, ScalarDesc, SceneDesc, ShapeDesc, Span, TextureDesc, TextureFilter,
    TextureId, WrapMode,
};
use glam::DMat4;
use std::collections::HashMap;
use std::io::BufReader;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Refractive index of a transparent material that does not say it.
const GLASS: f32 = 1.5;
/// From this Phong exponent on a highlight is as sharp as a reflection.
const MIRROR_EXPONENT: f32 = 1e4;

/// Reads a PLY file as a scene of one grey object.
pub(super) fn load_ply(path: &Path, options: &LoadOptions, report: &mut Report) -> Option<SceneDesc> {
    let LoadedMesh { mesh, skipped_faces } =
        ply::read_ply(path, MeshOptions::default()).map_err(|e| unreadable(path, &e, report)).ok()?;
    if skipped_faces > 0 {
        let message = format!("`{}`: {skipped_faces} faces of fewer than three corners are left out", path.display());
        report.push(Diagnostic::warning("load::mesh", message));
    }
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
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut materials: HashMap<String, (Mtl, Arc<Source>)> = HashMap::new();
    for library in &file.libraries {
        for name in library_files(folder, library) {
            read_library(&folder.join(name), path, library.line, &mut materials, report);
        }
    }

    let mut model = Model { assets: Assets::new(options.strict), ..Model::default() };
    if file.skipped_faces > 0 {
        let message =
            format!("`{}`: {} faces of fewer than three corners are left out", path.display(), file.skipped_faces);
        report.push(Diagnostic::warning("load::mesh", message));
    }
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
            Some((mtl, _)) => model.material(mtl, folder, span.clone()),
            None => (model.grey(), None),
        };
        model.scene.meshes.push(mesh);
        let mesh = MeshId((model.scene.meshes.len() - 1) as u32);
        model.shape(mesh, bsdf, emission, span);
    }
    drop(file);
    Some(model.finish(options, report))
}

fn unreadable(path: &Path, e: &MeshError, report: &mut Report) {
    let d = Diagnostic::error("load::mesh", format!("cannot read `{}`: {e}", path.display()));
    if matches!(e, MeshError::Io(_)) { report.push_io(d) } else { report.push(d) }
}

/// Files that a `mtllib` statement names, relative to `folder`. The format separates several files by blanks, while
/// many exporters write one name with blanks in it; a file that is there decides.
fn library_files(folder: &Path, library: &Library) -> Vec<String> {
    // Backslashes separate folders in files from Windows.
    let names = library.names.replace('\\', "/");
    // The first of several that has a material wins: it is read last.
    let words: Vec<String> = names.split_ascii_whitespace().rev().map(str::to_owned).collect();
    if !folder.join(&names).exists() && words.iter().any(|word| folder.join(word).exists()) {
        words
    } else {
        vec![names]
    }
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
            mesh,
            to_world: DMat4::IDENTITY,
            bsdf: Some(bsdf),
            emission,
            flip_normals: false,
            name: None,
            span,
        };
        self.scene.shapes.push(shape);
    }

    /// Decodes textures, adds camera and, if need be, light.
    fn finish(mut self, options: &LoadOptions, report: &mut Report) -> SceneDesc {
        self.assets.decode_images(&mut self.scene, report);
        if self.scene.shapes.iter().all(|s| s.emission.is_none()) && !self.scene.shapes.is_empty() {
            report.push(Diagnostic::note(
                "load::added-sky",
                "nothing in this file shines: a sky of constant radiance 1 is added",
            ));
            self.scene.emitters.push(EmitterDesc { kind: EmitterKind::Constant { radiance: Rgb::WHITE }, span: None });
        }
        match framing::camera(&self.scene, &options.camera) {
            Ok(camera) => self.scene.sensors.push(camera),
            Err(message) => report.push(Diagnostic::error("load::camera", message)),
        }
        self.scene
    }

    /// The BSDF of a material: mirrors and glass by the illumination model, else a diffuse base with a Phong
    /// highlight; seen from both sides unless it transmits.
    fn material(&mut self, mtl: &Mtl, folder: &Path, span: Option<Span>) -> (BsdfId, Option<AreaEmission>) {
        let emission = self.color(mtl.map_emission.as_ref(), mtl.emission.unwrap_or(Rgb::BLACK), folder, span.clone());
        let emits = emission != ColorDesc::Constant(Rgb::BLACK);
        let emission = emits.then_some(AreaEmission { radiance: emission, span: span.clone() });
        let name = Some(mtl.name.as_str());
        let specular = mtl.specular.unwrap_or(Rgb::BLACK);
        let dissolve = mtl.opacity();
        let refracts = mtl.ior.is_some_and(|i| i > 1.0);
        if matches!(mtl.illumination, Some(4 | 6 | 7 | 9)) || (dissolve < 1.0 && refracts && mtl.map_dissolve.is_none())
        {
            // Black stands for "not filled in" in what many exporters write.
            let tint = mtl.transmission.filter(|t| !t.is_black()).unwrap_or(Rgb::WHITE);
            let glass = DielectricParams {
                eta: mtl.ior.filter(|i| *i > 1.0).unwrap_or(GLASS),
                specular_reflectance: ColorDesc::Constant(Rgb::WHITE),
                specular_transmittance: ColorDesc::Constant(tint.map(|v| v.clamp(0.0, 1.0))),
            };
            return (self.bsdf(name, glass.into(), span), emission);
        }
        let diffuse = self.color(mtl.map_diffuse.as_ref(), mtl.diffuse.unwrap_or(Rgb::grey(0.5)), folder, span.clone());
        let shininess = mtl.shininess.unwrap_or(0.0);
        let mirror =
            matches!(mtl.illumination, Some(3 | 5 | 8)) || (shininess >= MIRROR_EXPONENT && !specular.is_black());
        let kind = if mirror {
            let tint =
                if specular.is_black() { diffuse } else { ColorDesc::Constant(specular.map(|v| v.clamp(0.0, 1.0))) };
            let ior = ComplexIor { eta: ColorDesc::Constant(Rgb::BLACK), k: ColorDesc::Constant(Rgb::WHITE) };
            ConductorParams { ior, specular_reflectance: tint }.into()
        } else if shininess > 1.0 && (!specular.is_black() || mtl.map_specular.is_some()) {
            self.glossy(mtl, diffuse, specular, shininess, folder, span.clone())
        } else {
            DiffuseParams { reflectance: clamped(diffuse) }.into()
        };
        let inner = self.bsdf(name, kind, span.clone());
        let mut outer = self.bsdf(name, BsdfKind::TwoSided { front: inner, back: inner }, span.clone());
        let opacity = match &mtl.map_dissolve {
            Some(map) => Some(ScalarDesc::Texture(self.texture(map, ImageUse::Data, folder, span.clone()))),
            None => (dissolve < 1.0).then_some(ScalarDesc::Constant(dissolve)),
        };
        if let Some(opacity) = opacity {
            outer = self.bsdf(name, BsdfKind::Mask { nested: outer, opacity }, span);
        }
        (outer, emission)
    }

    /// Diffuse and specular part together reflect no more than what arrives.
    fn glossy(
        &mut self,
        mtl: &Mtl,
        diffuse: ColorDesc,
        specular: Rgb,
        exponent: f32,
        folder: &Path,
        span: Option<Span>,
    ) -> BsdfKind {
        let specular = self.color(mtl.map_specular.as_ref(), specular, folder, span);
        let brightest = |c: ColorDesc| match c {
            ColorDesc::Constant(c) => c.max_component(),
            ColorDesc::Texture(_) => 0.0,
        };
        let sum = brightest(diffuse) + brightest(specular);
        let scale = if sum > 1.0 { 1.0 / sum } else { 1.0 };
        let scaled = |c: ColorDesc| match c {
            ColorDesc::Constant(c) => ColorDesc::Constant(c * scale),
            texture => texture,
        };
        let highlight = PhongParams {
            exponent: ScalarDesc::Constant(exponent),
            specular_reflectance: scaled(specular),
            diffuse_reflectance: scaled(diffuse),
        };
        highlight.into()
    }

    fn color(&mut self, map: Option<&Map>, constant: Rgb, folder: &Path, span: Option<Span>) -> ColorDesc {
        match map {
            Some(map) => ColorDesc::Texture(self.texture(map, ImageUse::Color, folder, span)),
            None => ColorDesc::Constant(constant),
        }
    }

    fn texture(&mut self, map: &Map, usage: ImageUse, folder: &Path, span: Option<Span>) -> TextureId {
        let image = self.assets.image(folder.join(&map.file), usage, span);
        let ([su, sv], [ou, ov]) = (map.scale, map.offset);
        // The file's v runs up, ours down: 1 − (s (1 − v) + o) = s v + (1 − s − o).
        let to_uv = [[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]];
        let wrap = if map.clamp { WrapMode::Clamp } else { WrapMode::Repeat };
        self.scene.textures.push(TextureDesc::Bitmap {
            image,
            to_uv,
            filter: TextureFilter::Bilinear,
            wrap,
            scale: 1.0,
        });
        TextureId((self.scene.textures.len() - 1) as u32)
    }
}

fn clamped(c: ColorDesc) -> ColorDesc {
    match c {
        ColorDesc::Constant(c) => ColorDesc::Constant(c.map(|v| v.clamp(0.0, 1.0))),
        texture => texture,
    }
}

#[cfg(test)]
mod tests;
