//! A latitude–longitude picture as environment, with Mitsuba 3's conventions.
//!
//! In light space +y is up. Column x + ½ of W lies at u = atan2(d.x, −d.z) / 2π (mod 1), so u = 0 looks along −z and u
//! = ¼ along +x; row y of H lies at θ = π y / (H − 1) from +y: the first and last rows are the poles. Radiance is
//! interpolated bilinearly. Directions are drawn from a bilinear density over the same grid: luminance times the mean
//! of sin θ around the row, which is positive at the poles too, so that no lit direction is without density. A texel
//! holds its radiance and its density side by side: both come from one look-up.

use super::EmitError;
use super::orientation::Orientation;
use crate::image::Image;
use crate::math::piecewise::{CellGrid, invert_in_cell, sample_in_cell};
use crate::math::trig::atan2;
use crate::math::{DMat4, Rgb, SolidAnglePdf, Vec3};
use glam::Vec4;
use std::f32::consts::{PI, TAU};

/// A latitude–longitude picture.
#[derive(Clone, Debug)]
pub struct EnvMap {
    width: usize,
    height: usize,
    /// Red, green, blue, and the density per unit area of the grid.
    texels: Vec<Vec4>,
    orientation: Orientation,
    /// Cells between texels, the last of a row between its last and first; `None` if the picture is black.
    cells: Option<CellGrid>,
}

/// sin θ is kept from zero: at the very pole the density per steradian is finite, and the same for sampling and
/// evaluation.
const MIN_SIN: f32 = 1e-6;

impl EnvMap {
    /// From a picture, a factor, and the transform light → world (its rotation counts). Texels that are negative or not
    /// finite are black.
    pub fn new(image: &Image, scale: f32, to_world: DMat4) -> Result<EnvMap, EmitError> {
        let orientation = Orientation::new(to_world).ok_or(EmitError::Transform("environment map"))?;
        let pixels = f64::from(image.width) * f64::from(image.height);
        super::in_range("number of pixels of the environment map", pixels, pixels > 0.0, "positive")?;
        super::in_range("scale", f64::from(scale), scale >= 0.0 && scale.is_finite(), "at least 0")?;
        let width = image.width as usize;
        // A single row stands for both poles and all between.
        let height = image.height.max(2) as usize;
        let clean = |v: f32| if (v * scale).is_finite() { (v * scale).max(0.0) } else { 0.0 };
        let mut texels: Vec<Vec4> = (0..height)
            .flat_map(|y| (0..image.width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let rgb = image.rgb(x, (y as u32).min(image.height - 1)).map(clean);
                let density = f64::from(rgb.luminance()) * row_weight(y, height);
                Vec4::new(rgb.r, rgb.g, rgb.b, density as f32)
            })
            .collect();

        let at = |x: usize, y: usize| f64::from(texels[y * width + x % width].w);
        let mass = |x, y| 0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1));
        let cells = CellGrid::new([width, height - 1], mass);
        if let Some(cells) = &cells {
            let scale = (width * (height - 1)) as f64 / cells.total();
            texels.iter_mut().for_each(|t| t.w = (f64::from(t.w) * scale) as f32);
        }
        Ok(EnvMap { width, height, texels, orientation, cells })
    }

    /// Position of a light-space direction on the grid: u from the first column's centre, v from the upper pole, both
    /// in [0, 1].
    fn direction_to_grid(&self, d: Vec3) -> ([f32; 2], f32) {
        let u = atan2(d.x, -d.z) / TAU - 0.5 / self.width as f32;
        let sin = (d.x * d.x + d.z * d.z).sqrt();
        // atan2 keeps its precision near the poles, where acos loses it.
        let v = atan2(sin, d.y) / PI;
        ([(u - u.floor()).clamp(0.0, 1.0), v.clamp(0.0, 1.0)], sin)
    }

    fn grid_to_direction(&self, p: [f32; 2]) -> Vec3 {
        let (sin_phi, cos_phi) = (TAU * (p[0] + 0.5 / self.width as f32)).sin_cos();
        let (sin, cos) = (PI * p[1]).sin_cos();
        Vec3::new(sin * sin_phi, cos, -sin * cos_phi)
    }

    /// The texels at the corners of the cell (i, j), row by row.
    #[inline]
    fn corners(&self, [i, j]: [usize; 2]) -> [Vec4; 4] {
        let next = if i + 1 == self.width { 0 } else { i + 1 };
        let (upper, lower) = (&self.texels[j * self.width..], &self.texels[(j + 1) * self.width..]);
        [upper[i], upper[next], lower[i], lower[next]]
    }

    /// Radiance in the world direction `dir`, and the density of [`EnvMap::sample`] there.
    #[inline]
    pub fn look_up(&self, dir: Vec3) -> (Rgb, SolidAnglePdf) {
        let ([u, v], sin) = self.direction_to_grid(self.orientation.to_local(dir));
        let (x, y) = (u * self.width as f32, v * (self.height - 1) as f32);
        let (i, j) = ((x as usize).min(self.width - 1), (y as usize).min(self.height - 2));
        let (s, t) = (x - i as f32, y - j as f32);
        let [a, b, c, d] = self.corners([i, j]);
        let texel = a.lerp(b, s).lerp(c.lerp(d, s), t);
        let pdf = texel.w / (2.0 * PI * PI * sin.max(MIN_SIN));
        (Rgb::new(texel.x, texel.y, texel.z), SolidAnglePdf(pdf))
    }

    /// Radiance in the world direction `dir`.
    pub fn radiance(&self, dir: Vec3) -> Rgb {
        self.look_up(dir).0
    }

    /// Draws a world direction; `None` if the picture is black or the direction has no density.
    pub fn sample(&self, u: [f32; 2]) -> Option<(Vec3, SolidAnglePdf)> {
        self.sample_radiance(u).map(|(dir, pdf, _)| (dir, pdf))
    }

    /// [`EnvMap::sample`], with the radiance of the direction.
    pub fn sample_radiance(&self, u: [f32; 2]) -> Option<(Vec3, SolidAnglePdf, Rgb)> {
        let (cell, u) = self.cells.as_ref()?.choose(u);
        let [s, t] = sample_in_cell(self.corners(cell).map(|texel| texel.w), u);
        let p = [(cell[0] as f32 + s) / self.width as f32, (cell[1] as f32 + t) / (self.height - 1) as f32];
        let dir = self.orientation.to_world(self.grid_to_direction(p)).normalize();
        // Looked up again from the direction: rounding must not make the two densities differ.
        let (radiance, pdf) = self.look_up(dir);
        (pdf.0 > 0.0).then_some((dir, pdf, radiance))
    }

    /// Density of [`EnvMap::sample`] per steradian.
    pub fn pdf(&self, dir: Vec3) -> SolidAnglePdf {
        self.look_up(dir).1
    }

    /// The numbers that [`EnvMap::sample`] maps to the world direction `dir`; `None` if the picture is black.
    pub fn invert(&self, dir: Vec3) -> Option<[f32; 2]> {
        let ([u, v], _) = self.direction_to_grid(self.orientation.to_local(dir));
        let (x, y) = (u * self.width as f32, v * (self.height - 1) as f32);
        let cell = [(x as usize).min(self.width - 1), (y as usize).min(self.height - 2)];
        let place = [x - cell[0] as f32, y - cell[1] as f32];
        let inside = invert_in_cell(self.corners(cell).map(|texel| texel.w), place);
        Some(self.cells.as_ref()?.invert(cell, inside))
    }

    /// ∫ radiance over the sphere, exact for the interpolated picture.
    pub fn integral(&self) -> Rgb {
        let dphi = std::f64::consts::TAU / self.width as f64;
        let mut sum = [0.0f64; 3];
        for (y, row) in self.texels.chunks_exact(self.width).enumerate() {
            let w = row_weight(y, self.height) * dphi;
            for c in 0..3 {
                sum[c] += w * row.iter().map(|t| f64::from(t[c])).sum::<f64>();
            }
        }
        Rgb::from(sum.map(|s| s as f32))
    }
}

/// ∫ sin θ · hat(θ) dθ around row `y`, the hat function of linear interpolation between `height` rows.
fn row_weight(y: usize, height: usize) -> f64 {
    let h = std::f64::consts::PI / (height - 1) as f64;
    if y == 0 || y + 1 == height { 1.0 - h.sin() / h } else { (h * y as f64).sin() * 2.0 * (1.0 - h.cos()) / h }
}
