//! Picture files in and out, through the public interface. The small files in `tests/data/images` were written with
//! OpenEXR 3.5.3 and Pillow 13.0.0 from the formulas named at each test; their pixels are 5 x 3.

use lightsieve::image::read::{decode, read_image};
use lightsieve::image::{Encoding, Image, ImageError, ImageFault, Pixels};
use lightsieve::image::{Layer, Picture, WriteError, write_picture};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/images").join(name)
}

fn read(name: &str) -> Image {
    read_image(&data(name), Encoding::Auto).unwrap()
}

fn floats(image: &Image) -> &[f32] {
    match &image.pixels {
        Pixels::F32(v) => v,
        other => panic!("expected floats, found {other:?}"),
    }
}

/// Channel c of the pixel (x, y) is (x + 10 y + 100 c) · scale.
fn ramp(channels: usize, scale: f32) -> Vec<f32> {
    let value = |i: usize| ((i / channels % 5) + 10 * (i / channels / 5) + 100 * (i % channels)) as f32;
    (0..15 * channels).map(|i| value(i) * scale).collect()
}

/// Byte i is 5 i.
fn bytes() -> Vec<u8> {
    (0..45).map(|i| 5 * i).collect()
}

#[test]
fn exr_of_every_kind_gives_the_written_values() {
    for (name, channels, scale) in [
        ("half-rgba-piz.exr", 4, 0.125),
        ("half-rgb-pxr24.exr", 3, 0.125),
        ("float-rgb-zips.exr", 3, 0.125),
        ("tiled-rgb-rle.exr", 3, 0.125),
        ("uint-y-none.exr", 1, 100_000.0),
        // The data window lies elsewhere than the display window.
        ("window.exr", 3, 0.125),
        // albedo.* stands before R in the file, and holds -1.
        ("layers.exr", 3, 0.125),
        // No nameless colours: a.b.* is the first layer that has some, b.* holds -1.
        ("named-only.exr", 3, 0.125),
        // The first part holds W and Z only.
        ("multipart.exr", 3, 0.125),
    ] {
        let image = read(name);
        assert_eq!((image.width, image.height, image.channels), (5, 3, channels as u32), "{name}");
        assert_eq!(floats(&image), ramp(channels, scale), "{name}");
    }
}

#[test]
fn flat_pictures_may_be_much_larger_than_their_files() {
    // 2048 x 2048 halfs of 0.5 in three channels, DWAB: 25 MB of samples in 3 kB.
    let image = read("flat-dwab.exr");
    assert_eq!((image.width, image.height, image.channels), (2048, 2048, 3));
    assert!(floats(&image).iter().all(|&v| (v - 0.5).abs() < 1e-3));
    let small = read("half-rgb-dwaa.exr");
    assert_eq!((small.width, small.height, small.channels), (5, 3, 3));
    assert!(floats(&small).iter().all(|&v| (v - 0.5).abs() < 1e-3));
    // Black, PNG: deflate at its best.
    let mut file = Vec::new();
    let black = image::GrayImage::new(4096, 4096);
    black.write_to(&mut std::io::Cursor::new(&mut file), image::ImageFormat::Png).unwrap();
    assert_eq!(decode(&file, false, Encoding::Auto).unwrap().width, 4096);
}

#[test]
fn exr_without_colours_is_refused_by_name() {
    let error = read_image(&data("xy-only.exr"), Encoding::Auto).unwrap_err();
    assert!(matches!(error.fault, ImageFault::Unsupported { format: "EXR", .. }), "{error}");
    assert!(error.to_string().contains("xy-only.exr") && error.to_string().contains("U, V"), "{error}");
}

#[test]
fn eight_bit_files_stay_eight_bit() {
    for name in ["rgb8.png", "rgb.tga", "rle.tga", "rgb.bmp", "palette.bmp", "lossless.webp"] {
        assert_eq!(read(name).pixels, Pixels::Srgb8(bytes()), "{name}");
    }
    let alpha = read("alpha.webp");
    let Pixels::Srgb8(v) = &alpha.pixels else { panic!("expected bytes") };
    assert_eq!(v.chunks(4).flat_map(|p| p[..3].to_vec()).collect::<Vec<u8>>(), bytes());
    assert!(v.chunks(4).all(|p| p[3] == 200));
    let palette = read("palette.png");
    assert_eq!((palette.channels, palette.pixels), (3, Pixels::Srgb8(bytes())));
    let linear = read_image(&data("rgb8.png"), Encoding::Linear).unwrap();
    assert_eq!(linear.pixels, Pixels::Linear8(bytes()));
}

#[test]
fn palettes_with_transparency_and_single_bits_are_expanded() {
    let image = read("palette4-transparent.png");
    assert_eq!(image.channels, 4);
    let Pixels::Srgb8(v) = &image.pixels else { panic!("expected bytes") };
    let colours: Vec<u8> = v.chunks(4).flat_map(|p| p[..3].to_vec()).collect();
    assert_eq!(colours, bytes());
    assert_eq!(v.chunks(4).filter(|p| p[3] == 0).count(), 1, "one colour of the palette is transparent");

    // The red bytes 75 y + 15 x that are above 100.
    let expected: Vec<u8> = (0..15).map(|i| if 15 * i > 100 { 255 } else { 0 }).collect();
    let image = read("bilevel.png");
    assert_eq!((image.channels, image.pixels), (1, Pixels::Srgb8(expected)));
}

#[test]
fn sixteen_bit_png_is_decoded_to_floats() {
    // Values 257 b for the red bytes b of the eight-bit file: the same fractions of full scale.
    let eight = read("rgb8.png");
    let sixteen = read("grey16.png");
    assert_eq!(sixteen.channels, 1);
    let linear = read_image(&data("grey16.png"), Encoding::Linear).unwrap();
    for i in 0..15 {
        let (x, y) = (i % 5, i / 5);
        let (a, b) = (sixteen.value(x, y, 0), eight.value(x, y, 0));
        assert!((a - b).abs() <= 1e-7, "{a} {b}");
        assert_eq!(linear.value(x, y, 0), (15 * i) as f32 * 257.0 / 65535.0);
    }
}

#[test]
fn jpeg_baseline_progressive_grey_and_cmyk() {
    for (name, channels) in [("flat.jpg", 3), ("flat-progressive.jpg", 3), ("cmyk.jpg", 3), ("grey.jpg", 1)] {
        let image = read(name);
        assert_eq!((image.width, image.height, image.channels), (16, 16, channels), "{name}");
        let Pixels::Srgb8(v) = &image.pixels else { panic!("expected bytes") };
        for pixel in v.chunks(channels as usize) {
            for (found, expected) in pixel.iter().zip([200_u8, 100, 50]) {
                assert!(found.abs_diff(expected) <= 2, "{name}: {pixel:?}");
            }
        }
    }
}

#[test]
fn the_contents_decide_the_format_not_the_ending() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("really-a-png.jpg");
    std::fs::copy(data("rgb8.png"), &path).unwrap();
    assert_eq!(read_image(&path, Encoding::Auto).unwrap(), read("rgb8.png"));
}

#[test]
fn pnm_plain_and_binary_with_any_maximum() {
    let decode = |b: &[u8]| decode(b, false, Encoding::Linear).unwrap();
    let image = decode(b"P3 # colour\n2 1\n#size above\n255\n1 2 3\n253 254 255\n");
    assert_eq!((image.width, image.height, image.channels), (2, 1, 3));
    assert_eq!(image.pixels, Pixels::Linear8(vec![1, 2, 3, 253, 254, 255]));
    assert_eq!(decode(b"P6 1 1 255\n\x20\x0a\xff").pixels, Pixels::Linear8(vec![0x20, 0x0a, 0xff]));
    // A maximum below 255 means fractions of it, not bytes.
    assert_eq!(decode(b"P5\n2 1\n100\n\x32\x64").pixels, Pixels::F32(vec![0.5, 1.0]));
    assert_eq!(decode(b"P2 2 1 4 1 3").pixels, Pixels::F32(vec![0.25, 0.75]));
    assert_eq!(decode(b"P5 1 2 65535\n\xff\xff\x00\x01").pixels, Pixels::F32(vec![1.0, 1.0 / 65535.0]));
}

#[test]
fn pfm_of_both_byte_orders_starts_with_the_bottom_row() {
    for little in [true, false] {
        let mut file = if little { b"PF\n1 2\n-1.0\n".to_vec() } else { b"PF\n1 2\n1.0\n".to_vec() };
        for value in [1.0_f32, 2.0, 3.0, 4.0, 5.0, 1.0e20] {
            file.extend(if little { value.to_le_bytes() } else { value.to_be_bytes() });
        }
        let image = decode(&file, false, Encoding::Auto).unwrap();
        assert_eq!(floats(&image), [4.0, 5.0, 1.0e20, 1.0, 2.0, 3.0]);
    }
    let grey = decode(b"Pf 1 1 -0.5 \x00\x00\x00\x41", false, Encoding::Auto).unwrap();
    assert_eq!((grey.channels, floats(&grey)), (1, &[4.0_f32][..]), "the scale multiplies");
}

#[test]
fn radiance_hdr_round_trip() {
    let mut file = Vec::new();
    let pixels = [image::Rgb([1.0_f32, 0.5, 0.25]), image::Rgb([1024.0, 0.0, 512.0])];
    image::codecs::hdr::HdrEncoder::new(&mut file).encode(&pixels, 2, 1).unwrap();
    let image = decode(&file, false, Encoding::Auto).unwrap();
    assert_eq!((image.width, image.height, image.channels), (2, 1, 3));
    for (found, expected) in floats(&image).iter().zip([1.0_f32, 0.5, 0.25, 1024.0, 0.0, 512.0]) {
        assert!((found - expected).abs() <= 0.005 * expected, "{found} {expected}");
    }
}

fn picture() -> Picture {
    let plane = |c: usize| ramp(3, 0.125).into_iter().skip(c).step_by(3).collect::<Vec<f32>>();
    Picture {
        width: 5,
        height: 3,
        layers: vec![
            Layer { name: "albedo".into(), channels: vec![("R", vec![-1.0; 15]), ("G", plane(0)), ("B", plane(1))] },
            Layer { name: String::new(), channels: vec![("R", plane(0)), ("G", plane(1)), ("B", plane(2))] },
            Layer { name: "depth".into(), channels: vec![("Z", vec![f32::INFINITY; 15])] },
        ],
        metadata: (0..12).map(|i| (format!("lightsieve.key{i}"), format!("value ü {i}"))).collect(),
    }
}

#[test]
fn exr_and_pfm_round_trips_are_exact() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.exr", "a.pfm", "UPPER.EXR"] {
        let path = folder.path().join(name);
        write_picture(&path, &picture(), 3.0).unwrap();
        let image = read_image(&path, Encoding::Auto).unwrap();
        assert_eq!((image.width, image.height, image.channels), (5, 3, 3));
        assert_eq!(floats(&image), ramp(3, 0.125), "{name}");
    }
}

#[test]
fn exr_has_one_part_with_named_channels_and_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write_picture(&path, &picture(), 0.0).unwrap();
    let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
    assert_eq!(meta.headers.len(), 1);
    let header = &meta.headers[0];
    let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z"]);
    let found = &header.own_attributes.other[&exr::meta::attribute::Text::from("lightsieve.key7")];
    let exr::meta::attribute::AttributeValue::Text(text) = found else { panic!("expected a text") };
    assert_eq!(text.as_slice(), "value ü 7".as_bytes());
}

#[test]
fn equal_pictures_give_equal_bytes() {
    // The EXR encoder orders attributes by a hash that differs from call to call; twelve of them do not agree by
    // chance.
    let folder = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for name in ["a.exr", "b.exr"] {
        write_picture(&folder.path().join(name), &picture(), 0.0).unwrap();
        files.push(std::fs::read(folder.path().join(name)).unwrap());
    }
    assert!(files[0] == files[1]);
}

#[test]
fn png_is_exposed_clipped_and_encoded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    // IEC 61966-2-1: linear 0.5 has the code 188, 0.25 has 137, 0.002 has 7 (on the straight part).
    let values = vec![0.5, 0.25, 0.002, 2.0, -1.0, f32::NAN, f32::INFINITY, 0.0];
    let grey = |v: Vec<f32>| Picture {
        width: 8,
        height: 1,
        layers: vec![Layer { name: String::new(), channels: vec![("Y", v)] }],
        metadata: vec![],
    };
    write_picture(&path, &grey(values.clone()), 0.0).unwrap();
    let expected = vec![188, 137, 7, 255, 0, 0, 255, 0];
    assert_eq!(read_image(&path, Encoding::Auto).unwrap().pixels, Pixels::Srgb8(expected));
    write_picture(&path, &grey(values), -1.0).unwrap();
    let Pixels::Srgb8(darker) = read_image(&path, Encoding::Auto).unwrap().pixels else { panic!("expected bytes") };
    assert_eq!((darker[0], darker[3]), (137, 255));
}

#[test]
fn an_unknown_ending_lists_the_known_ones() {
    for name in ["picture.gif", "picture", ".exr"] {
        let error = write_picture(Path::new(name), &picture(), 0.0).unwrap_err();
        assert!(matches!(error, WriteError::UnknownEnding(_)), "{name}");
        assert!(error.to_string().contains(".exr, .pfm, .png"), "{error}");
    }
}

#[test]
fn contradictory_pictures_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refuse = |name: &str, change: &dyn Fn(&mut Picture)| {
        let path = folder.path().join(name);
        let mut picture = picture();
        change(&mut picture);
        let error = write_picture(&path, &picture, 0.0).unwrap_err();
        assert!(matches!(error, WriteError::Picture { .. }), "{error}");
        assert!(error.to_string().contains(name), "{error}");
        assert!(!path.exists());
    };
    refuse("short.exr", &|p| p.layers[0].channels[0].1.truncate(14));
    refuse("twice.exr", &|p| p.layers[2].channels.push(("Z", vec![0.0; 15])));
    refuse("empty.exr", &|p| p.layers.clear());
    refuse("no-main.png", &|p| p.layers[1].name = "other".into());
    refuse("no-main.pfm", &|p| p.layers[1].channels.truncate(2));
    refuse("key-twice.exr", &|p| p.metadata[1].0 = p.metadata[0].0.clone());
    refuse("key-reserved.exr", &|p| p.metadata[1].0 = "channels".into());
    refuse("key-empty.exr", &|p| p.metadata[1].0 = String::new());
    refuse("key-zero.exr", &|p| p.metadata[1].0 = "a\0b".into());
    refuse("name-zero.exr", &|p| p.layers[0].name = "a\0b".into());
    refuse("key-long.exr", &|p| p.metadata[1].0 = "k".repeat(300));
    refuse("no-pixels.exr", &|p| p.width = 0);
}

#[test]
fn places_that_cannot_be_written_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let is_io = |path: &Path| matches!(write_picture(path, &picture(), 0.0), Err(WriteError::Io { .. }));
    assert!(is_io(&folder.path().join("missing/a.png")));
    let link = folder.path().join("full.exr");
    if Path::new("/dev/full").exists() {
        std::os::unix::fs::symlink("/dev/full", &link).unwrap();
        assert!(is_io(&link));
    }
    std::fs::create_dir(folder.path().join("folder.pfm")).unwrap();
    assert!(is_io(&folder.path().join("folder.pfm")));
}

fn fault_of(bytes: &[u8]) -> Option<ImageFault> {
    decode(bytes, true, Encoding::Auto).err()
}

/// Every sample file, and one of each format that the tests write themselves.
fn samples() -> Vec<(String, Vec<u8>)> {
    let mut all: Vec<(String, Vec<u8>)> = std::fs::read_dir(data(""))
        .unwrap()
        .map(|entry| entry.unwrap())
        // Its 25 MB would take all the time; half-rgb-dwaa.exr stands for its kind.
        .filter(|entry| entry.file_name() != "flat-dwab.exr")
        .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap()))
        .collect();
    all.sort();
    let mut hdr = Vec::new();
    let pixels = vec![image::Rgb([1.0_f32, 0.5, 0.25]); 16 * 2];
    image::codecs::hdr::HdrEncoder::new(&mut hdr).encode(&pixels, 16, 2).unwrap();
    all.push(("sample.hdr".into(), hdr));
    all.push(("sample.pfm".into(), [b"PF 2 1 -1 ".to_vec(), vec![7; 24]].concat()));
    all.push(("sample.ppm".into(), b"P6 2 1 255 abcdef".to_vec()));
    all.push(("plain.pgm".into(), b"P2 2 1 255 12 1".to_vec()));
    all
}

#[test]
fn files_cut_short_are_errors() {
    for (name, bytes) in samples() {
        // The last bytes of these formats carry no pixels; of the others not one may be missing.
        let spare = match name.rsplit('.').next() {
            Some("png") => 20,
            Some("tga") => 26,
            // A blank, and the byte that makes the length even.
            Some("pgm" | "webp") => 1,
            _ => 0,
        };
        for length in 0..bytes.len() - spare {
            assert!(fault_of(&bytes[..length]).is_some(), "{name} cut to {length} of {} bytes", bytes.len());
        }
    }
}

#[test]
fn absurd_sizes_are_refused_without_allocating_them() {
    for file in [
        &b"PF 60000 60000 -1\n"[..],
        b"PF 4294967295 4294967295 -1\n",
        b"P6 4294967295 4294967295 255\n",
        b"P3 4294967295 1 255\n",
        b"P5 99999999999999999999 1 255\n",
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2000000000 +X 2000000000\n",
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n",
    ] {
        assert!(fault_of(file).is_some(), "{}", String::from_utf8_lossy(file));
    }
    // Windows and tiles of EXR files.
    for (name, attribute, values) in [
        ("float-rgb-zips.exr", "dataWindow\0box2i\0", [0, 0, 29_999, 29_999]),
        ("float-rgb-zips.exr", "dataWindow\0box2i\0", [0, 0, 1_000_000_000, 0]),
        ("float-rgb-zips.exr", "dataWindow\0box2i\0", [0, 0, 0, 1_000_000_000]),
        ("float-rgb-zips.exr", "dataWindow\0box2i\0", [i32::MIN, i32::MIN, i32::MAX, i32::MAX]),
        ("tiled-rgb-rle.exr", "dataWindow\0box2i\0", [0, 0, 29_999, 29_999]),
        ("tiled-rgb-rle.exr", "tiles\0tiledesc\0", [i32::MAX, i32::MAX, 0, 0]),
        ("tiled-rgb-rle.exr", "tiles\0tiledesc\0", [0, 0, 0, 0]),
    ] {
        let mut file = std::fs::read(data(name)).unwrap();
        let at = file.windows(attribute.len()).position(|w| w == attribute.as_bytes()).unwrap() + attribute.len();
        let size = u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        let bytes: Vec<u8> = values.iter().flat_map(|v: &i32| v.to_le_bytes()).collect();
        let bytes = &bytes[..size / 8 * 8]; // of a tile description only the size
        file[at + 4..at + 4 + bytes.len()].copy_from_slice(bytes);
        assert!(fault_of(&file).is_some(), "{name} with {attribute:?} {values:?}");
    }
    // A sound PNG whose header claims 65535 x 65535, checksum and all.
    let mut png = std::fs::read(data("rgb8.png")).unwrap();
    png[16..24].copy_from_slice(&[0, 0, 255, 255, 0, 0, 255, 255]);
    let mut crc = flate2::Crc::new();
    crc.update(&png[12..29]);
    png[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    assert!(matches!(fault_of(&png), Some(ImageFault::TooLarge { width: 65535, height: 65535 })));
}

#[test]
fn unknown_contents_and_missing_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notes.png");
    std::fs::write(&path, "not a picture").unwrap();
    let error = read_image(&path, Encoding::Auto).unwrap_err();
    assert!(matches!(error, ImageError { fault: ImageFault::UnknownFormat, .. }));
    assert!(error.to_string().contains("notes.png") && error.to_string().contains("known: png"), "{error}");
    for path in [folder.path().join("missing.png"), folder.path().to_owned(), PathBuf::from("/dev/zero")] {
        let error = read_image(&path, Encoding::Auto).unwrap_err();
        assert!(matches!(error.fault, ImageFault::Io(_)), "{error}");
        assert!(error.to_string().contains(path.to_str().unwrap()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_never_panic(
        which in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        header_only in any::<bool>(),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let (name, mut bytes) = SAMPLES.with(|s| which.get(s).clone());
        let reach = if header_only { bytes.len().min(64) } else { bytes.len() };
        for (at, value) in changes {
            let at = at.index(reach);
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(image) = decode(&bytes, name.ends_with("tga"), Encoding::Auto) {
            prop_assert!(image.width > 0 && image.height > 0 && [1, 3, 4].contains(&image.channels));
            let values = image.width as usize * image.height as usize * image.channels as usize;
            let held = match &image.pixels {
                Pixels::Srgb8(v) | Pixels::Linear8(v) => v.len(),
                Pixels::F32(v) => v.len(),
            };
            prop_assert_eq!(values, held);
        }
    }
}

thread_local! {
    static SAMPLES: Vec<(String, Vec<u8>)> = samples();
}
