//! Mutated files for every reader: none may panic, abort or hang.

#[path = "../../fuzz/readers.rs"]
mod readers;

use crate::support::gallery::{GALLERY, file};
use crate::support::program::BOX;
use lightsieve::image::{Layer, Picture, write_picture};
use lightsieve::math::hash::mix64;
use readers::{READERS, Reader};
use std::io::Write;
use std::time::{Duration, Instant};

/// Longest time that one input may take.
const PATIENCE: Duration = Duration::from_secs(10);
/// Longest mutated file in bytes.
const MAX_BYTES: usize = 1 << 16;

/// Pseudo-random numbers: hashes of a counter.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix64(self.0)
    }

    /// A number below `n`, which is not zero.
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn pick<'a, T: ?Sized>(&mut self, all: &[&'a T]) -> &'a T {
        all[self.below(all.len())]
    }
}

/// Numbers and words at the edges of what readers accept.
const WORDS: [&str; 24] = [
    "0",
    "-0",
    "1",
    "-1",
    "255",
    "256",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "-2147483649",
    "18446744073709551615",
    "18446744073709551616",
    "1e-45",
    "1e38",
    "1e39",
    "1e308",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "",
    "0x10",
    "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16",
];
/// Bytes at the edges of binary numbers.
const BYTES: [u8; 8] = [0, 1, 0x7f, 0x80, 0xff, b'\n', b' ', b'"'];

/// Makes up to eight changes.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    for _ in 0..=random.below(8) {
        if bytes.is_empty() {
            bytes.extend_from_slice(other);
            continue;
        }
        let at = random.below(bytes.len());
        let end = at + random.below((bytes.len() - at).min(64)) + 1;
        match random.below(11) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = BYTES[random.below(BYTES.len())],
            2 => bytes[at] = random.next() as u8,
            3 => drop(bytes.drain(at..end)),
            4 => {
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                drop(bytes.splice(to..to, copy));
            }
            5 => bytes.truncate(at),
            6 if !other.is_empty() => {
                let from = random.below(other.len());
                let until = (from + 1 + random.below(256)).min(other.len());
                drop(bytes.splice(at..at, other[from..until].iter().copied()));
            }
            7 => {
                let value = (random.next() as u32).wrapping_shl(random.below(32) as u32).to_le_bytes();
                bytes.iter_mut().skip(at).zip(value).for_each(|(b, v)| *b = v);
            }
            8 => bytes.iter_mut().skip(at).take(4).for_each(|b| *b = 0xff),
            _ => replace_word(bytes, at, random),
        }
        bytes.truncate(MAX_BYTES);
    }
}

/// Replaces the number or name around a place.
fn replace_word(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let is_word = |b: &u8| b.is_ascii_alphanumeric() || b"+-._".contains(b);
    let begin = bytes[..at].iter().rposition(|b| !is_word(b)).map_or(0, |i| i + 1);
    let end = bytes[at..].iter().position(|b| !is_word(b)).map_or(bytes.len(), |i| at + i);
    let words: Vec<&str> = WORDS.to_vec();
    drop(bytes.splice(begin..end.max(begin), random.pick(&words).bytes()));
}

/// Sound files of a reader.
fn corpus(reader: &str) -> Vec<Vec<u8>> {
    let text = |texts: &[&str]| texts.iter().map(|t| t.as_bytes().to_vec()).collect::<Vec<_>>();
    match reader {
        "xml" => {
            let gallery = GALLERY.iter().map(|name| std::fs::read(file(name, "xml")).unwrap());
            gallery.chain(text(&[BOX, NESTED])).collect()
        }
        "obj" => text(&[
            "v 0 0 0\nv 1 0 0 1\nv 1 1 0 .5 .5 .5\nv 0 1 0\nvn 0 0 1\nvt 0 0\nvt 1 1\nf 1/1/1 2/2/1 3/1/1 4/2/1\nf -4 -3 -2\n",
            "mtllib a.mtl b.mtl\no one\ng two three\ns 1\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//  2 \\\n 3\nl 1 2 3\n",
        ]),
        "mtl" => text(&[
            "newmtl a\nKd .5 .5 .5\nKs 0 0 0\nNs 10\nd .5\nTr .5\nNi 1.5\nillum 5\nmap_Kd -s 1 1 1 a.png\nKe 1 1 1\n",
            "newmtl b\nTf 1 1 1\nmap_bump -bm .2 b.png\nmap_d c.png\nmap_Ke d.png\nPr .3\nPm 1\n",
        ]),
        "ply" => ply_corpus(),
        "serialized" => vec![serialized_file(3), serialized_file(4)],
        "picture" | "exr-layers" => picture_corpus(),
        "checkpoint" => readers::checkpoints(),
        "parameters" => text(&[
            "max_depth=5\nrr_depth=2\nlight_paths=1/4\nconnections=50%\nheuristic=power\nhide_emitters=true\n",
            "techniques=all,-0:*,+2:3\npresampled_paths=100\nsecond_stage_paths=10\nallocation=full\nskip=never\nkeep=60\n",
        ]),
        other => panic!("no corpus for {other}"),
    }
}

const NESTED: &str = r##"<scene version="0.6.0"><default name="n" value="3"/><integrator type="path"/>
    <include filename="part.xml"/><alias id="a" as="b"/>
    <bsdf type="blendbsdf" id="a"><texture type="checkerboard" name="weight"/><float name="weight" value="$n"/>
    <bsdf type="mask"><bsdf type="bumpmap"><texture type="bitmap"><string name="filename" value="x.png"/></texture>
    <bsdf type="roughconductor"><string name="material" value="Au"/><float name="alpha" value=".1"/></bsdf></bsdf></bsdf>
    <bsdf type="twosided"><bsdf type="roughplastic"><spectrum name="diffuseReflectance" value="400:.1, 700:.9"/></bsdf></bsdf></bsdf>
    <shape type="shapegroup" id="g"><shape type="cylinder"><point name="p0" x="0" y="0" z="1"/><float name="radius" value="2"/>
    </shape></shape><shape type="instance"><ref id="g"/><transform name="toWorld"><matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/>
    <lookAt origin="0,0,1" target="1,1,1" up="0,1,0"/><rotate x="1" angle="30"/><scale value="2"/></transform></shape>
    <emitter type="sunsky"><float name="turbidity" value="3"/><vector name="sunDirection" x="0" y="1" z="1"/></emitter>
    <emitter type="spot"><spectrum name="intensity" value="1"/></emitter><emitter type="envmap"><string name="filename" value="e.exr"/></emitter>
    <sensor type="thinlens"><float name="apertureRadius" value=".1"/><float name="focusDistance" value="5"/>
    <film type="hdrfilm"><integer name="cropWidth" value="4"/><rfilter type="gaussian"/></film></sensor></scene>"##;

fn ply_corpus() -> Vec<Vec<u8>> {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n\
             property list uchar int vertex_indices\nend_header\n"
        )
    };
    let ascii = header("ascii") + "0 0 0 1 2 3\n1 0 0 1 2 3\n1 1 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2\n4 0 1 2 3\n";
    let binary = |format: &str, order: fn([u8; 4]) -> [u8; 4]| {
        let mut bytes = header(format).into_bytes();
        for [x, y] in [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            [x, y, 0.0].iter().for_each(|v| bytes.extend(order(v.to_le_bytes())));
            bytes.extend([1, 2, 3]);
        }
        for face in [&[0, 1, 2][..], &[0, 1, 2, 3]] {
            bytes.push(face.len() as u8);
            face.iter().for_each(|i: &i32| bytes.extend(order(i.to_le_bytes())));
        }
        bytes
    };
    let swap = |[a, b, c, d]: [u8; 4]| [d, c, b, a];
    vec![ascii.into_bytes(), binary("binary_little_endian", |b| b), binary("binary_big_endian", swap)]
}

/// A triangle in Mitsuba's format.
fn serialized_file(version: u16) -> Vec<u8> {
    let mut body = vec![];
    body.extend(0x1000u32.to_le_bytes());
    if version == 4 {
        body.extend(b"name\0");
    }
    body.extend(3u64.to_le_bytes());
    body.extend(1u64.to_le_bytes());
    [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().for_each(|v| body.extend(v.to_le_bytes()));
    [0u32, 1, 2].iter().for_each(|i| body.extend(i.to_le_bytes()));
    let mut bytes = [0x041cu16.to_le_bytes(), version.to_le_bytes()].concat();
    let mut encoder = flate2::write::ZlibEncoder::new(&mut bytes, flate2::Compression::none());
    encoder.write_all(&body).unwrap();
    encoder.finish().unwrap();
    if version == 4 {
        bytes.extend(0u64.to_le_bytes());
    } else {
        bytes.extend(0u32.to_le_bytes());
    }
    bytes.extend(1u32.to_le_bytes());
    bytes
}

fn picture_corpus() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let values = |k: usize| (0..12).map(|i| (i * 7 + k) as f32 / 40.0).collect::<Vec<f32>>();
    let layer = |name: &str| Layer {
        name: name.into(),
        channels: ["R", "G", "B"].into_iter().enumerate().map(|(k, c)| (c, values(k))).collect(),
    };
    let picture = Picture {
        width: 4,
        height: 3,
        layers: vec![layer(""), layer("variance")],
        metadata: vec![("lightsieve:seed".into(), "3".into())],
    };
    let written = ["a.exr", "a.pfm", "a.png"].map(|name| {
        let path = folder.path().join(name);
        write_picture(&path, &picture, 0.0).unwrap();
        std::fs::read(path).unwrap()
    });
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n".to_vec();
    hdr.extend([2, 2, 0, 8, 136, 10, 136, 20, 136, 30, 136, 128].repeat(2));
    let netpbm =
        [&b"P3\n2 1\n255\n1 2 3 4 5 6\n"[..], b"P6\n2 1\n255\nabcdef", b"P5\n2 1\n65535\nabcd"].map(<[u8]>::to_vec);
    let mut tga = vec![0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 2, 0, 24, 32];
    tga.extend([0x83, 1, 2, 3, 0x83, 4, 5, 6]);
    written.into_iter().chain(netpbm).chain([hdr, tga]).collect()
}

/// Feeds a reader with mutated files while `go_on` says so; returns the number of files.
fn fuzz((name, read): Reader, seed: u64, go_on: impl Fn(u64) -> bool) -> u64 {
    let corpus = corpus(name);
    corpus.iter().for_each(|bytes| read(bytes));
    let mut done = 0;
    while go_on(done) {
        let mut random = Random(mix64(seed ^ mix64(done)));
        let (one, other) = (random.below(corpus.len()), random.below(corpus.len()));
        let mut bytes = corpus[one].clone();
        mutate(&mut bytes, &corpus[other], &mut random);
        let start = Instant::now();
        let outcome = std::panic::catch_unwind(|| read(&bytes));
        let time = start.elapsed();
        if outcome.is_err() || time > PATIENCE {
            let path = std::env::temp_dir().join(format!("lightsieve-fuzz-{name}-{seed}-{done}"));
            std::fs::write(&path, &bytes).unwrap();
            panic!("{name}, seed {seed}, input {done} after {time:?}: kept as {}", path.display());
        }
        done += 1;
    }
    done
}

/// 400 files for each reader, or as many as FUZZ_SECONDS allow for each if that is set, with a seed of the clock.
#[test]
fn readers_survive_mutated_files() {
    let seconds: Option<u64> = std::env::var("FUZZ_SECONDS").ok().and_then(|s| s.parse().ok());
    let clock = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs();
    for reader in READERS {
        let (start, files) = (Instant::now(), if reader.0 == "checkpoint" { 60 } else { 400 });
        match seconds {
            None => assert_eq!(fuzz(reader, 1, |done| done < files), files),
            Some(seconds) => {
                let files = fuzz(reader, clock, |_| start.elapsed() < Duration::from_secs(seconds));
                println!("{}: {files} files in {:.0} s", reader.0, start.elapsed().as_secs_f64());
            }
        }
    }
}
