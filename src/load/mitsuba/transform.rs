//! `<transform>`: a product of steps, each applied after those before it.

use super::document::{Node, Tree};
use super::values::{number, numbers, triple};
use crate::load::report::Report;
use crate::math::Frame;
use crate::scene::diag::{Diagnostic, nearest};
use glam::{DMat4, DVec3, DVec4};
use std::cell::RefCell;

/// How far from one the length of a rotation's axis may be.
const AXIS_TOLERANCE: f64 = 1e-3;

const STEPS: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// The matrix of a `<transform>` element; steps with mistakes are reported and left out.
pub(super) fn transform(tree: &Tree, node: usize, report: &RefCell<Report>) -> DMat4 {
    let mut all = DMat4::IDENTITY;
    for &child in &tree.nodes[node].children {
        let step = &tree.nodes[child];
        warn_of_axis(step, report);
        match matrix_of(step) {
            Ok(m) => all = m * all,
            Err((attr, message)) => {
                let mut d = Diagnostic::error("scene::bad-value", message).at(step.span_of(attr));
                if let Some(near) = (!STEPS.contains(&step.tag.as_str())).then(|| nearest(&step.tag, STEPS)).flatten() {
                    d = d.label(format!("did you mean <{near}>?"));
                }
                report.borrow_mut().push(d);
            }
        }
    }
    all
}

/// Says where Mitsuba 3 makes something other than a rotation: it does not normalize the axis, as 0.6 did.
fn warn_of_axis(step: &Node, report: &RefCell<Report>) {
    if step.tag != "rotate" || step.legacy {
        return;
    }
    let Ok(length) = vector(step, 0.0).map(DVec3::length) else { return };
    if length > 0.0 && (length - 1.0).abs() > AXIS_TOLERANCE {
        let message = format!("the axis of this rotation is {length:.3} long: it is taken as a direction");
        let help = "Mitsuba 3 makes a matrix of it that is no rotation: normalize the axis for equal pictures";
        report.borrow_mut().push(Diagnostic::warning("scene::rotation-axis", message).at(step.span.clone()).help(help));
    }
}

/// The attribute at fault ("" for the element) and what is wrong.
type Fault = (&'static str, String);

fn matrix_of(step: &Node) -> Result<DMat4, Fault> {
    match step.tag.as_str() {
        "translate" => Ok(DMat4::from_translation(vector(step, 0.0)?)),
        "scale" => {
            if let Some(value) = step.attr("value") {
                let v = numbers(&value.value).map_err(|m| ("value", m))?;
                return match v.as_slice() {
                    &[s] => Ok(DMat4::from_scale(DVec3::splat(s))),
                    &[x, y, z] => Ok(DMat4::from_scale(DVec3::new(x, y, z))),
                    other => Err(("value", format!("expected one or three numbers, found {}", other.len()))),
                };
            }
            Ok(DMat4::from_scale(vector(step, 1.0)?))
        }
        "rotate" => {
            let axis = vector(step, 0.0)?;
            let axis = axis.try_normalize().ok_or(("", "the axis of a rotation must not be zero".to_owned()))?;
            let angle = step.attr("angle").ok_or(("", "<rotate> needs an `angle` in degrees".to_owned()))?;
            let angle = number(&angle.value).map_err(|m| ("angle", m))?;
            Ok(DMat4::from_axis_angle(axis, angle.to_radians()))
        }
        "lookat" => {
            let get = |name: &'static str| {
                let attr = step.attr(name).ok_or_else(|| ("", format!("<lookat> needs `{name}`")))?;
                triple(&attr.value).map_err(|m| (name, m))
            };
            let (origin, target) = (get("origin")?, get("target")?);
            let up = if step.attr("up").is_some() { get("up")? } else { DVec3::ZERO };
            look_at(origin, target, up).map_err(|m| ("", m))
        }
        "matrix" => {
            let value = step.attr("value").ok_or(("", "<matrix> needs a `value`".to_owned()))?;
            let v = numbers(&value.value).map_err(|m| ("value", m))?;
            match v.len() {
                16 => Ok(DMat4::from_cols_slice(&v).transpose()),
                9 => Ok(DMat4::from_cols(
                    DVec4::new(v[0], v[3], v[6], 0.0),
                    DVec4::new(v[1], v[4], v[7], 0.0),
                    DVec4::new(v[2], v[5], v[8], 0.0),
                    DVec4::W,
                )),
                n => Err(("value", format!("a matrix has 16 or 9 numbers, found {n}"))),
            }
        }
        tag => Err(("", format!("<{tag}> is not a step of a transform: expected one of {}", STEPS.join(", ")))),
    }
}

/// `value="x, y, z"` or `x`, `y`, `z`, each `default` if it is not there.
fn vector(step: &Node, default: f64) -> Result<DVec3, Fault> {
    if let Some(value) = step.attr("value") {
        return triple(&value.value).map_err(|m| ("value", m));
    }
    let get = |name: &'static str| step.attr(name).map_or(Ok(default), |a| number(&a.value).map_err(|m| (name, m)));
    Ok(DVec3::new(get("x")?, get("y")?, get("z")?))
}

/// Camera → world: +z towards `target`, +y as near to `up` as can be, +x = y × z (left of the picture). Without an `up`
/// (zero) any will do; the choice is Mitsuba's, for the sake of equal pictures.
pub(in crate::load) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Result<DMat4, String> {
    let forward = (target - origin).try_normalize().ok_or("`origin` and `target` are the same point")?;
    let up = if up == DVec3::ZERO { Frame::from_normal(forward.as_vec3()).s.as_dvec3() } else { up.normalize() };
    let left = up.cross(forward);
    if left.length() < 1e-9 {
        return Err("`up` is parallel to the viewing direction".into());
    }
    let left = left.normalize();
    let new_up = forward.cross(left);
    Ok(DMat4::from_cols(left.extend(0.0), new_up.extend(0.0), forward.extend(0.0), origin.extend(1.0)))
}
