//! Orthonormal frames. Local coordinates: x = s, y = t, z = n.

use glam::Vec3;

/// A right-handed orthonormal basis around a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub s: Vec3,
    /// Second tangent.
    pub t: Vec3,
    /// Normal.
    pub n: Vec3,
}

impl Frame {
    /// A frame around the unit normal `n`, without branches that lose precision (Duff et al. 2017).
    pub fn from_normal(n: Vec3) -> Frame {
        let sign = 1.0f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Frame {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// A frame around the unit normal `n` whose first tangent lies in the plane of `n` and `tangent` (dp/du), or any
    /// frame when `tangent` is parallel to `n`, zero or not finite.
    pub fn from_normal_tangent(n: Vec3, tangent: Vec3) -> Frame {
        let s = tangent - n * n.dot(tangent);
        let len2 = s.length_squared();
        if len2 > 1e-12 * tangent.length_squared() && len2.is_finite() {
            let s = s / len2.sqrt();
            Frame { s, t: n.cross(s), n }
        } else {
            Frame::from_normal(n)
        }
    }

    /// World direction → local coordinates.
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local coordinates → world direction.
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn is_orthonormal_and_right_handed(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0) {
            let n = Vec3::new(x, y, z);
            prop_assume!(n.length() > 1e-3);
            let n = n.normalize();
            for f in [Frame::from_normal(n), Frame::from_normal_tangent(n, Vec3::new(0.3, -2.0, 0.7)), Frame::from_normal_tangent(n, n)] {
                prop_assert!((f.s.cross(f.t) - f.n).length() < 1e-5);
                prop_assert!(f.s.dot(f.t).abs() < 1e-5 && (f.s.length() - 1.0).abs() < 1e-5);
                let v = Vec3::new(0.2, -0.5, 0.9);
                prop_assert!((f.to_local(f.to_world(v)) - v).length() < 1e-5);
            }
        }
    }
}
