//! Phase functions: how a point of a medium distributes the light that it scatters.
//!
//! A phase function p depends on the angle θ between the direction in which light travels before and after; with `wo`
//! and `wi` as everywhere (both leave the point) cos θ = −wo · wi. It is normalised over the sphere, symmetric in `wo`
//! and `wi`, and sampled exactly: the density of a direction is p itself. The scattering function of the point is σ_s p,
//! for radiance and importance alike.

use crate::math::{Frame, Rgb, SolidAnglePdf, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// A phase function of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PhaseLobe {
    /// 1 / 4π.
    Isotropic,
    /// (1 − g²) / (4π (1 + g² − 2 g cos θ)^(3/2)), with the mean cosine g in (−1, 1) (Henyey and Greenstein 1941).
    HenyeyGreenstein(f32),
    /// 3 (1 + cos² θ) / 16π: particles much smaller than the wavelength.
    Rayleigh,
}

/// The phase function of a medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// A mixture of both.
    pub lobes: [PhaseLobe; 2],
    /// Share of the second, in [0, 1].
    pub second: f32,
}

/// Scattering at a point of a medium: σ_s p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseScattering {
    /// Scattering coefficient σ_s per unit of length.
    pub sigma_s: Rgb,
    /// Largest albedo σ_s / σ_t of the channels.
    pub albedo: f32,
    /// p.
    pub phase: Phase,
}

/// Henyey–Greenstein with less anisotropy than this is isotropic in single precision.
const LEAST_G: f32 = 1e-3;

impl PhaseLobe {
    /// Density per steradian of a scattering angle with cosine `cos`.
    #[inline]
    fn eval(self, cos: f32) -> f32 {
        match self {
            PhaseLobe::Isotropic => 0.25 * FRAC_1_PI,
            PhaseLobe::HenyeyGreenstein(g) => {
                // 1 + g² − 2 g cos θ as a sum of positive terms: the difference cancels where light goes straight on.
                let (toward, away) = (1.0 - g.abs(), 1.0 - cos * g.signum());
                let base = toward * toward + 2.0 * g.abs() * away;
                0.25 * FRAC_1_PI * (1.0 - g * g) / (base * base.sqrt())
            }
            PhaseLobe::Rayleigh => 3.0 / 16.0 * FRAC_1_PI * (1.0 + cos * cos),
        }
    }

    /// Cosine of a scattering angle, drawn by `u` in [0, 1).
    #[inline]
    fn sample_cosine(self, u: f32) -> f32 {
        match self {
            PhaseLobe::HenyeyGreenstein(g) if g.abs() >= LEAST_G => {
                let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
                ((1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
            }
            PhaseLobe::Isotropic | PhaseLobe::HenyeyGreenstein(_) => 1.0 - 2.0 * u,
            PhaseLobe::Rayleigh => {
                // The root of the cubic c³ + 3 c = 8 u − 4.
                let v = 4.0 * u - 2.0;
                let w = (v + (v * v + 1.0).sqrt()).cbrt();
                (w - 1.0 / w).clamp(-1.0, 1.0)
            }
        }
    }

    /// Mean cosine of the scattering angle.
    fn mean_cosine(self) -> f32 {
        match self {
            PhaseLobe::HenyeyGreenstein(g) => g,
            PhaseLobe::Isotropic | PhaseLobe::Rayleigh => 0.0,
        }
    }
}

impl Phase {
    /// A phase function of one kind.
    pub fn single(lobe: PhaseLobe) -> Phase {
        Phase { lobes: [lobe; 2], second: 0.0 }
    }

    /// Value and density per steradian.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> f32 {
        let cos = -wo.dot(wi);
        let [first, second] = self.lobes;
        match self.second > 0.0 {
            false => first.eval(cos),
            true => first.eval(cos) * (1.0 - self.second) + second.eval(cos) * self.second,
        }
    }

    /// Draws a direction with the density [`Phase::eval`]; `u` = [lobe, cosine, azimuth].
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Vec3 {
        let cos = self.lobes[usize::from(u[0] < self.second)].sample_cosine(u[1]);
        let (sin, phi) = ((1.0 - cos * cos).max(0.0).sqrt(), TAU * u[2]);
        Frame::from_normal(-wo).to_world(Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)).normalize()
    }

    /// Mean cosine of the scattering angle.
    pub fn mean_cosine(&self) -> f32 {
        let [first, second] = self.lobes.map(PhaseLobe::mean_cosine);
        first * (1.0 - self.second) + second * self.second
    }
}

impl PhaseScattering {
    /// Nothing is scattered.
    pub const NONE: PhaseScattering = PhaseScattering {
        sigma_s: Rgb::BLACK,
        albedo: 0.0,
        phase: Phase { lobes: [PhaseLobe::Isotropic; 2], second: 0.0 },
    };

    /// σ_s p and p.
    #[inline]
    pub fn eval_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        let p = self.phase.eval(wo, wi);
        (self.sigma_s * p, SolidAnglePdf(p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phases() -> Vec<Phase> {
        use PhaseLobe::{HenyeyGreenstein, Isotropic, Rayleigh};
        let single = [Isotropic, Rayleigh, HenyeyGreenstein(0.0), HenyeyGreenstein(0.7), HenyeyGreenstein(-0.9)]
            .map(Phase::single);
        let blend = Phase { lobes: [HenyeyGreenstein(0.6), Rayleigh], second: 0.3 };
        single.into_iter().chain([blend]).collect()
    }

    /// ∫ p f(cos θ) over the sphere, by the midpoint rule in double precision.
    fn integral(phase: &Phase, f: impl Fn(f64) -> f64) -> f64 {
        let n = 200_000;
        let wo = -Vec3::Z;
        let term = |i: usize| {
            let cos = -1.0 + (2 * i + 1) as f64 / n as f64;
            let wi = Vec3::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
            f64::from(phase.eval(wo, wi)) * f(cos)
        };
        (0..n).map(term).sum::<f64>() * 4.0 * std::f64::consts::PI / n as f64
    }

    #[test]
    fn phase_functions_are_normalised_and_have_their_mean_cosine() {
        for phase in phases() {
            let (total, mean) = (integral(&phase, |_| 1.0), integral(&phase, |cos| cos));
            assert!((total - 1.0).abs() < 1e-4, "{phase:?}: {total}");
            assert!((mean - f64::from(phase.mean_cosine())).abs() < 1e-4, "{phase:?}: {mean}");
        }
    }

    /// χ² of the cosines of 10⁵ samples in 20 bins; the azimuth is uniform by construction and only its mean is tested.
    #[test]
    fn directions_are_drawn_by_the_phase_function() {
        const BINS: usize = 20;
        for phase in phases() {
            let wo = Vec3::new(0.48, -0.6, 0.64);
            let (samples, mut counts, mut sum) = (100_000_u32, [0.0; BINS], Vec3::ZERO);
            let mut rng = crate::math::hash::HashRng::from_key(7);
            for _ in 0..samples {
                let wi = phase.sample(wo, [rng.next_f32(), rng.next_f32(), rng.next_f32()]);
                let cos = f64::from(-wo.dot(wi)).clamp(-1.0, 1.0);
                counts[((cos + 1.0) / 2.0 * BINS as f64).min(BINS as f64 - 1.0) as usize] += 1.0;
                sum += wi;
            }
            let expected: Vec<f64> = (0..BINS)
                .map(|bin| {
                    let inside = |cos: f64| ((cos + 1.0) / 2.0 * BINS as f64) as usize == bin;
                    f64::from(samples) * integral(&phase, |cos| if inside(cos) { 1.0 } else { 0.0 })
                })
                .collect();
            let chi2: f64 = counts.iter().zip(&expected).map(|(n, e): (&f64, _)| (n - e) * (n - e) / e).sum();
            // 19 degrees of freedom: more than 45 once in a thousand.
            assert!(chi2 < 45.0, "{phase:?}: {chi2}");
            let mean = sum / samples as f32 + wo * phase.mean_cosine();
            assert!(mean.length() < 0.01, "{phase:?}: {mean}");
        }
    }

    #[test]
    fn phase_functions_are_reciprocal() {
        let (a, b) = (Vec3::new(0.36, 0.48, 0.8), Vec3::new(-0.6, 0.0, 0.8));
        for phase in phases() {
            assert_eq!(phase.eval(a, b), phase.eval(b, a), "{phase:?}");
        }
    }
}
