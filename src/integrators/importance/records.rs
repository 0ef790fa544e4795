//! The places at which importance caching keeps pmfs: records on surfaces, or nodes in the middle of empty space.
//!
//! Records are the vertices of few eye sub-paths, on surfaces and in media (Georgiev et al. 2012, "Importance caching for
//! complex illumination"). Nodes are those of the scene's skeleton (Noël and Biri 2015, "Skeleton based vertex connection
//! resampling"); those that hardly any eye vertex belongs to are left out, and eye vertices there draw uniformly (§4.4).

use super::record_pmfs::Selection;
use crate::bidir::WarmUp;
use crate::bidir::eye_vertices::EyeSubpathVertex;
use crate::bidir::vertex::direction_to;
use crate::math::{Rgb, Vec3};
use crate::ray::offset::SegmentEnd;
use crate::ray::{PACKET, RayStats};
use crate::skeleton::Skeleton;
use crate::spatial::nearest::{MAX_NEIGHBORS, Metric};
use crate::spatial::{NearestPoints, morton};
use std::ops::Range;

/// Eye sub-paths whose vertices are counted by node.
const COUNTED: f64 = 4096.0;

/// The records of a scene. Neighbours in space are neighbours in number.
#[derive(Debug)]
pub(super) struct ImportanceRecords {
    /// Where shadow rays end.
    pub ends: Vec<SegmentEnd>,
    /// Unit normals of records on surfaces, on the side that sees; zero in media.
    pub normals: Option<Vec<Vec3>>,
    finder: Finder,
}

/// Finds the records of an eye vertex.
#[derive(Debug)]
enum Finder {
    Nearest(Box<NearestPoints>),
    Nodes {
        skeleton: Box<Skeleton>,
        /// For each node its number among the records.
        records: Vec<Option<usize>>,
    },
}

impl ImportanceRecords {
    /// Records on surfaces: the vertices of `fraction` times as many eye sub-paths as the picture has pixels.
    pub fn on_surfaces(warm_up: &WarmUp, fraction: f64) -> (ImportanceRecords, RayStats) {
        let (found, stats) = warm_up.eye_vertices(fraction);
        let positions: Vec<Vec3> = found.vertices.iter().map(EyeSubpathVertex::position).collect();
        let all: Vec<_> = morton::order(&positions).into_iter().map(|i| found.vertices[i as usize]).collect();
        let normals: Vec<Vec3> = all.iter().map(|c| c.side).collect();
        let index =
            NearestPoints::new(all.iter().map(EyeSubpathVertex::position).collect(), normals.clone(), Metric::Facing);
        let ends = all.iter().map(|c| c.place.segment_end()).collect();
        let finder = Finder::Nearest(Box::new(index));
        (ImportanceRecords { ends, normals: Some(normals), finder }, stats)
    }

    /// The nodes of the skeleton that more than `acceptance` times the mean number of eye vertices belong to.
    pub fn at_nodes(warm_up: &WarmUp, cells: Option<usize>, acceptance: f64) -> (ImportanceRecords, RayStats) {
        let scene = warm_up.iteration.scene;
        let skeleton = Box::new(Skeleton::of_scene(scene, cells));
        let pixels = f64::from(scene.film_size[0]) * f64::from(scene.film_size[1]);
        let (found, stats) = warm_up.eye_vertices(COUNTED / pixels);
        let mut mapped = vec![0u32; skeleton.nodes.len()];
        for v in &found.vertices {
            if let Some(node) = skeleton.node_of(v.position(), v.side) {
                mapped[node] += 1;
            }
        }
        let mean = mapped.iter().map(|&n| f64::from(n)).sum::<f64>() / mapped.len().max(1) as f64;
        let accepted: Vec<usize> = (0..mapped.len()).filter(|&n| f64::from(mapped[n]) > acceptance * mean).collect();
        let positions: Vec<Vec3> = accepted.iter().map(|&n| skeleton.nodes[n].position).collect();
        let order = morton::order(&positions);
        let mut records = vec![None; skeleton.nodes.len()];
        for (record, &i) in order.iter().enumerate() {
            records[accepted[i as usize]] = Some(record);
        }
        let ends = order.iter().map(|&i| SegmentEnd::Free(positions[i as usize])).collect();
        (ImportanceRecords { ends, normals: None, finder: Finder::Nodes { skeleton, records } }, stats)
    }

    /// Neighbours that share packets.
    pub fn groups(&self) -> impl Iterator<Item = Range<usize>> {
        let all = self.ends.len();
        (0..all.div_ceil(PACKET)).map(move |g| g * PACKET..all.min((g + 1) * PACKET))
    }

    /// The records of the point `p` on the side of the unit normal `n`, at most `most`; returns their number.
    #[inline]
    pub fn find(&self, p: Vec3, n: Vec3, most: usize, found: &mut [usize; MAX_NEIGHBORS]) -> usize {
        match &self.finder {
            Finder::Nearest(index) => {
                let mut count = 0;
                for i in index.find(p, n).take(most) {
                    found[count] = i;
                    count += 1;
                }
                count
            }
            Finder::Nodes { skeleton, records } => match skeleton.node_of(p, n).and_then(|node| records[node]) {
                Some(record) if most > 0 => {
                    found[0] = record;
                    1
                }
                _ => 0,
            },
        }
    }

    /// Mean factor between the light that a record counts and the irradiance of a surface there. A node counts light of
    /// all directions without a cosine.
    pub fn mean_cosine(&self) -> f64 {
        if self.normals.is_some() { 1.0 } else { 0.5 }
    }

    /// The light at a record over the throughput of a light vertex at `p` with the adjoint BSDF value `value`,
    /// visibility taken for granted: ρ G at records on surfaces; at nodes ρ / d², or 1 / d² as published (Noël and Biri
    /// 2015, eq. 5).
    #[inline]
    pub fn unoccluded(&self, record: usize, selection: Selection, p: Vec3, value: impl Fn(Vec3) -> Rgb) -> Rgb {
        let at = self.ends[record].position();
        match &self.normals {
            Some(normals) => {
                direction_to(p, at, normals[record]).map_or(Rgb::BLACK, |(to, jacobian)| value(to) * jacobian)
            }
            None => {
                let to = at - p;
                let inverse = 1.0 / to.length_squared();
                // DEVIATION: the mixture counts ρ at nodes, too: light that the vertex does not send there need not be
                // drawn.
                if selection == Selection::Mixture { value(to * inverse.sqrt()) * inverse } else { Rgb::grey(inverse) }
            }
        }
    }

    /// A few words about the records, for people.
    pub fn note(&self) -> String {
        match &self.finder {
            Finder::Nearest(index) => format!("{} importance records", index.len()),
            Finder::Nodes { skeleton, records } => {
                let used = records.iter().flatten().count();
                format!("skeleton of {} nodes, {used} of them used", skeleton.nodes.len())
            }
        }
    }
}
