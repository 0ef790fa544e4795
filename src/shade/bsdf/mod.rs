//! Bidirectional scattering distribution functions.
//!
//! A [`Material`] is a tree (two-sided, masks, blends, bump maps …) over scattering models; [`Material::resolve`] looks up its
//! textures at a point and flattens it into a [`Bsdf`]: up to [`MAX_LEAVES`] weighted lobes, each in its own frame. The models are one
//! file each and work in local coordinates (`lobe.rs` says which).

mod conductor;
mod dielectric;
mod diffuse;
mod facts;
mod bsdf_pool;
mod link;
mod lobe;
mod material;
mod microfacet;
mod node;
mod phong;
mod plastic;
mod principled;
mod rough_dielectric;
mod rough_plastic;
mod ward;

#[cfg(test)]
mod tests;

pub use bsdf_pool::{BsdfPool, BsdfView, StoredBsdf};
pub use material::{Features, Material, MaterialSet};

use super::{SurfacePoint, Transport};
use crate::math::{Frame, Rgb, SolidAnglePdf, Vec3};
use arrayvec::ArrayVec;
use diffuse::Lambert;
use link::{Link, ROOT};
use lobe::{DeltaSample, Lobe, LobeSample};
use std::ops::Deref;

/// Most lobes a material may have at a point (a two-sided material counts both sides if its tree lets light through).
pub const MAX_LEAVES: usize = 8;
/// Most nested frames (bump maps, normal maps, backs of two-sided materials) in a material.
const MAX_LINKS: usize = 8;

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Where the walk goes on; world space, unit length.
    pub wi: Vec3,
    /// Cosine weighted value, f · |cos θ_i| (for a delta event: the value whose ratio to `pdf` is the throughput).
    pub value: Rgb,
    /// Density per steradian of `wi` given `wo`; of a delta event the discrete probability.
    pub pdf: SolidAnglePdf,
    /// Of a delta event: the discrete probability of the reverse event (`wo` given `wi`); otherwise unused.
    pub pdf_reverse_delta: SolidAnglePdf,
    /// Of a delta event drawn for radiance: the value of the reverse event for importance; otherwise unused.
    pub reverse_delta: Rgb,
    /// The direction is one of finitely many.
    pub delta: bool,
    /// The ray goes straight through as if nothing were there (mask, null).
    pub passes_through: bool,
    /// Relative refractive index crossed: transmitted side / incident side; 1 for reflection.
    pub eta: f32,
}

/// A lobe with its share of the material.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    lobe: Lobe,
    /// Multiplies values.
    weight: f32,
    /// Relative probability of being drawn from, before normalisation over the lobes that are active on a side.
    pick: f32,
    /// Innermost frame; [`ROOT`] for the point's own.
    link: u8,
    /// Whether it scatters light that is seen from the front and from the back of the point's frame.
    active: [bool; 2],
}

/// The BSDF at one point: every texture looked up, seen from `wo`. It answers for the `wo` it was resolved with, and for any
/// other direction on the same side or, in materials that let light through, on either side.
///
/// Under bump and normal maps the normal is turned towards the eye where it would face away (as Mitsuba does), so light that is
/// traced from the other end may find it turned differently: there the adjoint can be positive where the density is zero. All
/// densities are still functions of the two directions alone, so combinations of techniques stay consistent.
///
/// `L` and `K` hold the lobes and the frames: [`Bsdf`] has room for any material, [`BsdfView`] borrows what a [`BsdfPool`] keeps.
#[derive(Clone, Debug)]
pub struct BsdfOf<L, K> {
    ng: Vec3,
    scattering: Scattering,
    leaves: L,
    links: K,
}

/// A BSDF in itself: a plain value without heap memory, cheap to make but large.
pub type Bsdf = BsdfOf<ArrayVec<Leaf, MAX_LEAVES>, ArrayVec<Link, MAX_LINKS>>;

/// How the lobes make a BSDF.
#[derive(Clone, Copy, Debug)]
enum Scattering {
    /// The single Lambertian lobe of most surfaces, for which everything else is short-circuited: there are no leaves and nothing else
    /// is written. (Reading in one piece what has just been written in several stalls processors.)
    Lambertian(Lambert),
    /// By `leaves`.
    Lobes {
        /// Shading frame.
        frame: Frame,
        /// 1 / sum of the picks of the active leaves, seen from the front and from the back.
        pick_scale: [f32; 2],
    },
}

/// Index into the arrays of two sides.
#[inline]
fn side(z: f32) -> usize {
    usize::from(z <= 0.0)
}

impl Bsdf {
    /// Scatters nothing at `point`.
    #[inline]
    pub fn empty(point: &SurfacePoint) -> Bsdf {
        Bsdf {
            ng: point.ng,
            scattering: Scattering::Lobes { frame: point.frame, pick_scale: [0.0; 2] },
            leaves: ArrayVec::new(),
            links: ArrayVec::new(),
        }
    }

    /// Starts over at `point`, without lobes.
    #[inline]
    fn begin(&mut self, point: &SurfacePoint, scattering: Scattering) {
        self.ng = point.ng;
        self.scattering = scattering;
        self.leaves.clear();
        self.links.clear();
    }

    /// Normalises the choice of lobes; called once all leaves are in.
    #[inline]
    fn seal(&mut self) {
        let scales = if let [leaf] = self.leaves.as_mut_slice() {
            leaf.pick = 1.0;
            leaf.active.map(|a| if a { 1.0 } else { 0.0 })
        } else {
            std::array::from_fn(|s| {
                let sum: f32 = self.leaves.iter().filter(|l| l.active[s]).map(|l| l.pick).sum();
                if sum > 0.0 { 1.0 / sum } else { 0.0 }
            })
        };
        if let Scattering::Lobes { pick_scale, .. } = &mut self.scattering {
            *pick_scale = scales;
        }
    }
}

impl<L: Deref<Target = [Leaf]>, K: Deref<Target = [Link]>> BsdfOf<L, K> {
    /// |wi·ng| / |wo·ng|, the geometric half of the shading-normal factor; 0 for `wo` in the surface, where no light arrives.
    #[inline]
    fn geometric_ratio(&self, wo: Vec3, wi: Vec3) -> f32 {
        let o = wo.dot(self.ng).abs();
        if o > 1e-7 { wi.dot(self.ng).abs() / o } else { 0.0 }
    }

    /// Cosine weighted value f(wo, wi) · |cos θ_i|, delta lobes excluded.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, mode: Transport) -> Rgb {
        self.eval_and_pdf(wo, wi, mode).0
    }

    /// [`Bsdf::eval`] and [`Bsdf::pdf`] at once, sharing their work.
    #[inline]
    pub fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> (Rgb, SolidAnglePdf) {
        match &self.scattering {
            Scattering::Lambertian(lambert) => {
                let Some((cos_o, cos_i)) = lambert.cosines(wo, wi) else {
                    return (Rgb::BLACK, SolidAnglePdf(0.0));
                };
                let pdf = cos_i * std::f32::consts::FRAC_1_PI;
                let value = match mode {
                    Transport::Radiance => lambert.reflectance * pdf,
                    Transport::Importance => {
                        lambert.reflectance * (cos_o * std::f32::consts::FRAC_1_PI * self.geometric_ratio(wo, wi))
                    }
                };
                (value, SolidAnglePdf(pdf))
            }
            Scattering::Lobes { frame, pick_scale } => self.eval_and_pdf_general((frame, pick_scale), wo, wi, mode),
        }
    }

    fn eval_and_pdf_general(
        &self,
        (frame, pick_scale): (&Frame, &[f32; 2]),
        wo: Vec3,
        wi: Vec3,
        mode: Transport,
    ) -> (Rgb, SolidAnglePdf) {
        let (o, i) = (frame.to_local(wo), frame.to_local(wi));
        let scale = pick_scale[side(o.z)];
        let (mut value, mut pdf) = (Rgb::BLACK, 0.0);
        for leaf in self.leaves.iter() {
            let (v, p) = leaf.eval_pdf(&self.links, o, i, mode);
            value += v * leaf.weight;
            if leaf.active[side(o.z)] {
                pdf += p * leaf.pick;
            }
        }
        if mode == Transport::Importance {
            value *= self.geometric_ratio(wo, wi);
        }
        (value, SolidAnglePdf(pdf * scale))
    }

    /// Density per steradian with which [`Bsdf::sample`] draws `wi` given `wo`, delta lobes excluded (their share of the
    /// probability is missing from the integral). It does not depend on what the walk carries.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, _mode: Transport) -> SolidAnglePdf {
        match &self.scattering {
            Scattering::Lambertian(lambert) => {
                SolidAnglePdf(lambert.cosines(wo, wi).map_or(0.0, |(_, cos_i)| cos_i * std::f32::consts::FRAC_1_PI))
            }
            Scattering::Lobes { frame, pick_scale } => {
                SolidAnglePdf(self.pdf_local(pick_scale, frame.to_local(wo), frame.to_local(wi)))
            }
        }
    }

    /// The densities of `wi` given `wo` and of `wo` given `wi` (a walk in the opposite direction, which carries the opposite
    /// quantity).
    #[inline]
    pub fn pdf_both(&self, wo: Vec3, wi: Vec3, _mode: Transport) -> (SolidAnglePdf, SolidAnglePdf) {
        match &self.scattering {
            Scattering::Lambertian(lambert) => {
                let (cos_o, cos_i) = lambert.cosines(wo, wi).unwrap_or((0.0, 0.0));
                let scale = std::f32::consts::FRAC_1_PI;
                (SolidAnglePdf(cos_i * scale), SolidAnglePdf(cos_o * scale))
            }
            Scattering::Lobes { frame, pick_scale } => {
                let (o, i) = (frame.to_local(wo), frame.to_local(wi));
                (SolidAnglePdf(self.pdf_local(pick_scale, o, i)), SolidAnglePdf(self.pdf_local(pick_scale, i, o)))
            }
        }
    }

    /// Density of `b` given `a` in root coordinates.
    fn pdf_local(&self, pick_scale: &[f32; 2], a: Vec3, b: Vec3) -> f32 {
        let s = side(a.z);
        let pdf = |leaf: &Leaf| {
            if !leaf.active[s] {
                return 0.0;
            }
            leaf.pick
                * if leaf.link == ROOT {
                    leaf.lobe.pdf(a, b)
                } else {
                    link::enter(&self.links, leaf.link, a, b)
                        .map_or(0.0, |inside| leaf.lobe.pdf(inside.eye, inside.light))
                }
        };
        self.leaves.iter().map(pdf).sum::<f32>() * pick_scale[s]
    }

    /// Draws a direction; `u` = [lobe, u, v]. `None` if the light is absorbed. Of a smooth event, `value` and `pdf` are what
    /// [`Bsdf::eval`] and [`Bsdf::pdf`] say about the direction, all lobes summed; of a delta event they are those of the event alone.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3], mode: Transport) -> Option<BsdfSample> {
        match &self.scattering {
            Scattering::Lambertian(lambert) => self.smooth_sample(wo, lambert.sample_direction(u), 1.0, mode),
            Scattering::Lobes { frame, pick_scale } => self.sample_general((frame, pick_scale), wo, u, mode),
        }
    }

    #[inline]
    fn smooth_sample(&self, wo: Vec3, wi: Vec3, eta: f32, mode: Transport) -> Option<BsdfSample> {
        let (value, pdf) = self.eval_and_pdf(wo, wi, mode);
        (pdf.0 > 0.0).then_some(BsdfSample {
            wi,
            value,
            pdf,
            pdf_reverse_delta: SolidAnglePdf(0.0),
            reverse_delta: Rgb::BLACK,
            delta: false,
            passes_through: false,
            eta,
        })
    }

    fn sample_general(
        &self,
        (root, pick_scale): (&Frame, &[f32; 2]),
        wo: Vec3,
        u: [f32; 3],
        mode: Transport,
    ) -> Option<BsdfSample> {
        let o = root.to_local(wo);
        let s = side(o.z);
        let (leaf, share, rest) = self.pick(s, pick_scale[s], u[0])?;
        let (frame, a) = link::frame_of(&self.links, leaf.link, o);
        match leaf.lobe.sample(a, [rest, u[1], u[2]])? {
            LobeSample::Smooth(b) => {
                let wi = root.to_world(frame.to_world(b)).normalize();
                let eta = leaf.lobe.eta();
                let crossed = a.z * b.z < 0.0;
                let eta = match (crossed, a.z > 0.0) {
                    (false, _) => 1.0,
                    (true, true) => eta,
                    (true, false) => 1.0 / eta,
                };
                self.smooth_sample(wo, wi, eta, mode)
            }
            LobeSample::Delta(event) => {
                self.delta_sample((root, pick_scale), wo, (leaf, share), (frame, a), event, mode)
            }
        }
    }

    /// Chooses a leaf: the leaf, its probability, and what is left of the random number.
    fn pick(&self, s: usize, scale: f32, u: f32) -> Option<(&Leaf, f32, f32)> {
        let (mut rest, mut last) = (u, None);
        for leaf in self.leaves.iter().filter(|l| l.active[s]) {
            let share = leaf.pick * scale;
            if share > 0.0 {
                if rest < share {
                    return Some((leaf, share, (rest / share).min(crate::math::float::ONE_MINUS_EPSILON)));
                }
                rest -= share;
                last = Some((leaf, share));
            }
        }
        // Rounding left a sliver above the last share.
        last.map(|(leaf, share)| (leaf, share, crate::math::float::ONE_MINUS_EPSILON))
    }

    /// A discrete event of `leaf`, which is chosen with probability `share` and whose frame and view in it are `inner`.
    fn delta_sample(
        &self,
        (root, pick_scale): (&Frame, &[f32; 2]),
        wo: Vec3,
        (leaf, share): (&Leaf, f32),
        inner: (Frame, Vec3),
        event: DeltaSample,
        mode: Transport,
    ) -> Option<BsdfSample> {
        let (frame, a) = inner;
        let (o, i) = (root.to_local(wo), frame.to_world(event.b));
        let wi = if event.passes_through { -wo } else { root.to_world(i).normalize() };
        let mut value = event.value * leaf.weight;
        let mut reverse_value = value;
        if !event.passes_through {
            let inside = match mode {
                Transport::Radiance => link::enter(&self.links, leaf.link, o, i)?,
                Transport::Importance => link::enter(&self.links, leaf.link, i, o)?,
            };
            value *= inside.shadowing;
            // Walked from `wi` to `wo`: no η², and the cosines exchanged.
            let cosines = self.geometric_ratio(wi, wo) * event.b.z.abs() / a.z.abs();
            reverse_value = value * (event.eta * event.eta * cosines);
            if mode == Transport::Importance {
                let cos = event.b.z.abs();
                if cos == 0.0 {
                    return None;
                }
                value *= event.eta * event.eta * self.geometric_ratio(wo, wi) * a.z.abs() / cos;
            }
        }
        let reverse = if leaf.active[side(i.z)] { leaf.pick * pick_scale[side(i.z)] } else { 0.0 };
        Some(BsdfSample {
            wi,
            value,
            pdf: SolidAnglePdf(share * event.pdf),
            pdf_reverse_delta: SolidAnglePdf(reverse * event.pdf_reverse),
            reverse_delta: reverse_value,
            delta: true,
            passes_through: event.passes_through,
            eta: event.eta,
        })
    }

    /// Approximate albedo per channel, independent of direction: Russian roulette uses it, and it must be the same from
    /// whichever side the point is reached.
    #[inline]
    pub fn albedo(&self) -> Rgb {
        if let Scattering::Lambertian(lambert) = &self.scattering {
            return lambert.reflectance;
        }
        let seen =
            |s: usize| -> Rgb { self.leaves.iter().filter(|l| l.active[s]).map(|l| l.lobe.albedo() * l.weight).sum() };
        let (front, back) = (seen(0), seen(1));
        Rgb::new(front.r.max(back.r), front.g.max(back.g), front.b.max(back.b)).map(|c| c.min(1.0))
    }

    /// It scatters as a matt surface does, and in no other way.
    #[inline]
    pub fn is_lambertian(&self) -> bool {
        matches!(self.scattering, Scattering::Lambertian(_))
    }

    /// True if a connection to this point can carry light: some lobe is not a delta.
    #[inline]
    pub fn connectable(&self) -> bool {
        match &self.scattering {
            Scattering::Lambertian(lambert) => !lambert.reflectance.is_black(),
            Scattering::Lobes { .. } => self.leaves.iter().any(|leaf| leaf.lobe.is_smooth()),
        }
    }
}

impl Leaf {
    /// Value and density of `i` given `o`, in root coordinates; in importance mode without the geometric ratio.
    fn eval_pdf(&self, links: &[Link], o: Vec3, i: Vec3, mode: Transport) -> (Rgb, f32) {
        if self.link == ROOT {
            let (value, pdf) = self.lobe.eval_pdf(o, i);
            return match mode {
                Transport::Radiance => (value, pdf),
                Transport::Importance => (value * self.adjoint_factor(o, i), pdf),
            };
        }
        match mode {
            Transport::Radiance => link::enter(links, self.link, o, i).map_or((Rgb::BLACK, 0.0), |inside| {
                let (value, pdf) = self.lobe.eval_pdf(inside.eye, inside.light);
                (value * inside.shadowing, pdf)
            }),
            Transport::Importance => {
                // Tilted normals and their shadowing tell eye and light apart: the adjoint is the radiance seen the other way.
                let value = link::enter(links, self.link, i, o)
                    .map_or(Rgb::BLACK, |inside| self.lobe.eval_pdf(inside.eye, inside.light).0 * inside.shadowing);
                let pdf =
                    link::enter(links, self.link, o, i).map_or(0.0, |inside| self.lobe.pdf(inside.eye, inside.light));
                (value, pdf)
            }
        }
    }

    /// What turns the radiance value at (o, i) into that at (i, o): η² and the exchange of the cosine.
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
