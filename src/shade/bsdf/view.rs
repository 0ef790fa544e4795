//! The functions of a BSDF: value, density, sampling and what they can do at all, on borrowed lobes.

use super::BsdfSample;
use super::diffuse::Lambert;
use super::lobe::Lobe;
use super::model::{DeltaSample, LobeSample};
use super::nested_frame::{self, LocalDirections, NestedFrame, ROOT};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Frame, Rgb, SolidAnglePdf, Vec3};
use crate::shade::{PhaseScattering, Transport};
use std::f32::consts::FRAC_1_PI;

/// A BSDF whose lobes and frames are borrowed, from a [`Bsdf`](super::Bsdf) or a [`BsdfPool`](super::BsdfPool).
///
/// Functions that treat Lambertian BSDFs separately are always inlined, and those for lobes take the view by value:
/// then the view never has to be put together in memory where the BSDF is Lambertian.
#[derive(Clone, Copy, Debug)]
pub struct BsdfView<'a> {
    pub(super) ng: Vec3,
    pub(super) scattering: &'a Scattering,
    pub(super) lobes: &'a [WeightedLobe],
    pub(super) frames: &'a [NestedFrame],
}

/// Representation of a BSDF.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scattering {
    /// A single Lambertian lobe, as most surfaces have, for which everything else is short-circuited: lobes and frames
    /// are empty and nothing else is written. (Reading in one piece what has just been written in several stalls
    /// processors.)
    Lambertian(Lambert),
    /// A sum of lobes.
    Lobes(LobeSum),
    /// A point of a medium: lobes and frames are empty, and there is no surface.
    Phase(PhaseScattering),
}

/// Frame and normalisation of a sum of lobes.
#[derive(Clone, Copy, Debug)]
pub(super) struct LobeSum {
    /// Shading frame.
    pub frame: Frame,
    /// 1 / sum of the selection weights of the active lobes, seen from the front and from the back.
    pub selection_scale: [f32; 2],
}

impl LobeSum {
    /// Before any lobe is in.
    #[inline]
    pub fn new(frame: Frame) -> LobeSum {
        LobeSum { frame, selection_scale: [0.0; 2] }
    }
}

/// A lobe of a BSDF.
#[derive(Clone, Copy, Debug)]
pub(super) struct WeightedLobe {
    pub lobe: Lobe,
    /// Multiplies values.
    pub weight: f32,
    /// Relative probability of being drawn from, before normalisation over the lobes that are active on a side.
    pub selection_weight: f32,
    /// Index of the innermost frame; [`ROOT`] for the point's own.
    pub frame: u8,
    /// Whether the lobe scatters light that is seen from the front and from the back of the point's frame.
    pub active: [bool; 2],
}

/// A lobe that was chosen to draw a direction from.
struct SelectedLobe<'a> {
    lobe: &'a WeightedLobe,
    /// Probability of the choice.
    probability: f32,
    /// Remainder of the random number, uniform in [0, 1).
    rest: f32,
}

/// A discrete event of a selected lobe.
struct DeltaEvent<'a> {
    selected: SelectedLobe<'a>,
    /// The direction `wo` in the lobe's frame.
    a: Vec3,
    sample: DeltaSample,
}

/// Index into arrays of the two sides.
#[inline]
fn side_index(z: f32) -> usize {
    usize::from(z <= 0.0)
}

impl BsdfView<'_> {
    /// |wi·ng| / |wo·ng|, the geometric half of the shading-normal factor; 0 for `wo` in the surface, where no light
    /// arrives.
    #[inline]
    fn geometric_ratio(&self, wo: Vec3, wi: Vec3) -> f32 {
        let o = wo.dot(self.ng).abs();
        if o > 1e-7 { wi.dot(self.ng).abs() / o } else { 0.0 }
    }

    /// Cosine weighted value f(wo, wi) · |cos θ_i|, delta lobes excluded.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3, mode: Transport) -> Rgb {
        self.eval_and_pdf(wo, wi, mode).0
    }

    /// [`BsdfView::eval`] and [`BsdfView::pdf`] at once, sharing their work.
    #[inline(always)]
    pub fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> (Rgb, SolidAnglePdf) {
        match self.scattering {
            Scattering::Lambertian(lambert) => {
                let Some((cos_o, cos_i)) = lambert.cosines(wo, wi) else {
                    return (Rgb::BLACK, SolidAnglePdf(0.0));
                };
                let pdf = cos_i * FRAC_1_PI;
                let value = match mode {
                    Transport::Radiance => lambert.reflectance * pdf,
                    Transport::Importance => lambert.reflectance * (cos_o * FRAC_1_PI * self.geometric_ratio(wo, wi)),
                };
                (value, SolidAnglePdf(pdf))
            }
            Scattering::Lobes(sum) => self.eval_and_pdf_lobes(sum, wo, wi, mode),
            Scattering::Phase(phase) => phase.eval_and_pdf(wo, wi),
        }
    }

    fn eval_and_pdf_lobes(self, sum: &LobeSum, wo: Vec3, wi: Vec3, mode: Transport) -> (Rgb, SolidAnglePdf) {
        let (o, i) = (sum.frame.to_local(wo), sum.frame.to_local(wi));
        let scale = sum.selection_scale[side_index(o.z)];
        let (mut value, mut pdf) = (Rgb::BLACK, 0.0);
        for lobe in self.lobes {
            let (v, p) = lobe.eval_pdf(self.frames, o, i, mode);
            value += v * lobe.weight;
            if lobe.active[side_index(o.z)] {
                pdf += p * lobe.selection_weight;
            }
        }
        if mode == Transport::Importance {
            value *= self.geometric_ratio(wo, wi);
        }
        (value, SolidAnglePdf(pdf * scale))
    }

    /// Density per steradian with which [`BsdfView::sample`] draws `wi` given `wo`, delta lobes excluded (their share
    /// of the probability is missing from the integral). It does not depend on what the walk carries.
    #[inline(always)]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, _mode: Transport) -> SolidAnglePdf {
        match self.scattering {
            Scattering::Lambertian(lambert) => {
                SolidAnglePdf(lambert.cosines(wo, wi).map_or(0.0, |(_, cos_i)| cos_i * FRAC_1_PI))
            }
            Scattering::Lobes(sum) => SolidAnglePdf(self.pdf_lobes(sum, wo, wi)),
            Scattering::Phase(phase) => SolidAnglePdf(phase.phase.eval(wo, wi)),
        }
    }

    fn pdf_lobes(self, sum: &LobeSum, wo: Vec3, wi: Vec3) -> f32 {
        let (o, i) = (sum.frame.to_local(wo), sum.frame.to_local(wi));
        let s = side_index(o.z);
        let pdf = |lobe: &WeightedLobe| {
            if lobe.active[s] { lobe.selection_weight * lobe.pdf(self.frames, o, i) } else { 0.0 }
        };
        self.lobes.iter().map(pdf).sum::<f32>() * sum.selection_scale[s]
    }

    /// Draws a direction; `u` = [lobe, u, v]. `None` if the light is absorbed. For a smooth event, `value` and `pdf`
    /// are the results of [`BsdfView::eval`] and [`BsdfView::pdf`] for the direction, all lobes summed; for a delta
    /// event they are those of the event alone.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3], mode: Transport) -> Option<BsdfSample> {
        match self.scattering {
            Scattering::Lambertian(lambert) => self.smooth_sample(wo, lambert.sample_direction(u), 1.0, mode),
            Scattering::Lobes(sum) => self.sample_lobes(sum, wo, u, mode),
            Scattering::Phase(phase) => self.smooth_sample(wo, phase.phase.sample(wo, u), 1.0, mode),
        }
    }

    #[inline]
    fn smooth_sample(self, wo: Vec3, wi: Vec3, eta: f32, mode: Transport) -> Option<BsdfSample> {
        let (value, pdf) = self.eval_and_pdf(wo, wi, mode);
        (pdf.0 > 0.0).then_some(BsdfSample {
            wi,
            value,
            pdf,
            pdf_reverse_delta: SolidAnglePdf(0.0),
            reverse_delta: Rgb::BLACK,
            delta: false,
            eta,
        })
    }

    fn sample_lobes(self, sum: &LobeSum, wo: Vec3, u: [f32; 3], mode: Transport) -> Option<BsdfSample> {
        let o = sum.frame.to_local(wo);
        let selected = self.select_lobe(sum, side_index(o.z), u[0])?;
        let lobe = &selected.lobe.lobe;
        let a = nested_frame::eye_in(self.frames, selected.lobe.frame, o)?;
        match lobe.sample(a, [selected.rest, u[1], u[2]])? {
            LobeSample::Smooth(b) => {
                let i = nested_frame::leave(self.frames, selected.lobe.frame, o, b)?;
                let wi = sum.frame.to_world(i).normalize();
                let crossed = a.z * b.z < 0.0;
                let eta = match (crossed, a.z > 0.0) {
                    (false, _) => 1.0,
                    (true, true) => lobe.eta(),
                    (true, false) => 1.0 / lobe.eta(),
                };
                self.smooth_sample(wo, wi, eta, mode)
            }
            LobeSample::Delta(sample) => self.delta_sample(sum, wo, &DeltaEvent { selected, a, sample }, mode),
        }
    }

    /// Chooses a lobe that is active on side `s`.
    fn select_lobe(&self, sum: &LobeSum, s: usize, u: f32) -> Option<SelectedLobe<'_>> {
        let (mut rest, mut last) = (u, None);
        for lobe in self.lobes.iter().filter(|l| l.active[s]) {
            let probability = lobe.selection_weight * sum.selection_scale[s];
            if probability > 0.0 {
                if rest < probability {
                    let rest = (rest / probability).min(ONE_MINUS_EPSILON);
                    return Some(SelectedLobe { lobe, probability, rest });
                }
                rest -= probability;
                last = Some((lobe, probability));
            }
        }
        // Rounding can leave `u` just above the sum of the probabilities.
        last.map(|(lobe, probability)| SelectedLobe { lobe, probability, rest: ONE_MINUS_EPSILON })
    }

    fn delta_sample(&self, sum: &LobeSum, wo: Vec3, event: &DeltaEvent, mode: Transport) -> Option<BsdfSample> {
        let DeltaEvent { selected: SelectedLobe { lobe, probability, .. }, a, sample } = event;
        let o = sum.frame.to_local(wo);
        let i = nested_frame::leave(self.frames, lobe.frame, o, sample.b)?;
        let wi = sum.frame.to_world(i).normalize();
        let local = match mode {
            Transport::Radiance => nested_frame::enter(self.frames, lobe.frame, o, i)?,
            Transport::Importance => nested_frame::enter(self.frames, lobe.frame, i, o)?,
        };
        let mut value = sample.value * lobe.weight * local.passing;
        // Walked from `wi` to `wo`: no η², and the cosines exchanged.
        let cosines = self.geometric_ratio(wi, wo) * sample.b.z.abs() / a.z.abs();
        let reverse_value = value * (sample.eta * sample.eta * cosines);
        if mode == Transport::Importance {
            let cos = sample.b.z.abs();
            if cos == 0.0 {
                return None;
            }
            value *= sample.eta * sample.eta * self.geometric_ratio(wo, wi) * a.z.abs() / cos;
        }
        let back = side_index(i.z);
        let reverse_probability =
            if lobe.active[back] { lobe.selection_weight * sum.selection_scale[back] } else { 0.0 };
        Some(BsdfSample {
            wi,
            value,
            pdf: SolidAnglePdf(probability * sample.pdf),
            pdf_reverse_delta: SolidAnglePdf(reverse_probability * sample.pdf_reverse),
            reverse_delta: reverse_value,
            delta: true,
            eta: sample.eta,
        })
    }

    /// Approximate albedo per channel, independent of direction: Russian roulette uses it, and it must be equal from
    /// whichever side the point is reached.
    #[inline]
    pub fn albedo(&self) -> Rgb {
        match self.scattering {
            Scattering::Lambertian(lambert) => return lambert.reflectance,
            Scattering::Phase(phase) => return Rgb::grey(phase.albedo),
            Scattering::Lobes(_) => {}
        }
        let of_side =
            |s: usize| -> Rgb { self.lobes.iter().filter(|l| l.active[s]).map(|l| l.lobe.albedo() * l.weight).sum() };
        let (front, back) = (of_side(0), of_side(1));
        Rgb::new(front.r.max(back.r), front.g.max(back.g), front.b.max(back.b)).map(|c| c.min(1.0))
    }

    /// True if the BSDF is a single Lambertian lobe.
    #[inline]
    pub fn is_lambertian(&self) -> bool {
        matches!(self.scattering, Scattering::Lambertian(_))
    }

    /// True if a connection to this point can carry light: some lobe is not a delta.
    #[inline]
    pub fn connectable(&self) -> bool {
        match self.scattering {
            Scattering::Lambertian(lambert) => !lambert.reflectance.is_black(),
            Scattering::Lobes(_) => self.lobes.iter().any(|l| l.lobe.is_smooth()),
            Scattering::Phase(phase) => !phase.sigma_s.is_black(),
        }
    }

    /// True if nothing is scattered: a walk ends here and no light need be sampled.
    #[inline]
    pub fn is_black(&self) -> bool {
        match self.scattering {
            Scattering::Lambertian(lambert) => lambert.reflectance.is_black(),
            Scattering::Lobes(_) => self.lobes.is_empty(),
            Scattering::Phase(phase) => phase.sigma_s.is_black(),
        }
    }

    /// True if light from the other side than `wo`'s may contribute; in a medium there are no sides.
    #[inline]
    pub fn transmits(&self) -> bool {
        matches!(self.scattering, Scattering::Phase(_)) || self.lobes.iter().any(|l| l.active[0] && l.active[1])
    }
}

impl WeightedLobe {
    /// Value and density of `i` given `o`, in root coordinates; in importance mode without the geometric ratio.
    fn eval_pdf(&self, frames: &[NestedFrame], o: Vec3, i: Vec3, mode: Transport) -> (Rgb, f32) {
        if self.frame == ROOT {
            let (value, pdf) = self.lobe.eval_pdf(o, i);
            return match mode {
                Transport::Radiance => (value, pdf),
                Transport::Importance => (value * self.adjoint_factor(o, i), pdf),
            };
        }
        match mode {
            Transport::Radiance => nested_frame::enter(frames, self.frame, o, i).map_or((Rgb::BLACK, 0.0), |local| {
                let (value, pdf) = self.lobe.eval_pdf(local.eye, local.light);
                (value * (local.passing * local.jacobian), pdf * local.jacobian)
            }),
            Transport::Importance => {
                // Tilted normals and their shadowing tell eye and light apart: the adjoint is the radiance seen the
                // other way.
                let value = nested_frame::enter(frames, self.frame, i, o).map_or(Rgb::BLACK, |local| {
                    self.lobe.eval_pdf(local.eye, local.light).0 * (local.passing * local.jacobian)
                });
                (value, self.pdf(frames, o, i))
            }
        }
    }

    /// Density of `i` given `o`, in root coordinates.
    #[inline]
    fn pdf(&self, frames: &[NestedFrame], o: Vec3, i: Vec3) -> f32 {
        if self.frame == ROOT {
            return self.lobe.pdf(o, i);
        }
        let local = nested_frame::enter(frames, self.frame, o, i);
        local.map_or(0.0, |LocalDirections { eye, light, jacobian, .. }| self.lobe.pdf(eye, light) * jacobian)
    }

    /// Factor from the radiance value at (o, i) to that at (i, o): η² and the exchange of the cosine.
    fn adjoint_factor(&self, o: Vec3, i: Vec3) -> f32 {
        if i.z == 0.0 {
            return 0.0;
        }
        let swap = o.z.abs() / i.z.abs();
        if o.z * i.z > 0.0 {
            swap
        } else {
            let eta = if o.z > 0.0 { self.lobe.eta() } else { 1.0 / self.lobe.eta() };
            swap * eta * eta
        }
    }
}
