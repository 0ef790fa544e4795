//! Common parts of all mesh readers: options, errors, and the repairs every mesh gets before it enters a scene.

use super::normals;
use crate::math::Rgb;
use crate::scene::MeshDesc;
use std::fmt;
use std::path::Path;

/// How to read a mesh, after the parameters of Mitsuba's mesh shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct MeshOptions {
    /// Drop vertex normals: the surface is faceted.
    pub face_normals: bool,
    /// Vertex normals are made anew; edges at which the normals of faces differ by more stay sharp.
    pub max_smooth_angle: Option<SmoothAngle>,
    /// Texture v becomes 1 − v. Pictures have v = 0 at their *top* row here, as in Mitsuba 3; OBJ files have it at the
    /// bottom.
    pub flip_v: bool,
    /// Which colours of the file a texture needs.
    pub colors: MeshColors,
    /// The mesh is placed by a transform that mirrors. Vertex normals of the file keep their meaning then (they go with
    /// the inverse transpose), while the winding turns round: it is reversed here so that both stay on one side.
    pub mirrored: bool,
}

/// An angle in degrees by its bits, so that meshes read with equal options are known as equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct SmoothAngle(u32);

impl SmoothAngle {
    pub(super) fn degrees(degrees: f32) -> SmoothAngle {
        SmoothAngle(degrees.to_bits())
    }

    fn cosine(self) -> f32 {
        f32::from_bits(self.0).to_radians().cos()
    }
}

/// Colours of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) enum MeshColors {
    /// None is needed.
    #[default]
    Unused,
    /// One for each vertex.
    Vertex,
    /// One for each face.
    Face,
}

impl MeshColors {
    /// Name of the attribute in scene files; empty if none is needed.
    pub(super) fn attribute(self) -> &'static str {
        match self {
            MeshColors::Unused => "",
            MeshColors::Vertex => "vertex_color",
            MeshColors::Face => "face_color",
        }
    }
}

/// A mesh as read.
#[derive(Debug)]
pub(super) struct LoadedMesh {
    pub mesh: MeshDesc,
    pub dropped: Dropped,
}

/// Parts of a mesh file that are not in the mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Dropped {
    /// Faces of fewer than three corners.
    pub faces: u64,
    /// Statements that the reader does not know: how many, the first of them, and its line.
    pub statements: Option<UnknownStatements>,
}

/// Statements that the reader does not know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct UnknownStatements {
    pub count: u64,
    /// The first one's keyword.
    pub first: String,
    /// The first one's line, from 1.
    pub line: u64,
}

impl Dropped {
    /// A sentence for each kind of part that was dropped.
    pub(super) fn messages(&self, path: &Path) -> Vec<String> {
        let path = path.display();
        let mut out = Vec::new();
        if self.faces > 0 {
            out.push(format!("`{path}`: {} faces of fewer than three corners are left out", self.faces));
        }
        if let Some(UnknownStatements { count, first, line }) = &self.statements {
            out.push(format!(
                "`{path}`: {count} unknown statements are skipped; the first is `{first}` in line {line}"
            ));
        }
        out
    }
}

/// Where in a mesh file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Line, from 1.
    Line(u64),
    /// Offset from the beginning of the file.
    Byte(u64),
    /// The file as a whole.
    File,
}

/// Why a mesh file could not be read.
#[derive(Debug)]
pub(super) enum MeshError {
    /// The file system's reason.
    Io(std::io::Error),
    /// The mistake in the file.
    Bad { place: Place, message: String },
}

impl MeshError {
    pub(super) fn new(place: Place, message: impl Into<String>) -> MeshError {
        MeshError::Bad { place, message: message.into() }
    }
}

impl From<std::io::Error> for MeshError {
    fn from(e: std::io::Error) -> MeshError {
        MeshError::Io(e)
    }
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MeshError::Io(e) => write!(f, "{e}"),
            MeshError::Bad { place: Place::Line(line), message } => write!(f, "line {line}: {message}"),
            MeshError::Bad { place: Place::Byte(byte), message } => write!(f, "byte {byte}: {message}"),
            MeshError::Bad { place: Place::File, message } => write!(f, "{message}"),
        }
    }
}

/// Applies the options to a mesh as the file has it: normals dropped, completed or generated, v flipped, winding
/// turned.
pub(super) fn finish(mesh: &mut MeshDesc, options: MeshOptions) {
    if options.flip_v {
        for uv in &mut mesh.uvs {
            uv.y = 1.0 - uv.y;
        }
    }
    if let Some(angle) = options.max_smooth_angle {
        normals::split_at_creases(mesh, angle.cosine());
        mesh.normals = Vec::new();
    }
    if options.face_normals {
        mesh.normals = Vec::new();
    } else if mesh.normals.is_empty() {
        mesh.normals = normals::angle_weighted(&mesh.positions, &mesh.triangles);
        if options.mirrored {
            // Generated normals follow the winding as it is in the world.
            mesh.normals.iter_mut().for_each(|n| *n = -*n);
        }
    } else {
        normals::normalize_or_repair(mesh);
        if options.mirrored {
            reverse_winding(mesh);
        }
    }
}

/// Gives every triangle vertices of its own, all in the triangle's colour.
pub(super) fn color_faces(mesh: &mut MeshDesc, colors: &[Rgb]) {
    let corners: Vec<usize> = mesh.triangles.iter().flatten().map(|&i| i as usize).collect();
    mesh.positions = corners.iter().map(|&i| mesh.positions[i]).collect();
    if !mesh.normals.is_empty() {
        mesh.normals = corners.iter().map(|&i| mesh.normals[i]).collect();
    }
    if !mesh.uvs.is_empty() {
        mesh.uvs = corners.iter().map(|&i| mesh.uvs[i]).collect();
    }
    mesh.colors = colors.iter().flat_map(|&c| [c; 3]).collect();
    mesh.triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
}

/// Turns every triangle round.
pub(super) fn reverse_winding(mesh: &mut MeshDesc) {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
}
