//! Do directions come with the density that is claimed? χ² tests of every material, and the integrals of the densities.

use super::*;
use crate::shade::{Bsdf, Transport};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f32::consts::PI;

const THETA_BINS: usize = 20;
const PHI_BINS: usize = 24;
/// Midpoints per bin and axis.
const SUB: usize = 10;
const SAMPLES: usize = 50_000;

fn bin_of(v: Vec3) -> usize {
    let theta = v.z.clamp(-1.0, 1.0).acos() / PI;
    let phi = v.y.atan2(v.x) / (2.0 * PI) + 0.5;
    let index = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
    index(theta, THETA_BINS) * PHI_BINS + index(phi, PHI_BINS)
}

/// Integral of the density over each bin.
fn expected(bsdf: &Bsdf, wo: Vec3) -> Vec<f64> {
    let mut bins = vec![0.0f64; THETA_BINS * PHI_BINS];
    let (nt, np) = (THETA_BINS * SUB, PHI_BINS * SUB);
    let cell = f64::from(PI) / nt as f64 * 2.0 * f64::from(PI) / np as f64;
    for t in 0..nt {
        let (sin, cos) = ((t as f32 + 0.5) / nt as f32 * PI).sin_cos();
        for p in 0..np {
            let (s, c) = (((p as f32 + 0.5) / np as f32 - 0.5) * 2.0 * PI).sin_cos();
            let pdf = bsdf.pdf(wo, Vec3::new(sin * c, sin * s, cos), Transport::Radiance);
            bins[t / SUB * PHI_BINS + p / SUB] += f64::from(pdf.0 * sin) * cell;
        }
    }
    bins
}

/// The probability of a χ² statistic at least as large, bins of small expectation pooled.
fn p_value(expected: &[f64], observed: &[u32]) -> f64 {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let (mut chi2, mut dof, mut pool_e, mut pool_o) = (0.0, -1.0, 0.0, 0.0);
    for i in order {
        pool_e += expected[i];
        pool_o += f64::from(observed[i]);
        if pool_e >= 5.0 {
            chi2 += (pool_o - pool_e) * (pool_o - pool_e) / pool_e;
            dof += 1.0;
            (pool_e, pool_o) = (0.0, 0.0);
        }
    }
    if dof < 1.0 { 1.0 } else { ChiSquared::new(dof).map_or(0.0, |d| d.sf(chi2)) }
}

#[test]
fn directions_follow_their_density() {
    let views = [Vec3::new(0.3, 0.2, 0.8), Vec3::new(-0.8, 0.5, 0.25), Vec3::new(0.3, -0.2, -0.7)].map(Vec3::normalize);
    let tests = ZOO.all().count() * views.len();
    // Šidák's correction of a significance of 1e-3.
    let significance = 1.0 - (1.0f64 - 1e-3).powf(1.0 / tests as f64);
    let mut failures = String::new();
    for (m, (name, material)) in ZOO.all().enumerate() {
        for (v, &wo) in views.iter().enumerate() {
            let bsdf = material.resolve(&leaning(), wo);
            let mut rng = HashRng::new(11, m as u64, v as u64, 0);
            let mut observed = vec![0u32; THETA_BINS * PHI_BINS];
            let (mut smooth, mut delta) = (0u32, 0u32);
            for _ in 0..SAMPLES {
                match bsdf.sample(wo, next3(&mut rng), Transport::Radiance) {
                    Some(s) if s.delta => delta += 1,
                    Some(s) => {
                        smooth += 1;
                        observed[bin_of(s.wi)] += 1;
                    }
                    None => {}
                }
            }
            let n = SAMPLES as f64;
            let probability = expected(&bsdf, wo);
            let integral: f64 = probability.iter().sum();
            let fraction = f64::from(smooth) / n;
            let sigma = (fraction * (1.0 - fraction) / n).sqrt();
            if (integral - fraction).abs() > 4.5 * sigma + 4e-3 {
                failures += &format!(
                    "\n{name} from {wo}: densities integrate to {integral}, drawn {fraction}, discrete {delta}"
                );
            }
            // Given that a direction was drawn: the shape of the density.
            let scaled: Vec<f64> = probability.iter().map(|p| p / integral.max(1e-9) * f64::from(smooth)).collect();
            let p = p_value(&scaled, &observed);
            if p < significance {
                failures += &format!("\n{name} from {wo}: p = {p:e}");
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}
