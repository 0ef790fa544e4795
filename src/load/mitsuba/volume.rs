//! Volumes: quantities of media that are constant or given on a grid.

use super::objects::{Builder, FORCE};
use super::props::Props;
use super::spectrum::Purpose::Reflectance;
use crate::load::vol::{LoadedGrid, VolError, read_vol};
use crate::math::Rgb;
use crate::scene::diag::Diagnostic;
use crate::scene::{GridDesc, Span, VolumeDesc, VolumeFilter, VolumeGrid, VolumeWrap};
use glam::{DMat4, DVec3};
use std::path::PathBuf;
use std::sync::Arc;

const PLUGINS: [&str; 2] = ["constvolume", "gridvolume"];

/// A grid that was read, shared by all volumes that name its file.
#[derive(Clone)]
pub(super) struct SharedGrid {
    grid: Arc<VolumeGrid>,
    bounds: [DVec3; 2],
    largest: f32,
}

/// A quantity and its largest value.
pub(super) struct Volume {
    pub desc: VolumeDesc,
    pub largest: f32,
}

/// A quantity that a medium needs.
#[derive(Clone, Copy)]
pub(super) struct Quantity {
    pub name: &'static str,
    /// Values go from zero to here.
    pub largest: f32,
}

impl Volume {
    /// A quantity that is the same everywhere.
    pub(super) fn constant(value: Rgb) -> Volume {
        Volume { desc: VolumeDesc::Constant(value), largest: value.max_component() }
    }
}

impl Builder<'_> {
    /// The quantity of a property; `None` if it is not there or wrong.
    pub(super) fn volume(&mut self, p: &Props<'_>, quantity: Quantity) -> Option<Volume> {
        let from = p.get_index(quantity.name)?;
        let object = self.resolve(from)?;
        if self.node(object).tag == "volume" {
            return self.guarded(object, from, |b| {
                let volume = b.props(object)?;
                let desc = b.volume_plugin(&volume, quantity);
                volume.finish();
                desc
            });
        }
        self.constant_volume(object, quantity)
    }

    fn volume_plugin(&mut self, p: &Props<'_>, quantity: Quantity) -> Option<Volume> {
        match p.plugin {
            "constvolume" => {
                // A constant is the same everywhere.
                p.ignore(&["to_world"]);
                let Some(value) = p.get_index("value") else {
                    return Some(Volume::constant(Rgb::WHITE));
                };
                let value = self.resolve(value)?;
                self.constant_volume(value, quantity)
            }
            "gridvolume" => self.grid_volume(p, quantity),
            _ => {
                self.unknown_plugin(p, &PLUGINS);
                None
            }
        }
    }

    /// The number or colour that the element `object` stands for.
    fn constant_volume(&self, object: usize, Quantity { name, largest }: Quantity) -> Option<Volume> {
        let node = self.node(object);
        let c = self.constant(node, Reflectance, "a number, colour or volume")?;
        if [c.r, c.g, c.b].iter().all(|v| (0.0..=largest).contains(v)) {
            return Some(Volume::constant(c));
        }
        let message = format!("`{name}` has the value {}, {}, {}", c.r, c.g, c.b);
        let range =
            if largest < f32::MAX { format!("from 0 to {largest}") } else { "that are not negative".to_owned() };
        let d = Diagnostic::error("scene::bad-value", message).at(node.span_of("value"));
        self.push(d.label(format!("expected numbers {range}")));
        None
    }

    fn grid_volume(&mut self, p: &Props<'_>, quantity: Quantity) -> Option<Volume> {
        let legacy = p.element().legacy;
        let filters = [("trilinear", VolumeFilter::Trilinear), ("nearest", VolumeFilter::Nearest)];
        let filter = p.choice("filter_type", &filters, VolumeFilter::Trilinear);
        let wraps = [("clamp", VolumeWrap::Clamp), ("repeat", VolumeWrap::Repeat), ("mirror", VolumeWrap::Mirror)];
        let wrap = p.choice("wrap_mode", &wraps, VolumeWrap::Clamp);
        // Values of three channels are RGB in any case.
        p.boolean_or("raw", false);
        let to_world = p.transform("to_world").unwrap_or(DMat4::IDENTITY);
        let (corners, in_bounds) = (legacy_corners(p), p.boolean_or("use_grid_bbox", false));
        let (path, span) = self.file(p, "filename")?;
        let SharedGrid { grid, bounds, largest } = self.grid(path, &span)?;
        if largest > quantity.largest {
            let message = format!("the largest value of the grid is {largest}, and `{}` ends at 1", quantity.name);
            self.push(Diagnostic::error("load::volume", message).at(span));
            return None;
        }
        let box_to_world = to_world * unit_cube_to(corners.unwrap_or(bounds));
        let (to_world, wrap) = match (legacy, in_bounds) {
            (true, _) => (box_to_world * samples_to_corners(p, grid.size)?, VolumeWrap::Empty),
            (false, true) => (box_to_world, wrap),
            (false, false) => (to_world, wrap),
        };
        Some(Volume { desc: VolumeDesc::Grid(GridDesc { grid, to_world, filter, wrap }), largest })
    }

    /// The grid of a file, which is read once.
    fn grid(&mut self, path: PathBuf, span: &Span) -> Option<SharedGrid> {
        if let Some(done) = self.grids.get(&path) {
            return done.clone();
        }
        let read = read_vol(&path);
        self.report.borrow_mut().opened(&path);
        let shared = match read {
            Ok(LoadedGrid { grid, bounds, largest }) => Some(SharedGrid { grid: Arc::new(grid), bounds, largest }),
            Err(e) => {
                let message = format!("cannot read the volume `{}`: {e}", path.display());
                let d = Diagnostic::error("load::volume", message.clone()).at(span.clone());
                match e {
                    VolError::Io(_) => self.report.borrow_mut().push_io(d),
                    VolError::Bad(_) => self.push(d),
                    VolError::Unsupported(_) => {
                        self.push(Diagnostic::unsupported(message).at(span.clone()).help(FORCE));
                    }
                }
                None
            }
        };
        self.grids.insert(path, shared.clone());
        shared
    }
}

/// The box of Mitsuba 0.6's `min` and `max`, which replaces that of the file if both are there.
fn legacy_corners(p: &Props<'_>) -> Option<[DVec3; 2]> {
    if !p.element().legacy {
        return None;
    }
    let (lower, upper) = (p.vector("min"), p.vector("max"));
    Some([lower?, upper?])
}

/// [0, 1]³ → a box.
fn unit_cube_to([lower, upper]: [DVec3; 2]) -> DMat4 {
    DMat4::from_translation(lower) * DMat4::from_scale(upper - lower)
}

/// In Mitsuba 0.6 the outermost samples are in the corners of the box, not in the middle of cells. The unit cube of a
/// grid is larger than the box by half a cell on each side then. `None`, with a message, if samples do not span a box.
fn samples_to_corners(p: &Props<'_>, size: [u32; 3]) -> Option<DMat4> {
    let size = DVec3::from_array(size.map(f64::from));
    if size.min_element() < 2.0 {
        p.error("scene::bad-value", "a `gridvolume` of version 0.6 needs two samples along each axis");
        return None;
    }
    let intervals = size - DVec3::ONE;
    Some(DMat4::from_scale(size / intervals) * DMat4::from_translation(-0.5 / size))
}
