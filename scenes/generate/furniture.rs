//! Things that several scenes share. Each stands on the ground with its middle at the origin and faces +z.

use crate::mesh::Mesh;
use crate::shapes::*;

/// A table of four square or turned legs: width, height, depth.
pub fn table(w: f64, h: f64, d: f64, turned_legs: bool) -> Mesh {
    let mut m = block([-w / 2.0, h - 0.035, -d / 2.0], [w / 2.0, h, d / 2.0], 0.008);
    let (x, z) = (w / 2.0 - 0.08, d / 2.0 - 0.08);
    m.add(slab([-x, h - 0.115, -z - 0.01], [x, h - 0.03, -z + 0.01]));
    m.add(slab([-x, h - 0.115, z - 0.01], [x, h - 0.03, z + 0.01]));
    m.add(slab([-x - 0.01, h - 0.115, -z], [-x + 0.01, h - 0.03, z]));
    m.add(slab([x - 0.01, h - 0.115, -z], [x + 0.01, h - 0.03, z]));
    for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let leg = if turned_legs {
            let p = [[0.0, 0.0], [0.022, 0.0], [0.03, 0.02], [0.02, 0.07], [0.028, 0.28], [0.036, 0.42], [0.022, 0.5]];
            let mut p = curve(&p, 3);
            p.extend([[0.034, 0.52], [0.034, 0.56], [0.024, 0.57]]);
            lathe(&p, 12).and(block([-0.032, 0.56, -0.032], [0.032, h - 0.03, 0.032], 0.004))
        } else {
            block([-0.028, 0.0, -0.028], [0.028, h - 0.03, 0.028], 0.005)
        };
        m.add(leg.at(sx * x, 0.0, sz * z));
    }
    m
}

/// A wooden chair with a slatted back; sitters look towards +z.
pub fn chair() -> Mesh {
    let mut m = block([-0.21, 0.43, -0.2], [0.21, 0.46, 0.22], 0.01);
    for x in [-0.18, 0.18] {
        m.add(block([x - 0.02, 0.0, 0.16], [x + 0.02, 0.435, 0.2], 0.005));
        m.add(block([x - 0.02, 0.0, -0.2], [x + 0.02, 0.46, -0.16], 0.005));
        m.add(block([x - 0.02, 0.0, -0.02], [x + 0.02, 0.46, 0.02], 0.005).tilted(-8.0).at(0.0, 0.45, -0.18));
        m.add(slab([x - 0.01, 0.2, -0.17], [x + 0.01, 0.23, 0.17]));
    }
    for y in [0.14, 0.26, 0.38] {
        m.add(block([-0.18, y - 0.03, -0.009], [0.18, y + 0.03, 0.009], 0.005).tilted(-8.0).at(0.0, 0.45, -0.18));
    }
    m.and(slab([-0.18, 0.38, 0.165], [0.18, 0.43, 0.185])).and(slab([-0.18, 0.38, -0.185], [0.18, 0.43, -0.165]))
}

/// A teapot: body with lid, spout towards +x, handle towards −x; 0.17 m high.
pub fn teapot() -> Mesh {
    let body = [[0.0, 0.0], [0.05, 0.0], [0.058, 0.006], [0.085, 0.04], [0.088, 0.075], [0.068, 0.11], [0.045, 0.122]];
    let mut p = curve(&body[2..], 4);
    p.splice(0..0, [[0.0, 0.0], [0.052, 0.0]]);
    p.push([0.047, 0.128]);
    p.extend(curve(&[[0.044, 0.128], [0.03, 0.138], [0.008, 0.144], [0.007, 0.15]], 3));
    p.extend(curve(&[[0.007, 0.15], [0.014, 0.158], [0.012, 0.167], [0.0, 0.17]], 3));
    let spout = [[0.07, 0.045, 0.0], [0.1, 0.055, 0.0], [0.118, 0.085, 0.0], [0.142, 0.118, 0.0]];
    let handle = [[-0.075, 0.1, 0.0], [-0.105, 0.115, 0.0], [-0.138, 0.1, 0.0], [-0.13, 0.06, 0.0], [-0.08, 0.04, 0.0]];
    lathe(&p, 26).and(tube(&curve(&spout, 4), 12, |t| 0.021 - 0.012 * t)).and(tube(&curve(&handle, 4), 9, |_| 0.0075))
}

/// A slender vase with a hollow mouth, 0.32 m high.
pub fn vase() -> Mesh {
    let outside =
        [[0.04, 0.0], [0.045, 0.01], [0.075, 0.09], [0.07, 0.16], [0.03, 0.24], [0.028, 0.275], [0.045, 0.32]];
    let inside = [[0.041, 0.319], [0.024, 0.275], [0.026, 0.24], [0.06, 0.17], [0.0, 0.05]];
    let mut p = curve(&outside, 3);
    p.insert(0, [0.0, 0.0]);
    p.extend(curve(&inside, 3));
    lathe(&p, 24)
}

/// A round bowl, hollow, radius 0.14 m.
pub fn bowl() -> Mesh {
    let mut p = vec![[0.0, 0.0], [0.05, 0.0], [0.05, 0.008]];
    p.extend(curve(&[[0.052, 0.01], [0.1, 0.03], [0.13, 0.06], [0.14, 0.09]], 4));
    p.extend(curve(&[[0.136, 0.09], [0.125, 0.06], [0.09, 0.032], [0.0, 0.014]], 4));
    lathe(&p, 32)
}

/// A cup with a handle towards +x, on its saucer.
pub fn cup() -> Mesh {
    let mut p = vec![[0.0, 0.012], [0.024, 0.012]];
    p.extend(curve(&[[0.025, 0.016], [0.036, 0.04], [0.041, 0.075]], 5));
    p.extend(curve(&[[0.038, 0.075], [0.033, 0.04], [0.02, 0.02], [0.0, 0.018]], 4));
    let saucer = [[0.0, 0.0], [0.035, 0.0], [0.075, 0.014], [0.078, 0.017], [0.04, 0.008], [0.0, 0.007]];
    let handle = [[0.037, 0.062, 0.0], [0.058, 0.062, 0.0], [0.062, 0.045, 0.0], [0.034, 0.032, 0.0]];
    lathe(&p, 28).and(lathe(&saucer, 28)).and(tube(&curve(&handle, 4), 8, |_| 0.004))
}

/// A picture frame around a picture of w × h metres, hanging in the xy plane, its back at z = 0.
pub fn frame(w: f64, h: f64) -> Mesh {
    let (x, y, t) = (w / 2.0, h / 2.0, 0.045);
    block([-x - t, -y - t, 0.0], [x + t, -y, 0.03], 0.008)
        .and(block([-x - t, y, 0.0], [x + t, y + t, 0.03], 0.008))
        .and(block([-x - t, -y, 0.0], [-x, y, 0.03], 0.008))
        .and(block([x, -y, 0.0], [x + t, y, 0.03], 0.008))
}

/// The picture for `frame`.
pub fn canvas(w: f64, h: f64) -> Mesh {
    let (x, y, z) = (w / 2.0, h / 2.0, 0.012);
    picture(v3(-x, -y, z), v3(x, -y, z), v3(x, y, z), v3(-x, y, z))
}

/// A panelled door leaf, hinged at the origin and reaching to x = w, between z = 0 and 0.04.
pub fn door_leaf(w: f64, h: f64) -> Mesh {
    let (t, rail) = (0.04, 0.12);
    let mut m = block([0.0, 0.0, 0.0], [rail, h, t], 0.003).and(block([w - rail, 0.0, 0.0], [w, h, t], 0.003));
    let rows = [0.0, 0.82, h - rail];
    for y in rows {
        let top = if y == 0.0 { 0.2 } else { y + rail };
        m.add(block([rail, y, 0.0], [w - rail, top, t], 0.003));
    }
    m.add(block([w / 2.0 - 0.05, 0.2, 0.0], [w / 2.0 + 0.05, 0.82, t], 0.003));
    m.add(block([w / 2.0 - 0.05, 0.94, 0.0], [w / 2.0 + 0.05, h - rail, t], 0.003));
    m.add(slab([rail, 0.2, 0.014], [w - rail, h - rail, t - 0.014]));
    for (x0, x1) in [(rail, w / 2.0 - 0.05), (w / 2.0 + 0.05, w - rail)] {
        for (y0, y1) in [(0.2, 0.82), (0.94, h - rail)] {
            m.add(block([x0 + 0.035, y0 + 0.035, 0.006], [x1 - 0.035, y1 - 0.035, t - 0.006], 0.008));
        }
    }
    m
}

/// Lever handles on both sides of that leaf.
pub fn door_handle(w: f64) -> Mesh {
    let mut m = Mesh::default();
    for (z, out) in [(0.0, -1.0), (0.04, 1.0)] {
        let x = w - 0.06;
        let lever = [
            [x, 1.02, z],
            [x, 1.02, z + 0.05 * out],
            [x - 0.015, 1.02, z + 0.06 * out],
            [x - 0.12, 1.015, z + 0.06 * out],
        ];
        m.add(tube(&curve(&lever, 3), 10, |_| 0.009));
        m.add(block([x - 0.022, 0.92, z.min(z + 0.005 * out)], [x + 0.022, 1.08, z.max(z + 0.005 * out)], 0.002));
    }
    m
}

/// The casing round a door or window opening: x0, x1, y0 (no lower board if 0), y1, on the side +z of the plane z.
pub fn casing(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Mesh {
    let t = 0.09;
    let mut m = block([x[0] - t, y[0], z[0]], [x[0], y[1] + t, z[1]], 0.004);
    m.add(block([x[1], y[0], z[0]], [x[1] + t, y[1] + t, z[1]], 0.004));
    m.add(block([x[0], y[1], z[0]], [x[1], y[1] + t, z[1]], 0.004));
    if y[0] > 0.0 {
        m.add(block([x[0] - t - 0.03, y[0] - 0.04, z[0]], [x[1] + t + 0.03, y[0], z[1] + 0.08], 0.006));
    }
    m
}

/// A window frame with `nx` × `ny` panes (no glass) in the opening x, y, around the plane z.
pub fn window(x: [f64; 2], y: [f64; 2], z: f64, nx: usize, ny: usize) -> Mesh {
    let (t, d) = (0.05, 0.03);
    let mut m = block([x[0], y[0], z - d], [x[1], y[0] + t, z + d], 0.006);
    m.add(block([x[0], y[1] - t, z - d], [x[1], y[1], z + d], 0.006));
    for i in 0..=nx {
        let half = if i == 0 || i == nx { t / 2.0 } else { 0.018 };
        let c = (x[0] + t / 2.0) + (x[1] - x[0] - t) * i as f64 / nx as f64;
        m.add(block([c - half, y[0], z - d], [c + half, y[1], z + d], 0.006));
    }
    for j in 1..ny {
        let c = y[0] + (y[1] - y[0]) * j as f64 / ny as f64;
        m.add(block([x[0], c - 0.018, z - d * 0.8], [x[1], c + 0.018, z + d * 0.8], 0.006));
    }
    m
}

/// A row of books from x = 0 to `length`, each of its own size; one mesh per colour class.
pub fn books(length: f64, seed: u64, classes: usize) -> Vec<Mesh> {
    let mut out = vec![Mesh::default(); classes];
    let (mut x, mut i) = (0.0, 0);
    while x < length - 0.05 {
        let r = |k: i64| crate::texture::hash(i, k, seed);
        let (w, h, d) = (0.02 + 0.03 * r(1), 0.18 + 0.09 * r(2), 0.13 + 0.05 * r(3));
        out[(r(4) * classes as f64) as usize % classes].add(slab([x, 0.0, -d], [x + w, h, 0.0]));
        x += w + 0.002;
        i += 1;
    }
    out
}

/// A hanging curtain from x = 0 to `w`, heights `y`, in folds of depth `a` and about `pitch` apart. It has two layers
/// and hems, because light must not leak where a thin sheet's shading normals lean to its other side.
pub fn curtain(w: f64, y: [f64; 2], a: f64, pitch: f64) -> Mesh {
    let folds = (w / pitch).round().max(1.0);
    let cells = (folds * 11.0) as usize;
    let sheet = |u: f64, v: f64, z: f64| {
        let phase = 2.0 * std::f64::consts::PI * folds * u;
        let spread = 1.0 - 0.35 * v;
        let sway = 0.15 * a * (3.0 * phase / folds + 2.0 * v).sin();
        let x = w * u + 0.12 * pitch * (2.0 * phase + 1.3).sin() * spread;
        let fold = a * spread * (phase + 0.5 * (1.0 - v) * (phase / 3.0).sin()).sin();
        v3(x, y[0] + (y[1] - y[0]) * v, fold + sway + z)
    };
    let t = 0.006;
    patch(cells, 4, |u, v| sheet(u, v, t))
        .and(patch(cells, 4, |u, v| sheet(1.0 - u, v, -t)))
        .and(patch(1, 4, |u, v| sheet(0.0, v, t * (2.0 * u - 1.0))))
        .and(patch(1, 4, |u, v| sheet(1.0, v, t * (1.0 - 2.0 * u))))
        .and(patch(cells, 1, |u, v| sheet(u, 0.0, t * (2.0 * v - 1.0))))
        .and(patch(cells, 1, |u, v| sheet(u, 1.0, t * (1.0 - 2.0 * v))))
}

/// A soft cushion of w × d metres and height h: a squashed box with pinched corners.
pub fn cushion(w: f64, h: f64, d: f64, n: usize) -> Mesh {
    let swell = |u: f64, v: f64| {
        let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        ((1.0 - x.powi(4)) * (1.0 - z.powi(4))).max(0.0).sqrt()
    };
    let side = |sign: f64| {
        move |u: f64, v: f64| {
            let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let pinch = 1.0 - 0.06 * (1.0 - (x * x).max(z * z)).max(0.0) + 0.05 * x * x * z * z - 0.05;
            v3(w / 2.0 * x * pinch, h / 2.0 + sign * h / 2.0 * swell(u, v), d / 2.0 * z * pinch)
        }
    };
    patch(n, n, side(1.0)).flipped().and(patch(n, n, side(-1.0)))
}
