//! Pictures of one size to flip between, as data for the page's viewer.

use super::encode;
use super::html::escape;
use crate::image::error_image::{DECADES, relative_error, scale_colour};
use crate::math::Rgb;
use std::fmt::Write;

/// A picture of a group.
#[derive(Clone, Debug)]
pub struct Shown<'a> {
    /// Name.
    pub name: String,
    /// Linear colours, row by row.
    pub pixels: &'a [[f64; 3]],
    /// Something to say beside the name.
    pub note: String,
}

/// Colours of the error scale that the page gets.
const SCALE_STEPS: usize = 255;

/// Markup of a viewer. With a reference every picture also has its errors.
///
/// # Panics
/// If a picture has another size.
pub fn picture_group([width, height]: [u32; 2], pictures: &[Shown], reference: Option<&[[f64; 3]]>) -> String {
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    let mut data = format!(
        "{{\"width\":{width},\"height\":{height},\"decades\":[{},{}],\"scale\":\"{}\",\"pictures\":[",
        DECADES[0],
        DECADES[1],
        encode::base64(&scale_bytes())
    );
    for (i, p) in pictures.iter().enumerate() {
        assert_eq!(p.pixels.len(), width as usize * height as usize, "{}", p.name);
        let errors = reference
            .map_or(String::new(), |r| encode::errors(p.pixels.iter().zip(r).map(|(a, b)| relative_error(a, b))));
        let _ = write!(
            data,
            "{}{{\"name\":{},\"note\":{},\"pixels\":\"{}\",\"errors\":\"{errors}\"}}",
            if i > 0 { ",\n" } else { "" },
            quoted(&p.name),
            quoted(&p.note),
            encode::pixels(p.pixels),
        );
    }
    data.push_str("]}");
    // In a script only this could end it early.
    let data = data.replace("</", "<\\/");
    let names: Vec<String> = pictures.iter().map(|p| escape(&p.name)).collect();
    format!(
        "<figure class=\"viewer\" tabindex=\"0\"><script type=\"application/json\">{data}</script>\
         <noscript>{} (the viewer needs JavaScript)</noscript></figure>",
        names.join(", ")
    )
}

/// The scale as bytes of sRGB.
fn scale_bytes() -> Vec<u8> {
    let byte = |v: f32| (crate::image::buffer::linear_to_srgb(f64::from(v)) * 255.0).round() as u8;
    let colour = |i: usize| scale_colour(i as f64 / (SCALE_STEPS - 1) as f64);
    (0..SCALE_STEPS).flat_map(|i| colour(i).to_array().map(byte)).collect()
}

/// Colours as the viewer wants them.
pub fn doubles(pixels: &[Rgb]) -> Vec<[f64; 3]> {
    pixels.iter().map(|p| p.to_array().map(f64::from)).collect()
}
