//! Stanford PLY: ASCII and both binary byte orders, any order and type of properties, streamed.
//!
//! The file is never held as a whole: a chunk is read, converted into the mesh's own arrays, and forgotten. Counts in
//! the header are believed only as far as the file is long enough for them, so that a broken header cannot ask for all
//! memory. The crate `ply-rs` and its successor `ply-rs-bw` collect a value per element, with a `Vec` for each list,
//! before a mesh can be made of them, and do not say at which byte a binary file is wrong; so neither is used.
//!
//! Known vertex properties: `x y z`, `nx ny nz`, `u v` (or `s t`, `texture_u texture_v`, `texture_s texture_t`), `r g
//! b` (or `red green blue`; eight-bit colours are taken as sRGB; faces may have them too). Faces: `vertex_indices` or `vertex_index`; polygons
//! are cut into triangles.

mod ascii;
mod binary;
mod build;
mod header;

use super::mesh::{self, LoadedMesh, MeshColors, MeshError, MeshOptions, Place};
use crate::image::open_regular;
use crate::math::Rgb;
use build::Builder;
use header::{Format, Header};
use std::io::Read;
use std::path::Path;

/// Reads a PLY file.
pub(super) fn read_ply(path: &Path, options: MeshOptions) -> Result<LoadedMesh, MeshError> {
    let (file, size) = open_regular(path)?;
    let Parsed { mut loaded, face_colors } = parse_ply(file, size, options)?;
    if options.colors == MeshColors::Face {
        loaded.mesh.colors = Vec::new();
    }
    mesh::finish(&mut loaded.mesh, options);
    if !face_colors.is_empty() {
        mesh::color_faces(&mut loaded.mesh, &face_colors);
    }
    loaded.mesh.name = path.display().to_string();
    Ok(loaded)
}

/// The contents of a file.
#[derive(Debug)]
struct Parsed {
    loaded: LoadedMesh,
    /// One for each triangle, if the options ask for colours of faces and the file has them.
    face_colors: Vec<Rgb>,
}

/// Parses a PLY stream of `size` bytes. Normals of vertices are kept as they are, if the options want them.
fn parse_ply(reader: impl Read + Send, size: u64, options: MeshOptions) -> Result<Parsed, MeshError> {
    let mut stream = binary::Stream::new(reader, size);
    let header = Header::read(&mut stream)?;
    let mut builder = Builder::new(options);
    match header.format {
        Format::Ascii => ascii::read_body(&header, &mut stream, &mut builder)?,
        Format::BinaryLittle => binary::read_body::<binary::Little, _>(&header, &mut stream, &mut builder)?,
        Format::BinaryBig => binary::read_body::<binary::Big, _>(&header, &mut stream, &mut builder)?,
    }
    if !header.elements.iter().any(|e| e.name == "vertex") {
        return Err(MeshError::new(Place::File, "the header declares no `vertex` element"));
    }
    builder.finish()
}

#[cfg(test)]
mod tests;
