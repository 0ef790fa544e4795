//! Mitsuba's `.serialized` meshes, versions 3 and 4: zlib streams one after the other, and a table of where each
//! begins.
//!
//! Layout (Mitsuba 0.6 documentation, "Serialized mesh loader"): u16 0x041C, u16 version, then deflated: u32 flags,
//! [version 4: name, zero], u64 vertices, u64 triangles, positions, [normals], [uvs], [colours], indices; at the file's
//! end the offsets of all meshes (u32 in version 3, u64 in version 4) and their number as u32. All little endian.

use super::mesh::{self, Dropped, LoadedMesh, MeshError, MeshOptions, Place};
use crate::image::open_regular;
use crate::math::Rgb;
use crate::scene::MeshDesc;
use flate2::read::ZlibDecoder;
use glam::{Vec2, Vec3};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

const MAGIC: u16 = 0x041C;
const HAS_NORMALS: u32 = 0x0001;
const HAS_UVS: u32 = 0x0002;
const HAS_COLORS: u32 = 0x0008;
const FACE_NORMALS: u32 = 0x0010;
const DOUBLE: u32 = 0x2000;
/// Deflate makes nothing smaller than by this factor (RFC 1951: 258 bytes from two bits).
const MAX_COMPRESSION: u64 = 1032;

/// Reads mesh number `index` of a file.
pub(super) fn read_serialized(path: &Path, index: u32, options: MeshOptions) -> Result<LoadedMesh, MeshError> {
    let (mut file, size) = open_regular(path)?;
    let (offset, end, version) = find(&mut file, size, index)?;
    file.seek(SeekFrom::Start(offset + 4))?;
    let compressed = end.saturating_sub(offset + 4);
    let mut inflated = Inflated {
        reader: ZlibDecoder::new(BufReader::new(file.take(compressed))),
        limit: compressed.saturating_mul(MAX_COMPRESSION),
        offset,
    };
    let (mut mesh, face_normals) = inflated.mesh(version)?;
    mesh::finish(&mut mesh, MeshOptions { face_normals: options.face_normals || face_normals, ..options });
    mesh.name = format!("{} #{index}", path.display());
    Ok(LoadedMesh { mesh, dropped: Dropped::default() })
}

/// Where a mesh begins and ends, and the format's version.
fn find(file: &mut File, size: u64, index: u32) -> Result<(u64, u64, u16), MeshError> {
    let bad = |at: u64, message: String| MeshError::new(Place::Byte(at), message);
    if size < 8 {
        return Err(bad(0, "truncated: not a serialized mesh".into()));
    }
    let version = header(file, 0)?;
    let width = if version >= 4 { 8 } else { 4 };
    file.seek(SeekFrom::Start(size - 4))?;
    let count = u64::from(u32::from_le_bytes(array(file)?));
    let table = size.checked_sub(4 + count * width).filter(|_| count > 0);
    let Some(table) = table else {
        return Err(bad(size - 4, format!("the table of {count} meshes does not fit into the file")));
    };
    if u64::from(index) >= count {
        return Err(MeshError::new(
            Place::File,
            format!("there is no mesh {index}: the file holds {count} (counted from 0)"),
        ));
    }
    let mut offset = |i: u64| -> Result<u64, MeshError> {
        if i == count {
            return Ok(table);
        }
        file.seek(SeekFrom::Start(table + i * width))?;
        Ok(if width == 8 { u64::from_le_bytes(array(file)?) } else { u64::from(u32::from_le_bytes(array(file)?)) })
    };
    let (begin, end) = (offset(u64::from(index))?, offset(u64::from(index) + 1)?);
    if begin.saturating_add(4) > end || end > table {
        return Err(bad(
            table + u64::from(index) * width,
            format!("mesh {index} is said to lie at bytes {begin} to {end}"),
        ));
    }
    Ok((begin, end, header(file, begin)?))
}

/// Checks the magic number at `offset` and returns the version.
fn header(file: &mut File, offset: u64) -> Result<u16, MeshError> {
    file.seek(SeekFrom::Start(offset))?;
    let [a, b, c, d] = array(file)?;
    let (magic, version) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
    if magic != MAGIC {
        return Err(MeshError::new(Place::Byte(offset), "not a serialized mesh: its first bytes must be 1C 04"));
    }
    if !(3..=4).contains(&version) {
        return Err(MeshError::new(
            Place::Byte(offset + 2),
            format!("version {version} is not known: expected 3 or 4"),
        ));
    }
    Ok(version)
}

fn array<const N: usize>(reader: &mut impl Read) -> Result<[u8; N], std::io::Error> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes)?;
    Ok(bytes)
}

struct Inflated<R> {
    reader: R,
    /// Bytes that can still come at most.
    limit: u64,
    /// Number of the mesh in the file, for messages.
    offset: u64,
}

impl<R: Read> Inflated<R> {
    fn bad(&self, message: impl Into<String>) -> MeshError {
        MeshError::new(Place::Byte(self.offset), message)
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], MeshError> {
        array(&mut self.reader).map_err(|e| self.bad(format!("broken or truncated zlib stream: {e}")))
    }

    fn mesh(&mut self, version: u16) -> Result<(MeshDesc, bool), MeshError> {
        let flags = u32::from_le_bytes(self.bytes()?);
        if version >= 4 {
            let mut length = 0;
            while self.bytes::<1>()? != [0] {
                length += 1;
                if length > 4096 {
                    return Err(self.bad("the mesh's name has no end"));
                }
            }
        }
        let vertices = u64::from_le_bytes(self.bytes()?);
        let triangles = u64::from_le_bytes(self.bytes()?);
        let float = if flags & DOUBLE != 0 { 8 } else { 4 };
        let per_vertex =
            [(true, 3), (flags & HAS_NORMALS != 0, 3), (flags & HAS_UVS != 0, 2), (flags & HAS_COLORS != 0, 3)];
        let floats: u64 = per_vertex.iter().filter(|p| p.0).map(|p| p.1).sum();
        let needed = vertices.saturating_mul(floats * float).saturating_add(triangles.saturating_mul(12));
        if needed > self.limit || vertices > u64::from(u32::MAX) {
            return Err(
                self.bad(format!("truncated: {vertices} vertices and {triangles} triangles do not fit into the file"))
            );
        }
        let (n, double) = (vertices as usize, flags & DOUBLE != 0);
        let mut mesh = MeshDesc { positions: self.rows(n, double, Vec3::from_array)?, ..MeshDesc::default() };
        if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
            return Err(self.bad(format!("vertex {i} is not finite")));
        }
        if flags & HAS_NORMALS != 0 {
            mesh.normals = self.rows(n, double, Vec3::from_array)?;
        }
        if flags & HAS_UVS != 0 {
            mesh.uvs = self.rows(n, double, Vec2::from_array)?;
            if let Some(i) = mesh.uvs.iter().position(|p| !p.is_finite()) {
                return Err(self.bad(format!("the texture coordinates of vertex {i} are not finite")));
            }
        }
        if flags & HAS_COLORS != 0 {
            mesh.colors = self.rows(n, double, Rgb::from)?;
        }
        mesh.triangles.reserve_exact(triangles as usize);
        for i in 0..triangles {
            let raw: [u8; 12] = self.bytes()?;
            let t: [u32; 3] = std::array::from_fn(|k| u32::from_le_bytes(std::array::from_fn(|b| raw[4 * k + b])));
            if t.iter().any(|&v| v as usize >= n) {
                return Err(self.bad(format!(
                    "triangle {i} names vertex {}, but there are {n} vertices",
                    t.iter().max().unwrap_or(&0)
                )));
            }
            mesh.triangles.push(t);
        }
        Ok((mesh, flags & FACE_NORMALS != 0))
    }

    fn rows<T, const N: usize>(
        &mut self,
        count: usize,
        double: bool,
        make: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, MeshError> {
        let mut out = Vec::with_capacity(count);
        for _ in 0..count {
            let mut row = [0.0f32; N];
            for v in &mut row {
                *v = if double { f64::from_le_bytes(self.bytes()?) as f32 } else { f32::from_le_bytes(self.bytes()?) };
            }
            out.push(make(row));
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::ZlibEncoder};
    use std::io::Write;

    /// Two meshes: one triangle each, the second one shifted.
    fn file(version: u16, flags: u32) -> Vec<u8> {
        let (mut out, mut offsets) = (Vec::new(), Vec::new());
        for shift in [0.0, 5.0] {
            offsets.push(out.len() as u64);
            out.extend([0x1C, 0x04]);
            out.extend(version.to_le_bytes());
            let mut z = ZlibEncoder::new(&mut out, Compression::default());
            z.write_all(&flags.to_le_bytes()).unwrap();
            if version == 4 {
                z.write_all(b"name\0").unwrap();
            }
            z.write_all(&3u64.to_le_bytes()).unwrap();
            z.write_all(&1u64.to_le_bytes()).unwrap();
            let mut put = |v: f64| {
                if flags & DOUBLE != 0 {
                    z.write_all(&v.to_le_bytes())
                } else {
                    z.write_all(&(v as f32).to_le_bytes())
                }
                .unwrap();
            };
            [shift, 0., 0., 1., 0., 0., 0., 1., 0.].into_iter().for_each(&mut put);
            if flags & HAS_UVS != 0 {
                [0., 0., 1., 0., 0., 1.].into_iter().for_each(&mut put);
            }
            for i in [0u32, 1, 2] {
                z.write_all(&i.to_le_bytes()).unwrap();
            }
            z.finish().unwrap();
        }
        for o in &offsets {
            if version == 4 { out.extend(o.to_le_bytes()) } else { out.extend((*o as u32).to_le_bytes()) }
        }
        out.extend(2u32.to_le_bytes());
        out
    }

    fn read(bytes: &[u8], index: u32) -> Result<LoadedMesh, MeshError> {
        let mut f = tempfile::NamedTempFile::new().unwrap();
        f.write_all(bytes).unwrap();
        read_serialized(f.path(), index, MeshOptions { face_normals: true, ..MeshOptions::default() })
    }

    #[test]
    fn reads_both_versions_and_precisions() {
        for version in [3, 4] {
            for flags in [0x1000 | HAS_UVS, DOUBLE | HAS_UVS] {
                let m = read(&file(version, flags), 1).unwrap().mesh;
                assert_eq!(m.positions, [Vec3::new(5.0, 0.0, 0.0), Vec3::X, Vec3::Y]);
                assert_eq!(m.uvs, [Vec2::ZERO, Vec2::X, Vec2::Y]);
                assert_eq!(m.triangles, [[0, 1, 2]]);
            }
        }
    }

    /// tests/data/meshes/serialized.py wrote the file; Mitsuba 3.9.1, scalar_rgb, reads the same numbers in it.
    #[test]
    fn a_file_of_version_4_is_read_as_mitsuba_reads_it() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/meshes/version4.serialized");
        let positions = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.5]].map(Vec3::from);
        let plain = read_serialized(&path, 0, MeshOptions::default()).unwrap().mesh;
        assert_eq!((plain.positions.as_slice(), plain.uvs.len(), plain.colors.len()), (positions.as_slice(), 0, 0));
        assert_eq!(plain.triangles, [[0, 1, 2], [0, 2, 3]]);
        let generated = [[0.121_771_54, -0.121_771_54, 0.985_060_1], [0.0, 0.0, 1.0]].map(Vec3::from);
        assert!(plain.normals.iter().zip(generated).all(|(n, want)| (n - want).length() < 1e-6), "{:?}", plain.normals);
        let full = read_serialized(&path, 1, MeshOptions::default()).unwrap().mesh;
        assert_eq!(full.positions, positions);
        assert_eq!(full.normals, [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]].map(Vec3::from));
        assert_eq!(full.uvs, [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
        assert_eq!(full.colors, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]].map(Rgb::from));
    }

    #[test]
    fn mistakes_are_placed() {
        let good = file(4, 0x1000);
        let message = |bytes: &[u8], index| read(bytes, index).unwrap_err().to_string();
        assert!(message(&good, 2).contains("no mesh 2"));
        assert!(message(&good[..6], 0).contains("byte 0: truncated"));
        let mut broken = good.clone();
        broken[0] = 0;
        assert!(message(&broken, 0).starts_with("byte 0: not a serialized"));
        let mut broken = good.clone();
        broken[20] ^= 0xFF;
        assert!(message(&broken, 0).starts_with("byte 0:"));
        let mut broken = good.clone();
        let n = broken.len();
        broken[n - 4..].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(message(&broken, 0).contains("does not fit"));
    }

    #[test]
    fn no_single_wrong_byte_panics() {
        let good = file(4, 0x1000 | HAS_UVS);
        for i in 0..good.len() {
            let mut broken = good.clone();
            broken[i] ^= 0x55;
            // Either it is noticed or it changed a number; indices are always in range.
            if let Ok(m) = read(&broken, 0) {
                assert!(m.mesh.triangles.iter().flatten().all(|&v| (v as usize) < m.mesh.positions.len()));
            }
        }
    }
}
