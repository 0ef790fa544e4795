//! Frames within frames: the frame of a lobe is reached from the point's shading frame through normal maps, bump maps
//! and the backs of two-sided materials.
//!
//! Tilted normals follow Mitsuba 3: a normal that would face away from the direction the light is *seen* from is turned
//! around the base normal (Schüßler et al. 2017), directions on different sides of base and tilted surface exchange
//! nothing, and a shadowing factor for the light's direction softens the terminator (Estevez et al. 2019, "A
//! Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem").

use crate::math::{Frame, Vec3};

/// Transformation from a frame to the next inner one.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// The back of the outer frame: z is negated (left-handed on purpose: anisotropy keeps its tangents).
    Mirror,
    /// A tilted normal, unit length, in the outer frame, before it is turned towards the viewer.
    Tilt(Vec3),
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

/// Two directions in a lobe's coordinates and the shadowing by the tilted normals that lead there.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalDirections {
    pub eye: Vec3,
    pub light: Vec3,
    pub shadowing: f32,
}

/// Directions in root coordinates → in the coordinates of frame `index`; `None` if they are on different sides of some
/// normal.
pub(super) fn enter(frames: &[NestedFrame], index: u8, eye: Vec3, light: Vec3) -> Option<LocalDirections> {
    let Some(nested) = frames.get(usize::from(index)) else {
        return Some(LocalDirections { eye, light, shadowing: 1.0 });
    };
    let outer = enter(frames, nested.outer, eye, light)?;
    match nested.step {
        Step::Mirror => {
            let mirror = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
            Some(LocalDirections { eye: mirror(outer.eye), light: mirror(outer.light), shadowing: outer.shadowing })
        }
        Step::Tilt(n) => {
            let frame = tilted_frame(n, outer.eye);
            let light = frame.to_local(outer.light);
            (light.z * outer.light.z > 0.0).then(|| LocalDirections {
                eye: frame.to_local(outer.eye),
                light,
                shadowing: outer.shadowing * bump_shadowing(frame.n, outer.light),
            })
        }
    }
}

/// The frame `index` in root coordinates for an eye in direction `eye`, and the eye in it.
pub(super) fn frame_of(frames: &[NestedFrame], index: u8, eye: Vec3) -> (Frame, Vec3) {
    let Some(nested) = frames.get(usize::from(index)) else {
        return (Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z }, eye);
    };
    let (outer, eye) = frame_of(frames, nested.outer, eye);
    match nested.step {
        Step::Mirror => (Frame { n: -outer.n, ..outer }, Vec3::new(eye.x, eye.y, -eye.z)),
        Step::Tilt(n) => {
            let inner = tilted_frame(n, eye);
            let [s, t, n] = [inner.s, inner.t, inner.n].map(|v| outer.to_world(v));
            (Frame { s, t, n }, inner.to_local(eye))
        }
    }
}
