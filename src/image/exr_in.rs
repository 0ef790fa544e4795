//! OpenEXR in: one layer's colours out of a file with any channels, straight into one float picture.
//!
//! The `exr` crate decodes the blocks; only the samples of the wanted channels are kept.

use super::buffer::{Image, Pixels};
use super::read::{ImageFault, check_size};
use exr::block::reader::ChunksReader;
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::attribute::{ChannelList, SampleType};
use std::io::Cursor;

const NAME: &str = "EXR";

/// Channels that can be interleaved into a picture, in the order of preference.
const SETS: [&[&str]; 3] = [&["R", "G", "B", "A"], &["R", "G", "B"], &["Y"]];

fn fault(e: exr::error::Error) -> ImageFault {
    match e {
        exr::error::Error::NotSupported(what) => ImageFault::unsupported(NAME, what),
        e => ImageFault::damaged(NAME, e.to_string()),
    }
}

/// Decodes the nameless layer if it has colours, else the first layer that has; the data window, full resolution.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, ImageFault> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(fault)?;

    let flat = || reader.headers().iter().enumerate().filter(|(_, h)| !h.deep);
    let Some((part, header)) = flat()
        .find(|(_, h)| colours(&h.channels).is_some())
        .or_else(|| flat().find(|(_, h)| h.channels.list.len() == 1))
    else {
        return Err(match reader.headers().iter().find(|h| !h.deep) {
            None => ImageFault::unsupported(NAME, "deep pixels"),
            Some(header) => ImageFault::unsupported(
                NAME,
                format!("channels without R, G, B or Y (found: {})", names(&header.channels)),
            ),
        });
    };
    // A lone channel of any name is a grey picture.
    let wanted = colours(&header.channels).unwrap_or_else(|| vec![0]);
    if wanted.iter().any(|&c| header.channels.list[c].sampling != Vec2(1, 1)) {
        return Err(ImageFault::unsupported(NAME, "channels of a lower resolution"));
    }

    let Vec2(width, height) = header.layer_size;
    let bytes_per_pixel: usize = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample()).sum();
    // DWA stores a constant block of 8 x 8 pixels as one number, and those numbers are deflated.
    let dwa = matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_));
    let file_bytes = bytes.len() as u64 * if dwa { 64 } else { 1 };
    check_size(width as u64, height as u64, bytes_per_pixel as u64, file_bytes)?;
    let channels = wanted.len();
    check_size(width as u64, height as u64, 4 * channels as u64, u64::MAX)?;
    // For each channel of the file, its place in the picture.
    let place: Vec<Option<usize>> =
        (0..header.channels.list.len()).map(|c| wanted.iter().position(|&w| w == c)).collect();

    let mut values = vec![0.0_f32; width * height * channels];
    let chunks = reader
        .filter_chunks(false, |_, tile, block| block.layer == part && tile.level_index == Vec2(0, 0))
        .map_err(fault)?;
    chunks
        .decompress_sequential(false, |meta, block| {
            let list = &meta.headers[part].channels;
            for line in block.lines(list) {
                let Some(channel) = place[line.location.channel] else { continue };
                let Vec2(x, y) = line.location.position;
                let row = (y * width + x) * channels;
                let to = values[row..row + line.location.sample_count * channels].iter_mut().skip(channel);
                let to = to.step_by(channels);
                match list.list[line.location.channel].sample_type {
                    SampleType::F16 => copy(line.value, to, |b: [u8; 2]| exr::prelude::f16::from_ne_bytes(b).to_f32()),
                    SampleType::F32 => copy(line.value, to, f32::from_ne_bytes),
                    SampleType::U32 => copy(line.value, to, |b: [u8; 4]| u32::from_ne_bytes(b) as f32),
                }
            }
            Ok(())
        })
        .map_err(fault)?;
    Ok(Image { width: width as u32, height: height as u32, channels: channels as u32, pixels: Pixels::F32(values) })
}

fn copy<'a, const N: usize>(from: &[u8], to: impl Iterator<Item = &'a mut f32>, value: impl Fn([u8; N]) -> f32) {
    let (samples, _) = from.as_chunks::<N>();
    for (to, &sample) in to.zip(samples) {
        *to = value(sample);
    }
}

/// Indices of the channels that make a picture: those of the nameless layer, else of the first layer with colours.
fn colours(channels: &ChannelList) -> Option<Vec<usize>> {
    let names: Vec<String> = channels.list.iter().map(|c| c.name.to_string()).collect();
    let mut layers: Vec<&str> = names.iter().map(|n| n.rfind('.').map_or("", |dot| &n[..=dot])).collect();
    // Stable, so that the others stay in the file's (alphabetical) order.
    layers.sort_by_key(|layer| !layer.is_empty());
    layers.dedup();
    layers.iter().find_map(|layer| {
        SETS.iter().find_map(|set| {
            let index = |wanted: &&str| names.iter().position(|n| n.strip_prefix(layer) == Some(*wanted));
            set.iter().map(index).collect::<Option<Vec<usize>>>()
        })
    })
}

fn names(channels: &ChannelList) -> String {
    let all: Vec<String> = channels.list.iter().take(12).map(|c| c.name.to_string()).collect();
    all.join(", ")
}
