//! XML text into a tree: spans, includes, `<default>` and `-D` parameters, aliases, ids, renaming of old spellings.

use super::encoding;
use super::limits::Usage;
use super::objects::FORCE;
use crate::image::{MAX_TEXT_BYTES, read_regular};
use crate::load::paths::locate_or_warn;
use crate::load::report::Report;
use crate::scene::Span;
use crate::scene::diag::{Diagnostic, Source, nearest};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// An attribute, its parameters substituted.
#[derive(Clone, Debug)]
pub(super) struct Attr {
    pub name: String,
    pub value: String,
    /// The value, without the quotes.
    pub span: Span,
}

/// An element.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub tag: String,
    pub attrs: Vec<Attr>,
    pub children: Vec<usize>,
    /// The start tag.
    pub span: Span,
    /// The file is older than version 2.
    pub legacy: bool,
}

impl Node {
    pub(super) fn attr(&self, name: &str) -> Option<&Attr> {
        self.attrs.iter().find(|a| a.name == name)
    }

    /// The span of an attribute's value, or of the element.
    pub(super) fn span_of(&self, attr: &str) -> Span {
        self.attr(attr).map_or_else(|| self.span.clone(), |a| a.span.clone())
    }
}

/// All elements of a scene, included files merged.
#[derive(Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub root: usize,
    /// By `id` and alias.
    pub ids: HashMap<String, usize>,
    /// Folders in which files are looked for, the scene's own first.
    pub folders: Vec<PathBuf>,
}

/// Elements nested deeper than this in one file are a mistake.
const MAX_DEPTH: usize = 64;

/// Elements that stand for plugins.
pub(super) const OBJECT_TAGS: [&str; 12] = [
    "bsdf",
    "texture",
    "shape",
    "emitter",
    "sensor",
    "film",
    "sampler",
    "rfilter",
    "integrator",
    "medium",
    "volume",
    "phase",
];
/// Elements that stand for values.
pub(super) const VALUE_TAGS: [&str; 12] = [
    "integer",
    "float",
    "string",
    "boolean",
    "rgb",
    "srgb",
    "spectrum",
    "blackbody",
    "point",
    "vector",
    "transform",
    "ref",
];
const OTHER_TAGS: [&str; 5] = ["scene", "default", "include", "alias", "path"];
const TRANSFORM_TAGS: [&str; 6] = ["translate", "rotate", "scale", "lookat", "matrix", "lookAt"];
/// Nested objects of old versions that hold nothing we use.
const SUBSURFACE: &str = "subsurface";

/// Reads the scene file; `None` if there is no tree to go on with.
pub(super) fn load(path: &Path, definitions: &[(String, String)], report: &mut Report) -> Option<Tree> {
    let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let mut loader = Loader {
        tree: Tree { nodes: Vec::new(), root: 0, ids: HashMap::new(), folders: vec![folder] },
        parameters: definitions.iter().map(|(k, v)| (k.clone(), (v.clone(), false))).collect(),
        open: Vec::new(),
        aliases: Vec::new(),
        usage: Usage::default(),
        exceeded: false,
        report,
    };
    loader.tree.root = loader.file(path, None)?;
    loader.resolve_aliases();
    for (name, _) in definitions {
        if let Some((_, false)) = loader.parameters.get(name) {
            loader.report.push(
                Diagnostic::warning(
                    "scene::unused-definition",
                    format!("the definition `{name}` (-D) is not used in the scene"),
                )
                .help(format!("a scene uses it as ${name}")),
            );
        }
    }
    Some(loader.tree)
}

struct Loader<'a> {
    tree: Tree,
    /// Value, and whether it was used.
    parameters: HashMap<String, (String, bool)>,
    /// Files being read, outermost first.
    open: Vec<PathBuf>,
    aliases: Vec<(Attr, Attr)>,
    usage: Usage,
    /// A limit is exceeded, which has been reported: nothing more is read.
    exceeded: bool,
    report: &'a mut Report,
}

/// Facts that all elements of a file share.
struct File<'a> {
    source: &'a Arc<Source>,
    legacy: bool,
}

impl Loader<'_> {
    /// Reads a file and returns its root element.
    fn file(&mut self, path: &Path, from: Option<&Span>) -> Option<usize> {
        let text = match read_regular(path, MAX_TEXT_BYTES) {
            Ok(bytes) => bytes,
            Err(e) => {
                let d = Diagnostic::error("load::io", format!("cannot read `{}`: {e}", path.display()));
                self.report.push_io(d.at(from.cloned()));
                return None;
            }
        };
        self.report.opened(path);
        let text = self.decoded(text, path, from)?;
        let source = Arc::new(Source { path: path.to_path_buf(), text });
        let identity = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        if self.open.contains(&identity) {
            let d = Diagnostic::error("scene::circular-include", format!("`{}` includes itself", path.display()));
            self.report.push(d.at(from.cloned()).label("included here again"));
            return None;
        }
        if let Some(at) = too_deep(&source.text) {
            let d = Diagnostic::error("scene::syntax", format!("elements are nested deeper than {MAX_DEPTH} levels"));
            self.report.push(d.at(Span { source, range: at..at + 1 }));
            return None;
        }
        let document = match roxmltree::Document::parse(&source.text) {
            Ok(document) => document,
            Err(e) => {
                let at = offset(&source.text, e.pos().row, e.pos().col);
                let span = Span { source: source.clone(), range: at..(at + 1).min(source.text.len()) };
                // The library ends its sentence with the position, which is shown anyway.
                let message = e.to_string();
                let message = message.split(" at ").next().unwrap_or(&message).to_owned();
                self.report
                    .push(Diagnostic::error("scene::syntax", format!("not well-formed XML: {message}")).at(span));
                return None;
            }
        };
        let root = document.root_element();
        let legacy = self.version(&root, &source);
        self.open.push(identity);
        let root = self.element(root, &File { source: &source, legacy });
        self.open.pop();
        root
    }

    /// The text of a file; `None` if its encoding is not known.
    fn decoded(&mut self, bytes: Vec<u8>, path: &Path, from: Option<&Span>) -> Option<String> {
        match encoding::decode(bytes) {
            Ok(decoded) => {
                if decoded.is_damaged {
                    let message = format!(
                        "`{}` is not {} throughout; unknown characters are replaced",
                        path.display(),
                        decoded.encoding
                    );
                    self.report.push(Diagnostic::warning("scene::not-utf8", message));
                }
                Some(decoded.text)
            }
            Err(label) => {
                let message = format!("`{}` is in the encoding `{label}`, which is not known", path.display());
                let d = Diagnostic::error("scene::unknown-encoding", message);
                self.report.push(d.at(from.cloned()).help("convert the file to UTF-8"));
                None
            }
        }
    }

    /// Reports that the scene exceeds a limit, the first time.
    fn exceed(&mut self, message: String, span: &Span) {
        if !std::mem::replace(&mut self.exceeded, true) {
            self.report.push(Diagnostic::error("scene::too-large", message).at(span.clone()));
        }
    }

    /// True for files older than version 2.
    fn version(&mut self, root: &roxmltree::Node<'_, '_>, source: &Arc<Source>) -> bool {
        let Some(attr) = root.attribute_node("version") else {
            let d = Diagnostic::warning("scene::no-version", "the scene does not say its version: taken as 3.0.0");
            self.report.push(d.at(start_tag(root, source)).help("write <scene version=\"3.0.0\">"));
            return false;
        };
        let major = attr.value().split('.').next().and_then(|v| v.trim().parse::<u32>().ok());
        if major.is_none() {
            let d = Diagnostic::error("scene::bad-value", format!("`{}` is not a version", attr.value()));
            self.report
                .push(d.at(Span { source: source.clone(), range: attr.range_value() }).label("expected e.g. 3.0.0"));
        }
        major.is_some_and(|m| m < 2)
    }

    /// Adds an element with all it holds; `None` if it leaves nothing in the tree.
    fn element(&mut self, xml: roxmltree::Node<'_, '_>, file: &File<'_>) -> Option<usize> {
        if self.exceeded {
            return None;
        }
        let span = start_tag(&xml, file.source);
        let tag = xml.tag_name().name();
        if !self.is_known(tag, &span) {
            return None;
        }
        let mut attrs = Vec::new();
        for a in xml.attributes() {
            let span = Span { source: file.source.clone(), range: a.range_value() };
            let mut value = self.substitute(a.value(), &span);
            if file.legacy && a.name() == "name" && tag != "default" {
                value = snake_case(&value);
            }
            attrs.push(Attr { name: a.name().to_owned(), value, span });
        }
        let mut node = Node { tag: tag.to_owned(), attrs, children: Vec::new(), span, legacy: file.legacy };
        if node.tag == "lookAt" {
            node.tag = "lookat".to_owned();
        }
        match tag {
            "default" => {
                if let Some([name, value]) = self.required(&node, ["name", "value"]) {
                    self.parameters.entry(name.value).or_insert((value.value, false));
                }
                return None;
            }
            "path" => {
                if let Some([value]) = self.required(&node, ["value"]) {
                    let folder = self.tree.folders[0].join(value.value);
                    self.tree.folders.push(folder);
                }
                return None;
            }
            "alias" => {
                if let Some([id, alias]) = self.required(&node, ["id", "as"]) {
                    self.aliases.push((id, alias));
                }
                return None;
            }
            _ => {}
        }
        if let Err(message) = self.usage.begin_element() {
            self.exceed(message, &node.span);
            return None;
        }
        for child in xml.children().filter(roxmltree::Node::is_element) {
            if child.tag_name().name() == "include" {
                self.include(child, file, &mut node);
            } else if let Some(child) = self.element(child, file) {
                node.children.push(child);
            }
        }
        self.usage.end_element();
        let index = self.tree.nodes.len();
        if node.tag != "ref" {
            self.register_id(&node, index);
        }
        self.tree.nodes.push(node);
        Some(index)
    }

    /// Reports an element that does not exist.
    fn is_known(&mut self, tag: &str, span: &Span) -> bool {
        let known = OBJECT_TAGS.iter().chain(&VALUE_TAGS).chain(&OTHER_TAGS).chain(&TRANSFORM_TAGS).copied();
        if known.clone().any(|k| k == tag) {
            return true;
        }
        let d = if tag == SUBSURFACE {
            Diagnostic::unsupported("subsurface scattering is not supported").help(FORCE)
        } else {
            let d = Diagnostic::error("scene::unknown-element", format!("unknown element <{tag}>"));
            match nearest(tag, known) {
                Some(near) => d.label(format!("did you mean <{near}>?")),
                None => d,
            }
        };
        self.report.push(d.at(span.clone()));
        false
    }

    /// Remembers the element `index` by its id, if it has one.
    fn register_id(&mut self, node: &Node, index: usize) {
        let Some(id) = node.attr("id").filter(|id| !id.value.is_empty()) else { return };
        if let Some(&other) = self.tree.ids.get(&id.value) {
            let line = self.tree.nodes[other].span.line_column().0;
            let d = Diagnostic::error("scene::duplicate-id", format!("the id `{}` is taken", id.value));
            self.report.push(d.at(id.span.clone()).label(format!("first used in line {line}")));
        } else {
            self.tree.ids.insert(id.value.clone(), index);
        }
    }

    /// Puts the contents of an included file in the place of `<include>`.
    fn include(&mut self, xml: roxmltree::Node<'_, '_>, file: &File<'_>, parent: &mut Node) {
        let span = start_tag(&xml, file.source);
        let Some(attr) = xml.attribute_node("filename") else {
            self.report.push(Diagnostic::error("scene::missing-attribute", "<include> needs a `filename`").at(span));
            return;
        };
        let name_span = Span { source: file.source.clone(), range: attr.range_value() };
        let name = self.substitute(attr.value(), &name_span);
        if let Err(message) = self.usage.include(self.open.len()) {
            self.exceed(message, &name_span);
        }
        if self.exceeded {
            return;
        }
        let path = locate_or_warn(&self.tree.folders, &name, Some(&name_span), self.report);
        if let Some(root) = self.file(&path, Some(&name_span)) {
            // A whole scene gives its contents; a lone element gives itself.
            if self.tree.nodes[root].tag == "scene" {
                parent.children.append(&mut self.tree.nodes[root].children);
            } else {
                parent.children.push(root);
            }
        }
    }

    fn required<const N: usize>(&mut self, node: &Node, names: [&str; N]) -> Option<[Attr; N]> {
        let found = names.map(|name| {
            if node.attr(name).is_none() {
                let d = Diagnostic::error(
                    "scene::missing-attribute",
                    format!("<{}> needs the attribute `{name}`", node.tag),
                );
                self.report.push(d.at(node.span.clone()));
            }
            node.attr(name).cloned()
        });
        let mut all = Vec::with_capacity(N);
        for attr in found {
            all.push(attr?);
        }
        all.try_into().ok()
    }

    /// Replaces every `$name` by its value.
    fn substitute(&mut self, text: &str, span: &Span) -> String {
        if !text.contains('$') {
            return text.to_owned();
        }
        let mut out = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            out.push_str(&rest[..at]);
            let after = &rest[at + 1..];
            let length = after.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(after.len());
            let name = &after[..length];
            if let Some((value, used)) = self.parameters.get_mut(name) {
                *used = true;
                match self.usage.substitute(out.len(), value.len()) {
                    Ok(()) => out.push_str(value),
                    Err(message) => {
                        self.exceed(message, span);
                        return out;
                    }
                }
            } else {
                let known: Vec<&str> = self.parameters.keys().map(String::as_str).collect();
                let mut d = Diagnostic::error(
                    "scene::undefined-parameter",
                    format!("the parameter `${name}` is not defined"),
                )
                .at(span.clone())
                .help(format!(
                    "define it with -D {name}=VALUE or <default name=\"{name}\" value=\"…\"/> before its first use"
                ));
                if let Some(near) = nearest(name, known) {
                    d = d.label(format!("did you mean `${near}`?"));
                }
                self.report.push(d);
            }
            rest = &after[length..];
        }
        out.push_str(rest);
        out
    }

    /// Aliases may name what stands later in the file.
    fn resolve_aliases(&mut self) {
        for (id, alias) in std::mem::take(&mut self.aliases) {
            match self.tree.ids.get(&id.value).copied() {
                None => {
                    let d =
                        Diagnostic::error("scene::undefined-reference", format!("nothing has the id `{}`", id.value));
                    self.report.push(d.at(id.span));
                }
                Some(_) if self.tree.ids.contains_key(&alias.value) => {
                    let d = Diagnostic::error("scene::duplicate-id", format!("the id `{}` is taken", alias.value));
                    self.report.push(d.at(alias.span));
                }
                Some(node) => {
                    self.tree.ids.insert(alias.value, node);
                }
            }
        }
    }
}

/// The start tag of an element, without what it encloses.
fn start_tag(xml: &roxmltree::Node<'_, '_>, source: &Arc<Source>) -> Span {
    let range = xml.range();
    // Quoted values may hold a `>`: look behind the last of them.
    let inside = xml.attributes().map(|a| a.range().end).max().unwrap_or(range.start);
    let end = source.text[inside..range.end].find('>').map_or(range.end, |i| inside + i + 1);
    Span { source: source.clone(), range: range.start..end }
}

/// Byte offset of a line and column (in characters, both from 1).
fn offset(text: &str, row: u32, column: u32) -> usize {
    let start: usize = text.split_inclusive('\n').take(row.saturating_sub(1) as usize).map(str::len).sum();
    let line = text[start..].lines().next().unwrap_or("");
    start + line.char_indices().nth(column.saturating_sub(1) as usize).map_or(line.len(), |(i, _)| i)
}

/// Where elements are nested too deep. Asked before parsing: the parser and all that follows call themselves for each
/// level.
fn too_deep(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let (mut depth, mut i) = (0usize, 0usize);
    while let Some(at) = text[i..].find('<').map(|k| i + k) {
        let skip = |end: &str| text[at..].find(end).map_or(text.len(), |k| at + k + end.len());
        if text[at..].starts_with("<!--") {
            i = skip("-->");
        } else if text[at..].starts_with("<![CDATA[") {
            i = skip("]]>");
        } else if matches!(bytes.get(at + 1), Some(b'?' | b'!')) {
            i = skip(">");
        } else if bytes.get(at + 1) == Some(&b'/') {
            depth = depth.saturating_sub(1);
            i = at + 2;
        } else {
            i = end_of_tag(bytes, at);
            if bytes.get(i.wrapping_sub(2)) != Some(&b'/') {
                depth += 1;
                if depth > MAX_DEPTH {
                    return Some(at);
                }
            }
            // Never inside a character: the tag ends behind an ASCII byte, or with the text.
        }
    }
    None
}

/// Behind the `>` of the tag that begins at `at`; quoted values may hold one.
fn end_of_tag(bytes: &[u8], at: usize) -> usize {
    let mut quote = None;
    for (i, &b) in bytes.iter().enumerate().skip(at) {
        match (quote, b) {
            (Some(q), b) if b == q => quote = None,
            (None, b'"' | b'\'') => quote = Some(b),
            (None, b'>') => return i + 1,
            _ => {}
        }
    }
    bytes.len()
}

/// `toWorld` → `to_world`, `intIOR` → `int_ior`.
fn snake_case(name: &str) -> String {
    let mut out = String::new();
    let mut previous = '_';
    for c in name.chars() {
        if c.is_ascii_uppercase() && previous.is_ascii_lowercase() {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
        previous = c;
    }
    out
}
