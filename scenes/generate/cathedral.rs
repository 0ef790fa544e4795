//! A nave with pointed arches, clustered piers and rib vaults, lit by two small lamps in its corners.

use crate::mesh::Mesh;
use crate::scene::{Metal, Scene, at};
use crate::shapes::*;
use crate::texture;

/// A pier: a core with eight shafts, on a plinth, with a capital; `h` to the springing of the arches.
fn pier(h: f64) -> Mesh {
    let shaft = |r: f64| {
        let mut p = vec![[r * 1.7, 0.3]];
        p.extend(curve(&[[r * 1.7, 0.3], [r * 1.8, 0.36], [r * 1.5, 0.42], [r * 1.25, 0.45], [r, 0.52]], 2));
        p.push([r, h - 0.5]);
        p.extend(curve(&[[r, h - 0.5], [r * 1.15, h - 0.47], [r * 1.02, h - 0.44]], 2));
        p.extend(curve(&[[r * 1.02, h - 0.43], [r * 1.2, h - 0.3], [r * 1.8, h - 0.16]], 3));
        p
    };
    let mut m = lathe(&shaft(0.3), 16);
    for k in 0..8 {
        let angle = k as f64 * 45.0;
        let (r, d) = if k % 2 == 0 { (0.12, 0.36) } else { (0.075, 0.34) };
        m.add(lathe(&shaft(r), 10).at(d, 0.0, 0.0).turned(angle));
    }
    let octagon = |r: f64, y0: f64, y1: f64| {
        let p = [[0.0, y0], [r, y0], [r + 0.03, y0 + 0.03], [r + 0.03, y1 - 0.03], [r, y1], [0.0, y1]];
        lathe(&p, 8).turned(22.5)
    };
    m.and(octagon(0.66, 0.0, 0.3)).and(octagon(0.6, h - 0.17, h))
}

/// A rib vault over w (x) by d (z) metres: four webs between pointed arches of the same rise, springing at y = 0.
fn rib_vault(w: f64, d: f64, rise: f64, n: usize) -> Mesh {
    let mut m = Mesh::default();
    // The web over the long direction z has the profile of the arch of width w, and the other way round.
    let crown = |t: f64, width: f64| pointed(width, rise, t * width / 2.0);
    let along = patch(n, n / 2, |u, v| {
        let t = (2.0 * u - 1.0) * v.max(1e-6);
        v3(t * w / 2.0, crown(t, w), v * d / 2.0)
    });
    let across = patch(n, n / 2, |u, v| {
        let t = (2.0 * u - 1.0) * v.max(1e-6);
        v3(v * w / 2.0, crown(t, w), -t * d / 2.0)
    });
    m.add(along.clone());
    m.add(along.turned(180.0));
    m.add(across.clone());
    m.add(across.turned(180.0));
    m
}

/// Ribs under that vault: the two diagonals and the transverse arch at z = −d/2.
fn ribs(w: f64, d: f64, rise: f64) -> Mesh {
    let n = 20;
    let steps =
        (0..=n).map(|i| 2.0 * i as f64 / n as f64 - 1.0).map(|t: f64| t.signum() * (1.0 - (1.0 - t.abs()).powi(2)));
    let y = |t: f64| pointed(w, rise, t * w / 2.0) - 0.03;
    let steps: Vec<f64> = steps.collect();
    let mut m = Mesh::default();
    for side in [-1.0, 1.0] {
        let path: Vec<[f64; 3]> = steps.iter().map(|&t| [t * w / 2.0, y(t), side * t * d / 2.0]).collect();
        m.add(tube(&path, 8, |_| 0.085));
    }
    let path: Vec<[f64; 3]> = steps.iter().map(|&t| [t * w / 2.0, y(t), -d / 2.0]).collect();
    m.add(tube(&path, 10, |_| 0.16));
    let boss = lathe(&[[0.0, -0.2], [0.12, -0.18], [0.2, -0.1], [0.22, 0.0]], 16);
    m.and(boss.at(0.0, rise, 0.0))
}

/// A lantern on a stand, without its light: 1.6 m high.
fn lantern() -> Mesh {
    let mut m = lathe(
        &[[0.0, 0.0], [0.16, 0.0], [0.16, 0.03], [0.02, 0.06], [0.018, 1.3], [0.12, 1.34], [0.12, 1.36], [0.0, 1.36]],
        16,
    );
    for k in 0..6 {
        let (s, c) = (k as f64 * std::f64::consts::PI / 3.0).sin_cos();
        m.add(rod([0.11 * c, 1.35, 0.11 * s], [0.11 * c, 1.62, 0.11 * s], 0.006, 6));
    }
    m.and(lathe(&[[0.0, 1.62], [0.13, 1.62], [0.14, 1.63], [0.03, 1.72], [0.0, 1.75]], 16))
}

pub fn scene() -> Scene {
    let purpose = "A dark nave: rib vaults and clustered piers, two small lamps in its corners, long soft gradients.";
    let mut s = Scene::new("cathedral", purpose, 24, 512);
    s.camera([-0.9, 1.75, 9.6], [0.55, 5.4, -10.0], 74.0);
    s.file("textures/ashlar.png", texture::ashlar([0.78, 0.72, 0.62], 8, 31).png());
    s.file("textures/tiles.png", texture::tiles([0.62, 0.58, 0.52], [0.36, 0.33, 0.31], [0.3, 0.28, 0.26], 14).png());
    s.matt_picture("ashlar", "textures/ashlar.png", [0.3, 0.3]);
    s.glossy_picture("tiles", "textures/tiles.png", [0.7, 0.7], 0.3);
    s.matt("stone", [0.62, 0.57, 0.49]);
    s.matt("vault", [0.7, 0.66, 0.58]);
    s.glossy("pew", [0.26, 0.14, 0.07], 0.25);
    s.matt("cloth", [0.72, 0.7, 0.66]);
    s.metal("brass", Metal::Brass, 0.15);
    s.glossy("lead", [0.1, 0.11, 0.14], 0.25);

    // Nave of width w in bays of length d; aisles of width aisle on both sides under lower vaults.
    let (w, d, bays, aisle) = (7.0, 4.6, 5, 3.2);
    let (arcade, rise, high, vault_rise) = (4.2, 2.4, 7.2, 4.6);
    let near = 10.5;
    let far = near - d * bays as f64;
    let z_of = |i: usize| near - d * (i as f64 + 0.5);
    s.define("pier", pier(arcade));
    s.define("vault", rib_vault(w, d, vault_rise, 20).at(0.0, high, 0.0));
    s.define("ribs", ribs(w, d, vault_rise).at(0.0, high, 0.0));
    s.define("aisle-vault", rib_vault(aisle, d, rise, 16).at(0.0, arcade, 0.0));
    s.define("aisle-ribs", ribs(aisle, d, rise).at(0.0, arcade, 0.0));
    let arch = above_arch(&pointed_arch(d - 0.9, rise - 0.35, arcade, 24), high + vault_rise + 0.3, -0.38, 0.38)
        .and(slab([-d / 2.0, arcade, -0.38], [-d / 2.0 + 0.45, high + vault_rise + 0.3, 0.38]))
        .and(slab([d / 2.0 - 0.45, arcade, -0.38], [d / 2.0, high + vault_rise + 0.3, 0.38]));
    let order = |w: f64, rise: f64, r: f64, z: f64| {
        let path: Vec<[f64; 3]> = pointed_arch(w, rise, arcade, 24).iter().map(|&[x, y]| [x, y, z]).collect();
        tube(&path, 8, |_| r)
    };
    s.define("arcade", arch.turned(90.0));
    let mouldings = order(d - 0.84, rise - 0.32, 0.09, 0.3)
        .and(order(d - 0.84, rise - 0.32, 0.09, -0.3))
        .and(order(d - 0.3, rise, 0.06, 0.4))
        .and(order(d - 0.3, rise, 0.06, -0.4));
    s.define("mouldings", mouldings.turned(90.0));
    // A blind window in every bay of the wall above the arcade, and a string course below it.
    let tracery = {
        let mut m = Mesh::default();
        for x in [-0.55, 0.55] {
            let p: Vec<[f64; 3]> = pointed_arch(0.95, 0.8, 8.9, 12).iter().map(|&[a, y]| [x + a, y, 0.4]).collect();
            m.add(tube(&p, 6, |_| 0.05));
            m.add(rod([x - 0.475, 7.6, 0.4], [x - 0.475, 8.9, 0.4], 0.05, 6));
            m.add(rod([x + 0.475, 7.6, 0.4], [x + 0.475, 8.9, 0.4], 0.05, 6));
        }
        let p: Vec<[f64; 3]> = pointed_arch(2.3, 1.9, 8.9, 16).iter().map(|&[a, y]| [a, y, 0.4]).collect();
        m.add(tube(&p, 8, |_| 0.07));
        m.and(block([-d / 2.0, 7.25, 0.3], [d / 2.0, 7.4, 0.5], 0.03))
    };
    s.define("tracery", tracery.turned(90.0));
    let lancet = above_arch(&pointed_arch(1.1, 1.0, 3.0, 14), 8.0, -0.3, 0.0)
        .and(slab([-d / 2.0, -0.1, -0.3], [-0.55, 8.0, 0.0]))
        .and(slab([0.55, -0.1, -0.3], [d / 2.0, 8.0, 0.0]))
        .and(slab([-0.55, -0.1, -0.3], [0.55, 1.4, 0.0]));
    s.define("aisle-wall", lancet.turned(90.0));
    let shaft = [
        [0.17, 0.0],
        [0.17, 0.3],
        [0.1, 0.4],
        [0.1, high - arcade - 0.35],
        [0.12, high - arcade - 0.3],
        [0.2, high - arcade],
    ];
    s.define("wall-shaft", lathe(&shaft, 12).at(0.0, arcade, 0.0));
    let centre = w / 2.0 + aisle / 2.0;
    for i in 0..bays {
        let z = z_of(i);
        s.place("vault", "vault", at(0.0, 0.0, z));
        s.place("ribs", "stone", at(0.0, 0.0, z));
        for (side, turn) in [(-1.0, 0.0), (1.0, 180.0)] {
            let place = |x: f64, turn: f64| crate::scene::turned(turn, side * x, 0.0, z);
            s.place("aisle-vault", "vault", at(side * centre, 0.0, z));
            s.place("aisle-ribs", "stone", at(side * centre, 0.0, z));
            s.place("arcade", "ashlar", place(w / 2.0, turn));
            s.place("mouldings", "stone", place(w / 2.0, turn));
            s.place("tracery", "stone", place(w / 2.0, turn));
            s.place("aisle-wall", "ashlar", place(w / 2.0 + aisle, turn));
        }
    }
    for i in 0..=bays {
        let z = near - d * i as f64;
        for side in [-1.0, 1.0] {
            s.place("pier", "stone", at(side * w / 2.0, 0.0, z));
            s.place("wall-shaft", "stone", at(side * (w / 2.0 - 0.42), 0.0, z));
        }
    }
    // Dark panes behind the lancets: it is night.
    for side in [-1.0, 1.0] {
        let x = side * (w / 2.0 + aisle + 0.25);
        s.put("panes", "lead", slab([x - 0.05, 1.0, far], [x + 0.05, 4.5, near]));
    }
    let (x, top) = (w / 2.0 + aisle + 0.3, high + vault_rise + 0.5);
    s.put("shell", "ashlar", slab([-x, -0.1, near], [x, top, near + 0.4]));
    s.put("shell", "ashlar", slab([-x, -0.1, far - 0.4], [x, top, far]));
    s.put("shell", "ashlar", slab([-x - 0.2, top - 0.25, far - 0.4], [x + 0.2, top, near + 0.4]));
    for side in [-1.0, 1.0] {
        s.put("shell", "ashlar", slab([side * x - 0.1, -0.1, far], [side * x + 0.1, top, near]));
    }
    s.put("tiles", "tiles", slab([-x - 0.2, -0.3, far - 0.4], [x + 0.2, 0.0, near + 0.4]));

    // The end wall: a blind rose and a great pointed niche; steps and an altar before it.
    let niche: Vec<[f64; 3]> = pointed_arch(4.2, 3.6, 4.0, 24).iter().map(|&[x, y]| [x, y, far + 0.02]).collect();
    s.put("end", "stone", tube(&niche, 8, |_| 0.14));
    for x in [-2.1, 2.1] {
        s.put("end", "stone", rod([x, 0.0, far + 0.02], [x, 4.0, far + 0.02], 0.14, 10));
    }
    let ring = |r: f64, t: f64, cx: f64, cy: f64| {
        let p: Vec<[f64; 3]> = (0..=24)
            .map(|k| (k % 24) as f64 / 12.0 * std::f64::consts::PI)
            .map(|a| [cx + r * a.cos(), cy + r * a.sin(), far + 0.02])
            .collect();
        tube(&p, 5, |_| t)
    };
    s.put("end", "stone", ring(1.5, 0.12, 0.0, 9.3));
    for k in 0..8 {
        let (sn, c) = (k as f64 * std::f64::consts::PI / 4.0).sin_cos();
        s.put("end", "stone", ring(0.38, 0.06, 0.98 * c, 9.3 + 0.98 * sn));
    }
    s.put("end", "stone", ring(0.45, 0.07, 0.0, 9.3));
    for k in 0..3 {
        let e = 0.4 * k as f64;
        s.put(
            "steps",
            "stone",
            block([-3.0 + e, 0.15 * k as f64, far], [3.0 - e, 0.15 * (k + 1) as f64, far + 3.4 - e], 0.015),
        );
    }
    s.put("altar", "stone", block([-1.1, 0.45, far + 0.9], [1.1, 1.4, far + 1.7], 0.02));
    s.put("altar-cloth", "cloth", block([-1.2, 1.39, far + 0.8], [1.2, 1.45, far + 1.8], 0.01));
    for x in [-0.8, 0.8] {
        let p =
            [[0.0, 0.0], [0.09, 0.0], [0.09, 0.02], [0.02, 0.06], [0.03, 0.2], [0.015, 0.3], [0.05, 0.4], [0.0, 0.4]];
        s.put("candlesticks", "brass", lathe(&p, 16).at(x, 1.45, far + 1.2));
    }

    // Pews on both sides of the middle aisle.
    let mut pew = block([-1.15, 0.42, -0.2], [1.15, 0.46, 0.2], 0.008);
    pew.add(block([-1.15, 0.4, 0.16], [1.15, 0.92, 0.2], 0.008));
    for x in [-1.17, 1.13] {
        pew.add(block([x, 0.0, -0.24], [x + 0.04, 0.96, 0.24], 0.01));
    }
    s.define("pew", pew);
    for k in 0..9 {
        for side in [-1.0, 1.0] {
            s.place("pew", "pew", at(side * 1.9, 0.0, 5.2 - 1.15 * k as f64));
        }
    }

    // Two lanterns: one hidden by a pier on the left in front, one far right.
    s.define("lantern", lantern());
    s.define("flame", cylinder(0.055, 0.2, 16));
    for (x, z, r) in [(-5.2, 3.4, [4200.0, 2900.0, 1500.0]), (5.0, -9.4, [4600.0, 3200.0, 1700.0])] {
        s.place("lantern", "brass", at(x, 0.0, z));
        s.place_lamp("flame", r, at(x, 1.38, z));
    }
    s
}
