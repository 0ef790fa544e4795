//! Tests of textures, against Mitsuba 3.9.1 where it has them.

use super::*;
use crate::math::{Frame, Vec3};
use crate::scene::{ImageId, Severity};

fn at(u: f32, v: f32) -> SurfacePoint {
    SurfacePoint {
        p: Vec3::ZERO,
        error: 0.0,
        ng: Vec3::Z,
        frame: Frame::from_normal(Vec3::Z),
        uv: Vec2::new(u, v),
        dpdu: Vec3::X,
        dpdv: Vec3::Y,
        color: Rgb::WHITE,
    }
}

fn image(width: u32, height: u32, channels: u32, pixels: Pixels) -> ImageDesc {
    ImageDesc { path: "test.png".into(), image: Arc::new(Image { width, height, channels, pixels }) }
}

const IDENTITY: UvMap = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn bitmap(to_uv: UvMap, filter: TextureFilter, wrap: WrapMode, scale: f32) -> TextureDesc {
    TextureDesc::Bitmap { image: ImageId(0), to_uv, filter, wrap, scale }
}

fn build(descs: &[TextureDesc], images: &[ImageDesc]) -> (TextureSet, Diagnostics) {
    let mut diagnostics = Diagnostics::default();
    (TextureSet::build(descs, images, &mut diagnostics), diagnostics)
}

/// Value and gradient.
type Row = (f32, [f32; 2]);

/// Mitsuba 3.9.1, scalar_rgb: `eval_1` and `eval_1_grad` of a `bitmap` of 4 x 3 texels with `to_uv`.
    #[rustfmt::skip]
    const MITSUBA: [(WrapMode, TextureFilter, [Row; 6]); 6] = [
(WrapMode::Repeat, TextureFilter::Nearest, [(0.1875, [0.0, 0.0]), (0.5, [0.0, 0.0]), (0.5625, [0.0, 0.0]), (0.0625, [0.0, 0.0]), (0.625, [0.0, 0.0]), (0.625, [0.0, 0.0])]),
        (WrapMode::Repeat, TextureFilter::Bilinear, [(0.405, [1.95, 0.39375]), (0.51554, [-0.429, -0.4977]), (0.507256, [-2.24055, 0.83055]), (0.17585, [0.663, -0.651]), (0.62255, [0.234, -0.336]), (0.635285, [-0.507, -0.4473])]),
        (WrapMode::Mirror, TextureFilter::Nearest, [(0.1875, [0.0, 0.0]), (0.5, [0.0, 0.0]), (0.0625, [0.0, 0.0]), (0.75, [0.0, 0.0]), (0.5625, [0.0, 0.0]), (0.0625, [0.0, 0.0])]),
        (WrapMode::Mirror, TextureFilter::Bilinear, [(0.345, [1.95, 0.0]), (0.30281, [-0.156, 0.56595]), (0.117744, [2.24055, -0.83055]), (0.5599, [-1.378, 0.821625]), (0.486113, [-1.69975, -0.716625]), (0.166093, [-2.34975, 0.59535])]),
        (WrapMode::Clamp, TextureFilter::Nearest, [(0.1875, [0.0, 0.0]), (0.0625, [0.0, 0.0]), (0.25, [0.0, 0.0]), (0.1875, [0.0, 0.0]), (0.6875, [0.0, 0.0]), (0.0625, [0.0, 0.0])]),
        (WrapMode::Clamp, TextureFilter::Bilinear, [(0.345, [1.95, 0.0]), (0.1465, [0.975, 0.0]), (0.254937, [0.0, -0.13125]), (0.1875, [0.0, 0.0]), (0.6875, [0.0, 0.0]), (0.1505, [-2.6, -0.0])]),
    ];

#[test]
fn bitmaps_agree_with_mitsuba() {
    let values = [3.0, 9.0, 1.0, 4.0, 7.0, 2.0, 8.0, 5.0, 6.0, 12.0, 10.0, 11.0].map(|v: f32| v / 16.0);
    let picture = [image(4, 3, 1, Pixels::F32(values.to_vec()))];
    let to_uv = [[1.3, 0.0, 0.1], [0.0, -0.7, 0.2]];
    let points = [(0.1, 0.2), (0.49, 0.8), (0.99, 0.01), (-0.3, 1.4), (1.2, -2.3), (0.37, 0.55)];
    for (wrap, filter, rows) in MITSUBA {
        // A scale of two doubles values and gradients.
        let (set, _) = build(&[bitmap(to_uv, filter, wrap, 1.0), bitmap(to_uv, filter, wrap, 2.0)], &picture);
        for ((u, v), (value, gradient)) in points.into_iter().zip(rows) {
            for (id, scale) in [(0, 1.0), (1, 2.0)] {
                let texture = set.get(TextureId(id)).expect("built");
                let p = at(u, v);
                assert!((texture.scalar(&p) - scale * value).abs() < 1e-5, "{wrap:?} {filter:?} {u} {v}");
                assert!((texture.color(&p).b - scale * value).abs() < 1e-5);
                let error = texture.gradient(&p) - scale * Vec2::from(gradient);
                assert!(error.abs().max_element() < 1e-4, "{wrap:?} {filter:?} {u} {v} {error}");
            }
        }
    }
}

/// Mitsuba multiplies by the resolution after undoing `to_uv`, which is wrong for rotated maps of pictures that are not
/// square; here the gradient is that of the value.
#[test]
fn gradients_are_differences_of_values() {
    let values = [3.0, 9.0, 1.0, 4.0, 7.0, 2.0, 8.0, 5.0, 6.0, 12.0, 10.0, 11.0].map(|v: f32| v / 16.0);
    let picture = [image(4, 3, 1, Pixels::F32(values.to_vec()))];
    let (set, _) = build(
        &[bitmap([[1.0, 0.5, 0.1], [-0.25, 1.0, 0.0]], TextureFilter::Bilinear, WrapMode::Mirror, 1.5)],
        &picture,
    );
    let texture = set.get(TextureId(0)).expect("built");
    let h = 1e-3;
    for (u, v) in [(0.1, 0.2), (0.49, 0.82), (0.37, 0.55), (-0.31, 1.4)] {
        let du = (texture.scalar(&at(u + h, v)) - texture.scalar(&at(u - h, v))) / (2.0 * h);
        let dv = (texture.scalar(&at(u, v + h)) - texture.scalar(&at(u, v - h))) / (2.0 * h);
        let error = texture.gradient(&at(u, v)) - Vec2::new(du, dv);
        assert!(error.abs().max_element() < 5e-3, "{u} {v} {error}");
    }
}

#[test]
fn eight_bit_pictures_are_decoded_on_reading() {
    let bytes = vec![0u8, 128, 255, 64, 32, 16, 200, 100, 50, 10, 20, 30];
    let pictures = [image(2, 2, 3, Pixels::Srgb8(bytes.clone())), image(2, 2, 3, Pixels::Linear8(bytes))];
    for (i, picture) in pictures.iter().enumerate() {
        let (set, _) =
            build(&[bitmap(IDENTITY, TextureFilter::Nearest, WrapMode::Repeat, 1.0)], std::slice::from_ref(picture));
        let texture = set.get(TextureId(0)).expect("built");
        let mut mean = Rgb::BLACK;
        for (x, y) in [(0u32, 0u32), (1, 0), (0, 1), (1, 1)] {
            let p = at((x as f32 + 0.5) / 2.0, (y as f32 + 0.5) / 2.0);
            let expected = picture.image.rgb(x, y);
            assert!((0..3).all(|c| (texture.color(&p)[c] - expected[c]).abs() < 1e-6), "{i} {x} {y}");
            assert!((texture.scalar(&p) - expected.luminance()).abs() < 1e-6);
            mean += expected * 0.25;
        }
        assert!((0..3).all(|c| (texture.mean()[c] - mean[c]).abs() < 1e-6));
    }
}

#[test]
fn checkerboard_squares_are_half_a_unit() {
    let (red, green) = (Rgb::new(1.0, 0.0, 0.0), Rgb::new(0.0, 1.0, 0.0));
    let inner = TextureDesc::Checkerboard {
        color0: ColorDesc::Constant(red),
        color1: ColorDesc::Constant(green),
        to_uv: IDENTITY,
    };
    let outer = TextureDesc::Checkerboard {
        color0: ColorDesc::Texture(TextureId(1)),
        color1: ColorDesc::Constant(Rgb::WHITE),
        to_uv: [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]],
    };
    // The nested one comes later: order does not matter.
    let (set, diagnostics) = build(&[outer, inner], &[]);
    assert!(diagnostics.list.is_empty());
    let (outer, inner) = (set.get(TextureId(0)).expect("built"), set.get(TextureId(1)).expect("built"));
    // As Mitsuba 3.9.1.
    for (u, v, color) in
        [(0.1, 0.2, red), (0.6, 0.2, green), (0.5, 0.2, red), (0.5, 0.5, red), (0.75, 0.75, red), (-0.1, 0.2, green)]
    {
        assert_eq!(inner.color(&at(u, v)), color, "{u} {v}");
    }
    assert_eq!(outer.color(&at(0.6, 0.2)), green);
    assert_eq!(outer.color(&at(1.6, 0.2)), Rgb::WHITE);
    assert_eq!(inner.mean(), Rgb::new(0.5, 0.5, 0.0));
    assert_eq!(inner.gradient(&at(0.3, 0.3)), Vec2::ZERO);
}

#[test]
fn broken_textures_are_errors_and_grey() {
    let circle = TextureDesc::Checkerboard {
        color0: ColorDesc::Texture(TextureId(0)),
        color1: ColorDesc::Constant(Rgb::WHITE),
        to_uv: IDENTITY,
    };
    let missing = bitmap(IDENTITY, TextureFilter::Bilinear, WrapMode::Clamp, 1.0);
    let short = image(4, 4, 3, Pixels::Linear8(vec![0; 5]));
    for (descs, images) in [(vec![circle], vec![]), (vec![missing.clone()], vec![]), (vec![missing], vec![short])] {
        let (set, diagnostics) = build(&descs, &images);
        assert_eq!(diagnostics.count(Severity::Error), 1);
        let color = set.color(ColorDesc::Texture(TextureId(0)));
        assert_eq!(color.eval(&at(0.3, 0.4)), Rgb::grey(0.5));
        assert_eq!(set.scalar(ScalarDesc::Texture(TextureId(0))).mean(), 0.5);
    }
}

#[test]
fn coordinates_that_are_not_finite_read_some_texel() {
    let picture = [image(2, 2, 1, Pixels::F32(vec![1.0, 2.0, 3.0, 4.0]))];
    for filter in [TextureFilter::Nearest, TextureFilter::Bilinear] {
        for wrap in [WrapMode::Repeat, WrapMode::Mirror, WrapMode::Clamp] {
            let (set, _) = build(&[bitmap(IDENTITY, filter, wrap, 1.0)], &picture);
            let texture = set.get(TextureId(0)).expect("built");
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30] {
                let value = texture.scalar(&at(bad, 0.3));
                assert!((1.0..=4.0).contains(&value), "{filter:?} {wrap:?} {bad} {value}");
                assert!(texture.gradient(&at(bad, bad)).is_finite());
            }
        }
    }
}
