//! Textures: colours and numbers that vary over a surface.
//!
//! Conventions of Mitsuba 3's `bitmap` and `checkerboard`: texel centres lie at integers + ½, row = v · height counted
//! from the top of the picture, and wrapping acts on texels. Eight-bit pictures are decoded on reading, through a table
//! of 256 values that holds the transfer curve and the scale, so they take no more memory than their file.

use super::SurfacePoint;
use crate::image::{Image, Pixels};
use crate::math::{Rgb, Vec2};
use crate::scene::{
    ColorDesc, Diagnostic, Diagnostics, ImageDesc, ScalarDesc, TextureDesc, TextureFilter, TextureId, WrapMode,
};
use std::sync::Arc;

/// A texture that is not constant.
#[derive(Debug)]
pub enum Texture {
    /// A picture.
    Bitmap(Bitmap),
    /// Two colours in squares.
    Checkerboard(Checkerboard),
    /// Colours of the mesh times a number.
    MeshAttribute(f32),
}

impl Texture {
    /// Colour at texture coordinates.
    pub fn color(&self, point: &SurfacePoint) -> Rgb {
        match self {
            Texture::Bitmap(b) => b.color(point.uv),
            Texture::Checkerboard(c) => c.side(point.uv).eval(point),
            Texture::MeshAttribute(scale) => point.color * *scale,
        }
    }

    /// The single channel, or the luminance of a colour.
    pub fn scalar(&self, point: &SurfacePoint) -> f32 {
        match self {
            Texture::Bitmap(b) => b.scalar(point.uv),
            Texture::Checkerboard(c) => c.side(point.uv).eval(point).luminance(),
            Texture::MeshAttribute(scale) => (point.color * *scale).luminance(),
        }
    }

    /// ∂/∂u and ∂/∂v of [`Texture::scalar`]; zero where the texture is piecewise constant.
    pub fn gradient(&self, point: &SurfacePoint) -> Vec2 {
        match self {
            Texture::Bitmap(b) => b.gradient(point.uv),
            Texture::Checkerboard(_) | Texture::MeshAttribute(_) => Vec2::ZERO,
        }
    }

    /// Mean over the unit square of texture space (before `to_uv`); of mesh attributes, which are not known here, a
    /// middle value.
    pub fn mean(&self) -> Rgb {
        match self {
            Texture::Bitmap(b) => b.mean,
            Texture::Checkerboard(c) => (c.even.mean() + c.odd.mean()) * 0.5,
            Texture::MeshAttribute(scale) => Rgb::grey(0.5 * scale),
        }
    }
}

/// A colour that may vary over a surface.
#[derive(Clone, Debug)]
pub enum ColorTexture {
    /// Constant.
    Constant(Rgb),
    /// Looked up.
    Texture(Arc<Texture>),
}

impl ColorTexture {
    /// Linear colour at the point.
    #[inline]
    pub fn eval(&self, point: &SurfacePoint) -> Rgb {
        match self {
            ColorTexture::Constant(c) => *c,
            ColorTexture::Texture(t) => t.color(point),
        }
    }

    /// Mean colour.
    pub fn mean(&self) -> Rgb {
        match self {
            ColorTexture::Constant(c) => *c,
            ColorTexture::Texture(t) => t.mean(),
        }
    }

    /// True if it is looked up.
    pub fn is_textured(&self) -> bool {
        matches!(self, ColorTexture::Texture(_))
    }
}

/// A number that may vary over a surface.
#[derive(Clone, Debug)]
pub enum ScalarTexture {
    /// Constant.
    Constant(f32),
    /// Looked up: the single channel, or the luminance.
    Texture(Arc<Texture>),
}

impl ScalarTexture {
    /// Value at the point.
    #[inline]
    pub fn eval(&self, point: &SurfacePoint) -> f32 {
        match self {
            ScalarTexture::Constant(c) => *c,
            ScalarTexture::Texture(t) => t.scalar(point),
        }
    }

    /// Mean value.
    pub fn mean(&self) -> f32 {
        match self {
            ScalarTexture::Constant(c) => *c,
            ScalarTexture::Texture(t) => t.mean().luminance(),
        }
    }

    /// True if it is looked up.
    pub fn is_textured(&self) -> bool {
        matches!(self, ScalarTexture::Texture(_))
    }
}

/// An affine map of texture coordinates, rows of [a b c; d e f].
type UvMap = [[f32; 3]; 2];

fn map_uv(m: &UvMap, uv: Vec2) -> Vec2 {
    let row = |r: &[f32; 3]| r[0] * uv.x + r[1] * uv.y + r[2];
    Vec2::new(row(&m[0]), row(&m[1]))
}

/// A picture laid over texture space.
#[derive(Debug)]
pub struct Bitmap {
    image: Arc<Image>,
    /// Meaning of eight-bit values, scale included; empty for float pictures.
    decode: Vec<f32>,
    /// Multiplies float pictures.
    scale: f32,
    to_uv: UvMap,
    filter: TextureFilter,
    wrap: WrapMode,
    mean: Rgb,
}

/// Four texels around a point and the fractions of the way from the first to the others.
struct Footprint<T> {
    texels: [T; 4],
    fx: f32,
    fy: f32,
}

impl Bitmap {
    fn new(image: Arc<Image>, to_uv: UvMap, filter: TextureFilter, wrap: WrapMode, scale: f32) -> Bitmap {
        let decode: Vec<f32> = match &image.pixels {
            Pixels::Srgb8(_) => {
                (0..256).map(|i| crate::image::buffer::srgb_to_linear(f64::from(i) / 255.0) as f32 * scale).collect()
            }
            Pixels::Linear8(_) => (0..256).map(|i| i as f32 / 255.0 * scale).collect(),
            Pixels::F32(_) => Vec::new(),
        };
        let mut bitmap = Bitmap { image, decode, scale, to_uv, filter, wrap, mean: Rgb::BLACK };
        bitmap.mean = bitmap.compute_mean();
        bitmap
    }

    fn compute_mean(&self) -> Rgb {
        let (w, h) = (self.image.width as usize, self.image.height as usize);
        let mut sum = [0.0f64; 3];
        for y in 0..h {
            for x in 0..w {
                let c = self.texel(x, y).to_array();
                sum.iter_mut().zip(c).for_each(|(s, c)| *s += f64::from(c));
            }
        }
        let n = (w * h) as f64;
        Rgb::new((sum[0] / n) as f32, (sum[1] / n) as f32, (sum[2] / n) as f32)
    }

    #[inline]
    fn channel(&self, index: usize) -> f32 {
        match &self.image.pixels {
            Pixels::Srgb8(v) | Pixels::Linear8(v) => self.decode[v[index] as usize],
            Pixels::F32(v) => v[index] * self.scale,
        }
    }

    #[inline]
    fn texel(&self, x: usize, y: usize) -> Rgb {
        let channels = self.image.channels as usize;
        let i = (y * self.image.width as usize + x) * channels;
        if channels < 3 {
            Rgb::grey(self.channel(i))
        } else {
            Rgb::new(self.channel(i), self.channel(i + 1), self.channel(i + 2))
        }
    }

    #[inline]
    fn texel_scalar(&self, x: usize, y: usize) -> f32 {
        let channels = self.image.channels as usize;
        if channels < 3 {
            self.channel((y * self.image.width as usize + x) * channels)
        } else {
            self.texel(x, y).luminance()
        }
    }

    /// Texel coordinate → index, beyond the edges as the wrap mode says.
    #[inline]
    fn wrapped(&self, i: i64, size: u32) -> usize {
        let n = i64::from(size);
        // Most look-ups are inside, and a remainder is as slow as a cache miss.
        if (0..n).contains(&i) {
            return i as usize;
        }
        let i = match self.wrap {
            WrapMode::Repeat => i.rem_euclid(n),
            WrapMode::Clamp => i.clamp(0, n - 1),
            WrapMode::Mirror => {
                let j = i.rem_euclid(2 * n);
                if j < n { j } else { 2 * n - 1 - j }
            }
        };
        i as usize
    }

    fn nearest(&self, uv: Vec2) -> (usize, usize) {
        let uv = map_uv(&self.to_uv, uv);
        // A float that is not finite converts to some integer: any texel will do, but there must be one.
        let x = (uv.x * self.image.width as f32).floor() as i64;
        let y = (uv.y * self.image.height as f32).floor() as i64;
        (self.wrapped(x, self.image.width), self.wrapped(y, self.image.height))
    }

    fn footprint<T>(&self, uv: Vec2, texel: impl Fn(usize, usize) -> T) -> Footprint<T> {
        let uv = map_uv(&self.to_uv, uv);
        let (x, y) = (uv.x * self.image.width as f32 - 0.5, uv.y * self.image.height as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (i, j) = (x0 as i64, y0 as i64);
        let (i0, i1) = (self.wrapped(i, self.image.width), self.wrapped(i.saturating_add(1), self.image.width));
        let (j0, j1) = (self.wrapped(j, self.image.height), self.wrapped(j.saturating_add(1), self.image.height));
        let fraction = |x: f32, x0: f32| if x.is_finite() { x - x0 } else { 0.0 };
        Footprint {
            texels: [texel(i0, j0), texel(i1, j0), texel(i0, j1), texel(i1, j1)],
            fx: fraction(x, x0),
            fy: fraction(y, y0),
        }
    }

    fn color(&self, uv: Vec2) -> Rgb {
        match self.filter {
            TextureFilter::Nearest => {
                let (x, y) = self.nearest(uv);
                self.texel(x, y)
            }
            TextureFilter::Bilinear => {
                let Footprint { texels: [a, b, c, d], fx, fy } = self.footprint(uv, |x, y| self.texel(x, y));
                a.lerp(b, fx).lerp(c.lerp(d, fx), fy)
            }
        }
    }

    fn scalar(&self, uv: Vec2) -> f32 {
        match self.filter {
            TextureFilter::Nearest => {
                let (x, y) = self.nearest(uv);
                self.texel_scalar(x, y)
            }
            TextureFilter::Bilinear => {
                let Footprint { texels: [a, b, c, d], fx, fy } = self.footprint(uv, |x, y| self.texel_scalar(x, y));
                (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy
            }
        }
    }

    fn gradient(&self, uv: Vec2) -> Vec2 {
        if self.filter == TextureFilter::Nearest {
            return Vec2::ZERO;
        }
        let Footprint { texels: [a, b, c, d], fx, fy } = self.footprint(uv, |x, y| self.texel_scalar(x, y));
        let dx = ((b - a) * (1.0 - fy) + (d - c) * fy) * self.image.width as f32;
        let dy = ((c - a) * (1.0 - fx) + (d - b) * fx) * self.image.height as f32;
        let m = &self.to_uv;
        Vec2::new(m[0][0] * dx + m[1][0] * dy, m[0][1] * dx + m[1][1] * dy)
    }
}

/// Two colours in squares of side one half.
#[derive(Debug)]
pub struct Checkerboard {
    even: ColorTexture,
    odd: ColorTexture,
    to_uv: UvMap,
}

impl Checkerboard {
    fn side(&self, uv: Vec2) -> &ColorTexture {
        let uv = map_uv(&self.to_uv, uv);
        let upper = |x: f32| x - x.floor() > 0.5;
        if upper(uv.x) == upper(uv.y) { &self.even } else { &self.odd }
    }
}

/// All textures of a scene.
#[derive(Debug, Default)]
pub struct TextureSet {
    textures: Vec<Option<Arc<Texture>>>,
}

/// Checkerboards may hold checkerboards; deeper than this is taken for a cycle.
const MAX_NESTING: u32 = 16;

impl TextureSet {
    /// Builds every texture. A texture that cannot be built (no such picture, no pixels, a cycle) is reported as an
    /// error and reads as mid grey.
    pub fn build(descs: &[TextureDesc], images: &[ImageDesc], diagnostics: &mut Diagnostics) -> TextureSet {
        let mut set = TextureSet { textures: vec![None; descs.len()] };
        for i in 0..descs.len() {
            if let Err(what) = set.build_one(i, descs, images, 0) {
                diagnostics.push(Diagnostic::error("scene::texture", format!("texture {i}: {what}")));
            }
        }
        set
    }

    fn build_one(&mut self, i: usize, descs: &[TextureDesc], images: &[ImageDesc], depth: u32) -> Result<(), String> {
        let desc = descs.get(i).ok_or_else(|| format!("there is no texture {i}"))?;
        if self.textures[i].is_some() {
            return Ok(());
        }
        if depth > MAX_NESTING {
            return Err("textures contain each other in a circle".into());
        }
        let texture = match desc {
            TextureDesc::Bitmap { image, to_uv, filter, wrap, scale } => {
                let image = images.get(image.index()).ok_or("its picture does not exist")?;
                let (w, h, c) = (image.image.width, image.image.height, image.image.channels);
                let held = match &image.image.pixels {
                    Pixels::Srgb8(v) | Pixels::Linear8(v) => v.len(),
                    Pixels::F32(v) => v.len(),
                };
                if w == 0 || h == 0 || c == 0 || held != w as usize * h as usize * c as usize {
                    return Err(format!("picture {} holds no pixels", image.path.display()));
                }
                Texture::Bitmap(Bitmap::new(image.image.clone(), *to_uv, *filter, *wrap, *scale))
            }
            TextureDesc::MeshAttribute { scale } => Texture::MeshAttribute(*scale),
            TextureDesc::Checkerboard { color0, color1, to_uv } => {
                for c in [color0, color1] {
                    if let ColorDesc::Texture(id) = c {
                        self.build_one(id.index(), descs, images, depth + 1)?;
                    }
                }
                Texture::Checkerboard(Checkerboard {
                    even: self.color(*color0),
                    odd: self.color(*color1),
                    to_uv: *to_uv,
                })
            }
        };
        self.textures[i] = Some(Arc::new(texture));
        Ok(())
    }

    /// The texture of an id, if it could be built.
    pub fn get(&self, id: TextureId) -> Option<&Arc<Texture>> {
        self.textures.get(id.index())?.as_ref()
    }

    /// Binds a description to its texture.
    pub fn color(&self, desc: ColorDesc) -> ColorTexture {
        match desc {
            ColorDesc::Constant(c) => ColorTexture::Constant(c),
            ColorDesc::Texture(id) => match self.get(id) {
                Some(t) => ColorTexture::Texture(t.clone()),
                None => ColorTexture::Constant(Rgb::grey(0.5)),
            },
        }
    }

    /// Binds a description to its texture.
    pub fn scalar(&self, desc: ScalarDesc) -> ScalarTexture {
        match desc {
            ScalarDesc::Constant(c) => ScalarTexture::Constant(c),
            ScalarDesc::Texture(id) => match self.get(id) {
                Some(t) => ScalarTexture::Texture(t.clone()),
                None => ScalarTexture::Constant(0.5),
            },
        }
    }
}

#[cfg(test)]
mod tests;
