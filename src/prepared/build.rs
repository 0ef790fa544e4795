//! Building a [`PreparedScene`]: place, clean, centre, and hand each part to the room that knows it.

use super::coplanar::raise_emitters;
use super::lights::{Extent, all_lights};
use super::limits::{MAX_REACH, check_instances};
use super::media::{Surroundings, build_media};
use super::placing::{PlacedScene, bounds};
use super::units::to_usual_size;
use super::{Features, MeshShading, PreparedScene, TriangleTable};
use crate::emit::{Camera, EmitError, Light, LightSet, PixelFilter};
use crate::math::{DVec3, Vec3};
use crate::ray::{Backend, QueryError, SurfaceMask};
use crate::scene::{Diagnostics, SceneDesc, SensorDesc};
use crate::shade::{MaterialSet, TextureSet};
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
    /// Transforms are beyond single precision; the diagnostics say which.
    #[error("the scene's transforms cannot be used")]
    Transforms,
    /// Media are impossible; the diagnostics say which.
    #[error("the scene's participating media cannot be used")]
    Media,
    /// The scene is larger than single precision can hold.
    #[error("the scene reaches {0:e} from its centre, which is beyond the range of single precision")]
    Extent(f32),
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
        let unit = to_usual_size(&mut desc);
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

        let centre = bounds(&desc).map_or(DVec3::ZERO, |(lo, hi)| 0.5 * (lo + hi));
        let mut placed = PlacedScene::new(&mut desc, centre, &materials, diagnostics);
        raise_emitters(&mut placed, diagnostics);
        let (lo, hi) = placed.geometry.bounds().unwrap_or((Vec3::ZERO, Vec3::ZERO));
        let radius = lo.abs().max(hi.abs()).length();
        let camera = Camera::new(&sensor, centre)?;
        check_range(&placed, &desc, radius.max(camera.position().length()), diagnostics)?;
        let lights = all_lights(&mut placed, &desc, &textures, Extent { centre, radius })?;
        let PlacedScene { geometry, meshes, instance_normals, .. } = placed;

        let mut features =
            features(&desc, &sensor, &materials, &lights, &meshes, window != [0, 0, film_size[0], film_size[1]]);
        features.set(Features::MASKS, geometry.has_any_of(SurfaceMask::MASKS));
        let media = build_media(&desc.media, centre, diagnostics)?;
        features.set(Features::MEDIA, !media.is_empty());
        let geometry = Arc::new(geometry);
        let start = Instant::now();
        let query = options.backend.build(geometry.clone(), options.threads)?;
        let mut scene = PreparedScene {
            query,
            triangles: TriangleTable::new(&geometry, &meshes),
            geometry,
            meshes,
            instance_normals,
            materials,
            media,
            surroundings: Surroundings::default(),
            lights,
            camera,
            filter: PixelFilter::new(sensor.film.filter),
            film_size,
            window,
            centre: centre * unit,
            unit,
            radius,
            features,
            tree_seconds: start.elapsed().as_secs_f64(),
        };
        scene.surroundings = scene.find_surroundings(sensor.medium);
        Ok(scene)
    }
}

/// Refuses what single precision cannot hold; `reach` is the distance of surfaces and camera from the centre.
fn check_range(
    placed: &PlacedScene,
    desc: &SceneDesc,
    reach: f32,
    diagnostics: &mut Diagnostics,
) -> Result<(), PrepareError> {
    check_instances(&placed.geometry, &desc.instances, reach, diagnostics);
    if diagnostics.has_errors() {
        return Err(PrepareError::Transforms);
    }
    // Not a number is out of range as well.
    if reach < MAX_REACH { Ok(()) } else { Err(PrepareError::Extent(reach)) }
}

/// The part to render.
fn window([width, height]: [u32; 2], crop: Option<[u32; 4]>) -> Result<[u32; 4], PrepareError> {
    if width == 0 || height == 0 {
        return Err(PrepareError::Film(format!("a picture of {width} x {height} pixels has nothing to render")));
    }
    if u64::from(width) * u64::from(height) > 1 << 31 {
        return Err(PrepareError::Film(format!(
            "a picture of {width} x {height} pixels is too large: at most 2^31 pixels can be rendered"
        )));
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

fn features(
    desc: &SceneDesc,
    sensor: &SensorDesc,
    materials: &MaterialSet,
    lights: &LightSet,
    meshes: &[MeshShading],
    cropped: bool,
) -> Features {
    let mut f = Features::default();
    for mesh in meshes {
        let m = materials.get(mesh.material).features();
        f.set(Features::TEXTURES, m.textured);
        f.set(Features::SPECULAR, m.delta);
        f.set(Features::NEARLY_SPECULAR, m.nearly_specular);
        f.set(Features::SHADING_NORMALS, !mesh.normals.is_empty());
    }
    for (_, light) in lights.iter() {
        f.set(Features::DELTA_LIGHTS, light.is_delta());
        f.set(Features::ENVIRONMENT, light.is_infinite() && !light.is_delta());
        f.set(Features::AREA_LIGHTS, matches!(light, Light::Triangle(_) | Light::Round(_)));
    }
    f.set(Features::THIN_LENS, sensor.aperture_radius > 0.0);
    f.set(Features::INSTANCES, !desc.instances.is_empty());
    f.set(Features::CROP, cropped);
    f
}
