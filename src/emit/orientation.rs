//! The rotation (or rotation and mirroring) of a transform.

use crate::math::{DMat4, Vec3};

/// Unit axes of a space in the world; left-handed if the transform mirrors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orientation {
    x: Vec3,
    y: Vec3,
    z: Vec3,
}

impl Orientation {
    /// The axes of `to_world` without scale and shear: z is kept, y made perpendicular, x's side is kept. `None` if
    /// they are degenerate.
    pub fn new(to_world: DMat4) -> Option<Orientation> {
        let z = to_world.z_axis.truncate().try_normalize()?;
        let y = to_world.y_axis.truncate();
        let y = (y - z * z.dot(y)).try_normalize()?;
        let side = y.cross(z).dot(to_world.x_axis.truncate());
        if side == 0.0 || !side.is_finite() {
            return None;
        }
        let x = y.cross(z) * side.signum();
        Some(Orientation { x: x.as_vec3(), y: y.as_vec3(), z: z.as_vec3() })
    }

    /// Unit z axis.
    pub fn z(&self) -> Vec3 {
        self.z
    }

    /// Local → world.
    pub fn to_world(self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// World → local.
    pub fn to_local(self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }
}
