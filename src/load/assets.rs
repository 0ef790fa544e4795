//! Files that a scene names: remembered while the text is read, each once, and decoded in parallel afterwards.

use super::mesh::{Dropped, LoadedMesh, MeshColors, MeshError, MeshOptions};
use super::primitives::Primitive;
use super::report::Report;
use super::{obj, ply, serialized};
use crate::image::read::{Encoding, ImageError, ImageFault, read_image};
use crate::image::{Image, Pixels};
use crate::scene::diag::Diagnostic;
use crate::scene::{ImageDesc, ImageId, MeshDesc, MeshId, SceneDesc, Span};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The meaning of a picture's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum ImageUse {
    /// Colours: eight-bit files are sRGB.
    Color,
    /// sRGB, whatever the format.
    Srgb,
    /// Plain numbers.
    Data,
    /// Powers of plain numbers in [0, 1]: the exponent's bits.
    Power(u32),
}

impl ImageUse {
    /// Values that are raised to the power `exponent`.
    pub(super) fn power(exponent: f32) -> ImageUse {
        ImageUse::Power(exponent.to_bits())
    }

    fn read(self, path: &Path) -> Result<Image, ImageError> {
        let encoding = match self {
            ImageUse::Color => Encoding::Auto,
            ImageUse::Srgb => Encoding::Srgb,
            ImageUse::Data | ImageUse::Power(_) => Encoding::Linear,
        };
        let image = read_image(path, encoding)?;
        Ok(match self {
            ImageUse::Power(bits) => raised(&image, f32::from_bits(bits)),
            _ => image,
        })
    }
}

/// A picture of plain numbers with every value but alpha raised to a power.
fn raised(image: &Image, exponent: f32) -> Image {
    let channels = image.channels as usize;
    let power = |(i, v): (usize, f32)| if i % channels == 3 { v } else { v.max(0.0).powf(exponent) };
    let pixels = match &image.pixels {
        Pixels::Srgb8(v) | Pixels::Linear8(v) => {
            v.iter().map(|&v| f32::from(v) / 255.0).enumerate().map(power).collect()
        }
        Pixels::F32(v) => v.iter().copied().enumerate().map(power).collect(),
    };
    Image { width: image.width, height: image.height, channels: image.channels, pixels: Pixels::F32(pixels) }
}

/// Where triangles come from.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum MeshSource {
    Ply(PathBuf),
    Obj(PathBuf),
    /// And which of the meshes in the file.
    Serialized(PathBuf, u32),
    Primitive(Primitive),
}

impl MeshSource {
    fn path(&self) -> Option<&PathBuf> {
        match self {
            MeshSource::Ply(p) | MeshSource::Obj(p) | MeshSource::Serialized(p, _) => Some(p),
            MeshSource::Primitive(_) => None,
        }
    }

    fn load(&self, options: MeshOptions) -> Result<LoadedMesh, MeshError> {
        match self {
            MeshSource::Ply(path) => ply::read_ply(path, options),
            MeshSource::Obj(path) => obj::read_obj(path, options),
            MeshSource::Serialized(path, index) => serialized::read_serialized(path, *index, options),
            MeshSource::Primitive(p) => Ok(LoadedMesh { mesh: p.mesh(options.mirrored), dropped: Dropped::default() }),
        }
    }
}

/// A picture to decode.
#[derive(Debug)]
struct ImageJob {
    path: PathBuf,
    usage: ImageUse,
    span: Option<Span>,
    /// It lights the scene: nothing can be shown in its place.
    is_light: bool,
}

/// Files to decode.
#[derive(Debug, Default)]
pub(super) struct Assets {
    strict: bool,
    images: Vec<ImageJob>,
    image_ids: HashMap<(PathBuf, ImageUse), ImageId>,
    meshes: Vec<(MeshSource, MeshOptions, Span)>,
    mesh_ids: HashMap<(MeshSource, MeshOptions), MeshId>,
}

impl Assets {
    /// With `strict`, a picture that cannot be read is an error.
    pub(super) fn new(strict: bool) -> Assets {
        Assets { strict, ..Assets::default() }
    }

    /// The id that a picture will have.
    pub(super) fn image(&mut self, path: PathBuf, usage: ImageUse, span: impl Into<Option<Span>>) -> ImageId {
        *self.image_ids.entry((path.clone(), usage)).or_insert_with(|| {
            self.images.push(ImageJob { path, usage, span: span.into(), is_light: false });
            ImageId((self.images.len() - 1) as u32)
        })
    }

    /// Makes it an error if the picture cannot be read, as it lights the scene.
    pub(super) fn require(&mut self, image: ImageId) {
        if let Some(job) = self.images.get_mut(image.index()) {
            job.is_light = true;
        }
    }

    /// The id that a mesh will have.
    pub(super) fn mesh(&mut self, source: MeshSource, options: MeshOptions, span: Span) -> MeshId {
        *self.mesh_ids.entry((source.clone(), options)).or_insert_with(|| {
            self.meshes.push((source, options, span));
            MeshId((self.meshes.len() - 1) as u32)
        })
    }

    /// Reports mesh files that are not there, without reading those that are.
    pub(super) fn check_files_exist(&self, report: &mut Report) {
        for (source, _, span) in &self.meshes {
            if let Some(path) = source.path()
                && let Err(e) = std::fs::metadata(path)
            {
                report.push_io(missing_mesh(path, &e.into()).at(span.clone()));
            }
        }
    }

    /// Decodes everything into the scene's arenas.
    pub(super) fn decode(mut self, scene: &mut SceneDesc, report: &mut Report) {
        let jobs = std::mem::take(&mut self.meshes);
        let (images, meshes) = rayon::join(
            || self.read_images(),
            // One at a time to a thread: a mesh being read is no larger than it ends up.
            || jobs.par_iter().with_max_len(1).map(|(source, options, _)| source.load(*options)).collect::<Vec<_>>(),
        );
        jobs.iter().filter_map(|(source, ..)| source.path()).for_each(|path| report.opened(path));
        self.add_images(images, scene, report);
        scene.meshes.reserve(meshes.len());
        for (mesh, (source, options, span)) in meshes.into_iter().zip(jobs) {
            let path = source.path().cloned().unwrap_or_default();
            scene.meshes.push(match mesh {
                Ok(loaded) => {
                    if options.colors != MeshColors::Unused && loaded.mesh.colors.is_empty() {
                        let (name, attribute) = (&loaded.mesh.name, options.colors.attribute());
                        let message = format!("a texture asks for `{attribute}`, which `{name}` does not have");
                        report.push(Diagnostic::error("load::missing-attribute", message).at(span.clone()));
                    }
                    for message in loaded.dropped.messages(&path) {
                        report.push(Diagnostic::warning("load::mesh", message).at(span.clone()));
                    }
                    loaded.mesh
                }
                Err(e) => {
                    let io = matches!(e, MeshError::Io(_));
                    let d = missing_mesh(&path, &e).at(span);
                    if io {
                        report.push_io(d);
                    } else {
                        report.push(d);
                    }
                    MeshDesc::default()
                }
            });
        }
    }

    /// Decodes the pictures alone.
    pub(super) fn decode_images(self, scene: &mut SceneDesc, report: &mut Report) {
        let images = self.read_images();
        self.add_images(images, scene, report);
    }

    fn read_images(&self) -> Vec<Result<Image, ImageError>> {
        self.images.par_iter().map(|job| job.usage.read(&job.path)).collect()
    }

    fn add_images(self, images: Vec<Result<Image, ImageError>>, scene: &mut SceneDesc, report: &mut Report) {
        for (image, ImageJob { path, span, is_light, .. }) in images.into_iter().zip(self.images) {
            report.opened(&path);
            let image = image.unwrap_or_else(|e| {
                let message = format!("cannot read the picture `{}`: {e}", path.display());
                if self.strict || is_light {
                    let d = Diagnostic::error("load::image", message).at(span);
                    match e.fault {
                        ImageFault::Io(_) => report.push_io(d),
                        _ => report.push(d),
                    }
                } else {
                    let d = Diagnostic::warning("load::image", message).at(span).changing_picture();
                    report.push(d.help("magenta is shown in its place"));
                }
                magenta()
            });
            scene.images.push(ImageDesc { path, image: Arc::new(image) });
        }
    }
}

fn missing_mesh(path: &Path, e: &MeshError) -> Diagnostic {
    Diagnostic::error("load::mesh", format!("cannot read the mesh `{}`: {e}", path.display()))
}

/// One pixel that nobody overlooks.
fn magenta() -> Image {
    Image { width: 1, height: 1, channels: 3, pixels: Pixels::F32(vec![1.0, 0.0, 1.0]) }
}
