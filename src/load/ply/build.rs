//! Puts rows of a PLY file, however written, into the arrays of a mesh.

use super::Parsed;
use super::header::{Element, Kind, Scalar};
use crate::image::buffer::srgb_to_linear;
use crate::load::mesh::{Dropped, LoadedMesh, MeshColors, MeshError, MeshOptions, Place};
use crate::load::polygon::{self, MAX_CONCAVE_CORNERS};
use crate::math::Rgb;
use crate::scene::MeshDesc;
use glam::{Vec2, Vec3};

/// Where in a row (as an index of its properties) the known vertex properties are.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexLayout {
    pub position: [usize; 3],
    pub normal: Option<[usize; 3]>,
    pub uv: Option<[usize; 2]>,
    pub color: Option<[usize; 3]>,
    /// Colours are bytes: sRGB.
    pub color_is_srgb: bool,
}

/// Where in a row the three components of a colour are, and whether they are bytes.
fn color_property(element: &Element) -> Option<([usize; 3], bool)> {
    let find = |name: &str| element.properties.iter().position(|p| p.name == name && matches!(p.kind, Kind::One(_)));
    let three = |names: [&str; 3]| Some([find(names[0])?, find(names[1])?, find(names[2])?]);
    let color = three(["r", "g", "b"]).or_else(|| three(["red", "green", "blue"]))?;
    Some((color, element.properties[color[0]].kind == Kind::One(Scalar::U8)))
}

/// A colour of a file as linear Rec. 709.
fn color_of(row: [f64; 3], is_srgb: bool) -> Rgb {
    Rgb::from(row.map(|v| if is_srgb { srgb_to_linear(v / 255.0) as f32 } else { v as f32 }))
}

/// Where in a row the known face properties are.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceLayout {
    /// The list of vertices.
    pub list: usize,
    /// The colour, if it is wanted.
    color: Option<[usize; 3]>,
    color_is_srgb: bool,
}

impl FaceLayout {
    /// Finds the known properties of the face element.
    pub(super) fn of(element: &Element, builder: &Builder) -> Result<FaceLayout, MeshError> {
        let color = color_property(element).filter(|_| builder.face_colors_wanted);
        let (color, color_is_srgb) = color.map_or((None, false), |(color, srgb)| (Some(color), srgb));
        Ok(FaceLayout { list: index_property(element)?, color, color_is_srgb })
    }

    /// The component of the colour that a property is.
    pub(super) fn component(&self, property: usize) -> Option<usize> {
        self.color?.iter().position(|&p| p == property)
    }
}

/// A row of the face element.
#[derive(Clone, Debug, Default)]
pub(super) struct Face {
    /// Indices of vertices.
    pub corners: Vec<u32>,
    /// The colour as the file has it.
    pub color: [f64; 3],
}

impl VertexLayout {
    /// Finds the known properties of the vertex element.
    pub(super) fn of(element: &Element, normals_unwanted: bool) -> Result<VertexLayout, MeshError> {
        let find =
            |name: &str| element.properties.iter().position(|p| p.name == name && matches!(p.kind, Kind::One(_)));
        let three = |names: [&str; 3]| Some([find(names[0])?, find(names[1])?, find(names[2])?]);
        let two = |names: [&str; 2]| Some([find(names[0])?, find(names[1])?]);
        let position = three(["x", "y", "z"])
            .ok_or_else(|| MeshError::new(Place::File, "the `vertex` element lacks one of the properties x, y, z"))?;
        let (color, color_is_srgb) = color_property(element).map_or((None, false), |(color, srgb)| (Some(color), srgb));
        Ok(VertexLayout {
            position,
            normal: if normals_unwanted { None } else { three(["nx", "ny", "nz"]) },
            uv: [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]]
                .into_iter()
                .find_map(two),
            color,
            color_is_srgb,
        })
    }
}

/// The index of the face element's list of vertices.
fn index_property(element: &Element) -> Result<usize, MeshError> {
    let found = element.properties.iter().position(|p| {
        (p.name == "vertex_indices" || p.name == "vertex_index")
            && matches!(p.kind, Kind::List { item, .. } if item.is_integer())
    });
    found.ok_or_else(|| {
        MeshError::new(Place::File, "the `face` element lacks an integer list `vertex_indices` (or `vertex_index`)")
    })
}

/// A face of more than three corners, cut into triangles when all vertices are known: they may follow the faces.
#[derive(Debug)]
struct Polygon {
    /// Number of the face in the file.
    face: u64,
    /// Where its triangles stand in the mesh.
    first_triangle: usize,
    corners: Vec<u32>,
}

/// A mesh in the making.
#[derive(Debug, Default)]
pub(super) struct Builder {
    pub mesh: MeshDesc,
    pub normals_unwanted: bool,
    face_colors_wanted: bool,
    /// One for each triangle, or none.
    face_colors: Vec<Rgb>,
    skipped_faces: u64,
    polygons: Vec<Polygon>,
    /// Largest index seen, and the face that had it.
    largest: Option<(u32, u64)>,
}

impl Builder {
    pub(super) fn new(options: MeshOptions) -> Builder {
        Builder {
            normals_unwanted: options.face_normals,
            face_colors_wanted: options.colors == MeshColors::Face,
            ..Builder::default()
        }
    }

    /// Prepares for `count` vertices; the caller has made sure that the file is long enough for them.
    pub(super) fn reserve_vertices(&mut self, layout: &VertexLayout, count: u64) -> Result<(), MeshError> {
        if count > u64::from(u32::MAX) {
            return Err(MeshError::new(Place::File, "more than 2^32 vertices"));
        }
        let count = count as usize;
        self.mesh.positions.reserve_exact(count);
        if layout.normal.is_some() {
            self.mesh.normals.reserve_exact(count);
        }
        if layout.uv.is_some() {
            self.mesh.uvs.reserve_exact(count);
        }
        if layout.color.is_some() {
            self.mesh.colors.reserve_exact(count);
        }
        Ok(())
    }

    /// Adds a vertex, its properties as numbers in the order of the header.
    pub(super) fn vertex(&mut self, layout: &VertexLayout, row: &[f64]) {
        let three = |i: [usize; 3]| Vec3::new(row[i[0]] as f32, row[i[1]] as f32, row[i[2]] as f32);
        self.mesh.positions.push(three(layout.position));
        if let Some(i) = layout.normal {
            self.mesh.normals.push(three(i));
        }
        if let Some(i) = layout.uv {
            self.mesh.uvs.push(Vec2::new(row[i[0]] as f32, row[i[1]] as f32));
        }
        if let Some(i) = layout.color {
            self.mesh.colors.push(color_of(i.map(|i| row[i]), layout.color_is_srgb));
        }
    }

    /// Index of the first vertex from `first` on that is not finite.
    pub(super) fn first_broken_vertex(&self, first: usize) -> Option<usize> {
        let bad = |from: usize, all: &[Vec3]| all.get(from..)?.iter().position(|v| !v.is_finite()).map(|i| i + from);
        let uv = self.mesh.uvs.get(first..).and_then(|v| v.iter().position(|v| !v.is_finite())).map(|i| i + first);
        bad(first, &self.mesh.positions).or(uv)
    }

    /// Adds face number `number`.
    pub(super) fn face_row(&mut self, number: u64, face: &Face, layout: &FaceLayout) -> Result<(), MeshError> {
        self.face(number, &face.corners)?;
        if layout.color.is_some() {
            let color = color_of(face.color, layout.color_is_srgb);
            self.face_colors.resize(self.mesh.triangles.len(), color);
        }
        Ok(())
    }

    /// Adds face number `face`.
    pub(super) fn face(&mut self, face: u64, corners: &[u32]) -> Result<(), MeshError> {
        if corners.len() < 3 {
            self.skipped_faces += 1;
            return Ok(());
        }
        let first_triangle = self.mesh.triangles.len();
        for pair in corners[1..].windows(2) {
            self.mesh.triangles.push([corners[0], pair[0], pair[1]]);
        }
        let largest = corners.iter().copied().max().unwrap_or(0);
        self.note_largest(largest, face);
        if corners.len() > 3 {
            if (largest as usize) < self.mesh.positions.len() {
                return self.cut(face, first_triangle, corners);
            }
            self.polygons.push(Polygon { face, first_triangle, corners: corners.to_vec() });
        }
        Ok(())
    }

    /// Puts the right triangles in the place of a polygon's fan. All its vertices must be there.
    fn cut(&mut self, face: u64, first_triangle: usize, corners: &[u32]) -> Result<(), MeshError> {
        let points: Vec<Vec3> = corners.iter().map(|&i| self.mesh.positions[i as usize]).collect();
        let mut places = self.mesh.triangles[first_triangle..].iter_mut();
        let cut = polygon::triangulate(&points, |t| {
            if let Some(place) = places.next() {
                *place = t.map(|i| corners[i]);
            }
        });
        cut.map_err(|_| {
            let message = format!("face {face} is a polygon of {} corners that is not convex", corners.len());
            MeshError::new(Place::File, format!("{message}: at most {MAX_CONCAVE_CORNERS} are supported"))
        })
    }

    /// Remembers the largest index; [`Builder::finish`] compares it with the number of vertices, which may come after
    /// the faces.
    pub(super) fn note_largest(&mut self, index: u32, face: u64) {
        if self.largest.is_none_or(|(largest, _)| index > largest) {
            self.largest = Some((index, face));
        }
    }

    /// The mesh, its indices checked.
    pub(super) fn finish(mut self) -> Result<Parsed, MeshError> {
        let vertices = self.mesh.positions.len();
        if let Some((index, face)) = self.largest
            && index as usize >= vertices
        {
            let index = index as i32;
            return Err(MeshError::new(
                Place::File,
                format!("face {face} names vertex {index}, but there are {vertices} vertices"),
            ));
        }
        for polygon in std::mem::take(&mut self.polygons) {
            self.cut(polygon.face, polygon.first_triangle, &polygon.corners)?;
        }
        // Polygons grow the list by doubling: give back what is too much.
        self.mesh.triangles.shrink_to_fit();
        let dropped = Dropped { faces: self.skipped_faces, statements: None };
        Ok(Parsed { loaded: LoadedMesh { mesh: self.mesh, dropped }, face_colors: self.face_colors })
    }
}
