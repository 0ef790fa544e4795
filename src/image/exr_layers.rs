//! OpenEXR in, all of it: every channel of full resolution under its full name, and the header's texts. For pictures
//! that this program has written and that somebody wants to compute with; textures go through [`super::read_image`].

use super::buffer::{Image, Pixels};
use super::read::{ImageError, ImageFault, check_size, read_file};
use super::write::{Layer, Picture};
use exr::prelude as e;
use std::io::Cursor;
use std::path::Path;

/// Everything in an EXR file.
#[derive(Clone, Debug)]
pub struct ExrFile {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Full names (`R`, `variance.G`, …) and values, row by row from the top.
    pub channels: Vec<(String, Vec<f32>)>,
    /// Names and values of the header's texts.
    pub metadata: Vec<(String, String)>,
}

/// Channels that pictures of this program are made of.
const CHANNELS: [&str; 7] = ["R", "G", "B", "A", "X", "Y", "Z"];

impl ExrFile {
    /// Reads a file.
    ///
    /// # Errors
    /// [`ImageError`] for anything that is not a sound EXR file.
    pub fn read(path: &Path) -> Result<ExrFile, ImageError> {
        read_file(path)
            .and_then(|bytes| ExrFile::decode(&bytes))
            .map_err(|fault| ImageError { path: path.to_owned(), fault })
    }

    fn decode(bytes: &[u8]) -> Result<ExrFile, ImageFault> {
        if !bytes.starts_with(b"\x76\x2f\x31\x01") {
            return Err(ImageFault::damaged("EXR", "it does not begin like one"));
        }
        // A decoder that panics has a bug of its own; whoever has a damaged file should still get an error that names
        // it.
        std::panic::catch_unwind(|| decode(bytes))
            .unwrap_or_else(|_| Err(ImageFault::damaged("EXR", "its decoder gave up")))
    }

    /// A text of the header.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.metadata.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str())
    }

    /// The channel of that full name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_slice())
    }

    /// Colours of a layer (empty name: the picture), if it has them.
    pub fn colours(&self, layer: &str) -> Option<Vec<[f64; 3]>> {
        let name = |c: &str| if layer.is_empty() { c.to_owned() } else { format!("{layer}.{c}") };
        let (r, g, b) = (self.channel(&name("R"))?, self.channel(&name("G"))?, self.channel(&name("B"))?);
        Some(r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b].map(f64::from)).collect())
    }

    /// The nameless layer as a picture in memory.
    pub fn image(&self) -> Option<Image> {
        let values = self.colours("")?.into_iter().flatten().map(|v| v as f32).collect();
        Some(Image { width: self.width, height: self.height, channels: 3, pixels: Pixels::F32(values) })
    }

    /// As it would be written again; channels of other names than this program writes are left out.
    pub fn picture(&self) -> Picture {
        let mut layers: Vec<Layer> = vec![];
        for (full, values) in &self.channels {
            let (layer, channel) = full.rsplit_once('.').unwrap_or(("", full));
            let Some(channel) = CHANNELS.into_iter().find(|c| *c == channel) else { continue };
            let at = layers.iter().position(|l| l.name == layer).unwrap_or_else(|| {
                layers.push(Layer { name: layer.to_owned(), channels: vec![] });
                layers.len() - 1
            });
            layers[at].channels.push((channel, values.clone()));
        }
        Picture { width: self.width, height: self.height, layers, metadata: self.metadata.clone() }
    }
}

fn decode(bytes: &[u8]) -> Result<ExrFile, ImageFault> {
    let fault = |e: e::Error| match e {
        e::Error::NotSupported(what) => ImageFault::unsupported("EXR", what),
        e => ImageFault::damaged("EXR", e.to_string()),
    };
    // The size is in the header; it is looked at before the pixels are made room for.
    let meta = e::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(fault)?;
    for header in &meta.headers {
        let per_pixel: usize = header.channels.list.iter().map(|_| 4).sum();
        let (w, h) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
        check_size(w, h, per_pixel as u64, bytes.len() as u64)?;
    }
    use e::ReadChannels;
    use e::ReadLayers;
    let reader =
        e::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = reader.from_buffered(Cursor::new(bytes)).map_err(fault)?;
    let layer = image.layer_data;
    // Attributes of the program's own are the layer's, whatever reads them.
    let texts = layer.attributes.other.iter().chain(&image.attributes.other);
    let mut metadata: Vec<(String, String)> = texts
        .filter_map(|(name, value)| match value {
            e::AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
            _ => None,
        })
        .collect();
    metadata.sort();
    metadata.dedup();
    let prefix = layer.attributes.layer_name.as_ref().map_or(String::new(), |n| format!("{n}."));
    let channels = layer.channel_data.list.iter();
    let channels = channels.map(|c| (format!("{prefix}{}", c.name), c.sample_data.values_as_f32().collect())).collect();
    Ok(ExrFile { width: layer.size.width() as u32, height: layer.size.height() as u32, channels, metadata })
}
