//! Which light sub-paths an eye vertex is connected to: the part in which bidirectional methods differ.

use super::light_subpath::LightSubpath;
use super::store::VertexStore;
use super::vertex::LightVertex;
use super::warm_up::WarmUp;
use crate::math::Rgb;
use crate::math::Vec3;
use crate::math::sampler::PathSampler;
use crate::mis::factors::Balance;
use crate::mis::{AdjacentVertices, ConnectionFactor, EmitterFactors, MisContext, VertexPdfs};
use crate::path::{Iteration, Origin, StoredPlace, Vertex};
use crate::prepared::PreparedScene;
use crate::ray::offset::SegmentEnd;
use crate::ray::{RayStats, Tracer};
use crate::shade::{BsdfView, Transport};

/// Where the light sub-paths of an iteration come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSubpaths {
    /// Each pixel (or a few of them together) traces one of its own.
    OfPixel,
    /// All are traced before the eye sub-paths, and the vertices of the first `count` are stored.
    Shared {
        /// M.
        count: u32,
        /// A tree over the stored vertices is built.
        tree: bool,
    },
}

/// A light sub-path that an eye vertex is connected to. `L` is the strategy's [`Lookup`](ConnectionStrategy::Lookup).
pub struct Candidate<'a, L> {
    /// Its last vertex, y_{s−1}.
    pub vertex: &'a LightVertex,
    /// The BSDF of that vertex.
    pub bsdf: BsdfView<'a>,
    /// Densities of its s vertices.
    pub pdfs: &'a [VertexPdfs],
    /// c_0 and c_1 of paths that begin with it.
    pub emitter: EmitterFactors,
    /// y_0; `None` for a sub-path of the store.
    pub origin: Option<Origin>,
    /// Number of the sub-path among those of the iteration, for a sub-path of the store.
    pub number: Option<u32>,
    /// One over the expected number of times that the sub-path is drawn.
    pub scale: f32,
    /// The cache point that drew it, where each is a technique of its own.
    pub selected: Option<usize>,
    /// Knowledge about the eye vertex, visibility from there to y_{s−1} included, where drawing has found it already.
    pub lookup: Option<L>,
}

/// An eye vertex, and the light sub-paths from which strategies draw its candidates.
pub struct EyeVertex<'a, 'v> {
    /// The eye vertex.
    pub vertex: &'v Vertex<'v>,
    /// The light sub-path of the vertex's own pixel, of strategies that trace one for each.
    pub own: &'a LightSubpath,
    /// The stored light vertices of the iteration, of strategies that share them.
    pub store: &'a VertexStore,
    /// Fraction of the connections that is made.
    pub fraction: f32,
}

/// The strategy of a bidirectional method. All functions have defaults that suit a strategy without memory and without
/// cache points.
pub trait ConnectionStrategy: Send + Sync {
    /// c of connections.
    type Factor: ConnectionFactor;

    /// Knowledge about one side of an eye vertex that the factors of its connections share, e.g. its nearest cache
    /// points and which of them see the light vertex.
    type Lookup: Copy + Default;

    /// [`ConnectionStrategy::edge`] depends on the light vertex, and [`ConnectionStrategy::see`] on its visibility.
    const NEEDS_LIGHT_VERTEX: bool = false;

    /// Where light sub-paths come from.
    fn light_subpaths(&self) -> LightSubpaths {
        LightSubpaths::OfPixel
    }

    /// Expected number of samples that an eye vertex takes of each connection technique.
    fn samples(&self) -> f32 {
        1.0
    }

    /// The factor of the coming iteration, from what earlier ones found.
    fn factor(&self) -> Self::Factor;

    /// Before the first iteration, if it has connections: places cache points and estimates normalisations. Depends on
    /// scene and seed alone.
    fn place(&mut self, _warm_up: &WarmUp) -> RayStats {
        RayStats::default()
    }

    /// Before the eye sub-paths of an iteration: finds the pmfs of the stored light vertices.
    fn prepare(&mut self, _iteration: &Iteration, _store: &VertexStore) -> RayStats {
        RayStats::default()
    }

    /// After an iteration: adds what it found to what later factors know.
    fn learn(&mut self, _store: &VertexStore) {}

    /// Forgets everything: the next iteration is the first.
    fn reset(&mut self) {}

    /// Draws the light sub-paths that an eye vertex is connected to, of those lengths s that are `wanted`, and hands
    /// them to `connect`.
    fn draw<'a>(
        &'a self,
        eye: &EyeVertex<'a, '_>,
        sampler: &mut PathSampler,
        wanted: impl Fn(usize) -> bool,
        connect: impl FnMut(Candidate<'a, Self::Lookup>),
    );

    /// Looks up the side of the direction `d` of an eye vertex.
    #[inline]
    fn look_up(&self, _z: &StoredPlace, _d: Vec3) -> Self::Lookup {
        Self::Lookup::default()
    }

    /// Completes a look-up by the visibility of the light vertex whose end of a segment is `y`.
    #[inline]
    fn see(&self, _lookup: &mut Self::Lookup, _y: &SegmentEnd, _tracer: &mut Tracer) {}

    /// The argument of the factor of the edge from a light vertex at `y` to the eye vertex of the look-up; `value` is
    /// the adjoint BSDF value at `y` for a direction.
    fn edge(
        &self,
        lookup: &Self::Lookup,
        y: &StoredPlace,
        value: impl Fn(Vec3) -> Rgb,
    ) -> <Self::Factor as ConnectionFactor>::Edge;

    /// A sentence about what was built, for people.
    fn note(&self) -> Option<String> {
        None
    }

    /// The state that must be saved to go on later, serialised.
    fn save(&self) -> Vec<u8> {
        vec![]
    }

    /// Goes on from a saved state, after `place`; false if it is of something else.
    fn restore(&mut self, state: &[u8]) -> bool {
        state.is_empty()
    }
}

/// c of two adjacent vertices of a path, for the oracle and for replays.
pub fn factor_of<S: ConnectionStrategy>(
    scene: &PreparedScene,
    strategy: &S,
    mis: &MisContext<S::Factor>,
    vertices: &AdjacentVertices,
) -> f32 {
    let AdjacentVertices { y, wo, z, wi, light } = vertices;
    let mut lookup = strategy.look_up(&z.place, -*wi);
    strategy.see(&mut lookup, &y.place.segment_end(), &mut scene.tracer());
    let edge = strategy.edge(&lookup, &y.place, |to| y.bsdf.eval(*wo, to, Transport::Importance));
    mis.factor.c(light, &edge)
}

/// No connections: light sub-paths serve the light image alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoConnections;

impl ConnectionStrategy for NoConnections {
    type Factor = Balance;
    type Lookup = ();

    fn factor(&self) -> Balance {
        Balance
    }

    fn draw<'a>(
        &'a self,
        _eye: &EyeVertex<'a, '_>,
        _sampler: &mut PathSampler,
        _wanted: impl Fn(usize) -> bool,
        _connect: impl FnMut(Candidate<'a, ()>),
    ) {
    }

    fn edge(&self, (): &(), _y: &StoredPlace, _value: impl Fn(Vec3) -> Rgb) {}
}
