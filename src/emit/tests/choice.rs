//! Choosing lights.

use super::*;
use std::f32::consts::PI;

fn many_lights() -> Vec<Light> {
    let mut rng = rng(80);
    let mut lights = Vec::new();
    for i in 0..60 {
        let c = (Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) - 0.5) * 6.0;
        let corner = |rng: &mut HashRng| c + random_direction(rng) * 0.3;
        let power = if i % 7 == 3 { 0.0 } else { rng.next_f32() * 4.0 };
        lights.push(match i % 5 {
            0 => Light::Point(PointLight::new(c.as_dvec3(), Rgb::grey(power), DVec3::ZERO)),
            1 => {
                let m = DMat4::from_translation(c.as_dvec3()) * tilted();
                Light::Spot(Box::new(SpotLight::new(m, Rgb::grey(power), 40.0, 25.0, DVec3::ZERO).unwrap()))
            }
            _ => {
                let v = [corner(&mut rng), corner(&mut rng), corner(&mut rng)];
                Light::Triangle(TriangleLight::new(v, false, TriangleEmission::Constant(Rgb::grey(power))))
            }
        });
    }
    lights
}

fn with_infinite() -> LightSet {
    let mut lights = many_lights();
    lights.extend(all_lights().into_iter().map(|(_, l)| l).filter(Light::is_infinite));
    LightSet::new(lights)
}

fn places() -> Vec<(Vec3, Option<Vec3>)> {
    let mut rng = rng(81);
    let mut places: Vec<_> = (0..6)
        .map(|i| {
            let p = (Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) - 0.5) * if i < 4 { 5.0 } else { 50.0 };
            (p, (i % 2 == 0).then(|| random_direction(&mut rng)))
        })
        .collect();
    // Outside of all lights, facing away: nothing arrives, and probabilities must still sum to one.
    places.push((Vec3::new(0.0, 0.0, 100.0), Some(Vec3::Z)));
    places
}

/// Two finely tessellated emitters, one round and one flat, of unlike triangles: from most places parts of them count
/// as one light.
fn tessellated() -> LightSet {
    let (n, mut lights) = (24, Vec::new());
    for k in 0..n * n {
        let at = |i: usize, j: usize| {
            let (theta, phi) = (PI * i as f32 / n as f32, 2.0 * PI * j as f32 / n as f32);
            Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()) * 0.5
        };
        let plane = |i: usize, j: usize| Vec3::new((i * i) as f32 * 0.001, j as f32 * 0.01, 2.0);
        let (i, j) = (k / n, k % n);
        for v in [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [plane(i, j), plane(i, j + 1), plane(i + 1, j)]] {
            let radiance = Rgb::grey(1.0 + (k % 3) as f32);
            lights.push(Light::Triangle(TriangleLight::new(v, false, TriangleEmission::Constant(radiance))));
        }
    }
    LightSet::new(lights)
}

#[test]
fn probabilities_sum_to_one_and_match_the_choices() {
    let sets = [LightSet::new(many_lights()), with_infinite(), tessellated()];
    let alpha = significance(2 * (sets.len() * places().len()) as u32);
    for (k, set) in sets.iter().enumerate() {
        for (j, (p, n)) in places().into_iter().enumerate() {
            let draws = 20_000;
            for from_point in [true, false] {
                let pmf = |id| if from_point { set.pmf_light_from(p, n, id) } else { set.pmf_light(id) };
                let total: f64 = set.iter().map(|(id, _)| f64::from(pmf(id).0)).sum();
                assert!((total - 1.0).abs() < 1e-5, "{total}");
                let mut observed = vec![0.0; set.len()];
                let mut rng = rng(90 + (k * 10 + j) as u64);
                for _ in 0..draws {
                    let u = rng.next_f32();
                    let (id, probability) =
                        if from_point { set.sample_light_from(p, n, u) } else { set.sample_light(u) }.unwrap();
                    assert!((probability.0 - pmf(id).0).abs() <= 1e-6 * probability.0, "{probability:?} {:?}", pmf(id));
                    assert!(set.get(id).power() > 0.0);
                    observed[id.index()] += 1.0;
                }
                let expected: Vec<f64> = set.iter().map(|(id, _)| f64::from(pmf(id).0) * f64::from(draws)).collect();
                let value = chi2_p_value(&observed, &expected);
                assert!(value > alpha, "set {k} place {j} {from_point}: p = {value}");
            }
        }
    }
}

/// A light that is never chosen must not be able to contribute.
#[test]
fn lights_without_probability_are_dark() {
    let set = with_infinite();
    let mut rng = rng(100);
    let mut dark = 0;
    for i in 0..2000 {
        // Half of the points are close to a light, where it is seen under a large angle.
        let near = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 6.0 - 3.0;
        let p = match set.get(LightId(rng.next_u64() as u32 % 60)) {
            Light::Triangle(t) if i % 2 == 0 => t.corners()[i % 3] + random_direction(&mut rng) * 0.3,
            _ => near,
        };
        let n = (i % 3 > 0).then(|| random_direction(&mut rng));
        for (id, light) in set.iter().filter(|(id, _)| set.pmf_light_from(p, n, *id).0 == 0.0) {
            dark += 1;
            for _ in 0..4 {
                if let Some(s) = light.sample_direct(p, pair(&mut rng)) {
                    assert!(n.is_some_and(|n| n.dot(s.wi) <= 1e-3), "light {id:?} shines on {p}");
                }
            }
        }
    }
    assert!(dark > 10_000, "{dark}");
}

/// The tree has less variance than sampling by power among many lights spread over a large room.
#[test]
fn the_tree_follows_the_distance() {
    let lights: Vec<Light> = (0..100)
        .map(|i| {
            let at = DVec3::new(f64::from(i % 10) * 10.0, f64::from(i / 10) * 10.0, 2.0);
            Light::Point(PointLight::new(at, Rgb::WHITE, DVec3::ZERO))
        })
        .collect();
    let set = LightSet::new(lights);
    let (p, n) = (Vec3::new(33.0, 41.0, 0.0), Vec3::Z);
    let value = |id: LightId| {
        let s = set.get(id).sample_direct(p, [0.5; 2]).unwrap();
        f64::from(s.radiance.g * s.wi.dot(n))
    };
    let sum: f64 = set.iter().map(|(id, _)| value(id)).sum();
    let second = |pmf: &dyn Fn(LightId) -> f64| -> f64 { set.iter().map(|(id, _)| value(id).powi(2) / pmf(id)).sum() };
    let variance = |pmf: &dyn Fn(LightId) -> f64| second(pmf) / (sum * sum) - 1.0;
    let by_power = variance(&|id| f64::from(set.pmf_light(id).0));
    let by_tree = variance(&|id| f64::from(set.pmf_light_from(p, Some(n), id).0));
    assert!(by_tree < 0.1 * by_power, "{by_tree} {by_power}");
}

#[test]
fn none_one_and_many_coincident_lights() {
    let dark = || Light::Point(PointLight::new(DVec3::ZERO, Rgb::BLACK, DVec3::ZERO));
    for lights in [vec![], vec![dark()], vec![dark(), dark()]] {
        let set = LightSet::new(lights);
        assert!(set.sample_light(0.5).is_none() && set.sample_light_from(Vec3::X, None, 0.5).is_none());
        assert!(set.iter().all(|(id, _)| set.pmf_light(id).0 == 0.0));
    }
    for (name, light) in all_lights() {
        let set = LightSet::new(vec![light]);
        let one = Some((LightId(0), crate::math::Pmf(1.0)));
        assert!(set.sample_light(0.9) == one && set.sample_light_from(Vec3::X, Some(Vec3::Z), 0.9) == one, "{name}");
        assert_eq!(set.infinite().len(), usize::from(set.get(LightId(0)).is_infinite()));
    }
    // All in one place: no split is better than another, and the depth stays bounded.
    let light = |_| Light::Point(PointLight::new(DVec3::ONE, Rgb::WHITE, DVec3::ZERO));
    let set = LightSet::new((0..5000).map(light).collect());
    let total: f32 = set.iter().map(|(id, _)| set.pmf_light_from(Vec3::ZERO, None, id).0).sum();
    assert!((total - 1.0).abs() < 1e-3, "{total}");
    // Ever farther apart: bucket splits peel off one light at a time.
    let light = |i: i32| Light::Point(PointLight::new(DVec3::X * 1.3f64.powi(i), Rgb::WHITE, DVec3::ZERO));
    let set = LightSet::new((0..200).map(light).collect());
    let total: f32 = set.iter().map(|(id, _)| set.pmf_light_from(Vec3::ZERO, None, id).0).sum();
    assert!((total - 1.0).abs() < 1e-3, "{total}");
}

#[test]
fn weights_multiply_the_probability_of_being_sampled() {
    let point = |power: f32, x: f64| Light::Point(PointLight::new(DVec3::X * x, Rgb::grey(power), DVec3::ZERO));
    let from = Vec3::new(0.0, 10.0, 0.0);
    // Few lights are sampled by power, more by a tree.
    for count in [3, 8] {
        let lights: Vec<Light> = (0..count).map(|i| point(1.0, f64::from(i) * 1e-3)).collect();
        let weights: Vec<f32> = (0..count).map(|i| [1.0, 4.0, 0.0][i as usize % 3]).collect();
        let set = LightSet::weighted(lights, &weights);
        let total: f32 = weights.iter().sum();
        for (id, _) in set.iter() {
            let expected = weights[id.index()] / total;
            let (by_power, from_there) = (set.pmf_light(id).0, set.pmf_light_from(from, None, id).0);
            assert!((by_power - expected).abs() < 1e-6, "{count} {id:?}: {by_power} {expected}");
            assert!((from_there - expected).abs() < 0.02, "{count} {id:?}: {from_there} {expected}");
            assert_eq!(from_there == 0.0, expected == 0.0);
        }
    }
}
