//! Samples of lights, and the conventions for lights at infinity.
//!
//! A light at infinity has no points. By convention its path vertex y_0 carries a direction; the vertex's "area
//! density" is the density per steradian of that direction, its geometry term with the next vertex has neither 1/d² nor
//! a cosine at the light, and the next vertex's area density comes from the disk that emission rays start on. The
//! functions of [`EmitterVertex`] apply these rules, so that callers write one formula for all lights.

use crate::math::measure::area_jacobian;
use crate::math::{AreaPdf, Rgb, SolidAnglePdf, Vec3};
use crate::ray::offset::SegmentEnd;

/// The vertex y_0 of a path: the end of a segment at a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EmitterVertex {
    /// A point of an emitting surface.
    Surface {
        /// Position.
        p: Vec3,
        /// Bound on the error of any component of `p`.
        error: f32,
        /// Unit geometric normal, on the side that emits.
        ng: Vec3,
    },
    /// A light without extent.
    Point {
        /// Position.
        p: Vec3,
    },
    /// Beyond the scene.
    Infinite,
}

impl EmitterVertex {
    /// Area density of the light vertex itself: `position` for a light in the scene, `direction` for one at infinity.
    pub fn pdf_vertex(&self, position: AreaPdf, direction: SolidAnglePdf) -> AreaPdf {
        match self {
            EmitterVertex::Infinite => AreaPdf(direction.0),
            _ => position,
        }
    }

    /// Density of the emission's direction given the light vertex, per steradian; of a light at infinity, the density
    /// of the ray's origin on the disk, per unit area.
    pub fn pdf_emission_dir(&self, position: AreaPdf, direction: SolidAnglePdf) -> SolidAnglePdf {
        match self {
            EmitterVertex::Infinite => SolidAnglePdf(position.0),
            _ => direction,
        }
    }

    /// Area density of the vertex that follows the light vertex on an emission ray; `cos_next` is the cosine at that
    /// vertex between its normal and the segment, `dist2` the segment's squared length (unused at infinity).
    pub fn pdf_next_vertex(&self, position: AreaPdf, direction: SolidAnglePdf, cos_next: f32, dist2: f32) -> AreaPdf {
        match self {
            // The disk is perpendicular to the ray: only the cosine at the receiver remains.
            EmitterVertex::Infinite => AreaPdf(position.0 * cos_next.abs()),
            _ => direction.to_area(cos_next, dist2),
        }
    }

    /// Factor from a density per steradian at the next vertex to a density of the light vertex, in the measure of
    /// [`EmitterVertex::pdf_vertex`]. `wo` is the unit direction of the segment, either way, and `dist2` its squared
    /// length. The factor of a light without extent is 1.
    #[inline]
    pub fn area_jacobian(&self, wo: Vec3, dist2: f32) -> f32 {
        match self {
            EmitterVertex::Surface { ng, .. } => area_jacobian(ng.dot(wo), dist2),
            EmitterVertex::Point { .. } | EmitterVertex::Infinite => 1.0,
        }
    }

    /// Unit normal of a surface, zero elsewhere.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        match *self {
            EmitterVertex::Surface { ng, .. } => ng,
            EmitterVertex::Point { .. } | EmitterVertex::Infinite => Vec3::ZERO,
        }
    }

    /// The end of a shadow ray at this vertex; `None` at infinity.
    #[inline]
    pub fn segment_end(&self) -> Option<SegmentEnd> {
        match *self {
            EmitterVertex::Surface { p, error, ng } => Some(SegmentEnd::Surface { p, error, ng }),
            EmitterVertex::Point { p } => Some(SegmentEnd::Free(p)),
            EmitterVertex::Infinite => None,
        }
    }

    /// Throughput of a light sub-path after its first edge. The sub-path leaves this vertex in the unit direction
    /// `direction`; `pdf` is the joint density of vertex and direction. `radiance` arrives along the edge, whose length
    /// is `distance` (of a point light: intensity / distance²).
    #[inline]
    pub fn flux(&self, radiance: Rgb, direction: Vec3, distance: f32, pdf: f32) -> Rgb {
        let factor = match self {
            EmitterVertex::Surface { ng, .. } => ng.dot(direction).abs(),
            EmitterVertex::Point { .. } => distance * distance,
            EmitterVertex::Infinite => 1.0,
        };
        radiance * (factor / pdf)
    }
}

/// Light arriving at a reference point from one sampled point (or direction) of one light.
#[derive(Clone, Copy, Debug)]
pub struct DirectSample {
    /// Unit direction from the reference point to the light.
    pub wi: Vec3,
    /// Length of the segment; infinite for a light at infinity.
    pub distance: f32,
    /// The segment's end at the light.
    pub end: EmitterVertex,
    /// Emitted radiance towards the reference point. Of a point or spot light: intensity / distance². Of a directional
    /// light: irradiance on a surface that faces it. In all cases `radiance / pdf` times BSDF and cosine estimates
    /// reflected radiance.
    pub radiance: Rgb,
    /// Density per steradian at the reference point; 1 for delta lights. The choice of the light is not part of it.
    pub pdf: SolidAnglePdf,
    /// The light has no extent: no ray hits it by chance.
    pub delta: bool,
}

/// A ray that leaves a light.
#[derive(Clone, Copy, Debug)]
pub struct EmissionSample {
    /// Where the ray starts. For lights at infinity: a point of the disk before the scene.
    pub origin: Vec3,
    /// Bound on the error of any component of `origin`.
    pub error: f32,
    /// Unit normal of the surface it leaves, if there is one.
    pub ng: Option<Vec3>,
    /// Unit direction of travel.
    pub direction: Vec3,
    /// Emitted radiance; of a point or spot light its intensity, of a directional light its irradiance.
    pub radiance: Rgb,
    /// Density of `origin` per unit area: of the surface, or of the disk perpendicular to `direction` for lights at
    /// infinity; 1 for a light at a point.
    pub pdf_position: AreaPdf,
    /// Density of `direction` per steradian; 1 for a directional light.
    pub pdf_direction: SolidAnglePdf,
    /// The light is a point.
    pub delta_position: bool,
    /// The light has one direction.
    pub delta_direction: bool,
    /// The light end of a segment along this ray.
    pub end: EmitterVertex,
}

impl EmissionSample {
    /// Flux carried: radiance · |cos θ at the light| / density. Its expectation is the light's flux per channel.
    pub fn flux(&self) -> Rgb {
        // The radiance of a point is its intensity: what arrives at distance one.
        self.end.flux(self.radiance, self.direction, 1.0, self.pdf_position.0 * self.pdf_direction.0)
    }

    /// Area density of the light vertex (see [`EmitterVertex::pdf_vertex`]).
    pub fn pdf_vertex(&self) -> AreaPdf {
        self.end.pdf_vertex(self.pdf_position, self.pdf_direction)
    }
}
