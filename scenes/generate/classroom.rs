//! A classroom: six panel lights in the ceiling and daylight through a row of windows on the left.

use crate::furniture::*;
use crate::mesh::Mesh;
use crate::scene::{Metal, Scene, at, turned};
use crate::shapes::*;
use crate::texture::{self, Picture, Sky};

/// The steel frame of a pupil's desk for one.
fn desk_frame() -> Mesh {
    let mut m = Mesh::default();
    for x in [-0.29, 0.29] {
        let p = [[x, 0.012, 0.22], [x, 0.012, -0.2], [x, 0.72, -0.12], [x, 0.72, 0.2]];
        m.add(tube(&[p[0], p[1]], 8, |_| 0.012));
        m.add(rod([x, 0.012, -0.05], [x, 0.715, -0.05], 0.014, 8));
        m.add(rod([x, 0.7, -0.2], [x, 0.7, 0.2], 0.012, 8));
    }
    m.and(rod([-0.29, 0.3, -0.05], [0.29, 0.3, -0.05], 0.011, 8))
}

/// The steel frame of a pupil's chair, which faces −z here as all else in the room does.
fn chair_frame() -> Mesh {
    let mut m = Mesh::default();
    for x in [-0.17, 0.17] {
        let p = [[x, 0.0, -0.2], [x, 0.4, -0.16], [x, 0.43, -0.1], [x, 0.43, 0.14], [x, 0.5, 0.18], [x, 0.8, 0.24]];
        m.add(tube(&curve(&p, 3), 8, |_| 0.011));
        m.add(rod([x, 0.0, 0.24], [x, 0.43, 0.1], 0.011, 8));
    }
    m
}

/// Its bent plywood seat and back.
fn chair_wood() -> Mesh {
    let plate = |u: f64, v: f64, t: f64| {
        let x = 2.0 * u - 1.0;
        v3(0.2 * x, 0.437 + t + 0.012 * x * x - 0.02 * (v - 0.1).max(0.0).powi(2), 0.2 - 0.4 * v)
    };
    let back = |u: f64, v: f64, t: f64| {
        let x = 2.0 * u - 1.0;
        v3(0.2 * x, 0.6 + 0.2 * v, 0.2 + 0.035 * v - 0.03 * x * x - t + 0.02)
    };
    patch(6, 5, |u, v| plate(u, v, 0.012))
        .and(patch(6, 5, |u, v| plate(1.0 - u, v, 0.0)))
        .and(patch(6, 3, |u, v| back(1.0 - u, v, 0.012)))
        .and(patch(6, 3, |u, v| back(u, v, 0.0)))
}

/// A green chalk board with wiped traces and a few lines of chalk.
fn board() -> Picture {
    Picture::new(320, 128, |u, v| {
        let smear = texture::fbm(0.7 * u + 0.3 * v, v, 5, 4, 40);
        let c = texture::mix([0.13, 0.25, 0.2], [0.27, 0.38, 0.32], 1.6 * smear - 0.45);
        let chalk = |on: bool, c: [f64; 3]| if on { [0.86, 0.86, 0.8] } else { c };
        // A triangle, a circle and a curve, as in a geometry lesson.
        let (x, y) = (u * 2.5, v);
        let line = |ax: f64, ay: f64, bx: f64, by: f64| {
            let t = (((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / ((bx - ax).powi(2) + (by - ay).powi(2)))
                .clamp(0.0, 1.0);
            (x - ax - t * (bx - ax)).hypot(y - ay - t * (by - ay)) < 0.009
        };
        let circle = ((x - 1.3).hypot(y - 0.5) - 0.27).abs() < 0.008;
        let mut on = line(0.2, 0.75, 0.75, 0.75) || line(0.75, 0.75, 0.75, 0.25) || line(0.75, 0.25, 0.2, 0.75);
        on |= line(0.68, 0.75, 0.68, 0.68) || line(0.68, 0.68, 0.75, 0.68) || circle;
        on |= line(1.3, 0.5, 1.49, 0.31) || line(1.03, 0.5, 1.57, 0.5);
        on |= line(1.75, 0.8, 2.4, 0.8) || line(1.8, 0.85, 1.8, 0.2);
        on |= (1.78..2.38).contains(&x) && (y - 0.55 + 0.2 * (9.0 * (x - 1.8)).sin()).abs() < 0.013;
        chalk(on && texture::hash((u * 640.0) as i64, (v * 256.0) as i64, 3) > 0.15, c)
    })
}

pub fn scene() -> Scene {
    let purpose =
        "A classroom under ceiling panels, with daylight from a row of windows: two kinds of light, many objects.";
    let mut s = Scene::new("classroom", purpose, 16, 256);
    s.camera([3.25, 1.62, 3.55], [-1.1, 0.98, -2.2], 68.0);
    let sky = Sky {
        zenith: [0.5, 0.8, 1.5],
        horizon: [1.7, 1.85, 2.0],
        ground: [0.42, 0.45, 0.36],
        sun: v3(-0.8, 0.75, 0.25),
        glow: [2.0, 1.7, 1.2],
        disc: [5600.0, 5000.0, 4100.0],
        disc_radius: 1.2,
        clouds: 0.8,
    };
    s.file("textures/sky.hdr", sky.picture(96).hdr());
    s.file("textures/parquet.png", texture::planks([0.55, 0.42, 0.29], [0.76, 0.63, 0.46], 6, 6).png());
    s.file("textures/board.png", board().png());
    s.environment("textures/sky.hdr", 2.2);
    s.glossy_picture("parquet", "textures/parquet.png", [1.3, 0.7], 0.3);
    s.matt_picture("board", "textures/board.png", [1.0, -1.0]);
    s.matt("wall", [0.76, 0.74, 0.68]);
    s.matt("wainscot", [0.42, 0.52, 0.5]);
    s.matt("ceiling", [0.8, 0.8, 0.78]);
    s.matt("outside", [0.55, 0.5, 0.45]);
    s.glossy("desk", [0.62, 0.46, 0.28], 0.2);
    s.glossy("ply", [0.66, 0.47, 0.27], 0.2);
    s.glossy("oak", [0.45, 0.29, 0.15], 0.2);
    s.glossy("white-paint", [0.78, 0.78, 0.76], 0.2);
    s.metal("steel", Metal::Steel, 0.25);
    s.matt("red", [0.6, 0.12, 0.09]);
    s.matt("blue", [0.14, 0.25, 0.5]);
    s.matt("yellow", [0.72, 0.56, 0.16]);
    s.matt("paper", [0.8, 0.79, 0.75]);
    s.glossy("globe", [0.14, 0.33, 0.55], 0.15);
    s.metal("brass", Metal::Brass, 0.15);

    // The room: x −4 … 4, z −4 … 4.2, windows in the wall x = −4.
    let (w, h, front, back) = (4.0, 3.1, -4.0, 4.2);
    s.put("floor", "parquet", slab([-w - 0.3, -0.2, front - 0.3], [w + 0.3, 0.0, back + 0.3]));
    s.put("ceiling", "ceiling", slab([-w - 0.3, h, front - 0.3], [w + 0.3, h + 0.2, back + 0.3]));
    s.put("walls", "wall", slab([w, -0.2, front - 0.3], [w + 0.3, h + 0.2, back + 0.3]));
    s.put("walls", "wall", slab([-w - 0.3, -0.2, front - 0.3], [w + 0.3, h + 0.2, front]));
    s.put("walls", "wall", slab([-w - 0.3, -0.2, back], [w + 0.3, h + 0.2, back + 0.3]));
    // In the wall's own frame x runs along −z … and its inside is z = 0.
    let starts = [0.75, 2.8, 4.85, 6.65];
    let holes: Vec<[f64; 4]> = starts.iter().map(|&x| [x, x + 1.45, 0.95, 2.75]).collect();
    let side = |m: Mesh| m.turned(90.0).at(-w, 0.0, back);
    s.put("walls", "wall", side(wall([-0.1, back - front + 0.1], [-0.1, h + 0.1], [-0.3, 0.0], &holes)));
    for o in &holes {
        s.put("windows", "white-paint", side(window([o[0], o[1]], [o[2], o[3]], -0.2, 2, 2)));
        s.put("windows", "white-paint", side(block([o[0] - 0.05, 0.91, -0.2], [o[1] + 0.05, 0.95, 0.12], 0.008)));
        // Radiators under the sills.
        for k in 0..12 {
            let x = o[0] + 0.1 + 0.105 * k as f64;
            s.put("radiators", "white-paint", side(block([x, 0.15, 0.04], [x + 0.085, 0.75, 0.13], 0.02)));
        }
    }
    s.put("wainscot", "wainscot", slab([-w, 0.0, front], [w, 0.9, front + 0.012]));
    s.put("wainscot", "wainscot", slab([w - 0.012, 0.0, front], [w, 0.9, back]));
    s.put("trim", "oak", block([-w, 0.9, front], [w, 0.95, front + 0.025], 0.004));
    s.put("trim", "oak", block([w - 0.025, 0.9, front], [w, 0.95, back], 0.004));
    s.put("outside", "outside", slab([-30.0, -3.6, -30.0], [-w - 0.3, -3.4, 30.0]));

    // Panel lights: white trays sunk below the ceiling, shining down only.
    for (i, x) in [-2.2, 0.2, 2.6].into_iter().enumerate() {
        for (j, z) in [-2.1, 1.6].into_iter().enumerate() {
            s.put(
                "trays",
                "white-paint",
                wall([-0.34, 0.34], [-0.66, 0.66], [0.0, 0.07], &[[-0.3, 0.3, -0.62, 0.62]]).tilted(90.0).at(
                    x,
                    h - 0.001,
                    z,
                ),
            );
            let (a, b, y) = (0.3, 0.62, h - 0.02);
            let panel = quad(v3(-a, y, -b), v3(a, y, -b), v3(a, y, b), v3(-a, y, b)).at(x, 0.0, z);
            s.lamp(&format!("panel-{}", 2 * i + j + 1), panel, [6.0, 5.7, 5.0]);
        }
    }

    // The board with its frame and chalk tray, a clock, a teacher's desk, a globe.
    let (bw, b0, b1) = (1.9, 1.0, 2.45);
    let z = front + 0.03;
    s.put("board", "board", picture(v3(-bw, b0, z), v3(bw, b0, z), v3(bw, b1, z), v3(-bw, b1, z)));
    s.put("trim", "oak", block([-bw - 0.06, b0 - 0.06, front], [bw + 0.06, b0, front + 0.06], 0.006));
    s.put("trim", "oak", block([-bw - 0.06, b1, front], [bw + 0.06, b1 + 0.06, front + 0.06], 0.006));
    for x in [-bw - 0.06, bw] {
        s.put("trim", "oak", block([x, b0, front], [x + 0.06, b1, front + 0.06], 0.006));
    }
    s.put("trim", "oak", block([-1.2, b0 - 0.1, front], [1.2, b0 - 0.06, front + 0.12], 0.006));
    for k in 0..5 {
        let x = -0.9 + 0.33 * k as f64;
        s.put("paper", "paper", block([x, b0 - 0.06, front + 0.07], [x + 0.08, b0 - 0.045, front + 0.085], 0.004));
    }
    let clock = [[0.0, 0.03], [0.14, 0.03], [0.145, 0.045], [0.16, 0.045], [0.165, 0.0]];
    let clock: Vec<[f64; 2]> = clock.iter().rev().copied().collect();
    s.put("clock", "paper", lathe(&clock, 32).tilted(90.0).at(2.75, 2.45, front));
    s.put("clock-hands", "oak", block([-0.006, 0.0, 0.04], [0.006, 0.11, 0.046], 0.001).at(2.75, 2.45, front));
    s.put(
        "clock-hands",
        "oak",
        block([-0.008, 0.0, 0.04], [0.008, 0.08, 0.046], 0.001).rolled(-62.0).at(2.75, 2.45, front),
    );
    s.put("teacher-desk", "oak", table(1.6, 0.76, 0.75, false).at(1.0, 0.0, -2.75));
    s.put("teacher-desk", "oak", block([0.3, 0.2, -2.44], [1.7, 0.7, -2.42], 0.004));
    s.put("globe", "globe", ball(0.15, 20).at(1.55, 1.0, -2.85));
    let stand: Vec<[f64; 3]> = (0..=12)
        .map(|k| (k as f64 * 15.0 - 60.0).to_radians())
        .map(|a| [0.17 * a.cos(), 0.17 * a.sin(), 0.0])
        .collect();
    s.put("globe-stand", "brass", tube(&stand, 8, |_| 0.007).turned(30.0).at(1.55, 1.0, -2.85));
    s.put(
        "globe-stand",
        "brass",
        lathe(&[[0.0, 0.76], [0.09, 0.76], [0.09, 0.775], [0.015, 0.79], [0.012, 0.85], [0.0, 0.85]], 24)
            .at(1.55, 0.0, -2.85),
    );
    s.put("chair", "oak", chair().at(0.8, 0.0, -3.4));

    // Pupils' desks, some with a book or a sheet of paper; chairs not quite aligned.
    s.define(
        "desk-top",
        block([-0.34, 0.715, -0.25], [0.34, 0.74, 0.25], 0.008).and(slab([-0.28, 0.6, -0.2], [0.28, 0.61, 0.2])),
    );
    s.define("desk-frame", desk_frame());
    s.define("seat-wood", chair_wood());
    s.define("seat-frame", chair_frame());
    s.define("book", block([-0.08, 0.74, -0.11], [0.08, 0.765, 0.11], 0.004));
    s.define("sheet", block([-0.105, 0.74, -0.148], [0.105, 0.7415, 0.148], 0.0005));
    for row in 0..4 {
        for column in 0..5 {
            let r = |k: i64| texture::hash(row, 10 * column + k, 8) - 0.5;
            let (x, z) = (-2.9 + 1.3 * column as f64, -1.35 + 1.25 * row as f64);
            if x > 2.0 && row == 3 {
                continue;
            }
            let place = turned(6.0 * r(1), x + 0.05 * r(2), 0.0, z);
            s.place("desk-top", "desk", place);
            s.place("desk-frame", "steel", place);
            let seat = turned(24.0 * r(3), x + 0.1 * r(4), 0.0, z + 0.42 + 0.15 * r(5));
            s.place("seat-wood", "ply", seat);
            s.place("seat-frame", "steel", seat);
            let put = turned(70.0 * r(6), x + 0.3 * r(7), 0.0, z + 0.1 * r(8));
            match (row * 5 + column) % 4 {
                0 => s.place("sheet", "paper", put),
                1 => s.place("book", if r(9) > 0.0 { "red" } else { "blue" }, put),
                2 => {
                    s.place("sheet", "paper", put);
                    s.place("book", "yellow", turned(-40.0 * r(7), x - 0.18, 0.0, z - 0.02));
                }
                _ => {}
            }
        }
    }

    // A shelf of books on the right wall, and two posters.
    for y in [1.05, 1.4, 1.75] {
        s.put("shelf", "oak", block([-0.2, y - 0.025, -1.3], [0.0, y, 1.3], 0.005).at(w - 0.01, 0.0, -1.7));
        for (k, m) in books(2.4, (y * 100.0) as u64, 4).into_iter().enumerate() {
            let material = ["red", "blue", "yellow", "wainscot"][k];
            s.put(&format!("books-{material}"), material, m.turned(-90.0).at(w - 0.17, y, -2.9));
        }
    }
    for z in [-3.0, -0.4] {
        s.put("shelf", "oak", block([-0.2, 1.02, -0.012], [0.0, 2.05, 0.012], 0.004).at(w - 0.01, 0.0, z));
    }
    s.define("poster", slab([-0.3, 1.3, 0.0], [0.3, 2.15, 0.006]));
    s.place("poster", "yellow", at(-2.6, 0.0, front));
    s.place("poster", "blue", at(-3.35, 0.0, front));
    s
}
