//! A bedroom in the morning: sun and sky come through the gap between heavy curtains.

use crate::furniture::*;
use crate::mesh::Mesh;
use crate::scene::{Metal, Scene};
use crate::shapes::*;
use crate::texture::{self, Sky};

/// A quilt over a bed: flat on top with quilted swellings and wrinkles, falling over the sides in soft waves.
fn duvet(w: f64, length: f64, top: f64) -> Mesh {
    patch(48, 36, |u, v| {
        let x = 2.0 * u - 1.0;
        let half = w / 2.0;
        // Arc length across, bent down over a rounded edge.
        let s = x * (half + 0.3);
        let edge = (s.abs() - half + 0.06).max(0.0);
        let bend = (edge / 0.09).min(std::f64::consts::FRAC_PI_2);
        let drop = 0.09 * (1.0 - bend.cos()) + (edge - 0.09 * std::f64::consts::FRAC_PI_2).max(0.0);
        let out = s.abs().min(half - 0.06) + 0.09 * bend.sin();
        let wave = drop * 0.16 * (9.0 * v + 1.3 * x.signum()).sin() + drop * 0.07 * (23.0 * v).sin();
        let wrinkle =
            texture::fbm(u, v, 4, 4, 12) * 0.07 + 0.018 * texture::noise(10.0 * u + 4.0 * v, 5.0 * v, 64, 64, 3);
        let foot = ((v - 0.93) / 0.07).max(0.0);
        let y = top + 0.02 + wrinkle * (1.0 - (drop / 0.2).min(1.0)) - drop - 0.22 * foot * foot;
        v3(x.signum() * (out + wave), y, length * (v - 0.5) - 0.03 * foot * foot)
    })
    .flipped()
}

pub fn scene() -> Scene {
    let purpose = "A bedroom lit by an environment map through the gap between curtains.";
    let mut s = Scene::new("bedroom", purpose, 16, 512);
    s.camera([-1.55, 1.5, 3.25], [0.72, 0.78, -0.9], 62.0);
    let sky = Sky {
        zenith: [0.9, 1.5, 2.9],
        horizon: [3.4, 3.7, 4.0],
        ground: [0.7, 0.75, 0.55],
        sun: v3(0.88, 0.62, 0.42),
        glow: [5.0, 4.0, 2.6],
        disc: [42000.0, 36000.0, 27000.0],
        disc_radius: 1.0,
        clouds: 0.5,
    };
    s.file("textures/sky.hdr", sky.picture(96).hdr());
    s.file("textures/boards.png", texture::planks([0.5, 0.33, 0.2], [0.74, 0.54, 0.35], 5, 17).png());
    s.file("textures/rug.png", texture::carpet([0.5, 0.2, 0.18], [0.2, 0.24, 0.36], [0.8, 0.7, 0.52]).png());
    s.file("textures/landscape.png", texture::landscape(4).png());
    s.environment("textures/sky.hdr", 4.2);
    s.glossy_picture("boards", "textures/boards.png", [1.4, 0.6], 0.3);
    s.matt_picture("rug", "textures/rug.png", [1.0, 1.0]);
    s.matt_picture("landscape", "textures/landscape.png", [1.0, -1.0]);
    s.matt("wall", [0.7, 0.69, 0.63]);
    s.matt("ceiling", [0.8, 0.79, 0.77]);
    s.matt("curtain", [0.36, 0.42, 0.5]);
    s.matt("linen", [0.8, 0.78, 0.74]);
    s.matt("quilt", [0.66, 0.7, 0.72]);
    s.matt("throw", [0.62, 0.3, 0.2]);
    s.glossy("walnut", [0.33, 0.19, 0.1], 0.22);
    s.glossy("white-paint", [0.77, 0.76, 0.73], 0.22);
    s.matt("shade", [0.76, 0.7, 0.58]);
    s.polished("ceramic", [0.24, 0.36, 0.38]);
    s.metal("brass", Metal::Brass, 0.12);
    s.matt("red", [0.52, 0.12, 0.1]);
    s.matt("blue", [0.15, 0.24, 0.42]);
    s.matt("outside", [0.4, 0.42, 0.3]);

    // x −2.3 … 2.3, z −2.1 … 3.5; the window is in the wall x = 2.3.
    let (w, h, back, front) = (2.3, 2.65, -2.1, 3.5);
    s.put("floor", "boards", slab([-w - 0.25, -0.2, back - 0.25], [w + 0.25, 0.0, front + 0.25]));
    s.put("ceiling", "ceiling", slab([-w - 0.25, h, back - 0.25], [w + 0.25, h + 0.2, front + 0.25]));
    s.put("walls", "wall", slab([-w - 0.25, -0.2, back - 0.25], [-w, h + 0.2, front + 0.25]));
    s.put("walls", "wall", slab([-w - 0.25, -0.2, back - 0.25], [w + 0.25, h + 0.2, back]));
    s.put("walls", "wall", slab([-w - 0.25, -0.2, front], [w + 0.25, h + 0.2, front + 0.25]));
    // The window wall: its frame has x along +z of the room, z = 0 at its inside, and faces −x.
    let side = |m: Mesh| m.turned(-90.0).at(w, 0.0, back);
    let (win, sill) = ([1.25, 2.95], [0.75, 2.25]);
    s.put(
        "walls",
        "wall",
        side(wall([-0.1, front - back + 0.1], [-0.1, h + 0.1], [-0.25, 0.0], &[[win[0], win[1], sill[0], sill[1]]])),
    );
    s.put("window", "white-paint", side(window(win, sill, -0.17, 3, 2)));
    s.put("window", "white-paint", side(casing(win, sill, [0.0, 0.02])));
    s.put("outside", "outside", slab([w + 0.3, -3.2, -25.0], [40.0, -3.0, 25.0]));
    s.put("rail", "brass", side(rod([0.75, 2.42, 0.15], [3.45, 2.42, 0.15], 0.014, 12)));
    for x in [0.75, 3.45] {
        s.put("rail", "brass", side(ball(0.03, 8).at(x, 2.42, 0.15)));
    }
    for k in 0..10 {
        let x = if k < 5 { 0.85 + 0.22 * k as f64 } else { 2.4 + 0.24 * (k - 5) as f64 };
        let ring: Vec<[f64; 3]> = (0..=12)
            .map(|i| ((i % 12) as f64 * 30.0).to_radians())
            .map(|a| [x, 2.405 + 0.024 * a.sin(), 0.15 + 0.024 * a.cos()])
            .collect();
        s.put("rail", "brass", side(tube(&ring, 5, |_| 0.003)));
    }
    s.put("curtains", "curtain", side(curtain(0.98, [0.03, 2.38], 0.055, 0.15).at(0.82, 0.0, 0.15)));
    s.put("curtains", "curtain", side(curtain(1.02, [0.03, 2.38], 0.055, 0.15).at(2.36, 0.0, 0.15)));
    s.put("trim", "white-paint", block([-w, 0.0, back], [w, 0.1, back + 0.016], 0.005));
    s.put("trim", "white-paint", block([-w, 0.0, back], [-w + 0.016, 0.1, front], 0.005));
    s.put("trim", "white-paint", block([w - 0.016, 0.0, back], [w, 0.1, front], 0.005));
    s.put("trim", "white-paint", block([-w, h - 0.07, back], [w, h, back + 0.05], 0.02));
    s.put("trim", "white-paint", block([-w, h - 0.07, back], [-w + 0.05, h, front], 0.02));
    s.put("trim", "white-paint", block([w - 0.05, h - 0.07, back], [w, h, front], 0.02));

    // The bed: headboard against the back wall.
    let bx = 0.15;
    s.put("bed", "walnut", block([-0.86, 0.0, -2.06], [0.86, 1.08, -2.0], 0.02).at(bx, 0.0, 0.0));
    for k in 0..3 {
        let x = -0.8 + 0.55 * k as f64;
        s.put("bed", "walnut", block([x, 0.5, -2.02], [x + 0.5, 1.0, -1.975], 0.02).at(bx, 0.0, 0.0));
    }
    s.put("bed", "walnut", block([-0.84, 0.18, -2.0], [0.84, 0.34, 0.06], 0.015).at(bx, 0.0, 0.0));
    s.put("bed", "walnut", block([-0.86, 0.0, 0.04], [0.86, 0.52, 0.1], 0.02).at(bx, 0.0, 0.0));
    s.put("mattress", "linen", block([-0.8, 0.32, -1.97], [0.8, 0.54, 0.02], 0.05).at(bx, 0.0, 0.0));
    s.put("duvet", "quilt", duvet(1.62, 1.5, 0.56).at(bx, 0.0, -0.7));
    let fold = |u: f64, v: f64| {
        let a = std::f64::consts::PI * v;
        v3(
            1.66 * (u - 0.5),
            0.595 + 0.045 * a.cos() + 0.03 * texture::fbm(u, 0.2, 5, 1, 8),
            -1.42 - 0.07 * a.sin() + 0.32 * (1.0 - v).powi(2),
        )
    };
    s.put("sheet", "linen", patch(40, 10, fold).at(bx, 0.01, 0.0));
    let pillow = |m: Mesh, x: f64, tilt: f64, turn: f64| m.tilted(tilt).turned(turn).at(bx + x, 0.6, -1.78);
    s.put("pillows", "linen", pillow(cushion(0.72, 0.2, 0.46, 14), -0.4, 38.0, 4.0));
    s.put("pillows", "linen", pillow(cushion(0.72, 0.2, 0.46, 14), 0.41, 36.0, -5.0));
    s.put("cushions", "throw", pillow(cushion(0.44, 0.16, 0.4, 12), -0.28, 52.0, 12.0).at(0.0, 0.03, 0.24));
    let blanket = |u: f64, v: f64| {
        let x = 2.0 * u - 1.0;
        let s = x.abs() * 1.2;
        let edge = (s - 0.8).max(0.0);
        let bend = (edge / 0.1).min(std::f64::consts::FRAC_PI_2);
        let drop = 0.1 * (1.0 - bend.cos()) + (edge - 0.157).max(0.0);
        let out = s.min(0.8) + 0.1 * bend.sin() + 0.02;
        let bump = 0.05 * texture::fbm(u, v, 6, 3, 5) + 0.012 * (18.0 * v).sin();
        v3(
            x.signum() * (out + drop * 0.1 * (12.0 * v).sin()),
            0.655 + bump * (1.0 - bend / 2.0) - drop,
            0.55 * (v - 0.5),
        )
    };
    s.put("throw", "throw", patch(48, 16, blanket).flipped().at(bx, 0.0, -0.3));

    // Nightstands with lamps (not lit) and books.
    for (x, lit) in [(-1.15, true), (1.45, false)] {
        s.put("nightstands", "walnut", block([-0.24, 0.12, -0.2], [0.24, 0.52, 0.18], 0.008).at(x, 0.0, -1.86));
        s.put("nightstands", "walnut", block([-0.27, 0.52, -0.22], [0.27, 0.55, 0.21], 0.008).at(x, 0.0, -1.86));
        for (lx, lz) in [(-0.21, -0.17), (0.21, -0.17), (0.21, 0.15), (-0.21, 0.15)] {
            s.put(
                "nightstands",
                "walnut",
                block([-0.02, 0.0, -0.02], [0.02, 0.12, 0.02], 0.004).at(x + lx, 0.0, -1.86 + lz),
            );
        }
        for y in [0.15, 0.34] {
            s.put("nightstands", "walnut", block([-0.21, y, 0.17], [0.21, y + 0.16, 0.195], 0.006).at(x, 0.0, -1.86));
            s.put("knobs", "brass", ball(0.014, 8).at(x, y + 0.08, -1.655));
        }
        let mut p = vec![[0.0, 0.0], [0.06, 0.0]];
        p.extend(curve(&[[0.062, 0.01], [0.09, 0.1], [0.05, 0.2], [0.016, 0.24], [0.016, 0.28]], 5));
        s.put("lamp-feet", "ceramic", lathe(&p, 20).at(x, 0.55, -1.9));
        let shade = [[0.16, 0.26], [0.11, 0.46], [0.107, 0.46], [0.157, 0.26]];
        s.put("lamp-shades", "shade", lathe(&shade, 32).at(x, 0.55, -1.9));
        let n = if lit { 3 } else { 2 };
        for k in 0..n {
            let book = block([-0.075, 0.0, -0.11], [0.075, 0.028, 0.11], 0.004).turned(15.0 + 17.0 * k as f64);
            let name = if k % 2 == 0 { "red" } else { "blue" };
            s.put(&format!("books-{name}"), name, book.at(x + 0.13, 0.55 + 0.0285 * k as f64, -1.75));
        }
    }
    s.put("frame", "walnut", frame(0.95, 0.62).at(bx, 1.72, back));
    s.put("painting", "landscape", canvas(0.95, 0.62).at(bx, 1.72, back));

    // A wardrobe on the left, a rug, a chair with a folded cloth.
    s.put("wardrobe", "white-paint", block([-w + 0.01, 0.06, -1.45], [-w + 0.6, 2.15, 0.15], 0.008));
    s.put("wardrobe", "white-paint", block([-w + 0.01, 2.15, -1.5], [-w + 0.65, 2.24, 0.2], 0.015));
    s.put("wardrobe", "white-paint", block([-w + 0.03, 0.0, -1.42], [-w + 0.57, 0.06, 0.12], 0.004));
    for k in 0..2 {
        let z = -1.43 + 0.79 * k as f64;
        let leaf = |y0: f64, y1: f64| block([-w + 0.59, y0 + 0.1, z + 0.1], [-w + 0.628, y1 - 0.1, z + 0.67], 0.01);
        s.put("wardrobe", "white-paint", block([-w + 0.59, 0.1, z], [-w + 0.615, 2.12, z + 0.77], 0.006));
        s.put("wardrobe", "white-paint", leaf(0.1, 1.0).and(leaf(0.95, 2.12)));
        s.put("knobs", "brass", ball(0.016, 8).at(-w + 0.64, 1.05, if k == 0 { z + 0.72 } else { z + 0.05 }));
    }
    let rug = picture(v3(-1.0, 0.012, 1.75), v3(1.25, 0.012, 1.75), v3(1.25, 0.012, 0.3), v3(-1.0, 0.012, 0.3));
    s.put("rug", "rug", rug.turned(3.0));
    s.put("rug-edge", "linen", block([-1.01, 0.0, 0.29], [1.26, 0.011, 1.76], 0.003).turned(3.0));
    s.put("chair", "walnut", chair().turned(-60.0).at(1.6, 0.0, 1.95));
    s.put("cushions", "throw", cushion(0.38, 0.07, 0.38, 12).turned(-60.0).at(1.6, 0.455, 1.95));
    s
}
