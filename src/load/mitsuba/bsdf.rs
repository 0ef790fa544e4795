//! Materials: scattering models by the table of [`MODELS`], operators on other materials by [`OPERATORS`].

use super::conductors;
use super::objects::{Builder, FORCE};
use super::props::Props;
use super::spectrum::Purpose::Reflectance;
use super::values;
use crate::math::Rgb;
use crate::scene::diag::{Diagnostic, nearest};
use crate::scene::{
    BK7, BsdfDesc, BsdfId, BsdfKind, BsdfModel, CoatingDesc, ColorDesc, ComplexIor, DiffuseParams, Distribution,
    MODELS, ParamSource, Roughness, ScalarDesc, TextureDesc, TextureId, WardVariant,
};

/// Reads a plugin that combines or modifies other materials.
type ReadOperator = fn(&mut Builder<'_>, &Props<'_>) -> Option<BsdfKind>;

/// Most materials of a mixture.
const MAX_MIXED: usize = 8;

/// Plugins that combine or modify other materials.
const OPERATORS: [(&str, ReadOperator); 9] = [
    ("twosided", two_sided),
    ("mask", mask),
    ("bumpmap", bump_map),
    ("normalmap", normal_map),
    ("blendbsdf", blend),
    ("mixturebsdf", mixture),
    ("coating", coating),
    ("polarizer", polarizer),
    ("null", |_, _| Some(BsdfKind::Null)),
];

/// A plugin of old versions that is read as a supported one.
struct ReplacedPlugin {
    name: &'static str,
    replacement: &'static str,
    /// Properties without a counterpart in the replacement.
    ignored: &'static [&'static str],
}

const REPLACED: [ReplacedPlugin; 2] = [
    ReplacedPlugin { name: "roughdiffuse", replacement: "diffuse", ignored: &["alpha", "use_fast_approx"] },
    ReplacedPlugin { name: "difftrans", replacement: "diffuse", ignored: &["transmittance"] },
];

/// A second spelling of a property; it takes precedence where it is given.
struct PropertyAlias {
    plugin: &'static str,
    name: &'static str,
    alias: &'static str,
}

const ALIASES: [PropertyAlias; 3] = [
    PropertyAlias { plugin: "diffuse", name: "reflectance", alias: "diffuse_reflectance" },
    PropertyAlias { plugin: "ward", name: "alpha_u", alias: "alpha" },
    PropertyAlias { plugin: "ward", name: "alpha_v", alias: "alpha" },
];

/// Values of the property `variant` of the plugin `ward`.
const WARD_VARIANTS: [(&str, WardVariant); 3] =
    [("balanced", WardVariant::Balanced), ("ward", WardVariant::Ward), ("ward-duer", WardVariant::WardDuer)];

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
        let plugin = self.supported_plugin(props);
        if let Some(model) = MODELS.iter().find(|model| model.name == plugin) {
            let mut source = BsdfProps { builder: self, props, plugin };
            return Some(BsdfKind::Model((model.read)(&mut source)));
        }
        if let Some((_, read)) = OPERATORS.iter().find(|(name, _)| *name == plugin) {
            return read(self, props);
        }
        let models = MODELS.iter().map(|model| model.name);
        let known: Vec<&str> = models.chain(OPERATORS.iter().map(|(name, _)| *name)).collect();
        self.unknown_plugin(props, &known);
        None
    }

    /// The plugin's name, or that of its replacement, with a warning.
    fn supported_plugin<'p>(&mut self, props: &Props<'p>) -> &'p str {
        let Some(replaced) = REPLACED.iter().find(|r| r.name == props.plugin) else { return props.plugin };
        let message = format!("`{}` is not supported: `{}` is used instead", replaced.name, replaced.replacement);
        let d = Diagnostic::warning("scene::replaced-plugin", message).at(props.element().span_of("type"));
        self.push(d.changing_picture());
        props.ignore(replaced.ignored);
        replaced.replacement
    }

    /// A material that a plugin needs inside of its own.
    fn unnamed_bsdf(&mut self, kind: BsdfKind, props: &Props<'_>) -> BsdfId {
        self.scene.bsdfs.push(BsdfDesc { name: None, kind, span: Some(props.span()) });
        BsdfId((self.scene.bsdfs.len() - 1) as u32)
    }

    /// Nested materials, named or not, in the order of the file.
    fn nested(&mut self, p: &Props<'_>, wanted: std::ops::RangeInclusive<usize>) -> Option<Vec<BsdfId>> {
        let objects = p.objects();
        if !wanted.contains(&objects.len()) {
            let expected = match (*wanted.start(), *wanted.end()) {
                (1, 1) => "one nested <bsdf>".to_owned(),
                (a, b) if a == b => format!("{a} nested <bsdf>s"),
                (a, b) if a + 1 == b => format!("{a} or {b} nested <bsdf>s"),
                (a, b) => format!("{a} to {b} nested <bsdf>s"),
            };
            let message = format!("`{}` needs {expected}, found {}", p.plugin, objects.len());
            self.push(
                Diagnostic::error("scene::nested-bsdf", message).at(p.span()).label(format!("expected {expected}")),
            );
            return None;
        }
        objects.into_iter().map(|o| self.bsdf(o)).collect::<Vec<_>>().into_iter().collect()
    }

    /// A texture (with or without one of the given names) and one material.
    fn texture_and_nested(&mut self, p: &Props<'_>, names: [&'static str; 2]) -> Option<(TextureId, BsdfId)> {
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
        self.warn_of_decoding(object, p.plugin);
        let (texture, nested) = (self.texture(texture, object), self.bsdf(nested));
        Some((texture?, nested?))
    }
}

fn two_sided(builder: &mut Builder<'_>, props: &Props<'_>) -> Option<BsdfKind> {
    let nested = builder.nested(props, 1..=2)?;
    Some(BsdfKind::TwoSided { front: nested[0], back: nested[nested.len() - 1] })
}

fn mask(builder: &mut Builder<'_>, props: &Props<'_>) -> Option<BsdfKind> {
    let opacity = builder.scalar(props, "opacity", 0.5);
    Some(BsdfKind::Mask { opacity, nested: builder.nested(props, 1..=1)?[0] })
}

fn bump_map(builder: &mut Builder<'_>, props: &Props<'_>) -> Option<BsdfKind> {
    let scale = props.float_or("scale", 1.0) as f32;
    let (height, nested) = builder.texture_and_nested(props, ["map", "bumpmap"])?;
    if matches!(builder.scene.textures[height.index()], TextureDesc::MeshAttribute { .. }) {
        let message = "a `mesh_attribute` as the heights of a `bumpmap` is not supported";
        builder.push(Diagnostic::unsupported(message).at(props.span()).help(FORCE));
    }
    Some(BsdfKind::BumpMap { nested, height, scale })
}

fn normal_map(builder: &mut Builder<'_>, props: &Props<'_>) -> Option<BsdfKind> {
    let (normals, nested) = builder.texture_and_nested(props, ["normalmap", "map"])?;
    Some(BsdfKind::NormalMap { nested, normals })
}

fn blend(builder: &mut Builder<'_>, props: &Props<'_>) -> Option<BsdfKind> {
    let weight = builder.scalar(props, "weight", 0.5);
    let nested = builder.nested(props, 2..=2)?;
    Some(BsdfKind::Blend { weight, a: nested[0], b: nested[1] })
}

/// A mixture of Mitsuba 0.6, as nested blends of two: Σ wᵢ fᵢ. Light is lost where the weights do not reach one.
fn mixture(builder: &mut Builder<'_>, props: &Props<'_>) -> Option<BsdfKind> {
    let nested = builder.nested(props, 1..=MAX_MIXED)?;
    let weights = mixture_weights(props, nested.len())?;
    let black = BsdfModel::Diffuse(DiffuseParams { reflectance: ColorDesc::Constant(Rgb::BLACK) });
    // The mixture of the last materials, of the sum `total` of their weights, scaled to a sum of one.
    let (mut total, mut rest) =
        (1.0 - weights.iter().sum::<f64>().min(1.0), builder.unnamed_bsdf(BsdfKind::Model(black), props));
    for (i, (&weight, &a)) in weights.iter().zip(&nested).enumerate().rev() {
        let fraction = total / (total + weight);
        total += weight;
        let weight = ScalarDesc::Constant(if fraction.is_nan() { 0.0 } else { fraction as f32 });
        let blend = BsdfKind::Blend { weight, a, b: rest };
        if i == 0 {
            return Some(blend);
        }
        rest = builder.unnamed_bsdf(blend, props);
    }
    None
}

/// The property `weights` of a mixture of `count` materials; with a sum above one, they are scaled to a sum of one.
fn mixture_weights(props: &Props<'_>, count: usize) -> Option<Vec<f64>> {
    let Some(node) = props.get("weights") else {
        props.error("scene::missing-property", "`mixturebsdf` needs the property `weights`");
        return None;
    };
    let text = props.string("weights")?;
    let refused = |message: String| props.bad_value(node, "value", message, "numbers that are not negative");
    let weights = match values::numbers(&text.replace(';', " ")) {
        Ok(weights) => weights,
        Err(message) => {
            refused(message);
            return None;
        }
    };
    let total: f64 = weights.iter().sum();
    if weights.len() != count {
        refused(format!("{} weights for {count} materials", weights.len()));
    } else if weights.iter().any(|weight| *weight < 0.0) || total <= 0.0 {
        refused("weights of a mixture are not negative, and not all zero".into());
    } else {
        return Some(weights.iter().map(|weight| weight / total.max(1.0)).collect());
    }
    None
}

fn coating(builder: &mut Builder<'_>, props: &Props<'_>) -> Option<BsdfKind> {
    let eta = builder.relative_ior(props, BK7);
    let sigma_a = builder.color(props, "sigma_a", 0.0, Reflectance);
    let thickness = props.float_or("thickness", 1.0) as f32;
    if thickness < 0.0
        && let Some(node) = props.get("thickness")
    {
        props.bad_value(node, "value", format!("a thickness of {thickness}"), "a number that is not negative");
    }
    let specular_reflectance = builder.reflectance(props, "specular_reflectance", 1.0);
    let nested = builder.nested(props, 1..=1)?[0];
    Some(BsdfKind::Coating(CoatingDesc { nested, eta, sigma_a, thickness, specular_reflectance }))
}

/// A polarizer without polarization: as in Mitsuba's unpolarized variants it passes half of all light.
fn polarizer(builder: &mut Builder<'_>, props: &Props<'_>) -> Option<BsdfKind> {
    let message =
        "light has no polarization here: a `polarizer` passes half of all light, as in Mitsuba's `scalar_rgb`";
    let d = Diagnostic::warning("scene::replaced-plugin", message).at(props.element().span_of("type"));
    builder.push(d.changing_picture());
    props.ignore(&["theta", "polarizing"]);
    let ScalarDesc::Constant(transmittance) = builder.scalar(props, "transmittance", 1.0) else {
        props.unsupported("a `polarizer` with a texture as its `transmittance` is not supported");
        return None;
    };
    let black = BsdfModel::Diffuse(DiffuseParams { reflectance: ColorDesc::Constant(Rgb::BLACK) });
    let nested = builder.unnamed_bsdf(BsdfKind::Model(black), props);
    Some(BsdfKind::Mask { opacity: ScalarDesc::Constant(1.0 - 0.5 * transmittance), nested })
}

/// The properties of a plugin as parameters of a scattering model.
struct BsdfProps<'b, 'd, 'p, 't> {
    builder: &'b mut Builder<'d>,
    props: &'p Props<'t>,
    plugin: &'p str,
}

impl BsdfProps<'_, '_, '_, '_> {
    /// The spelling of a property that the file uses.
    fn spelling(&self, name: &'static str) -> &'static str {
        let alias = ALIASES.iter().find(|a| a.plugin == self.plugin && a.name == name).map(|a| a.alias);
        alias.filter(|alias| self.props.has(alias)).unwrap_or(name)
    }
}

impl ParamSource for BsdfProps<'_, '_, '_, '_> {
    fn color(&mut self, name: &'static str, default: f32) -> ColorDesc {
        self.builder.reflectance(self.props, self.spelling(name), default)
    }

    fn scalar(&mut self, name: &'static str, default: f32) -> ScalarDesc {
        self.builder.scalar(self.props, self.spelling(name), default)
    }

    fn flag(&mut self, name: &'static str, default: bool) -> bool {
        self.props.boolean_or(name, default)
    }

    fn relative_ior(&mut self, interior: f64) -> f32 {
        self.builder.relative_ior(self.props, interior)
    }

    fn principled_ior(&mut self) -> f32 {
        let p = self.props;
        let eta = match (p.float("eta"), p.float("specular")) {
            (Some(_), Some(_)) => {
                p.error("scene::duplicate-property", "give either `eta` or `specular`");
                1.5
            }
            (Some(eta), None) => eta,
            // Burley 2012: specular 0 … 1 is a reflectance of 0 … 0.08 at normal incidence.
            (None, specular) => 2.0 / (1.0 - (0.08 * specular.unwrap_or(0.5)).max(0.0).sqrt()) - 1.0,
        };
        eta as f32
    }

    /// By the name of a metal, or as given.
    fn complex_ior(&mut self) -> ComplexIor {
        let p = self.props;
        let named = p.string("material").unwrap_or("none");
        let given_eta = self.builder.optional_color(p, "eta", Reflectance);
        let given_k = self.builder.optional_color(p, "k", Reflectance);
        let Some((eta, k)) = conductors::find(named) else {
            if let Some(node) = p.get("material") {
                let expected = match nearest(named, conductors::names()) {
                    Some(near) => format!("a metal; did you mean `{near}`?"),
                    None => format!("one of: {}", conductors::names().collect::<Vec<_>>().join(", ")),
                };
                p.bad_value(node, "value", format!("unknown conductor `{named}`"), &expected);
            }
            return ComplexIor { eta: ColorDesc::Constant(Rgb::BLACK), k: ColorDesc::Constant(Rgb::WHITE) };
        };
        if named != "none" && (given_eta.is_some() || given_k.is_some()) {
            p.error("scene::duplicate-property", "give either `material` or `eta` and `k`");
        }
        // Mitsuba 0.6: relative to the index of the exterior.
        let outside = 1.0 / p.positive_or("ext_eta", 1.0) as f32;
        let relative = |c: ColorDesc| match c {
            ColorDesc::Constant(c) => ColorDesc::Constant(c * outside),
            texture => texture,
        };
        let or = |c: Option<ColorDesc>, table: [f32; 3]| relative(c.unwrap_or(ColorDesc::Constant(table.into())));
        ComplexIor { eta: or(given_eta, eta), k: or(given_k, k) }
    }

    fn roughness(&mut self) -> Roughness {
        let p = self.props;
        let mut choices = vec![("beckmann", Distribution::Beckmann), ("ggx", Distribution::Ggx)];
        if let Some(node) = p.get("distribution")
            && node.attr("value").is_some_and(|a| matches!(a.value.as_str(), "phong" | "as"))
        {
            let d = Diagnostic::warning(
                "scene::replaced-distribution",
                "this distribution of normals is not supported: ggx is used",
            );
            self.builder.push(d.at(node.span_of("value")).changing_picture());
            choices.extend([("phong", Distribution::Ggx), ("as", Distribution::Ggx)]);
        }
        let distribution = p.choice("distribution", &choices, Distribution::Beckmann);
        let sample_visible = p.boolean_or("sample_visible", true);
        if p.has("alpha") && (p.has("alpha_u") || p.has("alpha_v")) {
            p.error("scene::duplicate-property", "give either `alpha` or `alpha_u` and `alpha_v`");
        }
        let (u, v) = if p.has("alpha") { ("alpha", "alpha") } else { ("alpha_u", "alpha_v") };
        let alpha_u = self.builder.scalar(p, u, 0.1);
        let alpha_v = self.builder.scalar(p, v, 0.1);
        Roughness { distribution, alpha_u, alpha_v, sample_visible }
    }

    fn ward_variant(&mut self, name: &'static str, default: WardVariant) -> WardVariant {
        self.props.choice(name, &WARD_VARIANTS, default)
    }
}
