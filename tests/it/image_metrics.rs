//! Measures of error against values computed elsewhere: the simple ones with numpy 2 in f64 (and scipy), ꟻLIP with
//! NVIDIA's flip-evaluator 1.7 (`evaluate(…, 'LDR', inputsRGB=False)` and `evaluate(…, 'HDR')`, default viewer). All on
//! pictures of 64 x 48 pixels made by the formulas below, which use only operations that are exact or rounded once.

use lightsieve::image::flip::{hdr_flip, ldr_flip};
use lightsieve::image::metrics::picture_errors;
use lightsieve::image::z_test::z_test;
use lightsieve::image::{Image, Pixels, SizeMismatch, compare};
use lightsieve::measure::reference::OwnError;

const WIDTH: usize = 64;
const HEIGHT: usize = 48;

fn picture(f: impl Fn(usize, usize, usize) -> f64) -> Image {
    let value = |i: usize| f(i / 3 % WIDTH, i / 3 / WIDTH, i % 3) as f32;
    let values = (0..WIDTH * HEIGHT * 3).map(value).collect();
    Image { width: WIDTH as u32, height: HEIGHT as u32, channels: 3, pixels: Pixels::F32(values) }
}

fn colours(image: &Image) -> Vec<[f64; 3]> {
    let pixels = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
    pixels.map(|(x, y)| image.rgb(x, y).to_array().map(f64::from)).collect()
}

/// Uniform in [0, 1).
fn noise(seed: u64, x: usize, y: usize, c: usize) -> f64 {
    let i = ((y * WIDTH + x) * 3 + c) as u64;
    let first = (i * 2_654_435_761 + seed * 40_503) & 0xffff_ffff;
    (first.wrapping_mul(2_246_822_519) & 0xffff_ffff) as f64 / 4_294_967_296.0
}

fn gradient(x: usize, y: usize, c: usize) -> f64 {
    [x as f64 / 64.0, y as f64 / 48.0, 0.5][c]
}

fn checker(x: usize, y: usize, c: usize) -> f64 {
    ((x / 8 + y / 8) % 2) as f64 * [0.75, 0.5, 0.25][c] + 0.125
}

/// Eight bands, each twice as bright as the one before.
fn bands(x: usize, y: usize, c: usize) -> f64 {
    (0.25 + gradient(x, y, c)) * ((x / 8) as f64 - 3.0).exp2()
}

fn noisy_bands() -> Image {
    picture(|x, y, c| bands(x, y, c) * (0.5 + noise(2, x, y, c)))
}

fn bands_with_fireflies() -> Image {
    picture(|x, y, c| bands(x, y, c) + if (x * 7 + y * 13) % 211 == 0 { 1000.0 } else { 0.0 })
}

/// Pixels whose values were recorded.
const POINTS: [(usize, usize); 4] = [(0, 0), (17, 5), (40, 30), (63, 47)];

fn assert_map(name: &str, found: &[f64], mean: f64, points: [f64; 4]) {
    let found_mean = found.iter().sum::<f64>() / found.len() as f64;
    assert!((found_mean - mean).abs() < 1e-5, "{name}: mean {found_mean}, expected {mean}");
    for ((x, y), expected) in POINTS.into_iter().zip(points) {
        let found = found[y * WIDTH + x];
        assert!((found - expected).abs() < 1e-4, "{name} at ({x}, {y}): {found}, expected {expected}");
    }
}

#[test]
fn ldr_flip_agrees_with_flip_evaluator() {
    let check = |name: &str, image: Image, reference: Image, mean: f64, points: [f64; 4]| {
        let map = ldr_flip(&colours(&image), &colours(&reference), WIDTH);
        assert_map(name, &map.values, mean, points);
    };
    check(
        "noise",
        picture(|x, y, c| (gradient(x, y, c) + 0.25 * (noise(1, x, y, c) - 0.5)).clamp(0.0, 1.0)),
        picture(gradient),
        0.10398054867982864,
        [0.12463334947824478, 0.1467832624912262, 0.08938541263341904, 0.1744207739830017],
    );
    check(
        "shifted edges",
        picture(|x, y, c| checker(x + 1, y, c)),
        picture(checker),
        0.24063320457935333,
        [0.0336676761507988, 0.2940675616264343, 0.4549742639064789, 0.9372571706771851],
    );
    check(
        "dots",
        picture(|x, y, _| if x % 8 == 3 && y % 8 == 5 { 0.75 } else { 0.25 }),
        picture(|_, _, _| 0.25),
        0.044023316353559494,
        [0.0, 0.08324956893920898, 0.014159699901938438, 0.000680387718603015],
    );
    let plain = |channel| picture(move |_, _, c| if c == channel { 1.0 } else { 0.0 });
    check("blue for green", plain(2), plain(1), 1.0, [1.0; 4]);
}

#[test]
fn hdr_flip_agrees_with_flip_evaluator() {
    let check = |name: &str, image: Image, mean: f64, points: [f64; 4]| {
        let map = hdr_flip(&colours(&image), &colours(&picture(bands)), WIDTH);
        assert_map(name, &map.values, mean, points);
    };
    check(
        "noise",
        noisy_bands(),
        0.1341865211725235,
        [0.12754258513450623, 0.15175452828407288, 0.14184331893920898, 0.27360057830810547],
    );
    check(
        "fireflies",
        bands_with_fireflies(),
        0.038390275090932846,
        [0.9895676970481873, 0.35848116874694824, 0.0014611202059313655, 0.0],
    );
}

fn close(name: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-11 * expected.abs(), "{name}: {found}, expected {expected}");
}

#[test]
fn picture_errors_agree_with_numpy() {
    let r = compare(&noisy_bands(), &picture(bands)).unwrap();
    close("mse", r.mse, 3.003285392795731);
    close("rmse", r.rmse, 1.7329989592598523);
    close("mae", r.mae, 0.8500464516071387);
    close("mape", r.mape, 0.24156626166480916);
    close("relmse", r.relmse, 0.07181411277781918);
    close("relmse_trimmed", r.relmse_trimmed, 0.0716582176847672);
    close("mean_ratio", r.mean_ratio, 0.9981198947036602);
    assert_eq!(r.non_finite, 0);
    assert!((r.hdr_flip - 0.1341865211725235).abs() < 1e-5);

    let r = compare(&bands_with_fireflies(), &picture(bands)).unwrap();
    close("mse", r.mse, 4882.812495755691);
    close("mape", r.mape, 20.33032360701069);
    close("relmse", r.relmse, 84438.44264633497);
    close("relmse_trimmed", r.relmse_trimmed, 17985.197370183727);
    close("mean_ratio", r.mean_ratio, 2.442775900206148);
}

#[test]
fn errors_in_units_of_their_spread_agree_with_numpy() {
    // With variances v = b²/12 of the picture and b²/64 of the reference; the threshold is scipy's norm.isf.
    let variance = |share: f64| colours(&picture(|x, y, c| bands(x, y, c) * bands(x, y, c) / share));
    let (image, reference) = (colours(&noisy_bands()), colours(&picture(bands)));
    let z = z_test(WIDTH, (&image, Some(&variance(12.0))), (&reference, Some(&variance(64.0)))).unwrap();
    assert_eq!((z.values, z.beyond_2, z.beyond_3), (9216, 0.0, 0.0));
    close("rms", z.rms, 0.916963772032476);
    close("worst", z.worst, 1.5754992147798985);
    close("whole", z.whole, -0.194668832604774);
    assert!((z.threshold - 5.311777286964634).abs() < 1e-9, "{}", z.threshold);
    let own = OwnError::new(&reference, &variance(12.0));
    close("own relmse", own.relmse, 0.07178135109386805);
    close("own mape", own.mape, 0.22273474636830082);
    close("own mae", own.mae, 0.7795080551722646);
}

#[test]
fn equal_pictures_have_no_error_at_all() {
    let r = compare(&picture(bands), &picture(bands)).unwrap();
    assert_eq!((r.mse, r.mae, r.mape, r.relmse, r.relmse_trimmed), (0.0, 0.0, 0.0, 0.0, 0.0));
    assert_eq!((r.flip, r.hdr_flip, r.mean_ratio), (0.0, 0.0, 1.0));
}

#[test]
fn non_finite_pixels_are_counted_and_left_out() {
    let (mut image, mut reference) = (noisy_bands(), picture(bands));
    let set = |image: &mut Image, x: usize, y: usize, c: usize, value: f32| {
        let Pixels::F32(values) = &mut image.pixels else { panic!("expected floats") };
        values[(y * WIDTH + x) * 3 + c] = value;
    };
    set(&mut image, 10, 10, 0, f32::NAN);
    set(&mut image, 20, 10, 1, f32::INFINITY);
    set(&mut reference, 20, 10, 2, f32::NAN);
    set(&mut reference, 30, 10, 2, f32::NEG_INFINITY);
    let found = compare(&image, &reference).unwrap();
    assert_eq!(found.non_finite, 3);

    let left_out = [(10, 10), (20, 10), (30, 10)].map(|(x, y)| y * WIDTH + x);
    let kept = |image: &Image| -> Vec<[f64; 3]> {
        colours(image).into_iter().enumerate().filter(|(i, _)| !left_out.contains(i)).map(|(_, p)| p).collect()
    };
    let expected = picture_errors(&kept(&noisy_bands()), &kept(&picture(bands)), 1);
    assert_eq!((found.mse, found.relmse, found.mean_ratio), (expected.mse, expected.relmse, expected.mean_ratio));
    // Three pixels of three thousand hardly change the mean.
    assert!((found.hdr_flip - 0.134).abs() < 0.002 && found.flip.is_finite());
}

#[test]
fn pictures_without_a_finite_pixel_or_with_a_black_reference() {
    let nan = picture(|_, _, _| f64::NAN);
    let r = compare(&nan, &nan).unwrap();
    assert_eq!(r.non_finite, (WIDTH * HEIGHT) as u64);
    assert!(r.mse.is_nan() && r.flip.is_nan() && r.hdr_flip.is_nan() && r.relmse_trimmed.is_nan());

    let black = picture(|_, _, _| 0.0);
    let r = compare(&picture(|_, _, _| 0.5), &black).unwrap();
    assert!(r.hdr_flip > 0.5 && r.hdr_flip <= 1.0 && r.mean_ratio.is_infinite());
    assert_eq!(compare(&black, &black).unwrap().hdr_flip, 0.0);
}

#[test]
fn sizes_must_agree() {
    let small = Image { width: 2, height: 1, channels: 1, pixels: Pixels::F32(vec![0.0; 2]) };
    let tall = Image { width: 1, height: 2, ..small.clone() };
    let error = compare(&small, &tall).unwrap_err();
    assert_eq!(error, SizeMismatch { image: (2, 1), reference: (1, 2) });
    assert_eq!(error.to_string(), "the sizes differ: 2 x 1 against 1 x 2 pixels");
    // One pixel is less than any filter is wide.
    let dot = Image { width: 1, height: 1, channels: 1, pixels: Pixels::F32(vec![0.5]) };
    assert_eq!(compare(&dot, &dot).unwrap().flip, 0.0);
}

#[test]
fn the_report_has_the_promised_keys() {
    let json = serde_json::to_value(compare(&picture(bands), &picture(bands)).unwrap()).unwrap();
    let keys: Vec<&str> = json.as_object().unwrap().keys().map(String::as_str).collect();
    let expected = [
        "mse",
        "rmse",
        "mae",
        "mape",
        "relmse",
        "relmse_trimmed",
        "relmse_8x8",
        "relmse_16x16",
        "relmse_32x32",
        "relmse_whole",
        "flip",
        "hdr_flip",
        "mean_ratio",
        "non_finite",
    ];
    assert_eq!(keys, expected);
}
