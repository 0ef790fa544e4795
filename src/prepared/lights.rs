//! The lights of a scene: one for every triangle of an emitting mesh, one for every emitting round shape, then the
//! emitters.

use super::MeshShading;
use super::placing::PlacedScene;
use crate::emit::{
    DirectionalLight, EmitError, EnvMap, Environment, EnvironmentLight, Light, LightSet, PointLight, Projection,
    Projector, RadianceTexture, RoundEmission, RoundLight, SpotLight, SunSky, SunSkyParams, TexturedEmission,
    TriangleEmission, TriangleLight,
};
use crate::math::{DVec3, Rgb, Vec2};
use crate::ray::{MeshBuffers, RoundShape};
use crate::scene::{AreaEmission, ColorDesc, EmitterDesc, EmitterKind, ImageDesc, SceneDesc, TextureDesc};
use crate::shade::{ColorTexture, SurfacePoint, TextureSet};
use std::sync::Arc;

/// Where a scene is, and how large.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    /// Centre in the coordinates of the file.
    pub centre: DVec3,
    /// Radius of a sphere around the centre that holds all surfaces.
    pub radius: f32,
}

/// All lights. Each emitting surface learns the number of its light, a mesh that of its first triangle's.
pub(super) fn all_lights(
    placed: &mut PlacedScene,
    desc: &SceneDesc,
    textures: &TextureSet,
    extent: Extent,
) -> Result<LightSet, EmitError> {
    let (mut lights, mut weights) = (vec![], vec![]);
    let PlacedScene { geometry, meshes, emission, .. } = placed;
    for (i, (shading, emission)) in meshes.iter_mut().zip(&*emission).enumerate() {
        let Some(emission) = emission else { continue };
        shading.first_light = Some(lights.len() as u32);
        match geometry.round_shape(i as u32) {
            Some(shape) => lights.push(round_light(shape, emission, textures)),
            None => triangle_lights(&geometry.meshes[i], shading, emission, textures, &mut lights),
        }
        weights.resize(lights.len(), emission.sampling_weight);
    }
    for emitter in &desc.emitters {
        lights.push(emitter_light(emitter, desc, textures, extent)?);
        weights.push(emitter.sampling_weight);
    }
    Ok(LightSet::weighted(lights, &weights))
}

/// A texture as the emission of a surface or the picture that a spot light projects.
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

/// The emission's texture, if it has one.
fn radiance_texture(emission: &AreaEmission, textures: &TextureSet) -> Option<Arc<dyn RadianceTexture>> {
    match emission.radiance {
        ColorDesc::Constant(_) => None,
        ColorDesc::Texture(_) => Some(Arc::new(Emission(textures.color(emission.radiance)))),
    }
}

fn round_light(shape: &RoundShape, emission: &AreaEmission, textures: &TextureSet) -> Light {
    let radiance = match (radiance_texture(emission, textures), emission.radiance) {
        (Some(texture), _) => RoundEmission::Textured(texture),
        (None, ColorDesc::Constant(radiance)) => RoundEmission::Constant(radiance),
        (None, ColorDesc::Texture(_)) => RoundEmission::Constant(Rgb::BLACK),
    };
    Light::Round(Box::new(RoundLight::new(shape.clone(), radiance)))
}

/// One light for every triangle of an emitting mesh, in the order of the triangles.
fn triangle_lights(
    buffers: &MeshBuffers,
    shading: &MeshShading,
    emission: &AreaEmission,
    textures: &TextureSet,
    lights: &mut Vec<Light>,
) {
    let textured = radiance_texture(emission, textures);
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

fn emitter_light(
    emitter: &EmitterDesc,
    desc: &SceneDesc,
    textures: &TextureSet,
    extent: Extent,
) -> Result<Light, EmitError> {
    let Extent { centre, radius } = extent;
    Ok(match &emitter.kind {
        EmitterKind::Point { position, intensity } => Light::Point(PointLight::new(*position, *intensity, centre)),
        EmitterKind::Spot { to_world, intensity, cutoff_angle, beam_width, texture } => {
            let mut light = SpotLight::new(*to_world, *intensity, *cutoff_angle, *beam_width, centre)?;
            if let Some(texture) = texture {
                let texture = Arc::new(Emission(textures.color(ColorDesc::Texture(*texture))));
                light = light.with_projection(Projection::new(texture, *to_world, *cutoff_angle)?);
            }
            Light::Spot(Box::new(light))
        }
        EmitterKind::Projector(projector) => {
            let picture = Arc::new(Emission(textures.color(projector.irradiance)));
            let aspect = aspect_ratio(projector.irradiance, desc);
            Light::Projector(Box::new(Projector::new(projector, picture, aspect, centre)?))
        }
        EmitterKind::Directional { direction, irradiance } => {
            Light::Directional(DirectionalLight::new(*direction, *irradiance, radius)?)
        }
        environment => {
            Light::Environment(Box::new(EnvironmentLight::new(surroundings(environment, &desc.images)?, radius)))
        }
    })
}

/// Width over height of a picture in pixels; other textures are square.
fn aspect_ratio(color: ColorDesc, desc: &SceneDesc) -> f64 {
    let ColorDesc::Texture(id) = color else { return 1.0 };
    match desc.textures[id.index()] {
        TextureDesc::Bitmap { image, .. } => {
            let image = &desc.images[image.index()].image;
            f64::from(image.width) / f64::from(image.height)
        }
        _ => 1.0,
    }
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
        EmitterKind::Point { .. }
        | EmitterKind::Spot { .. }
        | EmitterKind::Projector(_)
        | EmitterKind::Directional { .. } => Environment::Constant(Rgb::BLACK),
    })
}
