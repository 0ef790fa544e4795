//! The ray-query backends agree on every scene of the repository: hit or miss, distance, triangle, occlusion.
//!
//! Tolerances: a distance may differ by 1e-4 of itself, another triangle at the same distance is a tie (shared edges,
//! coplanar surfaces), and of all questions at most one in ten thousand may be answered differently (rays that graze a
//! surface or meet a vertex). Packets must answer as single rays do.

use lightsieve::load::{LoadOptions, load_scene};
use lightsieve::prepared::{PrepareOptions, PreparedScene};
use lightsieve::ray::agreement::{Agreement, compare};
use lightsieve::ray::{Backend, Geometry, MeshBuffers, VertexBuffer};
use lightsieve::scene::Diagnostics;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const TOLERATED: f64 = 1e-4;

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .filter_map(|entry| {
            let folder = entry.unwrap().path();
            let file = folder.join(folder.file_name()?).with_extension("xml");
            file.is_file().then_some(file)
        })
        .collect();
    found.sort();
    assert!(found.len() >= 10, "{found:?}");
    found
}

fn prepare(path: &Path) -> PreparedScene {
    let (desc, _) = load_scene(path, &LoadOptions::default()).unwrap();
    let options = PrepareOptions { backend: Backend::default_available(), threads: 2, size: None, crop: None };
    PreparedScene::build(desc, &options, &mut Diagnostics::default()).unwrap()
}

fn expect(what: &str, a: &Agreement) {
    assert!(a.both_hit * 20 > a.rays, "{what}: {a:?}");
    assert!(a.disagreement() <= TOLERATED, "{what}: {a:?}");
    assert_eq!(a.packet, 0, "{what}: {a:?}");
}

#[test]
fn backends_agree_on_every_scene() {
    for path in scenes() {
        let scene = prepare(&path);
        let bounds = scene.geometry.bounds().unwrap();
        let obvhs = Backend::Obvhs.build(scene.geometry.clone(), 2).unwrap();
        expect(&format!("{} obvhs", path.display()), &compare(&*scene.query, &*obvhs, bounds, 20_000, 1));
        // Every triangle for every ray: as many rays as two hundred million tests pay for.
        let rays = (200_000_000 / scene.geometry.triangle_count() as u64 / 3).clamp(100, 20_000);
        let brute = Backend::Brute.build(scene.geometry.clone(), 2).unwrap();
        let a = compare(&*scene.query, &*brute, bounds, rays, 2);
        // With few rays one grazing hit is more than the tolerated share.
        let unexplained = (a.disagreement() * (a.rays + a.segments) as f64).round();
        assert!(unexplained <= 1.0 + TOLERATED * (a.rays + a.segments) as f64, "{} brute: {a:?}", path.display());
    }
}

/// One geometry, scaled and moved as a file might have it and centred as every scene is prepared.
#[test]
fn backends_agree_at_any_scale_and_place() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.xml");
    let scene = prepare(&path);
    for scale in [1e-3f32, 1.0, 1e4] {
        for shift in [0.0f32, 30.0] {
            let meshes = scene.geometry.meshes.iter().map(|m| MeshBuffers {
                positions: VertexBuffer::new(m.positions.iter().map(|&p| (p + shift) * scale).collect()),
                triangles: m.triangles.clone(),
                surface: m.surface,
            });
            let geometry = Arc::new(Geometry {
                meshes: meshes.collect(),
                world: scene.geometry.world.clone(),
                ..Geometry::default()
            });
            let bounds = geometry.bounds().unwrap();
            let query = Backend::default_available().build(geometry.clone(), 2).unwrap();
            for other in [Backend::Obvhs, Backend::Brute] {
                let other = other.build(geometry.clone(), 2).unwrap();
                let a = compare(&*query, &*other, bounds, 20_000, 3);
                let tolerated = if shift == 0.0 { TOLERATED } else { 30.0 * TOLERATED };
                assert!(a.disagreement() <= tolerated, "scale {scale} shift {shift}: {a:?}");
                assert_eq!(a.packet, 0, "{a:?}");
            }
        }
    }
}
