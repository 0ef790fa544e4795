//! Support for statistical tests: scenes, renders with an honest error, and the tests that compare them.
//!
//! One pixel's samples are stratified over iterations, so their sample variance says too much. A picture is therefore
//! the mean of [`RENDERS`] short renders with different seeds, and its error comes from the spread of these. Two
//! pictures are compared by Welch's t-test, in every pixel and channel with Šidák's correction for their number, and in
//! the mean of the whole picture, which is far more sensitive to a bias that is everywhere. Seeds are fixed: a test
//! that passes passes always.

use lightsieve::integrators::{IntegratorSpec, Params};
use lightsieve::load::{LoadOptions, load_scene};
use lightsieve::prepared::{PrepareOptions, PreparedScene};
use lightsieve::ray::Backend;
use lightsieve::render::Estimator;
use lightsieve::scene::{Diagnostics, SceneDesc};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Chance that one comparison of two equal expectations fails (with other seeds than these).
pub const SIGNIFICANCE: f64 = 1e-3;
/// Renders that a picture is the mean of.
pub const RENDERS: u64 = 16;
/// Differences below this, relative to the value, are rounding.
pub const ROUNDING: f64 = 2e-5;
/// A sliver of light that fewer than one in a thousand samples meets may have been met by none of them, which leaves no
/// variance to judge by: pixels that are both darker than this, relative to the picture's mean, are not compared.
const SLIVER: f64 = 1e-2;

/// Reads a scene from the text of a Mitsuba file and the files that it names.
pub fn parse(xml: &str, files: &[(&str, &str)]) -> SceneDesc {
    let files: Vec<(&str, Vec<u8>)> = files.iter().map(|(name, text)| (*name, text.as_bytes().to_vec())).collect();
    parse_beside(xml, &files)
}

/// Reads the content of a scene file beside which other files stand.
pub fn parse_beside(xml: &str, files: &[(&str, Vec<u8>)]) -> SceneDesc {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, format!("<scene version=\"3.0.0\">{xml}</scene>")).unwrap();
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).0
}

/// Prepares a scene.
pub fn prepare(desc: SceneDesc, backend: Backend, crop: Option<[u32; 4]>) -> PreparedScene {
    let options = PrepareOptions { backend, threads: 2, size: None, crop };
    PreparedScene::build(desc, &options, &mut Diagnostics::default()).unwrap()
}

/// True if the integrator is made for such scenes, and renders all of them.
pub fn takes(spec: &IntegratorSpec, scene: &PreparedScene) -> bool {
    (spec.limitations)(scene.features).is_none()
}

/// Means per pixel and channel with the variances of these means.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Mean radiance, row by row.
    pub mean: Vec<[f64; 3]>,
    /// Variance of `mean`.
    pub variance: Vec<[f64; 3]>,
    /// Mean over all pixels and channels, and its variance.
    pub whole: (f64, f64),
    /// Degrees of freedom of the variances.
    pub freedom: f64,
}

impl Picture {
    /// [`RENDERS`] renders of `spp` samples per pixel each, with seeds from `seed` on. Parameters that the integrator
    /// does not have are left out. Every sample must be finite and every ray valid.
    pub fn render(
        spec: &'static IntegratorSpec,
        scene: &PreparedScene,
        params: &[(&str, &str)],
        spp: u64,
        seed: u64,
    ) -> Picture {
        let mut values = Params::defaults(spec);
        // Few samples of few pixels show no variance of what is rare: splats of a small share of the light image, and
        // long eye sub-paths that end early. Tests that want these ask for them. And few pixels need few light
        // sub-paths, a small scene no fine voxels.
        for (name, value) in
            [("allocation", "full"), ("rr_scale", "1"), ("voxel_resolution", "24"), ("presampled_paths", "100")]
                .iter()
                .chain(params)
        {
            if spec.params().any(|p| p.name == *name) {
                values.set(name, value).unwrap();
            }
        }
        let renders: Vec<Vec<[f64; 3]>> = (seed..seed + RENDERS)
            .into_par_iter()
            .map(|seed| {
                let mut estimator = Estimator::new((spec.build)(&values), scene.window, seed);
                for _ in 0..spp {
                    estimator.iterate(scene);
                }
                assert_eq!(estimator.film.non_finite(), (0, vec![]), "{}", spec.name);
                assert_eq!(estimator.rays().invalid, 0, "{}", spec.name);
                estimator.film.mean_f64()
            })
            .collect();
        let pixels = renders[0].len();
        let moments: Vec<[(f64, f64); 3]> =
            (0..pixels).map(|i| std::array::from_fn(|c| mean_and_variance(renders.iter().map(|r| r[i][c])))).collect();
        let wholes = renders.iter().map(|r| r.iter().flatten().sum::<f64>() / (3 * pixels) as f64);
        Picture {
            mean: moments.iter().map(|m| m.map(|m| m.0)).collect(),
            variance: moments.iter().map(|m| m.map(|m| m.1)).collect(),
            whole: mean_and_variance(wholes),
            freedom: (RENDERS - 1) as f64,
        }
    }

    /// Known values.
    pub fn exact(mean: Vec<[f64; 3]>) -> Picture {
        let whole = mean.iter().flatten().sum::<f64>() / (3 * mean.len()) as f64;
        Picture { variance: vec![[0.0; 3]; mean.len()], mean, whole: (whole, 0.0), freedom: f64::INFINITY }
    }

    /// One value everywhere.
    pub fn constant(value: f64, pixels: usize) -> Picture {
        Picture::exact(vec![[value; 3]; pixels])
    }

    /// One colour everywhere.
    pub fn constant_rgb(value: [f64; 3], pixels: usize) -> Picture {
        Picture::exact(vec![value; pixels])
    }

    /// The window `[x, y, width, height]` of a picture that has rows of `row` pixels. Its mean gets an upper bound of
    /// the variance, as if the errors of all pixels were the same.
    pub fn window(&self, row: u32, [x, y, width, height]: [u32; 4]) -> Picture {
        let inside: Vec<usize> =
            (0..height).flat_map(|j| (0..width).map(move |i| ((y + j) * row + x + i) as usize)).collect();
        let mut part = Picture::exact(inside.iter().map(|&i| self.mean[i]).collect());
        part.variance = inside.iter().map(|&i| self.variance[i]).collect();
        part.freedom = self.freedom;
        let sum: f64 = part.variance.iter().flatten().map(|v| v.sqrt()).sum();
        part.whole.1 = (sum / (3 * inside.len()) as f64).powi(2);
        part
    }

    /// Fails unless the expectations of both pictures are the same up to `tolerance` (relative), at [`SIGNIFICANCE`].
    pub fn assert_agrees(&self, other: &Picture, tolerance: f64, what: &str) {
        if let Some(difference) = self.difference(other, tolerance) {
            panic!("{what}: {difference}");
        }
    }

    /// Evidence against the expectations of both pictures being the same up to `tolerance` (relative), at
    /// [`SIGNIFICANCE`].
    pub fn difference(&self, other: &Picture, tolerance: f64) -> Option<String> {
        assert_eq!(self.mean.len(), other.mean.len());
        let tests = 3 * self.mean.len();
        // Šidák 1967: so many independent tests, all passed with the probability 1 − SIGNIFICANCE.
        let per_test = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / tests as f64);
        let freedom = (self.freedom, other.freedom);
        let mut worst = (1.0, String::new());
        for i in 0..self.mean.len() {
            for c in 0..3 {
                let (a, b) = ((self.mean[i][c], self.variance[i][c]), (other.mean[i][c], other.variance[i][c]));
                if a.0.abs().max(b.0.abs()) < SLIVER * other.whole.0 {
                    continue;
                }
                let p = chance(a, b, freedom, tolerance);
                if p < worst.0 {
                    let text = format!("pixel {i} channel {c}: {} ± {} and {} ± {}", a.0, a.1.sqrt(), b.0, b.1.sqrt());
                    worst = (p, text);
                }
            }
        }
        if worst.0 < per_test {
            return Some(format!("p = {:e} < {per_test:e} in {}", worst.0, worst.1));
        }
        let p = chance(self.whole, other.whole, freedom, tolerance);
        let ((a, va), (b, vb)) = (self.whole, other.whole);
        (p < SIGNIFICANCE).then(|| format!("p = {p:e} in the mean: {a} ± {} and {b} ± {}", va.sqrt(), vb.sqrt()))
    }
}

/// Mean, and the variance of the mean.
fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = RENDERS as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n * (n - 1.0)))
}

/// Chance of a difference like this or larger between two means of equal expectation (Welch 1947); each mean comes with
/// its variance. What is within the tolerance counts as no difference.
pub fn chance(a: (f64, f64), b: (f64, f64), freedom: (f64, f64), tolerance: f64) -> f64 {
    let difference = (a.0 - b.0).abs() - (tolerance + ROUNDING) * a.0.abs().max(b.0.abs());
    if difference <= 0.0 {
        return 1.0;
    }
    let variance = a.1 + b.1;
    if variance == 0.0 {
        return 0.0;
    }
    let freedom = variance * variance / (a.1 * a.1 / freedom.0 + b.1 * b.1 / freedom.1);
    let t = StudentsT::new(0.0, 1.0, freedom).unwrap();
    2.0 * t.sf(difference / variance.sqrt())
}

/// Everyone who claims the right expectation.
/// (Virtual lights are unbiased too, but have no variance that a test could know: 1/d² is all that near ones weigh.)
pub fn unbiased() -> impl Iterator<Item = &'static IntegratorSpec> {
    lightsieve::integrators::REGISTRY.iter().copied().filter(|s| s.unbiased && s.name != "importance-caching")
}

/// The integrators of [`unbiased`] that sample every pixel by itself. Light tracing alone leaves the pixels of a small
/// or narrow picture to chance, too noisy for tests that look at a pixel after few samples.
pub fn sampled_by_pixel() -> impl Iterator<Item = &'static IntegratorSpec> {
    unbiased().filter(|s| s.name != "light")
}
