//! Auxiliary layers: what the camera sees first, averaged over a few rays per pixel. They need no integrator. Rays go
//! through the holes of masks by chance, as walks do.

use crate::film::Film;
use crate::image::Layer;
use crate::math::Vec3;
use crate::math::sampler::PathSampler;
use crate::path::{first_seen, streams};
use crate::prepared::PreparedScene;
use crate::ray::Ray;
use rayon::prelude::*;

/// Rays per pixel; auxiliary layers converge quickly.
const RAYS: u64 = 16;

/// A layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Approximate albedo of the first surface.
    Albedo,
    /// Shading normal of the first surface in world space.
    Normal,
    /// Distance of the first surface from the camera.
    Depth,
}

impl Aov {
    /// Every layer with its name.
    pub const ALL: [(&'static str, Aov); 3] = [("albedo", Aov::Albedo), ("normal", Aov::Normal), ("depth", Aov::Depth)];
}

/// Renders the layers asked for, for the window of `film`. Pixels (or parts of them) that see nothing are zero.
pub fn layers(scene: &PreparedScene, film: &Film, seed: u64, wanted: &[Aov]) -> Vec<Layer> {
    if wanted.is_empty() {
        return vec![];
    }
    let width = film.width;
    let pixels: Vec<[f32; 7]> = (0..film.width * film.height)
        .into_par_iter()
        .map(|i| pixel(scene, film.x0 + i % width, film.y0 + i / width, seed))
        .collect();
    let channel = |c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
    wanted
        .iter()
        .map(|aov| {
            let (name, channels) = match aov {
                Aov::Albedo => ("albedo", vec![("R", channel(0)), ("G", channel(1)), ("B", channel(2))]),
                Aov::Normal => ("normal", vec![("X", channel(3)), ("Y", channel(4)), ("Z", channel(5))]),
                Aov::Depth => ("depth", vec![("Z", channel(6))]),
            };
            Layer { name: name.into(), channels }
        })
        .collect()
}

fn pixel(scene: &PreparedScene, x: u32, y: u32, seed: u64) -> [f32; 7] {
    let mut tracer = scene.tracer();
    let mut sum = [0.0f32; 7];
    let index = u64::from(y) * u64::from(scene.film_size[0]) + u64::from(x);
    for k in 0..RAYS {
        let mut sampler = PathSampler::new(seed, streams::AUXILIARY, index, k);
        let u = sampler.origin();
        let eye = scene.camera.sample_ray([x as f32 + u[0], y as f32 + u[1]], [u[2], u[3]]);
        let ray = Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far };
        let Some((hit, point, material)) = first_seen(scene, &ray, &mut tracer, sampler.rng()) else { continue };
        let albedo = material.resolve(&point, -ray.d).albedo();
        let n: Vec3 = point.frame.n;
        let depth = (f64::from(hit.t) * scene.unit) as f32;
        for (s, v) in sum.iter_mut().zip([albedo.r, albedo.g, albedo.b, n.x, n.y, n.z, depth]) {
            *s += v / RAYS as f32;
        }
    }
    sum
}
