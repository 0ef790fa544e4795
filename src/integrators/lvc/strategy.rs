//! Connections to stored light vertices, drawn uniformly.
//!
//! Each of C draws takes one of V stored vertices of M light sub-paths with the probability 1/V. A connection to the
//! prefix ȳ that ends there is estimated by f / (C M p(ȳ) p(z̄) / V).

use crate::bidir::{Candidate, ConnectionStrategy, EyeVertex, LightSubpaths, VertexCount, VertexStore, WarmUp};
use crate::math::sampler::{PathSampler, SampleSlot, systematic};
use crate::math::{Rgb, Vec3};
use crate::mis::factors::UniformFactor;
use crate::path::StoredPlace;
use crate::ray::RayStats;
use serde::{Deserialize, Serialize};

/// The strategy.
#[derive(Debug)]
pub(super) struct VertexCache {
    /// M; one for every pixel of the full picture if none is given.
    paths: Option<u32>,
    /// C; decided by the warm-up if none is given.
    connections: Option<u32>,
    state: State,
}

/// Numbers that are decided before the first iteration, and what the stores of all iterations had.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct State {
    /// M.
    paths: u32,
    /// C.
    connections: u32,
    counted: VertexCount,
}

impl VertexCache {
    /// Draws `connections` times from the vertices of `paths` light sub-paths.
    pub fn new(paths: Option<u32>, connections: Option<u32>) -> VertexCache {
        VertexCache { paths, connections, state: State::default() }
    }
}

impl ConnectionStrategy for VertexCache {
    type Factor = UniformFactor;
    type Lookup = ();

    fn light_subpaths(&self) -> LightSubpaths {
        LightSubpaths::Shared { count: self.state.paths, tree: false }
    }

    fn samples(&self) -> f32 {
        self.state.connections as f32
    }

    fn factor(&self) -> UniformFactor {
        UniformFactor { vertices_per_path: self.state.counted.vertices_per_path() as f32 }
    }

    fn place(&mut self, warm_up: &WarmUp) -> RayStats {
        let [width, height] = warm_up.iteration.scene.film_size;
        let paths = self.paths.unwrap_or(width * height);
        let (store, stats) = warm_up.light_vertices(paths.min(WarmUp::MAX_PATHS), 1, false);
        self.state = State { paths, ..State::default() };
        self.state.counted.add(&store);
        let mean = self.state.counted.vertices_per_path().round() as u32;
        self.state.connections = self.connections.unwrap_or(mean.max(1));
        stats
    }

    fn learn(&mut self, store: &VertexStore) {
        self.state.counted.add(store);
    }

    fn reset(&mut self) {
        self.state = State::default();
    }

    #[inline]
    fn draw<'a>(
        &'a self,
        eye: &EyeVertex<'a, '_>,
        sampler: &mut PathSampler,
        wanted: impl Fn(usize) -> bool,
        mut connect: impl FnMut(Candidate<'a, ()>),
    ) {
        let (vertices, connections) = (eye.store.len() as f32, self.state.connections);
        if eye.store.is_empty() {
            return;
        }
        // Next event leaves the last of its numbers. Systematic draws: vertices that are neighbours in the store are
        // neighbours in space.
        let [.., offset] = sampler.vertex(eye.vertex.index, SampleSlot::Emitter);
        let scale = vertices / (connections as f32 * self.state.paths as f32 * eye.fraction);
        for number in 0..connections {
            if eye.fraction < 1.0 && sampler.rng().next_f32() >= eye.fraction {
                continue;
            }
            let u = systematic(number, connections, offset);
            let candidate = eye.store.candidate(((u * vertices) as usize).min(eye.store.len() - 1), scale);
            if wanted(candidate.vertex.length()) {
                connect(candidate);
            }
        }
    }

    #[inline]
    fn edge(&self, (): &(), _y: &StoredPlace, _value: impl Fn(Vec3) -> Rgb) {}

    fn note(&self) -> Option<String> {
        let State { paths, connections, .. } = self.state;
        (paths > 0)
            .then(|| format!("{connections} connections per eye vertex to the vertices of {paths} light sub-paths"))
    }

    fn save(&self) -> Vec<u8> {
        postcard::to_allocvec(&self.state).unwrap_or_default()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        postcard::from_bytes(state).map(|state| self.state = state).is_ok()
    }
}
