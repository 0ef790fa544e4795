//! The `<integrator>` of a scene: a name and parameters, which the renderer resolves.

use super::objects::{Builder, FORCE};
use super::plugins;
use super::props::Props;
use crate::scene::IntegratorDesc;
use crate::scene::diag::Diagnostic;

/// Integrators with the expectation of `path` (without media): other ways to sample it, or to differentiate it.
const LIKE_PATH: [&str; 16] = [
    "volpath",
    "volpathmis",
    "prb",
    "prb_basic",
    "prb_projective",
    "prbvolpath",
    "volpath_simple",
    "mlt",
    "pssmlt",
    "erpt",
    "photonmapper",
    "ppm",
    "sppm",
    "vpl",
    "irrcache",
    "adaptive",
];
/// Integrators that render what a nested one does, and more layers or with other statistics.
const WRAPPERS: [&str; 5] = ["aov", "moment", "multichannel", "irrcache", "adaptive"];

impl Builder<'_> {
    pub(super) fn integrator(&mut self, node: usize) {
        let element = self.node(node);
        let Some(name) = Props::plugin_name(self.tree, node, self.report) else { return };
        let nested = element.children.iter().find(|&&c| self.node(c).tag == "integrator");
        if let Some(&nested) = nested.filter(|_| WRAPPERS.contains(&name)) {
            if matches!(name, "aov" | "moment" | "multichannel") {
                let message = format!("the layers of `{name}` are not written: see --aov");
                self.push(Diagnostic::warning("scene::layers", message).at(element.span_of("type")).changing_picture());
            }
            self.integrator(nested);
            return;
        }
        let refused = plugins::refusal("integrator", name).map(|why| {
            let message = format!("the integrator plugin `{name}` is not supported: {why}");
            self.report.borrow().graded(Diagnostic::unsupported(message).at(element.span_of("type")).help(FORCE))
        });
        let mut params: Vec<_> = element.children.iter().filter_map(|&child| self.parameter(name, child)).collect();
        // Direct light only: paths of at most two edges.
        if matches!(name, "direct" | "direct_projective") {
            params.push(("max_depth".into(), "2".into(), None));
        }
        let like_path = LIKE_PATH.contains(&name) || name.starts_with("direct");
        let name = if like_path { "path" } else { name };
        let span = Some(element.span.clone());
        self.scene.integrator = Some(IntegratorDesc { name: name.to_owned(), params, refused, span });
    }

    /// A parameter of the integrator `plugin` with its value, unless it is ignored or refused.
    fn parameter(&self, plugin: &str, node: usize) -> Option<(String, String, Option<crate::scene::Span>)> {
        let child = self.node(node);
        let (name, value) = (child.attr("name")?, child.attr("value")?);
        if let Some(unread) = plugins::unread("integrator", plugin, &name.value) {
            if let Some(why) = unread.refusal(Some(&value.value)) {
                let message = format!("the property `{}` of `{plugin}` is not supported: {why}", name.value);
                self.push(Diagnostic::unsupported(message).at(name.span.clone()).help(FORCE));
            }
            return None;
        }
        Some((name.value.clone(), value.value.clone(), Some(value.span.clone())))
    }
}
