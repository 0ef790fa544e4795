//! Mitsuba's `.vol` files: values on a grid.
//!
//! Layout (Mitsuba 3 documentation, "Grid-based volume data source"): "VOL", u8 version 3; i32 encoding; i32 samples
//! along x, y and z; i32 channels; box of six f32 (lower corner, upper corner); then the values, x fastest, channels of
//! a sample side by side. All little endian.

use crate::image::open_regular;
use crate::scene::{GridValue, GridValues, VolumeGrid};
use glam::DVec3;
use half::f16;
use std::io::{self, Read};
use std::path::Path;

const HEADER: u64 = 48;
/// Most samples along an axis.
const MAX_SIDE: u32 = 1 << 24;
/// Bytes that are read at once: they stay in the processor's cache until they are converted.
const CHUNK: usize = 1 << 17;

/// A grid and what its file says about it.
#[derive(Debug)]
pub(super) struct LoadedGrid {
    pub grid: VolumeGrid,
    /// Lower and upper corner of the box that the file gives.
    pub bounds: [DVec3; 2],
    /// Largest value.
    pub largest: f32,
}

/// Why a `.vol` file could not be read.
#[derive(Debug, thiserror::Error)]
pub(super) enum VolError {
    /// The file system's reason.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A mistake in the file.
    #[error("{0}")]
    Bad(String),
    /// A sound file that uses something not supported here.
    #[error("{0}")]
    Unsupported(String),
}

/// Numbers at the beginning of a file.
struct Header {
    encoding: u32,
    size: [u32; 3],
    channels: u32,
    bounds: [DVec3; 2],
}

/// Reads a grid of values that are finite and not negative.
pub(super) fn read_vol(path: &Path) -> Result<LoadedGrid, VolError> {
    let (mut file, length) = open_regular(path)?;
    let bad = |message: String| Err(VolError::Bad(message));
    if length < HEADER {
        return bad(format!("{length} bytes are too few for a .vol file, which begins with {HEADER} bytes of header"));
    }
    let Header { encoding, size, channels, bounds } = Header::read(&mut file)?;
    let width = match encoding {
        1 => 4,
        2 => 2,
        3 => 1,
        4 => return Err(VolError::Unsupported("values that are directions (encoding 4) are not supported".into())),
        other => return bad(format!("encoding {other} is not known: expected 1 (float32), 2 (float16) or 3 (uint8)")),
    };
    match channels {
        1 | 3 => {}
        6 => return Err(VolError::Unsupported("six channels (microflakes) are not supported".into())),
        other => return bad(format!("{other} channels: expected 1 or 3")),
    }
    let [x, y, z] = size;
    if size.iter().any(|n| !(1..=MAX_SIDE).contains(n)) {
        return bad(format!("{x} x {y} x {z} samples: expected 1 to {MAX_SIDE} along each axis"));
    }
    // At most 2^72 values of 4 bytes.
    let count = size.iter().map(|&n| u128::from(n)).product::<u128>() * u128::from(channels);
    let present = u128::from(length - HEADER);
    if count * width > present {
        let needed = count * width;
        return bad(format!("truncated: {x} x {y} x {z} samples need {needed} bytes, and {present} are there"));
    }
    let Ok(count) = usize::try_from(count) else { return bad(format!("{count} values are too many")) };
    let (values, largest) = match encoding {
        1 => read_values(&mut file, count, f32::from_le_bytes).map(|v| (GridValues::Float32(v.values), v.largest)),
        2 => read_values(&mut file, count, f16::from_le_bytes).map(|v| (GridValues::Float16(v.values), v.largest)),
        _ => read_values(&mut file, count, u8::from_le_bytes).map(|v| (GridValues::Unorm8(v.values), v.largest)),
    }
    .map_err(|e| e.placed(size, channels))?;
    Ok(LoadedGrid { grid: VolumeGrid { size, channels, values }, bounds, largest })
}

impl Header {
    fn read(file: &mut impl Read) -> Result<Header, VolError> {
        let mut bytes = [0; HEADER as usize];
        file.read_exact(&mut bytes)?;
        if &bytes[..3] != b"VOL" {
            return Err(VolError::Bad("not a .vol file: its first bytes must be `VOL`".into()));
        }
        if bytes[3] != 3 {
            return Err(VolError::Bad(format!("version {} is not known: expected 3", bytes[3])));
        }
        let word = |i: usize| -> [u8; 4] { std::array::from_fn(|b| bytes[4 * i + b]) };
        let number = |i: usize| u32::from_le_bytes(word(i));
        let corner = |i: usize| DVec3::from_array([0, 1, 2].map(|k| f64::from(f32::from_le_bytes(word(i + k)))));
        Ok(Header {
            encoding: number(1),
            size: [2, 3, 4].map(number),
            channels: number(5),
            bounds: [corner(6), corner(9)],
        })
    }
}

struct ReadValues<T> {
    values: Vec<T>,
    largest: f32,
}

/// Why values could not be read.
enum ValueFault {
    Io(io::Error),
    /// More than can be allocated.
    Memory,
    /// A value that is negative or not finite, and its number.
    Value(usize, f32),
}

impl ValueFault {
    /// With the place in a grid.
    fn placed(self, size: [u32; 3], channels: u32) -> VolError {
        let (index, value) = match self {
            ValueFault::Io(e) => return VolError::Io(e),
            ValueFault::Memory => return VolError::Bad("there is not enough memory for the values".into()),
            ValueFault::Value(index, value) => (index, value),
        };
        let [nx, ny] = [size[0], size[1]].map(|n| n as usize);
        let sample = index / channels as usize;
        let (x, y, z) = (sample % nx, sample / nx % ny, sample / nx / ny);
        let fault = if value < 0.0 { "is negative" } else { "is not finite" };
        VolError::Bad(format!("the value {value} of sample ({x}, {y}, {z}) {fault}"))
    }
}

/// Reads `count` numbers straight into their place.
fn read_values<T: GridValue, const N: usize>(
    file: &mut impl Read,
    count: usize,
    from_bytes: impl Fn([u8; N]) -> T,
) -> Result<ReadValues<T>, ValueFault> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| ValueFault::Memory)?;
    let mut bytes = vec![0; CHUNK];
    let mut largest = 0.0f32;
    while values.len() < count {
        let begin = values.len();
        let wanted = (count - begin).min(CHUNK / N);
        let part = &mut bytes[..wanted * N];
        file.read_exact(part).map_err(ValueFault::Io)?;
        values.extend(part.as_chunks().0.iter().map(|&b| from_bytes(b)));
        let part = &values[begin..];
        // Without branches, so that the loop is vectorised. A value that is not a number is in no range.
        let sound = part.iter().fold(true, |all, v| all & (v.value() >= 0.0) & (v.value() < f32::INFINITY));
        if !sound && let Some(i) = part.iter().position(|v| !(0.0..f32::INFINITY).contains(&v.value())) {
            return Err(ValueFault::Value(begin + i, part[i].value()));
        }
        largest = part.iter().fold(largest, |m, v| if v.value() > m { v.value() } else { m });
    }
    Ok(ReadValues { values, largest })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Write;

    fn header(encoding: u32, size: [u32; 3], channels: u32) -> Vec<u8> {
        let mut out = b"VOL\x03".to_vec();
        out.extend([encoding].iter().chain(&size).chain(&[channels]).flat_map(|n| n.to_le_bytes()));
        out.extend([-1.0f32, -2.0, -3.0, 1.0, 2.0, 3.5].iter().flat_map(|v| v.to_le_bytes()));
        out
    }

    fn read(bytes: &[u8]) -> Result<LoadedGrid, VolError> {
        let mut f = tempfile::NamedTempFile::new().unwrap();
        f.write_all(bytes).unwrap();
        read_vol(f.path())
    }

    fn floats(size: [u32; 3], channels: u32, values: &[f32]) -> Vec<u8> {
        let mut file = header(1, size, channels);
        file.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        file
    }

    #[test]
    fn every_encoding_is_read() {
        let LoadedGrid { grid, bounds, largest } =
            read(&floats([1, 2, 1], 3, &[0.0, 0.5, 1.0, 2.0, 4.0, 8.0])).unwrap();
        assert_eq!((grid.size, grid.channels, largest), ([1, 2, 1], 3, 8.0));
        assert_eq!(grid.values, GridValues::Float32(vec![0.0, 0.5, 1.0, 2.0, 4.0, 8.0]));
        assert_eq!(bounds, [DVec3::new(-1.0, -2.0, -3.0), DVec3::new(1.0, 2.0, 3.5)]);
        let mut file = header(2, [2, 1, 1], 1);
        file.extend([0x3800u16, 0x4200].iter().flat_map(|v| v.to_le_bytes()));
        let half = read(&file).unwrap();
        assert_eq!((half.grid.values.get(0), half.grid.values.get(1), half.largest), (0.5, 3.0, 3.0));
        let mut file = header(3, [1, 1, 3], 1);
        file.extend([0, 51, 255]);
        let bytes = read(&file).unwrap();
        assert_eq!([0, 1, 2].map(|i| bytes.grid.values.get(i)), [0.0, 0.2, 1.0]);
        // Longer than what is read at once.
        let n = 50_000;
        let values: Vec<f32> = (0..n).map(|i| i as f32).collect();
        let long = read(&floats([n, 1, 1], 1, &values)).unwrap();
        assert_eq!((long.grid.values, long.largest), (GridValues::Float32(values), n as f32 - 1.0));
    }

    /// tests/data/volumes/write_volume.py wrote the file with Mitsuba 3.9.1.
    #[test]
    fn a_file_of_mitsuba_is_read() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes/mitsuba.vol");
        let LoadedGrid { grid, bounds, .. } = read_vol(&path).unwrap();
        assert_eq!((grid.size, grid.channels, bounds), ([3, 2, 2], 1, [DVec3::ZERO, DVec3::ONE]));
        assert_eq!(grid.values, GridValues::Float32((0..12).map(|i| 0.0625 * i as f32).collect()));
    }

    #[test]
    fn mistakes_are_said() {
        let says = |bytes: &[u8], text: &str| {
            let message = read(bytes).unwrap_err().to_string();
            assert!(message.contains(text), "{message}");
        };
        let good = floats([2, 1, 2], 1, &[1.0; 4]);
        says(&good[..20], "too few");
        says(&good[..good.len() - 1], "truncated: 2 x 1 x 2 samples need 16 bytes, and 15 are there");
        says(b"VOM\x03                                            ", "`VOL`");
        says(&[&b"VOL\x02"[..], &good[4..]].concat(), "version 2");
        says(&header(7, [1; 3], 1), "encoding 7");
        says(&header(4, [1; 3], 3), "not supported");
        says(&header(1, [1; 3], 6), "not supported");
        says(&header(1, [1; 3], 2), "2 channels");
        says(&header(1, [0, 1, 1], 1), "0 x 1 x 1");
        says(&header(1, [u32::MAX, 1, 1], 1), "expected 1 to");
        // 10^12 samples, and as many as the format can claim.
        says(&header(1, [10_000; 3], 1), "need 4000000000000 bytes");
        says(&header(1, [MAX_SIDE; 3], 3), "truncated");
        says(&floats([2, 1, 2], 1, &[1.0, 1.0, 1.0, -2.0]), "the value -2 of sample (1, 0, 1) is negative");
        says(&floats([2, 1, 2], 1, &[1.0, 1.0, f32::NAN, 1.0]), "of sample (0, 0, 1) is not finite");
        says(&floats([1, 1, 1], 3, &[1.0, f32::INFINITY, 1.0]), "of sample (0, 0, 0) is not finite");
    }

    proptest! {
        #[test]
        fn damaged_files_never_panic(at in 0usize..80, value: u8, length in 0usize..81) {
            let mut file = floats([2, 2, 2], 1, &[1.0; 8]);
            let at = at.min(file.len() - 1);
            file[at] = value;
            file.truncate(length);
            if let Ok(LoadedGrid { grid, .. }) = read(&file) {
                let samples: u32 = grid.size.iter().product();
                prop_assert_eq!(grid.values.len(), (samples * grid.channels) as usize);
            }
        }
    }
}
