//! `SceneDesc`: everything a scene file says, as plain data in world coordinates of double precision.
//!
//! Arenas and typed ids, no reference counting: the loaders fill it, `prepared` consumes it. Defaults follow Mitsuba 3,
//! whose files are read; each field says its unit where it has one.

use super::bsdf::BsdfDesc;
use super::diag::{Diagnostic, Span};
use super::medium::{InterfaceDesc, MediumDesc};
use crate::image::Image;
use crate::math::Rgb;
use glam::{DMat4, DVec3, DVec4, Vec2, Vec3};
use std::path::PathBuf;
use std::sync::Arc;

macro_rules! id_type {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);
        impl $name {
            /// As an index into the arena.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}
id_type!(/// Index into [`SceneDesc::textures`].
    TextureId);
id_type!(/// Index into [`SceneDesc::images`].
    ImageId);
id_type!(/// Index into [`SceneDesc::bsdfs`].
    BsdfId);
id_type!(/// Index into [`SceneDesc::meshes`].
    MeshId);
id_type!(/// Index into [`SceneDesc::groups`].
    GroupId);
id_type!(/// Index into [`SceneDesc::media`].
    MediumId);

/// A whole scene.
#[derive(Debug, Default)]
pub struct SceneDesc {
    /// The file it came from.
    pub path: PathBuf,
    /// Every file that the scene was read from: scene files, includes, meshes, materials, tables and pictures.
    pub files: Vec<PathBuf>,
    /// Cameras, at least one when valid; the first is rendered.
    pub sensors: Vec<SensorDesc>,
    /// Settings of the render that the file proposes; the command line overrides them.
    pub integrator: Option<IntegratorDesc>,
    /// Textures.
    pub textures: Vec<TextureDesc>,
    /// Decoded pictures, shared by textures and environment lights.
    pub images: Vec<ImageDesc>,
    /// Materials.
    pub bsdfs: Vec<BsdfDesc>,
    /// Triangles, in object space.
    pub meshes: Vec<MeshDesc>,
    /// Surfaces placed in the world.
    pub shapes: Vec<ShapeDesc>,
    /// Sets of shapes that are placed by instances only.
    pub groups: Vec<GroupDesc>,
    /// Placements of groups.
    pub instances: Vec<InstanceDesc>,
    /// Lights that are not surfaces.
    pub emitters: Vec<EmitterDesc>,
    /// Participating media.
    pub media: Vec<MediumDesc>,
}

/// A camera with its film.
#[derive(Clone, Debug)]
pub struct SensorDesc {
    /// Camera → world. The camera looks along +z, +x is to the left of the picture, +y up (Mitsuba's convention).
    pub to_world: DMat4,
    /// Field of view in degrees along `fov_axis`.
    pub fov: f64,
    /// Which side of the film `fov` spans.
    pub fov_axis: FovAxis,
    /// Shift of the principal point, as a fraction of the film's width and height.
    pub principal_point: [f64; 2],
    /// Nothing nearer (distance along the viewing axis) is seen.
    pub near_clip: f64,
    /// Nothing farther (distance along the viewing axis) is seen.
    pub far_clip: f64,
    /// Radius of the lens; zero for a pinhole.
    pub aperture_radius: f64,
    /// Distance along the viewing axis of the plane in focus; used with a lens only.
    pub focus_distance: f64,
    /// The medium that the camera is in; vacuum if there is none.
    pub medium: Option<MediumId>,
    /// The film.
    pub film: FilmDesc,
    /// Samples per pixel that the file asks for.
    pub sample_count: Option<u32>,
    /// Where the camera stands in the file.
    pub span: Option<Span>,
}

/// Which side of the film a field of view spans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FovAxis {
    /// Width.
    X,
    /// Height.
    Y,
    /// Diagonal.
    Diagonal,
    /// The shorter side.
    Smaller,
    /// The longer side.
    Larger,
}

/// The picture to make.
#[derive(Clone, Debug)]
pub struct FilmDesc {
    /// Width in pixels of the full picture.
    pub width: u32,
    /// Height in pixels of the full picture.
    pub height: u32,
    /// Part to render, in pixels of the full picture: x, y, width, height.
    pub crop: Option<[u32; 4]>,
    /// Pixel filter.
    pub filter: FilterDesc,
    /// Where the film stands in the file.
    pub span: Option<Span>,
}

/// Pixel filters; radii and deviations in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterDesc {
    /// Constant over the pixel.
    Box,
    /// Triangle.
    Tent {
        /// Half width.
        radius: f32,
    },
    /// Gaussian, cut at four deviations and lowered to zero there.
    Gaussian {
        /// Standard deviation.
        stddev: f32,
    },
    /// Mitchell & Netravali 1988 with parameters B and C, radius 2.
    Mitchell {
        /// B.
        b: f32,
        /// C.
        c: f32,
    },
}

/// A proposal of how to render: name and raw parameters, checked against the registry later.
#[derive(Clone, Debug)]
pub struct IntegratorDesc {
    /// Plugin name in the file.
    pub name: String,
    /// `max_depth` and the like.
    pub params: Vec<(String, String, Option<Span>)>,
    /// It makes another kind of picture than any integrator here: to be said where it would be used.
    pub refused: Option<Diagnostic>,
    /// Where it stands.
    pub span: Option<Span>,
}

/// A colour that may vary over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorDesc {
    /// One colour everywhere (linear Rec. 709).
    Constant(Rgb),
    /// Looked up.
    Texture(TextureId),
}

/// A number that may vary over a surface (a texture's luminance or its single channel).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScalarDesc {
    /// One value everywhere.
    Constant(f32),
    /// Looked up.
    Texture(TextureId),
}

/// A texture.
#[derive(Clone, Debug)]
pub enum TextureDesc {
    /// A picture.
    Bitmap {
        /// Its pixels.
        image: ImageId,
        /// Texture coordinates are mapped through this first (affine in u, v): rows of [a b c; d e f].
        to_uv: [[f32; 3]; 2],
        /// Interpolation.
        filter: TextureFilter,
        /// Beyond [0, 1].
        wrap: WrapMode,
        /// Multiplies every value.
        scale: f32,
    },
    /// Colours of the mesh ([`MeshDesc::colors`]), interpolated.
    MeshAttribute {
        /// Multiplies every value.
        scale: f32,
    },
    /// Two colours in squares of side one half in texture space.
    Checkerboard {
        /// Squares (even, even).
        color0: ColorDesc,
        /// The others.
        color1: ColorDesc,
        /// As for bitmaps.
        to_uv: [[f32; 3]; 2],
    },
}

/// Interpolation between texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureFilter {
    /// The texel that holds the point.
    Nearest,
    /// Linear between the four nearest texel centres.
    Bilinear,
}

/// Texture values beyond the picture's edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrapMode {
    /// The picture again.
    Repeat,
    /// The picture mirrored.
    Mirror,
    /// The edge.
    Clamp,
}

/// A decoded picture file.
#[derive(Clone, Debug)]
pub struct ImageDesc {
    /// File it came from.
    pub path: PathBuf,
    /// Pixels; the colour space was decided on loading.
    pub image: Arc<Image>,
}

/// Triangles in object space.
#[derive(Clone, Debug, Default)]
pub struct MeshDesc {
    /// For messages: the file's name or the shape's kind.
    pub name: String,
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Per vertex, unit length, or empty.
    pub normals: Vec<Vec3>,
    /// Per vertex texture coordinates, or empty.
    pub uvs: Vec<Vec2>,
    /// Per vertex colours (linear), or empty.
    pub colors: Vec<Rgb>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

/// Shapes of a formula that rays meet as they are, without triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RoundKind {
    /// Unit sphere around the origin.
    Sphere,
    /// Unit disk at z = 0, facing +z.
    Disk,
    /// Unit radius around z from 0 to 1, without caps, facing outwards.
    Cylinder,
}

impl RoundKind {
    /// True if the map leaves the shape what it is: an ellipsoid is no sphere, an elliptic or oblique cylinder no
    /// cylinder. Disks may become ellipses: their area is stretched everywhere alike.
    pub fn is_kept_by(self, to_world: &DMat4) -> bool {
        // Relative difference of lengths, and cosine, up to which axes count as equally long and perpendicular.
        const SIMILAR: f64 = 1e-6;
        let [x, y, z] = [to_world.x_axis, to_world.y_axis, to_world.z_axis].map(DVec4::truncate);
        let equal = |a: DVec3, b: DVec3| (a.length() / b.length() - 1.0).abs() < SIMILAR;
        let perpendicular = |a: DVec3, b: DVec3| a.normalize_or_zero().dot(b.normalize_or_zero()).abs() < SIMILAR;
        let upright = perpendicular(x, y) && perpendicular(x, z) && perpendicular(y, z);
        match self {
            RoundKind::Disk => true,
            RoundKind::Cylinder => upright && equal(x, y),
            RoundKind::Sphere => upright && equal(x, y) && equal(x, z),
        }
    }
}

/// The surface of a shape, in object space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShapeGeometry {
    /// Triangles.
    Mesh(MeshId),
    /// A round shape.
    Round(RoundKind),
}

impl ShapeGeometry {
    /// The mesh, if it is one.
    pub fn mesh(self) -> Option<MeshId> {
        match self {
            ShapeGeometry::Mesh(mesh) => Some(mesh),
            ShapeGeometry::Round(_) => None,
        }
    }
}

/// A surface in the world (or in its group).
#[derive(Clone, Debug)]
pub struct ShapeDesc {
    /// The surface itself.
    pub geometry: ShapeGeometry,
    /// Object → world (or group) space. Round shapes that emit keep their kind under it (see
    /// [`RoundKind::is_kept_by`]).
    pub to_world: DMat4,
    /// Material; `None` is Mitsuba's default, a diffuse reflectance of one half.
    pub bsdf: Option<BsdfId>,
    /// The emitted radiance, if it emits.
    pub emission: Option<AreaEmission>,
    /// The media on both sides, if the surface separates media.
    pub interface: Option<InterfaceDesc>,
    /// Turns the surface inside out.
    pub flip_normals: bool,
    /// `id` in the file.
    pub name: Option<String>,
    /// Where it stands.
    pub span: Option<Span>,
}

/// Emission of a surface from its front.
#[derive(Clone, Debug)]
pub struct AreaEmission {
    /// Radiance, W/(m² sr) in the file's units.
    pub radiance: ColorDesc,
    /// Multiplies the probability of being sampled.
    pub sampling_weight: f32,
    /// Where it stands.
    pub span: Option<Span>,
}

/// Shapes that instances place together.
#[derive(Clone, Debug, Default)]
pub struct GroupDesc {
    /// The shapes, in group space.
    pub shapes: Vec<ShapeDesc>,
}

/// A placed group.
#[derive(Clone, Debug)]
pub struct InstanceDesc {
    /// Which group.
    pub group: GroupId,
    /// Group → world; any invertible affine map, mirrored ones included.
    pub to_world: DMat4,
    /// Where it stands.
    pub span: Option<Span>,
}

/// A light that is not a surface.
#[derive(Clone, Debug)]
pub struct EmitterDesc {
    /// Its kind.
    pub kind: EmitterKind,
    /// Multiplies the probability of being sampled.
    pub sampling_weight: f32,
    /// Where it stands.
    pub span: Option<Span>,
}

/// A point that projects a picture, as a pinhole camera sees one: +z of its space is the axis, +x the left of the
/// picture, +y its top.
#[derive(Clone, Debug)]
pub struct ProjectorDesc {
    /// Light → world.
    pub to_world: DMat4,
    /// The picture: the irradiance at distance one on its axis, over π.
    pub irradiance: ColorDesc,
    /// Multiplies the picture.
    pub scale: f32,
    /// Angle in degrees under which the picture is seen from the light.
    pub fov: f64,
    /// Direction in which `fov` is measured.
    pub fov_axis: FovAxis,
}

/// Lights that are not surfaces. Spaces: light space → world by `to_world`.
#[derive(Clone, Debug)]
pub enum EmitterKind {
    /// Shines equally in all directions.
    Point {
        /// World position.
        position: glam::DVec3,
        /// Radiant intensity per channel, W/sr.
        intensity: Rgb,
    },
    /// A cone of light along +z of its space.
    Spot {
        /// Light → world.
        to_world: DMat4,
        /// Radiant intensity on the axis.
        intensity: Rgb,
        /// Half angle in degrees beyond which it is dark.
        cutoff_angle: f32,
        /// Half angle in degrees up to which it has full strength; falls off linearly in angle from there.
        beam_width: f32,
        /// Multiplies the intensity; projected on the square that just holds the cone.
        texture: Option<TextureId>,
    },
    /// A picture thrown from a point.
    Projector(ProjectorDesc),
    /// Parallel light from infinity.
    Directional {
        /// World direction in which the light travels.
        direction: glam::DVec3,
        /// Irradiance on a surface that faces it, W/m².
        irradiance: Rgb,
    },
    /// Constant radiance from all directions.
    Constant {
        /// Radiance.
        radiance: Rgb,
    },
    /// A latitude–longitude picture. In light space +y is up; the picture's columns run as in Mitsuba 3's `envmap`.
    Envmap {
        /// Radiance.
        image: ImageId,
        /// Multiplies it.
        scale: f32,
        /// Light → world (its rotation counts).
        to_world: DMat4,
    },
    /// Clear sky and/or sun (Hosek & Wilkie 2012, 2013). In light space +z is the zenith.
    SunSky {
        /// Light → world (its rotation counts).
        to_world: DMat4,
        /// Direction towards the sun in light space.
        sun_direction: glam::DVec3,
        /// Haziness, 1 … 10.
        turbidity: f32,
        /// Ground albedo.
        albedo: Rgb,
        /// Multiplies the sky; zero for the sun alone.
        sky_scale: f32,
        /// Multiplies the sun; zero for the sky alone.
        sun_scale: f32,
        /// Angle in degrees under which the sun is seen.
        sun_aperture: f32,
    },
}
