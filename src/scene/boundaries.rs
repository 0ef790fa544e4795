//! Are the boundaries of media closed? A path that leaves a medium through a gap goes on as if it were still inside.

use super::desc::{MediumId, SceneDesc, ShapeDesc, ShapeGeometry};
use super::diag::{Diagnostic, Diagnostics};
use super::medium::InterfaceDesc;
use crate::math::DVec3;
use crate::scene::RoundKind;
use std::collections::HashMap;

/// Vertices that are nearer to each other than this fraction of the boundary's size are one.
const WELD: f64 = 1e-6;

/// Warns of media whose boundary has free edges: edges that belong to one of its triangles alone.
pub(super) fn media(scene: &SceneDesc, out: &mut Diagnostics) {
    for medium in (0..scene.media.len() as u32).map(MediumId) {
        let bounds = |shape: &&ShapeDesc| shape.interface.is_some_and(|interface| separates(interface, medium));
        // A group is closed, or is not, wherever its instances are.
        let groups = scene.groups.iter().map(|group| group.shapes.as_slice());
        let places = std::iter::once(scene.shapes.as_slice()).chain(groups);
        let free: usize = places
            .map(|shapes| {
                let mut boundary = Boundary::default();
                shapes.iter().filter(bounds).for_each(|shape| boundary.add(scene, shape));
                boundary.free_edges()
            })
            .sum();
        if free > 0 {
            let message = format!("the boundary of a medium is open: {free} of its edges belong to one triangle alone");
            let help = "paths that leave it through a gap stay in the medium, unless other surfaces close it";
            let span = scene.media[medium.index()].span.clone();
            out.push(Diagnostic::warning("scene::open-boundary", message).at(span).help(help));
        }
    }
}

/// The medium is on one side of the surface alone.
fn separates(interface: InterfaceDesc, medium: MediumId) -> bool {
    (interface.interior == Some(medium)) != (interface.exterior == Some(medium))
}

/// The triangles around a medium.
#[derive(Default)]
struct Boundary {
    corners: Vec<[DVec3; 3]>,
    /// Round shapes that do not close by themselves count as this many free edges.
    open_round: usize,
}

impl Boundary {
    fn add(&mut self, scene: &SceneDesc, shape: &ShapeDesc) {
        match shape.geometry {
            ShapeGeometry::Round(RoundKind::Sphere) => {}
            ShapeGeometry::Round(RoundKind::Disk) => self.open_round += 1,
            ShapeGeometry::Round(RoundKind::Cylinder) => self.open_round += 2,
            ShapeGeometry::Mesh(mesh) => {
                let Some(mesh) = scene.meshes.get(mesh.index()) else { return };
                let corner =
                    |v: u32| mesh.positions.get(v as usize).map(|p| shape.to_world.transform_point3(p.as_dvec3()));
                let sound = mesh.triangles.iter().filter_map(|t| Some([corner(t[0])?, corner(t[1])?, corner(t[2])?]));
                self.corners.extend(sound);
            }
        }
    }

    /// Edges that belong to one triangle alone, and those of open round shapes.
    fn free_edges(&self) -> usize {
        let corners = self.corners.iter().flatten();
        let (lo, hi) =
            corners.clone().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        let scale = 1.0 / (WELD * (hi - lo).length());
        let mut numbers = HashMap::new();
        let mut number = |p: &DVec3| {
            let cell = ((*p - lo) * scale).round().to_array().map(|v| v as i64);
            let next = numbers.len();
            *numbers.entry(cell).or_insert(next)
        };
        let mut triangles = HashMap::new();
        for triangle in &self.corners {
            let [a, b, c] = [0, 1, 2].map(|i| number(&triangle[i]));
            for (from, to) in [(a, b), (b, c), (c, a)] {
                // Triangles without area have edges of no length.
                if from != to {
                    *triangles.entry((from.min(to), from.max(to))).or_insert(0usize) += 1;
                }
            }
        }
        self.open_round + triangles.values().filter(|count| **count == 1).count()
    }
}
