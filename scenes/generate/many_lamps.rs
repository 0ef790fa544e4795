//! A market street at night under a thousand bulbs: strings of lights from house to house and lanterns at the stalls.

use crate::furniture::*;
use crate::mesh::Mesh;
use crate::scene::{Metal, Scene, at, turned};
use crate::shapes::*;
use crate::texture::{self, Picture, hash};

/// How many bulbs there are in all.
const BULBS: usize = 1000;

/// A market stall's timber frame: posts, counter, roof laths; customers stand at +z.
fn stall() -> Mesh {
    let mut m = block([-1.1, 0.82, -0.45], [1.1, 0.87, 0.45], 0.01);
    for x in [-1.05, 1.05] {
        m.add(block([x - 0.035, 0.0, 0.38], [x + 0.035, 2.15, 0.45], 0.006));
        m.add(block([x - 0.035, 0.0, -0.45], [x + 0.035, 2.55, -0.38], 0.006));
    }
    for k in 0..9 {
        let x = -1.08 + 0.241 * k as f64;
        m.add(block([x, 0.12, 0.4], [x + 0.225, 0.8, 0.425], 0.005));
    }
    m.and(block([-1.1, 2.1, 0.39], [1.1, 2.16, 0.45], 0.005)).and(block([-1.1, 2.5, -0.45], [1.1, 2.56, -0.39], 0.005))
}

/// Every other stripe of its awning, with a scalloped front.
fn awning(parity: usize) -> Mesh {
    let mut m = Mesh::default();
    for k in (parity..10).step_by(2) {
        let (x0, x1) = (-1.2 + 0.24 * k as f64, -1.2 + 0.24 * (k + 1) as f64);
        m.add(quad(v3(x0, 2.1, 0.8), v3(x1, 2.1, 0.8), v3(x1, 2.62, -0.5), v3(x0, 2.62, -0.5)));
        m.add(patch(6, 1, |u, v| {
            let drop = 0.1 + 0.07 * (std::f64::consts::PI * u).sin();
            v3(x0 + (x1 - x0) * u, 2.1 - drop * (1.0 - v), 0.8)
        }));
    }
    m
}

/// A crate with fruit heaped in it: the crate and the fruit.
fn crate_of(seed: u64, size: f64) -> (Mesh, Mesh) {
    let mut wood = slab([-0.2, 0.0, -0.15], [0.2, 0.015, 0.15]);
    for z in [-0.15, 0.138] {
        for y in [0.02, 0.08] {
            wood.add(slab([-0.2, y, z], [0.2, y + 0.045, z + 0.012]));
        }
    }
    for x in [-0.2, 0.188] {
        wood.add(slab([x, 0.0, -0.15], [x + 0.012, 0.13, 0.15]));
    }
    let mut fruit = Mesh::default();
    let (nx, nz) = ((0.36 / (2.0 * size)) as i64, (0.27 / (2.0 * size)) as i64);
    for i in 0..nx {
        for j in 0..nz {
            let (fx, fz) = ((i as f64 + 0.5) / nx as f64 - 0.5, (j as f64 + 0.5) / nz as f64 - 0.5);
            let heap = 0.09 + 0.06 * (1.0 - 3.0 * (fx * fx + fz * fz)) + 0.02 * hash(i, j, seed);
            fruit.add(ball(size, if size < 0.03 { 4 } else { 6 }).at(0.36 * fx, heap, 0.27 * fz));
        }
    }
    (wood, fruit)
}

/// The front of a row house, 5 m wide, h high; its face is z = 0 and looks to +z.
struct House {
    walls: Mesh,
    cornices: Mesh,
    panes: Mesh,
    /// Lower left corners of its windows.
    windows: Vec<[f64; 2]>,
    /// Left end of its door.
    door: f64,
}

/// Windows and doors are 0.9 m wide; windows 1.5 m, doors 2.2 m high.
fn house(h: f64, seed: i64) -> House {
    let storeys = ((h - 0.6) / 2.7) as usize;
    let columns = [0.5, 2.05, 3.6];
    let door = columns[seed.rem_euclid(3) as usize];
    let (mut walls, mut cornices, mut windows) = (Mesh::default(), Mesh::default(), Vec::new());
    for k in 0..storeys {
        let y = 2.9 * k as f64;
        let top = if k + 1 == storeys { h } else { y + 2.9 };
        let holes = columns.map(|x| {
            if k == 0 && x == door {
                return [x, x + 0.9, 0.0, 2.2];
            }
            windows.push([x, y + 0.85]);
            [x, x + 0.9, y + 0.85, y + 2.35]
        });
        walls.add(wall([0.0, 5.0], [y, top], [-0.25, 0.0], &holes));
        cornices.add(block([0.0, top - 0.12, 0.0], [5.0, top, if k + 1 == storeys { 0.22 } else { 0.06 }], 0.02));
    }
    let panes = slab([0.05, 0.05, -0.32], [4.95, h - 0.05, -0.3]).and(slab([0.0, h - 0.3, -3.0], [5.0, h, -0.25]));
    House { walls, cornices, panes, windows, door }
}

/// Puts up a house whose lower left corner is at x, z, turned by `turn`.
fn build(s: &mut Scene, house: House, front: &str, turn: f64, x: f64, z: f64) {
    let put = |m: Mesh| m.turned(turn).at(x, 0.0, z);
    s.put(&format!("walls-{front}"), front, put(house.walls));
    s.put("cornices", "paint", put(house.cornices));
    s.put("panes", "pane", put(house.panes));
    let (sin, cos) = turn.to_radians().sin_cos();
    let place = |a: f64, y: f64| turned(turn, x + a * cos, y, z - a * sin);
    s.place("house-door", "paint", place(house.door, 0.0));
    for [a, y] in house.windows {
        s.place("house-window", "paint", place(a, y));
    }
}

/// Round cobbles in shallow joints.
fn cobbles() -> Picture {
    Picture::new(192, 192, |u, v| {
        let (n, y) = (10.0, v * 12.0);
        let row = y.floor() as i64;
        let x = u * n + 0.5 * (row % 2) as f64 + 0.18 * hash(0, row, 9);
        let stone = (x.floor() as i64).rem_euclid(10);
        let (fx, fy) = (x - x.floor() - 0.5, y - y.floor() - 0.5);
        let round = (fx.powi(4) + fy.powi(4)).powf(0.25) * 2.0;
        let c = texture::mix([0.42, 0.4, 0.38], [0.6, 0.54, 0.47], hash(stone, row, 4));
        let c = texture::dim(c, 0.85 + 0.3 * texture::fbm(u, v, 20, 20, 8));
        texture::mix(c, [0.2, 0.19, 0.18], ((round - 0.78) * 6.0).max(0.0))
    })
}

pub fn scene() -> Scene {
    let purpose = "A market street at night under 1,000 small lamps: which of them matters where?";
    let mut s = Scene::new("many-lamps", purpose, 12, 256);
    s.camera([-0.55, 1.72, 5.2], [0.25, 2.15, -8.0], 66.0);
    s.file("textures/cobbles.png", cobbles().png());
    s.constant([0.006, 0.011, 0.026]);
    s.glossy_picture("cobbles", "textures/cobbles.png", [0.75, 0.75], 0.25);
    for (k, c) in [[0.66, 0.5, 0.36], [0.56, 0.38, 0.3], [0.62, 0.6, 0.52], [0.42, 0.48, 0.5]].into_iter().enumerate() {
        s.matt(&format!("front-{k}"), c);
    }
    s.glossy("paint", [0.7, 0.68, 0.62], 0.25);
    s.glossy("pane", [0.035, 0.045, 0.07], 0.08);
    s.glossy("timber", [0.4, 0.25, 0.13], 0.3);
    s.matt("white-cloth", [0.78, 0.76, 0.7]);
    s.matt("red-cloth", [0.62, 0.1, 0.08]);
    s.matt("green-cloth", [0.1, 0.36, 0.22]);
    s.matt("blue-cloth", [0.12, 0.24, 0.5]);
    s.glossy("orange", [0.72, 0.33, 0.05], 0.2);
    s.glossy("apple", [0.56, 0.07, 0.05], 0.12);
    s.glossy("lime", [0.3, 0.5, 0.1], 0.15);
    s.glossy("plum", [0.22, 0.08, 0.24], 0.15);
    s.polished("porcelain", [0.72, 0.7, 0.64]);
    s.metal("copper", Metal::Copper, 0.12);
    s.metal("iron", Metal::Steel, 0.35);
    s.matt("cord", [0.05, 0.05, 0.05]);

    // The street runs along −z, houses at x = ±3.6, closed by a house across its far end.
    let (w, near, plots) = (3.6, 8.0, 6);
    let end = near - 5.0 * plots as f64;
    s.put("street", "cobbles", slab([-w - 0.4, -0.2, end - 0.4], [w + 0.4, 0.0, near + 4.0]));
    s.define(
        "house-window",
        window([0.0, 0.9], [0.0, 1.5], -0.14, 2, 3).and(casing([0.0, 0.9], [1.0, 2.5], [0.0, 0.03]).at(0.0, -1.0, 0.0)),
    );
    s.define("house-door", door_leaf(0.9, 2.2).at(0.0, 0.0, -0.2).and(casing([0.0, 0.9], [0.0, 2.2], [0.0, 0.03])));
    for (side, turn) in [(-1.0, 90.0), (1.0, -90.0)] {
        for k in 0..plots {
            let h = 6.4 + 2.9 * (hash(k, side as i64, 21) > 0.45) as u8 as f64;
            let z = if side < 0.0 { near - 5.0 * k as f64 } else { near - 5.0 * (k + 1) as f64 };
            let front = format!("front-{}", (k + 2 * (side > 0.0) as i64) % 4);
            build(&mut s, house(h, k + (side > 0.0) as i64), &front, turn, side * w, z);
        }
    }
    for k in 0..2 {
        build(&mut s, house(9.3, k + 1), "front-2", 0.0, -5.0 + 5.0 * k as f64, end);
    }
    s.put("kerbs", "paint", block([-w, -0.1, end], [-w + 0.7, 0.1, near], 0.03));
    s.put("kerbs", "paint", block([w - 0.7, -0.1, end], [w, 0.1, near], 0.03));

    // Stalls on both sides with goods.
    s.define("stall", stall());
    s.define("awning-0", awning(0));
    s.define("awning-1", awning(1));
    for (k, (fruit, size)) in
        [("orange", 0.036), ("apple", 0.034), ("lime", 0.026), ("plum", 0.024)].into_iter().enumerate()
    {
        let (wood, heap) = crate_of(k as u64, size);
        s.define(&format!("crate-{fruit}"), wood);
        s.define(&format!("heap-{fruit}"), heap);
    }
    s.define("vase", vase());
    s.define("bowl", bowl());
    s.define("teapot", teapot());
    let mut lanterns: Vec<[f64; 3]> = Vec::new();
    let fruits = ["orange", "apple", "lime", "plum"];
    for i in 0..12i64 {
        let side = if i % 2 == 0 { -1.0 } else { 1.0 };
        let z = 1.6 - 2.05 * i as f64 + 0.3 * hash(i, 1, 5);
        let x = side * (w - 1.1);
        let turn = -90.0 * side;
        let cloth = ["red-cloth", "green-cloth", "blue-cloth"][(i % 3) as usize];
        let place = turned(turn, x, 0.0, z);
        s.place("stall", "timber", place);
        s.place("awning-0", cloth, place);
        s.place("awning-1", "white-cloth", place);
        // The stall's own axes: `a` along its counter, `b` towards its customers.
        let world = |a: f64, y: f64, b: f64| [x - side * b, y, z + side * a];
        for j in 0..4i64 {
            let a = -0.78 + 0.5 * j as f64;
            let p = world(a, 0.87, 0.12);
            if i % 4 == 3 {
                let (name, material) =
                    [("vase", "copper"), ("teapot", "porcelain"), ("bowl", "copper"), ("vase", "porcelain")]
                        [j as usize];
                s.place(name, material, turned(40.0 * j as f64, p[0], p[1], p[2]));
            } else {
                let fruit = fruits[((i + j + (i / 4)) % 4) as usize];
                let put = turned(turn + 6.0 * (hash(i, j, 8) - 0.5), p[0], p[1], p[2]);
                s.place(&format!("crate-{fruit}"), "timber", put);
                s.place(&format!("heap-{fruit}"), fruit, put);
            }
        }
        for a in [-0.9, -0.45, 0.0, 0.45, 0.9] {
            lanterns.push(world(a, 1.98, 0.62));
        }
    }

    // Strings across the street sag like parabolas; the remaining bulbs run along the eaves.
    s.define("bulb", ball(0.028, 3));
    let mut bulbs = lanterns.clone();
    let strings = 25;
    let per = 24;
    for k in 0..strings {
        let z0 = 4.2 - 1.02 * k as f64;
        let (za, zb) = (z0 + 0.9 * (hash(k, 1, 2) - 0.5), z0 + 0.9 * (hash(k, 2, 2) - 0.5));
        let (ya, yb) = (4.3 + 0.9 * hash(k, 3, 2), 4.3 + 0.9 * hash(k, 4, 2));
        let sag = 0.75 + 0.4 * hash(k, 5, 2);
        let on = |t: f64| [-w + 2.0 * w * t, ya + (yb - ya) * t - 4.0 * sag * t * (1.0 - t), za + (zb - za) * t];
        let path: Vec<[f64; 3]> = (0..=12).map(|i| on(i as f64 / 12.0)).map(|p| [p[0], p[1] + 0.03, p[2]]).collect();
        s.put("cords", "cord", tube(&path, 3, |_| 0.006));
        bulbs.extend((0..per).map(|i| on((i as f64 + 0.5) / per as f64)));
    }
    let rest = BULBS - bulbs.len();
    let half = rest / 2;
    for i in 0..rest {
        let (side, j, n) = if i < half { (-1.0, i, half) } else { (1.0, i - half, rest - half) };
        let t = (j as f64 + 0.5) / n as f64;
        let z = near - 2.5 + (end - near + 3.0) * t;
        bulbs.push([side * (w - 0.16), 3.05 - 0.14 * (std::f64::consts::PI * (0.35 * z).rem_euclid(1.0)).sin(), z]);
    }
    for side in [-1.0, 1.0] {
        let x = side * (w - 0.16);
        s.put("cords", "cord", tube(&[[x, 3.07, near - 2.5], [x, 3.07, end + 0.5]], 5, |_| 0.006));
    }
    for (i, p) in lanterns.iter().enumerate() {
        if i % 5 == 0 {
            let q = lanterns[i + 4];
            let up = |p: &[f64; 3]| [p[0], p[1] + 0.03, p[2]];
            s.put("cords", "cord", tube(&[up(p), up(&q)], 5, |_| 0.006));
        }
    }
    // Mostly warm white; every string has its share of colour.
    let palette =
        [[1.0, 0.62, 0.28], [1.0, 0.72, 0.4], [1.0, 0.55, 0.2], [1.0, 0.2, 0.1], [0.25, 0.8, 0.3], [0.25, 0.42, 1.0]];
    for (i, p) in bulbs.iter().enumerate() {
        let r = hash(i as i64, 7, 13);
        let c = palette[if r < 0.72 { (r * 4.1) as usize } else { 3 + ((r - 0.72) * 10.7) as usize }.min(5)];
        let strength = if i < lanterns.len() { 80.0 } else { 60.0 };
        s.place_lamp("bulb", c.map(|x| x * strength), at(p[0], p[1], p[2]));
    }
    // Iron bollards along the kerbs, close to the camera.
    let p = [
        [0.0, 0.0],
        [0.09, 0.0],
        [0.08, 0.05],
        [0.06, 0.08],
        [0.055, 0.7],
        [0.08, 0.74],
        [0.08, 0.78],
        [0.05, 0.86],
        [0.0, 0.88],
    ];
    s.define("bollard", lathe(&p, 16));
    for (x, z) in [(-1.0, 1.9), (1.0, 1.9), (-1.0, 3.7), (1.0, 3.7)] {
        s.place("bollard", "iron", at(x * (w - 0.85), 0.0, z));
    }
    s
}
