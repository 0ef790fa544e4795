//! The densities that one walk knows of the vertices it made.
//!
//! Write u_0, u_1, … for the vertices of a sub-path (y from the light, z from the camera). A [`VertexPdfs`] keeps for
//! each of them the area density p_fwd with which this walk made it, and the ratio p_rev / p_fwd, where p_rev is the
//! density with which a walk from the *other* end would have made it. Products of such ratios lead from a technique to
//! its neighbours, so nothing else is ever multiplied up.
//!
//! The holes of masks that a walk passes on its way to a vertex are part of its density from either end. So they are no
//! part of the ratio, and are left out of p_fwd as well: among the techniques of a path they tell only the one that
//! connects the vertex with the vertex before from the others, which walk ([`VertexPdfs::connection_factor`]).
//!
//! In media the density of a vertex is per unit of volume. Light collides on its way with the density E κ per unit of
//! length (see [`media`](crate::media)): E is treated as the holes of masks are, and κ of a vertex, which differs from one
//! end of an edge to the other, is part of p_fwd and of [`VertexPdfs::area_jacobian`].
//!
//! Densities of a vertex at infinity are per steradian of its direction; the disk that emission rays start on stands in
//! for the direction's density at the next vertex (see `emit::sample`). [`VertexPdfs::area_jacobian`] hides the
//! difference.

use super::factor::ConnectionFactor;
use crate::math::measure::area_jacobian;
use crate::math::{AreaPdf, Rgb, SolidAnglePdf};
use crate::path::{DirectionSampler, Edge, FreeFlight, Vertex};
use crate::ray::Transmittance;
use crate::shade::{BsdfSample, Transport};

/// Densities of a vertex of a sub-path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexPdfs {
    /// p_fwd: area density with which this sub-path's walk makes the vertex, survival of roulette at the vertex before
    /// included.
    pub pdf_fwd: AreaPdf,
    /// Turns a density per steradian at this vertex, of directions towards the vertex before, into an area density of
    /// the vertex before:
    /// |cos| κ there / d²; 1 if that vertex is at infinity. Of a vertex that is itself at infinity: |cos| there, for the density
    /// per unit area of the emission disk.
    pub area_jacobian: f32,
    /// Survival of roulette at this vertex, where the walk from the other end plays it.
    pub survival: f32,
    /// p_rev / p_fwd, without the survival at the vertex after this one. Valid once the walk has left the vertex after
    /// it.
    pub rev_over_fwd: f32,
    /// Both directions of the path at this vertex have a density (no delta event), so that the edges beside it can be
    /// connections. Valid once the walk has left it.
    pub connectable: bool,
    /// Factor of the technique that connects this vertex with the vertex before: 1/τ of the edge (see
    /// `ray::transmittance`), media included, in light sub-paths times c of the connection (see [`ConnectionFactor`]).
    pub connection_factor: f32,
    /// Partial sums of effective densities: the techniques that use no vertices of this sub-path but those before this
    /// one (see [`MisContext::accumulate_partial_sums`](super::MisContext::accumulate_partial_sums)). Valid once the
    /// walk has left the vertex.
    pub partial_sums: [f32; 2],
}

impl VertexPdfs {
    fn new(transmittance: Transmittance, pdf_fwd: AreaPdf, area_jacobian: f32, survival: f32) -> VertexPdfs {
        VertexPdfs {
            pdf_fwd,
            area_jacobian,
            survival,
            rev_over_fwd: 0.0,
            connectable: true,
            connection_factor: 1.0 / transmittance.share(),
            partial_sums: [0.0; 2],
        }
    }

    /// The origin of a sub-path.
    pub fn origin(pdf_fwd: AreaPdf) -> VertexPdfs {
        VertexPdfs::new(Transmittance::ONE, pdf_fwd, 0.0, 1.0)
    }
}

/// The densities of the vertices of one sub-path, in the order in which they were made.
#[derive(Clone, Debug, Default)]
pub struct SubpathPdfs {
    vertices: Vec<VertexPdfs>,
    /// |cos| between the last vertex's surface and the edge on which the walk left it.
    cos_leaving: f32,
}

impl SubpathPdfs {
    /// Starts over at an origin of the given density.
    pub fn begin(&mut self, origin: AreaPdf) {
        self.vertices.clear();
        self.cos_leaving = 0.0;
        self.vertices.push(VertexPdfs::origin(origin));
    }

    /// The walk arrived at `vertex` from a vertex that is not a light's; `survival` is the survival there of a walk
    /// from the other end. Returns p_fwd without κ of media.
    #[inline]
    pub fn arrive(&mut self, vertex: &Vertex, survival: f32) -> AreaPdf {
        let (edge, cos) = (vertex.edge, vertex.place.cosine(vertex.wo));
        let distance2 = edge.distance * edge.distance;
        let pdf_fwd = edge.pdf_with_survival().to_area(cos, distance2);
        self.arrive_with(edge, pdf_fwd, area_jacobian(self.cos_leaving, distance2), survival);
        pdf_fwd
    }

    /// The walk left the scene. A vertex at infinity has a density per steradian, and only the tilt of the vertex
    /// before spreads the disk that emission from there starts on.
    pub fn arrive_at_infinity(&mut self, edge: &Edge) {
        self.arrive_with(edge, AreaPdf(edge.pdf_with_survival().0), self.cos_leaving.abs(), 1.0);
    }

    /// The walk arrived at its next vertex by `edge`, with densities that its emitter knows, κ of media apart.
    #[inline]
    pub fn arrive_with(&mut self, edge: &Edge, pdf_fwd: AreaPdf, area_jacobian: f32, survival: f32) {
        let FreeFlight { rate, rate_back, .. } = edge.flight;
        let (pdf_fwd, area_jacobian) = (AreaPdf(pdf_fwd.0 * rate), area_jacobian * rate_back);
        self.vertices.push(VertexPdfs::new(edge.transmittance, pdf_fwd, area_jacobian, survival));
    }

    /// Takes back the last arrival.
    pub fn forget_arrival(&mut self) {
        self.vertices.pop();
    }

    /// The walk leaves its last vertex, `vertex`, by `sample`; `reverse_mode` is the transport mode of a walk from the
    /// other end. Returns the density per steradian there of the direction back, given the one the walk goes on in (of
    /// a delta event the discrete probability of the reverse event).
    #[inline]
    pub fn leave(
        &mut self,
        vertex: &Vertex,
        sample: &BsdfSample,
        directions: &impl DirectionSampler,
        reverse_mode: Transport,
    ) -> SolidAnglePdf {
        self.cos_leaving = vertex.place.cosine(sample.wi);
        let pdf_rev = match sample.delta {
            true => sample.pdf_reverse_delta,
            false => directions.pdf(vertex.position(), &vertex.scatter, sample.wi, vertex.wo, reverse_mode),
        };
        if let [.., before, last] = self.vertices.as_mut_slice() {
            last.connectable = !sample.delta;
            before.rev_over_fwd = pdf_rev.0 * last.area_jacobian / before.pdf_fwd.0;
        }
        pdf_rev
    }

    /// Cosine between the last vertex's surface and the edge on which the walk left it.
    #[inline]
    pub fn cos_leaving(&self) -> f32 {
        self.cos_leaving
    }

    /// The last vertex.
    #[inline]
    pub fn last_mut(&mut self) -> Option<&mut VertexPdfs> {
        self.vertices.last_mut()
    }

    /// The first `n` vertices.
    #[inline]
    pub fn first(&self, n: usize) -> &[VertexPdfs] {
        &self.vertices[..n]
    }

    /// All vertices.
    #[inline]
    pub fn all(&self) -> &[VertexPdfs] {
        &self.vertices
    }

    /// All vertices, for sums over them.
    #[inline]
    pub fn all_mut(&mut self) -> &mut [VertexPdfs] {
        &mut self.vertices
    }
}

/// The values and densities that light on its way up an eye sub-path would meet at one of its vertices. Connection
/// factors ask for them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReverseTransport {
    /// |cos| between the surface's normal and the edge to the vertex before.
    pub cos: f32,
    /// Square of the distance to the vertex before.
    pub distance2: f32,
    /// Adjoint value of the vertex, cosine weighted.
    pub value: Rgb,
    /// Density per steradian with which a walk from the light would go on from here to the vertex before.
    pub pdf: f32,
    /// Flight along the edge to here.
    pub flight: FreeFlight,
}

/// Densities of an eye sub-path, with what factors of connections along it ask for.
#[derive(Clone, Debug)]
pub struct EyeSubpathPdfs<F: ConnectionFactor> {
    /// Densities.
    pub pdfs: SubpathPdfs,
    /// One for each vertex; none at all where all factors are one.
    reverse: Vec<ReverseTransport>,
    /// For each vertex, what the factor of the edge from it to the vertex before depends on; as `reverse`.
    edges: Vec<F::Edge>,
}

impl<F: ConnectionFactor> Default for EyeSubpathPdfs<F> {
    fn default() -> EyeSubpathPdfs<F> {
        EyeSubpathPdfs { pdfs: SubpathPdfs::default(), reverse: vec![], edges: vec![] }
    }
}

impl<F: ConnectionFactor> EyeSubpathPdfs<F> {
    /// Starts over at a lens point of the given density.
    pub fn begin(&mut self, lens: AreaPdf) {
        self.pdfs.begin(lens);
        self.reverse.clear();
        self.edges.clear();
        self.push(0.0, 0.0, FreeFlight::NONE);
    }

    #[inline]
    fn push(&mut self, cos: f32, distance2: f32, flight: FreeFlight) {
        if !F::IS_ONE {
            self.reverse.push(ReverseTransport { cos, distance2, flight, ..ReverseTransport::default() });
            self.edges.push(F::Edge::default());
        }
    }

    /// The walk arrived at `vertex`; see [`SubpathPdfs::arrive`].
    #[inline]
    pub fn arrive(&mut self, vertex: &Vertex, survival: f32) {
        self.pdfs.arrive(vertex, survival);
        let edge = vertex.edge;
        self.push(vertex.place.cosine(vertex.wo).abs(), edge.distance * edge.distance, edge.flight);
    }

    /// Takes back the last arrival.
    pub fn forget_arrival(&mut self) {
        self.pdfs.forget_arrival();
        self.reverse.pop();
        self.edges.pop();
    }

    /// The walk left the scene; see [`SubpathPdfs::arrive_at_infinity`].
    pub fn arrive_at_infinity(&mut self, edge: &Edge) {
        self.pdfs.arrive_at_infinity(edge);
        self.push(0.0, 0.0, edge.flight);
    }

    /// Notes at the last vertex the value and density of light on its way back, and what the factor of the edge to the
    /// vertex before depends on.
    #[inline]
    pub fn set_reverse(&mut self, value: Rgb, pdf: SolidAnglePdf, edge: F::Edge) {
        if let (Some(last), Some(last_edge)) = (self.reverse.last_mut(), self.edges.last_mut()) {
            (last.value, last.pdf) = (value, pdf.0);
            *last_edge = edge;
        }
    }

    /// Values and densities of light on its way back, for each vertex.
    #[inline]
    pub fn reverse(&self) -> &[ReverseTransport] {
        &self.reverse
    }

    /// Arguments of the factors of edges, for each vertex that an edge leads from.
    #[inline]
    pub fn edges(&self) -> &[F::Edge] {
        &self.edges
    }
}
