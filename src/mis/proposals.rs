//! The factor c of a connection where weights ask cache points what these can draw.
//!
//! *Split*, as published: an eye vertex chooses one of its n nearest cache points or a *virtual* one, each with probability 1/(n + 1), and draws a light sub-path
//! by that one's probabilities alone; the virtual one draws uniformly (Nabata et al. 2020, "Resampling-aware weighting functions",
//! §5.2). Proposal i then aims at q̂_i, the light that the sub-path brings to cache point i, what is in the way included, and has the factor
//!
//! c_i = [ 1/M + (1 − 1/M) · p/q_i ]⁻¹ with q_i = q̂_i/Q_i,   c_i = 0 where q̂_i = 0,   c = Σ_i c_i / (n + 1),
//!
//! and with two stages c_i = [ 1/M + (1 − 1/M) ( (1/M₂) p/q₁ + (1 − 1/M₂) p/q₂ ) ]⁻¹, q₁ being that of cache point i with nothing in the
//! way. The virtual one has q = p/L where L vertices per sub-path are drawn from alike; with two stages it draws from what the first left,
//! whose density is the cache points' mean q₁.
//!
//! *Asked*: the proposals are one mixture, Σ_i P_i/(n + 1), whose density is q = Σ_i q_i/(n + 1); c is that of one such proposal.
//!
//! Unlike the factor that only assumes ([`Resampled::factor`]) these need shadow rays from every cache point, for every technique of
//! every path; they know in return exactly which sub-paths each cache point can draw.

use super::resampled::{Form, Resampled, Targets};
use crate::math::Rgb;
use crate::spatial::nearest::MOST;

/// What a cache point is to one light vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Proposal {
    /// ρ G V from the light vertex to the cache point, to be multiplied by β_L there; zero if something is in the way.
    pub scattered: Rgb,
    /// The same with nothing in the way; used of sites of importance caching only.
    pub open: Rgb,
    /// G: without ρ, and nothing in the way.
    pub unscattered: f32,
    /// Number of the site of importance caching.
    pub site: u32,
    /// Q of both targets at the cache point.
    pub all: Targets,
}

/// The cache points near an eye vertex, as seen from a light vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Proposals {
    /// How many there are.
    pub count: usize,
    /// These.
    pub each: [Proposal; MOST],
}

/// c_i / (n + 1) of each cache point, in order, and of the virtual one after them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares([f32; MOST + 1]);

impl Proposals {
    /// No cache points.
    pub const NONE: Proposals = {
        let all = Targets { scattered: 0.0, unscattered: 0.0 };
        Proposals {
            count: 0,
            each: [Proposal { scattered: Rgb::BLACK, open: Rgb::BLACK, unscattered: 0.0, site: 0, all }; MOST],
        }
    };
}

impl Shares {
    /// That of proposal `i`.
    pub fn of(&self, i: usize) -> f32 {
        self.0[i]
    }

    /// c.
    pub fn sum(&self) -> f32 {
        self.0.iter().sum()
    }
}

impl Resampled {
    /// c of a connection to a light vertex at which the light β_L = `arriving` is.
    pub fn factor_of(&self, arriving: Rgb, proposals: &Proposals) -> f32 {
        if self.form == Form::Split {
            return self.shares(arriving, proposals).sum();
        }
        let near = &proposals.each[..proposals.count];
        let p_over = |q_over_p| self.p_over(q_over_p);
        let sum = |of: &dyn Fn(&Proposal) -> f32| near.iter().map(of).sum::<f32>();
        let all = sum(&|p| p.all.unscattered);
        let uniform = match self.second_stage {
            Some(_) if all > 0.0 => arriving.luminance() * sum(&|p| p.unscattered) / all,
            _ => 1.0 / self.vertices_per_path,
        };
        // Where a cache point knows of no light, its share of the mixture is uniform, too.
        let known = |p: &Proposal| match p.all.scattered > 0.0 {
            true => (arriving * p.scattered).luminance() / p.all.scattered,
            false => uniform,
        };
        self.factor_with(p_over(uniform), p_over((sum(&known) + uniform) / (near.len() + 1) as f32))
    }

    /// Factors of the proposals of a connection to a light vertex at which the light β_L = `arriving` is.
    pub fn shares(&self, arriving: Rgb, proposals: &Proposals) -> Shares {
        let near = &proposals.each[..proposals.count];
        let p_over = |q_over_p| self.p_over(q_over_p);
        let choice = 1.0 / (near.len() + 1) as f32;
        let unscattered: f32 = arriving.luminance() * near.iter().map(|p| p.unscattered).sum::<f32>();
        let all: f32 = near.iter().map(|p| p.all.unscattered).sum();
        let mut shares = [0.0; MOST + 1];
        for (own, p) in shares.iter_mut().zip(near) {
            let brings = (arriving * p.scattered).luminance();
            if brings > 0.0 {
                // Where nothing was known to arrive, whatever does is certain to be drawn.
                let first = match p.all.unscattered > 0.0 {
                    true => p_over(arriving.luminance() * p.unscattered / p.all.unscattered),
                    false => self.epsilon,
                };
                *own = choice * self.factor_with(first, p_over(brings / p.all.scattered));
            }
        }
        // What the first stage left is all that it draws from; with one stage, all vertices alike.
        let uniform = match self.second_stage {
            Some(_) if all > 0.0 => p_over(unscattered / all),
            _ => self.vertices_per_path.clamp(self.epsilon, f32::MAX),
        };
        shares[near.len()] = choice * self.factor_with(uniform, uniform);
        Shares(shares)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mis::resampled::tests::ONE_STAGE;

    const RESAMPLED: Resampled = Resampled { form: Form::Split, ..ONE_STAGE };

    fn near(scattered: [f32; MOST]) -> Proposals {
        let all = Targets { scattered: 2.0, unscattered: 5.0 };
        let each =
            scattered.map(|s| Proposal { scattered: Rgb::grey(s), unscattered: 1.5, all, ..Proposal::default() });
        Proposals { count: MOST, each }
    }

    #[test]
    fn what_a_cache_point_cannot_draw_has_no_share() {
        let shares = RESAMPLED.shares(Rgb::grey(3.0), &near([4.0, 0.0, 1.0]));
        assert_eq!(shares.of(1), 0.0);
        assert!(shares.of(0) > shares.of(2) && shares.of(2) > 0.0);
        assert!((shares.of(3) - 0.25 / (0.005 + 0.995 * 3.0)).abs() < 1e-6);
        // p/q = 2/12 at the first.
        assert!((shares.of(0) - 0.25 / (0.005 + 0.995 / 6.0)).abs() < 1e-6);
        assert!((shares.sum() - (0..4).map(|i| shares.of(i)).sum::<f32>()).abs() < 1e-6);
    }

    #[test]
    fn the_density_of_a_mixture_is_the_mean() {
        let asked = Resampled { form: Form::Asked, ..RESAMPLED };
        // Of three cache points one does not see the vertex.
        let q = (12.0 / 2.0 + 0.0 + 3.0 / 2.0 + 1.0 / 3.0) / 4.0;
        let c = asked.factor_of(Rgb::grey(3.0), &near([4.0, 0.0, 1.0]));
        assert!((c - 1.0 / (0.005 + 0.995 / q)).abs() < 1e-5);
        let c = Resampled { second_stage: Some(1e9), ..asked }.factor_of(Rgb::grey(3.0), &near([4.0, 0.0, 1.0]));
        let q = (12.0 / 2.0 + 0.0 + 3.0 / 2.0 + 4.5 / 5.0) / 4.0;
        assert!((c - 1.0 / (0.005 + 0.995 / q)).abs() < 1e-5);
        assert_eq!(Resampled { paths: 1.0, ..asked }.factor_of(Rgb::WHITE, &near([0.0; MOST])), 1.0);
    }

    #[test]
    fn one_path_counts_once_and_without_cache_points_it_is_drawn_uniformly() {
        let one = Resampled { paths: 1.0, ..RESAMPLED };
        assert!((one.shares(Rgb::WHITE, &near([1.0, 2.0, 3.0])).sum() - 1.0).abs() < 1e-6);
        assert_eq!(one.shares(Rgb::WHITE, &Proposals::default()).sum(), 1.0);
        let uniform = RESAMPLED.shares(Rgb::WHITE, &Proposals::default());
        assert!((uniform.sum() - 1.0 / (0.005 + 0.995 * 3.0)).abs() < 1e-6);
    }

    #[test]
    fn two_stages_lie_between_their_targets() {
        let shares =
            |m2: f32| Resampled { second_stage: Some(m2), ..RESAMPLED }.shares(Rgb::grey(3.0), &near([4.0; MOST]));
        let c = |p_over_q: f32| 0.25 / (0.005 + 0.995 * p_over_q);
        assert!((shares(1.0).of(0) - c(5.0 / 4.5)).abs() < 1e-5);
        assert!((shares(1e9).of(0) - c(2.0 / 12.0)).abs() < 1e-5);
        assert!((shares(16.0).of(MOST) - c(5.0 / 4.5)).abs() < 1e-5);
    }
}
