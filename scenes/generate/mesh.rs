//! Triangle meshes with normals and texture coordinates, and their binary PLY form.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use std::collections::HashMap;

/// A corner of a triangle.
#[derive(Clone, Copy)]
pub struct Vertex {
    pub p: DVec3,
    pub n: DVec3,
    pub uv: DVec2,
}

/// Triangles in metres, y up, counter-clockwise as seen from outside.
#[derive(Clone, Default)]
pub struct Mesh {
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, p: DVec3, n: DVec3, uv: DVec2) -> u32 {
        self.vertices.push(Vertex { p, n, uv });
        self.vertices.len() as u32 - 1
    }

    /// Adds a triangle, turned so that it faces where its vertex normals point; drops degenerate ones.
    pub fn triangle(&mut self, a: u32, b: u32, c: u32) {
        let [va, vb, vc] = [a, b, c].map(|i| self.vertices[i as usize]);
        let g = (vb.p - va.p).cross(vc.p - va.p);
        if g.length() < 1e-12 {
            return;
        }
        let outward = g.dot(va.n + vb.n + vc.n) >= 0.0;
        self.triangles.push(if outward { [a, b, c] } else { [a, c, b] });
    }

    /// Adds the two triangles of a convex quadrilateral.
    pub fn quad(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.triangle(a, b, c);
        self.triangle(a, c, d);
    }

    /// Takes in all of `other`.
    pub fn add(&mut self, other: Mesh) {
        let base = self.vertices.len() as u32;
        self.vertices.extend(other.vertices);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
    }

    /// Both meshes as one.
    pub fn and(mut self, other: Mesh) -> Mesh {
        self.add(other);
        self
    }

    /// The mesh under an affine map; mirrored maps keep the outside outside.
    pub fn mapped(mut self, map: DAffine3) -> Mesh {
        let normals: DMat3 = map.matrix3.inverse().transpose();
        for v in &mut self.vertices {
            v.p = map.transform_point3(v.p);
            v.n = (normals * v.n).normalize_or_zero();
        }
        if map.matrix3.determinant() < 0.0 {
            for t in &mut self.triangles {
                t.swap(1, 2);
            }
        }
        self
    }

    /// Moved.
    pub fn at(self, x: f64, y: f64, z: f64) -> Mesh {
        self.mapped(DAffine3::from_translation(DVec3::new(x, y, z)))
    }

    /// Turned about the vertical axis, counter-clockwise from above, in degrees.
    pub fn turned(self, degrees: f64) -> Mesh {
        self.mapped(DAffine3::from_rotation_y(degrees.to_radians()))
    }

    /// Turned about the x axis, in degrees.
    pub fn tilted(self, degrees: f64) -> Mesh {
        self.mapped(DAffine3::from_rotation_x(degrees.to_radians()))
    }

    /// Turned about the z axis, in degrees.
    pub fn rolled(self, degrees: f64) -> Mesh {
        self.mapped(DAffine3::from_rotation_z(degrees.to_radians()))
    }

    /// Stretched along the axes.
    pub fn scaled(self, x: f64, y: f64, z: f64) -> Mesh {
        self.mapped(DAffine3::from_scale(DVec3::new(x, y, z)))
    }

    /// Turned inside out.
    pub fn flipped(mut self) -> Mesh {
        for v in &mut self.vertices {
            v.n = -v.n;
        }
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        self
    }

    /// True if every vertex normal is its triangle's own, so that a file needs no normals.
    fn is_flat(&self) -> bool {
        self.triangles.iter().all(|t| {
            let [a, b, c] = t.map(|i| self.vertices[i as usize]);
            let g = (b.p - a.p).cross(c.p - a.p).normalize_or_zero();
            [a, b, c].iter().all(|v| v.n.dot(g) > 0.999_999)
        })
    }

    /// Binary little-endian PLY. Vertices that agree in everything are stored once; normals are left out of flat
    /// meshes (whose vertices stay separate per face) and texture coordinates where no texture needs them.
    pub fn ply(&self, textured: bool) -> Vec<u8> {
        let normals = !self.is_flat();
        // Normals and coordinates are rounded, so that the last bits of a mathematics library never show.
        let round = |x: f64, unit: f64| ((x * unit).round() / unit + 0.0) as f32;
        let mut seen: HashMap<Vec<u8>, u32> = HashMap::new();
        let (mut body, mut count, mut faces, mut face_count) = (Vec::<u8>::new(), 0u32, Vec::<u8>::new(), 0);
        for t in &self.triangles {
            let ids = t.map(|i| {
                let v = &self.vertices[i as usize];
                let mut key = Vec::with_capacity(32);
                let mut put = |x: f32| key.extend(x.to_le_bytes());
                v.p.to_array().iter().for_each(|&x| put(round(x, 1e6)));
                if normals {
                    v.n.to_array().iter().for_each(|&x| put(round(x, 1e5)));
                }
                if textured {
                    v.uv.to_array().iter().for_each(|&x| put(round(x, 1e5)));
                }
                let stored = key.len();
                if !normals {
                    let mut put = |x: f32| key.extend(x.to_le_bytes());
                    v.n.to_array().iter().for_each(|&x| put(round(x, 1e3)));
                }
                *seen.entry(key.clone()).or_insert_with(|| {
                    body.extend(&key[..stored]);
                    count += 1;
                    count - 1
                })
            });
            if ids[0] == ids[1] || ids[1] == ids[2] || ids[0] == ids[2] {
                continue;
            }
            faces.push(3u8);
            ids.iter().for_each(|i| faces.extend(i.to_le_bytes()));
            face_count += 1;
        }
        let mut head = format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n");
        let names: [(bool, &[&str]); 3] =
            [(true, &["x", "y", "z"]), (normals, &["nx", "ny", "nz"]), (textured, &["u", "v"])];
        for name in names.iter().filter(|n| n.0).flat_map(|n| n.1) {
            head += &format!("property float {name}\n");
        }
        head += &format!("element face {face_count}\nproperty list uchar uint vertex_indices\nend_header\n");
        let mut out = head.into_bytes();
        out.extend(body);
        out.extend(faces);
        out
    }
}
