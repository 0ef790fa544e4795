//! The Cornell box: the measured proportions of the original (Cornell University Program of Computer Graphics),
//! rounded.

use crate::scene::Scene;
use crate::shapes::{block, quad, slab, v3};

pub fn scene() -> Scene {
    let mut s = Scene::new("cornell", "The simple case, which must stay cheap: a box, two blocks, one lamp.", 16, 128);
    s.film(512, 512);
    s.camera([0.0, 2.74, 13.6], [0.0, 2.74, 0.0], 29.2);
    s.matt("white", [0.73, 0.71, 0.68]);
    s.matt("red", [0.61, 0.06, 0.05]);
    s.matt("green", [0.13, 0.44, 0.09]);
    let (w, h, d, t) = (2.78, 5.48, 2.8, 0.1);
    s.put("floor", "white", slab([-w - t, -t, -d - t], [w + t, 0.0, d]));
    s.put("ceiling", "white", slab([-w - t, h, -d - t], [w + t, h + t, d]));
    s.put("back", "white", slab([-w - t, 0.0, -d - t], [w + t, h, -d]));
    s.put("left", "red", slab([-w - t, 0.0, -d], [-w, h, d]));
    s.put("right", "green", slab([w, 0.0, -d], [w + t, h, d]));
    s.put(
        "tall-block",
        "white",
        block([-0.82, 0.0, -0.82], [0.82, 3.3, 0.82], 0.02).turned(17.0).at(-0.93, 0.0, -0.72),
    );
    s.put(
        "short-block",
        "white",
        block([-0.82, 0.0, -0.82], [0.82, 1.65, 0.82], 0.02).turned(-17.0).at(0.92, 0.0, 1.1),
    );
    let (a, b, y) = (0.65, 0.525, h - 0.005);
    s.lamp("lamp", quad(v3(-a, y, -b), v3(a, y, -b), v3(a, y, b), v3(-a, y, b)), [36.0, 30.0, 21.0]);
    s
}
