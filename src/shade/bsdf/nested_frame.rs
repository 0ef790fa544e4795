//! Frames within frames: the frame of a lobe is reached from the point's shading frame through normal maps, bump maps,
//! the backs of two-sided materials, and smooth coats, which refract what enters them.
//!
//! Tilted normals follow Mitsuba 3: a normal that would face away from the direction the light is *seen* from is turned
//! around the base normal (Schüßler et al. 2017), directions on different sides of base and tilted surface exchange
//! nothing, and a shadowing factor for the light's direction softens the terminator (Estevez et al. 2019, "A
//! Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem").

use crate::math::fresnel::dielectric;
use crate::math::{Frame, Rgb, Vec3};

/// Transformation from a frame to the next inner one.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// The back of the outer frame: z is negated (left-handed on purpose: anisotropy keeps its tangents).
    Mirror,
    /// A tilted normal, unit length, in the outer frame, before it is turned towards the viewer.
    Tilt(Vec3),
    /// Below a smooth coat.
    Coat(Coat),
}

/// A smooth coat of a refracting and absorbing medium, as of Mitsuba 0.6: light enters and leaves it once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    /// Refractive index of the coat over that of the exterior.
    pub eta: f32,
    /// Optical thickness per channel.
    pub absorption: Rgb,
}

/// A direction below a coat.
struct Below {
    direction: Vec3,
    /// Share of light that passes the coat.
    transmittance: Rgb,
    /// Solid angle below the coat over that above it.
    jacobian: f32,
}

impl Coat {
    /// The direction below the coat of `v` above it (or, with the inverse index, the other way); `None` where all light
    /// is reflected.
    fn refract(v: Vec3, eta: f32) -> Option<Vec3> {
        let cos2 = 1.0 - (1.0 - v.z * v.z).max(0.0) / (eta * eta);
        (cos2 > 0.0).then(|| Vec3::new(v.x / eta, v.y / eta, cos2.sqrt().copysign(v.z)))
    }

    fn enter(&self, v: Vec3) -> Option<Below> {
        let direction = Coat::refract(v, self.eta)?;
        let cos = direction.z.abs();
        let passes = 1.0 - dielectric(v.z.abs(), self.eta).reflectance;
        let transmittance = self.absorption.map(|a| (-a / cos).exp() * passes);
        Some(Below { direction, transmittance, jacobian: v.z.abs() / (self.eta * self.eta * cos) })
    }

    fn leave(&self, v: Vec3) -> Option<Vec3> {
        Coat::refract(v, 1.0 / self.eta)
    }
}

/// A frame within another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct NestedFrame {
    /// Index of the outer frame; [`ROOT`] for the point's own.
    pub outer: u8,
    pub step: Step,
}

/// Index of the point's own shading frame.
pub(super) const ROOT: u8 = u8::MAX;

/// The frame of a tilted normal in its outer frame's coordinates, for an eye in direction `eye`.
pub(super) fn tilted_frame(n: Vec3, eye: Vec3) -> Frame {
    let n = if eye.z * eye.dot(n) <= 0.0 { Vec3::new(-n.x, -n.y, n.z) } else { n };
    let s = (Vec3::X - n * n.x).normalize_or(Vec3::Y);
    Frame { s, t: n.cross(s), n }
}

/// Shadowing of light from `light` (outer coordinates) by bumps whose normal is tilted to `n`.
fn bump_shadowing(n: Vec3, light: Vec3) -> f32 {
    let tan2 = |v: Vec3| (1.0 - v.z * v.z).max(0.0) / (v.z * v.z);
    let alpha2 = (0.125 * tan2(n)).min(1.0);
    2.0 / (1.0 + (1.0 + alpha2 * tan2(light)).sqrt())
}

/// Two directions in a lobe's coordinates, and the effect of the frames that lead there.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalDirections {
    pub eye: Vec3,
    pub light: Vec3,
    /// Share of light that is not shadowed by bumps and passes coats both ways.
    pub passing: Rgb,
    /// Solid angle of directions to the light in the lobe's coordinates over that in root coordinates.
    pub jacobian: f32,
}

/// Directions in root coordinates → in the coordinates of frame `index`; `None` if they are on different sides of some
/// normal.
pub(super) fn enter(frames: &[NestedFrame], index: u8, eye: Vec3, light: Vec3) -> Option<LocalDirections> {
    let Some(nested) = frames.get(usize::from(index)) else {
        return Some(LocalDirections { eye, light, passing: Rgb::WHITE, jacobian: 1.0 });
    };
    let outer = enter(frames, nested.outer, eye, light)?;
    match nested.step {
        Step::Mirror => {
            let mirror = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
            Some(LocalDirections { eye: mirror(outer.eye), light: mirror(outer.light), ..outer })
        }
        Step::Tilt(n) => {
            let frame = tilted_frame(n, outer.eye);
            let light = frame.to_local(outer.light);
            (light.z * outer.light.z > 0.0).then(|| LocalDirections {
                eye: frame.to_local(outer.eye),
                light,
                passing: outer.passing * bump_shadowing(frame.n, outer.light),
                jacobian: outer.jacobian,
            })
        }
        Step::Coat(coat) => {
            let (eye, light) = (coat.enter(outer.eye)?, coat.enter(outer.light)?);
            Some(LocalDirections {
                eye: eye.direction,
                light: light.direction,
                passing: outer.passing * eye.transmittance * light.transmittance,
                jacobian: outer.jacobian * light.jacobian,
            })
        }
    }
}

/// The direction `eye` (root coordinates) in frame `index`; `None` if no light arrives there from it.
pub(super) fn eye_in(frames: &[NestedFrame], index: u8, eye: Vec3) -> Option<Vec3> {
    let Some(nested) = frames.get(usize::from(index)) else { return Some(eye) };
    let eye = eye_in(frames, nested.outer, eye)?;
    match nested.step {
        Step::Mirror => Some(Vec3::new(eye.x, eye.y, -eye.z)),
        Step::Tilt(n) => Some(tilted_frame(n, eye).to_local(eye)),
        Step::Coat(coat) => Some(coat.enter(eye)?.direction),
    }
}

/// The direction `light` in frame `index` for an eye in direction `eye` (root coordinates) → root coordinates; `None`
/// if light from there does not leave a coat.
pub(super) fn leave(frames: &[NestedFrame], index: u8, eye: Vec3, light: Vec3) -> Option<Vec3> {
    let Some(nested) = frames.get(usize::from(index)) else { return Some(light) };
    let outer = match nested.step {
        Step::Mirror => Vec3::new(light.x, light.y, -light.z),
        Step::Tilt(n) => tilted_frame(n, eye_in(frames, nested.outer, eye)?).to_world(light),
        Step::Coat(coat) => coat.leave(light)?,
    };
    leave(frames, nested.outer, eye, outer)
}
