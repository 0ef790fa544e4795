//! Properties that are colours or numbers, constant or looked up in a texture.

use super::document::Node;
use super::objects::Builder;
use super::props::Props;
use super::spectrum::{self, Purpose};
use super::values::{number, numbers};
use crate::image::buffer::srgb_to_linear;
use crate::image::read_regular_text;
use crate::load::paths::locate_or_warn;
use crate::math::Rgb;
use crate::scene::diag::Diagnostic;
use crate::scene::{ColorDesc, ScalarDesc};

/// Largest component of a reflectance that was scaled down, as in Mitsuba 0.6.
const CONSERVING: f32 = 0.99;

impl Builder<'_> {
    /// A colour or texture.
    pub(super) fn color(&mut self, props: &Props<'_>, name: &'static str, default: f32, purpose: Purpose) -> ColorDesc {
        self.optional_color(props, name, purpose).unwrap_or(ColorDesc::Constant(Rgb::grey(default)))
    }

    /// A colour or texture, if the property is there and right.
    pub(super) fn optional_color(
        &mut self,
        props: &Props<'_>,
        name: &'static str,
        purpose: Purpose,
    ) -> Option<ColorDesc> {
        let given = props.get_index(name)?;
        let object = self.resolve(given)?;
        let node = self.node(object);
        if node.tag == "texture" {
            return self.texture(given, object).map(ColorDesc::Texture);
        }
        self.constant(node, purpose, "a colour or texture").map(ColorDesc::Constant)
    }

    /// A reflectance or texture. Constants that are not in [0, 1] are treated as Mitsuba does: version 3 refuses colours
    /// and takes numbers above 1, which is worth a warning; 0.6 scales them down.
    pub(super) fn reflectance(&mut self, props: &Props<'_>, name: &'static str, default: f32) -> ColorDesc {
        let color = self.color(props, name, default, Purpose::Reflectance);
        let ColorDesc::Constant(c) = color else { return color };
        let (least, largest) = (c.r.min(c.g).min(c.b), c.r.max(c.g).max(c.b));
        let object = props.get_index(name).and_then(|given| self.resolve(given));
        let Some(node) = object.filter(|_| least < 0.0 || largest > 1.0).map(|object| self.node(object)) else {
            return color;
        };
        let range = "numbers from 0 to 1";
        if least < 0.0 || (!node.legacy && matches!(node.tag.as_str(), "rgb" | "srgb")) {
            let value = if least < 0.0 { least } else { largest };
            props.bad_value(node, "value", format!("the reflectance `{name}` has the value {value}"), range);
            return color;
        }
        let (color, does) = if node.legacy {
            (ColorDesc::Constant(c * (CONSERVING / largest)), format!("is scaled to {CONSERVING}, as in Mitsuba 0.6"))
        } else {
            (color, "makes light of nothing, as in Mitsuba".to_owned())
        };
        let d = Diagnostic::warning("scene::bright-reflectance", format!("a reflectance `{name}` of {largest} {does}"));
        self.push(d.at(node.span_of("value")).label(format!("expected {range}")));
        color
    }

    /// A colour that cannot vary.
    pub(super) fn rgb(&mut self, props: &Props<'_>, name: &'static str, default: f32, purpose: Purpose) -> Rgb {
        let Some(given) = props.get_index(name) else { return Rgb::grey(default) };
        let Some(object) = self.resolve(given) else { return Rgb::grey(default) };
        self.constant(self.node(object), purpose, "a colour").unwrap_or(Rgb::grey(default))
    }

    /// A number or texture; a colour counts with its luminance.
    pub(super) fn scalar(&mut self, props: &Props<'_>, name: &'static str, default: f32) -> ScalarDesc {
        self.optional_scalar(props, name).unwrap_or(ScalarDesc::Constant(default))
    }

    pub(super) fn optional_scalar(&mut self, props: &Props<'_>, name: &'static str) -> Option<ScalarDesc> {
        let given = props.get_index(name)?;
        let object = self.resolve(given)?;
        let node = self.node(object);
        if node.tag == "texture" {
            return self.texture(given, object).map(ScalarDesc::Texture);
        }
        let color = self.constant(node, Purpose::Reflectance, "a number or texture")?;
        // The luminance weights do not sum to one exactly: a grey value must stay what it is.
        let grey = color.r == color.g && color.g == color.b;
        Some(ScalarDesc::Constant(if grey { color.r } else { color.luminance() }))
    }

    /// The colour that an element stands for.
    pub(super) fn constant(&self, node: &Node, purpose: Purpose, expected: &str) -> Option<Rgb> {
        let text = node.attr("value").map(|a| a.value.as_str());
        let parsed = match (node.tag.as_str(), text) {
            ("blackbody", _) => return self.blackbody(node),
            ("float" | "integer", Some(text)) => number(text).map(|v| Rgb::grey(v as f32)),
            ("rgb" | "srgb", Some(text)) => parse_rgb(text, node.tag == "srgb"),
            // A spectrum of three samples is RGB: the standard build of Mitsuba 0.6.
            ("spectrum", Some(text)) if node.legacy && matches!(numbers(text).as_deref(), Ok(&[_, _, _])) => {
                parse_rgb(text, false)
            }
            ("spectrum", Some(text)) => spectrum::parse(text, purpose),
            ("spectrum", None) if node.attr("filename").is_some() => return self.spectrum_file(node, purpose),
            ("float" | "integer" | "rgb" | "srgb" | "spectrum", None) => {
                let d = Diagnostic::error(
                    "scene::missing-attribute",
                    format!("<{}> needs the attribute `value`", node.tag),
                );
                self.push(d.at(node.span.clone()));
                return None;
            }
            (tag, _) => {
                let d = Diagnostic::error("scene::wrong-type", format!("a <{tag}> where {expected} is expected"));
                self.push(d.at(node.span.clone()).label(format!("expected {expected}")));
                return None;
            }
        };
        parsed
            .map_err(|message| {
                let d = Diagnostic::error("scene::bad-value", message).at(node.span_of("value"));
                self.push(d.label("expected e.g. 0.5 or 0.2, 0.4, 0.6"));
            })
            .ok()
    }

    fn blackbody(&self, node: &Node) -> Option<Rgb> {
        let get = |name: &str, default: Option<f64>| match node.attr(name) {
            None => default.ok_or_else(|| format!("<blackbody> needs `{name}`")),
            // 0.6 wrote `5000K`.
            Some(a) => number(a.value.trim_end_matches(['K', 'k'])),
        };
        let found = get("temperature", None).and_then(|t| Ok((t, get("scale", Some(1.0))?)));
        match found {
            Ok((kelvin, scale)) if kelvin > 0.0 => Some(spectrum::blackbody(kelvin, scale)),
            Ok(_) | Err(_) => {
                let message = found.err().unwrap_or_else(|| "a temperature must be positive".into());
                let d = Diagnostic::error("scene::bad-value", message).at(node.span_of("temperature"));
                self.push(d.label("expected a temperature in kelvin"));
                None
            }
        }
    }

    /// A file of lines `wavelength value`; `#` begins a comment.
    fn spectrum_file(&self, node: &Node, purpose: Purpose) -> Option<Rgb> {
        let attr = node.attr("filename")?;
        let path = locate_or_warn(&self.tree.folders, &attr.value, Some(&attr.span), &mut self.report.borrow_mut());
        let text = match read_regular_text(&path) {
            Ok(text) => text,
            Err(e) => {
                let d = Diagnostic::error("load::io", format!("cannot read `{}`: {e}", path.display()))
                    .at(attr.span.clone());
                self.report.borrow_mut().push_io(d);
                return None;
            }
        };
        self.report.borrow_mut().opened(&path);
        let mut samples = Vec::new();
        for (i, line) in text.lines().enumerate() {
            let line = line.split('#').next().unwrap_or("").trim();
            match numbers(line).as_deref() {
                Ok([]) => {}
                Ok(&[wavelength, value]) => samples.push((wavelength, value)),
                _ => {
                    let message = format!("`{}`, line {}: expected a wavelength and a value", path.display(), i + 1);
                    self.push(Diagnostic::error("scene::bad-value", message).at(attr.span.clone()));
                    return None;
                }
            }
        }
        spectrum::from_samples(&samples, purpose)
            .map_err(|m| {
                self.push(
                    Diagnostic::error("scene::bad-value", format!("`{}`: {m}", path.display())).at(attr.span.clone()),
                );
            })
            .ok()
    }
}

/// One or three linear values, or `#rrggbb`, which is sRGB as the element `<srgb>` is.
fn parse_rgb(text: &str, srgb: bool) -> Result<Rgb, String> {
    let text = text.trim();
    let decode = |v: f64| srgb_to_linear(v) as f32;
    if let Some(hex) = text.strip_prefix('#') {
        let value = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6);
        let value = value.ok_or_else(|| format!("`{text}` is not of the form #rrggbb"))?;
        return Ok(Rgb::from([16, 8, 0].map(|shift| decode(f64::from((value >> shift) & 255) / 255.0))));
    }
    let linear = |v: f64| if srgb { decode(v) } else { v as f32 };
    match numbers(text)?.as_slice() {
        &[v] => Ok(Rgb::grey(linear(v))),
        &[r, g, b] => Ok(Rgb::new(linear(r), linear(g), linear(b))),
        other => Err(format!("a colour has one or three numbers, found {}", other.len())),
    }
}
