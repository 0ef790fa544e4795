//! Where it is known what light vertices bring, and what is known there.

use super::caches::Caches;
use super::combined::{CombinedPmfs, Draws};
use super::learnt::Learnt;
use super::pmfs::Pmfs;
use super::sites::Sites;
use crate::mis::{Targets, There};
use crate::ray::offset::SegmentEnd;

/// Places of one kind, with the probabilities of an iteration's light vertices there.
#[derive(Debug, Default)]
pub(super) enum Places {
    /// There are none yet.
    #[default]
    None,
    /// Cache points: probabilities of all light vertices together.
    Caches(Box<AtCaches>),
    /// Sites of importance caching: probabilities of the light vertices of each length, or of all together.
    Sites(Box<AtSites>),
}

/// What is known at cache points.
#[derive(Debug)]
pub(super) struct AtCaches {
    pub caches: Caches,
    pub pmfs: Pmfs,
}

/// What is known at sites of importance caching.
#[derive(Debug)]
pub(super) struct AtSites {
    pub sites: Sites,
    pub draws: Draws,
    pub combined: CombinedPmfs,
    /// What sites have found so far, if weights ask them.
    pub learnt: Learnt,
    /// Where sub-paths of each length are drawn from by themselves: the share of sub-paths that are as long.
    pub lengths: Vec<f32>,
}

impl AtSites {
    /// What there is at a place whose sites these are, where all light vertices are drawn from together, L of them from a sub-path.
    #[inline]
    pub fn there(&self, sites: &[usize], vertices_per_path: f64) -> There {
        let known = sites.iter().map(|&site| self.learnt.known(site)).sum::<f64>() / sites.len() as f64;
        // A node is reached by light of all directions, of which a surface takes the cosine.
        let all = vertices_per_path * self.sites.mean_cosine() / known;
        let scattered = if all.is_finite() { all as f32 } else { 0.0 };
        There { all: Targets { scattered, unscattered: 0.0 }, ..There::default() }
    }

    /// Share of light sub-paths with at least s vertices, as far as is known; never zero.
    pub fn share_of_length(&self, s: usize) -> f32 {
        let last = self.lengths.last().copied().unwrap_or(1.0);
        self.lengths.get(s).copied().unwrap_or(last)
    }
}

impl Places {
    /// A place's end of a shadow ray.
    #[inline]
    pub fn end(&self, place: usize) -> Option<&SegmentEnd> {
        match self {
            Places::None => None,
            Places::Caches(at) => Some(at.caches.end(place)),
            Places::Sites(at) => at.sites.ends.get(place),
        }
    }

    /// What there is, for people.
    pub fn note(&self) -> Option<String> {
        match self {
            Places::None => None,
            Places::Caches(at) => {
                Some(format!("{} cache points in {} groups", at.caches.index.len(), at.caches.groups.len()))
            }
            Places::Sites(at) => Some(at.sites.note()),
        }
    }

    /// Sums over iterations that must be saved to go on later, and the number of iterations behind them if it matters.
    pub fn state(&self) -> (Vec<f64>, u64) {
        match self {
            Places::None => (vec![], 0),
            Places::Caches(at) => {
                let (sums, iterations) = at.caches.state();
                (sums.as_flattened().to_vec(), iterations)
            }
            Places::Sites(at) => (at.learnt.state(), 0),
        }
    }

    /// Goes on from a saved state; false if it is of other places.
    pub fn restore(&mut self, sums: &[f64], iterations: u64) -> bool {
        match self {
            Places::None => false,
            Places::Caches(at) => {
                let (found, rest) = sums.as_chunks();
                rest.is_empty() && at.caches.restore(found.to_vec(), iterations)
            }
            Places::Sites(at) => at.learnt.restore(sums),
        }
    }
}
