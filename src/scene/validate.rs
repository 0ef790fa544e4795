//! Checks of a whole scene that no single element shows: nothing to see, nothing that shines, an empty film.

use super::boundaries;
use super::desc::{EmitterKind, MeshDesc, MeshId, ProjectorDesc, SceneDesc, ShapeDesc, ShapeGeometry};
use super::diag::{Diagnostic, Diagnostics, Span};
use super::medium::VolumeDesc;
use glam::DMat4;
use rayon::prelude::*;

/// Checks `scene` and adds what is wrong to `out`: no sensor, no shapes, an empty film, a crop outside the film,
/// vertices that are not finite, indices out of range and transforms that cannot be inverted are errors; a scene
/// without light, triangles without area (which `prepared` leaves out) and media with open boundaries are warnings.
pub fn validate(scene: &SceneDesc, out: &mut Diagnostics) {
    sensors(scene, out);
    let all: Vec<&ShapeDesc> = scene.shapes.iter().chain(scene.groups.iter().flat_map(|g| &g.shapes)).collect();
    let placed =
        scene.instances.iter().any(|i| scene.groups.get(i.group.index()).is_some_and(|g| !g.shapes.is_empty()));
    if scene.shapes.is_empty() && !placed {
        out.push(Diagnostic::error("scene::empty", "the scene has no shapes: there is nothing to see"));
    }
    let shines = !scene.emitters.is_empty() || scene.shapes.iter().any(|s| s.emission.is_some());
    if !shines {
        out.push(Diagnostic::warning(
            "scene::no-emitter",
            "nothing in the scene emits light: the picture will be black",
        ));
    }
    for shape in &all {
        transform(&shape.to_world, "shape", shape.span.as_ref(), out);
    }
    for instance in &scene.instances {
        transform(&instance.to_world, "instance", instance.span.as_ref(), out);
    }
    for emitter in &scene.emitters {
        if let EmitterKind::Spot { to_world, .. }
        | EmitterKind::Projector(ProjectorDesc { to_world, .. })
        | EmitterKind::Envmap { to_world, .. }
        | EmitterKind::SunSky { to_world, .. } = &emitter.kind
        {
            transform(to_world, "emitter", emitter.span.as_ref(), out);
        }
    }
    for medium in &scene.media {
        for volume in [&medium.sigma_t, &medium.albedo] {
            if let VolumeDesc::Grid(grid) = volume {
                transform(&grid.to_world, "volume", medium.span.as_ref(), out);
            }
        }
    }
    meshes(scene, &all, out);
    boundaries::media(scene, out);
}

fn sensors(scene: &SceneDesc, out: &mut Diagnostics) {
    if scene.sensors.is_empty() {
        let d = Diagnostic::error("scene::no-sensor", "the scene has no camera");
        out.push(d.help("add a <sensor type=\"perspective\">"));
    }
    for sensor in &scene.sensors {
        transform(&sensor.to_world, "sensor", sensor.span.as_ref(), out);
        let film = &sensor.film;
        let span = film.span.clone().or_else(|| sensor.span.clone());
        if film.width == 0 || film.height == 0 {
            let message = format!("a film of {} x {} pixels has no room for a picture", film.width, film.height);
            out.push(Diagnostic::error("scene::empty-film", message).at(span));
        } else if let Some([x, y, width, height]) = film.crop {
            let inside = |offset: u32, size: u32, whole: u32| {
                size > 0 && u64::from(offset) + u64::from(size) <= u64::from(whole)
            };
            if !inside(x, width, film.width) || !inside(y, height, film.height) {
                let message = format!(
                    "the crop of {width} x {height} pixels at ({x}, {y}) is empty or outside the film of {} x {}",
                    film.width, film.height
                );
                out.push(Diagnostic::error("scene::crop-outside", message).at(span));
            }
        }
    }
}

fn transform(m: &DMat4, what: &str, span: Option<&Span>, out: &mut Diagnostics) {
    let problem = if !m.is_finite() {
        "is not finite"
    } else if m.row(3).abs_diff_eq(glam::DVec4::W, 1e-9) {
        // The determinant alone says nothing: it is tiny for small scales. Compare it with what orthogonal axes of
        // these lengths have.
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|a| a.truncate().length());
        if m.determinant().abs() > 1e-10 * x * y * z { return } else { "cannot be inverted: it makes everything flat" }
    } else {
        "is not affine: its last row must be 0 0 0 1"
    };
    out.push(
        Diagnostic::error("scene::bad-transform", format!("the transform of this {what} {problem}")).at(span.cloned()),
    );
}

fn meshes(scene: &SceneDesc, shapes: &[&ShapeDesc], out: &mut Diagnostics) {
    let span_of = |mesh: usize| {
        shapes.iter().find(|s| s.geometry == ShapeGeometry::Mesh(MeshId(mesh as u32))).and_then(|s| s.span.clone())
    };
    let (mut flat, mut first_flat) = (0u64, None);
    for (index, mesh) in scene.meshes.iter().enumerate() {
        if let Some(v) = first_broken_vertex(mesh) {
            let message = format!("`{}`: vertex {v} is not finite", mesh.name);
            out.push(Diagnostic::error("scene::bad-mesh", message).at(span_of(index)));
            continue;
        }
        if let Some(t) = first_broken_triangle(mesh) {
            let message = format!("`{}`: triangle {t} names a vertex that is not there", mesh.name);
            out.push(Diagnostic::error("scene::bad-mesh", message).at(span_of(index)));
            continue;
        }
        let n = mesh.positions.len();
        for (what, length) in
            [("normals", mesh.normals.len()), ("texture coordinates", mesh.uvs.len()), ("colours", mesh.colors.len())]
        {
            if length != 0 && length != n {
                let message = format!("`{}`: {length} {what} for {n} vertices", mesh.name);
                out.push(Diagnostic::error("scene::bad-mesh", message).at(span_of(index)));
            }
        }
        let (count, first) = flat_triangles(mesh);
        if count > 0 {
            flat += count;
            first_flat.get_or_insert((index, first));
        }
    }
    if let Some((mesh, triangle)) = first_flat {
        let name = &scene.meshes[mesh].name;
        let message =
            format!("{flat} triangles have no area and are left out; the first is triangle {triangle} of `{name}`");
        out.push(Diagnostic::warning("scene::flat-triangles", message).at(span_of(mesh)));
    }
}

/// Vertices or triangles that one task looks at: parallel per chunk, so that the loop over its items stays a plain one.
const CHUNK: usize = 1 << 15;

fn first_broken_vertex(mesh: &MeshDesc) -> Option<usize> {
    let sound = mesh.positions.par_chunks(CHUNK).all(|c| c.iter().all(|p| p.is_finite()));
    if sound { None } else { mesh.positions.iter().position(|p| !p.is_finite()) }
}

fn first_broken_triangle(mesh: &MeshDesc) -> Option<usize> {
    let n = mesh.positions.len();
    let largest =
        mesh.triangles.par_chunks(CHUNK).map(|c| c.iter().fold(0, |m, t| m.max(t[0]).max(t[1]).max(t[2]))).max()?;
    if (largest as usize) < n { None } else { mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= n)) }
}

/// How many triangles have no area, and the first of them.
fn flat_triangles(mesh: &MeshDesc) -> (u64, usize) {
    let is_flat = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        // Products that round to zero in f32 are looked at again in double precision, lest a tiny model vanish.
        (b - a).cross(c - a).length_squared() == 0.0
            && (b - a).as_dvec3().cross((c - a).as_dvec3()).length_squared() == 0.0
    };
    let in_chunk = |(index, chunk): (usize, &[[u32; 3]])| {
        let mut found = (0u64, usize::MAX);
        for (i, t) in chunk.iter().enumerate() {
            if is_flat(t) {
                found = (found.0 + 1, found.1.min(index * CHUNK + i));
            }
        }
        found
    };
    mesh.triangles
        .par_chunks(CHUNK)
        .enumerate()
        .map(in_chunk)
        .reduce(|| (0, usize::MAX), |a, b| (a.0 + b.0, a.1.min(b.1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::scene::{EmitterDesc, FilmDesc, FilterDesc, FovAxis, SensorDesc};
    use glam::Vec3;

    fn sound() -> SceneDesc {
        let film = FilmDesc { width: 8, height: 4, crop: None, filter: FilterDesc::Box, span: None };
        SceneDesc {
            sensors: vec![SensorDesc {
                to_world: DMat4::IDENTITY,
                fov: 40.0,
                fov_axis: FovAxis::X,
                principal_point: [0.0; 2],
                near_clip: 0.01,
                far_clip: 100.0,
                aperture_radius: 0.0,
                focus_distance: 1.0,
                medium: None,
                film,
                sample_count: None,
                span: None,
            }],
            meshes: vec![MeshDesc {
                name: "one".into(),
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
                triangles: vec![[0, 1, 2]],
                ..MeshDesc::default()
            }],
            shapes: vec![ShapeDesc {
                geometry: ShapeGeometry::Mesh(MeshId(0)),
                to_world: DMat4::IDENTITY,
                bsdf: None,
                emission: None,
                interface: None,
                flip_normals: false,
                name: None,
                span: None,
            }],
            emitters: vec![EmitterDesc {
                kind: EmitterKind::Constant { radiance: Rgb::WHITE },
                sampling_weight: 1.0,
                span: None,
            }],
            ..SceneDesc::default()
        }
    }

    fn codes(change: impl FnOnce(&mut SceneDesc)) -> Vec<&'static str> {
        let mut scene = sound();
        change(&mut scene);
        let mut out = Diagnostics::default();
        validate(&scene, &mut out);
        out.list.iter().map(|d| d.code).collect()
    }

    #[test]
    fn a_sound_scene_has_no_messages() {
        assert!(codes(|_| ()).is_empty());
        // Small is not flat.
        assert!(codes(|s| s.shapes[0].to_world = DMat4::from_scale(glam::DVec3::splat(1e-9))).is_empty());
        assert!(codes(|s| s.meshes[0].positions.iter_mut().for_each(|p| *p *= 1e-22)).is_empty());
    }

    #[test]
    fn every_defect_has_its_code() {
        assert_eq!(codes(|s| s.sensors.clear()), ["scene::no-sensor"]);
        assert_eq!(codes(|s| s.shapes.clear()), ["scene::empty"]);
        assert_eq!(codes(|s| s.emitters.clear()), ["scene::no-emitter"]);
        assert_eq!(codes(|s| s.sensors[0].film.width = 0), ["scene::empty-film"]);
        assert_eq!(codes(|s| s.sensors[0].film.crop = Some([4, 0, 5, 4])), ["scene::crop-outside"]);
        assert_eq!(codes(|s| s.sensors[0].film.crop = Some([u32::MAX, 0, 2, 1])), ["scene::crop-outside"]);
        assert!(codes(|s| s.sensors[0].film.crop = Some([4, 0, 4, 4])).is_empty());
        assert_eq!(codes(|s| s.shapes[0].to_world.x_axis *= 0.0), ["scene::bad-transform"]);
        assert_eq!(codes(|s| s.shapes[0].to_world.y_axis = s.shapes[0].to_world.x_axis), ["scene::bad-transform"]);
        assert_eq!(codes(|s| s.shapes[0].to_world.w_axis.x = f64::NAN), ["scene::bad-transform"]);
        assert_eq!(codes(|s| s.shapes[0].to_world.x_axis.w = 0.5), ["scene::bad-transform"]);
        assert_eq!(codes(|s| s.meshes[0].positions[1].y = f32::INFINITY), ["scene::bad-mesh"]);
        assert_eq!(codes(|s| s.meshes[0].triangles.push([0, 1, 3])), ["scene::bad-mesh"]);
        assert_eq!(codes(|s| s.meshes[0].normals.push(Vec3::Z)), ["scene::bad-mesh"]);
    }

    #[test]
    fn flat_triangles_are_counted_and_the_first_named() {
        let mut scene = sound();
        scene.meshes[0].triangles = vec![[0, 1, 2], [1, 1, 2], [0, 0, 0]];
        let mut out = Diagnostics::default();
        validate(&scene, &mut out);
        assert_eq!(out.list.len(), 1);
        assert!(
            out.list[0].message.starts_with("2 triangles") && out.list[0].message.contains("triangle 1 of `one`"),
            "{}",
            out.list[0].message
        );
    }
}
