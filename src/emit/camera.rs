//! Perspective cameras with a pinhole or a thin lens, from both ends: rays into the scene, and connections to the lens.
//!
//! Measures. Raster coordinates are in pixels of the full film, (0, 0) at the top left. A camera ray is drawn with a
//! lens point uniform in area (1 / A; a pinhole counts as A = 1, its density is discrete) and a raster position uniform
//! in its pixel (density 1 per pixel area). With N pixels on the film, whose image at distance one along the axis has
//! the area F, the direction has the density N / (F cos³θ) per steradian; it is the same for every lens point, since
//! the plane in focus is parallel to the film. The importance of the film is
//!
//! W_e = N / (A F cos⁴θ), so that ∫∫ W_e cos θ dω dA over the rays of one pixel is 1:
//!
//! a pixel measures the mean radiance over its area, and a camera ray drawn as above has throughput W_e cos θ / (p_A
//! p_ω) = 1. Over the whole film the integral is N: a light image divides by the number of light sub-paths and nothing
//! else. (Veach 1997, §4.3.2; Pharr et al. 2016, §16.1.1, where N = 1.)

use super::orientation::Orientation;
use super::{EmitError, PixelFilter, in_range};
use crate::math::warp::square_to_disk;
use crate::math::{AreaPdf, DVec3, SolidAnglePdf, Vec2, Vec3};
use crate::scene::{FovAxis, SensorDesc};
use std::f32::consts::PI;

/// A ray from the camera.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// Point of the lens.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Distance along the ray of the near clipping plane.
    pub t_near: f32,
    /// Distance along the ray of the far clipping plane.
    pub t_far: f32,
}

/// A connection from a point of the scene to the lens.
#[derive(Clone, Copy, Debug)]
pub struct LensSample {
    /// Point of the lens.
    pub p: Vec3,
    /// Where the segment passes the near clipping plane: nothing between it and `p` blocks the view.
    pub p_near: Vec3,
    /// Unit direction from the point of the scene to the lens.
    pub wi: Vec3,
    /// Length of the segment to `p`.
    pub distance: f32,
    /// Cosine between the segment and the viewing axis.
    pub cos: f32,
    /// Where the point is seen, in pixels of the full film.
    pub raster: [f32; 2],
    /// W_e of the ray (see the module's head).
    pub importance: f32,
    /// Density of the lens point per unit area; 1 for a pinhole.
    pub pdf: AreaPdf,
    /// W_e · cos / (distance² · pdf): times the throughput and the cosine weighted BSDF at the point, and divided by
    /// the number of light sub-paths, it is the pixel's value.
    pub weight: f32,
}

impl LensSample {
    /// Density per steradian with which a camera ray from the same lens point has this direction.
    pub fn pdf_direction(&self) -> SolidAnglePdf {
        SolidAnglePdf(self.importance * self.cos / self.pdf.0)
    }
}

/// Half extents, at distance one, of a picture that is seen under the angle `fov` (degrees) along an axis; `aspect` is
/// its width over its height.
pub(super) fn half_extents(fov: f64, axis: FovAxis, aspect: f64) -> Vec2 {
    let tan = (0.5 * fov.to_radians()).tan();
    let half_x = match axis {
        FovAxis::X => tan,
        FovAxis::Y => tan * aspect,
        FovAxis::Diagonal => tan / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
        FovAxis::Smaller => tan * aspect.max(1.0),
        FovAxis::Larger => tan * aspect.min(1.0),
    };
    Vec2::new(half_x as f32, (half_x / aspect) as f32)
}

/// A camera.
#[derive(Clone, Debug)]
pub struct Camera {
    position: Vec3,
    /// +x is to the left of the picture, +y up, +z into the scene.
    orientation: Orientation,
    /// Half extents of the film's image at distance one.
    half: Vec2,
    size: Vec2,
    principal: Vec2,
    near: f32,
    far: f32,
    lens_radius: f32,
    focus: f32,
    /// Raster positions that can reach the picture: crop window and half width of the pixel filter.
    bounds: [Vec2; 2],
}

impl Camera {
    /// From its description, for a scene whose centre is `centre`.
    pub fn new(desc: &SensorDesc, centre: DVec3) -> Result<Camera, EmitError> {
        let film = &desc.film;
        let (w, h) = (f64::from(film.width), f64::from(film.height));
        in_range("film width", w, w > 0.0, "positive")?;
        in_range("film height", h, h > 0.0, "positive")?;
        in_range("fov", desc.fov, desc.fov > 0.0 && desc.fov < 180.0, "between 0 and 180 degrees")?;
        in_range("near_clip", desc.near_clip, desc.near_clip >= 0.0, "at least 0")?;
        in_range("far_clip", desc.far_clip, desc.far_clip > desc.near_clip, "beyond near_clip")?;
        let lens = desc.aperture_radius;
        in_range("aperture_radius", lens, lens >= 0.0 && lens.is_finite(), "at least 0")?;
        if lens > 0.0 {
            let focus = desc.focus_distance;
            in_range("focus_distance", focus, focus > 0.0 && focus.is_finite(), "positive")?;
        }

        let orientation = Orientation::new(desc.to_world).ok_or(EmitError::Transform("camera"))?;
        let position = (desc.to_world.w_axis.truncate() - centre).as_vec3();
        if !position.is_finite() {
            return Err(EmitError::Transform("camera"));
        }

        let margin = (PixelFilter::new(film.filter).radius() - 0.5).max(0.0);
        let [cx, cy, cw, ch] = film.crop.unwrap_or([0, 0, film.width, film.height]).map(|v| v as f32);
        Ok(Camera {
            position,
            orientation,
            half: half_extents(desc.fov, desc.fov_axis, w / h),
            size: Vec2::new(w as f32, h as f32),
            principal: Vec2::new(desc.principal_point[0] as f32, desc.principal_point[1] as f32),
            near: desc.near_clip as f32,
            far: desc.far_clip as f32,
            lens_radius: lens as f32,
            focus: if lens > 0.0 { desc.focus_distance as f32 } else { 1.0 },
            bounds: [Vec2::new(cx - margin, cy - margin), Vec2::new(cx + cw + margin, cy + ch + margin)],
        })
    }

    /// Centre of the lens.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Unit viewing axis.
    pub fn axis(&self) -> Vec3 {
        self.orientation.z()
    }

    /// The point at which the ray from the lens point `p` in the unit direction `direction` passes the near clipping plane.
    pub fn near_point(&self, p: Vec3, direction: Vec3) -> Vec3 {
        p + direction * (self.near / direction.dot(self.axis()))
    }

    /// The camera has no lens: its position is a delta.
    pub fn is_pinhole(&self) -> bool {
        self.lens_radius == 0.0
    }

    fn lens_point(&self, u: [f32; 2]) -> Vec3 {
        if self.is_pinhole() { Vec3::ZERO } else { (square_to_disk(u) * self.lens_radius).extend(0.0) }
    }

    /// Density of lens points per unit area; 1 for a pinhole.
    pub fn pdf_lens(&self) -> AreaPdf {
        AreaPdf(if self.is_pinhole() { 1.0 } else { 1.0 / (PI * self.lens_radius * self.lens_radius) })
    }

    /// Density per steradian of the directions of one pixel at the cosine `cos` to the axis.
    fn direction_density(&self, cos: f32) -> f32 {
        self.size.x * self.size.y / (4.0 * self.half.x * self.half.y * cos * cos * cos)
    }

    /// Raster position of the ray from the lens point `lens` in the direction `d` (both local, `d.z` > 0).
    fn raster(&self, lens: Vec3, d: Vec3) -> Vec2 {
        let on_plane = Vec2::new(lens.x, lens.y) / self.focus + Vec2::new(d.x, d.y) / d.z;
        ((Vec2::ONE - on_plane / self.half) * 0.5 - self.principal) * self.size
    }

    fn reaches_picture(&self, raster: Vec2) -> bool {
        raster.cmpge(self.bounds[0]).all() && raster.cmple(self.bounds[1]).all()
    }

    /// The ray through a raster position (pixels of the full film) and a point of the lens.
    #[inline]
    pub fn sample_ray(&self, raster: [f32; 2], lens_u: [f32; 2]) -> CameraRay {
        let on_plane = (Vec2::ONE - self.principal * 2.0 - Vec2::from(raster) * (2.0 / self.size)) * self.half;
        let lens = self.lens_point(lens_u);
        // Scaled so that its z component is one: the planes of the clipping distances are then that many lengths away.
        let d = (on_plane - lens.truncate() / self.focus).extend(1.0);
        let length = d.length();
        CameraRay {
            origin: self.position + self.orientation.to_world(lens),
            direction: self.orientation.to_world(d).normalize(),
            t_near: self.near * length,
            t_far: self.far * length,
        }
    }

    /// Connects the point `from` to a point of the lens; `None` if it is not seen in the picture.
    pub fn sample_lens(&self, from: Vec3, u: [f32; 2]) -> Option<LensSample> {
        let lens = self.lens_point(u);
        let p = self.position + self.orientation.to_world(lens);
        let view = self.orientation.to_local(from - p);
        let distance = view.length();
        if !(view.z > 0.0 && view.z >= self.near && view.z <= self.far && distance.is_finite()) {
            return None;
        }
        let raster = self.raster(lens, view);
        if !self.reaches_picture(raster) {
            return None;
        }
        let cos = view.z / distance;
        let pdf = self.pdf_lens();
        let importance = self.direction_density(cos) * pdf.0 / cos;
        Some(LensSample {
            p,
            p_near: p + (from - p) * (self.near / view.z),
            wi: (p - from) / distance,
            distance,
            cos,
            raster: raster.to_array(),
            importance,
            pdf,
            weight: importance * cos / (distance * distance * pdf.0),
        })
    }

    /// Connects a point of the lens to infinity in the unit direction `direction` from the camera; `None` if that
    /// direction is not in the picture. The weight has no distance: W_e · cos / pdf. `distance` is what lies between
    /// the clipping planes: only things on that way, from `p_near` on, can block the view.
    pub fn sample_lens_at_infinity(&self, direction: Vec3, u: [f32; 2]) -> Option<LensSample> {
        let lens = self.lens_point(u);
        let d = self.orientation.to_local(direction);
        if d.z <= 0.0 {
            return None;
        }
        let raster = self.raster(lens, d);
        if !self.reaches_picture(raster) {
            return None;
        }
        let p = self.position + self.orientation.to_world(lens);
        let pdf = self.pdf_lens();
        let importance = self.direction_density(d.z) * pdf.0 / d.z;
        Some(LensSample {
            p,
            p_near: p + direction * (self.near / d.z),
            wi: -direction,
            distance: (self.far - self.near) / d.z,
            cos: d.z,
            raster: raster.to_array(),
            importance,
            pdf,
            weight: importance * d.z / pdf.0,
        })
    }

    /// Densities of a ray that [`Camera::sample_ray`] drew: of its lens point per unit area (1 for a pinhole) and of
    /// its direction per steradian.
    pub fn pdf_sampled_ray(&self, direction: Vec3) -> (AreaPdf, SolidAnglePdf) {
        (self.pdf_lens(), SolidAnglePdf(self.direction_density(self.axis().dot(direction))))
    }

    /// Densities of a camera ray from the lens point `origin` in the unit direction `direction`: of the lens point per
    /// unit area (1 for a pinhole) and of the direction per steradian (zero outside of the picture).
    pub fn pdf_ray(&self, origin: Vec3, direction: Vec3) -> (AreaPdf, SolidAnglePdf) {
        let d = self.orientation.to_local(direction);
        if d.z > 0.0 && self.reaches_picture(self.raster(self.orientation.to_local(origin - self.position), d)) {
            (self.pdf_lens(), SolidAnglePdf(self.direction_density(d.z)))
        } else {
            (self.pdf_lens(), SolidAnglePdf(0.0))
        }
    }
}
