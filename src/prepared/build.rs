//! Building a [`PreparedScene`]: place, clean, centre, and hand each part to the room that knows it.

use super::{Features, MeshShading, PreparedScene, TriangleTable};
use crate::emit::{
    Camera, DirectionalLight, EmitError, EnvMap, Environment, EnvironmentLight, Light, LightSet, PixelFilter,
    PointLight, RadianceTexture, SpotLight, SunSky, SunSkyParams, TexturedEmission, TriangleEmission, TriangleLight,
};
use crate::math::{DVec3, Rgb, Vec2, Vec3};
use crate::ray::{Backend, Geometry, Instance, MeshBuffers, QueryError, VertexBuffer};
use crate::scene::{
    AreaEmission, BsdfId, ColorDesc, Diagnostic, Diagnostics, EmitterDesc, EmitterKind, ImageDesc, MeshDesc, SceneDesc,
    ShapeDesc,
};
use crate::shade::{ColorTexture, MaterialSet, SurfacePoint, TextureSet};
use glam::{Affine3A, DMat3, DMat4, Mat3A};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;

/// Options of preparing.
#[derive(Clone, Debug)]
pub struct PrepareOptions {
    /// Who answers questions about rays.
    pub backend: Backend,
    /// Threads for building the tree.
    pub threads: usize,
    /// Picture size instead of the file's.
    pub size: Option<[u32; 2]>,
    /// Part to render instead of the file's: x, y, width, height.
    pub crop: Option<[u32; 4]>,
}

/// Why a scene cannot be prepared.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// The scene has no camera.
    #[error("the scene has no camera")]
    NoCamera,
    /// The picture has no pixels, or the crop window leaves it.
    #[error("{0}")]
    Film(String),
    /// A camera or light is impossible.
    #[error(transparent)]
    Emit(#[from] EmitError),
    /// The ray-query backend failed.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// Materials are impossible; the diagnostics say which.
    #[error("the scene's materials cannot be used")]
    Materials,
}

impl PreparedScene {
    /// Prepares a scene; what was dropped or replaced on the way goes to `diagnostics`.
    ///
    /// # Errors
    /// See [`PrepareError`].
    pub fn build(
        mut desc: SceneDesc,
        options: &PrepareOptions,
        diagnostics: &mut Diagnostics,
    ) -> Result<PreparedScene, PrepareError> {
        let mut sensor = desc.sensors.first().cloned().ok_or(PrepareError::NoCamera)?;
        if let Some([width, height]) = options.size {
            (sensor.film.width, sensor.film.height, sensor.film.crop) = (width, height, None);
        }
        sensor.film.crop = options.crop.or(sensor.film.crop);
        let film_size = [sensor.film.width, sensor.film.height];
        let window = window(film_size, sensor.film.crop)?;

        let textures = TextureSet::build(&desc.textures, &desc.images, diagnostics);
        let materials = MaterialSet::build(&desc.bsdfs, &textures, diagnostics);
        if diagnostics.has_errors() {
            return Err(PrepareError::Materials);
        }

        let centre = centre(&desc);
        let mut placer = Placer { meshes: std::mem::take(&mut desc.meshes), uses: vec![], parts: vec![] };
        placer.count_uses(&desc);
        let mut geometry = Geometry::default();
        let to_origin = DMat4::from_translation(-centre);
        let mut emission: Vec<Option<AreaEmission>> = vec![];
        for shape in &desc.shapes {
            geometry.world.push(emission.len() as u32);
            emission.push(shape.emission.clone());
            placer.place(shape, to_origin * shape.to_world, &materials);
        }
        for group in &desc.groups {
            let mut ids = vec![];
            for shape in &group.shapes {
                ids.push(emission.len() as u32);
                emission.push(None);
                if shape.emission.is_some() {
                    let d = Diagnostic::warning(
                        "scene::emitter-in-group",
                        "a shape of a shapegroup cannot emit; its light is ignored",
                    );
                    diagnostics.push(d.at(shape.span.clone()));
                }
                placer.place(shape, shape.to_world, &materials);
            }
            geometry.groups.push(ids);
        }
        let mut instance_normals = vec![];
        for instance in &desc.instances {
            let (to_world, normals) = affine(to_origin * instance.to_world);
            geometry.instances.push(Instance { group: instance.group.0, to_world });
            instance_normals.push(normals);
        }

        let (meshes, removed): (Vec<_>, Vec<_>) = placer.finish();
        // Validation names them where it can; what only its place has flattened is named here.
        let named = diagnostics.list.iter().any(|d| d.code == "scene::flat-triangles");
        for (name, count) in removed.into_iter().filter(|&(_, n)| n > 0 && !named) {
            let message = format!("{count} triangles of {name} have no area and were removed");
            diagnostics.push(Diagnostic::warning("mesh::degenerate", message));
        }
        let mut shading = Vec::with_capacity(meshes.len());
        for (buffers, mesh) in meshes {
            geometry.meshes.push(buffers);
            shading.push(mesh);
        }
        let (lo, hi) = geometry.bounds().unwrap_or((Vec3::ZERO, Vec3::ZERO));
        let radius = lo.abs().max(hi.abs()).length();

        let mut lights = vec![];
        for (i, emission) in emission.iter().enumerate() {
            if let Some(emission) = emission {
                shading[i].first_light = Some(lights.len() as u32);
                triangle_lights(&geometry.meshes[i], &shading[i], emission, &textures, &mut lights);
            }
        }
        for emitter in &desc.emitters {
            emitter_lights(emitter, &desc.images, centre, radius, &mut lights)?;
        }
        let lights = LightSet::new(lights);

        let camera = Camera::new(&sensor, centre)?;
        let features =
            features(&desc, &sensor, &materials, &lights, &shading, window != [0, 0, film_size[0], film_size[1]]);
        let geometry = Arc::new(geometry);
        let start = Instant::now();
        let query = options.backend.build(geometry.clone(), options.threads)?;
        Ok(PreparedScene {
            query,
            triangles: TriangleTable::new(&geometry, &shading),
            geometry,
            meshes: shading,
            instance_normals,
            materials,
            lights,
            camera,
            filter: PixelFilter::new(sensor.film.filter),
            film_size,
            window,
            centre,
            radius,
            features,
            tree_seconds: start.elapsed().as_secs_f64(),
        })
    }
}

/// The part to render.
fn window([width, height]: [u32; 2], crop: Option<[u32; 4]>) -> Result<[u32; 4], PrepareError> {
    if width == 0 || height == 0 {
        return Err(PrepareError::Film(format!("a picture of {width} x {height} pixels has nothing to render")));
    }
    if u64::from(width) * u64::from(height) > 1 << 31 {
        return Err(PrepareError::Film(format!("a picture of {width} x {height} pixels is too large")));
    }
    let Some([x, y, w, h]) = crop else { return Ok([0, 0, width, height]) };
    let inside = |at: u32, size: u32, all: u32| size > 0 && at.checked_add(size).is_some_and(|end| end <= all);
    if inside(x, w, width) && inside(y, h, height) {
        Ok([x, y, w, h])
    } else {
        Err(PrepareError::Film(format!(
            "the crop window {x},{y},{w},{h} leaves the picture of {width} x {height} pixels"
        )))
    }
}

/// Centre of the box around everything, in double precision.
fn centre(desc: &SceneDesc) -> DVec3 {
    let mut bounds: Option<(DVec3, DVec3)> = None;
    let mut grow = |shape: &ShapeDesc, outer: DMat4| {
        let Some(mesh) = desc.meshes.get(shape.mesh.index()) else { return };
        if mesh.positions.is_empty() {
            return;
        }
        // The corners of the object's box bound the placed object; tightness does not matter for a centre.
        let (lo, hi) = mesh
            .positions
            .par_iter()
            .fold(|| (Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)))
            .reduce(|| (Vec3::INFINITY, Vec3::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        for i in 0..8 {
            let pick = |bit: u32, lo: f32, hi: f32| f64::from(if i >> bit & 1 == 0 { lo } else { hi });
            let corner = DVec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z));
            let p = (outer * shape.to_world).transform_point3(corner);
            if p.is_finite() {
                let (lo, hi) = bounds.unwrap_or((p, p));
                bounds = Some((lo.min(p), hi.max(p)));
            }
        }
    };
    for shape in &desc.shapes {
        grow(shape, DMat4::IDENTITY);
    }
    for instance in &desc.instances {
        for shape in desc.groups.get(instance.group.index()).map_or(&[][..], |g| &g.shapes) {
            grow(shape, instance.to_world);
        }
    }
    bounds.map_or(DVec3::ZERO, |(lo, hi)| 0.5 * (lo + hi))
}

fn affine(m: DMat4) -> (Affine3A, Mat3A) {
    let linear = DMat3::from_mat4(m);
    let single =
        |m: DMat3| Mat3A::from_cols(m.x_axis.as_vec3().into(), m.y_axis.as_vec3().into(), m.z_axis.as_vec3().into());
    let to_world = Affine3A { matrix3: single(linear), translation: m.w_axis.truncate().as_vec3().into() };
    (to_world, single(linear.inverse().transpose()))
}

/// A mesh in its place, cut into what rays and what shading need.
type PlacedMesh = (MeshBuffers, MeshShading);

/// A mesh on its way to its place.
struct Part {
    mesh: MeshDesc,
    to_place: DMat4,
    flip: bool,
    material: Option<BsdfId>,
    wants_tangents: bool,
    wants_uvs: bool,
    wants_colors: bool,
}

/// Hands out meshes: the last user of a mesh takes it over, earlier ones copy it.
struct Placer {
    meshes: Vec<MeshDesc>,
    uses: Vec<u32>,
    parts: Vec<Part>,
}

impl Placer {
    fn count_uses(&mut self, desc: &SceneDesc) {
        self.uses = vec![0; self.meshes.len()];
        for shape in desc.shapes.iter().chain(desc.groups.iter().flat_map(|g| &g.shapes)) {
            if let Some(n) = self.uses.get_mut(shape.mesh.index()) {
                *n += 1;
            }
        }
    }

    fn place(&mut self, shape: &ShapeDesc, to_place: DMat4, materials: &MaterialSet) {
        let i = shape.mesh.index();
        let mesh = match self.uses.get_mut(i) {
            Some(1) => std::mem::take(&mut self.meshes[i]),
            Some(n) => {
                *n -= 1;
                self.meshes[i].clone()
            }
            None => MeshDesc::default(),
        };
        let material = shape.bsdf;
        let wants = materials.get(material).features();
        let emission_textured = shape.emission.as_ref().is_some_and(|e| matches!(e.radiance, ColorDesc::Texture(_)));
        self.parts.push(Part {
            mesh,
            to_place,
            flip: shape.flip_normals,
            material,
            wants_tangents: wants.oriented,
            wants_uvs: wants.textured || wants.oriented || emission_textured,
            wants_colors: wants.textured,
        });
    }

    /// Every mesh in its place, and how many triangles of which mesh had no area.
    fn finish(self) -> (Vec<PlacedMesh>, Vec<(String, usize)>) {
        self.parts
            .into_par_iter()
            .map(|part| {
                let name = part.mesh.name.clone();
                let (placed, removed) = place(part);
                (placed, (name, removed))
            })
            .unzip()
    }
}

/// Moves a mesh to its place, drops triangles without area, and turns triangles so that their winding agrees with the vertex
/// normals (the side of a surface is the side of its geometric normal everywhere after this).
fn place(part: Part) -> (PlacedMesh, usize) {
    let Part { mut mesh, to_place, flip, material, wants_tangents, wants_uvs, wants_colors } = part;
    if to_place != DMat4::IDENTITY {
        mesh.positions.par_iter_mut().for_each(|p| *p = to_place.transform_point3(p.as_dvec3()).as_vec3());
        let normal_map = DMat3::from_mat4(to_place).inverse().transpose();
        mesh.normals.par_iter_mut().for_each(|n| *n = (normal_map * n.as_dvec3()).normalize_or_zero().as_vec3());
    }
    if flip {
        mesh.normals.par_iter_mut().for_each(|n| *n = -*n);
        mesh.triangles.par_iter_mut().for_each(|t| t.swap(1, 2));
    }
    let before = mesh.triangles.len();
    let (positions, normals) = (&mesh.positions, &mesh.normals);
    let cross = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        (b - a).cross(c - a)
    };
    // Shading normalises this single precision cross product: a triangle for which that fails has no area.
    let has_area = |t: &[u32; 3]| {
        let length2 = cross(t).length_squared();
        length2.is_finite() && length2 > f32::MIN_POSITIVE
    };
    let mut triangles = std::mem::take(&mut mesh.triangles);
    if !triangles.par_iter().all(has_area) {
        triangles.retain(has_area);
    }
    let mut flat = true;
    if !normals.is_empty() {
        flat = triangles
            .par_iter_mut()
            .map(|t| {
                let n = t.map(|i| normals[i as usize]);
                let mut ng = cross(t).normalize();
                if ng.dot(n[0] + n[1] + n[2]) < 0.0 {
                    t.swap(1, 2);
                    ng = -ng;
                }
                // Normals that only repeat the face's own tell nothing.
                n.iter().all(|n| n.dot(ng) > 1.0 - 1e-6)
            })
            .reduce(|| true, |a, b| a && b);
    }
    let removed = before - triangles.len();
    let shading = MeshShading {
        normals: if flat { vec![] } else { mesh.normals },
        uvs: if wants_uvs { mesh.uvs } else { vec![] },
        colors: if wants_colors { mesh.colors } else { vec![] },
        material,
        first_light: None,
        wants_tangents,
    };
    ((MeshBuffers { positions: VertexBuffer::new(mesh.positions), triangles }, shading), removed)
}

/// A texture as the emission of a surface.
#[derive(Debug)]
struct Emission(ColorTexture);

impl RadianceTexture for Emission {
    fn at(&self, uv: Vec2) -> Rgb {
        self.0.eval(&SurfacePoint { uv, ..SurfacePoint::default() })
    }

    fn mean(&self) -> Rgb {
        self.0.mean()
    }
}

/// One light for every triangle of an emitting mesh, in the order of the triangles.
fn triangle_lights(
    buffers: &MeshBuffers,
    shading: &MeshShading,
    emission: &AreaEmission,
    textures: &TextureSet,
    lights: &mut Vec<Light>,
) {
    let textured: Option<Arc<dyn RadianceTexture>> = match emission.radiance {
        ColorDesc::Constant(_) => None,
        ColorDesc::Texture(_) => Some(Arc::new(Emission(textures.color(emission.radiance)))),
    };
    for (i, triangle) in buffers.triangles.iter().enumerate() {
        let emission = match (&textured, emission.radiance) {
            (None, ColorDesc::Constant(radiance)) => TriangleEmission::Constant(radiance),
            (Some(texture), _) => {
                let uv = if shading.uvs.is_empty() {
                    [Vec2::ZERO, Vec2::X, Vec2::Y]
                } else {
                    triangle.map(|i| shading.uvs[i as usize])
                };
                TriangleEmission::Textured(Box::new(TexturedEmission { texture: texture.clone(), uv }))
            }
            (None, ColorDesc::Texture(_)) => TriangleEmission::Constant(Rgb::BLACK),
        };
        lights.push(Light::Triangle(TriangleLight::new(buffers.corners(i as u32), false, emission)));
    }
}

fn emitter_lights(
    emitter: &EmitterDesc,
    images: &[ImageDesc],
    centre: DVec3,
    radius: f32,
    lights: &mut Vec<Light>,
) -> Result<(), EmitError> {
    lights.push(match &emitter.kind {
        EmitterKind::Point { position, intensity } => Light::Point(PointLight::new(*position, *intensity, centre)),
        EmitterKind::Spot { to_world, intensity, cutoff_angle, beam_width } => {
            Light::Spot(Box::new(SpotLight::new(*to_world, *intensity, *cutoff_angle, *beam_width, centre)?))
        }
        EmitterKind::Directional { direction, irradiance } => {
            Light::Directional(DirectionalLight::new(*direction, *irradiance, radius)?)
        }
        environment => Light::Environment(Box::new(EnvironmentLight::new(surroundings(environment, images)?, radius))),
    });
    Ok(())
}

/// The radiance of a light that surrounds the scene.
fn surroundings(kind: &EmitterKind, images: &[ImageDesc]) -> Result<Environment, EmitError> {
    Ok(match kind {
        EmitterKind::Envmap { image, scale, to_world } => match images.get(image.index()) {
            Some(desc) => Environment::Map(Box::new(EnvMap::new(&desc.image, *scale, *to_world)?)),
            None => Environment::Constant(Rgb::BLACK),
        },
        &EmitterKind::SunSky { to_world, sun_direction, turbidity, albedo, sky_scale, sun_scale, sun_aperture } => {
            let params =
                SunSkyParams { to_world, sun_direction, turbidity, albedo, sky_scale, sun_scale, sun_aperture };
            Environment::SunSky(Box::new(SunSky::new(&params)?))
        }
        EmitterKind::Constant { radiance } => Environment::Constant(*radiance),
        // Lights at a place do not surround the scene.
        EmitterKind::Point { .. } | EmitterKind::Spot { .. } | EmitterKind::Directional { .. } => {
            Environment::Constant(Rgb::BLACK)
        }
    })
}

fn features(
    desc: &SceneDesc,
    sensor: &crate::scene::SensorDesc,
    materials: &MaterialSet,
    lights: &LightSet,
    meshes: &[MeshShading],
    cropped: bool,
) -> Features {
    let mut f = Features::default();
    for mesh in meshes {
        let m = materials.get(mesh.material).features();
        f.set(Features::TEXTURES, m.textured);
        f.set(Features::MASKS, m.passes_through);
        f.set(Features::SPECULAR, m.delta);
        f.set(Features::SHADING_NORMALS, !mesh.normals.is_empty());
    }
    for (_, light) in lights.iter() {
        f.set(Features::DELTA_LIGHTS, light.is_delta());
        f.set(Features::ENVIRONMENT, light.is_infinite() && !light.is_delta());
        f.set(Features::AREA_LIGHTS, matches!(light, Light::Triangle(_)));
    }
    f.set(Features::THIN_LENS, sensor.aperture_radius > 0.0);
    f.set(Features::INSTANCES, !desc.instances.is_empty());
    f.set(Features::CROP, cropped);
    f
}
