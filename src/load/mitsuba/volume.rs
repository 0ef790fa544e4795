//! Volumes: quantities of media that are constant or given on a grid.

use super::objects::Builder;
use super::props::Props;
use super::spectrum::Purpose::Reflectance;
use crate::math::Rgb;
use crate::scene::VolumeDesc;
use crate::scene::diag::Diagnostic;

const PLUGINS: [&str; 1] = ["constvolume"];

impl Builder<'_> {
    /// A quantity with values from zero to `largest`; `None` if it is not there or wrong.
    pub(super) fn volume(&mut self, p: &Props<'_>, name: &'static str, largest: f32) -> Option<VolumeDesc> {
        let from = p.get_index(name)?;
        let object = self.resolve(from)?;
        if self.node(object).tag == "volume" {
            return self.guarded(object, from, |b| {
                let volume = b.props(object)?;
                let desc = b.volume_plugin(&volume, name, largest);
                volume.finish();
                desc
            });
        }
        self.constant_volume(object, name, largest)
    }

    fn volume_plugin(&mut self, p: &Props<'_>, name: &str, largest: f32) -> Option<VolumeDesc> {
        if p.plugin != "constvolume" {
            self.unknown_plugin(p, &PLUGINS);
            return None;
        }
        // A constant is where it is everywhere.
        p.ignore(&["to_world"]);
        let Some(value) = p.get_index("value") else { return Some(VolumeDesc::Constant(Rgb::WHITE)) };
        let value = self.resolve(value)?;
        self.constant_volume(value, name, largest)
    }

    /// The number or colour that the element `object` stands for.
    fn constant_volume(&self, object: usize, name: &str, largest: f32) -> Option<VolumeDesc> {
        let node = self.node(object);
        let c = self.constant(node, Reflectance, "a number, colour or volume")?;
        if [c.r, c.g, c.b].iter().all(|v| (0.0..=largest).contains(v)) {
            return Some(VolumeDesc::Constant(c));
        }
        let message = format!("`{name}` has the value {}, {}, {}", c.r, c.g, c.b);
        let range =
            if largest < f32::MAX { format!("from 0 to {largest}") } else { "that are not negative".to_owned() };
        let d = Diagnostic::error("scene::bad-value", message).at(node.span_of("value"));
        self.push(d.label(format!("expected numbers {range}")));
        None
    }
}
