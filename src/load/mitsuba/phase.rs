//! Phase functions of media.

use super::objects::{Builder, FORCE};
use super::props::Props;
use crate::scene::PhaseDesc;
use crate::scene::diag::Diagnostic;

const PLUGINS: [&str; 4] = ["isotropic", "hg", "rayleigh", "blendphase"];

/// Mean cosine of `hg` where the file has none, as in Mitsuba.
const DEFAULT_G: f64 = 0.8;

impl Builder<'_> {
    /// The phase function that an element is or refers to.
    pub(super) fn phase(&mut self, from: usize) -> Option<PhaseDesc> {
        let object = self.resolve(from)?;
        let node = self.node(object);
        if node.tag != "phase" {
            let d = Diagnostic::error("scene::wrong-type", format!("a <{}> where a <phase> is expected", node.tag));
            self.push(d.at(self.node(from).span.clone()).label("expected a <phase>"));
            return None;
        }
        self.guarded(object, from, |b| {
            let p = b.props(object)?;
            let phase = b.phase_desc(&p)?;
            p.finish();
            Some(phase)
        })
    }

    fn phase_desc(&mut self, p: &Props<'_>) -> Option<PhaseDesc> {
        match p.plugin {
            "isotropic" => Some(PhaseDesc::Isotropic),
            "rayleigh" => Some(PhaseDesc::Rayleigh),
            "hg" => Some(PhaseDesc::HenyeyGreenstein { g: mean_cosine(p) }),
            "blendphase" => self.blended_phase(p),
            _ => {
                self.unknown_plugin(p, &PLUGINS);
                None
            }
        }
    }

    fn blended_phase(&mut self, p: &Props<'_>) -> Option<PhaseDesc> {
        let weight = match p.get_index("weight").and_then(|w| self.resolve(w)).map(|w| self.node(w)) {
            Some(node) if matches!(node.tag.as_str(), "volume" | "texture") => {
                let message = "a `weight` of a `blendphase` that changes from point to point is not supported";
                self.push(Diagnostic::unsupported(message).at(node.span.clone()).help(FORCE));
                0.5
            }
            _ => p.float_or("weight", 0.5),
        };
        if !(0.0..=1.0).contains(&weight)
            && let Some(node) = p.get("weight")
        {
            p.bad_value(node, "value", format!("a `weight` of {weight}"), "a number from 0 to 1");
        }
        let nested = self.nested_with_tag(p, "phase");
        let &[first, second] = nested.as_slice() else {
            let message = format!("a `blendphase` needs two nested <phase>s, found {}", nested.len());
            p.error("scene::nested-phase", message);
            return None;
        };
        let (first, second) = (self.phase(first), self.phase(second));
        let phases = [first?, second?];
        if phases.iter().any(|phase| matches!(phase, PhaseDesc::Blend { .. })) {
            p.unsupported("a `blendphase` of other `blendphase`s is not supported");
            return None;
        }
        Some(PhaseDesc::Blend { weight: weight as f32, phases: Box::new(phases) })
    }
}

/// `g`, which must be in (−1, 1) also in single precision.
fn mean_cosine(p: &Props<'_>) -> f32 {
    let g = p.float_or("g", DEFAULT_G) as f32;
    if g.abs() < 1.0 {
        return g;
    }
    if let Some(node) = p.get("g") {
        p.bad_value(node, "value", format!("a mean cosine `g` of {g}"), "a number between -1 and 1");
    }
    DEFAULT_G as f32
}
