//! Glass on a table: a goblet, an egg and a ball focus the light of one small lamp onto the cloth.

use crate::furniture::bowl;
use crate::mesh::Mesh;
use crate::scene::{Metal, Scene};
use crate::shapes::*;
use crate::texture;

/// A stemmed glass with walls of real thickness.
fn goblet() -> Mesh {
    let mut p = vec![[0.0, 0.0], [0.036, 0.0]];
    p.extend(curve(&[[0.036, 0.003], [0.01, 0.008], [0.0045, 0.02], [0.0045, 0.07], [0.012, 0.085]], 5));
    p.extend(&curve(&[[0.012, 0.085], [0.037, 0.105], [0.043, 0.135], [0.036, 0.185]], 6)[1..]);
    p.extend(curve(&[[0.0345, 0.185], [0.0412, 0.135], [0.0345, 0.108], [0.012, 0.092], [0.0, 0.0895]], 6));
    lathe(&p, 40)
}

/// A solid glass egg standing on its blunt end.
fn egg() -> Mesh {
    let n = 26;
    let profile: Vec<[f64; 2]> = (0..=n)
        .map(|i| std::f64::consts::PI * i as f64 / n as f64)
        .map(|a| [0.028 * a.sin() * (1.0 + 0.13 * a.cos()), 0.0385 - 0.0385 * a.cos()])
        .collect();
    lathe(&profile, 44)
}

pub fn scene() -> Scene {
    let purpose = "Glass under a small lamp: caustics on a table, the hard case for eye paths.";
    let mut s = Scene::new("caustic", purpose, 20, 512);
    s.camera([0.09, 0.45, 0.8], [-0.055, 0.122, -0.04], 47.0);
    s.file("textures/planks.png", texture::planks([0.33, 0.2, 0.12], [0.62, 0.44, 0.28], 4, 8).png());
    s.glossy_picture("wood", "textures/planks.png", [1.5, 1.1], 0.25);
    s.matt("wall", [0.5, 0.53, 0.54]);
    s.matt("cloth", [0.78, 0.74, 0.66]);
    s.glossy("lacquer", [0.06, 0.06, 0.07], 0.15);
    s.glass("glass");
    s.metal("silver", Metal::Silver, 0.0);
    s.metal("brass", Metal::Brass, 0.15);
    s.matt("bulb-holder", [0.7, 0.7, 0.7]);

    s.matt("red", [0.52, 0.11, 0.09]);
    s.matt("green", [0.13, 0.3, 0.22]);
    s.matt("cream", [0.7, 0.62, 0.47]);

    // A small closed room round the table.
    s.put("room", "wall", slab([-1.5, -0.75, -1.05], [1.5, 2.0, -0.95]));
    s.put("room", "wall", slab([-1.55, -0.75, -1.0], [-1.45, 2.0, 1.5]));
    s.put("room", "wall", slab([1.45, -0.75, -1.0], [1.55, 2.0, 1.5]));
    s.put("room", "wall", slab([-1.5, -0.75, 1.45], [1.5, 2.0, 1.55]));
    s.put("room", "wall", slab([-1.5, 1.95, -1.0], [1.5, 2.05, 1.5]));
    s.put("room", "wall", slab([-1.5, -0.8, -1.0], [1.5, -0.7, 1.5]));
    s.put("table", "wood", block([-0.75, -0.04, -0.45], [0.75, 0.0, 0.5], 0.006));
    s.put("cloth", "cloth", block([-0.36, 0.0, -0.2], [0.36, 0.002, 0.24], 0.001).turned(4.0));

    s.put("goblet", "glass", goblet().at(-0.1, 0.0022, -0.02));
    s.put("egg", "glass", egg().at(0.04, 0.0022, 0.09));
    s.put("ball", "glass", ball(0.042, 26).at(0.135, 0.0442, -0.03));
    // A napkin ring: the inside of a mirror cylinder makes the classic heart-shaped caustic.
    let ring =
        [[0.04, 0.0], [0.042, 0.002], [0.042, 0.024], [0.04, 0.026], [0.039, 0.024], [0.039, 0.002], [0.04, 0.0]];
    s.put("ring", "silver", lathe(&ring, 64).at(-0.19, 0.0025, 0.1));

    // Books and a brass bowl behind.
    for (k, name) in ["red", "green", "cream"].into_iter().enumerate() {
        let book = block([-0.11, 0.0, -0.075], [0.11, 0.03, 0.075], 0.004).turned(-8.0 + 11.0 * k as f64);
        s.put(&format!("book-{name}"), name, book.at(0.25, 0.0305 * k as f64, -0.3));
    }
    s.put("bowl", "brass", bowl().scaled(0.5, 0.5, 0.5).at(0.25, 0.0915, -0.3));

    // A desk lamp whose small bulb looks down through the mouth of its shade.
    let base = [[0.0, 0.0], [0.065, 0.0], [0.065, 0.008], [0.05, 0.016], [0.012, 0.02], [0.006, 0.03], [0.006, 0.12]];
    s.put("lamp-stand", "brass", lathe(&base, 32).at(-0.36, 0.002, -0.25));
    let arm = curve(&[[-0.36, 0.12, -0.25], [-0.36, 0.23, -0.25], [-0.335, 0.3, -0.235], [-0.272, 0.29, -0.2]], 8);
    s.put("lamp-stand", "brass", tube(&arm, 14, |_| 0.006));
    let mut p = curve(&[[0.055, -0.03], [0.05, 0.0], [0.03, 0.035], [0.012, 0.045]], 5);
    p.push([0.0, 0.045]);
    let mut inside = curve(&[[0.01, 0.041], [0.028, 0.032], [0.048, -0.001], [0.0535, -0.03]], 5);
    inside.insert(0, [0.0, 0.041]);
    p.splice(0..0, inside);
    let aim = |m: Mesh| m.rolled(46.0).turned(-38.0).at(-0.25, 0.265, -0.19);
    s.put("shade", "lacquer", aim(lathe(&p, 40)));
    s.put("bulb-holder", "bulb-holder", aim(cylinder(0.009, 0.03, 20).at(0.0, 0.01, 0.0)));
    s.lamp("bulb", aim(disc_down(0.009, 24).at(0.0, 0.0095, 0.0)), [1700.0, 1450.0, 1080.0]);
    // A dim lamp under the ceiling, so that the room is not black.
    s.lamp("ceiling-lamp", disc_down(0.25, 32).at(0.5, 1.945, 0.9), [20.0, 22.0, 26.0]);
    s
}
