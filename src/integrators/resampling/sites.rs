//! Places at which importance caching keeps probabilities: records on surfaces, or nodes in the middle of empty space.
//!
//! Records are the vertices of few eye sub-paths (Georgiev et al. 2012, "Importance caching for complex illumination"). Nodes are those of
//! the scene's skeleton (Noël and Biri 2015, "Skeleton based vertex connection resampling"); those that hardly any eye vertex
//! belongs to are left out, and eye vertices there draw uniformly (§4.4).

use super::caches::place;
use super::combined::DrawsFrom;
use super::store::direction_to;
use crate::math::{Rgb, Vec3};
use crate::path::Limits;
use crate::prepared::PreparedScene;
use crate::ray::offset::SegmentEnd;
use crate::ray::{PACKET, RayStats};
use crate::spatial::nearest::{MOST, Metric};
use crate::spatial::{NearestPoints, Skeleton, morton};
use std::ops::Range;

/// Eye sub-paths that tell which nodes are asked for.
const COUNTED: f64 = 4096.0;

/// The places.
#[derive(Debug)]
pub(super) struct Sites {
    /// Where shadow rays end; neighbours stand together.
    pub ends: Vec<SegmentEnd>,
    /// Unit normals of records, on the side that sees.
    pub normals: Option<Vec<Vec3>>,
    finder: Finder,
}

#[derive(Debug)]
enum Finder {
    Nearest(Box<NearestPoints>),
    Nodes {
        skeleton: Box<Skeleton>,
        /// For each node its number among the sites.
        sites: Vec<Option<usize>>,
    },
}

impl Sites {
    /// Records: the vertices of `fraction` times as many eye sub-paths as the picture has pixels.
    pub fn records(scene: &PreparedScene, seed: u64, fraction: f64, limits: &Limits) -> (Sites, RayStats) {
        let (mut all, _, stats) = place(scene, seed, fraction, limits);
        let positions: Vec<Vec3> = all.iter().map(|c| c.p).collect();
        all = morton::order(&positions).into_iter().map(|i| all[i as usize]).collect();
        let normals: Vec<Vec3> = all.iter().map(|c| c.side).collect();
        let index = NearestPoints::new(all.iter().map(|c| c.p).collect(), normals.clone(), Metric::Facing);
        let ends = all.iter().map(|c| SegmentEnd::Surface { p: c.p, error: c.error, ng: c.ng }).collect();
        (Sites { ends, normals: Some(normals), finder: Finder::Nearest(Box::new(index)) }, stats)
    }

    /// Nodes of the skeleton that more than `acceptance` times the mean number of eye vertices belong to.
    pub fn nodes(
        scene: &PreparedScene,
        seed: u64,
        cells: Option<usize>,
        acceptance: f64,
        limits: &Limits,
    ) -> (Sites, RayStats) {
        let skeleton = Box::new(Skeleton::of_scene(scene, cells));
        let pixels = f64::from(scene.film_size[0]) * f64::from(scene.film_size[1]);
        let (vertices, _, stats) = place(scene, seed, COUNTED / pixels, limits);
        let mut mapped = vec![0u32; skeleton.nodes.len()];
        for v in &vertices {
            if let Some(node) = skeleton.node_of(v.p, v.side) {
                mapped[node] += 1;
            }
        }
        let mean = mapped.iter().map(|&n| f64::from(n)).sum::<f64>() / mapped.len().max(1) as f64;
        let accepted: Vec<usize> = (0..mapped.len()).filter(|&n| f64::from(mapped[n]) > acceptance * mean).collect();
        let positions: Vec<Vec3> = accepted.iter().map(|&n| skeleton.nodes[n].position).collect();
        let order = morton::order(&positions);
        let mut sites = vec![None; skeleton.nodes.len()];
        for (site, &i) in order.iter().enumerate() {
            sites[accepted[i as usize]] = Some(site);
        }
        let ends = order.iter().map(|&i| SegmentEnd::Free(positions[i as usize])).collect();
        (Sites { ends, normals: None, finder: Finder::Nodes { skeleton, sites } }, stats)
    }

    /// Neighbours that share packets.
    pub fn groups(&self) -> impl Iterator<Item = Range<usize>> {
        let all = self.ends.len();
        (0..all.div_ceil(PACKET)).map(move |g| g * PACKET..all.min((g + 1) * PACKET))
    }

    /// The sites that know about the point `p` on the side `n`, at most `most`; returns their number.
    #[inline]
    pub fn find(&self, p: Vec3, n: Vec3, most: usize, found: &mut [usize; MOST]) -> usize {
        match &self.finder {
            Finder::Nearest(index) => {
                let mut count = 0;
                for i in index.find(p, n).take(most) {
                    found[count] = i;
                    count += 1;
                }
                count
            }
            Finder::Nodes { skeleton, sites } => match skeleton.node_of(p, n).and_then(|node| sites[node]) {
                Some(site) if most > 0 => {
                    found[0] = site;
                    1
                }
                _ => 0,
            },
        }
    }

    /// Mean cosine of the light that is counted at a site, as a surface there would take it.
    pub fn mean_cosine(&self) -> f64 {
        if self.normals.is_some() { 1.0 } else { 0.5 }
    }

    /// What of the flux at a light vertex at `p`, whose value for a direction is `value`, a site is reached by if nothing is in the way: ρ G at
    /// records; at nodes 1/d² and, unless that is to be as published, ρ.
    #[inline]
    pub fn reached(&self, site: usize, from: DrawsFrom, p: Vec3, value: impl Fn(Vec3) -> Rgb) -> Rgb {
        let at = self.ends[site].position();
        match &self.normals {
            Some(normals) => direction_to(p, at, normals[site]).map_or(Rgb::BLACK, |(to, spread)| value(to) * spread),
            None => {
                let to = at - p;
                let inverse = 1.0 / to.length_squared();
                if from == DrawsFrom::Mixture { value(to * inverse.sqrt()) * inverse } else { Rgb::grey(inverse) }
            }
        }
    }

    /// What there is, for people.
    pub fn note(&self) -> String {
        match &self.finder {
            Finder::Nearest(index) => format!("{} importance records", index.len()),
            Finder::Nodes { skeleton, sites } => {
                let used = sites.iter().flatten().count();
                format!("skeleton of {} nodes, {used} of them used", skeleton.nodes.len())
            }
        }
    }
}
