//! Participating media in their places: which medium is on which side of a surface, and around cameras and lights.

use super::{PrepareError, PreparedScene};
use crate::emit::{Light, LightId};
use crate::math::{DVec3, Vec3};
use crate::media::{Medium, MediumNumber, MediumPoint, MediumSet};
use crate::ray::offset::{SegmentEnd, offset_point};
use crate::ray::{Hit, Ray, RayKind, SurfaceMask, T_MIN, Tracer};
use crate::scene::{Diagnostic, Diagnostics, InterfaceDesc, MediumDesc, MediumId};
use crate::shade::PhaseScattering;

/// The media on both sides of a surface that separates media.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceInterface {
    /// On the side of the geometric normal.
    pub exterior: MediumNumber,
    /// On the other side.
    pub interior: MediumNumber,
}

/// The number of a described medium; vacuum for `None`.
pub(super) fn number_of(medium: Option<MediumId>) -> MediumNumber {
    medium.and_then(|id| MediumNumber::new(id.index())).unwrap_or_default()
}

impl SurfaceInterface {
    pub(super) fn new(desc: &InterfaceDesc) -> SurfaceInterface {
        SurfaceInterface { exterior: number_of(desc.exterior), interior: number_of(desc.interior) }
    }

    /// The medium in a direction of which the cosine to the geometric normal has this sign.
    #[inline]
    fn towards(&self, cosine: f32) -> MediumNumber {
        if cosine < 0.0 { self.interior } else { self.exterior }
    }
}

/// Media that are not in vacuum by themselves: those around the camera, beyond the scene and around each light.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// Around the camera.
    pub camera: MediumNumber,
    /// Beyond all surfaces.
    pub outside: MediumNumber,
    /// Around each light, on the side to which it emits; empty without media.
    pub lights: Vec<MediumNumber>,
}

/// The media of a description, for positions relative to `centre`.
pub(super) fn build_media(
    media: &[MediumDesc],
    centre: DVec3,
    diagnostics: &mut Diagnostics,
) -> Result<MediumSet, PrepareError> {
    if MediumNumber::new(media.len()).is_none() {
        let message = format!("the scene has {} media: at most 65534 are supported", media.len());
        diagnostics.push(Diagnostic::error("scene::too-many-media", message));
        return Err(PrepareError::Media);
    }
    let mut built = vec![];
    for desc in media {
        match Medium::build(desc, centre) {
            Ok(medium) => built.push(medium),
            Err(fault) => diagnostics.push(Diagnostic::unsupported(fault.to_string()).at(desc.span.clone())),
        }
    }
    if built.len() < media.len() { Err(PrepareError::Media) } else { Ok(MediumSet::new(built)) }
}

impl PreparedScene {
    /// There are surfaces that light may pass on a straight segment: masks, and interfaces between media.
    #[inline]
    pub fn has_crossings(&self) -> bool {
        self.features.contains(super::Features::MASKS)
    }

    /// The medium beside the surface hit in a direction whose cosine to the geometric normal has the sign of `cosine`;
    /// `None` if the surface separates no media.
    #[inline]
    pub fn medium_beside(&self, hit: &Hit, cosine: f32) -> Option<MediumNumber> {
        self.meshes[hit.mesh as usize].interface.map(|interface| interface.towards(cosine))
    }

    /// The media on the side of the geometric normal and on the other one of the surface hit, which a ray has met in
    /// `medium`.
    #[inline]
    pub fn media_beside(&self, hit: &Hit, medium: MediumNumber) -> [MediumNumber; 2] {
        self.meshes[hit.mesh as usize].interface.map_or([medium; 2], |side| [side.exterior, side.interior])
    }

    /// The scattering function of a point of a medium.
    #[inline]
    pub fn medium_scattering(&self, point: &MediumPoint) -> PhaseScattering {
        self.media.get(point.medium).map_or(PhaseScattering::NONE, |medium| medium.scattering(point.p))
    }

    /// The medium around a light, on the side to which it emits.
    #[inline]
    pub fn medium_around(&self, light: LightId) -> MediumNumber {
        self.surroundings.lights.get(light.index()).copied().unwrap_or_default()
    }

    /// The light is at infinity, behind a medium that has no end.
    #[inline]
    pub fn is_cut_off(&self, light: &Light) -> bool {
        !self.surroundings.outside.is_vacuum() && light.is_infinite()
    }

    /// Finds the media around the camera, of which the file names `declared`, beyond the scene and around the lights.
    pub(super) fn find_surroundings(&self, declared: Option<MediumId>) -> Surroundings {
        if self.media.is_empty() {
            return Surroundings::default();
        }
        let mut tracer = self.tracer();
        let found = self.medium_at(self.camera.position(), Vec3::Z, &mut tracer);
        let outside = if found.is_none() { number_of(declared) } else { MediumNumber::VACUUM };
        let camera = match declared {
            Some(_) => number_of(declared),
            None => found.unwrap_or(outside),
        };
        let around = |light: &Light| {
            let sample = light.sample_emission([0.5; 2], [0.5; 2]).filter(|_| !light.is_infinite())?;
            let (o, d) = match sample.end.segment_end()? {
                SegmentEnd::Surface { p, error, ng } => (offset_point(p, error, ng, ng), ng),
                SegmentEnd::Free(p) => (p, Vec3::Z),
            };
            self.medium_at(o, d, &mut self.tracer())
        };
        let lights = self.lights.iter().map(|(_, light)| around(light).unwrap_or(outside)).collect();
        Surroundings { camera, outside, lights }
    }

    /// The medium around a point: that before the first surface in the direction `d` that separates media; `None` if
    /// there is no such surface.
    fn medium_at(&self, o: Vec3, d: Vec3, tracer: &mut Tracer) -> Option<MediumNumber> {
        let mut ray = Ray { o, d, t_min: T_MIN, t_max: f32::INFINITY };
        for _ in 0..MOST_SURFACES {
            let hit = tracer.closest_of(&ray, SurfaceMask::ALL, RayKind::Mask)?;
            let (point, _) = self.surface_point(&hit);
            if let Some(medium) = self.medium_beside(&hit, -point.ng.dot(d)) {
                return Some(medium);
            }
            ray.o = offset_point(point.p, point.error, point.ng, d);
        }
        None
    }
}

/// Surfaces in a row that separate no media, of which more are not passed in the search for one that does.
const MOST_SURFACES: u32 = 10_000;
