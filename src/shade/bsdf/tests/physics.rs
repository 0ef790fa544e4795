//! Laws that every model must obey: consistency of its functions, reciprocity, the adjoint, energy, finite numbers.

use super::*;
use crate::shade::{Bsdf, BsdfPool, BsdfSample, Transport};

fn tilted(material: &Material) -> bool {
    material.features().tilted
}

fn close(a: f32, b: f32, tolerance: f32) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs()) + 1e-6
}

fn close_rgb(a: Rgb, b: Rgb, tolerance: f32) -> bool {
    (0..3).all(|c| close(a[c], b[c], tolerance))
}

/// Pairs of directions: half of them drawn from the material, so that narrow lobes are met.
fn pairs(material: &Material, p: &SurfacePoint, seed: u64) -> Vec<(Vec3, Vec3)> {
    let mut rng = HashRng::new(5, seed, 0, 0);
    (0..400)
        .filter_map(|i| {
            let wo = random_direction(&mut rng);
            let random = random_direction(&mut rng);
            let u = next3(&mut rng);
            if i % 2 == 0 {
                Some((wo, random))
            } else {
                let s = material.resolve(p, wo).sample(wo, u, Transport::Radiance)?;
                (!s.delta).then_some((wo, s.wi))
            }
        })
        .collect()
}

#[test]
fn samples_carry_what_eval_and_pdf_say() {
    for (m, (name, material)) in ZOO.all().enumerate() {
        let mut rng = HashRng::new(7, m as u64, 0, 0);
        for _ in 0..300 {
            let wo = random_direction(&mut rng);
            let bsdf = material.resolve(&leaning(), wo);
            for mode in [Transport::Radiance, Transport::Importance] {
                let Some(s) = bsdf.sample(wo, next3(&mut rng), mode) else { continue };
                assert!((s.wi.length() - 1.0).abs() < 1e-5, "{name}");
                assert!(s.pdf.0 > 0.0 && s.pdf.0.is_finite() && s.value.is_finite(), "{name} {s:?}");
                if s.delta {
                    assert!(s.pdf.0 <= 1.0 + 1e-5, "{name}");
                    continue;
                }
                assert!(close_rgb(s.value, bsdf.eval(wo, s.wi, mode), 1e-5), "{name}");
                assert!(
                    close(s.pdf.0, bsdf.pdf(wo, s.wi, mode).0, 1e-4),
                    "{name} {s:?} {:?}",
                    bsdf.pdf(wo, s.wi, mode)
                );
                let crossed = wo.dot(leaning().frame.n) * s.wi.dot(leaning().frame.n) < 0.0;
                assert_eq!(crossed, s.eta != 1.0, "{name} {s:?}");
            }
        }
    }
}

#[test]
fn densities_are_the_same_from_both_ends() {
    for (m, (name, material)) in ZOO.all().enumerate() {
        let p = leaning();
        for (wo, wi) in pairs(material, &p, m as u64) {
            let here = material.resolve(&p, wo);
            let there = material.resolve(&p, wi);
            let forward = here.pdf(wo, wi, Transport::Radiance);
            let reverse = here.pdf(wi, wo, Transport::Importance);
            let (value, pdf) = here.eval_and_pdf(wo, wi, Transport::Radiance);
            assert!(close(forward.0, pdf.0, 1e-4), "{name}");
            assert_eq!(forward, here.pdf(wo, wi, Transport::Importance), "{name}");
            let seen_there = there.pdf(wi, wo, Transport::Importance);
            assert!(close(reverse.0, seen_there.0, 1e-4), "{name} {wo} {wi}: {reverse:?} {seen_there:?}");
            assert!(close_rgb(here.albedo(), there.albedo(), 1e-5) || !material.features().transmissive, "{name}");
            // Directions that carry light have a density (tilted normals may be seen differently from both ends).
            assert!(value.is_black() || pdf.0 > 0.0 || tilted(material), "{name} {wo} {wi} {value:?}");
        }
    }
}

/// Index of the medium of `b` over that of `a`.
fn crossed_eta(name: &str, a: f32, b: f32) -> f32 {
    let eta = match name {
        "rough_dielectric_beckmann" => 1.33,
        "principled_glass" => 1.4,
        _ => TEST_IOR,
    };
    if a * b > 0.0 {
        1.0
    } else if a > 0.0 {
        eta
    } else {
        1.0 / eta
    }
}

#[test]
fn scattering_is_reciprocal() {
    // f(a, b) η_b⁻² … : the radiance BSDF divided by η² of the far side is symmetric (Veach 1997, eq. 5.14).
    for (m, (name, material)) in ZOO.all().enumerate().filter(|(_, (_, material))| !tilted(material)) {
        let p = flat();
        for (a, b) in pairs(material, &p, m as u64) {
            if a.z.abs() < 1e-2 || b.z.abs() < 1e-2 {
                continue;
            }
            let ab = material.resolve(&p, a).eval(a, b, Transport::Radiance) / b.z.abs();
            let ba = material.resolve(&p, b).eval(b, a, Transport::Radiance) / a.z.abs();
            let eta = crossed_eta(name, a.z, b.z);
            assert!(close_rgb(ab * (eta * eta), ba, 2e-3), "{name} {a} {b}: {ab:?} {ba:?}");
        }
    }
}

#[test]
fn importance_is_the_adjoint_of_radiance() {
    for (m, (name, material)) in ZOO.all().enumerate() {
        let p = leaning();
        for (wo, wi) in pairs(material, &p, m as u64) {
            let (o, i) = (wo.dot(p.frame.n).abs(), wi.dot(p.frame.n).abs());
            let (og, ig) = (wo.dot(p.ng).abs(), wi.dot(p.ng).abs());
            if o.min(i).min(og).min(ig) < 1e-2 {
                continue;
            }
            let importance = material.resolve(&p, wo).eval(wo, wi, Transport::Importance);
            // Value for a camera walk in the other direction, with the cosine exchanged (Veach 1997, §5.3).
            let radiance = material.resolve(&p, wi).eval(wi, wo, Transport::Radiance);
            assert!(close_rgb(importance, radiance * (ig / og), 2e-3), "{name} {wo} {wi}: {importance:?} {radiance:?}");
            if !tilted(material) {
                let forward = material.resolve(&p, wo).eval(wo, wi, Transport::Radiance);
                let eta = crossed_eta(name, wo.dot(p.frame.n), wi.dot(p.frame.n));
                let factor = eta * eta * o * ig / (og * i);
                assert!(close_rgb(importance, forward * factor, 2e-3), "{name} {wo} {wi}");
            }
        }
    }
}

#[test]
fn discrete_events_can_be_reversed() {
    for (m, (name, material)) in ZOO.all().enumerate() {
        let p = leaning();
        let mut rng = HashRng::new(9, m as u64, 0, 0);
        for _ in 0..60 {
            let wo = random_direction(&mut rng);
            let Some(s) = material.resolve(&p, wo).sample(wo, next3(&mut rng), Transport::Radiance) else { continue };
            if !s.delta || s.value.is_black() {
                continue;
            }
            let (o, i) = (wo.dot(p.frame.n).abs(), s.wi.dot(p.frame.n).abs());
            if o < 0.05 || i < 0.05 {
                continue;
            }
            let back = material.resolve(&p, s.wi);
            let events = (0..400).filter_map(|_| {
                let r = back.sample(s.wi, next3(&mut rng), Transport::Importance)?;
                (r.delta && (r.wi - wo).length() < 1e-3).then_some(r)
            });
            // A coat and a mirror below it reflect into one direction: the event is told by its probability and value.
            let distance =
                |r: &BsdfSample| (r.pdf.0 - s.pdf_reverse_delta.0).abs() + (r.value.g - s.reverse_delta.g).abs();
            let reverse = events.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            // A mirror under a bump map may see its normal turned from the other end.
            let Some(r) = reverse else {
                assert!(tilted(material) || s.pdf_reverse_delta.0 < 0.03, "{name} {wo} {s:?}");
                continue;
            };
            assert!(close(r.pdf.0, s.pdf_reverse_delta.0, 2e-3), "{name} {s:?} {r:?}");
            assert!(close(r.pdf_reverse_delta.0, s.pdf.0, 2e-3), "{name} {s:?} {r:?}");
            assert!(close(r.eta * s.eta, 1.0, 1e-3), "{name}");
            if !tilted(material) {
                // Flux: the importance event carries the radiance event's value, cosines exchanged and η² undone.
                let (og, ig) = (wo.dot(p.ng).abs(), s.wi.dot(p.ng).abs());
                let expected = s.value * (s.eta * s.eta) * (i * og / (ig * o));
                assert!(close_rgb(r.value, expected, 5e-3), "{name} {s:?} {r:?} {expected:?}");
            }
        }
    }
}

/// Mean throughput of importance from `wo`: the fraction of the energy that leaves.
fn reflected(bsdf: &Bsdf, wo: Vec3, seed: u64) -> Rgb {
    let mut rng = HashRng::new(13, seed, 0, 0);
    let n = 4000;
    let sum: Rgb =
        (0..n).filter_map(|_| bsdf.sample(wo, next3(&mut rng), Transport::Importance)).map(|s| s.value / s.pdf.0).sum();
    sum / n as f32
}

#[test]
fn white_materials_create_no_energy() {
    use Distribution::{Beckmann, Ggx};
    let mut z = ZooBuilder::new();
    let ior = ComplexIor { eta: rgb(0.0, 0.0, 0.0), k: white() };
    let mirror = |roughness| RoughConductorParams { roughness, ior, specular_reflectance: white() };
    let diffuse = z.name("diffuse", DiffuseParams { reflectance: white() });
    z.name("conductor", ConductorParams { ior, specular_reflectance: white() });
    z.name("dielectric", DielectricParams { eta: 1.5, specular_reflectance: white(), specular_transmittance: white() });
    z.name("thin", ThinDielectricParams { eta: 1.5, specular_reflectance: white(), specular_transmittance: white() });
    for (name, distribution, alpha) in [
        ("ggx 0.05", Ggx, 0.05),
        ("ggx 0.6", Ggx, 0.6),
        ("beckmann 0.05", Beckmann, 0.05),
        ("beckmann 0.6", Beckmann, 0.6),
    ] {
        let roughness = rough(distribution, alpha, alpha, true);
        z.name(name, mirror(roughness));
        z.name(
            name,
            RoughDielectricParams {
                roughness,
                eta: 1.5,
                specular_reflectance: white(),
                specular_transmittance: white(),
            },
        );
        z.name(
            name,
            RoughPlasticParams {
                roughness,
                eta: 1.5,
                diffuse_reflectance: white(),
                specular_reflectance: white(),
                nonlinear: true,
            },
        );
    }
    z.name(
        "plastic",
        PlasticParams { eta: 1.5, diffuse_reflectance: white(), specular_reflectance: white(), nonlinear: false },
    );
    z.name("phong", PhongParams { exponent: num(20.0), specular_reflectance: white(), diffuse_reflectance: white() });
    z.name(
        "ward",
        WardParams {
            alpha_u: num(0.2),
            alpha_v: num(0.4),
            variant: WardVariant::Balanced,
            specular_reflectance: white(),
            diffuse_reflectance: white(),
        },
    );
    z.name("metal", principled(|p| (p.base_color, p.metallic) = (white(), num(1.0))));
    z.name("glass", principled(|p| (p.base_color, p.spec_trans) = (white(), num(1.0))));
    z.name("mask", BsdfKind::Mask { nested: diffuse, opacity: num(0.5) });
    let zoo = z.build(&[], &[]);
    for (m, (name, material)) in zoo.all().enumerate() {
        for (v, wo) in [[0.0, 0.0, 1.0], [0.6, 0.1, 0.5], [0.1, 0.95, 0.15], [0.3, 0.3, -0.8], [-0.95, 0.1, -0.2]]
            .iter()
            .enumerate()
        {
            let wo = Vec3::from(*wo).normalize();
            let energy = reflected(&material.resolve(&flat(), wo), wo, (10 * m + v) as u64);
            // Smooth coats count the fit of the diffuse Fresnel reflectance (0.6 %) and the noise of 4000 samples.
            assert!(energy.max_component() <= 1.02, "{name} {wo} {energy:?}");
        }
    }
    // Materials that lose no energy.
    let up = Vec3::new(0.4, 0.0, 0.8).normalize();
    for name in ["diffuse", "conductor", "dielectric", "thin"] {
        let energy = reflected(&zoo.get(name).resolve(&flat(), up), up, 1);
        assert!((energy.r - 1.0).abs() < 1e-4, "{name} {energy:?}");
    }
}

#[test]
fn nothing_is_ever_non_finite() {
    use Distribution::{Beckmann, Ggx};
    let mut z = ZooBuilder::new();
    let zero = rgb(0.0, 0.0, 0.0);
    for distribution in [Ggx, Beckmann] {
        for (alpha_u, alpha_v, visible) in [(0.0, 0.0, true), (1e-4, 1.0, true), (1e-4, 1e-4, false), (1.0, 1.0, true)]
        {
            let roughness = rough(distribution, alpha_u, alpha_v, visible);
            z.name("conductor", gold(roughness, white()));
            z.name(
                "glass",
                RoughDielectricParams {
                    roughness,
                    eta: 1.0,
                    specular_reflectance: zero,
                    specular_transmittance: white(),
                },
            );
            z.name(
                "glass",
                RoughDielectricParams {
                    roughness,
                    eta: 0.6,
                    specular_reflectance: white(),
                    specular_transmittance: white(),
                },
            );
        }
        z.name(
            "rough plastic",
            RoughPlasticParams {
                roughness: rough(distribution, 0.0, 0.0, true),
                eta: 1.5,
                diffuse_reflectance: zero,
                specular_reflectance: zero,
                nonlinear: true,
            },
        );
    }
    for eta in [0.7, 1.0, 3.0] {
        z.name("dielectric", DielectricParams { eta, specular_reflectance: zero, specular_transmittance: white() });
        z.name("thin", ThinDielectricParams { eta, specular_reflectance: zero, specular_transmittance: zero });
        z.name(
            "plastic",
            PlasticParams { eta, diffuse_reflectance: zero, specular_reflectance: zero, nonlinear: false },
        );
    }
    for (roughness, trans) in [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        z.name(
            "principled",
            principled(|p| {
                (p.roughness, p.spec_trans, p.clearcoat, p.clearcoat_gloss) =
                    (num(roughness), num(trans), num(1.0), num(1.0));
                (p.base_color, p.anisotropic, p.sheen, p.sheen_tint, p.eta) = (zero, num(1.0), num(1.0), num(1.0), 1.0);
            }),
        );
    }
    for variant in [WardVariant::Ward, WardVariant::WardDuer, WardVariant::Balanced] {
        z.name(
            "ward",
            WardParams {
                alpha_u: num(0.0),
                alpha_v: num(0.5),
                variant,
                specular_reflectance: white(),
                diffuse_reflectance: zero,
            },
        );
    }
    z.name("phong", PhongParams { exponent: num(1e5), specular_reflectance: white(), diffuse_reflectance: zero });
    let extra = z.build(&[], &[]);
    let tiny = 1e-7f32;
    let mut directions: Vec<Vec3> = vec![Vec3::Z, -Vec3::Z, Vec3::X, Vec3::Y, -Vec3::X];
    for z in [tiny, -tiny, 1e-20, -1e-20, 1e-3, -1e-3, 0.5, -0.5, 1.0 - 1e-7] {
        for phi in [0.0f32, 0.7, 3.1] {
            let r = (1.0 - z * z).max(0.0).sqrt();
            directions.push(Vec3::new(r * phi.cos(), r * phi.sin(), z));
        }
    }
    let numbers = [0.0, 1e-6, 0.3, 0.7, 0.999_999_9f32.min(crate::math::float::ONE_MINUS_EPSILON)];
    for (name, material) in ZOO.all().chain(extra.all()) {
        for p in [flat(), leaning()] {
            for &wo in &directions {
                let bsdf = material.resolve(&p, wo);
                let albedo = bsdf.albedo();
                assert!(albedo.is_finite() && albedo.max_component() <= 1.0, "{name}");
                for mode in [Transport::Radiance, Transport::Importance] {
                    for &wi in &directions {
                        let (value, pdf) = bsdf.eval_and_pdf(wo, wi, mode);
                        let valid = |x: f32| x.is_finite() && x >= 0.0;
                        assert!(value.to_array().into_iter().all(valid), "{name} {wo} {wi} {mode:?} {value:?}");
                        assert!(valid(pdf.0), "{name} {wo} {wi} {pdf:?}");
                        let (forward, reverse) = (bsdf.pdf(wo, wi, mode), bsdf.pdf(wi, wo, mode));
                        assert!(valid(forward.0) && valid(reverse.0), "{name} {wo} {wi} {forward:?} {reverse:?}");
                    }
                    for &u in &numbers {
                        for &v in &numbers {
                            let Some(s) = bsdf.sample(wo, [u, v, numbers[2]], mode) else { continue };
                            assert!(
                                s.wi.is_finite() && s.value.is_finite() && s.pdf.0.is_finite(),
                                "{name} {wo} {s:?}"
                            );
                            assert!(s.pdf.0 > 0.0 && (s.value / s.pdf.0).is_finite(), "{name} {wo} {s:?}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn stored_bsdfs_equal_the_original() {
    let (mut first, mut second, mut stored) = (BsdfPool::default(), BsdfPool::default(), vec![]);
    let p = point(Vec3::new(0.2, 0.1, 1.0), Vec3::Z);
    for (_, material) in ZOO.all() {
        for (a, b) in pairs(material, &p, 77) {
            let bsdf = material.resolve(&p, a);
            stored.push((second.store(&bsdf), bsdf, a, b));
        }
    }
    // Something is there already when the second goes into the first.
    let before = first.store(&stored[stored.len() - 1].1);
    let offset = first.append(&second);
    let mut third = BsdfPool::default();
    for (stored, bsdf, a, b) in &stored {
        let copied = third.store_from(stored, &second);
        for found in [first.get(&stored.offset_by(offset), p.ng), second.get(stored, p.ng), third.get(&copied, p.ng)] {
            for mode in [Transport::Radiance, Transport::Importance] {
                assert_eq!(found.eval_and_pdf(*a, *b, mode), bsdf.eval_and_pdf(*a, *b, mode));
            }
            assert_eq!(found.albedo(), bsdf.albedo());
            assert_eq!(found.connectable(), bsdf.connectable());
        }
    }
    let (_, last, a, b) = &stored[stored.len() - 1];
    let mode = Transport::Radiance;
    assert_eq!(first.get(&before, p.ng).eval_and_pdf(*a, *b, mode), last.eval_and_pdf(*a, *b, mode));
}

/// A coated diffuse surface by its formula: Fresnel's equations and absorption on both ways, refraction of the solid
/// angle, and the cosine below the coat in the base's value.
#[test]
fn a_coat_lets_through_what_it_does_not_reflect_or_absorb() {
    let mut z = ZooBuilder::new();
    let nested = z.add(DiffuseParams { reflectance: rgb(0.8, 0.4, 0.1) });
    let (sigma_a, specular_reflectance) = (rgb(0.1, 0.5, 1.0), white());
    z.name(
        "coating",
        BsdfKind::Coating(CoatingDesc { nested, eta: 1.5, sigma_a, thickness: 0.5, specular_reflectance }),
    );
    let z = z.build(&[], &[]);
    for (a, b) in [(Vec3::Z, Vec3::Z), (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, -0.8, 0.6))] {
        let below = |v: Vec3| f64::from(1.0 - (1.0 - v.z * v.z) / 2.25).sqrt();
        let passes = |v: Vec3| {
            let (o, t) = (f64::from(v.z), below(v));
            let (s, p) = ((o - 1.5 * t) / (o + 1.5 * t), (t - 1.5 * o) / (t + 1.5 * o));
            1.0 - 0.5 * (s * s + p * p)
        };
        let value = z.get("coating").resolve(&flat(), a).eval(a, b, Transport::Radiance);
        for (c, (albedo, sigma)) in [(0.8, 0.1), (0.4, 0.5), (0.1, 1.0)].into_iter().enumerate() {
            let absorbed = (-0.5 * sigma * (1.0 / below(a) + 1.0 / below(b))).exp();
            let expected = albedo / std::f64::consts::PI * passes(a) * passes(b) * absorbed * f64::from(b.z) / 2.25;
            assert!(close(value[c], expected as f32, 1e-4), "{a} {b}: {value:?}, {expected}");
        }
    }
}
