//! Guided rays of lights against their densities.

use super::*;

/// Records of rays through a window: a small square that the rays cross in all directions in which the light shines.
fn window_records(light: &Light, id: LightId, rng: &mut HashRng) -> Vec<EmissionRecord> {
    let mut records = vec![];
    while records.len() < 3000 {
        let Some(direct) = light.sample_direct(Vec3::ZERO, pair(rng)) else { continue };
        let [u, v] = pair(rng);
        let p = Vec3::new(0.8, 0.3 * u - 0.5, 0.2 * v) - direct.wi * rng.next_f32();
        records.push(EmissionRecord { light: id, p, direction: -direct.wi, weight: 1.0 + f64::from(u) });
    }
    records
}

fn infinite_lights() -> Vec<(&'static str, Light)> {
    all_lights().into_iter().filter(|(_, light)| light.is_infinite()).collect()
}

/// The numbers of a ray are found again from the ray.
#[test]
fn emission_is_inverted() {
    let mut rng = rng(90);
    for (name, light) in infinite_lights() {
        for _ in 0..500 {
            let (u_pos, u_dir) = (pair(&mut rng), pair(&mut rng));
            let Some(sample) = light.sample_emission(u_pos, u_dir) else { continue };
            let p = sample.origin + sample.direction * 1.5;
            let close = |a: [f32; 2], b: [f32; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 2e-3);
            match &light {
                Light::Directional(light) => assert!(close(light.invert_emission(p), u_pos), "{name}"),
                Light::Environment(light) => {
                    let (position, directions) = light.invert_emission(p, sample.direction);
                    assert!(close(position, u_pos), "{name}: {position:?} {u_pos:?}");
                    let sum: f32 = directions.iter().map(|(pdf, _)| pdf).sum();
                    assert!((sum / sample.pdf_direction.0 - 1.0).abs() < 1e-5, "{name}");
                    let mut found = directions.iter().filter(|(pdf, _)| *pdf > 0.0);
                    // Azimuths at a pole, and places in cells with hardly any density, are not known well.
                    let known = sample.pdf_direction.0 > 1e-3 && sample.direction.y.abs() < 0.99;
                    assert!(!known || found.any(|(_, u)| close(*u, u_dir)), "{name}: {directions:?} {u_dir:?}");
                }
                _ => unreachable!(),
            }
        }
    }
}

/// The mean quotient of unguided and guided density over guided rays is one, in every region; evaluated densities are the
/// sampled ones; rays through the window are drawn much more often.
#[test]
fn guided_densities_agree_with_their_samples() {
    let n = 40_000;
    for (name, light) in infinite_lights() {
        let mut rng = rng(91);
        let lights = LightSet::new(vec![light]);
        let id = LightId(0);
        let light = lights.get(id);
        let guided = EmissionDistribution::guided(&lights, &window_records(light, id, &mut rng));
        let (mut all, mut right, mut drawn, mut through) = (0.0, 0.0, 0, [0; 2]);
        let is_through = |s: &EmissionSample| {
            let t = (0.8 - s.origin.x) / s.direction.x;
            let at = s.origin + s.direction * t;
            (-0.5..-0.2).contains(&at.y) && (0.0..0.2).contains(&at.z)
        };
        for _ in 0..n {
            let (u_pos, u_dir) = (pair(&mut rng), pair(&mut rng));
            through[0] += usize::from(light.sample_emission(u_pos, u_dir).is_some_and(|s| is_through(&s)));
            let Some(sample) = guided.sample_ray(&lights, id, u_pos, u_dir) else { continue };
            through[1] += usize::from(is_through(&sample));
            let next = sample.origin + sample.direction * (3.0 * u_pos[0]);
            let (position, direction) = guided.pdf_ray_at_vertex(&lights, id, Vec3::ZERO, sample.direction, next);
            let (unguided, _) = light.pdf_emission_at_vertex(Vec3::ZERO, sample.direction);
            // The number may round to the next box.
            if (position.0 / sample.pdf_position.0 - 1.0).abs() < 1e-4 && direction == sample.pdf_direction {
                drawn += 1;
            }
            let quotient = f64::from(unguided.0 / sample.pdf_position.0);
            all += quotient;
            right += if sample.origin.dot(Vec3::new(0.6, 0.0, 0.8)) > 0.0 { quotient } else { 0.0 };
        }
        let expected = (0..n)
            .filter_map(|_| light.sample_emission(pair(&mut rng), pair(&mut rng)))
            .filter(|s| s.origin.dot(Vec3::new(0.6, 0.0, 0.8)) > 0.0)
            .count() as f64;
        let n = f64::from(n);
        assert!((all / n - 1.0).abs() < 0.05, "{name}: {}", all / n);
        assert!((right - expected).abs() < 0.05 * n, "{name}: {right} {expected}");
        assert!(f64::from(drawn) > 0.995 * n, "{name}: {drawn}");
        assert!(through[1] > 4 * through[0], "{name}: {through:?}");
    }
}

#[test]
fn lights_are_drawn_by_what_they_brought_and_by_power() {
    let mut lights: Vec<Light> = infinite_lights().into_iter().map(|(_, light)| light).collect();
    lights.push(Light::Triangle(triangle([[0.1, -0.3, 1.0], [0.2, 0.8, 1.5], [1.4, 0.1, 1.2]], Rgb::grey(1e-3))));
    let near = LightId(lights.len() as u32 - 1);
    let lights = LightSet::new(lights);
    let record = |light: LightId, weight: f64| EmissionRecord { light, p: Vec3::ZERO, direction: Vec3::X, weight };
    let guided = EmissionDistribution::guided(&lights, &[record(LightId(0), 1.0), record(near, 3.0)]);
    let sum: f32 = lights.iter().map(|(id, _)| guided.pmf_light(&lights, id).0).sum();
    assert!((sum - 1.0).abs() < 1e-5);
    assert!(guided.pmf_light(&lights, near).0 > 0.5 && lights.pmf_light(near).0 < 1e-3);
    assert!(lights.iter().all(|(id, _)| guided.pmf_light(&lights, id).0 > 0.0));
    assert!(!EmissionDistribution::guided(&lights, &[record(near, 3.0)]).is_guided());
}
