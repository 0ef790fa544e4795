//! The body of a binary PLY file, chunk by chunk.
//!
//! Layouts that nearly all files have (float vertices, faces as one list of `uchar` length with 32-bit indices, little
//! endian) run through loops without any decision per value; everything else through a table.

use super::build::{Builder, Face, FaceLayout, VertexLayout};
use super::header::{Element, Header, Kind, Scalar};
use crate::load::mesh::{MeshError, Place};
use glam::{Vec2, Vec3};
use std::io::Read;

/// Bytes read at a time: small enough for the second-level cache, where the conversion finds them again.
const CHUNK: usize = 256 * 1024;

/// A file read in chunks, with its position known.
pub(super) struct Stream<R> {
    reader: R,
    buffer: Vec<u8>,
    /// The unread part of `buffer`.
    begin: usize,
    end: usize,
    /// Offset in the file of `buffer[0]`.
    base: u64,
    size: u64,
}

impl<R: Read + Send> Stream<R> {
    /// A stream of `size` bytes.
    pub(super) fn new(reader: R, size: u64) -> Stream<R> {
        Stream { reader, buffer: vec![0; CHUNK], begin: 0, end: 0, base: 0, size }
    }

    /// Offset in the file of the next unread byte.
    fn position(&self) -> u64 {
        self.base + self.begin as u64
    }

    /// Bytes of the file that are not read yet.
    pub(super) fn remaining(&self) -> u64 {
        self.size.saturating_sub(self.position())
    }

    fn available(&self) -> &[u8] {
        &self.buffer[self.begin..self.end]
    }

    /// Reads more behind what is there; false at the end of the file.
    fn fill(&mut self) -> Result<bool, MeshError> {
        if self.begin > 0 {
            self.buffer.copy_within(self.begin..self.end, 0);
            self.base += self.begin as u64;
            self.end -= self.begin;
            self.begin = 0;
        }
        if self.end == self.buffer.len() {
            self.buffer.resize(self.buffer.len() * 2, 0);
        }
        loop {
            match self.reader.read(&mut self.buffer[self.end..]) {
                Ok(0) => return Ok(false),
                Ok(n) => {
                    self.end += n;
                    return Ok(true);
                }
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e.into()),
            }
        }
    }

    /// Makes at least `count` bytes available.
    fn need(&mut self, count: usize, what: &str) -> Result<(), MeshError> {
        // Checked first, so that a length from a broken file cannot grow the buffer.
        if count as u64 > self.remaining() {
            return Err(MeshError::new(
                Place::Byte(self.position()),
                format!("truncated: the file ends within the `{what}` rows"),
            ));
        }
        while self.end - self.begin < count {
            if !self.fill()? {
                return Err(MeshError::new(
                    Place::Byte(self.base + self.end as u64),
                    format!("truncated: the file ends within the `{what}` rows"),
                ));
            }
        }
        Ok(())
    }

    /// The next line without its end, or `None` at the end of the file.
    pub(super) fn line(&mut self, limit: usize) -> Result<Option<&[u8]>, MeshError> {
        let mut searched = 0;
        let length = loop {
            if let Some(i) = self.available()[searched..].iter().position(|&b| b == b'\n') {
                break searched + i;
            }
            searched = self.available().len();
            if searched > limit {
                return Err(MeshError::new(Place::Byte(self.position()), "a line has no end: not a PLY file?"));
            }
            if !self.fill()? {
                if searched == 0 {
                    return Ok(None);
                }
                break searched;
            }
        };
        let begin = self.begin;
        self.begin = (begin + length + 1).min(self.end);
        Ok(Some(self.buffer[begin..begin + length].trim_ascii_end()))
    }
}

/// A byte order.
pub(super) trait Order {
    fn f32(b: [u8; 4]) -> f32;
    fn f64(b: [u8; 8]) -> f64;
    fn u16(b: [u8; 2]) -> u16;
    fn u32(b: [u8; 4]) -> u32;
}

/// Least significant byte first.
pub(super) struct Little;
/// Most significant byte first.
pub(super) struct Big;

macro_rules! order {
    ($name:ident, $from:ident) => {
        impl Order for $name {
            fn f32(b: [u8; 4]) -> f32 {
                f32::$from(b)
            }
            fn f64(b: [u8; 8]) -> f64 {
                f64::$from(b)
            }
            fn u16(b: [u8; 2]) -> u16 {
                u16::$from(b)
            }
            fn u32(b: [u8; 4]) -> u32 {
                u32::$from(b)
            }
        }
    };
}
order!(Little, from_le_bytes);
order!(Big, from_be_bytes);

/// The `N` bytes at `offset`, which the caller has made sure are there. (One test and one load: this is the innermost
/// loop.)
#[inline(always)]
fn bytes<const N: usize>(row: &[u8], offset: usize) -> [u8; N] {
    row.get(offset..offset + N).and_then(|b| b.try_into().ok()).unwrap_or([0; N])
}

fn scalar<O: Order>(kind: Scalar, row: &[u8], offset: usize) -> f64 {
    match kind {
        Scalar::I8 => f64::from(row[offset] as i8),
        Scalar::U8 => f64::from(row[offset]),
        Scalar::I16 => f64::from(O::u16(bytes(row, offset)) as i16),
        Scalar::U16 => f64::from(O::u16(bytes(row, offset))),
        Scalar::I32 => f64::from(O::u32(bytes(row, offset)) as i32),
        Scalar::U32 => f64::from(O::u32(bytes(row, offset))),
        Scalar::F32 => f64::from(O::f32(bytes(row, offset))),
        Scalar::F64 => O::f64(bytes(row, offset)),
    }
}

/// An index; negative ones become huge and fail the range check at the end.
fn index<O: Order>(kind: Scalar, row: &[u8], offset: usize) -> u32 {
    match kind {
        Scalar::I8 => row[offset] as i8 as u32,
        Scalar::U8 => u32::from(row[offset]),
        Scalar::I16 => O::u16(bytes(row, offset)) as i16 as u32,
        Scalar::U16 => u32::from(O::u16(bytes(row, offset))),
        Scalar::I32 | Scalar::U32 => O::u32(bytes(row, offset)),
        // The header does not let them through as indices.
        Scalar::F32 | Scalar::F64 => u32::MAX,
    }
}

/// Reads all elements.
pub(super) fn read_body<O: Order, R: Read + Send>(
    header: &Header,
    stream: &mut Stream<R>,
    builder: &mut Builder,
) -> Result<(), MeshError> {
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_vertices::<O, R>(element, stream, builder)?,
            "face" => read_faces::<O, R>(element, stream, builder)?,
            _ => each_row::<O, R>(element, stream, |_, _| Ok(()))?,
        }
    }
    Ok(())
}

fn read_vertices<O: Order, R: Read + Send>(
    element: &Element,
    stream: &mut Stream<R>,
    builder: &mut Builder,
) -> Result<(), MeshError> {
    let layout = VertexLayout::of(element, builder.normals_unwanted)?;
    builder.reserve_vertices(&layout, element.count)?;
    let Some(stride) = element.stride() else {
        // A list among the vertex properties: slow and rare.
        let mut row = vec![0.0; element.properties.len()];
        let mut first_bad = None;
        each_row::<O, R>(element, stream, |property, values| {
            if let Row::One(v) = values {
                row[property] = v;
            }
            if property + 1 == row.len() {
                builder.vertex(&layout, &row);
                let last = builder.mesh.positions.len() - 1;
                first_bad = first_bad.or(builder.first_broken_vertex(last));
            }
            Ok(())
        })?;
        return first_bad.map_or(Ok(()), |v| Err(MeshError::new(Place::File, format!("vertex {v} is not finite"))));
    };
    let table: Vec<(Scalar, usize)> = element
        .properties
        .iter()
        .scan(0, |offset, p| {
            let Kind::One(s) = p.kind else { return None };
            let at = *offset;
            *offset += s.size();
            Some((s, at))
        })
        .collect();
    let is_float = |i: &[usize]| i.iter().all(|&i| table[i].0 == Scalar::F32);
    let fast = is_float(&layout.position)
        && layout.normal.is_none_or(|i| is_float(&i))
        && layout.uv.is_none_or(|i| is_float(&i))
        && layout.color.is_none();

    let mut left = element.count;
    let mut row_values = vec![0.0; table.len()];
    while left > 0 {
        stream.need(stride, "vertex")?;
        let rows = ((stream.available().len() / stride) as u64).min(left) as usize;
        let (start, first) = (stream.position(), builder.mesh.positions.len());
        let chunk = &stream.available()[..rows * stride];
        if fast {
            let mesh = &mut builder.mesh;
            let three = |i: [usize; 3]| {
                let at = i.map(|i| table[i].1);
                move |r: &[u8]| Vec3::from(at.map(|at| O::f32(bytes(r, at))))
            };
            mesh.positions.extend(chunk.chunks_exact(stride).map(three(layout.position)));
            if let Some(i) = layout.normal {
                mesh.normals.extend(chunk.chunks_exact(stride).map(three(i)));
            }
            if let Some(i) = layout.uv {
                let at = i.map(|i| table[i].1);
                mesh.uvs.extend(chunk.chunks_exact(stride).map(|r| Vec2::from(at.map(|at| O::f32(bytes(r, at))))));
            }
        } else {
            for row in chunk.chunks_exact(stride) {
                for (value, &(kind, offset)) in row_values.iter_mut().zip(&table) {
                    *value = scalar::<O>(kind, row, offset);
                }
                builder.vertex(&layout, &row_values);
            }
        }
        if let Some(bad) = builder.first_broken_vertex(first) {
            return Err(MeshError::new(
                Place::Byte(start + ((bad - first) * stride) as u64),
                format!("vertex {bad} is not finite"),
            ));
        }
        stream.begin += rows * stride;
        left -= rows as u64;
    }
    Ok(())
}

fn read_faces<O: Order, R: Read + Send>(
    element: &Element,
    stream: &mut Stream<R>,
    builder: &mut Builder,
) -> Result<(), MeshError> {
    let layout = FaceLayout::of(element, builder)?;
    // No more than the file has room for: the header was checked.
    builder.mesh.triangles.reserve_exact(element.count as usize);
    let usual = element.properties.len() == 1
        && matches!(element.properties[0].kind, Kind::List { count: Scalar::U8, item: Scalar::I32 | Scalar::U32 });
    let mut row = Face::default();
    let mut face = 0u64;
    if usual {
        while face < element.count {
            stream.need(1, "face")?;
            // A run of triangles: rows of 13 bytes, each beginning with a 3.
            let rows = stream
                .available()
                .chunks_exact(13)
                .take((element.count - face) as usize)
                .take_while(|r| r[0] == 3)
                .count();
            if rows > 0 {
                let first = builder.mesh.triangles.len();
                let corner = |r: &[u8]| [1, 5, 9].map(|at| O::u32(bytes(r, at)));
                let chunk = &stream.available()[..rows * 13];
                builder.mesh.triangles.extend(chunk.chunks_exact(13).map(corner));
                let largest = builder.mesh.triangles[first..].iter().fold(0, |m, t| m.max(t[0]).max(t[1]).max(t[2]));
                if largest as usize >= builder.mesh.positions.len() {
                    let at = builder.mesh.triangles[first..].iter().position(|t| t.contains(&largest)).unwrap_or(0);
                    builder.note_largest(largest, face + at as u64);
                } else {
                    builder.note_largest(largest, face);
                }
                stream.begin += rows * 13;
                face += rows as u64;
                continue;
            }
            let count = usize::from(stream.available()[0]);
            stream.need(1 + 4 * count, "face")?;
            row.corners.clear();
            row.corners.extend((0..count).map(|i| O::u32(bytes(stream.available(), 1 + 4 * i))));
            builder.face(face, &row.corners)?;
            stream.begin += 1 + 4 * count;
            face += 1;
        }
        return Ok(());
    }
    let last = element.properties.len() - 1;
    each_row::<O, R>(element, stream, |property, values| {
        match values {
            Row::List(item, data) if property == layout.list => {
                row.corners.clear();
                row.corners.extend(data.chunks_exact(item.size()).map(|v| index::<O>(item, v, 0)));
            }
            Row::One(value) => {
                if let Some(component) = layout.component(property) {
                    row.color[component] = value;
                }
            }
            Row::List(..) => {}
        }
        if property == last {
            builder.face_row(face, &row, &layout)?;
            face += 1;
        }
        Ok(())
    })
}

/// The value of one property in one row.
enum Row<'a> {
    One(f64),
    List(Scalar, &'a [u8]),
}

/// Walks over all rows of an element of any layout.
fn each_row<O: Order, R: Read + Send>(
    element: &Element,
    stream: &mut Stream<R>,
    mut each: impl FnMut(usize, Row<'_>) -> Result<(), MeshError>,
) -> Result<(), MeshError> {
    for _ in 0..element.count {
        for (i, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::One(kind) => {
                    stream.need(kind.size(), &element.name)?;
                    each(i, Row::One(scalar::<O>(kind, stream.available(), 0)))?;
                    stream.begin += kind.size();
                }
                Kind::List { count, item } => {
                    stream.need(count.size(), &element.name)?;
                    let length = scalar::<O>(count, stream.available(), 0);
                    if length < 0.0 {
                        return Err(MeshError::new(Place::Byte(stream.position()), "a list of negative length"));
                    }
                    stream.begin += count.size();
                    let length = (length as u64).saturating_mul(item.size() as u64);
                    let length = usize::try_from(length).unwrap_or(usize::MAX);
                    stream.need(length, &element.name)?;
                    each(i, Row::List(item, &stream.available()[..length]))?;
                    stream.begin += length;
                }
            }
        }
    }
    Ok(())
}
