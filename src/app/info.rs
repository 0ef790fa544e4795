//! `lightsieve info`.

use super::Failure;
use super::cli::InfoArgs;
use super::config::plain_options;
use super::environment::Environment;
use super::skeleton;
use crate::image::{OutputFormat, Pixels};
use crate::integrators;
use crate::math::DVec3;
use crate::prepared::PreparedScene;
use crate::render::{OutputFiles, job};
use crate::scene::SceneDesc;
use crate::skeleton::Skeleton;
use std::path::PathBuf;
use std::time::Instant;

fn mib(bytes: usize) -> String {
    format!("{:.2} MiB", bytes as f64 / f64::from(1 << 20))
}

pub(crate) fn run(args: &InfoArgs) -> Result<(), Failure> {
    // Bad endings are found before anything is done.
    if let Some(path) = &args.skeleton {
        skeleton::LineFormat::of(path)?;
    }
    if let Some(path) = &args.skeleton_image {
        OutputFormat::of(path).map_err(Failure::input)?;
    }
    let mut outputs = OutputFiles::default();
    args.skeleton.iter().for_each(|path| outputs.add("--skeleton", path));
    args.skeleton_image.iter().for_each(|path| outputs.add("--skeleton-image", path));
    outputs.check_inputs([args.scene.scene.as_path()])?;
    outputs.check()?;
    let environment = Environment::new(None, false)?;
    let loaded = job::load(&args.scene.request(), environment.runtime())?;
    outputs.check_inputs(loaded.desc.files.iter().map(PathBuf::as_path))?;
    out!("scene       {}", args.scene.scene.display());
    describe_file(&loaded.desc);
    let named = loaded.desc.integrator.as_ref().and_then(|block| integrators::find(&block.name));
    let scene = job::prepare(loaded, &plain_options(&environment), environment.runtime())?.scene;
    describe_prepared(&scene);
    let integrator = named.unwrap_or(&integrators::path::SPEC);
    if let Some(limitation) = (integrator.limitations)(scene.features) {
        out!("missing     {}: {limitation}", integrator.name);
    }
    if args.skeleton.is_some() || args.skeleton_image.is_some() {
        write_skeleton(args, &scene)?;
    }
    Ok(())
}

/// Prints the contents of the scene file.
fn describe_file(desc: &SceneDesc) {
    if let Some(sensor) = desc.sensors.first() {
        let film = &sensor.film;
        let lens = if sensor.aperture_radius > 0.0 { "thin lens" } else { "pinhole" };
        out!("camera      {lens}, field of view {:.2} degrees, film {} x {}", sensor.fov, film.width, film.height);
        out!("filter      {:?}", film.filter);
    }
    if let Some(block) = &desc.integrator {
        let params: Vec<String> = block.params.iter().map(|(k, v, _)| format!("{k}={v}")).collect();
        out!("integrator  {} {}", block.name, params.join(" "));
    }
    out!("materials   {}", desc.bsdfs.len());
    out!("textures    {}", desc.textures.len());
    for image in &desc.images {
        let space = match image.image.pixels {
            Pixels::Srgb8(_) => "sRGB, 8 bit",
            Pixels::Linear8(_) => "linear, 8 bit",
            Pixels::F32(_) => "linear, float",
        };
        let i = &image.image;
        out!("  {}  {} x {} x {}, {space}, {}", image.path.display(), i.width, i.height, i.channels, mib(i.bytes()));
    }
}

/// Prints the scene as rays meet it.
fn describe_prepared(scene: &PreparedScene) {
    let shading: usize = scene.meshes.iter().map(crate::prepared::MeshShading::bytes).sum();
    out!("meshes      {}", scene.geometry.meshes.len());
    out!("instances   {}", scene.geometry.instances.len());
    out!(
        "triangles   {} ({} with vertex data, {} more as hits look them up)",
        scene.geometry.triangle_count(),
        mib(scene.geometry.bytes() + shading),
        mib(scene.triangles.bytes())
    );
    if !scene.geometry.round.is_empty() {
        out!("round       {} spheres, disks and cylinders", scene.geometry.round_count());
    }
    if !scene.media.is_empty() {
        out!("media       {}", scene.media.len());
    }
    out!("lights      {} (every emitting triangle is one)", scene.lights.len());
    let (radius, DVec3 { x, y, z }) = (f64::from(scene.radius) * scene.unit, scene.centre);
    if scene.unit == 1.0 {
        out!("radius      {radius:.4}, centre {x:.4} {y:.4} {z:.4}");
    } else {
        out!("radius      {radius:.4e}, centre {x:.4e} {y:.4e} {z:.4e}");
    }
    out!("features    {}", scene.features.names().join(", "));
    out!("backend     {}, tree built in {:.3} s", scene.query.describe(), scene.tree_seconds);
}

fn write_skeleton(args: &InfoArgs, scene: &PreparedScene) -> Result<(), Failure> {
    let start = Instant::now();
    let made = Skeleton::of_scene(scene, args.voxel_resolution.map(|c| c as usize));
    let seconds = start.elapsed().as_secs_f64();
    let ([w, h, d], _) = made.resolution();
    out!(
        "skeleton    {} nodes ({} before filtering), {} edges, {w}x{h}x{d} cells, node map {}, built in {seconds:.3} s",
        made.nodes.len(),
        made.unfiltered,
        made.edges.len(),
        mib(made.map_bytes())
    );
    if let Some(path) = &args.skeleton {
        skeleton::write_lines(path, &made, scene)?;
    }
    if let Some(path) = &args.skeleton_image {
        skeleton::write_image(path, scene, &made)?;
    }
    Ok(())
}
