//! Ray queries behind one trait: closest hit, occlusion of a segment, and occlusion in packets.
//!
//! Three backends answer the same questions: [`embree`] (Debian's Embree, the default and the only `unsafe` file),
//! [`obvhs`] (pure Rust, for machines without Embree) and [`brute`] (every surface in double precision, the tests'
//! oracle). Integrators see none of them: they hold a [`Tracer`], which counts rays by kind and knows how long they
//! took.
//!
//! Numerical policy: a ray leaves a surface from a point moved out by the error bound of the hit ([`offset`]), so the
//! interval starts at the smallest positive number and, for a segment, ends one part in 2^23 before its far point. A
//! ray with a component that is not finite is not traced: it is counted, and answered "miss" or "occluded".

pub mod agreement;
pub mod brute;
#[cfg(any(embree3, embree4))]
pub mod embree;
pub mod geometry;
#[cfg(any(embree3, embree4))]
mod lanes;
pub mod obvhs;
pub mod offset;
pub mod phases;
pub mod round;
pub mod tracer;
pub mod transmittance;

pub use geometry::{Geometry, Instance, MeshBuffers, SurfaceMask, VertexBuffer};
pub use phases::Phases;
pub use round::{RoundPoint, RoundShape};
pub use tracer::{RayKind, RayStats, Tracer, Work};
pub use transmittance::{MaskLookup, MaskPoint, Transmittance};

use crate::math::Vec3;
use glam::Vec3A;

/// Beginning of every ray that leaves a surface (its origin is already off the surface).
pub const T_MIN: f32 = f32::MIN_POSITIVE;
/// End of a segment whose far point has parameter 1: 1 − 2⁻²³.
pub const T_SEGMENT: f32 = 1.0 - f32::EPSILON;
/// Rays in a packet.
pub const PACKET: usize = 16;
/// No instance.
pub const NONE: u32 = u32::MAX;

/// A ray with its interval; `d` need not be normalised, `t` counts in lengths of `d`.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin.
    pub o: Vec3,
    /// Direction.
    pub d: Vec3,
    /// Beginning of the interval, ≥ 0.
    pub t_min: f32,
    /// End of the interval; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// A ray that leaves a surface point (already offset) and goes on for ever.
    pub fn leaving(o: Vec3, d: Vec3) -> Ray {
        Ray { o, d, t_min: T_MIN, t_max: f32::INFINITY }
    }

    /// True if the backends may see it: every component finite and of a size that does not overflow, t_min ≥ 0, no NaN.
    /// (Debian 12's Embree aborts the process on others.)
    #[inline]
    pub fn is_valid(&self) -> bool {
        // A sum rather than a maximum: `f32::max` drops NaN, a sum keeps it.
        let sum = (Vec3A::from(self.o).abs() + Vec3A::from(self.d).abs()).element_sum();
        sum < 1e18 && self.t_min >= 0.0 && !self.t_max.is_nan()
    }
}

/// The first intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Barycentric coordinate of the triangle's second vertex; of a round shape, the first number of the point's code.
    pub u: f32,
    /// Barycentric coordinate of the triangle's third vertex; of a round shape, the second number of the point's code.
    pub v: f32,
    /// Triangle of the mesh; 0 on a round shape.
    pub triangle: u32,
    /// Surface of the [`Geometry`].
    pub mesh: u32,
    /// Instance of the [`Geometry`], or [`NONE`].
    pub instance: u32,
}

/// A question of visibility: is there anything between `o` and `o + t_max·d`?
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Near point, already off its surface.
    pub o: Vec3,
    /// To the far point, or, with an infinite `t_max`, the direction.
    pub d: Vec3,
    /// [`T_SEGMENT`], infinite, or another length where the camera's far clipping plane ends it.
    pub t_max: f32,
}

impl Segment {
    /// Between two points that are off their surfaces.
    pub fn between(a: Vec3, b: Vec3) -> Segment {
        Segment { o: a, d: b - a, t_max: T_SEGMENT }
    }

    /// From a point that is off its surface to infinity.
    pub fn to_infinity(o: Vec3, d: Vec3) -> Segment {
        Segment { o, d, t_max: f32::INFINITY }
    }

    /// The rest of it from `o` on, a point of it but for rounding: the far end stays where it is.
    pub fn rest_from(&self, o: Vec3) -> Segment {
        if self.t_max.is_infinite() {
            return Segment { o, ..*self };
        }
        // The factor is one for the usual segment.
        let end = self.o + self.d * (self.t_max / T_SEGMENT);
        Segment { o, d: end - o, t_max: T_SEGMENT }
    }

    /// As a ray.
    pub fn ray(&self) -> Ray {
        Ray { o: self.o, d: self.d, t_min: T_MIN, t_max: self.t_max }
    }
}

/// Up to sixteen segments side by side, as the packet queries want them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct SegmentPacket {
    /// Origins.
    pub o: [[f32; PACKET]; 3],
    /// Directions.
    pub d: [[f32; PACKET]; 3],
    /// Ends.
    pub t_max: [f32; PACKET],
    /// Segments in use.
    pub len: usize,
    /// Surfaces that can be in the way of the segments.
    pub blockers: SurfaceMask,
}

impl Default for SegmentPacket {
    fn default() -> Self {
        SegmentPacket {
            o: [[0.0; PACKET]; 3],
            d: [[0.0; PACKET]; 3],
            t_max: [0.0; PACKET],
            len: 0,
            blockers: SurfaceMask::BLOCKERS,
        }
    }
}

impl SegmentPacket {
    /// Appends a segment.
    ///
    /// # Panics
    /// If the packet is full.
    #[inline]
    pub fn push(&mut self, s: &Segment) {
        let i = self.len;
        for (axis, (o, d)) in s.o.to_array().into_iter().zip(s.d.to_array()).enumerate() {
            self.o[axis][i] = o;
            self.d[axis][i] = d;
        }
        self.t_max[i] = s.t_max;
        self.len = i + 1;
    }

    /// Segment `i` again.
    pub fn get(&self, i: usize) -> Segment {
        let at = |a: &[[f32; PACKET]; 3]| Vec3::new(a[0][i], a[1][i], a[2][i]);
        Segment { o: at(&self.o), d: at(&self.d), t_max: self.t_max[i] }
    }
}

/// A backend: answers questions about one immutable scene, from any number of threads at once.
pub trait RayQuery: Send + Sync {
    /// Name and version, for people.
    fn describe(&self) -> String;

    /// This backend as the one that [`Tracer`] calls directly.
    #[cfg(any(embree3, embree4))]
    fn as_embree(&self) -> Option<&embree::EmbreeScene> {
        None
    }

    /// The first surface of the kinds `surfaces` that the ray meets. The ray must be valid ([`Ray::is_valid`]).
    fn closest_of(&self, ray: &Ray, surfaces: SurfaceMask) -> Option<Hit>;

    /// The first surface that the ray meets; interfaces are none. The ray must be valid ([`Ray::is_valid`]).
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest_of(ray, SurfaceMask::VISIBLE)
    }

    /// Is a surface of the kinds `blockers` in the ray's interval? The ray must be valid.
    fn occluded(&self, ray: &Ray, blockers: SurfaceMask) -> bool;

    /// Bit `i` set: segment `i` of the packet is blocked by a surface of the kinds that the packet asks for. Segments
    /// that are not valid are reported blocked, with their number in the second value.
    fn occluded_packet(&self, packet: &SegmentPacket) -> (u16, u32) {
        let (mut mask, mut invalid) = (0, 0);
        for i in 0..packet.len {
            let ray = packet.get(i).ray();
            let valid = ray.is_valid();
            invalid += u32::from(!valid);
            if !valid || self.occluded(&ray, packet.blockers) {
                mask |= 1 << i;
            }
        }
        (mask, invalid)
    }
}

/// Which backend to build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// Debian's Embree.
    Embree,
    /// Pure Rust.
    Obvhs,
    /// Every surface, in double precision.
    Brute,
}

impl Backend {
    /// Embree where the program was built with it.
    pub fn default_available() -> Backend {
        if cfg!(any(embree3, embree4)) { Backend::Embree } else { Backend::Obvhs }
    }

    /// Builds the acceleration structure; `threads` is a limit for the builder.
    ///
    /// # Errors
    /// If the backend is not part of this program or reports a failure.
    pub fn build(self, geometry: std::sync::Arc<Geometry>, threads: usize) -> Result<Box<dyn RayQuery>, QueryError> {
        match self {
            #[cfg(any(embree3, embree4))]
            Backend::Embree => Ok(Box::new(embree::EmbreeScene::build(geometry, threads)?)),
            #[cfg(not(any(embree3, embree4)))]
            Backend::Embree => {
                let _ = threads;
                Err(QueryError("this program was built without Embree; use --query obvhs".into()))
            }
            Backend::Obvhs => Ok(Box::new(obvhs::ObvhsScene::build(&geometry)?)),
            Backend::Brute => Ok(Box::new(brute::BruteScene::build(&geometry))),
        }
    }
}

/// A backend failed.
#[derive(Debug, thiserror::Error)]
#[error("ray queries: {0}")]
pub struct QueryError(pub String);

#[cfg(test)]
mod tests {
    use super::*;

    /// Every ray query copies them.
    #[test]
    fn rays_and_hits_are_small() {
        assert_eq!(size_of::<Ray>(), 32);
        assert_eq!(size_of::<Hit>(), 24);
        assert_eq!(size_of::<Segment>(), 28);
        // Seven lines of sixteen floats; the number of segments and the mask.
        assert_eq!(size_of::<SegmentPacket>(), 8 * 64);
    }
}
