//! `lightsieve info --skeleton`: the skeleton of empty space as lines in a file, and drawn over the camera's view.

use super::Failure;
use crate::image::{Layer, Picture, atomic_write, write_picture};
use crate::math::{Rgb, Vec3, hash::mix64};
use crate::prepared::PreparedScene;
use crate::ray::Ray;
use crate::skeleton::Skeleton;
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::Path;

/// A kind of file that lines can be written to.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LineFormat {
    /// Stanford PLY with edges.
    Ply,
    /// Wavefront OBJ with lines.
    Obj,
}

impl LineFormat {
    /// The format that the ending names.
    pub fn of(path: &Path) -> Result<LineFormat, Failure> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match ending.as_str() {
            "ply" => Ok(LineFormat::Ply),
            "obj" => Ok(LineFormat::Obj),
            _ => Err(Failure::Input(format!(
                "{}: the ending does not name a known format (known: .ply, .obj)",
                path.display()
            ))),
        }
    }
}

/// Writes nodes (with their radii in PLY) and edges in the coordinates of the scene file.
pub(crate) fn write_lines(path: &Path, skeleton: &Skeleton, scene: &PreparedScene) -> Result<(), Failure> {
    let format = LineFormat::of(path)?;
    let text = match format {
        LineFormat::Ply => ply(skeleton, scene),
        LineFormat::Obj => obj(skeleton, scene),
    };
    atomic_write(path, |w: &mut dyn Write| -> io::Result<()> { w.write_all(text.as_bytes()) })
        .map_err(|e| Failure::Io(format!("{}: cannot be written: {e}", path.display())))
}

fn ply(skeleton: &Skeleton, scene: &PreparedScene) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment nodes and edges of a skeleton of empty space\n\
         element vertex {}\nproperty double x\nproperty double y\nproperty double z\nproperty float radius\n\
         element edge {}\nproperty int vertex1\nproperty int vertex2\nend_header\n",
        skeleton.nodes.len(),
        skeleton.edges.len()
    );
    for node in &skeleton.nodes {
        let p = scene.position_in_file(node.position);
        text += &format!("{} {} {} {}\n", p.x, p.y, p.z, f64::from(node.radius) * scene.unit);
    }
    for [a, b] in &skeleton.edges {
        text += &format!("{a} {b}\n");
    }
    text
}

fn obj(skeleton: &Skeleton, scene: &PreparedScene) -> String {
    let mut text = String::from("# nodes and edges of a skeleton of empty space\n");
    for node in &skeleton.nodes {
        let p = scene.position_in_file(node.position);
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for [a, b] in &skeleton.edges {
        text += &format!("l {} {}\n", a + 1, b + 1);
    }
    text
}

/// A picture that is drawn into.
struct Canvas {
    size: [u32; 2],
    pixels: Vec<Rgb>,
    /// Distance from the camera; infinite where nothing is.
    depth: Vec<f32>,
}

impl Canvas {
    /// A square of `2 · reach + 1` pixels around a point of the scene; faint where something is in front of it.
    fn dot(&mut self, scene: &PreparedScene, p: Vec3, reach: i64, colour: Rgb) {
        let Some(lens) = scene.camera.sample_lens(p, [0.5; 2]) else { return };
        let [x, y] = lens.raster.map(|c| c.floor() as i64);
        for (x, y) in (y - reach..=y + reach).flat_map(|y| (x - reach..=x + reach).map(move |x| (x, y))) {
            let inside = x >= 0 && y >= 0 && x < self.size[0].into() && y < self.size[1].into();
            if inside {
                let i = (x + y * i64::from(self.size[0])) as usize;
                let strength = if lens.distance < self.depth[i] { 1.0 } else { 0.35 };
                self.pixels[i] = self.pixels[i] * (1.0 - strength) + colour * strength;
            }
        }
    }
}

/// Draws the camera's view with a tint for each node that surfaces belong to (dark red: none), over it the edges in
/// orange and the nodes in blue; what is behind something is faint.
pub(crate) fn write_image(path: &Path, scene: &PreparedScene, skeleton: &Skeleton) -> Result<(), Failure> {
    let mut canvas = view(scene, skeleton);
    for [a, b] in &skeleton.edges {
        let [a, b] = [a, b].map(|&k| skeleton.nodes[k as usize].position);
        let mut last = None;
        for k in 0..=1000 {
            let p = a.lerp(b, k as f32 / 1000.0);
            let at = scene.camera.sample_lens(p, [0.5; 2]).map(|s| s.raster.map(f32::floor));
            if at != last {
                canvas.dot(scene, p, 0, Rgb::new(1.0, 0.25, 0.0));
                last = at;
            }
        }
    }
    for node in &skeleton.nodes {
        canvas.dot(scene, node.position, 1, Rgb::new(0.0, 0.15, 1.0));
    }
    let channel = |c: usize| canvas.pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
    let channels = vec![("R", channel(0)), ("G", channel(1)), ("B", channel(2))];
    let layers = vec![Layer { name: String::new(), channels }];
    let picture = Picture { width: canvas.size[0], height: canvas.size[1], layers, metadata: vec![] };
    write_picture(path, &picture, 0.0).map_err(Failure::io)
}

/// A pale colour that neighbours in number do not share.
fn tint(node: usize) -> Rgb {
    let bits = mix64(node as u64);
    Rgb::from([0, 8, 16].map(|shift| 0.45 + 0.55 * ((bits >> shift & 255) as f32 / 255.0)))
}

/// Surfaces, lighter the more they face the camera and the nearer they are.
fn view(scene: &PreparedScene, skeleton: &Skeleton) -> Canvas {
    let size = scene.film_size;
    let pixel = |i: u32| {
        let raster = [(i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5];
        let eye = scene.camera.sample_ray(raster, [0.5; 2]);
        let ray = Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far };
        let hit = if ray.is_valid() { scene.query.closest(&ray) } else { None };
        let Some(hit) = hit else { return (Rgb::grey(0.02), f32::INFINITY) };
        let (point, _) = scene.surface_point(&hit);
        let facing = point.frame.n.dot(ray.d).abs();
        let fog = 1.0 / (1.0 + hit.t / scene.radius);
        let normal = if point.ng.dot(ray.d) > 0.0 { -point.ng } else { point.ng };
        let tint = skeleton.node_of(point.p, normal).map_or(Rgb::new(0.3, 0.0, 0.0), tint);
        (tint * ((0.1 + 0.5 * facing) * fog), hit.t)
    };
    let (pixels, depth) = (0..size[0] * size[1]).into_par_iter().map(pixel).unzip();
    Canvas { size, pixels, depth }
}
