//! `lightsieve compare`: error measures of an image against a reference.

use super::Failure;
use super::cli::CompareArgs;
use crate::image::{Encoding, ImageFault, compare, read_image};

pub(crate) fn run(args: &CompareArgs) -> Result<(), Failure> {
    let read = |path| {
        read_image(path, Encoding::Auto).map_err(|e| match e.fault {
            ImageFault::Io(_) => Failure::io(&e),
            _ => Failure::input(&e),
        })
    };
    let report = compare(&read(&args.image)?, &read(&args.reference)?).map_err(Failure::input)?;
    if args.json {
        out!("{}", serde_json::to_string_pretty(&report).map_err(Failure::io)?);
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
        ("FLIP", report.flip, "LDR-FLIP, clipped to [0, 1]"),
        ("HDR-FLIP", report.hdr_flip, "worst of the exposures"),
        ("mean ratio", report.mean_ratio, "mean image / mean reference"),
    ] {
        out!("{name:16}{value:<14.6e}{formula}");
    }
    out!("{:16}{:<14}pixels left out", "non-finite", report.non_finite);
    Ok(())
}
