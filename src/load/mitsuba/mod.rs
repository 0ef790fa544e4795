//! Mitsuba's XML scene format in its 0.6, 2.x and 3.x spellings.
//!
//! Three steps: `document` reads the text (and included files) into a tree with source spans, parameters substituted
//! and old spellings renamed; `props` looks at one element as a plugin with named properties, and knows which of them
//! nobody asked for; the other files build what the plugins describe.

mod bsdf;
mod cie;
mod color;
mod conductors;
mod document;
mod emitter;
mod encoding;
mod indices;
mod integrator;
mod limits;
mod medium;
mod medium_presets;
mod objects;
mod phase;
mod plugins;
mod props;
mod sensor;
mod shape;
mod spectrum;
mod sun;
mod texture;
mod transform;
mod values;
mod volume;

use super::LoadOptions;
use super::assets::Assets;
use super::report::Report;
use crate::scene::SceneDesc;
use crate::scene::diag::Diagnostic;
use objects::Builder;
use std::cell::RefCell;
use std::path::Path;

pub(super) use transform::look_at;

/// Elements that may stand directly in a scene.
const TOP_LEVEL: [&str; 14] = [
    "integrator",
    "sensor",
    "film",
    "sampler",
    "rfilter",
    "bsdf",
    "texture",
    "shape",
    "emitter",
    "medium",
    "volume",
    "phase",
    "ref",
    "spectrum",
];

/// Reads the file and everything it names.
pub(super) fn load(path: &Path, options: &LoadOptions, report: &mut Report) -> Option<SceneDesc> {
    let tree = document::load(path, &options.definitions, report)?;
    let shared = RefCell::new(std::mem::take(report));
    let mut builder = Builder::new(&tree, &shared, Assets::new(options.strict));
    builder.scene();
    let Builder { mut scene, assets, .. } = builder;
    *report = shared.into_inner();
    // Meshes are the expensive part: do not read them for a scene that is lost already.
    if report.has_errors() {
        assets.check_files_exist(report);
    } else {
        assets.decode(&mut scene, report);
    }
    Some(scene)
}

impl Builder<'_> {
    fn scene(&mut self) {
        let root = self.tree.root;
        for &child in &self.tree.nodes[root].children {
            if self.report.borrow().full() {
                return;
            }
            let node = &self.tree.nodes[child];
            match node.tag.as_str() {
                "integrator" => self.integrator(child),
                "sensor" => {
                    if let Some(sensor) = self.sensor(child) {
                        self.scene.sensors.push(sensor);
                    }
                }
                "shape" => self.shape(child),
                "emitter" => self.emitter(child),
                // Built when something refers to them; those that nobody uses are still checked below.
                "bsdf" | "texture" | "film" | "sampler" | "rfilter" => {}
                "ref" => self.reference(child),
                // Without effect where nothing refers to them.
                "medium" | "volume" | "phase" | "spectrum" => {}
                tag => {
                    let d = Diagnostic::error(
                        "scene::misplaced-element",
                        format!("<{tag}> has no place directly in a scene"),
                    )
                    .at(node.span.clone());
                    self.push(d.help(format!("expected one of: {}", TOP_LEVEL.join(", "))));
                }
            }
        }
        // Whatever was declared and not used is checked as well: a slip in it should not wait for its first use.
        for &child in &self.tree.nodes[root].children {
            if self.report.borrow().full() {
                return;
            }
            match self.tree.nodes[child].tag.as_str() {
                "bsdf" => drop(self.bsdf(child)),
                "film" => drop(self.film(child)),
                "sampler" => drop(self.sampler(child)),
                "rfilter" => drop(self.filter(child)),
                _ => {}
            }
        }
    }

    /// A `<ref>` directly in the scene: the object is a part of the scene as if it stood here. One that stands directly
    /// in the scene is a part of it once, except for emitters, which shine twice then, as in Mitsuba 3.
    fn reference(&mut self, node: usize) {
        let Some(object) = self.resolve(node) else { return };
        let is_part = self.tree.nodes[self.tree.root].children.contains(&object);
        let element = self.node(object);
        match element.tag.as_str() {
            "shape" if !is_part => self.shape(object),
            "integrator" if !is_part => self.integrator(object),
            // An area light without a shape shines nowhere.
            "emitter" if element.attr("type").is_none_or(|a| a.value != "area") => self.emitter(object),
            // Everything else has an effect only where something refers to it.
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
