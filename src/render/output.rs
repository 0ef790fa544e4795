//! From the film to a picture with layers and metadata.

use crate::film::Film;
use crate::image::{Layer, Picture};
use crate::math::Rgb;

fn rgb_layer(name: &str, pixels: &[Rgb]) -> Layer {
    let channel = |c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
    Layer { name: name.into(), channels: vec![("R", channel(0)), ("G", channel(1)), ("B", channel(2))] }
}

/// The picture: the mean as the nameless main layer, the variance of the mean, and `layers`.
pub fn picture(film: &Film, layers: Vec<Layer>, metadata: Vec<(String, String)>) -> Picture {
    let mut all = vec![rgb_layer("", &film.mean()), rgb_layer("variance", &film.variance_of_mean())];
    all.extend(layers);
    Picture { width: film.width, height: film.height, layers: all, metadata }
}
