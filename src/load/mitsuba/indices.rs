//! Refractive indices of transparent materials by the names that Mitsuba uses (at the sodium D line, 589 nm).

use super::objects::Builder;
use super::props::Props;
use super::values::number;
use crate::scene::diag::nearest;

const NAMED: [(&str, f64); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.472_9),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.504_6),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

const AIR: f64 = 1.000_277;

impl Builder<'_> {
    /// `int_ior` / `ext_ior`, each a number or the name of a material.
    pub(super) fn relative_ior(&self, props: &Props<'_>, interior: f64) -> f32 {
        (ior(props, "int_ior", interior) / ior(props, "ext_ior", AIR)) as f32
    }
}

fn ior(props: &Props<'_>, name: &'static str, default: f64) -> f64 {
    let Some(node) = props.get(name) else { return default };
    if node.tag != "string" {
        return props.positive_or(name, default);
    }
    let Some(text) = props.value_of(node) else { return default };
    // Older files write spaces as underscores, or the number itself as a string.
    let wanted = text.trim().to_lowercase().replace('_', " ");
    if let Some((_, value)) = NAMED.iter().find(|(n, _)| *n == wanted) {
        return *value;
    }
    if let Ok(value) = number(&wanted)
        && value > 0.0
    {
        return value;
    }
    let names: Vec<&str> = NAMED.iter().map(|(n, _)| *n).collect();
    let expected = match nearest(&wanted, names.iter().copied()) {
        Some(near) => format!("a number or a material; did you mean `{near}`?"),
        None => format!("a number or one of: {}", names.join(", ")),
    };
    props.bad_value(node, "value", format!("unknown material `{text}`"), &expected);
    default
}
