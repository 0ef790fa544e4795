//! A dark room with the door ajar; the lamp stands in the next room and shines at its ceiling. After the idea of
//! Veach's door scene (1997), with furniture of its own.

use crate::furniture::*;
use crate::scene::{Metal, Scene, at, turned};
use crate::shapes::*;
use crate::texture;

pub fn scene() -> Scene {
    let purpose = "A door ajar and a lamp in the next room: nearly all light is indirect and comes through the gap.";
    let mut s = Scene::new("door", purpose, 24, 1024);
    let fog = "The door scene in thin fog: light that comes through the gap is seen on its way, too.";
    s.foggy("foggy-door", fog, 0.12, 0.95);
    s.camera([-0.95, 1.45, 4.15], [0.3, 1.08, 0.0], 58.0);
    s.file("textures/planks.png", texture::planks([0.56, 0.49, 0.41], [0.8, 0.73, 0.64], 4, 3).png());
    s.file("textures/landscape.png", texture::landscape(21).png());
    s.matt("wall", [0.77, 0.77, 0.76]);
    s.matt("far-wall", [0.78, 0.775, 0.75]);
    s.matt("ceiling", [0.8, 0.8, 0.79]);
    s.glossy_picture("boards", "textures/planks.png", [1.6, 0.7], 0.25);
    s.glossy("paint", [0.77, 0.76, 0.74], 0.2);
    s.glossy("wood", [0.36, 0.19, 0.09], 0.2);
    s.glossy("gilt", [0.55, 0.4, 0.16], 0.2);
    s.matt_picture("landscape", "textures/landscape.png", [1.0, -1.0]);
    s.polished("blue-glaze", [0.1, 0.22, 0.42]);
    s.metal("brass", Metal::Brass, 0.12);
    s.metal("copper", Metal::Copper, 0.06);
    s.glass("glass");
    s.matt("cloth", [0.5, 0.16, 0.12]);

    // Two rooms, z > 0 and z < −0.15, in one shell.
    let (w, h, front, back) = (2.2, 2.7, 4.5, -3.6);
    let opening = [0.62, 1.52];
    s.put("floor", "boards", slab([-w - 0.2, -0.2, back - 0.2], [w + 0.2, 0.0, front + 0.2]));
    s.put("ceiling", "ceiling", slab([-w - 0.2, h, back - 0.2], [w + 0.2, h + 0.2, front + 0.2]));
    s.put("walls", "wall", slab([-w - 0.2, -0.2, -0.08], [-w, h + 0.2, front + 0.2]));
    s.put("walls", "wall", slab([w, -0.2, -0.08], [w + 0.2, h + 0.2, front + 0.2]));
    s.put("walls", "wall", slab([-w - 0.2, -0.2, front], [w + 0.2, h + 0.2, front + 0.2]));
    s.put(
        "walls",
        "wall",
        wall([-w - 0.1, w + 0.1], [-0.1, h + 0.1], [-0.15, 0.0], &[[opening[0], opening[1], 0.0, 2.06]]),
    );
    s.put("far-walls", "far-wall", slab([-w - 0.2, -0.2, back - 0.2], [-w, h + 0.2, -0.08]));
    s.put("far-walls", "far-wall", slab([w, -0.2, back - 0.2], [w + 0.2, h + 0.2, -0.08]));
    s.put("far-walls", "far-wall", slab([-w - 0.2, -0.2, back - 0.2], [w + 0.2, h + 0.2, back]));

    for (z, t) in [(0.0, 0.018), (front - 0.018, 0.018)] {
        let gap = if z == 0.0 { opening } else { [0.0, 0.0] };
        s.put("trim", "paint", block([-w, 0.0, z], [gap[0] - 0.09, 0.11, z + t], 0.006));
        s.put("trim", "paint", block([gap[1] + 0.09, 0.0, z], [w, 0.11, z + t], 0.006));
    }
    s.put("trim", "paint", block([-w, 0.0, 0.0], [-w + 0.018, 0.11, front], 0.006));
    s.put("trim", "paint", block([w - 0.018, 0.0, 0.0], [w, 0.11, front], 0.006));
    s.put("trim", "paint", casing(opening, [0.0, 2.06], [0.0, 0.025]));
    s.put("trim", "paint", casing(opening, [0.0, 2.06], [-0.175, -0.15]));

    // Hinged on the left, ajar into this room: the camera looks at the dark side of the leaf, past which the light
    // falls on the wall to its right.
    let ajar = |m: crate::mesh::Mesh| m.turned(-45.0).at(opening[0] + 0.005, 0.008, -0.03);
    s.put("door", "paint", ajar(door_leaf(0.88, 2.04)));
    s.put("handle", "brass", ajar(door_handle(0.88)));

    s.put("table", "wood", table(1.35, 0.76, 0.62, true).at(-0.75, 0.0, 0.48));
    s.put("runner", "cloth", block([-1.1, 0.758, 0.32], [-0.4, 0.764, 0.66], 0.002));
    s.put("teapot", "blue-glaze", teapot().scaled(1.25, 1.25, 1.25).turned(25.0).at(-0.78, 0.764, 0.5));
    s.put("vase", "copper", vase().scaled(1.1, 1.1, 1.1).at(-1.22, 0.76, 0.4));
    s.put("carafe", "glass", ball(0.085, 20).at(-0.3, 0.845, 0.56));
    s.put("bowl", "brass", bowl().scaled(0.8, 0.8, 0.8).at(-0.5, 0.764, 0.36));
    s.put("chair", "wood", chair().turned(-115.0).at(-1.55, 0.0, 1.35));
    s.put("frame", "gilt", frame(0.9, 0.6).at(-0.75, 1.62, 0.0));
    s.put("painting", "landscape", canvas(0.9, 0.6).at(-0.75, 1.62, 0.0));

    // An uplighter behind the wall, out of sight: its light reaches this room from that room's ceiling and walls.
    let shade = curve(&[[0.03, 1.58], [0.1, 1.61], [0.14, 1.7], [0.16, 1.86]], 4);
    let mut p = vec![[0.0, 0.0], [0.16, 0.0], [0.16, 0.02], [0.015, 0.04], [0.015, 1.58]];
    p.extend(&shade);
    p.extend(shade.iter().rev().map(|&[r, y]| [r - 0.006, y + 0.004]));
    p.push([0.0, 1.59]);
    s.define("uplighter", lathe(&p, 28));
    s.place("uplighter", "brass", at(-0.2, 0.0, -1.3));
    s.lamp("lamp", disc_up(0.09, 24).at(-0.2, 1.64, -1.3), [30000.0, 28000.0, 25000.0]);
    s.define("chair-2", chair());
    s.place("chair-2", "wood", turned(-20.0, 1.7, 0.0, -2.9));
    s
}
