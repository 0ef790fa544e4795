//! The pyramid of techniques (Veach 1997, Figs. 10.2 and 10.3): for every path length k and every technique (s, k + 1
//! − s) the picture that the technique makes by itself (raw), and what its weights leave of it.

use crate::math::Rgb;
use serde::{Deserialize, Serialize};

/// One picture per technique, of a part of the film.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Pyramid {
    window: [u32; 4],
    max_edges: usize,
    /// Iterations summed.
    pub iterations: u64,
    /// By [`Pyramid::number`], raw and weighted.
    sums: Vec<[Vec<[f64; 3]>; 2]>,
}

/// Which of a technique's two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PyramidLayer {
    /// By itself.
    Raw = 0,
    /// As it goes into the picture.
    Weighted = 1,
}

impl Pyramid {
    /// An empty pyramid of the paths of up to `max_edges` edges in the window x, y, width, height.
    pub fn new(window: [u32; 4], max_edges: usize) -> Pyramid {
        let pixels = window[2] as usize * window[3] as usize;
        let empty = || [vec![[0.0; 3]; pixels], vec![[0.0; 3]; pixels]];
        let techniques = Pyramid::number(max_edges + 1, 0);
        Pyramid { window, max_edges, iterations: 0, sums: (0..techniques).map(|_| empty()).collect() }
    }

    /// Number of the technique with s light vertices among those of k edges; there are k + 1 of them, s = 0 … k.
    fn number(k: usize, s: usize) -> usize {
        // Σ_{j<k} (j + 1), j from 1.
        k * (k + 1) / 2 - 1 + s
    }

    /// Number of techniques with paths of up to `max_edges` edges.
    pub fn techniques_up_to(max_edges: usize) -> usize {
        Pyramid::number(max_edges + 1, 0)
    }

    /// Adds what the technique (s, t) found for a pixel of the full picture. Longer paths and other pixels are left
    /// out, and values that are not finite, which the film reports.
    pub fn add(&mut self, (s, t): (usize, usize), (x, y): (u32, u32), raw: Rgb, weight: f32) {
        let [x0, y0, width, height] = self.window;
        let (k, x, y) = (s + t - 1, x.wrapping_sub(x0), y.wrapping_sub(y0));
        if k > self.max_edges || x >= width || y >= height || !raw.is_finite() || !weight.is_finite() {
            return;
        }
        let pixel = (y * width + x) as usize;
        for (sums, value) in self.sums[Pyramid::number(k, s)].iter_mut().zip([raw, raw * weight]) {
            for (sum, v) in sums[pixel].iter_mut().zip(value.to_array()) {
                *sum += f64::from(v);
            }
        }
    }

    /// Adds the iterations of another pyramid of the same window and path lengths.
    ///
    /// # Panics
    /// If it is of another window or other path lengths.
    pub fn merge(&mut self, other: &Pyramid) {
        assert_eq!((self.window, self.max_edges), (other.window, other.max_edges));
        self.iterations += other.iterations;
        for (sums, more) in self.sums.iter_mut().flatten().zip(other.sums.iter().flatten()) {
            sums.as_flattened_mut().iter_mut().zip(more.as_flattened()).for_each(|(a, b)| *a += b);
        }
    }

    /// The pyramid is of this window and these path lengths, and has a sum for every pixel.
    pub fn is_of(&self, window: [u32; 4], max_edges: usize) -> bool {
        let pixels = window[2] as usize * window[3] as usize;
        let techniques = Pyramid::number(max_edges + 1, 0);
        let whole = self.sums.len() == techniques && self.sums.as_flattened().iter().all(|p| p.len() == pixels);
        self.window == window && self.max_edges == max_edges && whole
    }

    /// True if all sums are finite, and zero if there were no iterations.
    pub fn is_plausible(&self) -> bool {
        let mut values = self.sums.iter().flatten().flatten().flatten();
        if self.iterations == 0 { values.all(|v| *v == 0.0) } else { values.all(|v| v.is_finite()) }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.window[2], self.window[3]]
    }

    /// Every technique: (k, s), shortest paths first.
    pub fn techniques(&self) -> impl Iterator<Item = (usize, usize)> {
        (1..=self.max_edges).flat_map(|k| (0..=k).map(move |s| (k, s)))
    }

    /// The picture of technique (s, k + 1 − s), row by row.
    pub fn picture(&self, (k, s): (usize, usize), side: PyramidLayer) -> Vec<Rgb> {
        let scale = 1.0 / self.iterations.max(1) as f64;
        let sums = &self.sums[Pyramid::number(k, s)][side as usize];
        sums.iter().map(|p| Rgb::from(p.map(|v| (v * scale) as f32))).collect()
    }

    /// All pictures on one sheet: a row for each path length, raw to the left and weighted to the right, s growing
    /// from left to right. Returns width, height and pixels.
    pub fn sheet(&self) -> (u32, u32, Vec<Rgb>) {
        const GAP: usize = 4;
        let step = (self.window[2] as usize).div_ceil(CELL).max(1);
        let (w, h) = ((self.window[2] as usize).div_ceil(step), (self.window[3] as usize).div_ceil(step));
        let columns = self.max_edges + 1;
        let block = columns * (w + GAP) + GAP;
        let (width, height) = (2 * block + 2 * GAP, self.max_edges * (h + GAP) + GAP);
        let mut sheet = vec![Rgb::grey(0.05); width * height];
        for (k, s) in self.techniques() {
            for side in [PyramidLayer::Raw, PyramidLayer::Weighted] {
                let small = shrink(&self.picture((k, s), side), self.window[2] as usize, step, (w, h));
                // Centred in its row, so that neighbours of a technique are its neighbours on the sheet.
                let indent = (columns - (k + 1)) * (w + GAP) / 2;
                let left = GAP + indent + s * (w + GAP) + if side == PyramidLayer::Raw { 0 } else { block + 2 * GAP };
                let top = GAP + (k - 1) * (h + GAP);
                for (row, pixels) in small.chunks_exact(w).enumerate() {
                    let at = (top + row) * width + left;
                    sheet[at..at + w].copy_from_slice(pixels);
                }
            }
        }
        (width as u32, height as u32, sheet)
    }
}

/// Largest width of a picture on the sheet.
const CELL: usize = 160;

/// Means of squares of `step` pixels; the last row and column may have smaller ones.
fn shrink(pixels: &[Rgb], width: usize, step: usize, (w, h): (usize, usize)) -> Vec<Rgb> {
    let height = pixels.len() / width;
    (0..w * h)
        .map(|i| {
            let (x0, y0) = (i % w * step, i / w * step);
            let (x1, y1) = ((x0 + step).min(width), (y0 + step).min(height));
            let square = (y0..y1).flat_map(|y| pixels[y * width + x0..y * width + x1].iter().copied());
            square.sum::<Rgb>() / ((x1 - x0) * (y1 - y0)) as f32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn techniques_have_their_own_pictures() {
        let mut pyramid = Pyramid::new([2, 1, 5, 3], 4);
        for (n, (k, s)) in pyramid.clone().techniques().enumerate() {
            pyramid.add((s, k + 1 - s), (3, 2), Rgb::grey(n as f32 + 1.0), 0.25);
        }
        pyramid.add((3, 3), (3, 2), Rgb::WHITE, 1.0);
        pyramid.add((0, 2), (1, 2), Rgb::WHITE, 1.0);
        pyramid.add((0, 2), (3, 2), Rgb::new(f32::NAN, 0.0, 0.0), 1.0);
        pyramid.iterations = 1;
        for (n, technique) in pyramid.techniques().enumerate() {
            let [raw, weighted] =
                [PyramidLayer::Raw, PyramidLayer::Weighted].map(|side| pyramid.picture(technique, side));
            for (i, (r, w)) in raw.iter().zip(&weighted).enumerate() {
                let expected = if i == 6 { n as f32 + 1.0 } else { 0.0 };
                assert_eq!((r.r, w.r), (expected, 0.25 * expected));
            }
        }
        let (width, height, sheet) = pyramid.sheet();
        assert_eq!(sheet.len(), (width * height) as usize);

        // The mean of a pyramid and an empty one of three iterations is a quarter of it.
        let mut mean = pyramid.clone();
        let mut empty = Pyramid::new([2, 1, 5, 3], 4);
        empty.iterations = 3;
        mean.merge(&empty);
        assert_eq!(mean.iterations, 4);
        for technique in pyramid.techniques() {
            let [one, quarter] = [&pyramid, &mean].map(|p| p.picture(technique, PyramidLayer::Weighted)[6].r);
            assert_eq!(quarter, 0.25 * one);
        }
    }
}
