//! The builder: what all plugin kinds share, above all references and what has been built already.

use super::document::{Node, Tree};
use super::plugins;
use super::props::Props;
use super::volume::SharedGrid;
use crate::load::assets::Assets;
use crate::load::paths::locate_or_warn;
use crate::load::report::Report;
use crate::scene::diag::{Diagnostic, nearest};
use crate::scene::{BsdfId, GroupId, MediumId, SceneDesc, Span, TextureId};
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

/// A chain of objects within objects longer than this is a mistake, if it is not a circle.
const MAX_CHAIN: usize = 64;

/// The way out of what is not supported.
pub(super) const FORCE: &str = "--force renders the scene without it";

/// Builds a scene from a tree.
pub(super) struct Builder<'t> {
    pub tree: &'t Tree,
    pub report: &'t RefCell<Report>,
    pub scene: SceneDesc,
    pub assets: Assets,
    pub bsdfs: HashMap<usize, Option<BsdfId>>,
    pub textures: HashMap<usize, Option<TextureId>>,
    pub groups: HashMap<usize, Option<GroupId>>,
    pub media: HashMap<usize, Option<MediumId>>,
    /// Grids by their files.
    pub grids: HashMap<PathBuf, Option<SharedGrid>>,
    /// Elements that a `<ref>` inside of another object names.
    pub referenced: HashSet<usize>,
    /// Shapes found so far inside of shapes that hold others.
    pub members: usize,
    /// Elements under construction, outermost first.
    open: Vec<usize>,
}

impl<'t> Builder<'t> {
    pub(super) fn new(tree: &'t Tree, report: &'t RefCell<Report>, assets: Assets) -> Builder<'t> {
        let in_scene: HashSet<usize> = tree.nodes[tree.root].children.iter().copied().collect();
        let refs = tree.nodes.iter().enumerate().filter(|(i, n)| n.tag == "ref" && !in_scene.contains(i));
        let names = refs.filter_map(|(_, n)| n.attr("id"));
        let referenced = names.filter_map(|id| tree.ids.get(&id.value).copied()).collect();
        Builder {
            tree,
            report,
            scene: SceneDesc::default(),
            assets,
            bsdfs: HashMap::new(),
            textures: HashMap::new(),
            groups: HashMap::new(),
            media: HashMap::new(),
            grids: HashMap::new(),
            referenced,
            members: 0,
            open: Vec::new(),
        }
    }

    pub(super) fn push(&self, d: Diagnostic) {
        self.report.borrow_mut().push(d);
    }

    pub(super) fn node(&self, index: usize) -> &'t Node {
        &self.tree.nodes[index]
    }

    pub(super) fn props(&self, node: usize) -> Option<Props<'t>> {
        Props::new(self.tree, node, self.report)
    }

    /// As [`Builder::resolve`], without a report.
    pub(super) fn referred(&self, index: usize) -> Option<usize> {
        let node = self.node(index);
        if node.tag == "ref" { self.tree.ids.get(&node.attr("id")?.value).copied() } else { Some(index) }
    }

    /// The object that an element is or, if it is a `<ref>`, names.
    pub(super) fn resolve(&self, index: usize) -> Option<usize> {
        let node = self.node(index);
        if node.tag != "ref" {
            return Some(index);
        }
        let Some(id) = node.attr("id") else {
            self.push(
                Diagnostic::error("scene::missing-attribute", "<ref> needs the attribute `id`").at(node.span.clone()),
            );
            return None;
        };
        let found = self.tree.ids.get(&id.value).copied();
        if found.is_none() {
            let mut d = Diagnostic::error("scene::undefined-reference", format!("nothing has the id `{}`", id.value))
                .at(id.span.clone());
            if let Some(near) = nearest(&id.value, self.tree.ids.keys().map(String::as_str)) {
                d = d.label(format!("did you mean `{near}`?"));
            }
            self.push(d);
        }
        found
    }

    /// Runs `build` for an object unless it is being built already, i.e. contains itself. `from` is the element that
    /// led here.
    pub(super) fn guarded<T>(
        &mut self,
        object: usize,
        from: usize,
        build: impl FnOnce(&mut Self) -> Option<T>,
    ) -> Option<T> {
        if self.open.contains(&object) || self.open.len() >= MAX_CHAIN {
            let id = self.node(object).attr("id").map_or("", |a| a.value.as_str());
            let d = Diagnostic::error("scene::circular-reference", format!("`{id}` contains itself"));
            self.push(d.at(self.node(from).span.clone()).label("this reference closes the circle"));
            return None;
        }
        self.open.push(object);
        let out = build(self);
        self.open.pop();
        out
    }

    /// Reports a plugin that does not exist, or that is refused.
    pub(super) fn unknown_plugin(&self, props: &Props<'_>, known: &[&str]) {
        let kind = &props.element().tag;
        if let Some(why) = plugins::refusal(kind, props.plugin) {
            let d = Diagnostic::unsupported(format!("the {kind} plugin `{}` is not supported: {why}", props.plugin));
            self.push(d.at(props.element().span_of("type")).help(FORCE));
            return;
        }
        let mut d = Diagnostic::error("scene::unknown-plugin", format!("unknown {kind} plugin `{}`", props.plugin))
            .at(props.element().span_of("type"))
            .help(format!("known {kind} plugins: {}", known.join(", ")));
        if let Some(near) = nearest(props.plugin, known.iter().copied()) {
            d = d.label(format!("did you mean `{near}`?"));
        }
        self.push(d);
    }

    /// The path and place of a file that a plugin names.
    pub(super) fn file(&self, props: &Props<'_>, name: &'static str) -> Option<(PathBuf, Span)> {
        if !props.has(name) {
            props.error(
                "scene::missing-property",
                format!("the {} plugin `{}` needs `{name}`", props.element().tag, props.plugin),
            );
            return None;
        }
        let text = props.string(name)?;
        let span = props.get(name)?.span_of("value");
        let path = locate_or_warn(&self.tree.folders, text, Some(&span), &mut self.report.borrow_mut());
        Some((path, span))
    }
}
