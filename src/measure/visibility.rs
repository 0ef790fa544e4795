//! Cost of pixels, and the part of it that is lost to blocked connections: single samples are run again and counted.

use crate::integrators::{Iteration, Replay};
use crate::math::Rgb;
use crate::prepared::PreparedScene;
use crate::render::Method;
use rayon::prelude::*;
use serde::Serialize;
use std::time::{Duration, Instant};

/// Counts of samples of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelCost {
    /// Rays: edges of both sub-paths and shadow rays.
    pub rays: f32,
    /// Contributions that needed a shadow ray, and those that were blocked.
    pub shadow: [f32; 2],
    /// Luminance of the contributions that arrived, and of the blocked ones.
    pub light: [f32; 2],
}

/// All pixels of a coarse picture.
#[derive(Clone, Debug)]
pub struct CostMap {
    /// Pixels of the picture along a side of one of these.
    pub step: u32,
    /// Width and height.
    pub size: [u32; 2],
    /// Samples of each pixel that were counted.
    pub samples: u32,
    /// Sums over these, row by row.
    pub pixels: Vec<PixelCost>,
}

/// Cost of visibility over the whole map.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct VisibilityCost {
    /// Samples counted.
    pub samples: usize,
    /// Rays per sample.
    pub rays_per_sample: f64,
    /// Share of the contributions that needed a shadow ray and were blocked.
    pub blocked_contributions: f64,
    /// Share of these contributions in all light, had they not been blocked.
    pub blocked_light: f64,
}

impl PixelCost {
    fn add(&mut self, o: &PixelCost) {
        self.rays += o.rays;
        for (a, b) in self.shadow.iter_mut().chain(&mut self.light).zip(o.shadow.iter().chain(&o.light)) {
            *a += b;
        }
    }
}

/// Number of samples of a pixel that a map aims at.
const PASSES: f64 = 8.0;

fn count(replay: &Replay) -> PixelCost {
    let mut cost = PixelCost { rays: (replay.eye.len() + replay.light.len()) as f32, ..PixelCost::default() };
    for c in &replay.contributions {
        let light = (c.raw * c.weight).luminance();
        // Without a light vertex the walk itself met the light.
        if c.s > 0 {
            cost.rays += 1.0;
            cost.shadow[0] += 1.0;
            cost.shadow[1] += f32::from(u8::from(!c.visible));
        }
        if light.is_finite() {
            cost.light[usize::from(!c.visible)] += light;
        }
    }
    cost
}

impl CostMap {
    /// Runs samples of every pixel, or of as many pixels as leave time for several samples of each, for about `time`.
    /// On the current thread pool.
    pub fn measure(scene: &PreparedScene, method: &Method, seed: u64, time: Duration) -> CostMap {
        let [x0, y0, width, height] = scene.window;
        let pass = |step: u32, more: u64| -> Vec<PixelCost> {
            let size = [width.div_ceil(step), height.div_ceil(step)];
            (0..size[0] * size[1])
                .into_par_iter()
                .map_init(
                    || method.build(),
                    |integrator, i| {
                        let (x, y) = (i % size[0] * step + step / 2, i / size[0] * step + step / 2);
                        let pixel = (x0 + x.min(width - 1), y0 + y.min(height - 1));
                        count(&integrator.replay(&Iteration::new(scene, seed.wrapping_add(more), 0), pixel))
                    },
                )
                .collect()
        };
        // One sample tells how many a coarse map may have, and that how long a fine one takes. Methods that learn
        // prepare a whole iteration for every sample.
        let start = Instant::now();
        let alone = Iteration::new(scene, seed, 0);
        method.build().replay(&alone, (x0 + width / 2, y0 + height / 2));
        let few = (0.25 * time.as_secs_f64() / start.elapsed().as_secs_f64().max(1e-6)).clamp(16.0, 256.0);
        let start = Instant::now();
        let mut step = (((f64::from(width) * f64::from(height)) / few).sqrt().ceil() as u32).max(1);
        let mut pixels = pass(step, 0);
        let affordable = (time.as_secs_f64() / PASSES / start.elapsed().as_secs_f64().max(1e-6)).sqrt();
        let finer = (f64::from(step) / affordable.max(1.0)).ceil().max(1.0) as u32;
        if finer < step {
            step = finer;
            pixels = pass(step, 0);
        }
        let mut samples = 1;
        while start.elapsed().mul_f64(f64::from(samples + 1) / f64::from(samples)) < time {
            pixels.iter_mut().zip(pass(step, samples.into())).for_each(|(sum, more)| sum.add(&more));
            samples += 1;
        }
        CostMap { step, size: [width.div_ceil(step), height.div_ceil(step)], samples, pixels }
    }

    /// Rays of every pixel as grey values, relative to the mean: two is twice as dear as the average pixel.
    pub fn cost_picture(&self) -> Vec<Rgb> {
        let mean = self.pixels.iter().map(|p| p.rays).sum::<f32>() / self.pixels.len().max(1) as f32;
        self.pixels.iter().map(|p| Rgb::grey(p.rays / mean.max(1e-9))).collect()
    }

    /// Share of a pixel's shadow rays that were blocked, 0 … 1; black where there were none.
    pub fn blocked_picture(&self) -> Vec<Rgb> {
        self.pixels.iter().map(|p| Rgb::grey(p.shadow[1] / p.shadow[0].max(1.0))).collect()
    }

    /// Share of blocked contributions in a pixel's light, had they not been blocked, 0 … 1.
    pub fn lost_light_picture(&self) -> Vec<Rgb> {
        self.pixels.iter().map(|p| Rgb::grey(p.light[1] / (p.light[0] + p.light[1]).max(1e-30))).collect()
    }

    /// Sums over all pixels.
    pub fn visibility_cost(&self) -> VisibilityCost {
        let sum = |of: fn(&PixelCost) -> f32| self.pixels.iter().map(|p| f64::from(of(p))).sum::<f64>();
        let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        let (arrived, blocked) = (sum(|p| p.light[0]), sum(|p| p.light[1]));
        VisibilityCost {
            samples: self.pixels.len() * self.samples as usize,
            rays_per_sample: share(sum(|p| p.rays), self.pixels.len() as f64 * f64::from(self.samples)),
            blocked_contributions: share(sum(|p| p.shadow[1]), sum(|p| p.shadow[0])),
            blocked_light: share(blocked, arrived + blocked),
        }
    }
}
