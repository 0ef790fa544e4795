//! Coefficients of measured media by the names that Mitsuba 0.6 uses.
//!
//! The numbers are those that Mitsuba 0.6 has from Jensen et al. 2001 (reduced scattering; chicken absorbs a tenth of
//! the published value in red) and Narasimhan et al. 2006. Its documentation says that they are in 1/mm, but the program
//! multiplies them by 100; files have their `scale` from its pictures.

use crate::math::Rgb;

/// Name, scattering, absorption, and mean cosine of the scattering angle.
type Material = (&'static str, [f32; 3], [f32; 3], [f32; 3]);

/// Factor of Mitsuba 0.6.
const FACTOR: f32 = 100.0;

/// No mean cosine is known: the scattering is the reduced one.
const REDUCED: [f32; 3] = [0.0; 3];

#[rustfmt::skip]
const MATERIALS: [Material; 47] = [
    ("apple", [2.29, 2.39, 1.97], [0.003, 0.0034, 0.046], REDUCED),
    ("chicken1", [0.15, 0.21, 0.38], [0.0015, 0.077, 0.19], REDUCED),
    ("chicken2", [0.19, 0.25, 0.32], [0.0018, 0.088, 0.2], REDUCED),
    ("cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163], REDUCED),
    ("ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45], REDUCED),
    ("marble", [2.19, 2.62, 3.0], [0.0021, 0.0041, 0.0071], REDUCED),
    ("potato", [0.68, 0.7, 0.55], [0.0024, 0.009, 0.12], REDUCED),
    ("skimmilk", [0.7, 1.22, 1.9], [0.0014, 0.0025, 0.0142], REDUCED),
    ("skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48], REDUCED),
    ("skin2", [1.09, 1.59, 1.79], [0.013, 0.07, 0.145], REDUCED),
    ("spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0], REDUCED),
    ("wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014], REDUCED),
    ("lowfat milk", [13.1157, 15.4445, 17.9572], [0.002_87, 0.005_75, 0.0115], [0.932, 0.902, 0.859]),
    ("reduced milk", [13.7335, 15.6003, 17.8007], [0.002_56, 0.005_11, 0.012_78], [0.819, 0.797, 0.746]),
    ("regular milk", [18.2052, 20.3826, 22.3698], [0.001_53, 0.0046, 0.019_93], [0.75, 0.714, 0.681]),
    ("espresso", [7.782_62, 8.1305, 8.538_75], [4.798_38, 6.575_12, 8.849_25], [0.907, 0.896, 0.88]),
    ("mint mocha coffee", [3.511_33, 4.143_83, 5.596_67], [3.772, 5.822_83, 7.82], [0.91, 0.907, 0.914]),
    ("lowfat soy milk", [2.038_38, 2.328_75, 3.902_81], [0.001_44, 0.007_19, 0.035_94], [0.85, 0.853, 0.842]),
    ("regular soy milk", [4.663_25, 5.201_83, 8.745_75], [0.001_92, 0.009_58, 0.065_17], [0.873, 0.858, 0.832]),
    ("lowfat chocolate milk", [9.8371, 11.4954, 13.1629], [0.0115, 0.0368, 0.1564], [0.934, 0.927, 0.916]),
    ("regular chocolate milk", [10.5685, 13.1416, 15.2202], [0.010_06, 0.043_13, 0.143_75], [0.862, 0.838, 0.806]),
    ("coke", [0.002_54, 0.002_99, 0.0], [0.100_14, 0.165_03, 0.2468], [0.965, 0.972, 0.0]),
    ("pepsi", [0.000_83, 0.002_03, 0.0], [0.091_64, 0.141_58, 0.207_29], [0.926, 0.979, 0.0]),
    ("sprite", [0.000_11, 0.000_14, 0.000_14], [0.001_89, 0.001_83, 0.002], [0.943, 0.953, 0.952]),
    ("gatorade", [0.036_68, 0.044_88, 0.057_42], [0.024_79, 0.019_29, 0.008_88], [0.933, 0.933, 0.935]),
    ("chardonnay", [0.000_21, 0.000_33, 0.000_48], [0.010_78, 0.011_86, 0.024], [0.914, 0.958, 0.975]),
    ("white zinfandel", [0.000_22, 0.000_33, 0.000_46], [0.012_07, 0.016_18, 0.019_84], [0.919, 0.943, 0.972]),
    ("merlot", [0.000_81, 0.0, 0.0], [0.116_32, 0.251_91, 0.294_34], [0.974, 0.0, 0.0]),
    ("budweiser beder", [0.000_29, 0.000_55, 0.000_59], [0.011_49, 0.024_91, 0.057_79], [0.917, 0.956, 0.982]),
    ("coors light beer", [0.000_62, 0.001_27, 0.0], [0.006_16, 0.013_98, 0.034_98], [0.918, 0.966, 0.0]),
    ("clorox", [0.027_31, 0.033_02, 0.036_95], [0.003_35, 0.014_89, 0.0263], [0.912, 0.905, 0.892]),
    ("apple juice", [0.002_57, 0.003_11, 0.004_13], [0.012_96, 0.023_74, 0.052_18], [0.947, 0.949, 0.945]),
    ("cranberry juice", [0.001_96, 0.002_38, 0.003_01], [0.039_44, 0.094_22, 0.124_26], [0.947, 0.951, 0.974]),
    ("grape juice", [0.001_38, 0.0, 0.0], [0.104_04, 0.239_58, 0.293_25], [0.961, 0.0, 0.0]),
    ("ruby grapefruit juice", [0.154_96, 0.153_91, 0.159_95], [0.085_87, 0.183_14, 0.252_62], [0.929, 0.929, 0.931]),
    ("white grapefruit juice", [0.504_99, 0.527_42, 0.752_82], [0.0138, 0.018_83, 0.056_78], [0.548, 0.545, 0.565]),
    ("shampoo", [0.007_97, 0.008_74, 0.011_27], [0.014_11, 0.045_69, 0.061_72], [0.91, 0.905, 0.92]),
    ("strawberry shampoo", [0.002_15, 0.002_45, 0.002_53], [0.014_49, 0.057_96, 0.075_82], [0.927, 0.935, 0.994]),
    ("head & shoulders shampoo", [0.267_47, 0.276_96, 0.295_74], [0.084_62, 0.156_88, 0.203_65], [0.911, 0.896, 0.884]),
    ("lemon tea powder", [0.744_89, 0.838_23, 1.001_58], [2.428_81, 4.575_73, 7.2127], [0.946, 0.946, 0.949]),
    ("orange juice powder", [0.001_93, 0.002_13, 0.002_26], [0.001_45, 0.003_44, 0.007_86], [0.919, 0.918, 0.922]),
    ("pink lemonade powder", [0.001_23, 0.001_33, 0.001_31], [0.001_16, 0.002_37, 0.0032], [0.902, 0.902, 0.904]),
    ("cappuccino powder", [12.2094, 16.4659, 29.2727], [35.8441, 49.547, 61.0844], [0.849, 0.843, 0.926]),
    ("salt powder", [0.138_05, 0.156_77, 0.178_65], [0.284_15, 0.3257, 0.341_48], [0.802, 0.793, 0.821]),
    ("sugar powder", [0.002_82, 0.003_15, 0.003_93], [0.012_64, 0.031_05, 0.050_12], [0.921, 0.919, 0.931]),
    ("suisse mocha powder", [30.0848, 33.4452, 38.7191], [17.502, 27.0044, 35.4334], [0.907, 0.894, 0.888]),
    ("pacific ocean surface water", [0.0018, 0.001_83, 0.002_28], [0.031_84, 0.031_32, 0.030_15], [0.902, 0.825, 0.914]),
];

/// Coefficients per unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Preset {
    pub sigma_s: Rgb,
    pub sigma_a: Rgb,
}

/// The material with this name, in capital or small letters. Scattering is reduced by the mean cosine, as in Mitsuba
/// 0.6, whichever phase function the medium has.
pub(super) fn find(name: &str) -> Option<Preset> {
    let (_, sigma_s, sigma_a, g) = MATERIALS.iter().find(|m| m.0.eq_ignore_ascii_case(name.trim()))?;
    let reduced: [f32; 3] = std::array::from_fn(|i| sigma_s[i] * (1.0 - g[i]) * FACTOR);
    Some(Preset { sigma_s: reduced.into(), sigma_a: Rgb::from(*sigma_a) * FACTOR })
}

/// All names.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    MATERIALS.iter().map(|m| m.0)
}
