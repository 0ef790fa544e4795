//! Procedural pictures, and the two file formats that they are written in: PNG (sRGB) and Radiance HDR.

use std::f64::consts::PI;

/// A picture of sRGB values in [0, 1]; row 0 is the top.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[f64; 3]>,
}

impl Picture {
    /// Evaluates `f(u, v)` at every pixel centre, v running down.
    pub fn new(width: usize, height: usize, f: impl Fn(f64, f64) -> [f64; 3]) -> Picture {
        let at = |i: usize| f(((i % width) as f64 + 0.5) / width as f64, ((i / width) as f64 + 0.5) / height as f64);
        Picture { width, height, pixels: (0..width * height).map(at).collect() }
    }

    /// 8-bit PNG. Values are cut to 64 levels, which nobody sees in a grained texture and which compress well.
    pub fn png(&self) -> Vec<u8> {
        let mut raw = Vec::with_capacity(self.height * (3 * self.width + 1));
        for row in self.pixels.chunks(self.width) {
            raw.push(0);
            raw.extend(row.iter().flatten().map(|x| ((x.clamp(0.0, 1.0) * 63.0).round() * 255.0 / 63.0) as u8));
        }
        let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
        let mut head = Vec::new();
        head.extend((self.width as u32).to_be_bytes());
        head.extend((self.height as u32).to_be_bytes());
        head.extend([8, 2, 0, 0, 0]);
        chunk(&mut out, b"IHDR", &head);
        chunk(&mut out, b"IDAT", &zlib(&raw));
        chunk(&mut out, b"IEND", &[]);
        out
    }

    /// Radiance RGBE of linear values; scanlines in the newer form, without runs.
    pub fn hdr(&self) -> Vec<u8> {
        let mut out =
            format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", self.height, self.width).into_bytes();
        for row in self.pixels.chunks(self.width) {
            out.extend([2, 2, (self.width >> 8) as u8, self.width as u8]);
            let texels: Vec<[u8; 4]> = row.iter().map(|&c| rgbe(c)).collect();
            for channel in 0..4 {
                for part in texels.chunks(128) {
                    out.push(part.len() as u8);
                    out.extend(part.iter().map(|t| t[channel]));
                }
            }
        }
        out
    }
}

/// Ward's shared-exponent pixel.
fn rgbe(c: [f64; 3]) -> [u8; 4] {
    let max = c[0].max(c[1]).max(c[2]);
    if max < 1e-30 {
        return [0; 4];
    }
    let exponent = max.log2().floor() as i32 + 1;
    let scale = 256.0 / 2f64.powi(exponent);
    let m = c.map(|x| (x * scale).min(255.0) as u8);
    [m[0], m[1], m[2], (exponent + 128) as u8]
}

/// A PNG chunk: length, name, data, CRC.
fn chunk(out: &mut Vec<u8>, name: &[u8; 4], data: &[u8]) {
    out.extend((data.len() as u32).to_be_bytes());
    let start = out.len();
    out.extend(name);
    out.extend(data);
    let mut crc = u32::MAX;
    for &byte in &out[start..] {
        crc ^= byte as u32;
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    out.extend((!crc).to_be_bytes());
}

/// zlib with one block of fixed Huffman codes (RFC 1950, RFC 1951): greedy matches against the last place that began
/// with the same three bytes.
fn zlib(data: &[u8]) -> Vec<u8> {
    let mut bits = Bits { out: vec![0x78, 0x01], hold: 0, count: 0 };
    bits.put(0b011, 3);
    let mut last = vec![usize::MAX; 1 << 15];
    let mut i = 0;
    while i < data.len() {
        let mut length = 0;
        let mut distance = 0;
        if i + 3 <= data.len() {
            let h = (data[i] as usize) << 7 ^ (data[i + 1] as usize) << 4 ^ (data[i + 2] as usize) << 1;
            let j = std::mem::replace(&mut last[h & 0x7FFF], i);
            if j != usize::MAX && i - j <= 32768 {
                length = (0..258.min(data.len() - i)).take_while(|&k| data[j + k] == data[i + k]).count();
                distance = i - j;
            }
        }
        if length >= 4 {
            bits.copy(length, distance);
            i += length;
        } else {
            bits.symbol(data[i] as u32);
            i += 1;
        }
    }
    bits.symbol(256);
    bits.put(0, 7);
    let (mut a, mut b) = (1u32, 0u32);
    for &byte in data {
        a = (a + byte as u32) % 65521;
        b = (b + a) % 65521;
    }
    bits.out.extend((b << 16 | a).to_be_bytes());
    bits.out
}

/// Bits, least significant first.
struct Bits {
    out: Vec<u8>,
    hold: u32,
    count: u32,
}

impl Bits {
    fn put(&mut self, value: u32, count: u32) {
        self.hold |= value << self.count;
        self.count += count;
        while self.count >= 8 {
            self.out.push(self.hold as u8);
            self.hold >>= 8;
            self.count -= 8;
        }
    }

    /// Huffman codes go in from their most significant bit.
    fn code(&mut self, value: u32, count: u32) {
        self.put(value.reverse_bits() >> (32 - count), count);
    }

    /// Literals and lengths, RFC 1951 §3.2.6.
    fn symbol(&mut self, s: u32) {
        match s {
            0..=143 => self.code(0x30 + s, 8),
            144..=255 => self.code(0x190 + s - 144, 9),
            256..=279 => self.code(s - 256, 7),
            _ => self.code(0xC0 + s - 280, 8),
        }
    }

    /// A match, RFC 1951 §3.2.5.
    fn copy(&mut self, length: usize, distance: usize) {
        let (mut symbol, mut base) = (257, 3);
        for k in 0..28u32 {
            let extra = if k < 8 { 0 } else { k / 4 - 1 };
            if length < base + (1 << extra) && length < 258 {
                self.symbol(symbol);
                self.put((length - base) as u32, extra);
                break;
            }
            base += 1 << extra;
            symbol += 1;
        }
        if length == 258 {
            self.symbol(285);
        }
        let mut base = 1;
        for k in 0..30u32 {
            let extra = if k < 4 { 0 } else { k / 2 - 1 };
            if distance < base + (1 << extra) {
                self.code(k, 5);
                self.put((distance - base) as u32, extra);
                return;
            }
            base += 1 << extra;
        }
    }
}

/// A hash of lattice points to [0, 1).
pub fn hash(x: i64, y: i64, seed: u64) -> f64 {
    let mut h = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F) ^ seed;
    for _ in 0..2 {
        h = (h ^ h >> 31).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    }
    (h >> 40) as f64 / (1u64 << 24) as f64
}

/// Smooth value noise with whole periods `px`, `py`.
pub fn noise(x: f64, y: f64, px: i64, py: i64, seed: u64) -> f64 {
    let (ix, iy) = (x.floor(), y.floor());
    let s = |t: f64| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (s(x - ix), s(y - iy));
    let g = |dx: i64, dy: i64| hash((ix as i64 + dx).rem_euclid(px), (iy as i64 + dy).rem_euclid(py), seed);
    let a = g(0, 0) * (1.0 - fx) + g(1, 0) * fx;
    let b = g(0, 1) * (1.0 - fx) + g(1, 1) * fx;
    a * (1.0 - fy) + b * fy
}

/// Four octaves over the unit square, starting at `nx` × `ny` cells; repeats.
pub fn fbm(u: f64, v: f64, nx: i64, ny: i64, seed: u64) -> f64 {
    (0..4)
        .map(|k| {
            let m = 1 << k;
            0.533 / m as f64 * noise(u * (nx * m) as f64, v * (ny * m) as f64, nx * m, ny * m, seed + k)
        })
        .sum()
}

/// `a` where t = 0, `b` where t = 1.
pub fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t.clamp(0.0, 1.0))
}

/// A colour times a number.
pub fn dim(a: [f64; 3], t: f64) -> [f64; 3] {
    a.map(|x| x * t)
}

/// Floorboards along v: `boards` across, each cut once at a height of its own.
pub fn planks(dark: [f64; 3], light: [f64; 3], boards: usize, seed: u64) -> Picture {
    Picture::new(192, 192, |u, v| {
        let x = u * boards as f64;
        let board = x.floor() as i64;
        let cut = hash(board, 1, seed);
        let y = (v - cut).rem_euclid(1.0);
        let half = (y > 0.5) as i64;
        let edge = (x - x.floor()).min(1.0 - (x - x.floor())) * 192.0 / boards as f64;
        let end = (y - 0.5).abs().min(y).min(1.0 - y) * 192.0;
        let grain = fbm(u + hash(board, 7 + half, seed), v, 3 * boards as i64, 2, seed + 9);
        let c = mix(dark, light, 0.7 * grain + 0.75 * hash(board, 2 + half, seed) - 0.2);
        if edge < 1.0 || end < 1.0 { dim(c, 0.62) } else { c }
    })
}

/// Two by two tiles in two colours with joints and a little unevenness.
pub fn tiles(a: [f64; 3], b: [f64; 3], joint: [f64; 3], seed: u64) -> Picture {
    Picture::new(192, 192, |u, v| {
        let (x, y) = (u * 2.0, v * 2.0);
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        let edge = [x, y].iter().map(|t| (t - t.round()).abs()).fold(1.0, f64::min);
        if edge < 0.014 {
            return joint;
        }
        let c = if (i + j) % 2 == 0 { a } else { b };
        let c = dim(c, 0.96 + 0.08 * hash(i, j, seed));
        dim(c, 0.84 + 0.32 * fbm(u, v, 5, 5, seed))
    })
}

/// Coursed ashlar: `rows` rows of blocks, every other row shifted.
pub fn ashlar(base: [f64; 3], rows: i64, seed: u64) -> Picture {
    Picture::new(192, 192, |u, v| {
        let y = v * rows as f64;
        let row = y.floor() as i64;
        let x = u * (rows / 2) as f64 + 0.5 * (row % 2) as f64;
        let block = (x.floor() as i64).rem_euclid(rows / 2);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let edge = (fx.min(1.0 - fx) * 2.0).min(fy.min(1.0 - fy));
        let c = dim(base, 0.9 + 0.2 * hash(block, row, seed));
        let c = dim(c, 0.82 + 0.36 * fbm(u, v, 8, 8, seed + 3));
        if edge < 0.035 { dim(c, 0.82) } else { c }
    })
}

/// A patterned carpet with a border.
pub fn carpet(field: [f64; 3], border: [f64; 3], accent: [f64; 3]) -> Picture {
    Picture::new(192, 192, |u, v| {
        let d = u.min(1.0 - u).min(v).min(1.0 - v);
        let (x, y) = ((u * 10.0).rem_euclid(1.0) - 0.5, (v * 14.0).rem_euclid(1.0) - 0.5);
        let diamond = x.abs() + y.abs();
        let c = if d < 0.02 {
            accent
        } else if d < 0.09 {
            if (diamond - 0.3).abs() < 0.09 { accent } else { border }
        } else if d < 0.105 {
            accent
        } else if diamond < 0.16 || (diamond - 0.34).abs() < 0.05 {
            mix(field, accent, 0.7)
        } else {
            field
        };
        dim(c, 0.9 + 0.2 * hash((u * 96.0) as i64, (v * 96.0) as i64, 5))
    })
}

/// A painted landscape: evening sky, hills, water.
pub fn landscape(seed: u64) -> Picture {
    Picture::new(192, 128, |u, v| {
        let brush = fbm(u, v, 14, 10, seed) - 0.5;
        let sky = mix([0.36, 0.52, 0.72], [0.95, 0.78, 0.55], v / 0.55 + 0.5 * brush);
        let sun = ((u - 0.68).powi(2) + (1.5f64 * (v - 0.42)).powi(2)).sqrt();
        let mut c = if sun < 0.05 { [1.0, 0.93, 0.75] } else { sky };
        let ridge = |h: f64, a: f64, n: i64, s: u64| h - a * fbm(u, 0.3, n, 1, s);
        if v > ridge(0.58, 0.3, 3, seed + 11) {
            c = mix([0.42, 0.44, 0.58], [0.55, 0.5, 0.55], 2.0 * brush);
        }
        if v > ridge(0.68, 0.22, 4, seed + 12) {
            c = mix([0.25, 0.36, 0.28], [0.42, 0.46, 0.26], 0.5 + 2.0 * brush);
        }
        if v > 0.66 {
            let glint = noise(u * 12.0, v * 60.0, 12, 60, seed + 5);
            c = mix([0.2, 0.33, 0.42], [0.9, 0.75, 0.55], glint * glint * (1.2 - 3.0 * (u - 0.68).abs()));
        }
        if v > ridge(1.02, 0.25, 3, seed + 13) {
            c = mix([0.16, 0.22, 0.1], [0.3, 0.3, 0.13], 0.5 + 3.0 * brush);
        }
        dim(c, 0.92 + 0.3 * brush)
    })
}

/// A sky in linear radiance for an environment map (y up, column 0 towards −z, then +x): bluer and darker towards the
/// zenith, brighter round the sun, a dull ground; the sun itself is a disc of the radiance `disc` with soft edges.
pub struct Sky {
    pub zenith: [f64; 3],
    pub horizon: [f64; 3],
    pub ground: [f64; 3],
    pub sun: glam::DVec3,
    pub glow: [f64; 3],
    pub disc: [f64; 3],
    /// Half angle of the disc in degrees; at this resolution not under one.
    pub disc_radius: f64,
    pub clouds: f64,
}

impl Sky {
    /// Renders the map, twice as wide as `height`.
    pub fn picture(&self, height: usize) -> Picture {
        let sun = self.sun.normalize();
        Picture::new(2 * height, height, |u, v| {
            let ((sp, cp), (st, ct)) = ((2.0 * PI * u).sin_cos(), (PI * v).sin_cos());
            let d = glam::DVec3::new(sp * st, ct, -cp * st);
            if d.y < 0.0 {
                return dim(self.ground, 0.85 + 0.3 * fbm(u, v, 16, 8, 2));
            }
            let mut c = mix(self.horizon, self.zenith, d.y.powf(0.45));
            let cover = (2.2 * fbm(u, v, 8, 10, 77) - 0.95).clamp(0.0, 1.0) * self.clouds;
            c = mix(c, dim(self.horizon, 1.25), cover);
            let angle = d.dot(sun).clamp(-1.0, 1.0).acos().to_degrees();
            let glow = (-angle / 14.0).exp();
            let disc = (1.5 - angle / self.disc_radius).clamp(0.0, 1.0);
            std::array::from_fn(|i| c[i] + self.glow[i] * glow + self.disc[i] * disc)
        })
    }
}
