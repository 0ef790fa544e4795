//! Inside a house of two storeys at dusk: a hall with stairs to a gallery, rooms above and below, small lamps.

use crate::furniture::*;
use crate::mesh::Mesh;
use crate::scene::{Metal, Scene, at, turned};
use crate::shapes::*;
use crate::texture;

/// A turned baluster of height h.
fn baluster(h: f64) -> Mesh {
    let p = [
        [0.018, 0.0],
        [0.018, 0.08],
        [0.012, 0.1],
        [0.022, 0.2],
        [0.026, 0.3],
        [0.013, 0.5],
        [0.012, 0.75],
        [0.016, 0.9],
        [0.016, 1.0],
    ];
    let p: Vec<[f64; 2]> = curve(&p, 2).iter().map(|&[r, y]| [r, y * h]).collect();
    lathe(&p, 10)
}

/// A table or floor lamp's fabric shade and its foot; the lamp's disc goes inside at `y`.
fn shade(r: f64, y: f64) -> Mesh {
    lathe(&[[r, y - 0.02], [r * 0.68, y + 0.2], [r * 0.66, y + 0.2], [r * 0.98, y - 0.02]], 28)
}

pub fn scene() -> Scene {
    let purpose = "A two-storey house at dusk: stairs, gallery, rooms above and below, several small lamps, some sky.";
    let mut s = Scene::new("house", purpose, 20, 512);
    s.camera([-1.75, 1.75, 5.25], [0.55, 2.15, -2.6], 74.0);
    s.file("textures/boards.png", texture::planks([0.42, 0.26, 0.15], [0.66, 0.46, 0.28], 5, 41).png());
    s.file("textures/rug.png", texture::carpet([0.22, 0.3, 0.36], [0.5, 0.2, 0.16], [0.78, 0.68, 0.5]).png());
    s.file("textures/landscape.png", texture::landscape(52).png());
    s.constant([0.45, 0.75, 1.5]);
    s.glossy_picture("boards", "textures/boards.png", [1.5, 0.6], 0.25);
    s.matt_picture("rug", "textures/rug.png", [1.0, 1.0]);
    s.matt_picture("landscape", "textures/landscape.png", [1.0, -1.0]);
    s.matt("wall", [0.74, 0.7, 0.62]);
    s.matt("green-wall", [0.42, 0.5, 0.42]);
    s.matt("rose-wall", [0.68, 0.5, 0.43]);
    s.matt("ceiling", [0.8, 0.79, 0.76]);
    s.glossy("white-paint", [0.76, 0.75, 0.71], 0.2);
    s.glossy("oak", [0.4, 0.24, 0.12], 0.2);
    s.glossy("walnut", [0.25, 0.14, 0.075], 0.18);
    s.matt("sofa", [0.2, 0.32, 0.36]);
    s.matt("cushion", [0.68, 0.42, 0.16]);
    s.matt("linen", [0.78, 0.75, 0.7]);
    s.matt("shade", [0.78, 0.7, 0.55]);
    s.metal("brass", Metal::Brass, 0.12);
    s.polished("ceramic", [0.62, 0.62, 0.56]);
    s.polished("blue-glaze", [0.1, 0.2, 0.42]);
    s.matt("red", [0.5, 0.12, 0.09]);
    s.matt("blue", [0.13, 0.22, 0.42]);
    s.matt("leaf", [0.13, 0.26, 0.1]);
    s.matt("outside", [0.22, 0.26, 0.18]);

    // Outer shell: x −3.2 … 3.2, z −6.5 … 6, two storeys; the hall is open to the roof for z > −2.6.
    let (w, h, back, front) = (3.2, 5.5, -6.5, 6.0);
    let (floor, slab0) = (2.9, 2.62);
    s.put("floor", "boards", slab([-w - 0.3, -0.2, back - 0.3], [w + 0.3, 0.0, front + 0.3]));
    s.put("ceiling", "ceiling", slab([-w - 0.3, h, back - 0.3], [w + 0.3, h + 0.2, front + 0.3]));
    s.put("walls", "wall", slab([w, -0.2, back - 0.3], [w + 0.3, h + 0.2, front + 0.3]));
    s.put("walls", "wall", slab([-w - 0.3, -0.2, front], [w + 0.3, h + 0.2, front + 0.3]));
    s.put("walls", "wall", slab([-w - 0.3, -0.2, back - 0.3], [w + 0.3, h + 0.2, back]));
    // Two tall windows in the left wall of the hall, and a small one above.
    let side = |m: Mesh| m.turned(90.0).at(-w, 0.0, front);
    let low = [[2.2, 3.5, 0.7, 2.35], [4.6, 5.9, 0.7, 2.35]];
    let high = [[2.2, 3.5, 3.35, 4.7], [4.6, 5.9, 3.35, 4.7]];
    s.put("walls", "wall", side(wall([-0.2, front - back + 0.2], [-0.1, 2.8], [-0.3, 0.0], &low)));
    s.put("walls", "wall", side(wall([-0.2, front - back + 0.2], [2.8, h + 0.1], [-0.3, 0.0], &high)));
    for o in low.iter().chain(&high) {
        s.put("windows", "white-paint", side(window([o[0], o[1]], [o[2], o[3]], -0.2, 2, 3)));
        s.put("windows", "white-paint", side(casing([o[0], o[1]], [o[2], o[3]], [0.0, 0.022])));
    }
    s.put("outside", "outside", slab([-40.0, -0.5, -40.0], [-w - 0.3, -0.4, 40.0]));
    for (x, width) in [(1.72, 0.5), (5.93, 0.5), (3.55, 0.42), (4.13, 0.42)] {
        s.put("curtains", "linen", side(curtain(width, [0.05, 2.5], 0.045, 0.16).at(x, 0.0, 0.12)));
    }
    s.put("curtain-rail", "brass", side(rod([1.6, 2.52, 0.12], [6.5, 2.52, 0.12], 0.014, 10)));

    // The upper floor with a moulded edge, and the walls behind the gallery and the space below it.
    let edge = -2.6;
    let room = -4.0;
    s.put("upper-floor", "boards", slab([-w - 0.1, floor - 0.03, back - 0.1], [w + 0.1, floor, edge]));
    s.put("upper-slab", "ceiling", slab([-w - 0.1, slab0, back - 0.1], [w + 0.1, floor - 0.03, edge]));
    s.put("beam", "white-paint", block([-w, slab0 - 0.06, edge - 0.12], [w, floor + 0.015, edge + 0.05], 0.015));
    let (low_door, high_door) = ([-0.55, 0.4], [-1.75, -0.85]);
    s.put(
        "low-wall",
        "green-wall",
        wall([-w, w], [-0.1, slab0 + 0.1], [room - 0.15, room], &[[low_door[0], low_door[1], 0.0, 2.08]]),
    );
    s.put(
        "high-wall",
        "rose-wall",
        wall(
            [-w, w],
            [floor - 0.1, h + 0.1],
            [room - 0.15, room],
            &[[high_door[0], high_door[1], floor, floor + 2.06]],
        ),
    );
    s.put("trim", "white-paint", casing(low_door, [0.0, 2.08], [room, room + 0.025]));
    s.put("trim", "white-paint", casing(high_door, [0.0, 2.06], [0.0, 0.025]).at(0.0, floor, room));
    s.put(
        "doors",
        "white-paint",
        door_leaf(0.93, 2.05).scaled(-1.0, 1.0, 1.0).turned(-62.0).at(low_door[1], 0.01, room - 0.12),
    );
    s.put("doors", "white-paint", door_leaf(0.88, 2.03).turned(70.0).at(high_door[0], floor + 0.01, room - 0.12));
    for (y, doors) in [(0.0, low_door), (floor, high_door)] {
        s.put("trim", "white-paint", block([-w, y, room], [doors[0] - 0.09, y + 0.12, room + 0.018], 0.006));
        s.put("trim", "white-paint", block([doors[1] + 0.09, y, room], [w, y + 0.12, room + 0.018], 0.006));
    }
    s.put("trim", "white-paint", block([w - 0.018, 0.0, edge], [w, 0.12, front], 0.006));
    s.put("trim", "white-paint", block([-w, 0.0, edge], [-w + 0.018, 0.12, front], 0.006));
    s.put("trim", "white-paint", block([-w, h - 0.1, edge], [-w + 0.08, h, front], 0.03));
    s.put("trim", "white-paint", block([w - 0.08, h - 0.1, edge], [w, h, front], 0.03));
    s.put("trim", "white-paint", block([-w, h - 0.1, room], [w, h, room + 0.08], 0.03));

    // Stairs along the right wall, up towards the gallery.
    let (steps, going) = (16, 0.27);
    let rise = floor / steps as f64;
    let (sx0, sx1) = (1.95, w);
    let start = edge + going * (steps - 1) as f64;
    s.define("baluster", baluster(0.85));
    s.define("baluster-long", baluster(0.91));
    s.define("baluster-short", baluster(0.8));
    for k in 0..steps - 1 {
        let (y, z) = (rise * (k + 1) as f64, start - going * k as f64);
        s.put("treads", "oak", block([sx0 - 0.03, y - 0.035, z - going - 0.01], [sx1, y, z + 0.03], 0.008));
        s.put("risers", "white-paint", slab([sx0, (y - rise - 0.2).max(0.0), z - going], [sx1, y - 0.03, z]));
        if k > 0 {
            s.put("spandrel", "white-paint", slab([sx0 + 0.02, 0.0, z - going], [sx0 + 0.06, y - rise, z]));
        }
        for d in [0.07, 0.2] {
            let name = if d > 0.1 { "baluster-long" } else { "baluster-short" };
            s.place(name, "white-paint", at(sx0 + 0.03, y, z - d));
        }
    }
    let hand = |y: f64, z: f64| [sx0 + 0.03, y + 0.93, z];
    s.put("rail", "oak", tube(&[hand(rise, start + 0.05), hand(floor, edge + 0.15)], 12, |_| 0.032));
    let post = |h: f64| block([-0.05, 0.0, -0.05], [0.05, h, 0.05], 0.008).and(ball(0.06, 10).at(0.0, h + 0.05, 0.0));
    s.put("rail", "oak", post(1.12).at(sx0 + 0.03, 0.0, start + 0.08));
    s.put("rail", "oak", post(1.05).at(sx0 + 0.03, floor, edge + 0.02));
    s.put("rail", "oak", rod([-w, floor + 0.95, edge - 0.02], [sx0, floor + 0.95, edge - 0.02], 0.035, 12));
    s.put("rail", "oak", block([-w, floor + 0.06, edge - 0.05], [sx0, floor + 0.1, edge + 0.01], 0.006));
    for k in 0..42 {
        s.place("baluster", "white-paint", at(-w + 0.1 + 0.122 * k as f64, floor + 0.1, edge - 0.02));
    }

    // The hall: rug, sofa, low table, floor lamp, picture.
    s.put("rug", "rug", picture(v3(-1.7, 0.012, 3.1), v3(0.9, 0.012, 3.1), v3(0.9, 0.012, 0.9), v3(-1.7, 0.012, 0.9)));
    s.put("rug-edge", "linen", block([-1.71, 0.0, 0.89], [0.91, 0.011, 3.11], 0.003));
    let sofa = |s: &mut Scene, place: &dyn Fn(Mesh) -> Mesh| {
        s.put("sofa", "sofa", place(block([-0.98, 0.1, -0.42], [0.98, 0.36, 0.4], 0.04)));
        s.put("sofa", "sofa", place(block([-0.98, 0.1, -0.46], [0.98, 0.82, -0.22], 0.07)));
        for x in [-0.98, 0.8] {
            s.put("sofa", "sofa", place(block([x, 0.1, -0.42], [x + 0.18, 0.6, 0.42], 0.06)));
        }
        for x in [-0.4, 0.4] {
            s.put("sofa", "sofa", place(cushion(0.82, 0.2, 0.66, 14).at(x, 0.32, 0.1)));
        }
        for (x, turn) in [(-0.55, 10.0), (0.6, -14.0)] {
            s.put(
                "cushions",
                "cushion",
                place(cushion(0.42, 0.15, 0.42, 12).tilted(68.0).turned(turn).at(x, 0.68, -0.17)),
            );
        }
    };
    sofa(&mut s, &|m| m.turned(90.0).at(-2.45, 0.0, 0.6));
    s.put("low-table", "walnut", table(1.0, 0.42, 0.6, false).turned(90.0).at(-0.95, 0.0, 1.2));
    s.put("bowl", "blue-glaze", bowl().at(-0.95, 0.42, 1.05));
    for k in 0..3 {
        let book = block([-0.1, 0.0, -0.14], [0.1, 0.03, 0.14], 0.004).turned(12.0 + 13.0 * k as f64);
        let name = ["red", "blue", "cushion"][k];
        s.put(&format!("book-{name}"), name, book.at(-0.92, 0.42 + 0.0305 * k as f64, 1.5));
    }
    s.put("frame", "walnut", frame(1.1, 0.73).turned(-90.0).at(w, 3.1, -0.35));
    s.put("painting", "landscape", canvas(1.1, 0.73).turned(-90.0).at(w, 3.1, -0.35));
    s.put("sideboard", "walnut", block([-0.6, 0.12, -0.2], [0.6, 0.78, 0.2], 0.01).at(2.2, 0.0, room + 0.22));
    s.put("sideboard", "walnut", block([-0.63, 0.78, -0.22], [0.63, 0.81, 0.22], 0.008).at(2.2, 0.0, room + 0.22));
    s.put("vase", "ceramic", vase().at(2.0, 0.81, room + 0.2));

    // Below the gallery: a dining table with chairs and a dresser.
    s.put("dining-table", "oak", table(1.5, 0.75, 0.8, true).at(-1.85, 0.0, -3.2));
    s.define("chair", chair());
    for (x, z, turn) in [(-2.25, -2.6, 175.0), (-1.5, -2.62, 188.0), (-2.2, -3.75, 4.0), (-1.45, -3.78, -6.0)] {
        s.place("chair", "oak", turned(turn, x, 0.0, z));
    }
    s.put("teapot", "ceramic", teapot().turned(200.0).at(-1.7, 0.75, -3.2));
    s.define("cup", cup());
    s.place("cup", "ceramic", turned(30.0, -2.15, 0.75, -3.0));
    s.place("cup", "ceramic", turned(190.0, -1.4, 0.75, -3.35));
    s.put("shelf", "oak", block([0.75, 0.0, room], [1.75, 0.03, room + 0.24], 0.005));
    for (k, y) in [0.4, 0.85, 1.3, 1.75].into_iter().enumerate() {
        s.put("shelf", "oak", block([0.75, y - 0.03, room], [1.75, y, room + 0.24], 0.005));
        for (c, m) in books(0.9, k as u64 + 70, 4).into_iter().enumerate() {
            let name = ["red", "blue", "cushion", "sofa"][c];
            if k < 3 {
                s.put(&format!("shelf-{name}"), name, m.at(0.79, y, room + 0.21));
            }
        }
    }
    for x in [0.73, 1.75] {
        s.put("shelf", "oak", block([x, 0.0, room], [x + 0.03, 2.0, room + 0.24], 0.005));
    }

    // Above: pictures on the gallery wall, a plant, and a bed seen through the door.
    for (x, a, b) in [(0.25, 0.5, 0.36), (1.2, 0.7, 0.5)] {
        s.put("frame", "walnut", frame(a, b).at(x, floor + 1.55, room));
        s.put("painting", "landscape", canvas(a, b).at(x, floor + 1.55, room));
    }
    s.put("bed", "walnut", block([-2.6, floor, -6.4], [-1.0, floor + 0.4, -4.9], 0.02));
    s.put("bedding", "linen", block([-2.58, floor + 0.36, -6.38], [-1.02, floor + 0.6, -4.92], 0.08));
    s.put(
        "plant-pot",
        "blue-glaze",
        lathe(&[[0.0, 0.0], [0.12, 0.0], [0.17, 0.3], [0.19, 0.3], [0.19, 0.35], [0.15, 0.35], [0.0, 0.32]], 24).at(
            0.75,
            0.0,
            start - 1.6,
        ),
    );
    for k in 0..36 {
        let r = |j: i64| texture::hash(k, j, 33);
        let (lean, length, twist) = (0.25 + 0.9 * r(1), 0.5 + 0.5 * r(2), 360.0 * r(3));
        let leaf = |u: f64, v: f64| {
            let half = 0.045 * (std::f64::consts::PI * u.powf(0.7)).sin().max(0.0) + 0.004;
            v3(half * (2.0 * v - 1.0), 0.32 + length * u - 0.55 * lean * length * u * u, length * u * lean)
        };
        s.put("plant", "leaf", patch(8, 2, leaf).turned(twist).at(0.75, 0.0, start - 1.6));
    }

    // Lamps. Discs inside shades shine down (and up) only; the rest of the room gets what comes back.
    s.define("shade-small", shade(0.15, 0.0));
    s.define("disc-down", disc_down(0.05, 20));
    s.define("disc-up", disc_up(0.05, 20));
    s.define(
        "bulb-base",
        cylinder(0.05, 0.012, 20).at(0.0, -0.006, 0.0).and(rod([0.0, 0.0, 0.0], [0.0, 0.16, 0.0], 0.006, 8)),
    );
    let shaded = |s: &mut Scene, x: f64, y: f64, z: f64, c: [f64; 3]| {
        s.place("shade-small", "shade", at(x, y, z));
        s.place("bulb-base", "brass", at(x, y + 0.07, z));
        s.place_lamp("disc-down", c, at(x, y + 0.0635, z));
        s.place_lamp("disc-up", c, at(x, y + 0.0765, z));
    };
    let warm = [1700.0, 1220.0, 720.0];
    shaded(&mut s, -1.85, 1.62, -3.2, warm);
    s.put("cords", "brass", rod([-1.85, 1.78, -3.2], [-1.85, slab0, -3.2], 0.005, 6));
    shaded(&mut s, -2.75, 1.45, -0.85, warm);
    s.put(
        "lamp-foot",
        "brass",
        rod([-2.75, 0.0, -0.85], [-2.75, 1.53, -0.85], 0.012, 10).and(cylinder(0.14, 0.02, 24).at(-2.75, 0.0, -0.85)),
    );
    // On the wall over the stairs.
    shaded(&mut s, w - 0.2, 2.75, 0.9, warm);
    s.put("sconce", "brass", rod([w - 0.2, 2.8, 0.9], [w, 2.7, 0.9], 0.01, 8));
    s.put("sconce", "brass", block([w - 0.02, 2.6, 0.85], [w, 2.8, 0.95], 0.006));
    // In the rooms behind the doors, and a pendant over the gallery.
    shaded(&mut s, -0.6, 1.9, -5.4, [2000.0, 1600.0, 1100.0]);
    s.put("cords", "brass", rod([-0.6, 2.06, -5.4], [-0.6, slab0, -5.4], 0.005, 6));
    shaded(&mut s, -0.5, floor + 1.7, -5.3, [2400.0, 1650.0, 950.0]);
    s.put("cords", "brass", rod([-0.5, floor + 1.86, -5.3], [-0.5, h, -5.3], 0.005, 6));
    shaded(&mut s, 0.72, floor + 1.95, -3.35, warm);
    s.put("cords", "brass", rod([0.72, floor + 2.11, -3.35], [0.72, h, -3.35], 0.005, 6));
    s
}
