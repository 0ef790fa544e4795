//! Textures. A picture's v runs down from its top row, as in Mitsuba 3: row = v · height with v as the mesh has it.

use super::objects::Builder;
use super::props::Props;
use super::spectrum::Purpose::Reflectance;
use crate::load::assets::ImageUse;
use crate::scene::diag::Diagnostic;
use crate::scene::{TextureDesc, TextureFilter, TextureId, WrapMode};

impl Builder<'_> {
    /// The texture `object`, reached from the element `from`; `data` reads eight-bit pictures as plain numbers, not as
    /// sRGB.
    pub(super) fn texture(&mut self, from: usize, object: usize, data: bool) -> Option<TextureId> {
        if let Some(done) = self.textures.get(&(object, data)) {
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
            let desc = b.texture_desc(&props, data)?;
            props.finish();
            b.scene.textures.push(desc);
            Some(TextureId((b.scene.textures.len() - 1) as u32))
        });
        self.textures.insert((object, data), built);
        built
    }

    fn texture_desc(&mut self, p: &Props<'_>, data: bool) -> Option<TextureDesc> {
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
                // 0.6 says linear with a gamma of one; any other gamma is taken for sRGB.
                let gamma = p.float("gamma");
                let raw = p.boolean_or("raw", gamma == Some(1.0));
                p.ignore(&["accel", "format", "max_anisotropy", "cache"]);
                let scale = p.float_or("scale", 1.0) as f32;
                let (path, span) = self.file(p, "filename")?;
                let image = self.assets.image(path, if raw || data { ImageUse::Data } else { ImageUse::Color }, span);
                Some(TextureDesc::Bitmap { image, to_uv, filter, wrap, scale })
            }
            "checkerboard" => {
                let color0 = self.color(p, "color0", 0.4, Reflectance);
                let color1 = self.color(p, "color1", 0.2, Reflectance);
                Some(TextureDesc::Checkerboard { color0, color1, to_uv: to_uv(p) })
            }
            // 0.6: a texture times a number.
            "scale" => self.scaled(p, data),
            _ => {
                self.unknown_plugin(p, &["bitmap", "checkerboard", "scale"]);
                None
            }
        }
    }

    fn scaled(&mut self, p: &Props<'_>, data: bool) -> Option<TextureDesc> {
        let factor = p.float_or("scale", 1.0) as f32;
        let &[nested] = p.objects().as_slice() else {
            p.error("scene::nested-texture", "`scale` needs one nested <texture>");
            return None;
        };
        let object = self.resolve(nested)?;
        let id = self.texture(nested, object, data)?;
        let mut desc = self.scene.textures[id.index()].clone();
        match &mut desc {
            TextureDesc::Bitmap { scale, .. } => *scale *= factor,
            TextureDesc::Checkerboard { color0, color1, .. } => {
                for color in [color0, color1] {
                    match color {
                        crate::scene::ColorDesc::Constant(c) => *c *= factor,
                        crate::scene::ColorDesc::Texture(_) => {
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
