//! A cloister walk: a vaulted colonnade along a small courtyard that is open to the sky only above.

use crate::mesh::Mesh;
use crate::scene::{Scene, at};
use crate::shapes::*;
use crate::texture::{self, Sky};

/// One cross vault over the square of side `a` around the origin: two half-cylinders of which the higher counts.
pub fn groin(a: f64, n: usize) -> Mesh {
    let r = a / 2.0;
    let web = patch(n, n / 2, |u, v| {
        // Cosine spacing follows the circle; the web narrows towards the crown of the cross.
        let x = -(std::f64::consts::PI * u).cos() * r * v.max(1e-6);
        v3(x, (r * r - x * x).max(0.0).sqrt(), r * v)
    });
    let mut m = Mesh::default();
    for k in 0..4 {
        m.add(web.clone().turned(90.0 * k as f64));
    }
    m
}

/// A column with a moulded base on a plinth and a capital under an abacus, for arches that spring at `h`.
pub fn column(h: f64, r: f64) -> Mesh {
    let mut p = vec![[0.0, 0.16], [r * 1.45, 0.16]];
    p.extend(curve(&[[r * 1.45, 0.16], [r * 1.55, 0.2], [r * 1.42, 0.24]], 4));
    p.extend(curve(&[[r * 1.25, 0.25], [r * 1.15, 0.29], [r * 1.25, 0.31]], 3));
    p.extend(curve(&[[r * 1.25, 0.31], [r * 1.3, 0.335], [r * 1.2, 0.36]], 3));
    p.push([r * 1.03, 0.38]);
    p.extend([[r * 1.02, 1.2], [r * 0.97, 2.0], [r * 0.9, h - 0.5]]);
    p.extend(curve(&[[r * 1.0, h - 0.49], [r * 1.07, h - 0.46], [r * 1.0, h - 0.43]], 3));
    p.extend(curve(&[[r * 0.92, h - 0.42], [r * 0.97, h - 0.32], [r * 1.25, h - 0.18], [r * 1.6, h - 0.12]], 4));
    lathe(&p, 24).and(block([-r * 1.65, 0.0, -r * 1.65], [r * 1.65, 0.16, r * 1.65], 0.012)).and(block(
        [-r * 1.7, h - 0.12, -r * 1.7],
        [r * 1.7, h, r * 1.7],
        0.015,
    ))
}

pub fn scene() -> Scene {
    let purpose = "A vaulted cloister walk lit by sun and sky through the opening above a small courtyard.";
    let mut s = Scene::new("colonnade", purpose, 16, 256);
    s.camera([-0.55, 1.62, 1.3], [0.42, 1.95, -8.0], 66.0);
    let sky = Sky {
        zenith: [0.32, 0.58, 1.25],
        horizon: [1.25, 1.4, 1.6],
        ground: [0.2, 0.19, 0.17],
        sun: v3(0.80, 0.88, -0.42),
        glow: [1.6, 1.3, 0.9],
        disc: [10500.0, 9000.0, 6900.0],
        disc_radius: 1.2,
        clouds: 0.6,
    };
    s.file("textures/sky.hdr", sky.picture(96).hdr());
    s.file("textures/tiles.png", texture::tiles([0.74, 0.62, 0.5], [0.52, 0.36, 0.29], [0.42, 0.38, 0.34], 4).png());
    s.file("textures/ashlar.png", texture::ashlar([0.8, 0.74, 0.63], 6, 5).png());
    s.environment("textures/sky.hdr", 1.3);
    s.matt_picture("tiles", "textures/tiles.png", [1.0, 1.0]);
    s.matt_picture("ashlar", "textures/ashlar.png", [0.42, 0.42]);
    s.matt("stone", [0.66, 0.6, 0.5]);
    s.matt("plaster", [0.74, 0.69, 0.6]);
    s.matt("roof", [0.45, 0.22, 0.14]);
    s.matt("grass", [0.16, 0.24, 0.08]);
    s.matt("leaf", [0.12, 0.26, 0.08]);
    s.matt("clay", [0.55, 0.27, 0.17]);
    s.glossy("bench", [0.3, 0.17, 0.09], 0.25);

    // The walk runs along −z in bays of side a; its arcade towards +x opens on the courtyard.
    let (a, spring, bays, t) = (2.8, 2.5, 7, 0.34);
    let (r, near) = (a / 2.0, 2.8);
    let top = spring + r + 0.45;
    let z_of = |i: usize| near - r - a * i as f64;
    let far = near - a * bays as f64;
    s.define("vault", groin(a, 24).at(0.0, spring, 0.0));
    s.define("column", column(spring, 0.17));
    let arcade = above_arch(&round_arch(a - t, spring, 24), top, -t / 2.0, t / 2.0);
    let pier = |x: f64| slab([x - t / 2.0, spring, -t / 2.0], [x + t / 2.0, top, t / 2.0]);
    // The corners of neighbouring arches meet above the columns.
    let bay = arcade.clone().and(pier(-r)).and(pier(r));
    s.define("arch-side", bay.turned(90.0));
    s.define("arch-across", above_arch(&round_arch(a - 0.06, spring, 24), spring + r + 0.02, -0.14, 0.14));
    let half = block([-0.13, 0.0, -0.16], [0.0, spring, 0.16], 0.01)
        .and(block([-0.17, spring - 0.14, -0.2], [0.0, spring, 0.2], 0.012))
        .and(block([-0.17, 0.0, -0.2], [0.0, 0.3, 0.2], 0.012));
    s.define("pilaster", half.at(-r + 0.13, 0.0, 0.0));
    for i in 0..bays {
        s.place("vault", "plaster", at(0.0, 0.0, z_of(i)));
        s.place("arch-side", "ashlar", at(r, 0.0, z_of(i)));
    }
    for i in 0..=bays {
        let z = near - a * i as f64;
        s.place("column", "stone", at(r, 0.0, z));
        s.place("pilaster", "stone", at(0.0, 0.0, z));
        s.place("arch-across", "stone", at(0.0, 0.0, z));
    }
    s.put("walk-wall", "ashlar", slab([-r - 0.4, -0.1, far - 0.4], [-r, top, near + 0.4]));
    s.put("walk-wall", "ashlar", slab([-r - 0.4, -0.1, near], [r + 0.3, top, near + 0.4]));
    s.put("walk-wall", "ashlar", wall([-r, r + 0.3], [-0.1, top], [far - 0.4, far], &[[-0.55, 0.55, 0.12, 2.3]]));
    s.put("walk-door", "bench", slab([-0.6, 0.1, far - 0.3], [0.6, 2.35, far - 0.2]));
    for k in 0..3 {
        let x = -0.55 + 0.367 * k as f64;
        s.put("walk-door", "bench", block([x + 0.02, 0.14, far - 0.22], [x + 0.347, 2.28, far - 0.17], 0.012));
    }
    s.put("walk-roof", "roof", slab([-r - 0.6, top, far - 0.6], [r + 0.45, top + 0.25, near + 0.6]));
    s.put("tiles", "tiles", slab([-r - 0.4, -0.2, far - 0.4], [r + 0.3, 0.0, near + 0.4]));
    s.put("kerb", "stone", block([r - 0.3, -0.2, far], [r + 0.34, 0.03, near], 0.015));

    // The courtyard: grass, and high walls on the three other sides.
    let (x0, x1, high) = (r + 0.34, r + 6.4, 6.2);
    s.put("grass", "grass", slab([x0 - 0.2, -0.3, far - 0.4], [x1, -0.05, near + 0.4]));
    let windows = |n: usize| -> Vec<[f64; 4]> {
        (0..n).map(|i| 1.6 + 2.8 * i as f64).map(|c| [c - 0.45, c + 0.45, 3.6, 5.1]).collect()
    };
    let long = near - far;
    let court = wall([0.0, long], [-0.3, high], [-0.5, 0.0], &windows(7));
    let behind = slab([0.0, 3.3, -0.55], [long, 5.4, -0.45]);
    s.put("court-wall", "plaster", court.turned(-90.0).at(x1, 0.0, far));
    s.put("court-dark", "bench", behind.turned(-90.0).at(x1, 0.0, far));
    for z in [far - 0.4, near] {
        s.put("court-wall", "plaster", slab([x0 - 0.3, -0.3, z], [x1 + 0.5, high, z + 0.4]));
    }
    s.put("court-wall", "plaster", slab([-r - 0.4, top, far - 0.4], [-r, top + 1.2, near + 0.4]));
    s.put("cornice", "stone", block([x1 - 0.25, high - 0.2, far], [x1 + 0.5, high, near], 0.03));
    s.put("cornice", "stone", block([x1 - 0.08, 2.95, far], [x1 + 0.1, 3.1, near], 0.02));
    s.define("blind-arch", above_arch(&round_arch(2.2, 1.5, 16), 2.95, -0.14, 0.0).turned(-90.0));
    s.define("post", block([-0.14, -0.1, -0.3], [0.0, 2.95, 0.3], 0.02));
    for i in 0..bays {
        s.place("blind-arch", "stone", at(x1, 0.0, z_of(i)));
        s.place("post", "stone", at(x1, 0.0, z_of(i) + r));
    }

    // A well, clipped bushes and a bench.
    let well =
        [[0.75, -0.1], [0.8, 0.0], [0.75, 0.1], [0.72, 0.75], [0.82, 0.8], [0.82, 0.9], [0.55, 0.9], [0.55, 0.0]];
    s.put("well", "stone", lathe(&well, 36).at(r + 3.3, 0.0, -6.0));
    for (i, z) in [-1.2, -3.2, -9.2, -12.0].into_iter().enumerate() {
        let size = 0.42 + 0.07 * (i % 3) as f64;
        let bush = |u: f64, v: f64| {
            let (p, t) = (2.0 * std::f64::consts::PI * u, std::f64::consts::PI * (1.0 - v));
            let bump = 1.0 + 0.10 * texture::noise(9.0 * u, 6.0 * v, 9, 9, i as u64) * t.sin();
            v3(p.cos() * t.sin(), t.cos(), -p.sin() * t.sin()) * bump * size
        };
        s.put("bushes", "leaf", patch(22, 12, bush).at(r + 1.1, 0.75, z));
        let pot = [[0.0, -0.05], [0.2, -0.05], [0.28, 0.4], [0.31, 0.4], [0.31, 0.46], [0.25, 0.46], [0.0, 0.42]];
        s.put("pots", "clay", lathe(&pot, 24).at(r + 1.1, 0.0, z));
    }
    for z in [-3.5, -9.0] {
        s.put("benches", "bench", block([-r + 0.02, 0.42, z - 0.8], [-r + 0.42, 0.48, z + 0.8], 0.01));
        for d in [-0.65, 0.65] {
            s.put("benches", "bench", block([-r + 0.05, 0.0, z + d - 0.04], [-r + 0.39, 0.42, z + d + 0.04], 0.008));
        }
    }
    s
}
