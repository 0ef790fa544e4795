//! A vertex of a sub-path: a place, and a function that scatters light there.

use super::flight::FreeFlight;
use crate::math::measure::area_jacobian;
use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::media::{MediumNumber, MediumPoint, collision_rate};
use crate::ray::offset::SegmentEnd;
use crate::ray::{Hit, Transmittance};
use crate::shade::{Bsdf, BsdfSample, BsdfView, SurfacePoint, Transport};

/// How a vertex was reached.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// The vertex before: a lens point, a point of a light, a vertex of the walk.
    pub from: Vec3,
    /// Density per steradian with which the direction was drawn; of a delta event its discrete probability.
    pub pdf: SolidAnglePdf,
    /// The direction was drawn from a delta lobe: no other technique finds this edge.
    pub delta: bool,
    /// Probability with which Russian roulette let the walk go on into this edge.
    pub survival: f32,
    /// Length.
    pub distance: f32,
    /// τ: the probability with which the walk has passed the masks and media on the edge. It is the same from the other
    /// end.
    pub transmittance: Transmittance,
    /// Flight through media.
    pub flight: FreeFlight,
}

impl Edge {
    /// An edge from `from` in a direction of the density `pdf`, not from a delta lobe and without Russian roulette,
    /// whose end is not yet known.
    #[inline]
    pub fn new(from: Vec3, pdf: SolidAnglePdf) -> Edge {
        let (distance, transmittance) = (f32::INFINITY, Transmittance::ONE);
        Edge { from, pdf, delta: false, survival: 1.0, distance, transmittance, flight: FreeFlight::NONE }
    }

    /// Density per steradian of the direction, survival of Russian roulette included, without the masks and media on the
    /// way.
    #[inline]
    pub fn pdf_with_survival(&self) -> SolidAnglePdf {
        SolidAnglePdf(self.pdf.0 * self.survival)
    }
}

/// Where a vertex is.
#[derive(Clone, Copy, Debug)]
pub enum Place<'a> {
    /// On a surface.
    Surface {
        /// The point.
        point: &'a SurfacePoint,
        /// The ray query's answer.
        hit: &'a Hit,
    },
    /// Inside a participating medium.
    Medium(&'a MediumPoint),
}

/// A place that outlives the walk that found it.
#[derive(Clone, Copy, Debug)]
pub enum StoredPlace {
    /// On a surface.
    Surface {
        /// Position.
        p: Vec3,
        /// Bound on the error of any component of `p`.
        error: f32,
        /// Unit geometric normal.
        ng: Vec3,
    },
    /// Inside a participating medium.
    Medium(MediumPoint),
}

impl StoredPlace {
    /// Position.
    #[inline]
    pub fn position(&self) -> Vec3 {
        match *self {
            StoredPlace::Surface { p, .. } => p,
            StoredPlace::Medium(medium) => medium.p,
        }
    }

    /// Cosine between the unit direction `d` and the geometric normal, the factor of a geometry term at this end of an
    /// edge; 1 in a medium.
    #[inline]
    pub fn cosine(&self, d: Vec3) -> f32 {
        match self {
            StoredPlace::Surface { ng, .. } => ng.dot(d),
            StoredPlace::Medium(_) => 1.0,
        }
    }

    /// Turns a density per steradian at a point a distance √`distance2` away in the unit direction `d` into the density
    /// per unit area (in a medium: volume, κ apart) of this place: |cos| / d² on a surface, 1 / d² in a medium (Veach
    /// 1997, eq. 8.8).
    #[inline]
    pub fn area_jacobian(&self, d: Vec3, distance2: f32) -> f32 {
        area_jacobian(self.cosine(d), distance2)
    }

    /// κ of this end of a segment through media that let `passing` of the light through (see
    /// [`media`](crate::media)): 1 on a surface.
    #[inline]
    pub fn collision_rate(&self, passing: Rgb) -> f32 {
        match self {
            StoredPlace::Surface { .. } => 1.0,
            StoredPlace::Medium(medium) => collision_rate(medium.sigma_t, passing),
        }
    }

    /// The geometric normal on the side of the direction `d`; zero in a medium.
    #[inline]
    pub fn side_normal(&self, d: Vec3) -> Vec3 {
        match *self {
            StoredPlace::Surface { ng, .. } => {
                if ng.dot(d) < 0.0 {
                    -ng
                } else {
                    ng
                }
            }
            StoredPlace::Medium(_) => Vec3::ZERO,
        }
    }

    /// Distance of a point at the given offset from the place's tangent plane, and the bound on the error of the
    /// place's own coordinates: a point within the errors of both is on neither side. `None` in a medium, which has no
    /// plane.
    #[inline]
    pub fn height(&self, offset: Vec3) -> Option<(f32, f32)> {
        match *self {
            StoredPlace::Surface { error, ng, .. } => Some((ng.dot(offset).abs(), error)),
            StoredPlace::Medium(_) => None,
        }
    }

    /// This end of a segment.
    #[inline]
    pub fn segment_end(&self) -> SegmentEnd {
        match *self {
            StoredPlace::Surface { p, error, ng } => SegmentEnd::Surface { p, error, ng },
            StoredPlace::Medium(medium) => SegmentEnd::Free(medium.p),
        }
    }
}

impl Place<'_> {
    /// The parts of the place that outlive the walk.
    #[inline]
    pub fn stored(&self) -> StoredPlace {
        match self {
            Place::Surface { point, .. } => StoredPlace::Surface { p: point.p, error: point.error, ng: point.ng },
            Place::Medium(medium) => StoredPlace::Medium(**medium),
        }
    }

    /// Position.
    #[inline]
    pub fn position(&self) -> Vec3 {
        match self {
            Place::Surface { point, .. } => point.p,
            Place::Medium(medium) => medium.p,
        }
    }

    /// Unit geometric normal; zero in a medium.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        match self {
            Place::Surface { point, .. } => point.ng,
            Place::Medium(_) => Vec3::ZERO,
        }
    }

    /// σ_t in a medium; `None` on a surface.
    #[inline]
    pub fn extinction(&self) -> Option<Rgb> {
        match self {
            Place::Surface { .. } => None,
            Place::Medium(medium) => Some(medium.sigma_t),
        }
    }

    /// See [`StoredPlace::cosine`].
    #[inline]
    pub fn cosine(&self, d: Vec3) -> f32 {
        match self {
            Place::Surface { point, .. } => point.ng.dot(d),
            Place::Medium(_) => 1.0,
        }
    }

    /// See [`StoredPlace::area_jacobian`].
    #[inline]
    pub fn area_jacobian(&self, d: Vec3, distance2: f32) -> f32 {
        area_jacobian(self.cosine(d), distance2)
    }

    /// This end of a segment.
    #[inline]
    pub fn segment_end(&self) -> SegmentEnd {
        match self {
            Place::Surface { point, .. } => SegmentEnd::Surface { p: point.p, error: point.error, ng: point.ng },
            Place::Medium(medium) => SegmentEnd::Free(medium.p),
        }
    }
}

/// A scattering function at a place. Values are cosine weighted on surfaces.
pub trait Scattering {
    /// Value for light that comes along `wi` and leaves along `wo` (`Transport::Importance`: the adjoint).
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Transport) -> Rgb;

    /// Density per steradian with which [`Scatter::sample`] draws `wi` given `wo`.
    fn pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> SolidAnglePdf;

    /// [`Scattering::eval`] and [`Scattering::pdf`].
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> (Rgb, SolidAnglePdf);
}

macro_rules! scattering {
    ($($type:ty),*) => { $(
        impl Scattering for $type {
            #[inline]
            fn eval(&self, wo: Vec3, wi: Vec3, mode: Transport) -> Rgb {
                <$type>::eval(self, wo, wi, mode)
            }

            #[inline]
            fn pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> SolidAnglePdf {
                <$type>::pdf(self, wo, wi, mode)
            }

            #[inline]
            fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> (Rgb, SolidAnglePdf) {
                <$type>::eval_and_pdf(self, wo, wi, mode)
            }
        }
    )* };
}

scattering!(Bsdf, BsdfView<'_>);

/// The scattering function of a vertex that a walk has just made.
#[derive(Clone, Copy, Debug)]
pub struct Scatter<'a>(pub &'a Bsdf);

impl<'a> Scatter<'a> {
    /// The scattering function itself.
    #[inline]
    pub fn bsdf(&self) -> &'a Bsdf {
        self.0
    }

    /// Draws a direction; `u` are three numbers in [0, 1).
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3], mode: Transport) -> Option<BsdfSample> {
        self.bsdf().sample(wo, u, mode)
    }

    /// Approximate share of light that is scattered, per channel, independent of direction.
    #[inline]
    pub fn albedo(&self) -> Rgb {
        self.bsdf().albedo()
    }

    /// No light is scattered.
    #[inline]
    pub fn is_black(&self) -> bool {
        self.bsdf().is_black()
    }

    /// A connection to this vertex can carry light: not every event is a delta event.
    #[inline]
    pub fn connectable(&self) -> bool {
        self.bsdf().connectable()
    }

    /// Light is scattered as by a Lambertian surface and in no other way.
    #[inline]
    pub fn is_lambertian(&self) -> bool {
        self.bsdf().is_lambertian()
    }
}

impl Scattering for Scatter<'_> {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Transport) -> Rgb {
        self.bsdf().eval(wo, wi, mode)
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> SolidAnglePdf {
        self.bsdf().pdf(wo, wi, mode)
    }

    #[inline(always)]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> (Rgb, SolidAnglePdf) {
        self.bsdf().eval_and_pdf(wo, wi, mode)
    }
}

/// A vertex as hooks see it: what is large is borrowed from the walk, which makes it in place.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<'a> {
    /// Number of the vertex, counted from the sub-path's origin: the first vertex after the origin is 1.
    pub index: u32,
    /// Place of the vertex.
    pub place: Place<'a>,
    /// The scattering function there, resolved for `wo`.
    pub scatter: Scatter<'a>,
    /// Unit direction back to the vertex before.
    pub wo: Vec3,
    /// Throughput up to this vertex: all factors of the measurement contribution that the walk has passed, divided by
    /// its density.
    pub throughput: Rgb,
    /// The throughput before the flight of the last edge.
    pub unattenuated: Rgb,
    /// The media on the side of the geometric normal and on the other one.
    pub media: [MediumNumber; 2],
    /// How it was reached.
    pub edge: &'a Edge,
}

impl Vertex<'_> {
    /// Position.
    #[inline]
    pub fn position(&self) -> Vec3 {
        self.place.position()
    }

    /// The medium in the direction `d`.
    #[inline]
    pub fn medium_towards(&self, d: Vec3) -> MediumNumber {
        self.media[usize::from(self.place.cosine(d) < 0.0)]
    }

    /// The normal that the choice of a light may use here: the shading normal on the side of `wo`, none where light
    /// from behind contributes.
    #[inline]
    pub fn light_choice_normal(&self) -> Option<Vec3> {
        let Place::Surface { point, .. } = self.place else { return None };
        let n = point.frame.n;
        (!self.scatter.bsdf().transmits()).then(|| if n.dot(self.wo) < 0.0 { -n } else { n })
    }
}
