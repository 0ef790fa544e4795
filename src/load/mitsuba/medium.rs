//! Participating media: their coefficients, and which media a shape, a light or a camera names.

use super::medium_presets;
use super::objects::Builder;
use super::props::Props;
use super::volume::{Quantity, Volume};
use crate::math::Rgb;
use crate::scene::diag::{Diagnostic, nearest};
use crate::scene::{InterfaceDesc, MediumDesc, MediumId, PhaseDesc, VolumeDesc};

const PLUGINS: [&str; 2] = ["homogeneous", "heterogeneous"];

/// Defaults of Mitsuba 3.
const SIGMA_T: f32 = 1.0;
const ALBEDO: f32 = 0.75;
/// The preset of homogeneous media of Mitsuba 0.6 that name none.
const LEGACY_PRESET: &str = "skin1";

/// Extinction before `scale`, and albedo.
struct MediumCoefficients {
    sigma_t: Volume,
    albedo: Volume,
}

impl Builder<'_> {
    /// The medium that an element is or refers to.
    pub(super) fn medium(&mut self, from: usize) -> Option<MediumId> {
        let object = self.resolve(from)?;
        if let Some(done) = self.media.get(&object) {
            return *done;
        }
        let node = self.node(object);
        if node.tag != "medium" {
            let d = Diagnostic::error("scene::wrong-type", format!("a <{}> where a <medium> is expected", node.tag));
            self.push(d.at(self.node(from).span.clone()).label("expected a <medium>"));
            return None;
        }
        let built = self.guarded(object, from, |b| {
            let p = b.props(object)?;
            let medium = b.medium_desc(&p)?;
            p.finish();
            b.scene.media.push(medium);
            Some(MediumId((b.scene.media.len() - 1) as u32))
        });
        self.media.insert(object, built);
        built
    }

    /// The media on both sides of a shape, if it names any.
    pub(super) fn interface(&mut self, p: &Props<'_>) -> Option<InterfaceDesc> {
        let given = ["interior", "exterior"].map(|side| p.get_index(side));
        let [interior, exterior] = given.map(|medium| medium.and_then(|medium| self.medium(medium)));
        given.iter().any(Option::is_some).then_some(InterfaceDesc { interior, exterior })
    }

    /// Checks the media that a light names. They have no effect: shapes and the camera tell where media are.
    pub(super) fn check_media(&mut self, p: &Props<'_>) {
        for medium in self.nested_with_tag(p, "medium") {
            self.medium(medium);
        }
    }

    /// Nested objects with a tag, whatever their names, and references to such.
    pub(super) fn nested_with_tag(&self, p: &Props<'_>, tag: &str) -> Vec<usize> {
        // A reference to nothing is reported where it is resolved.
        p.objects_that(|object| self.referred(object).is_none_or(|object| self.node(object).tag == tag))
    }

    fn medium_desc(&mut self, p: &Props<'_>) -> Option<MediumDesc> {
        if !PLUGINS.contains(&p.plugin) {
            self.unknown_plugin(p, &PLUGINS);
            return None;
        }
        let MediumCoefficients { sigma_t, albedo } = self.medium_coefficients(p);
        let scale = self.medium_scale(p, sigma_t.largest);
        let (sigma_t, albedo) = (sigma_t.desc, albedo.desc);
        let phase = match self.nested_with_tag(p, "phase").as_slice() {
            [] => PhaseDesc::Isotropic,
            &[phase] => self.phase(phase).unwrap_or(PhaseDesc::Isotropic),
            several => {
                let message = format!("a medium has one phase function, found {}", several.len());
                p.error("scene::nested-phase", message);
                return None;
            }
        };
        Some(MediumDesc { sigma_t, albedo, scale, phase, span: Some(p.span()) })
    }

    /// `scale`, with which the extinction, `largest` at most, must not become negative or infinite.
    fn medium_scale(&self, p: &Props<'_>, largest: f32) -> f32 {
        let scale = p.float_or("scale", 1.0);
        let problem = if scale < 0.0 {
            format!("a `scale` of {scale} makes the extinction negative")
        } else if scale.max(scale * f64::from(largest)) > f64::from(f32::MAX) {
            format!("a `scale` of {scale} makes an extinction that is not finite")
        } else {
            return scale as f32;
        };
        if let Some(node) = p.get("scale") {
            p.bad_value(node, "value", problem, "a number that is not negative");
        }
        1.0
    }

    /// By the albedo and the extinction, by the coefficients of absorption and scattering, or by the name of a material.
    fn medium_coefficients(&mut self, p: &Props<'_>) -> MediumCoefficients {
        let legacy = p.element().legacy;
        // Mitsuba 0.6 has the extinction of heterogeneous media under another name.
        let extinction = if legacy && p.has("density") { "density" } else { "sigma_t" };
        let by_extinction = p.has(extinction) || p.has("albedo");
        let by_sigmas = p.has("sigma_a") || p.has("sigma_s");
        if [by_extinction, by_sigmas, p.has("material")].into_iter().filter(|&given| given).count() > 1 {
            p.error(
                "scene::duplicate-property",
                "give either `sigma_t` and `albedo`, `sigma_a` and `sigma_s`, or `material`",
            );
        }
        let is_preset = p.has("material") || (legacy && p.plugin == "homogeneous");
        let default = if is_preset { preset(p) } else { [Rgb::grey(SIGMA_T), Rgb::grey(ALBEDO)] };
        if by_sigmas {
            return self.by_absorption_and_scattering(p, default);
        }
        for name in ["density", "albedo"] {
            if legacy && p.plugin == "heterogeneous" && !p.has(name) {
                p.error("scene::missing-property", format!("the medium plugin `heterogeneous` needs `{name}`"));
            }
        }
        let [sigma_t, albedo] = default.map(Volume::constant);
        let density = Quantity { name: extinction, largest: f32::MAX };
        MediumCoefficients {
            sigma_t: self.volume(p, density).unwrap_or(sigma_t),
            albedo: self.volume(p, Quantity { name: "albedo", largest: 1.0 }).unwrap_or(albedo),
        }
    }

    /// σ_t = σ_a + σ_s and σ_s / σ_t, which is zero where the first is. Mitsuba 0.6 takes one that is not given from its
    /// default material.
    fn by_absorption_and_scattering(&mut self, p: &Props<'_>, [sigma_t, albedo]: [Rgb; 2]) -> MediumCoefficients {
        let mut coefficient = |name: &'static str, default: Rgb| {
            if !p.element().legacy && !p.has(name) {
                p.error(
                    "scene::missing-property",
                    format!("`sigma_a` and `sigma_s` belong together: `{name}` is missing"),
                );
            }
            match self.volume(p, Quantity { name, largest: f32::MAX }).map(|volume| volume.desc) {
                Some(VolumeDesc::Constant(c)) => c,
                Some(VolumeDesc::Grid(_)) => {
                    let message = format!("a grid of `{name}` is not supported: give grids of `sigma_t` and `albedo`");
                    p.unsupported(message);
                    default
                }
                None => default,
            }
        };
        let sigma_s = coefficient("sigma_s", sigma_t * albedo);
        let sigma_a = coefficient("sigma_a", sigma_t * (Rgb::WHITE - albedo));
        let sigma_t = sigma_a + sigma_s;
        if !sigma_t.is_finite() {
            p.error("scene::bad-value", "the sum of `sigma_a` and `sigma_s` is not finite");
        }
        let [sigma_t, albedo] = [sigma_t, share(sigma_s, sigma_t)].map(Volume::constant);
        MediumCoefficients { sigma_t, albedo }
    }
}

/// Extinction and albedo of the material that `material` names, by default that of Mitsuba 0.6.
fn preset(p: &Props<'_>) -> [Rgb; 2] {
    let name = p.string("material").unwrap_or(LEGACY_PRESET);
    let Some(preset) = medium_presets::find(name) else {
        let names: Vec<&str> = medium_presets::names().collect();
        if let Some(node) = p.get("material") {
            let expected = match nearest(&name.to_lowercase(), names.iter().copied()) {
                Some(near) => format!("a material; did you mean `{near}`?"),
                None => format!("one of: {}", names.join(", ")),
            };
            p.bad_value(node, "value", format!("unknown medium `{name}`"), &expected);
        }
        return [Rgb::grey(SIGMA_T), Rgb::grey(ALBEDO)];
    };
    let sigma_t = preset.sigma_a + preset.sigma_s;
    [sigma_t, share(preset.sigma_s, sigma_t)]
}

/// Quotients of channels; zero where both are.
fn share(part: Rgb, whole: Rgb) -> Rgb {
    Rgb::from([0, 1, 2].map(|i| if whole[i] > 0.0 { part[i] / whole[i] } else { 0.0 }))
}
