//! Several renders of one picture with seeds of their own become one: for example those of ten machines in a night.
//!
//! With n_i iterations, means m_i and variances of these means v_i: n = Σ n_i, m = Σ n_i m_i / n, and the sums of
//! squares are those of all samples together, Σ (n_i (n_i − 1) v_i + n_i m_i²), so that the merged variance is what
//! one render of all these samples would have reported.

use crate::image::{ExrFile, Layer, Picture};
use std::collections::BTreeSet;

/// Why renders cannot be merged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// Fewer than two.
    #[error("there must be at least two renders to merge")]
    TooFew,
    /// Not written by this program, or by hand changed.
    #[error("{file}: the header does not say {what}; only EXR files that lightsieve rendered can be merged")]
    Header {
        /// File.
        file: String,
        /// Which entry.
        what: &'static str,
    },
    /// They differ in an entry that must be equal.
    #[error("{file}: {what} is \"{found}\", but \"{expected}\" in the first file")]
    Differs {
        /// File.
        file: String,
        /// Name of the entry.
        what: &'static str,
        /// In this file.
        found: String,
        /// In the first.
        expected: String,
    },
    /// Two renders of one seed hold the same samples, which must not count twice.
    #[error("{file}: seed {seed} was merged already; renders of one seed hold the same samples")]
    Seed {
        /// File.
        file: String,
        /// Seed.
        seed: String,
    },
}

/// Entries of the header that must be the same in all files.
const SAME: [&str; 3] = ["integrator", "parameters", "unbiased"];

struct Input<'a> {
    file: &'a ExrFile,
    iterations: u64,
}

/// Merges renders; names are for messages.
///
/// # Errors
/// [`MergeError`].
pub fn merge(files: &[(String, ExrFile)]) -> Result<Picture, MergeError> {
    let [(_, first), _, ..] = files else { return Err(MergeError::TooFew) };
    let (mut seeds, mut inputs) = (BTreeSet::new(), vec![]);
    let text = |file: &ExrFile, what: &str| file.text(&format!("lightsieve:{what}")).map(str::to_owned);
    for (name, file) in files {
        let header = |what: &'static str| text(file, what).ok_or(MergeError::Header { file: name.clone(), what });
        let size = |f: &ExrFile| format!("{} x {}", f.width, f.height);
        let differing = SAME.into_iter().map(|what| {
            let of = |f| text(f, what).unwrap_or_default();
            (what, of(file), of(first))
        });
        let mut differing = std::iter::once(("size", size(file), size(first))).chain(differing);
        if let Some((what, found, expected)) = differing.find(|(_, a, b)| a != b) {
            return Err(MergeError::Differs { file: name.clone(), what, found, expected });
        }
        let iterations = header("iterations")?.parse().ok().filter(|n| *n > 0);
        let iterations =
            iterations.ok_or(MergeError::Header { file: name.clone(), what: "how many iterations it has" })?;
        for seed in header("seed")?.split_whitespace() {
            if !seeds.insert(seed.to_owned()) {
                return Err(MergeError::Seed { file: name.clone(), seed: seed.into() });
            }
        }
        if file.colours("").is_none() || file.colours("variance").is_none() {
            return Err(MergeError::Header { file: name.clone(), what: "its picture and its variance" });
        }
        inputs.push(Input { file, iterations });
    }
    let mut picture = first.picture();
    let n: u64 = inputs.iter().map(|p| p.iterations).sum();
    for layer in &mut picture.layers {
        merge_layer(layer, &inputs, n as f64);
    }
    // Layers that are not in all files are left out.
    picture.layers.retain(|l| l.channels.iter().all(|(_, v)| !v.is_empty()));
    let seconds: f64 = inputs.iter().filter_map(|p| text(p.file, "renderSeconds")?.parse::<f64>().ok()).sum();
    let lost: u64 = inputs.iter().filter_map(|p| text(p.file, "nonFinite")?.parse::<u64>().ok()).sum();
    let seeds: Vec<String> = seeds.into_iter().collect();
    for (key, value) in [
        ("lightsieve:iterations", n.to_string()),
        ("lightsieve:seed", seeds.join(" ")),
        ("lightsieve:renderSeconds", format!("{seconds:.3}")),
        ("lightsieve:nonFinite", lost.to_string()),
    ] {
        picture.metadata.retain(|(k, _)| k != key);
        picture.metadata.push((key.into(), value));
    }
    Ok(picture)
}

fn merge_layer(layer: &mut Layer, inputs: &[Input], n: f64) {
    let is_variance = layer.name == "variance";
    for (channel, values) in &mut layer.channels {
        let full = |layer: &str| if layer.is_empty() { (*channel).to_owned() } else { format!("{layer}.{channel}") };
        let named = |layer: &str| -> Option<Vec<(&[f32], f64)>> {
            inputs.iter().map(|p| Some((p.file.channel(&full(layer))?, p.iterations as f64))).collect()
        };
        let (Some(own), Some(means)) = (named(&layer.name), if is_variance { named("") } else { Some(vec![]) }) else {
            values.clear();
            continue;
        };
        for (i, value) in values.iter_mut().enumerate() {
            let weighted = |of: &[(&[f32], f64)]| of.iter().map(|(v, k)| f64::from(v[i]) * k).sum::<f64>() / n;
            *value = if is_variance {
                let mean = weighted(&means);
                let squares: f64 = own
                    .iter()
                    .zip(&means)
                    .map(|((v, k), (m, _))| {
                        let (v, d) = (f64::from(v[i]), f64::from(m[i]) - mean);
                        k * (k - 1.0) * v + k * d * d
                    })
                    .sum();
                (squares / ((n - 1.0) * n)) as f32
            } else {
                weighted(&own) as f32
            };
        }
    }
}
