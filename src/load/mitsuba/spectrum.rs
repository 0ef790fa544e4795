//! Spectra to linear Rec. 709.
//!
//! The CIE 1931 colour matching functions are the multi-lobe fits of Wyman, Sloan & Shirley 2013, "Simple analytic
//! approximations to the CIE XYZ color matching functions", JCGT 2(2), eq. 4. Reflectances are seen under CIE D65 and
//! scaled so that a reflectance of 1 is exactly white; emissions are taken as they are, so that an emission of 1 at all
//! wavelengths is the (reddish) equal-energy stimulus of luminance 1, as in Mitsuba 3's RGB mode. Colours outside the
//! gamut are clamped to it.

use super::values::number;
use crate::math::Rgb;

/// The use of a spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Reflectance, refractive index: a factor of light.
    Reflectance,
    /// Light.
    Emission,
}

const FIRST: usize = 360;
const LAST: usize = 830;

/// CIE standard illuminant D65, relative power every 10 nm from 360 nm (CIE 15:2004, table T.1).
const D65: [f64; 48] = [
    46.6383, 52.0891, 49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923,
    108.811, 109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062, 89.5991,
    87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856, 75.087,
    63.5927, 46.4182, 66.8054, 63.3828, 64.304, 59.4519, 51.959, 57.4406, 60.3125,
];

fn d65(nm: usize) -> f64 {
    let (i, t) = ((nm - FIRST) / 10, ((nm - FIRST) % 10) as f64 / 10.0);
    let next = D65[(i + 1).min(D65.len() - 1)];
    D65[i] * (1.0 - t) + next * t
}

/// x̄, ȳ, z̄.
fn matching(nm: f64) -> [f64; 3] {
    let lobe = |mean: f64, left: f64, right: f64| {
        let t = (nm - mean) * if nm < mean { left } else { right };
        (-0.5 * t * t).exp()
    };
    [
        0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.0490, 0.0382),
        0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322),
        1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725),
    ]
}

/// CIE XYZ → linear Rec. 709 with the white of D65 (IEC 61966-2-1).
fn to_rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_479 * x - 1.537_150 * y - 0.498_535 * z,
        -0.969_256 * x + 1.875_991 * y + 0.041_556 * z,
        0.055_648 * x - 0.204_043 * y + 1.057_311 * z,
    ]
}

/// ∫ f(λ) (x̄, ȳ, z̄) dλ in steps of 1 nm, as RGB.
fn integrate(f: impl Fn(usize) -> f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for nm in FIRST..=LAST {
        let value = f(nm);
        for (s, m) in sum.iter_mut().zip(matching(nm as f64)) {
            *s += value * m;
        }
    }
    to_rgb(sum)
}

fn luminous() -> f64 {
    (FIRST..=LAST).map(|nm| matching(nm as f64)[1]).sum()
}

/// A single number, or `wavelength:value` pairs (nm) separated by commas or blanks.
pub(super) fn parse(text: &str, purpose: Purpose) -> Result<Rgb, String> {
    if !text.contains(':') {
        let v = number(text)
            .map_err(|_| format!("`{}` is neither a number nor a list of wavelength:value", text.trim()))?;
        return match purpose {
            Purpose::Reflectance => Ok(Rgb::grey(v as f32)),
            Purpose::Emission => from_samples(&[(FIRST as f64, v), (LAST as f64, v)], purpose),
        };
    }
    let pairs = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty());
    let samples: Result<Vec<_>, String> = pairs
        .map(|pair| {
            let (nm, value) =
                pair.split_once(':').ok_or_else(|| format!("`{pair}` is not of the form wavelength:value"))?;
            Ok((number(nm)?, number(value)?))
        })
        .collect();
    from_samples(&samples?, purpose)
}

/// Linear between samples (nm, value), zero outside them.
pub(super) fn from_samples(samples: &[(f64, f64)], purpose: Purpose) -> Result<Rgb, String> {
    if samples.is_empty() {
        return Err("a spectrum without samples".into());
    }
    if let Some(w) = samples.windows(2).find(|w| w[0].0 >= w[1].0) {
        return Err(format!("wavelengths must increase, but {} follows {}", w[1].0, w[0].0));
    }
    let at = |nm: usize| {
        let nm = nm as f64;
        let i = samples.partition_point(|s| s.0 <= nm);
        match (i.checked_sub(1).map(|i| samples[i]), samples.get(i)) {
            (Some((a, va)), Some(&(b, vb))) => va + (vb - va) * (nm - a) / (b - a),
            (Some((a, v)), None) if a == nm => v,
            _ => 0.0,
        }
    };
    let rgb = match purpose {
        Purpose::Reflectance => {
            let (color, white) = (integrate(|nm| at(nm) * d65(nm)), integrate(d65));
            std::array::from_fn(|i| color[i] / white[i])
        }
        Purpose::Emission => integrate(at).map(|c| c / luminous()),
    };
    Ok(Rgb::from(rgb.map(|c: f64| c.max(0.0) as f32)))
}

/// Planck's law, W/(m² sr nm), times `scale`.
pub(super) fn blackbody(kelvin: f64, scale: f64) -> Rgb {
    // CODATA 2018.
    let (h, c, k) = (6.626_070_15e-34, 299_792_458.0, 1.380_649e-23);
    let planck = |nm: usize| {
        let l = nm as f64 * 1e-9;
        2.0 * h * c * c / l.powi(5) / ((h * c / (l * k * kelvin)).exp() - 1.0) * 1e-9
    };
    let luminous = luminous();
    Rgb::from(integrate(planck).map(|v| (v / luminous * scale).max(0.0) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: Rgb, want: [f32; 3], tolerance: f32) {
        let scale = want.iter().fold(0.0f32, |m, v| m.max(*v));
        for (i, w) in want.iter().enumerate() {
            assert!((got[i] - w).abs() < tolerance * scale, "{got:?} is not {want:?}");
        }
    }

    /// Values by Mitsuba 3.9.1, scalar_rgb; the fits of the matching functions are good to about a percent.
    #[test]
    fn agree_with_mitsuba() {
        let r = |t| parse(t, Purpose::Reflectance).unwrap();
        near(r("400:0.1, 700:0.9"), [0.742_85, 0.481_14, 0.208_32], 0.01);
        near(r("400:0.1 500:0.5 600:0.7 700:0.9"), [0.775_4, 0.593_51, 0.277_03], 0.01);
        near(r("360:1, 830:1"), [1.0, 1.0, 1.0], 1e-6);
        near(r("450:1, 500:0"), [0.0, 0.002_27, 0.390_2], 0.05);
        assert_eq!(r("0.3"), Rgb::grey(0.3));
        let e = |t| parse(t, Purpose::Emission).unwrap();
        near(e("3"), [3.614_38, 2.844_87, 2.726_75], 0.01);
        near(e("400:1, 500:5, 600:7, 700:9"), [9.179_22, 5.654_88, 2.416_05], 0.01);
    }

    #[test]
    fn a_blackbody_of_6500_kelvin_is_nearly_white_and_of_2700_orange() {
        let white = blackbody(6500.0, 1.0);
        near(white * (1.0 / white.g), [1.0, 1.0, 1.0], 0.08);
        let warm = blackbody(2700.0, 1.0);
        assert!(warm.r > 1.5 * warm.g && warm.g > 2.0 * warm.b);
        // Luminance-weighted radiance of Planck's law at 2856 K (CIE illuminant A) is 185.1 W/(m² sr nm) at 555 nm /
        // 1000.
        let peak = blackbody(2856.0, 1.0).luminance();
        assert!(peak > 100.0 && peak < 400.0, "{peak}");
    }

    #[test]
    fn mistakes_are_named() {
        for (text, says) in [
            ("400:1 500", "500"),
            ("500:1, 400:1", "increase"),
            ("a:1", "`a`"),
            ("", "neither"),
            (",:", "not a number"),
        ] {
            let e = parse(text, Purpose::Emission).unwrap_err();
            assert!(e.contains(says), "{text}: {e}");
        }
    }
}
