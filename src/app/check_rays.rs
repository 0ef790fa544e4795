//! `lightsieve check-rays`: agreement of the ray-query backends on a scene.

use super::Failure;
use super::cli::CheckRaysArgs;
use super::config::plain_options;
use super::environment::Environment;
use crate::ray::agreement::{Agreement, DISTANCE_TOLERANCE, compare};
use crate::ray::{Backend, RayQuery};
use crate::render::job;
use std::collections::BTreeMap;

/// Rays times triangles that the brute-force oracle may cost: beyond, it gets fewer rays.
const BRUTE_WORK: u64 = 400_000_000;
/// Share of queries that rounding may answer differently (grazing rays, vertices).
const TOLERATED: f64 = 1e-3;

pub(crate) fn run(args: &CheckRaysArgs) -> Result<(), Failure> {
    let environment = Environment::new(None, false)?;
    let options = plain_options(&environment);
    let loaded = job::load(&args.scene.request(), environment.runtime())?;
    let scene = job::prepare(loaded, &options, environment.runtime())?.scene;
    let Some(bounds) = scene.geometry.bounds() else { return Err(Failure::Input("the scene has no triangles".into())) };

    let mut rows: BTreeMap<String, Agreement> = BTreeMap::new();
    let mut check = |backend: Backend, rays: u64| -> Result<(), Failure> {
        if rays > 0 && backend != options.backend {
            let other: Box<dyn RayQuery> =
                backend.build(scene.geometry.clone(), environment.threads).map_err(Failure::input)?;
            let row = compare(&*scene.query, &*other, bounds, rays, args.seed);
            rows.insert(format!("{} / {}", scene.query.describe(), other.describe()), row);
        }
        Ok(())
    };
    check(Backend::Obvhs, args.rays)?;
    let affordable = BRUTE_WORK / (3 * (scene.geometry.triangle_count() + scene.geometry.round_count()).max(1) as u64);
    check(Backend::Brute, args.rays.min(affordable))?;

    print(&rows, args.json)?;
    let worst = rows.values().map(Agreement::disagreement).fold(0.0, f64::max);
    if worst > TOLERATED {
        return Err(Failure::Input(format!(
            "the backends disagree on {worst:.1e} of the questions (tolerated: {TOLERATED:.0e})"
        )));
    }
    Ok(())
}

fn print(rows: &BTreeMap<String, Agreement>, json: bool) -> Result<(), Failure> {
    if json {
        out!("{}", serde_json::to_string_pretty(rows).map_err(Failure::io)?);
    } else {
        for (name, a) in rows {
            out!("{name}");
            out!("  rays            {:>9}, both hit {}", a.rays, a.both_hit);
            out!("  hit or miss     {:>9}  one met something, the other nothing", a.hit_or_miss);
            out!("  other surface   {:>9}  another triangle at another distance", a.other_surface);
            out!(
                "  distance        {:>9}  same triangle, distance differs by more than {DISTANCE_TOLERANCE:e}",
                a.distance
            );
            out!(
                "  ties            {:>9}  another triangle at the same distance: shared edges, coplanar surfaces",
                a.ties
            );
            out!("  occlusion       {:>9}  of {} segments", a.occlusion, a.segments);
            out!("  packets         {:>9}  packet and single query of one backend differ", a.packet);
            out!("  disagreement    {:>9.2e}  ties apart", a.disagreement());
        }
    }
    Ok(())
}
