//! A café: a glossy table by the window with cups, a steel ball and a glass of water; more tables behind.

use crate::furniture::*;
use crate::mesh::Mesh;
use crate::scene::{Metal, Scene, at, turned};
use crate::shapes::*;
use crate::texture::{self, Sky};

/// A bistro chair of bent wood, without its seat; sitters look towards +z.
fn bistro_chair() -> Mesh {
    let back = [
        [-0.19, 0.0, -0.24],
        [-0.18, 0.45, -0.18],
        [-0.17, 0.78, -0.22],
        [0.0, 0.93, -0.24],
        [0.17, 0.78, -0.22],
        [0.18, 0.45, -0.18],
        [0.19, 0.0, -0.24],
    ];
    let inner = [[-0.1, 0.46, -0.17], [-0.1, 0.68, -0.2], [0.0, 0.8, -0.22], [0.1, 0.68, -0.2], [0.1, 0.46, -0.17]];
    let ring: Vec<[f64; 3]> = (0..=20)
        .map(|k| ((k % 20) as f64 * 18.0).to_radians())
        .map(|a| [0.16 * a.cos(), 0.22, 0.16 * a.sin()])
        .collect();
    let mut m = tube(&curve(&back, 5), 8, |_| 0.014);
    m.add(tube(&curve(&inner, 5), 8, |_| 0.01));
    m.add(tube(&ring, 6, |_| 0.008));
    for x in [-1.0, 1.0] {
        m.add(rod([0.16 * x, 0.45, 0.13], [0.19 * x, 0.0, 0.18], 0.014, 8));
    }
    let rim = [[0.0, 0.43], [0.2, 0.43], [0.212, 0.437], [0.212, 0.453], [0.2, 0.46], [0.0, 0.455]];
    m.and(lathe(&rim, 28))
}

/// The cast-iron foot of a round table of height h.
fn table_foot(h: f64) -> Mesh {
    let mut p = vec![[0.0, 0.0], [0.2, 0.0]];
    p.extend(curve(
        &[
            [0.21, 0.01],
            [0.19, 0.03],
            [0.08, 0.06],
            [0.03, 0.14],
            [0.045, 0.2],
            [0.026, 0.26],
            [0.026, 0.55],
            [0.05, 0.64],
        ],
        4,
    ));
    p.extend([[0.12, h - 0.03], [0.12, h - 0.02], [0.0, h - 0.02]]);
    lathe(&p, 28)
}

pub fn scene() -> Scene {
    let purpose = "A glossy café table with a steel ball and cups before a window: reflections of reflections.";
    let mut s = Scene::new("cafe", purpose, 16, 256);
    s.camera([0.2, 1.18, 1.02], [-0.06, 0.79, -0.2], 58.0);
    let sky = Sky {
        zenith: [0.4, 0.7, 1.4],
        horizon: [1.5, 1.6, 1.75],
        ground: [0.36, 0.35, 0.33],
        sun: v3(-0.75, 0.55, -0.62),
        glow: [2.5, 1.9, 1.2],
        disc: [7000.0, 5800.0, 4200.0],
        disc_radius: 1.2,
        clouds: 0.7,
    };
    s.file("textures/sky.hdr", sky.picture(96).hdr());
    s.file("textures/tiles.png", texture::tiles([0.72, 0.7, 0.65], [0.24, 0.27, 0.29], [0.3, 0.29, 0.28], 9).png());
    s.file("textures/wood.png", texture::planks([0.26, 0.14, 0.08], [0.45, 0.27, 0.15], 5, 23).png());
    s.environment("textures/sky.hdr", 3.2);
    s.glossy_picture("tiles", "textures/tiles.png", [1.4, 1.4], 0.2);
    s.glossy_picture("table-top", "textures/wood.png", [1.6, 1.1], 0.06);
    s.matt("wall", [0.66, 0.58, 0.45]);
    s.matt("ceiling", [0.78, 0.76, 0.7]);
    s.glossy("green-paint", [0.1, 0.2, 0.16], 0.2);
    s.glossy("dark-wood", [0.2, 0.1, 0.055], 0.18);
    s.metal("iron", Metal::Steel, 0.35);
    s.metal("steel", Metal::Steel, 0.02);
    s.metal("brass", Metal::Brass, 0.12);
    s.metal("copper", Metal::Copper, 0.1);
    s.polished("porcelain", [0.78, 0.77, 0.74]);
    s.polished("red-glaze", [0.58, 0.1, 0.07]);
    s.glossy("coffee", [0.06, 0.03, 0.015], 0.08);
    s.glass("glass");
    s.matt("paper", [0.78, 0.76, 0.7]);
    s.matt("lamp-inside", [0.8, 0.8, 0.78]);
    s.matt("street", [0.42, 0.4, 0.38]);
    s.matt("house", [0.62, 0.48, 0.36]);
    s.matt("leaf", [0.13, 0.28, 0.09]);
    s.glossy("bottle-green", [0.08, 0.22, 0.1], 0.1);
    s.glossy("bottle-amber", [0.4, 0.2, 0.05], 0.1);

    // x −3.2 … 3.4, z −3.2 … 2.4. Shop windows in the walls z = −3.2 (street) and x = −3.2.
    let (x0, x1, z0, z1, h) = (-3.2, 3.4, -3.2, 2.4, 3.1);
    s.put("floor", "tiles", slab([x0 - 0.3, -0.2, z0 - 0.3], [x1 + 0.3, 0.0, z1 + 0.3]));
    s.put("ceiling", "ceiling", slab([x0 - 0.3, h, z0 - 0.3], [x1 + 0.3, h + 0.2, z1 + 0.3]));
    s.put("walls", "wall", slab([x1, -0.2, z0 - 0.3], [x1 + 0.3, h + 0.2, z1 + 0.3]));
    s.put("walls", "wall", slab([x0 - 0.3, -0.2, z1], [x1 + 0.3, h + 0.2, z1 + 0.3]));
    let holes = [[x0 + 0.35, -1.15, 0.62, 2.6], [-0.75, 1.2, 0.62, 2.6]];
    s.put("walls", "wall", wall([x0 - 0.3, x1 + 0.3], [-0.1, h + 0.1], [z0 - 0.3, z0], &holes));
    for o in holes {
        s.put("windows", "green-paint", window([o[0], o[1]], [o[2], 2.1], z0 - 0.15, 2, 1));
        s.put("windows", "green-paint", window([o[0], o[1]], [2.1, o[3]], z0 - 0.15, 4, 1));
        s.put("windows", "green-paint", casing([o[0], o[1]], [o[2], o[3]], [z0, z0 + 0.025]));
    }
    let left = |m: Mesh| m.turned(90.0).at(x0, 0.0, z1);
    let hole = [2.2, 4.9, 0.62, 2.6];
    s.put("walls", "wall", left(wall([-0.2, z1 - z0 + 0.2], [-0.1, h + 0.1], [-0.3, 0.0], &[hole])));
    s.put("windows", "green-paint", left(window([hole[0], hole[1]], [hole[2], 2.1], -0.15, 3, 1)));
    s.put("windows", "green-paint", left(window([hole[0], hole[1]], [2.1, hole[3]], -0.15, 6, 1)));
    s.put("windows", "green-paint", left(casing([hole[0], hole[1]], [hole[2], hole[3]], [0.0, 0.025])));
    s.put("panelling", "green-paint", slab([x0, 0.0, z0], [x1, 0.5, z0 + 0.02]));
    for k in 0..8 {
        let x = x0 + 0.12 + 0.82 * k as f64;
        s.put("panelling", "green-paint", block([x, 0.1, z0 + 0.015], [x + 0.7, 0.42, z0 + 0.035], 0.012));
    }
    // The street: pavement and the houses across it.
    s.put("street", "street", slab([-30.0, -0.35, -30.0], [30.0, -0.25, z0 - 0.3]));
    s.put("street", "street", slab([-30.0, -0.35, z0 - 0.3], [x0 - 0.3, -0.25, 30.0]));
    for k in 0..6 {
        let x = -16.0 + 5.2 * k as f64;
        let tall = 6.0 + 2.5 * texture::hash(k, 2, 3);
        s.put("houses", "house", slab([x, -0.3, -16.0], [x + 4.9, tall, -12.0]));
        for j in 0..6 {
            let (wx, wy) = (x + 0.7 + 1.35 * (j % 3) as f64, 0.9 + 2.6 * (j / 3) as f64);
            s.put("house-windows", "green-paint", block([wx, wy, -12.05], [wx + 0.8, wy + 1.4, -11.9], 0.02));
        }
    }

    // Tables and chairs. The nearest table has the still life.
    let top = [[0.0, 0.72], [0.36, 0.72], [0.375, 0.73], [0.38, 0.74], [0.375, 0.75], [0.36, 0.755], [0.0, 0.755]];
    let mut round = lathe(&top, 48);
    for v in &mut round.vertices {
        v.uv = glam::DVec2::new(v.p.x, v.p.z);
    }
    s.define("table-top", round);
    s.define("table-rim", lathe(&[[0.374, 0.728], [0.386, 0.728], [0.386, 0.748], [0.374, 0.748]], 48));
    s.define("table-foot", table_foot(0.74));
    s.define("chair", bistro_chair());
    s.define("cup", cup().turned(35.0));
    s.define("coffee", disc_up(0.0365, 24).at(0.0, 0.066, 0.0));
    for (i, (x, z)) in [(0.0, 0.0), (-1.75, -1.75), (0.55, -2.15), (2.2, -1.1)].into_iter().enumerate() {
        s.place("table-top", "table-top", turned(20.0 * i as f64, x, 0.0, z));
        s.place("table-rim", "brass", at(x, 0.0, z));
        s.place("table-foot", "iron", at(x, 0.0, z));
        if i > 0 {
            s.place("cup", "porcelain", turned(60.0 * i as f64, x + 0.1, 0.755, z + 0.05));
            s.place("coffee", "coffee", at(x + 0.1, 0.755, z + 0.05));
        }
    }
    let chairs = [
        (-0.62, -0.22, 70.0),
        (0.35, -0.7, -27.0),
        (-1.35, -1.2, 215.0),
        (-2.35, -1.9, 80.0),
        (-1.6, -2.45, -10.0),
        (0.45, -1.45, 172.0),
        (1.2, -2.25, -85.0),
        (2.05, -0.45, 185.0),
        (2.4, -1.8, -15.0),
    ];
    for (x, z, turn) in chairs {
        s.place("chair", "dark-wood", turned(turn, x, 0.0, z));
    }

    let y = 0.755;
    s.place("cup", "porcelain", turned(-40.0, -0.2, y, -0.02));
    s.place("coffee", "coffee", at(-0.2, y, -0.02));
    s.place("cup", "red-glaze", turned(150.0, 0.16, y, -0.17));
    s.place("coffee", "coffee", at(0.16, y, -0.17));
    s.put("ball", "steel", ball(0.062, 26).at(0.045, y + 0.062, 0.03));
    s.put("pot", "copper", teapot().turned(205.0).at(-0.07, y, -0.2));
    // A tumbler, its base thick.
    let mut p = vec![[0.0, 0.0], [0.026, 0.0]];
    p.extend(curve(&[[0.028, 0.002], [0.033, 0.06], [0.036, 0.12]], 5));
    p.extend(curve(&[[0.0345, 0.12], [0.0315, 0.06], [0.026, 0.015], [0.0, 0.012]], 5));
    s.put("tumbler", "glass", lathe(&p, 28).at(0.235, y, 0.05));
    let spoon = |u: f64, v: f64| {
        let (a, x) = (2.0 * v - 1.0, u);
        let half = 0.004 + 0.012 * (1.0 - ((x - 0.14) / 0.14).powi(2)).max(0.0).sqrt() * (x < 0.28) as u8 as f64;
        v3(0.14 * x, 0.003 + 0.05 * (x - 0.3).max(0.0).powi(2) + 0.004 * a * a, half * a)
    };
    s.put("spoon", "steel", patch(40, 6, spoon).flipped().turned(28.0).at(-0.155, y + 0.008, 0.12));
    s.put("napkin", "paper", block([-0.08, 0.0, -0.05], [0.08, 0.004, 0.05], 0.001).turned(28.0).at(-0.1, y, 0.11));
    for k in 0..3 {
        let c = block([-0.008, 0.0, -0.008], [0.008, 0.016, 0.008], 0.0015).turned(31.0 * k as f64);
        s.put("sugar", "paper", c.at(-0.235 + 0.018 * k as f64, y + 0.0125, 0.035 + 0.006 * k as f64));
    }

    // The counter with bottles on the right, and brass pendants with lit discs inside.
    s.put("counter", "dark-wood", block([2.75, 0.0, -3.0], [3.3, 1.05, 1.8], 0.01));
    s.put("counter-top", "table-top", block([2.68, 1.05, -3.05], [3.36, 1.1, 1.85], 0.012));
    for y in [1.5, 1.95] {
        s.put("shelf", "dark-wood", block([3.15, y - 0.03, -2.8], [3.4, y, 1.6], 0.006));
    }
    for k in 0..26 {
        let tall = 0.24 + 0.08 * texture::hash(k, 1, 6);
        let mut p = vec![[0.0, 0.0], [0.04, 0.0]];
        p.extend(curve(&[[0.04, 0.0], [0.04, 0.6 * tall], [0.014, 0.75 * tall], [0.014, tall]], 2));
        p.push([0.0, tall]);
        let name = if texture::hash(k, 5, 6) > 0.5 { "bottle-green" } else { "bottle-amber" };
        s.put(name, name, lathe(&p, 10).at(3.27, 1.5 + 0.45 * (k % 2) as f64, -2.6 + 0.155 * k as f64));
    }
    let pendant = curve(&[[0.15, 0.0], [0.13, 0.06], [0.05, 0.13], [0.02, 0.16]], 4);
    let mut p: Vec<[f64; 2]> = pendant.iter().rev().map(|&[r, y]| [r - 0.004, y - 0.003]).collect();
    p.insert(0, [0.0, 0.155]);
    p.extend(&pendant);
    p.push([0.0, 0.16]);
    s.define("pendant", lathe(&p, 28));
    s.define("pendant-inside", cylinder(0.03, 0.09, 14).at(0.0, 0.051, 0.0));
    s.define("cord", rod([0.0, 0.155, 0.0], [0.0, 1.2, 0.0], 0.004, 6));
    s.define("pendant-light", disc_down(0.05, 20).at(0.0, 0.05, 0.0));
    for (x, z) in [(-1.75, -1.75), (0.55, -2.15), (2.2, -1.1), (2.9, 0.4)] {
        let place = at(x, h - 1.15, z);
        s.place("pendant", "copper", place);
        s.place("pendant-inside", "lamp-inside", place);
        s.place("cord", "dark-wood", place);
        s.place_lamp("pendant-light", [190.0, 132.0, 72.0], place);
    }
    // A potted plant in the corner between the windows.
    s.put(
        "plant-pot",
        "red-glaze",
        lathe(&[[0.0, 0.0], [0.13, 0.0], [0.19, 0.34], [0.21, 0.34], [0.21, 0.4], [0.17, 0.4], [0.0, 0.36]], 24)
            .at(-2.75, 0.0, -2.75),
    );
    for k in 0..40 {
        let r = |j: i64| texture::hash(k, j, 19);
        let (lean, length, twist) = (0.25 + 0.9 * r(1), 0.5 + 0.5 * r(2), 360.0 * r(3));
        let leaf = |u: f64, v: f64| {
            let half = 0.05 * (std::f64::consts::PI * u.powf(0.7)).sin().max(0.0) + 0.004;
            let reach = length * u * lean;
            v3(half * (2.0 * v - 1.0), 0.36 + length * u - 0.55 * lean * length * u * u, reach)
        };
        s.put("plant", "leaf", patch(8, 2, leaf).turned(twist).at(-2.75, 0.0, -2.75));
    }
    s
}
