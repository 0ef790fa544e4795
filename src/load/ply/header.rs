//! The header of a PLY file: which elements follow, with which properties.

use super::binary::Stream;
use crate::load::mesh::{MeshError, Place};
use std::io::Read;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    BinaryLittle,
    BinaryBig,
}

/// Number types of PLY.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &str) -> Option<Scalar> {
        Some(match word {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// Bytes of one value.
    pub(super) fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    pub(super) fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }
}

/// One value or a counted list of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    One(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Clone, Debug)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

/// A table of the file: `count` rows of these properties.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes of a binary row if all rows are of one size.
    pub(super) fn stride(&self) -> Option<usize> {
        self.properties.iter().try_fold(0, |sum, p| match p.kind {
            Kind::One(s) => Some(sum + s.size()),
            Kind::List { .. } => None,
        })
    }

    /// The fewest bytes a row can take.
    fn min_row(&self, format: Format) -> u64 {
        let bytes: usize = match format {
            // A digit and what separates it; the last row's end may be missing.
            Format::Ascii => 2 * self.properties.len(),
            _ => self
                .properties
                .iter()
                .map(|p| match p.kind {
                    Kind::One(s) | Kind::List { count: s, .. } => s.size(),
                })
                .sum(),
        };
        bytes as u64
    }
}

/// A parsed header.
#[derive(Clone, Debug)]
pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Lines of the header: the body's first line is one more.
    pub lines: u64,
}

/// A header of more lines than this is no header.
const MAX_LINES: u64 = 10_000;

impl Header {
    /// Reads up to and including the line `end_header`.
    pub(super) fn read<R: Read + Send>(stream: &mut Stream<R>) -> Result<Header, MeshError> {
        let (mut lines, mut format, mut elements) = (0u64, None, Vec::<Element>::new());
        loop {
            let bad = |message: String| MeshError::new(Place::Line(lines + 1), message);
            let Some(line) = stream.line(4096)? else {
                return Err(bad(if lines == 0 {
                    "the file is empty".into()
                } else {
                    "the header has no `end_header`".into()
                }));
            };
            let Ok(line) = std::str::from_utf8(line) else {
                return Err(bad("the header is not text: not a PLY file?".into()));
            };
            let mut words = line.split_ascii_whitespace();
            let keyword = words.next().unwrap_or("");
            if lines == 0 {
                if keyword != "ply" {
                    return Err(bad("not a PLY file: the first line must be `ply`".into()));
                }
                lines += 1;
                continue;
            }
            match keyword {
                "" | "comment" | "obj_info" => {}
                "format" => {
                    format = Some(match words.next() {
                        Some("ascii") => Format::Ascii,
                        Some("binary_little_endian") => Format::BinaryLittle,
                        Some("binary_big_endian") => Format::BinaryBig,
                        other => {
                            let other = other.unwrap_or("");
                            return Err(bad(format!(
                                "unknown format `{other}`: expected ascii, binary_little_endian or binary_big_endian"
                            )));
                        }
                    });
                }
                "element" => {
                    let (Some(name), Some(count)) = (words.next(), words.next()) else {
                        return Err(bad("expected `element <name> <count>`".into()));
                    };
                    let count = count.parse().map_err(|_| bad(format!("`{count}` is not a number of rows")))?;
                    if elements.iter().any(|e| e.name == name) {
                        return Err(bad(format!("the element `{name}` is declared twice")));
                    }
                    elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                "property" => {
                    let property = parse_property(&mut words).map_err(bad)?;
                    let Some(element) = elements.last_mut() else {
                        return Err(bad("a property before any element".into()));
                    };
                    element.properties.push(property);
                }
                "end_header" => {
                    lines += 1;
                    break;
                }
                other => {
                    return Err(bad(format!(
                        "unknown keyword `{}` in the header",
                        other.chars().take(40).collect::<String>()
                    )));
                }
            }
            lines += 1;
            if lines > MAX_LINES {
                return Err(MeshError::new(Place::Line(lines), "the header has no end"));
            }
        }
        let Some(format) = format else {
            return Err(MeshError::new(Place::Line(lines), "the header has no `format` line"));
        };
        let header = Header { format, elements, lines };
        header.check_counts(stream.remaining())?;
        Ok(header)
    }

    /// No element may have more rows than the rest of the file has room for.
    fn check_counts(&self, body: u64) -> Result<(), MeshError> {
        let mut needed = 0u64;
        for e in &self.elements {
            needed = needed.saturating_add(e.count.saturating_mul(e.min_row(self.format)));
            if needed > body.saturating_add(1) || (e.count > 0 && e.properties.is_empty()) {
                return Err(MeshError::new(
                    Place::File,
                    format!(
                        "truncated: {} rows of `{}` do not fit into the {body} bytes after the header",
                        e.count, e.name
                    ),
                ));
            }
        }
        Ok(())
    }
}

fn parse_property<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<Property, String> {
    let first = words.next().unwrap_or("");
    let scalar = |word: &str| Scalar::parse(word).ok_or_else(|| format!("unknown property type `{word}`"));
    let kind = if first == "list" {
        let count = scalar(words.next().unwrap_or(""))?;
        if !count.is_integer() {
            return Err("a list's length must be of an integer type".into());
        }
        Kind::List { count, item: scalar(words.next().unwrap_or(""))? }
    } else {
        Kind::One(scalar(first)?)
    };
    let name = words.next().ok_or("a property without a name")?;
    Ok(Property { name: name.to_owned(), kind })
}
