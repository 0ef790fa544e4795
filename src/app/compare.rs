//! `lightsieve compare`: error measures of an image against a reference.

use super::Failure;
use super::cli::CompareArgs;
use super::environment::Environment;
use super::numbers::number;
use crate::image::error_image::{DECADES, ErrorView, error_image};
use crate::image::metrics::{Colours, colours};
use crate::image::z_test::{ZTest, z_test};
use crate::image::{
    Encoding, ExrFile, Image, ImageError, ImageFault, Layer, OutputFormat, Picture, Pixels, Report, compare,
    read_image, write_picture,
};
use crate::render::OutputFiles;
use serde::Serialize;
use std::path::Path;

/// Output of `--json`.
#[derive(Serialize)]
struct Answer {
    #[serde(flatten)]
    report: Report,
    #[serde(skip_serializing_if = "Option::is_none")]
    z_test: Option<ZTest>,
}

/// A picture, and the variance of its pixels where a layer tells.
fn read(path: &Path) -> Result<(Image, Option<Colours>), Failure> {
    let fault = |e: ImageError| match e.fault {
        ImageFault::Io(_) => Failure::io(&e),
        _ => Failure::input(&e),
    };
    let image = read_image(path, Encoding::Auto).map_err(fault)?;
    // A file that only the simpler reader takes has no variance layer.
    let exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let layers = exr.then(|| ExrFile::read(path).ok()).flatten();
    Ok((image, layers.and_then(|f| f.colours("variance"))))
}

/// Pixels of an eight-bit picture that are white in some channel where a picture of floats is brighter than white.
fn clipped_pixels(eight_bits: &Image, floats: &Image) -> Option<usize> {
    if matches!(eight_bits.pixels, Pixels::F32(_)) || !matches!(floats.pixels, Pixels::F32(_)) {
        return None;
    }
    let (width, height) = (eight_bits.width.min(floats.width), eight_bits.height.min(floats.height));
    let is_clipped = |&(x, y): &(u32, u32)| {
        let (a, b) = (eight_bits.rgb(x, y).to_array(), floats.rgb(x, y).to_array());
        a.iter().zip(b).any(|(a, b)| *a >= 1.0 && b > 1.0)
    };
    let clipped = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).filter(is_clipped).count();
    (clipped > 0).then_some(clipped)
}

pub(crate) fn run(args: &CompareArgs) -> Result<(), Failure> {
    if let Some(path) = &args.error_image {
        OutputFormat::of(path).map_err(Failure::input)?;
        let mut outputs = OutputFiles::default();
        outputs.add("--error-image", path);
        outputs.check_inputs([args.image.as_path(), args.reference.as_path()])?;
        outputs.check()?;
    }
    let ((image, variance), (reference, reference_variance)) = (read(&args.image)?, read(&args.reference)?);
    for (one, other, names) in
        [(&image, &reference, [&args.image, &args.reference]), (&reference, &image, [&args.reference, &args.image])]
    {
        if let Some(n) = clipped_pixels(one, other).filter(|_| !args.quiet) {
            let [one, other] = names.map(|path| path.display());
            note!(
                "warning: {n} pixels of {one} are clipped to eight bits where {other} is brighter: the differences \
                 there are not errors of the render"
            );
        }
    }
    let pool = Environment::new(None, args.quiet)?.pool;
    let report = pool.install(|| compare(&image, &reference)).map_err(Failure::input)?;
    let (a, b, _) = colours(&image, &reference).map_err(Failure::input)?;
    let z = z_test(image.width as usize, (&a, variance.as_deref()), (&b, reference_variance.as_deref()));
    if let Some(path) = &args.error_image {
        let view = if args.signed { ErrorView::Signed } else { ErrorView::Relative };
        let pixels = error_image(&a, &b, view);
        let channel = |c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
        let channels = vec![("R", channel(0)), ("G", channel(1)), ("B", channel(2))];
        let layers = vec![Layer { name: String::new(), channels }];
        let picture = Picture { width: image.width, height: image.height, layers, metadata: vec![] };
        write_picture(path, &picture, 0.0).map_err(Failure::io)?;
    }
    if args.json {
        out!("{}", serde_json::to_string_pretty(&Answer { report, z_test: z }).map_err(Failure::io)?);
        return Ok(());
    }
    // d: difference of a channel; r: the reference's channel; means over pixels and channels.
    for (name, value, formula) in [
        ("MSE", report.mse, "mean d^2"),
        ("RMSE", report.rmse, "sqrt(MSE)"),
        ("MAE", report.mae, "mean |d|"),
        ("MAPE", report.mape, "mean |d| / (r + 0.01)"),
        ("relMSE", report.relmse, "mean d^2 / (r^2 + 0.01)"),
        ("relMSE trimmed", report.relmse_trimmed, "the same without the worst 0.1 % of pixels"),
        (
            "relMSE 8x8",
            report.regions.relmse_8x8,
            "of means of blocks of 8 x 8 pixels; 1/64 of relMSE if pixels are independent",
        ),
        ("relMSE 16x16", report.regions.relmse_16x16, "of 16 x 16 pixels; 1/256"),
        ("relMSE 32x32", report.regions.relmse_32x32, "of 32 x 32 pixels; 1/1024"),
        ("relMSE whole", report.regions.relmse_whole, "of the mean of the picture"),
        ("FLIP", report.flip, "LDR-FLIP, clipped to [0, 1]"),
        ("HDR-FLIP", report.hdr_flip, "worst of the exposures"),
        ("mean ratio", report.mean_ratio, "mean image / mean reference"),
    ] {
        out!("{name:16}{:<14}{formula}", number(value));
    }
    out!("{:16}{:<14}pixels left out", "non-finite", report.non_finite);
    if let Some(z) = z {
        out!("Z-test          z = d / sqrt(variances), {} values with a variance", z.values);
        out!("  rms z         {:<14.4}1 for equal expectations; less, as samples are stratified", z.rms);
        out!("  |z| > 2       {:<14.4}0.0455 for a normal distribution", z.beyond_2);
        out!("  |z| > 3       {:<14.4}0.0027 for a normal distribution", z.beyond_3);
        out!("  worst |z|     {:<14.2}{:.2} is passed by chance once in a thousand comparisons", z.worst, z.threshold);
        out!("  whole picture {:<14.2}z of the mean, if pixels are independent", z.whole);
        if let Some(blocks) = z.blocks {
            out!("  by blocks     {:<14.2}z of the mean, by the spread of blocks of 16 x 16 pixels", blocks.whole);
            let formula =
                "variance of blocks over that of independent pixels: larger where pixels share light sub-paths";
            out!("  correlation   {:<14.2}{formula}", blocks.variance_ratio);
        }
    }
    if let (Some(path), false) = (&args.error_image, args.signed) {
        out!("{}: d^2 / (r^2 + 0.01), 1e{} black to 1e{} white", path.display(), DECADES[0], DECADES[1]);
    } else if let Some(path) = &args.error_image {
        out!("{}: d / (r + 0.01), blue -1, white 0, red 1", path.display());
    }
    Ok(())
}
