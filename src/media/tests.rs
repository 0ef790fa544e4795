//! Media on grids against quadrature in double precision, and free flight against the depth.

use super::*;
use crate::math::DVec3;
use crate::math::hash::HashRng;
use crate::scene::{GridDesc, GridValues, MediumDesc, PhaseDesc, VolumeDesc, VolumeFilter, VolumeGrid, VolumeWrap};
use crate::shade::phase::PhaseLobe;
use glam::DMat4;
use half::f16;
use std::sync::Arc;

const WRAPS: [VolumeWrap; 4] = [VolumeWrap::Clamp, VolumeWrap::Repeat, VolumeWrap::Mirror, VolumeWrap::Empty];
const FILTERS: [VolumeFilter; 2] = [VolumeFilter::Trilinear, VolumeFilter::Nearest];

/// A ray from `o` in the direction `d` of the length `length`.
#[derive(Clone, Copy, Debug)]
struct TestRay {
    o: Vec3,
    d: Vec3,
    length: f32,
}

impl TestRay {
    fn reversed(self) -> TestRay {
        TestRay { o: self.o + self.d * self.length, d: -self.d, ..self }
    }
}

/// A grid of random values, of which a share `empty` of the samples, in whole slabs, is zero.
fn random_grid(size: [u32; 3], channels: u32, empty: f32, rng: &mut HashRng) -> VolumeGrid {
    let mut values = Vec::new();
    for z in 0..size[2] {
        for _ in 0..size[1] {
            let slab = (z as f32 + 0.5) / (size[2] as f32) < empty;
            for _ in 0..size[0] * channels {
                values.push(if slab { 0.0 } else { 3.0 * rng.next_f32() });
            }
        }
    }
    VolumeGrid { size, channels, values: GridValues::Float32(values) }
}

fn described(grid: VolumeGrid, to_world: DMat4, filter: VolumeFilter, wrap: VolumeWrap) -> MediumDesc {
    let grid = GridDesc { grid: Arc::new(grid), to_world, filter, wrap };
    MediumDesc {
        sigma_t: VolumeDesc::Grid(grid),
        albedo: VolumeDesc::Constant(Rgb::new(0.5, 0.25, 1.0)),
        scale: 0.75,
        phase: PhaseDesc::Isotropic,
        span: None,
    }
}

/// Turned, sheared a little, and away from the origin.
fn oblique() -> DMat4 {
    let shear = DMat4::from_cols_array(&[1., 0., 0.1, 0., 0.2, 1., 0., 0., 0., 0., 1.5, 0., 0., 0., 0., 1.]);
    DMat4::from_translation(DVec3::new(0.3, -0.2, 0.1)) * DMat4::from_rotation_y(0.5) * shear
}

/// Media of all filters and wrap modes, upright and oblique.
fn media(size: [u32; 3], channels: u32, empty: f32, centre: DVec3) -> Vec<(MediumDesc, Medium)> {
    let mut rng = HashRng::from_key(u64::from(size[0] * 7 + channels));
    let mut out = Vec::new();
    for (filter, wrap) in FILTERS.into_iter().flat_map(|f| WRAPS.map(|w| (f, w))) {
        for to_world in [DMat4::IDENTITY, oblique()] {
            let desc = described(random_grid(size, channels, empty, &mut rng), to_world, filter, wrap);
            let medium = Medium::build(&desc, centre).unwrap();
            out.push((desc, medium));
        }
    }
    out
}

fn rays(number: u32, seed: u64) -> Vec<TestRay> {
    let mut rng = HashRng::from_key(seed);
    let mut point = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.4 - 0.7;
    let ray = |(a, b): (Vec3, Vec3)| TestRay { o: a, d: (b - a).normalize(), length: (b - a).length() };
    let mut rays: Vec<TestRay> = (0..number).map(|_| ray((point(), point()))).collect();
    // Along axes, through edges and corners of cells, from inside and from outside; an end in a face.
    for d in [Vec3::X, -Vec3::Y, Vec3::Z, Vec3::ONE.normalize(), Vec3::new(1.0, -1.0, 0.0).normalize()] {
        for o in [Vec3::splat(0.5), Vec3::splat(0.25), Vec3::ZERO, Vec3::new(0.1, 0.375, 0.7), Vec3::splat(-0.5)] {
            rays.push(TestRay { o, d, length: 1.3 });
            rays.push(TestRay { o, d, length: 0.5 });
        }
    }
    rays
}

/// The extinction by its definition, at a point in the world.
fn density(desc: &MediumDesc, p: DVec3) -> [f64; 3] {
    let VolumeDesc::Grid(GridDesc { grid, to_world, filter, wrap }) = &desc.sigma_t else { panic!() };
    let corners =
        (0..8).map(|i| to_world.transform_point3(DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64)));
    let (lower, upper) =
        corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lower, upper), c| (lower.min(c), upper.max(c)));
    if p.cmplt(lower).any() || p.cmpgt(upper).any() {
        return [0.0; 3];
    }
    let n = grid.size.map(|n| n as i64);
    let u = to_world.inverse().transform_point3(p).to_array();
    let g: [f64; 3] =
        std::array::from_fn(|k| u[k] * n[k] as f64 - if *filter == VolumeFilter::Trilinear { 0.5 } else { 0.0 });
    let most = |k: usize| n[k] as f64 - if *filter == VolumeFilter::Trilinear { 1.0 } else { 0.0 };
    if *wrap == VolumeWrap::Empty && (0..3).any(|k| g[k] < 0.0 || g[k] > most(k)) {
        return [0.0; 3];
    }
    let wrapped = |i: i64, n: i64| match wrap {
        VolumeWrap::Clamp | VolumeWrap::Empty => i.clamp(0, n - 1),
        VolumeWrap::Repeat => i.rem_euclid(n),
        VolumeWrap::Mirror if i.div_euclid(n) % 2 == 0 => i.rem_euclid(n),
        VolumeWrap::Mirror => n - 1 - i.rem_euclid(n),
    };
    let value = |i: [i64; 3], channel: usize| {
        let [x, y, z] = [0, 1, 2].map(|k| wrapped(i[k], n[k]) as usize);
        let c = grid.channels as usize;
        f64::from(grid.values.get(((z * n[1] as usize + y) * n[0] as usize + x) * c + channel.min(c - 1)))
    };
    let cell = g.map(|g| g.floor() as i64);
    let f: [f64; 3] = std::array::from_fn(|k| g[k] - cell[k] as f64);
    std::array::from_fn(|channel| {
        let sum: f64 = match filter {
            VolumeFilter::Nearest => value(cell, channel),
            VolumeFilter::Trilinear => (0..8)
                .map(|corner| {
                    let upper = [0, 1, 2].map(|k| corner >> k & 1);
                    let weight = (0..3).map(|k| if upper[k] == 1 { f[k] } else { 1.0 - f[k] }).product::<f64>();
                    weight * value(std::array::from_fn(|k| cell[k] + upper[k]), channel)
                })
                .sum(),
        };
        sum * f64::from(desc.scale)
    })
}

/// ∫ of the density by the midpoint rule.
fn quadrature(desc: &MediumDesc, ray: TestRay, centre: DVec3, steps: u32) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let h = f64::from(ray.length) / f64::from(steps);
    for i in 0..steps {
        let p = ray.o.as_dvec3() + ray.d.as_dvec3() * (h * (f64::from(i) + 0.5)) + centre;
        sum.iter_mut().zip(density(desc, p)).for_each(|(sum, v)| *sum += v * h);
    }
    sum
}

#[test]
fn depths_are_integrals_of_the_density() {
    let centre = DVec3::new(0.25, -0.125, 0.5);
    for (size, channels, empty) in
        [([4, 4, 4], 1, 0.0), ([5, 3, 7], 3, 0.3), ([1, 2, 1], 1, 0.0), ([9, 17, 33], 1, 0.6)]
    {
        for (desc, medium) in media(size, channels, empty, centre) {
            for ray in rays(6, 3) {
                let got = medium.optical_depth(ray.o, ray.d, ray.length);
                let want = quadrature(&desc, ray, centre, 3000);
                for (channel, want) in want.into_iter().enumerate() {
                    // The midpoint rule errs by a step at each jump; rays in faces of cells have any of two values.
                    let tolerance = if is_nearest(&desc) { 0.03 } else { 3e-3 };
                    assert!(
                        (f64::from(got[channel]) - want).abs() < tolerance,
                        "{size:?} {ray:?} {got:?} {want}\n{desc:?}"
                    );
                }
            }
        }
    }
}

/// Interpolated densities without jumps, with the rule applied between the faces of cells: to rounding.
#[test]
fn depths_are_exact() {
    let mut rng = HashRng::from_key(5);
    let desc = described(
        random_grid([4, 4, 4], 3, 0.0, &mut rng),
        DMat4::IDENTITY,
        VolumeFilter::Trilinear,
        VolumeWrap::Clamp,
    );
    let medium = Medium::build(&desc, DVec3::ZERO).unwrap();
    let mut point = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
    for _ in 0..200 {
        let (a, b) = (point(), point());
        let ray = TestRay { o: a, d: (b - a).normalize(), length: (b - a).length() * 0.99 };
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let mut cuts = vec![0.0, f64::from(ray.length)];
        for axis in 0..3 {
            cuts.extend((0..4).map(|i| ((f64::from(i) + 0.5) / 4.0 - o[axis]) / d[axis]));
        }
        cuts.retain(|t| (0.0..=f64::from(ray.length)).contains(t));
        cuts.sort_by(f64::total_cmp);
        let mut want = [0.0; 3];
        for (a, b) in cuts.iter().zip(&cuts[1..]) {
            // Simpson's rule is exact for cubic polynomials.
            for (t, weight) in [(*a, 1.0), (0.5 * (a + b), 4.0), (*b, 1.0)] {
                let v = density(&desc, o + d * t);
                want.iter_mut().zip(v).for_each(|(sum, v)| *sum += v * weight * (b - a) / 6.0);
            }
        }
        let got = medium.optical_depth(ray.o, ray.d, ray.length);
        for (channel, want) in want.into_iter().enumerate() {
            assert!((f64::from(got[channel]) / want - 1.0).abs() < 1e-6, "{ray:?} {got:?} {want}");
        }
    }
}

#[test]
fn depths_of_parts_add_up_and_are_equal_from_both_ends() {
    for (desc, medium) in media([6, 5, 9], 3, 0.4, DVec3::ZERO) {
        for ray in rays(10, 4) {
            let TestRay { o, d, length } = ray;
            let whole = medium.optical_depth(o, d, length);
            let cut = 0.375 * length;
            let parts = medium.optical_depth(o, d, cut) + medium.optical_depth(o + d * cut, d, length - cut);
            let back = ray.reversed();
            let back = medium.optical_depth(back.o, back.d, length);
            // A ray in a face of cells is in any of them; off it, rounding of the point moves it by 1e-7.
            let in_faces = is_nearest(&desc) && d.abs().max_element() > 0.7;
            for channel in 0..3 {
                let tolerance = if in_faces { 1.0 } else { 1e-5 };
                assert!((parts[channel] - whole[channel]).abs() <= tolerance, "{ray:?} {parts:?} {whole:?}");
                assert!((back[channel] - whole[channel]).abs() <= tolerance, "{ray:?} {back:?} {whole:?}");
            }
        }
    }
}

/// Values are not interpolated.
fn is_nearest(desc: &MediumDesc) -> bool {
    matches!(&desc.sigma_t, VolumeDesc::Grid(grid) if grid.filter == VolumeFilter::Nearest)
}

#[test]
fn coefficients_are_the_density_and_the_derivative_of_the_depth() {
    let centre = DVec3::new(-0.5, 0.25, 0.125);
    let mut rng = HashRng::from_key(11);
    for (desc, medium) in media([5, 6, 4], 3, 0.25, centre) {
        for _ in 0..40 {
            let p = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 0.5;
            let Coefficients { sigma_t, sigma_s } = medium.coefficients(p);
            let want = density(&desc, p.as_dvec3() + centre);
            let d = Vec3::new(rng.next_f32(), rng.next_f32() - 0.5, -rng.next_f32()).normalize();
            let h = 1.0 / 512.0;
            let slope = medium.optical_depth(p - d * h, d, 2.0 * h) * (0.5 / h);
            for channel in 0..3 {
                assert!((f64::from(sigma_t[channel]) - want[channel]).abs() < 1e-5, "{p} {sigma_t:?} {want:?}");
                assert_eq!(sigma_s[channel], sigma_t[channel] * [0.5, 0.25, 1.0][channel]);
                // Nearest values may jump inside of the step.
                if !is_nearest(&desc) && sigma_t[channel] > 0.0 && slope[channel] > 0.0 {
                    let at_border = density(&desc, (p - d * h).as_dvec3() + centre)[channel] == 0.0
                        || density(&desc, (p + d * h).as_dvec3() + centre)[channel] == 0.0;
                    assert!(at_border || (slope[channel] - sigma_t[channel]).abs() < 0.1, "{p} {slope:?} {sigma_t:?}");
                }
            }
        }
    }
}

#[test]
fn constant_grids_are_homogeneous() {
    for values in
        [GridValues::Float32(vec![1.0; 60]), GridValues::Float16(vec![f16::ONE; 60]), GridValues::Unorm8(vec![255; 60])]
    {
        for filter in FILTERS {
            let grid = VolumeGrid { size: [3, 4, 5], channels: 1, values: values.clone() };
            let desc = described(grid, DMat4::from_scale(DVec3::splat(4.0)), filter, VolumeWrap::Clamp);
            let medium = Medium::build(&desc, DVec3::splat(2.0)).unwrap();
            let sigma_t = Rgb::grey(0.75);
            let o = Vec3::new(-1.5, 0.3, 0.7);
            let d = Vec3::new(0.8, 0.36, -0.48);
            assert_eq!(medium.coefficients(o).sigma_t, sigma_t);
            let depth = medium.optical_depth(o, d, 2.5);
            assert!((depth.r / (0.75 * 2.5) - 1.0).abs() < 1e-6 && depth.r == depth.b);
            let target = FlightTarget { channel: 1, depth: 1.2 };
            let Flight::Collided(at) = medium.fly(o, d, 2.5, target) else { panic!() };
            assert!((at.t / 1.6 - 1.0).abs() < 1e-6 && (at.depth.g / 1.2 - 1.0).abs() < 1e-6, "{at:?}");
            // Beyond the grid's box there is nothing, at any distance.
            let outside = medium.optical_depth(Vec3::new(-5.0, 0.0, 0.0), Vec3::X, f32::INFINITY);
            assert!((outside.r / 3.0 - 1.0).abs() < 1e-6, "{outside:?}");
            assert_eq!(medium.coefficients(Vec3::splat(2.1)), Coefficients::default());
        }
    }
    // A constant extinction with an albedo on a grid has no end.
    let mut desc = described(
        VolumeGrid { size: [1; 3], channels: 1, values: GridValues::Unorm8(vec![51]) },
        DMat4::IDENTITY,
        VolumeFilter::Nearest,
        VolumeWrap::Clamp,
    );
    desc.albedo = std::mem::replace(&mut desc.sigma_t, VolumeDesc::Constant(Rgb::new(1.0, 2.0, 0.0)));
    let medium = Medium::build(&desc, DVec3::ZERO).unwrap();
    assert_eq!(medium.optical_depth(Vec3::splat(9.0), Vec3::X, 2.0), Rgb::new(1.5, 3.0, 0.0));
    let Coefficients { sigma_s, .. } = medium.coefficients(Vec3::splat(-7.0));
    assert!((sigma_s.g - 0.3).abs() < 1e-6, "{sigma_s:?}");
}

/// A flight ends where the depth is the target, in any channel.
#[test]
fn flights_invert_the_depth() {
    let mut rng = HashRng::from_key(21);
    for (_, medium) in media([7, 6, 20], 3, 0.5, DVec3::splat(0.5)) {
        for ray in rays(20, 22) {
            let TestRay { o, d, length } = ray;
            let whole = medium.optical_depth(o, d, length);
            let channel = (rng.next_f32() * 3.0) as usize;
            let target = FlightTarget { channel, depth: rng.next_f32() * 2.0 };
            match medium.fly(o, d, length, target) {
                Flight::Passed { depth } => {
                    assert!(whole[channel] <= target.depth * 1.000_001, "{ray:?}");
                    assert!((depth.r - whole.r).abs() < 1e-5, "{ray:?} {depth:?} {whole:?}");
                }
                Flight::Collided(Collision { t, depth }) => {
                    assert!(whole[channel] >= target.depth * 0.999_999 && t < length, "{ray:?}");
                    assert!((depth[channel] - target.depth).abs() < 2e-6 * target.depth.max(1.0), "{ray:?} {depth:?}");
                    let there = medium.optical_depth(o, d, t);
                    for channel in 0..3 {
                        assert!((there[channel] - depth[channel]).abs() < 1e-5, "{ray:?} {there:?} {depth:?}");
                    }
                }
            }
        }
    }
}

/// Kolmogorov–Smirnov: distances of flights in one channel against 1 − exp(−τ).
#[test]
fn distances_have_the_density_of_the_depth() {
    const NUMBER: usize = 4000;
    let mut rng = HashRng::from_key(31);
    for (_, medium) in media([6, 6, 12], 1, 0.3, DVec3::ZERO) {
        let (o, d, length) = (Vec3::new(-0.2, 0.1, -0.3), Vec3::new(0.36, 0.48, 0.8), 2.0);
        let mut cdf = Vec::new();
        for _ in 0..NUMBER {
            match medium.fly(o, d, length, FlightTarget::sample([rng.next_f32(), rng.next_f32()])) {
                Flight::Collided(at) => {
                    cdf.push(1.0 - (-f64::from(medium.optical_depth(o, d, at.t).r)).exp());
                    assert!(medium.coefficients(o + d * at.t).sigma_t.r > 0.0, "{at:?}");
                }
                Flight::Passed { .. } => cdf.push(f64::INFINITY),
            }
        }
        cdf.sort_by(f64::total_cmp);
        let worst = cdf.iter().enumerate().filter(|(_, c)| c.is_finite()).fold(0.0f64, |worst, (i, c)| {
            worst.max((c - i as f64 / NUMBER as f64).abs()).max((c - (i + 1) as f64 / NUMBER as f64).abs())
        });
        // More than 1.95 / √n once in a thousand.
        assert!(worst < 1.95 / (NUMBER as f64).sqrt(), "{worst}");
    }
}

/// Every ray of a grid with much empty space has the depth that it has if no block is skipped.
#[test]
fn empty_blocks_hide_nothing() {
    let mut rng = HashRng::from_key(41);
    for wrap in WRAPS {
        let size = [40, 33, 25];
        let mut values = vec![0.0; size.iter().product::<u32>() as usize];
        for _ in 0..20 {
            values[(rng.next_f32() * 33_000.0) as usize] = 5.0;
        }
        let last = values.len() - 1;
        (values[0], values[last]) = (2.0, 3.0);
        let tiny = values.iter().map(|v: &f32| v.max(1e-30)).collect();
        let build = |values| {
            let grid = VolumeGrid { size, channels: 1, values: GridValues::Float32(values) };
            Medium::build(&described(grid, oblique(), VolumeFilter::Trilinear, wrap), DVec3::ZERO).unwrap()
        };
        let (sparse, dense) = (build(values), build(tiny));
        for ray in rays(400, 42) {
            let (a, b) =
                (sparse.optical_depth(ray.o, ray.d, ray.length), dense.optical_depth(ray.o, ray.d, ray.length));
            assert!((a.r - b.r).abs() <= 1e-6 * b.r + 1e-20, "{ray:?} {wrap:?} {a:?} {b:?}");
        }
    }
}

#[test]
fn what_cannot_be_built_is_said() {
    let grid = || VolumeGrid { size: [1; 3], channels: 1, values: GridValues::Unorm8(vec![51]) };
    let needle = DMat4::from_cols_array(&[1., 1., 0., 0., 1., 1.001, 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
    let fault = |wrap| Medium::build(&described(grid(), needle, VolumeFilter::Trilinear, wrap), DVec3::ZERO).err();
    assert_eq!(fault(VolumeWrap::Repeat), Some(MediumFault::Oblique));
    assert_eq!(fault(VolumeWrap::Clamp), None);
    let mut desc = described(grid(), DMat4::IDENTITY, VolumeFilter::Nearest, VolumeWrap::Clamp);
    let blend = |phases| PhaseDesc::Blend { weight: 0.25, phases: Box::new(phases) };
    desc.phase = blend([PhaseDesc::Rayleigh, PhaseDesc::HenyeyGreenstein { g: 0.5 }]);
    let phase = Medium::build(&desc, DVec3::ZERO).unwrap().phase;
    assert_eq!(phase, Phase { lobes: [PhaseLobe::Rayleigh, PhaseLobe::HenyeyGreenstein(0.5)], second: 0.25 });
    desc.phase = blend([PhaseDesc::Isotropic, desc.phase]);
    assert_eq!(Medium::build(&desc, DVec3::ZERO).err(), Some(MediumFault::NestedMixture));
}

/// The extinction at points inside and outside of the unit cube of an oblique grid, as tests/data/volumes/print_extinction.py
/// prints it with Mitsuba 3.9.1, scalar_rgb.
#[test]
fn grids_are_looked_up_as_in_mitsuba() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes/filters.xml");
    let (scene, found) = crate::load::load_scene(&path, &Default::default()).unwrap();
    assert!(found.list.is_empty());
    let points = [[0.9, 0.3, 0.2], [0.6, 0.75, 0.7], [1.35, 0.95, 0.8], [0.55, 0.1, -0.45]].map(DVec3::from_array);
    let mitsuba = [
        [0.504_422_8, 1.968_653_3, 2.377_091_2, 0.076_226],
        [0.0, 2.75, 1.0, 1.5],
        [0.504_422_8, 2.041_201_4, 2.377_091_2, 0.420_360_2],
    ];
    assert_eq!(scene.media.len(), mitsuba.len());
    let centre = DVec3::new(0.5, 0.25, 0.0);
    for (desc, values) in scene.media.iter().zip(mitsuba) {
        let medium = Medium::build(desc, centre).unwrap();
        for (point, value) in points.into_iter().zip(values) {
            let got = medium.coefficients((point - centre).as_vec3()).sigma_t;
            assert!((got.r - value).abs() < 2e-6 && got.r == got.g, "{point} {got:?} {value}");
        }
        // The box around the grid ends at z = −0.5 and 0.866, and begins at x = 0.5, as Mitsuba says.
        for beyond in [[0.9, 0.3, -0.501], [0.9, 0.3, 0.867], [0.49, 0.3, 0.0]].map(DVec3::from_array) {
            assert_eq!(medium.coefficients((beyond - centre).as_vec3()), Coefficients::default());
        }
    }
}
