//! Lights that are not surfaces.

use super::objects::Builder;
use super::props::Props;
use super::sensor::field_of_view;
use super::spectrum::Purpose::{Emission, Reflectance};
use super::sun;
use super::texture::legacy_gamma;
use crate::load::assets::ImageUse;
use crate::scene::diag::Diagnostic;
use crate::scene::{ColorDesc, EmitterDesc, EmitterKind, ProjectorDesc, TextureId};
use glam::{DMat4, DVec3};

const PLUGINS: [&str; 10] =
    ["area", "point", "spot", "projector", "directional", "constant", "envmap", "sunsky", "sun", "sky"];

impl Builder<'_> {
    /// An `<emitter>` that stands in the scene itself.
    pub(super) fn emitter(&mut self, node: usize) {
        // Built for the shapes that refer to it.
        if self.node(node).attr("type").is_some_and(|a| a.value == "area") && self.referenced.contains(&node) {
            return;
        }
        let Some(props) = self.props(node) else { return };
        let Some(kind) = self.emitter_kind(&props) else { return };
        let is_delta = matches!(
            kind,
            EmitterKind::Point { .. }
                | EmitterKind::Spot { .. }
                | EmitterKind::Projector(_)
                | EmitterKind::Directional { .. }
        );
        let sampling_weight = self.sampling_weight(&props);
        // Mitsuba never chooses a light of weight 0, and only lights that rays can meet shine all the same.
        if is_delta && sampling_weight == 0.0 {
            let message = "a light without extent and with a `sampling_weight` of 0 is dark, as in Mitsuba";
            self.push(Diagnostic::warning("scene::dark-emitter", message).at(props.span()));
        } else {
            self.scene.emitters.push(EmitterDesc { kind, sampling_weight, span: Some(props.span()) });
        }
        self.check_media(&props);
        props.finish();
    }

    fn emitter_kind(&mut self, p: &Props<'_>) -> Option<EmitterKind> {
        let to_world = |p: &Props<'_>| p.transform("to_world").unwrap_or(DMat4::IDENTITY);
        Some(match p.plugin {
            "area" => {
                let d = Diagnostic::error("scene::misplaced-element", "an area light belongs inside a <shape>");
                let help = "a <shape> may also refer to it: give it an `id` and write <ref id=\"…\"/> in the <shape>";
                self.push(d.at(p.span()).label("no surface here").help(help));
                return None;
            }
            "point" => EmitterKind::Point {
                position: p.vector("position").unwrap_or_else(|| to_world(p).transform_point3(DVec3::ZERO)),
                intensity: self.rgb(p, "intensity", 1.0, Emission),
            },
            "spot" => {
                let cutoff = p.positive_or("cutoff_angle", 20.0);
                EmitterKind::Spot {
                    to_world: to_world(p),
                    intensity: self.rgb(p, "intensity", 1.0, Emission),
                    cutoff_angle: cutoff as f32,
                    beam_width: p.float_or("beam_width", cutoff * 0.75) as f32,
                    texture: self.projected_texture(p, cutoff),
                }
            }
            "projector" => EmitterKind::Projector(self.projector(p, to_world(p))),
            "directional" => {
                let direction = p.vector("direction").unwrap_or_else(|| to_world(p).transform_vector3(DVec3::Z));
                let Some(direction) = direction.try_normalize() else {
                    p.error("scene::bad-value", "the `direction` of a light must not be zero");
                    return None;
                };
                EmitterKind::Directional { direction, irradiance: self.rgb(p, "irradiance", 1.0, Emission) }
            }
            "constant" => EmitterKind::Constant { radiance: self.rgb(p, "radiance", 1.0, Emission) },
            "envmap" => {
                let (path, span) = self.file(p, "filename")?;
                let usage = legacy_gamma(p).unwrap_or(ImageUse::Color);
                let image = self.assets.image(path, usage, span);
                self.assets.require(image);
                EmitterKind::Envmap { image, scale: p.float_or("scale", 1.0) as f32, to_world: to_world(p) }
            }
            "sunsky" | "sun" | "sky" => self.sun_sky(p, to_world(p)),
            _ => {
                self.unknown_plugin(p, &PLUGINS);
                return None;
            }
        })
    }

    /// The texture that a spot light projects.
    fn projected_texture(&mut self, p: &Props<'_>, cutoff: f64) -> Option<TextureId> {
        let ColorDesc::Texture(texture) = self.optional_color(p, "texture", Reflectance)? else {
            p.error("scene::wrong-type", "the `texture` of a spot light must be a <texture>");
            return None;
        };
        if cutoff >= 90.0 {
            p.error("scene::bad-value", "a spot light with a `texture` needs a `cutoff_angle` below 90 degrees");
        }
        self.require_pictures(ColorDesc::Texture(texture), &p.span());
        Some(texture)
    }

    fn projector(&mut self, p: &Props<'_>, to_world: DMat4) -> ProjectorDesc {
        if !p.has("irradiance") {
            p.error("scene::missing-property", "a `projector` needs the texture `irradiance`");
        }
        let irradiance = self.color(p, "irradiance", 1.0, Emission);
        self.require_pictures(irradiance, &p.span());
        let (fov, fov_axis) = field_of_view(p);
        ProjectorDesc { to_world, irradiance, scale: p.float_or("scale", 1.0) as f32, fov, fov_axis }
    }

    /// The sampling weight of an emitter, which must not be negative.
    pub(super) fn sampling_weight(&self, p: &Props<'_>) -> f32 {
        let weight = p.float_or("sampling_weight", 1.0);
        if weight < 0.0
            && let Some(node) = p.get("sampling_weight")
        {
            p.bad_value(node, "value", format!("a `sampling_weight` of {weight}"), "a number that is not negative");
        }
        weight as f32
    }

    fn sun_sky(&mut self, p: &Props<'_>, to_world: DMat4) -> EmitterKind {
        let legacy = p.element().legacy;
        // Mitsuba 3 means a direction in the world, 0.6 one in the light's own space.
        let given = p
            .vector("sun_direction")
            .map(|d| if legacy { sun::from_y_up(d) } else { to_world.inverse().transform_vector3(d) });
        let sun_direction =
            given.and_then(DVec3::try_normalize).unwrap_or_else(|| sun::direction(&sun::when_and_where(p), legacy));
        let turbidity = p.float_or("turbidity", 3.0);
        if !(1.0..=10.0).contains(&turbidity)
            && let Some(node) = p.get("turbidity")
        {
            p.bad_value(node, "value", format!("a turbidity of {turbidity}"), "a number from 1 to 10");
        }
        let scale = p.float_or("scale", 1.0);
        EmitterKind::SunSky {
            to_world: if legacy { to_world * sun::y_up() } else { to_world },
            sun_direction,
            turbidity: turbidity.clamp(1.0, 10.0) as f32,
            albedo: self.rgb(p, "albedo", if legacy { 0.15 } else { 0.3 }, Reflectance),
            sky_scale: if p.plugin == "sun" { 0.0 } else { (p.float_or("sky_scale", 1.0) * scale) as f32 },
            sun_scale: if p.plugin == "sky" { 0.0 } else { (p.float_or("sun_scale", 1.0) * scale) as f32 },
            sun_aperture: p.positive_or("sun_aperture", 0.5358) as f32,
        }
    }
}
