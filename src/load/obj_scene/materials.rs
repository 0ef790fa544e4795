//! MTL materials to BSDFs, textures and emission.

use super::Model;
use crate::image::{Image, Pixels};
use crate::load::assets::ImageUse;
use crate::load::obj_material::{Map, Mtl};
use crate::load::paths::locate_or_warn;
use crate::load::report::Report;
use crate::math::Rgb;
use crate::scene::diag::Diagnostic;
use crate::scene::{
    AreaEmission, BsdfId, BsdfKind, ColorDesc, ComplexIor, ConductorParams, DielectricParams, DiffuseParams, ImageId,
    PhongParams, ScalarDesc, SceneDesc, Span, TextureDesc, TextureFilter, TextureId, WrapMode,
};
use glam::Vec3;
use std::path::PathBuf;

/// Refractive index of a transparent material that does not say it.
const GLASS: f32 = 1.5;
/// From this Phong exponent on a highlight is as sharp as a reflection.
const MIRROR_EXPONENT: f32 = 1e4;

/// Where a material comes from, and where complaints about it go.
pub(super) struct Origin<'a> {
    /// Folders of the MTL file and of the OBJ file.
    pub folders: &'a [PathBuf],
    /// The material in its file.
    pub span: Option<Span>,
    pub report: &'a mut Report,
}

/// A material with a bump map.
#[derive(Debug)]
pub(super) struct BumpMap {
    bsdf: BsdfId,
    image: ImageId,
}

impl Model {
    /// The BSDF of a material: mirrors and glass by the illumination model, else a diffuse base with a Phong
    /// highlight; seen from both sides unless it transmits.
    pub(super) fn material(&mut self, mtl: &Mtl, origin: &mut Origin<'_>) -> (BsdfId, Option<AreaEmission>) {
        let span = origin.span.clone();
        let emission = match &mtl.map_emission {
            Some(map) => {
                let (texture, image) = self.texture(map, ImageUse::Color, origin);
                self.assets.require(image);
                ColorDesc::Texture(texture)
            }
            None => ColorDesc::Constant(mtl.emission.unwrap_or(Rgb::BLACK)),
        };
        let emits = emission != ColorDesc::Constant(Rgb::BLACK);
        let emission = emits.then_some(AreaEmission { radiance: emission, sampling_weight: 1.0, span: span.clone() });
        let name = Some(mtl.name.as_str());
        let dissolve = mtl.opacity();
        let refracts = mtl.ior.is_some_and(|i| i > 1.0);
        if matches!(mtl.illumination, Some(4 | 6 | 7 | 9)) || (dissolve < 1.0 && refracts && mtl.map_dissolve.is_none())
        {
            let glass = self.bsdf(name, glass(mtl), span);
            return (self.bumped(mtl, glass, origin), emission);
        }
        let kind = self.opaque(mtl, origin);
        let inner = self.bsdf(name, kind, span.clone());
        let inner = self.bumped(mtl, inner, origin);
        let mut outer = self.bsdf(name, BsdfKind::TwoSided { front: inner, back: inner }, span.clone());
        let opacity = match &mtl.map_dissolve {
            Some(map) => Some(ScalarDesc::Texture(self.texture(map, ImageUse::Data, origin).0)),
            None => (dissolve < 1.0).then_some(ScalarDesc::Constant(dissolve)),
        };
        if let Some(opacity) = opacity {
            outer = self.bsdf(name, BsdfKind::Mask { nested: outer, opacity }, span);
        }
        (outer, emission)
    }

    /// Diffuse, glossy or a mirror.
    fn opaque(&mut self, mtl: &Mtl, origin: &mut Origin<'_>) -> BsdfKind {
        let specular = mtl.specular.unwrap_or(Rgb::BLACK);
        let diffuse = self.color(mtl.map_diffuse.as_ref(), mtl.diffuse.unwrap_or(Rgb::grey(0.5)), origin);
        let shininess = mtl.shininess.unwrap_or(0.0);
        let mirror =
            matches!(mtl.illumination, Some(3 | 5 | 8)) || (shininess >= MIRROR_EXPONENT && !specular.is_black());
        if mirror {
            let tint =
                if specular.is_black() { diffuse } else { ColorDesc::Constant(specular.map(|v| v.clamp(0.0, 1.0))) };
            let ior = ComplexIor { eta: ColorDesc::Constant(Rgb::BLACK), k: ColorDesc::Constant(Rgb::WHITE) };
            ConductorParams { ior, specular_reflectance: tint }.into()
        } else if shininess > 1.0 && (!specular.is_black() || mtl.map_specular.is_some()) {
            let specular = self.color(mtl.map_specular.as_ref(), specular, origin);
            glossy(diffuse, specular, shininess)
        } else {
            DiffuseParams { reflectance: clamped(diffuse) }.into()
        }
    }

    /// A BSDF under the normals of the material's bump or normal map, if it has one.
    fn bumped(&mut self, mtl: &Mtl, nested: BsdfId, origin: &mut Origin<'_>) -> BsdfId {
        let name = Some(mtl.name.as_str());
        let span = origin.span.clone();
        if let Some(map) = &mtl.map_normal {
            let (normals, _) = self.texture(map, ImageUse::Data, origin);
            return self.bsdf(name, BsdfKind::NormalMap { nested, normals }, span);
        }
        let Some(map) = &mtl.map_bump else { return nested };
        let (height, image) = self.texture(map, ImageUse::Data, origin);
        let bsdf = self.bsdf(name, BsdfKind::BumpMap { nested, height, scale: map.bump_multiplier }, span);
        self.bump_maps.push(BumpMap { bsdf, image });
        bsdf
    }

    fn color(&mut self, map: Option<&Map>, constant: Rgb, origin: &mut Origin<'_>) -> ColorDesc {
        match map {
            Some(map) => ColorDesc::Texture(self.texture(map, ImageUse::Color, origin).0),
            None => ColorDesc::Constant(constant),
        }
    }

    fn texture(&mut self, map: &Map, usage: ImageUse, origin: &mut Origin<'_>) -> (TextureId, ImageId) {
        let path = locate_or_warn(origin.folders, &map.file, origin.span.as_ref(), origin.report);
        let image = self.assets.image(path, usage, origin.span.clone());
        let ([su, sv], [ou, ov]) = (map.scale, map.offset);
        // The file's v runs up, ours down: 1 − (s (1 − v) + o) = s v + (1 − s − o).
        let to_uv = [[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]];
        let wrap = if map.clamp { WrapMode::Clamp } else { WrapMode::Repeat };
        let filter = TextureFilter::Bilinear;
        self.scene.textures.push(TextureDesc::Bitmap { image, to_uv, filter, wrap, scale: 1.0 });
        (TextureId((self.scene.textures.len() - 1) as u32), image)
    }
}

fn glass(mtl: &Mtl) -> BsdfKind {
    // Black stands for "not filled in" in what many exporters write.
    let tint = mtl.transmission.filter(|t| !t.is_black()).unwrap_or(Rgb::WHITE);
    let glass = DielectricParams {
        eta: mtl.ior.filter(|i| *i > 1.0).unwrap_or(GLASS),
        specular_reflectance: ColorDesc::Constant(Rgb::WHITE),
        specular_transmittance: ColorDesc::Constant(tint.map(|v| v.clamp(0.0, 1.0))),
    };
    glass.into()
}

/// Diffuse and specular part together reflect no more than what arrives.
fn glossy(diffuse: ColorDesc, specular: ColorDesc, exponent: f32) -> BsdfKind {
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

fn clamped(c: ColorDesc) -> ColorDesc {
    match c {
        ColorDesc::Constant(c) => ColorDesc::Constant(c.map(|v| v.clamp(0.0, 1.0))),
        texture => texture,
    }
}

/// Makes normal maps of bump maps whose pictures hold normals: exporters write either behind `map_Bump`.
pub(super) fn replace_bump_maps_of_normals(scene: &mut SceneDesc, bump_maps: &[BumpMap], report: &mut Report) {
    for bump in bump_maps {
        let picture = &scene.images[bump.image.index()];
        let material = &mut scene.bsdfs[bump.bsdf.index()];
        if let BsdfKind::BumpMap { nested, height, .. } = material.kind
            && holds_normals(&picture.image)
        {
            material.kind = BsdfKind::NormalMap { nested, normals: height };
            let message =
                format!("the bump map `{}` holds normals: it is used as a normal map", picture.path.display());
            report.push(Diagnostic::warning("load::normals-as-bump", message).at(material.span.clone()));
        }
    }
}

/// Texels that are looked at to tell normals from heights.
const PROBES: usize = 4096;

/// True if nearly all texels are unit vectors (encoded as (n + 1) / 2) and the picture is bluish. `image` has plain
/// numbers.
fn holds_normals(image: &Image) -> bool {
    let channels = image.channels as usize;
    if channels < 3 {
        return false;
    }
    let texels = image.width as usize * image.height as usize;
    let value = |i: usize| match &image.pixels {
        Pixels::Srgb8(v) | Pixels::Linear8(v) => v.get(i).map_or(0.0, |&b| f32::from(b) / 255.0),
        Pixels::F32(v) => v.get(i).copied().unwrap_or(0.0),
    };
    let (mut unit, mut blue, mut probes) = (0, 0.0, 0);
    for texel in (0..texels).step_by(texels.div_ceil(PROBES).max(1)) {
        let c = Vec3::new(value(texel * channels), value(texel * channels + 1), value(texel * channels + 2));
        let n = c * 2.0 - 1.0;
        unit += usize::from((n.length() - 1.0).abs() < 0.15 && n.z > 0.0);
        blue += c.z - 0.5 * (c.x + c.y);
        probes += 1;
    }
    probes > 0 && unit * 10 >= probes * 9 && blue > 0.15 * probes as f32
}
