//! `lightsieve profile`: the time of one method by phases and rays.

use super::Failure;
use super::environment::Environment;
use super::measure_args::ProfileArgs;
use super::session::{Session, command_line, to_json, write_text};
use crate::image::{Layer, Picture, write_picture};
use crate::math::Rgb;
use crate::measure::profile::{Profile, Profiled, Task, profile};
use crate::measure::report::pictures::doubles;
use crate::measure::report::{Page, Shown, Table, picture_group};
use crate::measure::visibility::CostMap;
use crate::render::OutputFiles;
use std::path::Path;

/// Files of a report in its folder.
const JSON: &str = "profile.json";
const COST: &str = "cost.exr";
const BLOCKED: &str = "blocked.exr";
const PAGE: &str = "index.html";

pub(crate) fn run(args: &ProfileArgs) -> Result<(), Failure> {
    let mut outputs = OutputFiles::default();
    args.report.iter().for_each(|folder| outputs.add_folder("--report", folder, &[JSON, COST, BLOCKED, PAGE]));
    let session = Session::new(&args.measure, outputs, [args.scene.as_path()])?;
    let mut scene = session.prepare(&args.scene, None)?;
    let method = match scene.methods.as_slice() {
        [one] => one.clone(),
        [first, ..] if args.measure.integrators.is_none() => first.clone(),
        _ => return Err(Failure::Input("one method is profiled at a time: -i NAME".into())),
    };
    let task = Task {
        scene: args.scene.display().to_string(),
        method: &method,
        seed: args.seed,
        time: args.time,
        threads: session.environment.threads,
    };
    let Environment { pool, .. } = &session.environment;
    let profiled = pool.install(|| profile(&mut scene.scene, &task, session.environment.interrupt()))?;
    let Profiled { profile: found, picture, map } = profiled;
    let tables = tables(&found);
    if args.measure.json {
        out!("{}", to_json(&found)?);
    } else {
        for table in &tables {
            for line in table.lines() {
                out!("{line}");
            }
            out!("");
        }
    }
    session.say(&found.load.sentence());
    found.load.warning().iter().for_each(|warning| session.say(&format!("warning: {warning}")));
    if let Some(folder) = &args.report {
        session.say(&format!("wrote {}", write_text(folder, JSON, &to_json(&found)?)?.display()));
        for (name, pixels) in [(COST, map.cost_picture()), (BLOCKED, map.blocked_picture())] {
            session.say(&format!("wrote {}", write_map(folder, name, &map, &pixels)?.display()));
        }
        let page = page(&found, &tables, &picture, &map);
        session.say(&format!("wrote {}", write_text(folder, PAGE, &page)?.display()));
    }
    Ok(())
}

fn write_map(folder: &Path, name: &str, map: &CostMap, pixels: &[Rgb]) -> Result<std::path::PathBuf, Failure> {
    let path = folder.join(name);
    let grey = pixels.iter().map(|p| p.r).collect();
    let layers = vec![Layer { name: String::new(), channels: vec![("Y", grey)] }];
    let picture = Picture { width: map.size[0], height: map.size[1], layers, metadata: vec![] };
    write_picture(&path, &picture, 0.0).map_err(Failure::io)?;
    Ok(path)
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Tables of a profile, in the order of importance.
fn tables(p: &Profile) -> Vec<Table> {
    let mut all = Table::new([format!("{} on {}", p.method, p.scene), String::new()]);
    all.row(["samples per pixel".into(), format!("{} in {:.2} s", p.iterations, p.wall_s)]);
    all.row(["rays".into(), format!("{:.2} million per second", p.mrays_per_s)]);
    all.row(["processor time per ray, all included".into(), format!("{:.0} ns", p.ns_per_ray)]);
    all.row(["of it in ray queries (sampled)".into(), percent(p.query_share)]);
    if let Some(ours) = p.ours {
        all.row(["of it not the bare backend's (replay)".into(), percent(ours)]);
    }
    all.row(["shadow rays that were blocked".into(), percent(p.shadow_blocked)]);
    all.row(["light that blocked contributions would have brought".into(), percent(p.visibility.blocked_light)]);
    all.row(["samples that were not finite".into(), p.non_finite.to_string()]);

    let mut phases = Table::new(["phase", "seconds", "share"]);
    for (name, seconds) in &p.phases {
        phases.row([(*name).to_owned(), format!("{seconds:.3}"), percent(seconds / p.wall_s)]);
    }
    for (name, seconds) in &p.work {
        phases.row([format!("  of these, {name} (sampled)"), format!("{seconds:.3}"), percent(seconds / p.wall_s)]);
    }
    let rest = p.wall_s - p.phases.values().sum::<f64>();
    phases.row(["everything else".into(), format!("{rest:.3}"), percent(rest / p.wall_s)]);

    let mut rays = Table::new(["rays", "number", "share", "ns each", "time", "blocked"]);
    for (name, k) in &p.rays {
        let time = k.ns * k.rays as f64 * 1e-9 / p.cpu_s;
        rays.row([
            (*name).to_owned(),
            k.rays.to_string(),
            percent(k.share),
            format!("{:.0}", k.ns),
            percent(time),
            k.blocked.map_or(String::new(), percent),
        ]);
    }
    let mut replay =
        Table::new(["the same rays through the bare backend", "ns each", "share of the renderer's time", "met"]);
    for r in &p.replay {
        replay.row([r.backend.clone(), format!("{:.0}", r.ns_per_ray), percent(r.share), r.met.to_string()]);
    }
    vec![all, phases, rays, replay]
}

fn page(p: &Profile, tables: &[Table], picture: &[[f64; 3]], map: &CostMap) -> String {
    let mut page = Page::new(&format!("Profile: {} on {}", p.method, p.scene));
    page.command(&command_line());
    page.text(&format!("{} {}; {}.", p.method, p.parameters, p.load.sentence()));
    for table in tables {
        page.table(table);
    }
    page.text(&format!(
        "The replay sends the rays of one iteration ({} of {}) through a backend with nothing of the renderer around \
         them, each thread's in its order, in turns with whole iterations; what is left of the renderer's time is \
         its own.",
        p.replayed[0],
        p.replayed[0] + p.replayed[1]
    ));
    page.heading(2, "Picture");
    let plain = |name: &str, pixels, note: &str| Shown { name: name.into(), pixels, note: note.into() };
    page.markup(&picture_group(p.size, &[plain("picture", picture, "")], None));
    page.heading(2, "Cost and visibility");
    page.text(&format!(
        "{} samples of a pixel in every {}th column and row, run again and counted. Cost: rays relative to the mean \
         pixel ({:.1} rays), here at half of their value. Blocked: the share of a pixel's shadow rays with something \
         in the way, and the light that they would have brought relative to all light.",
        map.samples, map.step, p.visibility.rays_per_sample
    ));
    let half: Vec<[f64; 3]> = doubles(&map.cost_picture()).iter().map(|p| p.map(|v| 0.5 * v)).collect();
    let (blocked, light) = (doubles(&map.blocked_picture()), doubles(&map.lost_light_picture()));
    let shown = [
        plain("cost", &half, "rays, mean is 0.5"),
        plain("blocked", &blocked, "share of shadow rays"),
        plain("lost light", &light, "share of light"),
    ];
    page.markup(&picture_group(map.size, &shown, None));
    page.heading(2, "Machine");
    page.table(&p.machine.table());
    page.finish()
}
