//! One element seen as a plugin with named properties. Every property that is asked for is remembered, so that in the
//! end those nobody asked for can be reported, with the nearest name that would have been known.

use super::document::{Node, OBJECT_TAGS, Tree};
use super::objects::FORCE;
use super::plugins;
use super::transform;
use super::values::{number, triple};
use crate::load::report::Report;
use crate::scene::Span;
use crate::scene::diag::{Diagnostic, nearest};
use glam::{DMat4, DVec3};
use std::cell::{Cell, RefCell};

/// A child element and whether anybody asked for it.
struct Item {
    name: Option<String>,
    node: usize,
    used: Cell<bool>,
}

/// A plugin's properties.
pub(super) struct Props<'t> {
    tree: &'t Tree,
    report: &'t RefCell<Report>,
    pub node: usize,
    pub plugin: &'t str,
    items: Vec<Item>,
    asked: RefCell<Vec<&'static str>>,
}

impl<'t> Props<'t> {
    /// The `type` of an element; an error is reported if it has none.
    pub(super) fn plugin_name(tree: &'t Tree, node: usize, report: &RefCell<Report>) -> Option<&'t str> {
        let element = &tree.nodes[node];
        let found = element.attr("type").map(|a| a.value.as_str());
        if found.is_none() {
            let d =
                Diagnostic::error("scene::missing-attribute", format!("<{}> needs the attribute `type`", element.tag));
            report.borrow_mut().push(d.at(element.span.clone()));
        }
        found
    }

    /// Looks at an element; properties given twice, without a name or with unknown attributes are reported.
    pub(super) fn new(tree: &'t Tree, node: usize, report: &'t RefCell<Report>) -> Option<Props<'t>> {
        let plugin = Props::plugin_name(tree, node, report)?;
        check_attributes(&tree.nodes[node], report);
        let mut items: Vec<Item> = Vec::new();
        for &child in &tree.nodes[node].children {
            let element = &tree.nodes[child];
            let name = element.attr("name").map(|a| a.value.clone());
            if name.is_none() && element.tag != "ref" && !OBJECT_TAGS.contains(&element.tag.as_str()) {
                let d = Diagnostic::error(
                    "scene::missing-attribute",
                    format!("<{}> needs the attribute `name`", element.tag),
                );
                report.borrow_mut().push(d.at(element.span.clone()));
                continue;
            }
            if !OBJECT_TAGS.contains(&element.tag.as_str()) {
                check_attributes(element, report);
            }
            let earlier = items.iter_mut().find(|i| name.is_some() && i.name == name);
            let Some(earlier) = earlier else {
                items.push(Item { name, node: child, used: Cell::new(false) });
                continue;
            };
            let message = format!("`{}` is given twice", name.as_deref().unwrap_or(""));
            let d = if element.legacy {
                // As in Mitsuba 0.6.
                earlier.node = child;
                Diagnostic::warning("scene::duplicate-property", message).label("this one holds")
            } else {
                Diagnostic::error("scene::duplicate-property", message)
            };
            report.borrow_mut().push(d.at(element.span_of("name")));
        }
        Some(Props { tree, report, node, plugin, items, asked: RefCell::default() })
    }

    /// The element itself.
    pub(super) fn element(&self) -> &'t Node {
        &self.tree.nodes[self.node]
    }

    pub(super) fn span(&self) -> Span {
        self.element().span.clone()
    }

    /// Reports an error about the whole plugin.
    pub(super) fn error(&self, code: &'static str, message: impl Into<String>) {
        self.report.borrow_mut().push(Diagnostic::error(code, message).at(self.span()));
    }

    /// Reports what is not supported of the whole plugin.
    pub(super) fn unsupported(&self, message: impl Into<String>) {
        self.report.borrow_mut().push(Diagnostic::unsupported(message).at(self.span()).help(FORCE));
    }

    /// The element that gives a property, if there is one.
    pub(super) fn get(&self, name: &'static str) -> Option<&'t Node> {
        self.get_index(name).map(|i| &self.tree.nodes[i])
    }

    pub(super) fn get_index(&self, name: &'static str) -> Option<usize> {
        self.asked.borrow_mut().push(name);
        let item = self.items.iter().find(|i| i.name.as_deref() == Some(name))?;
        item.used.set(true);
        Some(item.node)
    }

    pub(super) fn has(&self, name: &'static str) -> bool {
        self.get_index(name).is_some()
    }

    /// Declares a property that is understood and has no effect here.
    pub(super) fn ignore(&self, names: &[&'static str]) {
        for name in names {
            self.get_index(name);
        }
    }

    /// Nested objects and references that are not asked for by name: index of the element.
    pub(super) fn objects(&self) -> Vec<usize> {
        self.objects_that(|_| true)
    }

    /// As [`Props::objects`], those alone that are `wanted`.
    pub(super) fn objects_that(&self, wanted: impl Fn(usize) -> bool) -> Vec<usize> {
        let mut found = Vec::new();
        for item in self.items.iter().filter(|i| !i.used.get()) {
            let tag = self.tree.nodes[item.node].tag.as_str();
            if (tag == "ref" || OBJECT_TAGS.contains(&tag)) && wanted(item.node) {
                item.used.set(true);
                found.push(item.node);
            }
        }
        found
    }

    /// Reports that a property's element is of the wrong kind.
    pub(super) fn wrong_type(&self, node: &Node, expected: &str) {
        let name = node.attr("name").map_or("", |a| a.value.as_str());
        let d =
            Diagnostic::error("scene::wrong-type", format!("`{name}` is a <{}>, but {expected} is expected", node.tag));
        self.report.borrow_mut().push(d.at(node.span.clone()).label(format!("expected {expected}")));
    }

    pub(super) fn bad_value(&self, node: &Node, attr: &str, message: String, expected: &str) {
        let d =
            Diagnostic::error("scene::bad-value", message).at(node.span_of(attr)).label(format!("expected {expected}"));
        self.report.borrow_mut().push(d);
    }

    /// The text of the attribute `value`.
    pub(super) fn value_of(&self, node: &'t Node) -> Option<&'t str> {
        let found = node.attr("value");
        if found.is_none() {
            let d =
                Diagnostic::error("scene::missing-attribute", format!("<{}> needs the attribute `value`", node.tag));
            self.report.borrow_mut().push(d.at(node.span.clone()));
        }
        found.map(|a| a.value.as_str())
    }

    pub(super) fn float(&self, name: &'static str) -> Option<f64> {
        let node = self.get(name)?;
        if !matches!(node.tag.as_str(), "float" | "integer") {
            self.wrong_type(node, "a number");
            return None;
        }
        number(self.value_of(node)?).map_err(|m| self.bad_value(node, "value", m, "a number")).ok()
    }

    pub(super) fn float_or(&self, name: &'static str, default: f64) -> f64 {
        self.float(name).unwrap_or(default)
    }

    /// A number that must be above zero.
    pub(super) fn positive_or(&self, name: &'static str, default: f64) -> f64 {
        match self.float(name) {
            Some(v) if v > 0.0 => v,
            Some(v) => {
                if let Some(node) = self.get(name) {
                    self.bad_value(node, "value", format!("`{name}` must be positive, not {v}"), "a positive number");
                }
                default
            }
            None => default,
        }
    }

    pub(super) fn integer(&self, name: &'static str) -> Option<i64> {
        let node = self.get(name)?;
        if node.tag != "integer" {
            self.wrong_type(node, "an <integer>");
            return None;
        }
        let text = self.value_of(node)?.trim();
        text.parse()
            .map_err(|_| self.bad_value(node, "value", format!("`{text}` is not a whole number"), "a whole number"))
            .ok()
    }

    /// A whole number of 0 … 2^32 − 1.
    pub(super) fn count(&self, name: &'static str) -> Option<u32> {
        let value = self.integer(name)?;
        let found = u32::try_from(value).ok();
        if found.is_none()
            && let Some(node) = self.get(name)
        {
            self.bad_value(node, "value", format!("`{name}` cannot be {value}"), "a whole number from 0 to 4294967295");
        }
        found
    }

    pub(super) fn boolean_or(&self, name: &'static str, default: bool) -> bool {
        let Some(node) = self.get(name) else { return default };
        if node.tag != "boolean" {
            self.wrong_type(node, "a <boolean>");
            return default;
        }
        match self.value_of(node).map(str::trim) {
            Some("true" | "True" | "1") => true,
            Some("false" | "False" | "0") => false,
            Some(text) => {
                self.bad_value(node, "value", format!("`{text}` is neither true nor false"), "true or false");
                default
            }
            None => default,
        }
    }

    pub(super) fn string(&self, name: &'static str) -> Option<&'t str> {
        let node = self.get(name)?;
        if node.tag != "string" {
            self.wrong_type(node, "a <string>");
            return None;
        }
        self.value_of(node)
    }

    /// One of several words.
    pub(super) fn choice<T: Copy>(&self, name: &'static str, choices: &[(&str, T)], default: T) -> T {
        let Some(text) = self.string(name) else { return default };
        if let Some((_, value)) = choices.iter().find(|(word, _)| word.eq_ignore_ascii_case(text)) {
            return *value;
        }
        let words: Vec<&str> = choices.iter().map(|(w, _)| *w).collect();
        if let Some(node) = self.get(name) {
            self.bad_value(
                node,
                "value",
                format!("`{text}` is not a value of `{name}`"),
                &format!("one of: {}", words.join(", ")),
            );
        }
        default
    }

    /// A `<point>` or `<vector>`: `value="x, y, z"` or `x`, `y`, `z`.
    pub(super) fn vector(&self, name: &'static str) -> Option<DVec3> {
        let node = self.get(name)?;
        if !matches!(node.tag.as_str(), "point" | "vector") {
            self.wrong_type(node, "a <point> or <vector>");
            return None;
        }
        if let Some(value) = node.attr("value") {
            return triple(&value.value).map_err(|m| self.bad_value(node, "value", m, "three numbers")).ok();
        }
        let mut out = DVec3::ZERO;
        for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let Some(attr) = node.attr(axis) else {
                self.bad_value(node, "", format!("`{name}` lacks `{axis}`"), "x, y and z");
                return None;
            };
            out[i] = number(&attr.value).map_err(|m| self.bad_value(node, axis, m, "a number")).ok()?;
        }
        Some(out)
    }

    pub(super) fn transform(&self, name: &'static str) -> Option<DMat4> {
        let index = self.get_index(name)?;
        let node = &self.tree.nodes[index];
        if node.tag != "transform" {
            self.wrong_type(node, "a <transform>");
            return None;
        }
        Some(transform::transform(self.tree, index, self.report))
    }

    /// Reports what nobody asked for: an error if Mitsuba documents the property and it changes the picture, a warning
    /// if nobody knows it.
    pub(super) fn finish(&self) {
        let asked = self.asked.borrow();
        for item in self.items.iter().filter(|i| !i.used.get()) {
            let node = &self.tree.nodes[item.node];
            let name = item.name.as_deref().unwrap_or("");
            if let Some(unread) = plugins::unread(&self.element().tag, self.plugin, name) {
                if let Some(why) = unread.refusal(node.attr("value").map(|a| a.value.as_str())) {
                    let message = format!("the property `{name}` of `{}` is not supported: {why}", self.plugin);
                    let d = Diagnostic::unsupported(message).at(node.span_of("name"));
                    self.report.borrow_mut().push(d.help(FORCE));
                }
                continue;
            }
            let what = if name.is_empty() { format!("<{}>", node.tag) } else { format!("property `{name}`") };
            let mut d = Diagnostic::warning(
                "scene::unknown-property",
                format!("the plugin `{}` knows no {what}: ignored", self.plugin),
            )
            .at(node.span_of("name"));
            if let Some(near) = nearest(name, asked.iter().copied()) {
                d = d.label(format!("did you mean `{near}`?"));
            }
            self.report.borrow_mut().push(d);
        }
    }
}

/// Attributes that an element can have.
fn check_attributes(node: &Node, report: &RefCell<Report>) {
    let known: &[&str] = match node.tag.as_str() {
        "ref" => &["id", "name"],
        "transform" => &["name", "id"],
        "point" | "vector" => &["name", "value", "x", "y", "z"],
        "spectrum" => &["name", "value", "type", "id", "filename", "intent"],
        "rgb" | "srgb" => &["name", "value", "intent", "id"],
        "blackbody" => &["name", "value", "temperature", "scale"],
        "integer" | "float" | "string" | "boolean" => &["name", "value"],
        _ => &["type", "id", "name", "version"],
    };
    for attr in node.attrs.iter().filter(|a| !known.contains(&a.name.as_str())) {
        let mut d = Diagnostic::warning(
            "scene::unknown-attribute",
            format!("<{}> has no attribute `{}`: ignored", node.tag, attr.name),
        );
        d = d.at(attr.span.clone());
        if let Some(near) = nearest(&attr.name, known.iter().copied()) {
            d = d.label(format!("did you mean `{near}`?"));
        }
        report.borrow_mut().push(d);
    }
}
