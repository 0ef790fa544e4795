//! One number for everything in a prepared scene that the picture depends on, so that a checkpoint of another scene
//! is recognised.

use crate::emit::Light;
use crate::math::Rgb;
use crate::math::hash::mix64;
use crate::math::warp::square_to_sphere;
use crate::prepared::PreparedScene;
use std::fmt::{Debug, Write};

/// Directions per side in which an environment is looked at.
const DIRECTIONS: u32 = 32;

/// Hash of `scene`; equal for equal scenes in every run.
pub fn scene_hash(scene: &PreparedScene) -> u64 {
    let mut h = Hasher(0);
    for mesh in &scene.geometry.meshes {
        h.add(mesh.positions.len() as u64);
        for p in mesh.positions.iter() {
            h.floats(&p.to_array());
        }
        for t in &mesh.triangles {
            h.add(u64::from(t[0]) | u64::from(t[1]) << 32);
            h.add(u64::from(t[2]));
        }
    }
    for mesh in &scene.meshes {
        mesh.normals.iter().for_each(|n| h.floats(&n.to_array()));
        mesh.uvs.iter().for_each(|uv| h.floats(&uv.to_array()));
        mesh.colors.iter().for_each(|c| h.rgb(*c));
        h.debug(&(mesh.material, mesh.first_light));
    }
    h.debug(&scene.geometry.round);
    for i in &scene.geometry.instances {
        h.add(u64::from(i.group));
        h.floats(&i.to_world.to_cols_array());
    }
    h.debug(&(&scene.geometry.world, &scene.geometry.groups));
    for (_, light) in scene.lights.iter() {
        h.floats(&[light.power()]);
        match light {
            // Their places are hashed with their surfaces.
            Light::Triangle(_) | Light::Round(_) => {}
            Light::Environment(_) => environment(light, &mut h),
            other => h.debug(other),
        }
    }
    // Materials, camera and filter have no canonical bytes; their debug form changes when they do.
    h.debug(&scene.materials);
    h.debug(&scene.camera);
    h.debug(&scene.filter);
    h.0
}

/// An environment may be a large picture: a thousand looks at it tell two of equal power apart.
fn environment(light: &Light, h: &mut Hasher) {
    let u = |i: u32| (i as f32 + 0.5) / DIRECTIONS as f32;
    for y in 0..DIRECTIONS {
        for x in 0..DIRECTIONS {
            h.rgb(light.emitted([0.0; 2], square_to_sphere([u(x), u(y)])));
        }
    }
}

struct Hasher(u64);

impl Hasher {
    fn add(&mut self, word: u64) {
        self.0 = mix64(self.0.rotate_left(5) ^ word);
    }

    fn floats(&mut self, values: &[f32]) {
        values.iter().for_each(|v| self.add(u64::from(v.to_bits())));
    }

    fn rgb(&mut self, c: Rgb) {
        self.floats(&c.to_array());
    }

    fn debug(&mut self, value: &dyn Debug) {
        // Writing into a hash does not fail.
        let _ = write!(self, "{value:?}");
    }
}

impl Write for Hasher {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.add(text.len() as u64);
        for chunk in text.as_bytes().chunks(8) {
            self.add(chunk.iter().fold(0, |word, &b| word << 8 | u64::from(b)));
        }
        Ok(())
    }
}
