//! `lightsieve replay`: one sample of one pixel, written down.

use super::Failure;
use super::cli::ReplayArgs;
use super::environment::Environment;
use crate::integrators::Iteration;
use crate::integrators::replay::{ContributionRecord, Replay, VertexRecord};
use crate::math::{Rgb, Vec3};
use crate::path::StoredPlace;
use crate::prepared::PreparedScene;
use crate::render::job;

pub(crate) fn run(args: &ReplayArgs) -> Result<(), Failure> {
    let environment = Environment::new(None, true)?;
    let runtime = environment.runtime();
    let mut loaded = job::load(&args.scene.request(), runtime)?;
    let method = args.sample.method().resolve(&loaded.desc, &mut loaded.diagnostics)?;
    let prepared = job::prepare(loaded, &args.sample.prepare_options(&environment), runtime)?;
    prepared.check_method(&method, runtime);
    let scene = &prepared.scene;
    let [x, y] = args.pixel;
    let [x0, y0, width, height] = scene.window;
    if x.wrapping_sub(x0) >= width || y.wrapping_sub(y0) >= height {
        return Err(Failure::Input(format!("pixel {x},{y} is not in the picture ({x0},{y0},{width},{height})")));
    }
    let iteration = Iteration::new(scene, args.sample.seed, args.iteration);
    let replay = environment.pool.install(|| method.build().replay(&iteration, (x, y)));
    out!("{} pixel {x},{y} iteration {} seed {}", method.spec.name, args.iteration, args.sample.seed);
    print(&replay, scene);
    Ok(())
}

fn rgb(c: Rgb) -> String {
    format!("({:.6e} {:.6e} {:.6e})", c.r, c.g, c.b)
}

fn point(p: Vec3, scene: &PreparedScene) -> String {
    let p = scene.position_in_file(p);
    if scene.unit == 1.0 {
        format!("({:.6} {:.6} {:.6})", p.x, p.y, p.z)
    } else {
        format!("({:.6e} {:.6e} {:.6e})", p.x, p.y, p.z)
    }
}

fn print(replay: &Replay, scene: &PreparedScene) {
    for (name, letter, walk) in [("eye", 'z', &replay.eye), ("light", 'y', &replay.light)] {
        out!("\n{name} sub-path: {} surface vertices", walk.len());
        for (i, v) in walk.iter().enumerate() {
            vertex(letter, i + 1, v, scene);
        }
    }
    out!("\n{} contributions (light vertices s, eye vertices t)", replay.contributions.len());
    let mut sum = Rgb::BLACK;
    for c in &replay.contributions {
        contribution(c, replay.pixel);
        if c.visible && c.pixel == replay.pixel {
            sum += c.raw * c.weight;
        }
    }
    out!("\nsum of what is visible in this pixel: {}", rgb(sum));
}

fn vertex(letter: char, i: usize, v: &VertexRecord, scene: &PreparedScene) {
    let place = &v.interior.place;
    let at = point(place.position(), scene);
    match (place, v.shading_normal) {
        (StoredPlace::Surface { ng, .. }, Some(n)) => {
            out!("  {letter}{i} at {at}  normal {ng:.4}  shading normal {n:.4}");
        }
        (StoredPlace::Surface { ng, .. }, None) => out!("  {letter}{i} at {at}  normal {ng:.4}"),
        (StoredPlace::Medium(medium), _) => {
            out!(
                "  {letter}{i} at {at}  in a medium of extinction {}",
                rgb(medium.sigma_t * (1.0 / scene.unit as f32))
            );
        }
    }
    out!(
        "     edge {:.6e} long, pdf {:.6e} /sr, survival {:.4}, cos {:.4}; throughput {}; albedo {}{}",
        f64::from(v.distance) * scene.unit,
        v.pdf.0,
        v.survival,
        place.cosine(v.wo),
        rgb(v.throughput),
        rgb(v.interior.bsdf.albedo()),
        match v.interior.delta {
            Some(([a, b], _)) => format!("; left by a delta event (probabilities {:.4} and {:.4})", a.0, b.0),
            None => String::new(),
        }
    );
}

fn contribution(c: &ContributionRecord, own: (u32, u32)) {
    out!(
        "  ({}, {}) raw {}  weight {:.6}  contributes {}{}{}",
        c.s,
        c.t,
        rgb(c.raw),
        c.weight,
        rgb(c.raw * c.weight),
        if c.visible { "" } else { "  blocked" },
        if c.pixel == own { String::new() } else { format!("  to pixel {},{}", c.pixel.0, c.pixel.1) },
    );
    let k = c.techniques.len().saturating_sub(1);
    for (s, (log_share, weight)) in c.techniques.iter().enumerate() {
        if *log_share > f64::NEG_INFINITY {
            out!("      by definition ({s}, {}): ln n c p = {log_share:.6}, weight {weight:.9}", k + 1 - s);
        }
    }
}
