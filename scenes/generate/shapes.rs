//! Primitive shapes: boxes, bevelled blocks, surfaces of revolution, tubes, patches and arches.

use crate::mesh::Mesh;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Short for a vector.
pub fn v3(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Texture coordinates in metres, projected along the axis that the normal is closest to.
fn box_uv(p: DVec3, n: DVec3) -> DVec2 {
    let a = n.abs();
    if a.y >= a.x && a.y >= a.z {
        DVec2::new(p.x, p.z)
    } else if a.x >= a.z {
        DVec2::new(p.z, p.y)
    } else {
        DVec2::new(p.x, p.y)
    }
}

/// A flat quadrilateral, counter-clockwise from its front.
pub fn quad(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Mesh {
    let n = (b - a).cross(c - a).normalize();
    let mut m = Mesh::default();
    let i = [a, b, c, d].map(|p| m.vertex(p, n, box_uv(p, n)));
    m.quad(i[0], i[1], i[2], i[3]);
    m
}

/// A flat picture: texture coordinates run over [0, 1]², origin at `a`.
pub fn picture(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Mesh {
    let mut m = quad(a, b, c, d);
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for (v, uv) in m.vertices.iter_mut().zip(corners) {
        v.uv = DVec2::from(uv);
    }
    m
}

/// A sharp box.
pub fn slab(lo: [f64; 3], hi: [f64; 3]) -> Mesh {
    block(lo, hi, 0.0)
}

/// A box whose edges are cut by `bevel` and shaded round.
pub fn block(lo: [f64; 3], hi: [f64; 3], bevel: f64) -> Mesh {
    let (lo, hi) = (DVec3::from(lo), DVec3::from(hi));
    let (c, h) = ((lo + hi) / 2.0, (hi - lo) / 2.0);
    let mut m = Mesh::default();
    // corner(axis, signs): the vertex of the face along `axis` at the corner with these signs.
    let corner = |axis: usize, s: [f64; 3]| 4 * (2 * axis + (s[axis] > 0.0) as usize) + inner(axis, s);
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            for k in 0..4 {
                let mut s = [0.0; 3];
                s[axis] = sign;
                s[(axis + 1) % 3] = if k & 1 == 1 { 1.0 } else { -1.0 };
                s[(axis + 2) % 3] = if k & 2 == 2 { 1.0 } else { -1.0 };
                let mut p = h - DVec3::splat(bevel);
                p[axis] = h[axis];
                let p = c + p * DVec3::from(s);
                let mut n = DVec3::ZERO;
                n[axis] = sign;
                m.vertex(p, n, box_uv(p, n));
            }
            let first = 4 * (2 * axis + (sign > 0.0) as usize) as u32;
            m.quad(first, first + 1, first + 3, first + 2);
        }
    }
    if bevel <= 0.0 {
        return m;
    }
    let signs = [-1.0, 1.0];
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for sa in signs {
            for sb in signs {
                let mut s = [[0.0; 3]; 2];
                for (end, sign) in signs.iter().enumerate() {
                    s[end][axis] = *sign;
                    s[end][a] = sa;
                    s[end][b] = sb;
                }
                let [i, j, k, l] = [corner(a, s[0]), corner(a, s[1]), corner(b, s[1]), corner(b, s[0])];
                m.quad(i as u32, j as u32, k as u32, l as u32);
            }
        }
    }
    for s in 0..8 {
        let s = [0, 1, 2].map(|k| if s >> k & 1 == 1 { 1.0 } else { -1.0 });
        let [i, j, k] = [0, 1, 2].map(|axis| corner(axis, s) as u32);
        m.triangle(i, j, k);
    }
    m
}

/// Place of a corner among the four of its face.
fn inner(axis: usize, s: [f64; 3]) -> usize {
    (s[(axis + 1) % 3] > 0.0) as usize + 2 * (s[(axis + 2) % 3] > 0.0) as usize
}

/// A smooth patch `f(u, v)` over [0, 1]² in `nu` × `nv` cells; its front is where ∂u × ∂v points.
pub fn patch(nu: usize, nv: usize, f: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let mut m = Mesh::default();
    let e = 1e-4;
    for j in 0..=nv {
        for i in 0..=nu {
            let (u, v) = (i as f64 / nu as f64, j as f64 / nv as f64);
            let slope = |u: f64, v: f64| {
                let du = f((u + e).min(1.0), v) - f((u - e).max(0.0), v);
                let dv = f(u, (v + e).min(1.0)) - f(u, (v - e).max(0.0));
                du.cross(dv)
            };
            let mut n = slope(u, v);
            if n.length() < 1e-14 {
                n = slope(u.clamp(0.01, 0.99), v.clamp(0.01, 0.99));
            }
            m.vertex(f(u, v), n.normalize_or_zero(), DVec2::new(u, v));
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let a = (j * (nu + 1) + i) as u32;
            let b = a + nu as u32 + 1;
            m.quad(a, a + 1, b + 1, b);
        }
    }
    m
}

/// A Catmull–Rom curve through `points`, each span cut into `per` pieces.
pub fn curve<const N: usize>(points: &[[f64; N]], per: usize) -> Vec<[f64; N]> {
    let mut out = Vec::new();
    for i in 0..points.len() - 1 {
        let (p1, p2) = (points[i], points[i + 1]);
        let (p0, p3) = (if i > 0 { points[i - 1] } else { p1 }, *points.get(i + 2).unwrap_or(&p2));
        for k in 0..per {
            let t = k as f64 / per as f64;
            out.push(std::array::from_fn(|c| {
                let (a, b, c, d) = (p0[c], p1[c], p2[c], p3[c]);
                b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
            }));
        }
    }
    out.push(points[points.len() - 1]);
    out
}

/// Turns a profile of (radius, height) about the y axis. A profile that runs upwards on the outside faces outwards;
/// bends of more than 40° stay sharp.
pub fn lathe(profile: &[[f64; 2]], n: usize) -> Mesh {
    let mut m = Mesh::default();
    // Radii that are zero but for rounding, such as the sine of π, are zero.
    let axis = |r: f64| if r < 1e-9 { 0.0 } else { r };
    let points: Vec<DVec2> = profile.iter().map(|&[r, y]| DVec2::new(axis(r), y)).collect();
    let spans: Vec<(DVec2, DVec2)> =
        points.windows(2).map(|w| (w[0], w[1])).filter(|(a, b)| a.distance(*b) > 1e-9).collect();
    let normals: Vec<DVec2> = spans.iter().map(|(a, b)| DVec2::new(b.y - a.y, a.x - b.x).normalize()).collect();
    let smooth = |i: usize, j: usize| {
        if normals[i].dot(normals[j]) > 0.766 { (normals[i] + normals[j]).normalize() } else { normals[i] }
    };
    let mut length = 0.0;
    for (i, (a, b)) in spans.iter().enumerate() {
        let na = if i > 0 { smooth(i, i - 1) } else { normals[i] };
        let nb = if i + 1 < spans.len() { smooth(i, i + 1) } else { normals[i] };
        let next = length + a.distance(*b);
        let base = m.vertices.len() as u32;
        for k in 0..=n {
            let (s, c) = (2.0 * PI * (k % n) as f64 / n as f64).sin_cos();
            let u = k as f64 / n as f64;
            m.vertex(v3(a.x * c, a.y, a.x * s), v3(na.x * c, na.y, na.x * s), DVec2::new(u, length));
            m.vertex(v3(b.x * c, b.y, b.x * s), v3(nb.x * c, nb.y, nb.x * s), DVec2::new(u, next));
        }
        for k in 0..n as u32 {
            let i = base + 2 * k;
            m.quad(i, i + 1, i + 3, i + 2);
        }
        length = next;
    }
    m
}

/// An upright cylinder with closed ends, standing on the ground.
pub fn cylinder(radius: f64, height: f64, n: usize) -> Mesh {
    lathe(&[[0.0, 0.0], [radius, 0.0], [radius, height], [0.0, height]], n)
}

/// A ball around the origin.
pub fn ball(radius: f64, n: usize) -> Mesh {
    let profile: Vec<[f64; 2]> =
        (0..=n).map(|i| PI * i as f64 / n as f64).map(|a| [radius * a.sin(), -radius * a.cos()]).collect();
    lathe(&profile, 2 * n)
}

/// A disc that faces down.
pub fn disc_down(radius: f64, n: usize) -> Mesh {
    lathe(&[[0.0, 0.0], [radius, 0.0]], n)
}

/// A disc that faces up.
pub fn disc_up(radius: f64, n: usize) -> Mesh {
    lathe(&[[radius, 0.0], [0.0, 0.0]], n)
}

/// A round rod of varying radius along a path of points; `radius` gets the fraction of the way.
pub fn tube(path: &[[f64; 3]], n: usize, radius: impl Fn(f64) -> f64) -> Mesh {
    let mut m = Mesh::default();
    let points: Vec<DVec3> = path.iter().map(|&p| DVec3::from(p)).collect();
    let last = points.len() - 1;
    let tangent = |i: usize| (points[(i + 1).min(last)] - points[i.saturating_sub(1)]).normalize();
    let mut side = tangent(0).any_orthonormal_vector();
    for (i, &p) in points.iter().enumerate() {
        let t = tangent(i);
        side = (side - t * side.dot(t)).normalize();
        let up = t.cross(side);
        let r = radius(i as f64 / last as f64);
        for k in 0..=n {
            let (s, c) = (2.0 * PI * (k % n) as f64 / n as f64).sin_cos();
            let d = side * c + up * s;
            m.vertex(p + d * r, d, DVec2::new(k as f64 / n as f64, i as f64));
        }
    }
    let row = n as u32 + 1;
    for i in 0..last as u32 {
        for k in 0..n as u32 {
            let a = i * row + k;
            m.quad(a, a + 1, a + row + 1, a + row);
        }
    }
    for (i, sign) in [(0, -1.0), (last, 1.0)] {
        let d = tangent(i) * sign;
        let c = m.vertex(points[i], d, DVec2::ZERO);
        let rim: Vec<u32> = (0..n)
            .map(|k| m.vertices[i * (n + 1) + k].p)
            .collect::<Vec<_>>()
            .into_iter()
            .map(|p| m.vertex(p, d, DVec2::ZERO))
            .collect();
        for k in 0..n {
            m.triangle(c, rim[k], rim[(k + 1) % n]);
        }
    }
    m
}

/// A straight rod.
pub fn rod(a: [f64; 3], b: [f64; 3], radius: f64, n: usize) -> Mesh {
    tube(&[a, b], n, |_| radius)
}

/// A round arch over [−w/2, w/2] as points (x, y), springing at height `spring`.
pub fn round_arch(w: f64, spring: f64, n: usize) -> Vec<[f64; 2]> {
    (0..=n).map(|i| PI * (1.0 - i as f64 / n as f64)).map(|a| [w / 2.0 * a.cos(), spring + w / 2.0 * a.sin()]).collect()
}

/// Height above the springing of a pointed arch of width `w` and height `rise` (≥ w/2) at `x` from its middle.
pub fn pointed(w: f64, rise: f64, x: f64) -> f64 {
    // Each side is an arc of radius r about a centre on the springing line, d beyond the middle.
    let half = w / 2.0;
    let r = (half * half + rise * rise) / (2.0 * half);
    let x = x.abs().min(half) + (r - half);
    (r * r - x * x).max(0.0).sqrt()
}

/// A pointed arch as points, dense where it is steep.
pub fn pointed_arch(w: f64, rise: f64, spring: f64, n: usize) -> Vec<[f64; 2]> {
    (0..=n)
        .map(|i| 2.0 * i as f64 / n as f64 - 1.0)
        .map(|t| w / 2.0 * t.signum() * (1.0 - (1.0 - t.abs()).powi(2)))
        .map(|x| [x, spring + pointed(w, rise, x)])
        .collect()
}

/// The wall above an arch: from the arch's points up to height `top`, between `z0` and `z1`, with its soffit.
pub fn above_arch(points: &[[f64; 2]], top: f64, z0: f64, z1: f64) -> Mesh {
    let mut m = Mesh::default();
    let soffit = |i: usize| {
        let (a, b) = (points[i.saturating_sub(1)], points[(i + 1).min(points.len() - 1)]);
        let n = v3(b[1] - a[1], a[0] - b[0], 0.0).normalize();
        // A pointed crown stays sharp enough when its two sides are averaged.
        if n.y > 0.0 { -n } else { n }
    };
    for i in 0..points.len() - 1 {
        let ([xa, ya], [xb, yb]) = (points[i], points[i + 1]);
        m.add(quad(v3(xa, ya, z1), v3(xb, yb, z1), v3(xb, top, z1), v3(xa, top, z1)));
        m.add(quad(v3(xb, yb, z0), v3(xa, ya, z0), v3(xa, top, z0), v3(xb, top, z0)));
        let c = [
            m.vertex(v3(xa, ya, z0), soffit(i), DVec2::new(z0, ya)),
            m.vertex(v3(xb, yb, z0), soffit(i + 1), DVec2::new(z0, yb)),
            m.vertex(v3(xb, yb, z1), soffit(i + 1), DVec2::new(z1, yb)),
            m.vertex(v3(xa, ya, z1), soffit(i), DVec2::new(z1, ya)),
        ];
        m.quad(c[0], c[1], c[2], c[3]);
    }
    m
}

/// A wall in the xy plane from x0 to x1, y0 to y1, between z0 and z1, with rectangular holes [x0, x1, y0, y1] that must
/// be in ascending x and apart from one another.
pub fn wall(x: [f64; 2], y: [f64; 2], z: [f64; 2], holes: &[[f64; 4]]) -> Mesh {
    let mut m = Mesh::default();
    let mut piece = |x0: f64, x1: f64, y0: f64, y1: f64| {
        if x1 - x0 > 1e-6 && y1 - y0 > 1e-6 {
            m.add(slab([x0, y0, z[0]], [x1, y1, z[1]]));
        }
    };
    let mut left = x[0];
    for h in holes {
        piece(left, h[0], y[0], y[1]);
        piece(h[0], h[1], y[0], h[2]);
        piece(h[0], h[1], h[3], y[1]);
        left = h[1];
    }
    piece(left, x[1], y[0], y[1]);
    m
}
