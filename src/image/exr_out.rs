//! OpenEXR out: every layer in one part, as one flat list of channels, which is what viewers show most reliably.

use super::write::Picture;
use exr::prelude as e;
use std::collections::BTreeSet;
use std::io::Cursor;

/// The file's bytes; the sizes of the channels have been checked.
pub(super) fn encode(picture: &Picture) -> Result<Vec<u8>, String> {
    let mut seen = BTreeSet::new();
    let mut channels = e::SmallVec::new();
    for layer in &picture.layers {
        for (name, values) in &layer.channels {
            let name = if layer.name.is_empty() { (*name).to_owned() } else { format!("{}.{name}", layer.name) };
            check_name(&name)?;
            if !seen.insert(name.clone()) {
                return Err(format!("there are two channels of the name {name}"));
            }
            channels.push(e::AnyChannel::new(text(&name), e::FlatSamples::F32(values.clone())));
        }
    }
    if channels.is_empty() {
        return Err("the picture has no channels".into());
    }

    let encoding = e::Encoding::SMALL_LOSSLESS;
    let mut attributes = e::LayerAttributes::default();
    for (name, value) in &picture.metadata {
        check_name(name)?;
        if attributes.other.insert(text(name), e::AttributeValue::Text(text(value))).is_some() {
            return Err(format!("there are two metadata of the name {name}"));
        }
    }
    let size = (picture.width as usize, picture.height as usize);
    let layer = e::Layer::new(size, attributes, encoding, e::AnyChannels::sort(channels));
    let mut out = Cursor::new(Vec::new());
    use e::WritableImage;
    e::Image::from_layer(layer).write().to_buffered(&mut out).map_err(|e| e.to_string())?;
    let mut bytes = out.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Names end with a zero byte in the file, and 255 bytes is the format's limit.
fn check_name(name: &str) -> Result<(), String> {
    if name.is_empty() || name.len() > 255 || name.contains('\0') {
        return Err(format!("\"{}\" cannot be a name in an EXR file", name.escape_default()));
    }
    Ok(())
}

/// UTF-8, as OpenEXR's own text functions write it.
fn text(s: &str) -> e::Text {
    e::Text::from_slice_unchecked(s.as_bytes())
}

/// Orders the header's attributes by name. The writer keeps them in a hash table, whose order differs from run to run;
/// offsets in the file stay right, as the header's length stays the same.
fn sort_attributes(file: &mut [u8]) {
    const HEADER: usize = 8; // magic number and version
    let mut found = Vec::new();
    let mut at = HEADER;
    while file.get(at).is_some_and(|&b| b != 0) {
        let Some(length) = attribute_length(&file[at..]) else { return };
        found.push(file[at..at + length].to_vec());
        at += length;
    }
    // A name ends with a zero byte, so comparing whole attributes compares names first.
    found.sort();
    file[HEADER..at].copy_from_slice(&found.concat());
}

/// Bytes of the attribute at the beginning: name, zero, type, zero, length of the value (32 bits), value.
fn attribute_length(bytes: &[u8]) -> Option<usize> {
    let name = bytes.iter().position(|&b| b == 0)?;
    let kind = bytes[name + 1..].iter().position(|&b| b == 0)?;
    let size_at = name + kind + 2;
    let size = bytes.get(size_at..size_at + 4)?;
    let length = size_at + 4 + u32::from_le_bytes([size[0], size[1], size[2], size[3]]) as usize;
    (length <= bytes.len()).then_some(length)
}
