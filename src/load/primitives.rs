//! Shapes of a formula as triangles, after Mitsuba's parametrisations; round ones are made of triangles only where they
//! emit and are stretched. These have exact vertex normals, and their radius is a little larger than one so that the
//! *area* of the triangles is the true one: an emitter's power is that of the formula.

use super::mesh;
use crate::scene::MeshDesc;
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A shape in its own space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Primitive {
    /// [−1, 1]² at z = 0, facing +z; uv = (x + 1, y + 1) / 2.
    Rectangle,
    /// [−1, 1]³, each face with its own uv.
    Cube,
    /// Unit sphere; u = azimuth / 2π from +x, v = angle from +z / π.
    Sphere,
    /// Unit radius around z from 0 to 1, without caps, facing outwards; u = azimuth / 2π, v = z.
    Cylinder,
}

/// Segments around, and from pole to pole.
const AROUND: u32 = 128;
const ALONG: u32 = 64;

impl Primitive {
    /// The triangles. With `mirrored` (see [`mesh::MeshOptions`]) they are made for a placement that mirrors.
    pub(super) fn mesh(self, mirrored: bool) -> MeshDesc {
        let mut m = match self {
            Primitive::Rectangle => rectangle(),
            Primitive::Cube => cube(),
            Primitive::Sphere => sphere(),
            Primitive::Cylinder => cylinder(),
        };
        if mirrored {
            if self == Primitive::Sphere {
                // A mirrored sphere is inside out in Mitsuba 3; the others keep facing where their normal goes.
                m.normals.iter_mut().for_each(|n| *n = -*n);
            } else {
                mesh::reverse_winding(&mut m);
            }
        }
        m
    }
}

fn rectangle() -> MeshDesc {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Vec2::from_array);
    MeshDesc {
        name: "rectangle".into(),
        positions: corners.iter().map(|c| c.extend(0.0)).collect(),
        normals: vec![Vec3::Z; 4],
        uvs: corners.iter().map(|c| (*c + 1.0) * 0.5).collect(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..MeshDesc::default()
    }
}

/// Normal, −u and +v: at uv = (0, 1) stands normal + minus_u + plus_v. (Read off Mitsuba 3.9.1.)
#[rustfmt::skip]
const CUBE_FACES: [[[f32; 3]; 3]; 6] = [
    [[0., -1., 0.], [0., 0., -1.], [1., 0., 0.]],
    [[0., 1., 0.], [1., 0., 0.], [0., 0., -1.]],
    [[1., 0., 0.], [0., -1., 0.], [0., 0., -1.]],
    [[0., 0., 1.], [0., -1., 0.], [1., 0., 0.]],
    [[-1., 0., 0.], [0., -1., 0.], [0., 0., 1.]],
    [[0., 0., -1.], [0., 1., 0.], [1., 0., 0.]],
];

fn cube() -> MeshDesc {
    let mut m = MeshDesc { name: "cube".into(), ..MeshDesc::default() };
    for [normal, minus_u, plus_v] in CUBE_FACES.map(|f| f.map(Vec3::from_array)) {
        let base = m.positions.len() as u32;
        for uv in [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(Vec2::from_array) {
            m.positions.push(normal + minus_u * (1.0 - 2.0 * uv.x) + plus_v * (2.0 * uv.y - 1.0));
            m.normals.push(normal);
            m.uvs.push(uv);
        }
        m.triangles.extend([[0, 1, 2], [3, 0, 2]].map(|t: [u32; 3]| t.map(|i| base + i)));
    }
    m
}

fn sphere() -> MeshDesc {
    let mut directions: Vec<(DVec3, Vec2)> = Vec::new();
    for i in 0..=ALONG {
        let v = f64::from(i) / f64::from(ALONG);
        let (sin, cos) = (v * PI).sin_cos();
        for j in 0..=AROUND {
            // A pole belongs to every meridian: its u is that of the middle of the triangle it is a corner of.
            let pole = i == 0 || i == ALONG;
            let u = (f64::from(j) + if pole { 0.5 } else { 0.0 }) / f64::from(AROUND);
            let (s, c) = (u * 2.0 * PI).sin_cos();
            let d = if pole { DVec3::Z * cos } else { DVec3::new(sin * c, sin * s, cos) };
            directions.push((d, Vec2::new(u as f32, v as f32)));
        }
    }
    let mut triangles = Vec::new();
    let at = |i: u32, j: u32| i * (AROUND + 1) + j;
    for (i, j) in (0..ALONG).flat_map(|i| (0..AROUND).map(move |j| (i, j))) {
        if i > 0 {
            triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
        }
        if i + 1 < ALONG {
            triangles.push([at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]);
        }
    }
    let area: f64 = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| directions[i as usize].0);
            (b - a).cross(c - a).length() * 0.5
        })
        .sum();
    let radius = (4.0 * PI / area).sqrt();
    MeshDesc {
        name: "sphere".into(),
        positions: directions.iter().map(|(d, _)| (*d * radius).as_vec3()).collect(),
        normals: directions.iter().map(|(d, _)| d.as_vec3()).collect(),
        uvs: directions.iter().map(|(_, uv)| *uv).collect(),
        triangles,
        ..MeshDesc::default()
    }
}

/// Points of the regular polygon of `n` corners whose area is that of the unit circle.
fn circle(n: u32) -> impl Iterator<Item = (f64, f64, f64)> {
    let step = 2.0 * PI / f64::from(n);
    let radius = (step / step.sin()).sqrt();
    (0..=n).map(move |j| {
        let (s, c) = (f64::from(j) * step).sin_cos();
        (radius * c, radius * s, f64::from(j) / f64::from(n))
    })
}

fn cylinder() -> MeshDesc {
    let n = 2 * AROUND;
    let mut m = MeshDesc { name: "cylinder".into(), ..MeshDesc::default() };
    // The wall's area grows with the perimeter of the polygon, not with its area.
    let radius = PI / (f64::from(n) * (PI / f64::from(n)).sin());
    for (x, y, u) in circle(n) {
        let direction = DVec3::new(x, y, 0.0).normalize();
        for z in [0.0, 1.0] {
            m.positions.push((direction * radius).as_vec3().with_z(z));
            m.normals.push(direction.as_vec3());
            m.uvs.push(Vec2::new(u as f32, z));
        }
    }
    for j in 0..n {
        let [a, b, c, d] = [2 * j, 2 * j + 2, 2 * j + 3, 2 * j + 1];
        m.triangles.extend([[a, b, c], [a, c, d]]);
    }
    m
}

#[cfg(test)]
mod tests;
