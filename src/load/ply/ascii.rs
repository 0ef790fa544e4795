//! The body of an ASCII PLY file: one row a line.

use super::binary::Stream;
use super::build::{Builder, Face, FaceLayout, VertexLayout};
use super::header::{Element, Header, Kind};
use crate::load::mesh::{MeshError, Place};
use std::io::Read;

/// No sensible row is longer.
const MAX_LINE: usize = 1 << 20;

/// Reads all elements.
pub(super) fn read_body<R: Read + Send>(
    header: &Header,
    stream: &mut Stream<R>,
    builder: &mut Builder,
) -> Result<(), MeshError> {
    let mut line = header.lines;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => {
                let layout = VertexLayout::of(element, builder.normals_unwanted)?;
                builder.reserve_vertices(&layout, element.count)?;
                let mut row = Vec::new();
                for _ in 0..element.count {
                    each_number(element, stream, &mut line, |property, number, value| {
                        if number == 0 {
                            row.resize(property + 1, value);
                            row[property] = value;
                        }
                        Ok(())
                    })?;
                    builder.vertex(&layout, &row);
                    if builder.first_broken_vertex(builder.mesh.positions.len() - 1).is_some() {
                        return Err(MeshError::new(Place::Line(line), "a vertex is not finite"));
                    }
                    row.clear();
                }
            }
            "face" => {
                let layout = FaceLayout::of(element, builder)?;
                builder.mesh.triangles.reserve_exact(element.count as usize);
                let mut face = Face::default();
                for number in 0..element.count {
                    each_number(element, stream, &mut line, |property, _, value| {
                        if let Some(component) = layout.component(property) {
                            face.color[component] = value;
                        }
                        if property == layout.list {
                            if value.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&value) {
                                return Err(format!("`{value}` is not the index of a vertex"));
                            }
                            face.corners.push(value as u32);
                        }
                        Ok(())
                    })?;
                    builder.face_row(number, &face, &layout)?;
                    face.corners.clear();
                }
            }
            _ => {
                for _ in 0..element.count {
                    each_number(element, stream, &mut line, |_, _, _| Ok(()))?;
                }
            }
        }
    }
    Ok(())
}

/// Reads one row and hands out its numbers: index of the property, position within its list, value.
fn each_number<R: Read + Send>(
    element: &Element,
    stream: &mut Stream<R>,
    line: &mut u64,
    mut each: impl FnMut(usize, u64, f64) -> Result<(), String>,
) -> Result<(), MeshError> {
    let text = loop {
        *line += 1;
        let Some(text) = stream.line(MAX_LINE)? else {
            return Err(MeshError::new(
                Place::Line(*line),
                format!("truncated: the file ends within the `{}` rows", element.name),
            ));
        };
        if !text.trim_ascii().is_empty() {
            break text;
        }
    };
    let bad = |message: String| MeshError::new(Place::Line(*line), message);
    let text = std::str::from_utf8(text).map_err(|_| bad("not text".into()))?;
    let mut words = text.split_ascii_whitespace();
    let mut number = |name: &str| {
        let word = words
            .next()
            .ok_or_else(|| bad(format!("`{name}` is missing: the row of `{}` is too short", element.name)))?;
        word.parse::<f64>().map_err(|_| bad(format!("`{word}` is not a number")))
    };
    for (index, property) in element.properties.iter().enumerate() {
        match property.kind {
            Kind::One(_) => each(index, 0, number(&property.name)?).map_err(bad)?,
            Kind::List { .. } => {
                let count = number(&property.name)?;
                if !(0.0..=MAX_LINE as f64).contains(&count) || count.fract() != 0.0 {
                    return Err(bad(format!("`{count}` is not the length of a list")));
                }
                for i in 0..count as u64 {
                    each(index, i, number(&property.name)?).map_err(bad)?;
                }
            }
        }
    }
    Ok(())
}
