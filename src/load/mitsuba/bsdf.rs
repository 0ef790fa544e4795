//! Materials.

use super::conductors;
use super::indices::{BK7, POLYPROPYLENE};
use super::objects::Builder;
use super::props::Props;
use super::spectrum::Purpose::Reflectance;
use crate::math::Rgb;
use crate::scene::diag::{Diagnostic, nearest};
use crate::scene::{BsdfDesc, BsdfId, BsdfKind, ColorDesc, Distribution, PrincipledDesc, RoughnessDesc, WardVariant};

const PLUGINS: [&str; 16] = [
    "diffuse",
    "dielectric",
    "thindielectric",
    "roughdielectric",
    "conductor",
    "roughconductor",
    "plastic",
    "roughplastic",
    "principled",
    "phong",
    "ward",
    "twosided",
    "mask",
    "bumpmap",
    "normalmap",
    "blendbsdf",
];
/// Plugins of old versions that are read as another one.
const REPLACED: [(&str, &str); 2] = [("roughdiffuse", "diffuse"), ("difftrans", "diffuse")];

impl Builder<'_> {
    /// The material that an element is or refers to.
    pub(super) fn bsdf(&mut self, from: usize) -> Option<BsdfId> {
        let object = self.resolve(from)?;
        if let Some(done) = self.bsdfs.get(&object) {
            return *done;
        }
        let node = self.node(object);
        if node.tag != "bsdf" {
            let d = Diagnostic::error("scene::wrong-type", format!("a <{}> where a <bsdf> is expected", node.tag));
            self.push(d.at(self.node(from).span.clone()).label("expected a <bsdf>"));
            return None;
        }
        let built = self.guarded(object, from, |b| {
            let props = b.props(object)?;
            let kind = b.bsdf_kind(&props)?;
            props.finish();
            let name = node.attr("id").map(|a| a.value.clone());
            b.scene.bsdfs.push(BsdfDesc { name, kind, span: Some(node.span.clone()) });
            Some(BsdfId((b.scene.bsdfs.len() - 1) as u32))
        });
        self.bsdfs.insert(object, built);
        built
    }

    fn bsdf_kind(&mut self, props: &Props<'_>) -> Option<BsdfKind> {
        let p = props;
        let mut plugin = p.plugin;
        if let Some((old, new)) = REPLACED.iter().find(|(old, _)| *old == plugin) {
            let d = Diagnostic::warning(
                "scene::replaced-plugin",
                format!("`{old}` is not supported: `{new}` is used instead"),
            );
            self.push(d.at(p.element().span_of("type")));
            p.ignore(&["alpha", "use_fast_approx", "transmittance"]);
            plugin = new;
        }
        Some(match plugin {
            "diffuse" => {
                let name = if p.has("diffuse_reflectance") { "diffuse_reflectance" } else { "reflectance" };
                BsdfKind::Diffuse { reflectance: self.color(p, name, 0.5, Reflectance) }
            }
            "dielectric" => {
                let (specular_reflectance, specular_transmittance) = self.tints(p);
                BsdfKind::Dielectric { eta: self.relative_ior(p, BK7), specular_reflectance, specular_transmittance }
            }
            "thindielectric" => {
                let (specular_reflectance, specular_transmittance) = self.tints(p);
                BsdfKind::ThinDielectric {
                    eta: self.relative_ior(p, BK7),
                    specular_reflectance,
                    specular_transmittance,
                }
            }
            "roughdielectric" => {
                let (specular_reflectance, specular_transmittance) = self.tints(p);
                let roughness = self.roughness(p);
                BsdfKind::RoughDielectric {
                    roughness,
                    eta: self.relative_ior(p, BK7),
                    specular_reflectance,
                    specular_transmittance,
                }
            }
            "conductor" => {
                let (eta, k) = self.metal(p);
                BsdfKind::Conductor {
                    eta,
                    k,
                    specular_reflectance: self.color(p, "specular_reflectance", 1.0, Reflectance),
                }
            }
            "roughconductor" => {
                let (eta, k) = self.metal(p);
                let roughness = self.roughness(p);
                BsdfKind::RoughConductor {
                    roughness,
                    eta,
                    k,
                    specular_reflectance: self.color(p, "specular_reflectance", 1.0, Reflectance),
                }
            }
            "plastic" => BsdfKind::Plastic {
                eta: self.relative_ior(p, POLYPROPYLENE),
                diffuse_reflectance: self.color(p, "diffuse_reflectance", 0.5, Reflectance),
                specular_reflectance: self.color(p, "specular_reflectance", 1.0, Reflectance),
                nonlinear: p.boolean_or("nonlinear", false),
            },
            "roughplastic" => BsdfKind::RoughPlastic {
                roughness: self.roughness(p),
                eta: self.relative_ior(p, POLYPROPYLENE),
                diffuse_reflectance: self.color(p, "diffuse_reflectance", 0.5, Reflectance),
                specular_reflectance: self.color(p, "specular_reflectance", 1.0, Reflectance),
                nonlinear: p.boolean_or("nonlinear", false),
            },
            "principled" => BsdfKind::Principled(Box::new(self.principled(p))),
            "phong" => BsdfKind::Phong {
                exponent: self.scalar(p, "exponent", 30.0),
                specular_reflectance: self.color(p, "specular_reflectance", 0.2, Reflectance),
                diffuse_reflectance: self.color(p, "diffuse_reflectance", 0.5, Reflectance),
            },
            "ward" => {
                let both = p.has("alpha");
                let variants = [
                    ("balanced", WardVariant::Balanced),
                    ("ward", WardVariant::Ward),
                    ("ward-duer", WardVariant::WardDuer),
                ];
                BsdfKind::Ward {
                    alpha_u: self.scalar(p, if both { "alpha" } else { "alpha_u" }, 0.1),
                    alpha_v: self.scalar(p, if both { "alpha" } else { "alpha_v" }, 0.1),
                    variant: p.choice("variant", &variants, WardVariant::Balanced),
                    specular_reflectance: self.color(p, "specular_reflectance", 0.2, Reflectance),
                    diffuse_reflectance: self.color(p, "diffuse_reflectance", 0.5, Reflectance),
                }
            }
            "twosided" => {
                let nested = self.nested(p, 1..=2)?;
                BsdfKind::TwoSided { front: nested[0], back: nested[nested.len() - 1] }
            }
            "mask" => {
                let opacity = self.scalar(p, "opacity", 0.5);
                BsdfKind::Mask { opacity, nested: self.nested(p, 1..=1)?[0] }
            }
            "bumpmap" => {
                let scale = p.float_or("scale", 1.0) as f32;
                let (height, nested) = self.texture_and_nested(p, ["map", "bumpmap"])?;
                BsdfKind::BumpMap { nested, height, scale }
            }
            "normalmap" => {
                let (normals, nested) = self.texture_and_nested(p, ["normalmap", "map"])?;
                BsdfKind::NormalMap { nested, normals }
            }
            "blendbsdf" => {
                let weight = self.scalar(p, "weight", 0.5);
                let nested = self.nested(p, 2..=2)?;
                BsdfKind::Blend { weight, a: nested[0], b: nested[1] }
            }
            "null" => BsdfKind::Null,
            _ => {
                let known: Vec<&str> = PLUGINS.iter().copied().chain(["null"]).collect();
                self.unknown_plugin(p, &known);
                return None;
            }
        })
    }

    fn tints(&mut self, p: &Props<'_>) -> (ColorDesc, ColorDesc) {
        (
            self.color(p, "specular_reflectance", 1.0, Reflectance),
            self.color(p, "specular_transmittance", 1.0, Reflectance),
        )
    }

    /// Nested materials, named or not, in the order of the file.
    fn nested(&mut self, p: &Props<'_>, wanted: std::ops::RangeInclusive<usize>) -> Option<Vec<BsdfId>> {
        let objects = p.objects();
        if !wanted.contains(&objects.len()) {
            let expected = match (*wanted.start(), *wanted.end()) {
                (1, 1) => "one nested <bsdf>".to_owned(),
                (a, b) if a == b => format!("{a} nested <bsdf>s"),
                (a, b) => format!("{a} or {b} nested <bsdf>s"),
            };
            let message = format!("`{}` needs {expected}, found {}", p.plugin, objects.len());
            self.push(
                Diagnostic::error("scene::nested-bsdf", message).at(p.span()).label(format!("expected {expected}")),
            );
            return None;
        }
        objects.into_iter().map(|o| self.bsdf(o)).collect::<Vec<_>>().into_iter().collect()
    }

    /// A texture of plain numbers (with or without one of the given names) and one material.
    fn texture_and_nested(
        &mut self,
        p: &Props<'_>,
        names: [&'static str; 2],
    ) -> Option<(crate::scene::TextureId, BsdfId)> {
        let mut texture = names.into_iter().find_map(|n| p.get_index(n));
        let mut nested = Vec::new();
        for object in p.objects() {
            match self.resolve(object) {
                Some(o) if self.node(o).tag == "texture" && texture.is_none() => texture = Some(object),
                Some(_) => nested.push(object),
                None => return None,
            }
        }
        let (Some(texture), &[nested]) = (texture, nested.as_slice()) else {
            p.error("scene::nested-bsdf", format!("`{}` needs one texture and one nested <bsdf>", p.plugin));
            return None;
        };
        let object = self.resolve(texture)?;
        let (texture, nested) = (self.texture(texture, object, true), self.bsdf(nested));
        Some((texture?, nested?))
    }

    fn roughness(&mut self, p: &Props<'_>) -> RoughnessDesc {
        let mut choices = vec![("beckmann", Distribution::Beckmann), ("ggx", Distribution::Ggx)];
        if let Some(node) = p.get("distribution")
            && node.attr("value").is_some_and(|a| matches!(a.value.as_str(), "phong" | "as"))
        {
            let d = Diagnostic::warning(
                "scene::replaced-distribution",
                "this distribution of normals is not supported: ggx is used",
            );
            self.push(d.at(node.span_of("value")));
            choices.extend([("phong", Distribution::Ggx), ("as", Distribution::Ggx)]);
        }
        let distribution = p.choice("distribution", &choices, Distribution::Beckmann);
        let sample_visible = p.boolean_or("sample_visible", true);
        if p.has("alpha") && (p.has("alpha_u") || p.has("alpha_v")) {
            p.error("scene::duplicate-property", "give either `alpha` or `alpha_u` and `alpha_v`");
        }
        let (u, v) = if p.has("alpha") { ("alpha", "alpha") } else { ("alpha_u", "alpha_v") };
        let alpha_u = self.scalar(p, u, 0.1);
        let alpha_v = self.scalar(p, v, 0.1);
        RoughnessDesc { distribution, alpha_u, alpha_v, sample_visible }
    }

    /// η and κ: by the name of a metal, or as given (a perfect mirror if nothing is given).
    fn metal(&mut self, p: &Props<'_>) -> (ColorDesc, ColorDesc) {
        let named = p.string("material").unwrap_or("none");
        let given = (self.optional_color(p, "eta", Reflectance), self.optional_color(p, "k", Reflectance));
        let Some((eta, k)) = conductors::find(named) else {
            if let Some(node) = p.get("material") {
                let expected = match nearest(named, conductors::names()) {
                    Some(near) => format!("a metal; did you mean `{near}`?"),
                    None => format!("one of: {}", conductors::names().collect::<Vec<_>>().join(", ")),
                };
                p.bad_value(node, "value", format!("unknown conductor `{named}`"), &expected);
            }
            return (ColorDesc::Constant(Rgb::BLACK), ColorDesc::Constant(Rgb::WHITE));
        };
        if named != "none" && (given.0.is_some() || given.1.is_some()) {
            p.error("scene::duplicate-property", "give either `material` or `eta` and `k`");
        }
        // 0.6: relative to what is outside.
        let outside = 1.0 / p.positive_or("ext_eta", 1.0) as f32;
        let relative = |c: ColorDesc| match c {
            ColorDesc::Constant(c) => ColorDesc::Constant(c * outside),
            texture => texture,
        };
        let or = |c: Option<ColorDesc>, table: [f32; 3]| relative(c.unwrap_or(ColorDesc::Constant(table.into())));
        (or(given.0, eta), or(given.1, k))
    }

    fn principled(&mut self, p: &Props<'_>) -> PrincipledDesc {
        let eta = match (p.float("eta"), p.float("specular")) {
            (Some(_), Some(_)) => {
                p.error("scene::duplicate-property", "give either `eta` or `specular`");
                1.5
            }
            (Some(eta), None) => eta,
            // Burley 2012: specular 0 … 1 is a reflectance of 0 … 0.08 at normal incidence.
            (None, specular) => 2.0 / (1.0 - (0.08 * specular.unwrap_or(0.5)).max(0.0).sqrt()) - 1.0,
        };
        p.ignore(&["main_specular_sampling_rate", "clearcoat_sampling_rate", "diffuse_reflectance_sampling_rate"]);
        PrincipledDesc {
            base_color: self.color(p, "base_color", 0.5, Reflectance),
            roughness: self.scalar(p, "roughness", 0.5),
            anisotropic: self.scalar(p, "anisotropic", 0.0),
            metallic: self.scalar(p, "metallic", 0.0),
            spec_trans: self.scalar(p, "spec_trans", 0.0),
            eta: eta as f32,
            spec_tint: self.scalar(p, "spec_tint", 0.0),
            sheen: self.scalar(p, "sheen", 0.0),
            sheen_tint: self.scalar(p, "sheen_tint", 0.0),
            flatness: self.scalar(p, "flatness", 0.0),
            clearcoat: self.scalar(p, "clearcoat", 0.0),
            clearcoat_gloss: self.scalar(p, "clearcoat_gloss", 0.0),
        }
    }
}
