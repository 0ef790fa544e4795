//! Textures. A picture's v runs down from its top row, as in Mitsuba 3: row = v · height with v as the mesh has it.

use super::objects::Builder;
use super::props::Props;
use super::spectrum::Purpose::Reflectance;
use crate::load::assets::ImageUse;
use crate::load::mesh::MeshColors;
use crate::math::Rgb;
use crate::scene::diag::Diagnostic;
use crate::scene::{ColorDesc, Span, TextureDesc, TextureFilter, TextureId, WrapMode};
use std::collections::HashSet;

impl Builder<'_> {
    /// The texture `object`, reached from the element `from`.
    pub(super) fn texture(&mut self, from: usize, object: usize) -> Option<TextureId> {
        if let Some(done) = self.textures.get(&object) {
            return *done;
        }
        let node = self.node(object);
        if node.tag != "texture" {
            let d = Diagnostic::error("scene::wrong-type", format!("a <{}> where a <texture> is expected", node.tag));
            self.push(d.at(self.node(from).span.clone()));
            return None;
        }
        let built = self.guarded(object, from, |b| {
            let props = b.props(object)?;
            let desc = b.texture_desc(&props)?;
            props.finish();
            b.scene.textures.push(desc);
            Some(TextureId((b.scene.textures.len() - 1) as u32))
        });
        self.textures.insert(object, built);
        built
    }

    fn texture_desc(&mut self, p: &Props<'_>) -> Option<TextureDesc> {
        match p.plugin {
            "bitmap" => {
                let to_uv = to_uv(p);
                let filters = [
                    ("bilinear", TextureFilter::Bilinear),
                    ("nearest", TextureFilter::Nearest),
                    ("trilinear", TextureFilter::Bilinear),
                    ("ewa", TextureFilter::Bilinear),
                ];
                let filter = p.choice("filter_type", &filters, TextureFilter::Bilinear);
                let wraps = [("repeat", WrapMode::Repeat), ("mirror", WrapMode::Mirror), ("clamp", WrapMode::Clamp)];
                let wrap = p.choice("wrap_mode", &wraps, WrapMode::Repeat);
                let usage = if p.boolean_or("raw", false) { ImageUse::Data } else { ImageUse::Color };
                let usage = legacy_gamma(p).unwrap_or(usage);
                let scale = p.float_or("scale", 1.0) as f32;
                let (path, span) = self.file(p, "filename")?;
                let image = self.assets.image(path, usage, span);
                Some(TextureDesc::Bitmap { image, to_uv, filter, wrap, scale })
            }
            "checkerboard" => {
                let color0 = self.color(p, "color0", 0.4, Reflectance);
                let color1 = self.color(p, "color1", 0.2, Reflectance);
                Some(TextureDesc::Checkerboard { color0, color1, to_uv: to_uv(p) })
            }
            "mesh_attribute" => Some(mesh_attribute(p)),
            "rawconstant" => self.raw_constant(p),
            // 0.6: a texture times a number.
            "scale" => self.scaled(p),
            _ => {
                self.unknown_plugin(p, &["bitmap", "checkerboard", "mesh_attribute", "rawconstant", "scale"]);
                None
            }
        }
    }

    /// A constant without conversion: a checkerboard of one colour.
    fn raw_constant(&mut self, p: &Props<'_>) -> Option<TextureDesc> {
        let Some(node) = p.get("value") else {
            p.error("scene::missing-property", "a `rawconstant` needs the property `value`");
            return None;
        };
        let color = match node.tag.as_str() {
            "vector" | "point" => p.vector("value").map(|v| Rgb::new(v.x as f32, v.y as f32, v.z as f32)),
            _ => self.constant(node, Reflectance, "a number or a vector"),
        };
        let color = ColorDesc::Constant(color?);
        Some(TextureDesc::Checkerboard { color0: color, color1: color, to_uv: to_uv(p) })
    }

    /// Makes it an error if a picture of a texture that lights the scene cannot be read. `at` is the light.
    pub(super) fn require_pictures(&mut self, color: ColorDesc, at: &Span) {
        let ColorDesc::Texture(id) = color else { return };
        match self.scene.textures[id.index()] {
            TextureDesc::Bitmap { image, .. } => self.assets.require(image),
            TextureDesc::MeshAttribute { .. } => {
                let message = "a `mesh_attribute` that lights the scene is not supported";
                self.push(Diagnostic::unsupported(message).at(at.clone()));
            }
            // Nested textures are built before the one that holds them, so that there is no circle.
            TextureDesc::Checkerboard { color0, color1, .. } => {
                [color0, color1].into_iter().for_each(|c| self.require_pictures(c, at));
            }
        }
    }

    /// Says that a normal or bump map is decoded as sRGB where the file does not ask for it in so many words: Mitsuba's
    /// default, and mostly not what an author means.
    pub(super) fn warn_of_decoding(&self, object: usize, plugin: &str) {
        let node = self.node(object);
        let child = |wanted: &str| {
            node.children.iter().map(|&c| self.node(c)).find(|c| c.attr("name").is_some_and(|a| a.value == wanted))
        };
        match node.attr("type").map(|a| a.value.as_str()) {
            Some("scale") => {
                let nested = node.children.iter().filter(|&&c| matches!(self.node(c).tag.as_str(), "texture" | "ref"));
                nested.filter_map(|&c| self.resolve(c)).for_each(|c| self.warn_of_decoding(c, plugin));
            }
            Some("bitmap") if child("raw").is_none() && child("gamma").is_none() => {
                let Some(file) = child("filename").and_then(|c| c.attr("value")) else { return };
                let ending = file.value.rsplit('.').next().unwrap_or("").to_ascii_lowercase();
                if FLOAT_PICTURES.contains(&ending.as_str()) {
                    return;
                }
                let message = format!("`{}` is decoded from sRGB for a `{plugin}`, as in Mitsuba", file.value);
                let remedy = if node.legacy {
                    "<float name=\"gamma\" value=\"1\"/>"
                } else {
                    "<boolean name=\"raw\" value=\"true\"/>"
                };
                let help = format!("if the picture holds plain numbers, write {remedy} in its <texture>");
                self.push(Diagnostic::warning("scene::decoded-data", message).at(file.span.clone()).help(help));
            }
            _ => {}
        }
    }

    /// The colours of its mesh that a shape's material (an element or a reference to one) looks up.
    pub(super) fn mesh_colors(&self, material: usize) -> MeshColors {
        let mut found = MeshColors::Unused;
        let (mut open, mut seen) = (vec![material], HashSet::new());
        while let Some(index) = open.pop() {
            let Some(object) = self.referred(index).filter(|&object| seen.insert(object)) else { continue };
            let node = self.node(object);
            open.extend(&node.children);
            let is_attribute = node.attr("type").is_some_and(|a| a.value == "mesh_attribute");
            let name = |c: &usize| self.node(*c).attr("name").is_some_and(|a| a.value == "name");
            let Some(name) = node.children.iter().find(|c| is_attribute && name(c)) else { continue };
            let value = self.node(*name).attr("value").map_or("", |a| a.value.as_str());
            let colors = if value == MeshColors::Face.attribute() { MeshColors::Face } else { MeshColors::Vertex };
            if found != MeshColors::Unused && found != colors {
                let message = "`vertex_color` and `face_color` of one shape together are not supported";
                self.push(Diagnostic::unsupported(message).at(node.span.clone()));
            }
            found = colors;
        }
        found
    }

    fn scaled(&mut self, p: &Props<'_>) -> Option<TextureDesc> {
        let factor = p.float_or("scale", 1.0) as f32;
        let &[nested] = p.objects().as_slice() else {
            p.error("scene::nested-texture", "`scale` needs one nested <texture>");
            return None;
        };
        let object = self.resolve(nested)?;
        let id = self.texture(nested, object)?;
        let mut desc = self.scene.textures[id.index()].clone();
        match &mut desc {
            TextureDesc::Bitmap { scale, .. } | TextureDesc::MeshAttribute { scale } => *scale *= factor,
            TextureDesc::Checkerboard { color0, color1, .. } => {
                for color in [color0, color1] {
                    match color {
                        ColorDesc::Constant(c) => *c *= factor,
                        ColorDesc::Texture(_) => {
                            p.error("scene::nested-texture", "a checkerboard of textures cannot be scaled");
                            return None;
                        }
                    }
                }
            }
        }
        Some(desc)
    }
}

/// Endings of pictures in linear floats, which are not decoded.
const FLOAT_PICTURES: [&str; 5] = ["exr", "hdr", "rgbe", "pfm", "pic"];

/// `gamma` of Mitsuba 0.6: 1 is linear, −1 sRGB, 0 (or nothing) what the format says, anything else a power.
pub(super) fn legacy_gamma(p: &Props<'_>) -> Option<ImageUse> {
    if !p.element().legacy {
        return None;
    }
    match p.float("gamma")? {
        1.0 => Some(ImageUse::Data),
        -1.0 => Some(ImageUse::Srgb),
        0.0 => None,
        gamma if gamma > 0.0 => Some(ImageUse::power(gamma as f32)),
        gamma => {
            if let Some(node) = p.get("gamma") {
                p.bad_value(node, "value", format!("a gamma of {gamma}"), "a positive number, or -1 for sRGB");
            }
            None
        }
    }
}

/// `to_uv`, or 0.6's `uscale`, `vscale`, `uoffset`, `voffset` (the offset counts before the scale, as Mitsuba 3
/// upgrades it).
fn to_uv(p: &Props<'_>) -> [[f32; 3]; 2] {
    let m = p.transform("to_uv").unwrap_or(glam::DMat4::IDENTITY);
    let row = |r: usize| [m.x_axis[r], m.y_axis[r], m.w_axis[r]];
    let [mut u, mut v] = [row(0), row(1)];
    if p.element().legacy {
        let both = p.float_or("uvscale", 1.0);
        for (row, axis, scale, offset) in [(&mut u, 0, "uscale", "uoffset"), (&mut v, 1, "vscale", "voffset")] {
            let scale = p.float_or(scale, both);
            row[axis] *= scale;
            row[2] += scale * p.float_or(offset, 0.0);
        }
    }
    [u, v].map(|row| row.map(|x| x as f32))
}

/// A texture of colours of the mesh that it is on.
fn mesh_attribute(p: &Props<'_>) -> TextureDesc {
    let scale = p.float_or("scale", 1.0) as f32;
    let known = [MeshColors::Vertex, MeshColors::Face].map(|c| (c.attribute(), c));
    if !p.has("name") {
        p.error("scene::missing-property", "a `mesh_attribute` needs the `name` of an attribute");
    }
    p.choice("name", &known, MeshColors::Vertex);
    TextureDesc::MeshAttribute { scale }
}
