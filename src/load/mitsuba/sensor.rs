//! Cameras and films.

use super::objects::Builder;
use super::props::Props;
use crate::scene::diag::Diagnostic;
use crate::scene::{FilmDesc, FilterDesc, FovAxis, SensorDesc};
use glam::DMat4;

/// Diagonal in mm of the 36 x 24 mm frame that focal lengths refer to.
const FRAME_DIAGONAL: f64 = 43.266_615_305_567_87;
/// No picture is larger.
const MAX_SIDE: u32 = 1 << 16;

impl Builder<'_> {
    pub(super) fn sensor(&mut self, node: usize) -> Option<SensorDesc> {
        let p = self.props(node)?;
        if !matches!(p.plugin, "perspective" | "thinlens") {
            self.unknown_plugin(&p, &["perspective", "thinlens"]);
            return None;
        }
        let far_clip = p.positive_or("far_clip", 1e4);
        let near_clip = p.positive_or("near_clip", 1e-2);
        if near_clip >= far_clip {
            p.error("scene::bad-value", format!("`near_clip` ({near_clip}) must be less than `far_clip` ({far_clip})"));
        }
        let (fov, fov_axis) = field_of_view(&p);
        let thin = p.plugin == "thinlens";
        let aperture_radius = if thin { p.float_or("aperture_radius", 0.0).max(0.0) } else { 0.0 };
        let focus_distance = p.positive_or("focus_distance", far_clip);
        if thin && !p.has("aperture_radius") {
            p.error("scene::missing-property", "a `thinlens` needs `aperture_radius`");
        }
        let offset = [p.float_or("principal_point_offset_x", 0.0), p.float_or("principal_point_offset_y", 0.0)];
        // Mitsuba's thin lens reads the offset and does not use it.
        let principal_point = if thin { [0.0; 2] } else { offset };
        let to_world = p.transform("to_world").unwrap_or(DMat4::IDENTITY);

        let (mut film, mut sample_count, mut medium) = (None, None, None);
        for object in p.objects() {
            let Some(object) = self.resolve(object) else { continue };
            match self.node(object).tag.as_str() {
                "film" => film = self.film(object),
                "sampler" => sample_count = self.sampler(object),
                "medium" => medium = self.medium(object),
                tag => {
                    let d =
                        Diagnostic::error("scene::misplaced-element", format!("a <{tag}> has no place in a <sensor>"));
                    self.push(d.at(self.node(object).span.clone()).label("expected <film> or <sampler>"));
                }
            }
        }
        p.finish();
        let film = film.unwrap_or(FilmDesc {
            width: 768,
            height: 576,
            crop: None,
            filter: FilterDesc::Gaussian { stddev: 0.5 },
            span: None,
        });
        Some(SensorDesc {
            to_world,
            fov,
            fov_axis,
            principal_point,
            near_clip,
            far_clip,
            aperture_radius,
            focus_distance,
            medium,
            film,
            sample_count,
            span: Some(p.span()),
        })
    }

    /// Samples per pixel that a `<sampler>` asks for.
    pub(super) fn sampler(&mut self, node: usize) -> Option<u32> {
        let p = self.props(node)?;
        // Every sampler of Mitsuba's is accepted: which numbers are drawn is the integrators' own business.
        let count = p.count("sample_count");
        p.finish();
        count
    }

    /// Size, crop and filter of a `<film>`.
    pub(super) fn film(&mut self, node: usize) -> Option<FilmDesc> {
        let p = self.props(node)?;
        if !matches!(p.plugin, "hdrfilm" | "ldrfilm" | "mfilm") {
            self.unknown_plugin(&p, &["hdrfilm", "ldrfilm"]);
            return None;
        }
        let side = |name: &'static str, default: u32| match p.count(name) {
            Some(v) if v > MAX_SIDE => {
                if let Some(node) = p.get(name) {
                    p.bad_value(node, "value", format!("a `{name}` of {v} pixels"), &format!("at most {MAX_SIDE}"));
                }
                default
            }
            v => v.unwrap_or(default),
        };
        let (width, height) = (side("width", 768), side("height", 576));
        let offset = [p.count("crop_offset_x"), p.count("crop_offset_y")];
        let size = [p.count("crop_width"), p.count("crop_height")];
        let crop = (offset.iter().chain(&size).any(Option::is_some)).then(|| {
            let [x, y] = offset.map(|v| v.unwrap_or(0));
            [x, y, size[0].unwrap_or(width.saturating_sub(x)), size[1].unwrap_or(height.saturating_sub(y))]
        });
        let mut filter = FilterDesc::Gaussian { stddev: 0.5 };
        for object in p.objects() {
            let Some(object) = self.resolve(object) else { continue };
            if self.node(object).tag == "rfilter" {
                filter = self.filter(object).unwrap_or(filter);
            } else {
                let d = Diagnostic::error(
                    "scene::misplaced-element",
                    format!("a <{}> has no place in a <film>", self.node(object).tag),
                );
                self.push(d.at(self.node(object).span.clone()).label("expected <rfilter>"));
            }
        }
        p.finish();
        Some(FilmDesc { width, height, crop, filter, span: Some(p.span()) })
    }

    /// The pixel filter that an `<rfilter>` describes.
    pub(super) fn filter(&mut self, node: usize) -> Option<FilterDesc> {
        let p = self.props(node)?;
        let filter = match p.plugin {
            "box" => FilterDesc::Box,
            "tent" => FilterDesc::Tent { radius: p.positive_or("radius", 1.0) as f32 },
            "gaussian" => FilterDesc::Gaussian { stddev: p.positive_or("stddev", 0.5) as f32 },
            "mitchell" => {
                let third = 1.0 / 3.0;
                FilterDesc::Mitchell {
                    b: p.float_or(either(&p, "B", "b"), third) as f32,
                    c: p.float_or(either(&p, "C", "c"), third) as f32,
                }
            }
            "catmullrom" => FilterDesc::Mitchell { b: 0.0, c: 0.5 },
            "lanczos" => {
                let d = Diagnostic::warning(
                    "scene::replaced-plugin",
                    "the filter `lanczos` is not supported: `gaussian` is used instead",
                );
                self.push(d.at(p.element().span_of("type")).changing_picture());
                FilterDesc::Gaussian { stddev: 0.5 }
            }
            _ => {
                self.unknown_plugin(&p, &["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"]);
                return None;
            }
        };
        p.finish();
        Some(filter)
    }
}

/// Whichever of two spellings the file uses.
fn either(p: &Props<'_>, first: &'static str, second: &'static str) -> &'static str {
    if p.has(first) { first } else { second }
}

/// `fov` in degrees with its axis, or `focal_length` in mm on 35 mm film, which stands for a diagonal angle.
pub(super) fn field_of_view(p: &Props<'_>) -> (f64, FovAxis) {
    let axes = [
        ("x", FovAxis::X),
        ("y", FovAxis::Y),
        ("diagonal", FovAxis::Diagonal),
        ("smaller", FovAxis::Smaller),
        ("larger", FovAxis::Larger),
    ];
    let axis = p.choice("fov_axis", &axes, FovAxis::X);
    if p.has("fov") {
        if p.has("focal_length") {
            p.error("scene::duplicate-property", "give either `fov` or `focal_length`");
        }
        let fov = p.float_or("fov", 40.0);
        if !(fov > 0.0 && fov < 180.0)
            && let Some(node) = p.get("fov")
        {
            p.bad_value(node, "value", format!("a field of view of {fov} degrees"), "an angle between 0 and 180");
        }
        return (fov, axis);
    }
    let mut length = 50.0;
    if let Some(node) = p.get("focal_length")
        && let Some(text) = p.value_of(node)
    {
        match text.trim().trim_end_matches("mm").trim().parse::<f64>() {
            Ok(mm) if mm > 0.0 && mm.is_finite() => length = mm,
            _ => p.bad_value(node, "value", format!("`{text}` is not a focal length"), "a length in mm, e.g. 50mm"),
        }
    }
    (2.0 * (FRAME_DIAGONAL / (2.0 * length)).atan().to_degrees(), FovAxis::Diagonal)
}
