//! Participating media and where they are.

use super::*;

/// A scene of version 0.6.
fn old(inside: &str) -> SceneDesc {
    let (scene, found) = load(&scene(inside).replacen("3.0.0", "0.6.0", 1)).unwrap_or_else(|e| panic!("{inside}: {e}"));
    assert!(found.list.is_empty(), "{inside}: {:?}", found.list[0].message);
    scene
}

/// A cube with a medium inside.
fn cube(medium: &str, plugin: &str) -> String {
    format!("<shape type=\"cube\"><medium type=\"{plugin}\" name=\"interior\">{medium}</medium></shape>")
}

/// Extinction and albedo of the only medium, which are constant.
fn constants(scene: &SceneDesc) -> [Rgb; 2] {
    let [medium] = scene.media.as_slice() else { panic!("{} media", scene.media.len()) };
    let (&VolumeDesc::Constant(sigma_t), &VolumeDesc::Constant(albedo)) = (&medium.sigma_t, &medium.albedo) else {
        panic!("{medium:?}")
    };
    [sigma_t * medium.scale, albedo]
}

fn near(got: [Rgb; 2], want: [[f32; 3]; 2]) {
    for (got, want) in got.into_iter().zip(want) {
        for (i, want) in want.into_iter().enumerate() {
            assert!((got[i] - want).abs() <= 1e-5 * want.abs(), "{got:?} is not {want:?}");
        }
    }
}

#[test]
fn coefficients_are_given_in_any_of_two_ways() {
    let medium = |inside| constants(&good(&cube(inside, "homogeneous")));
    near(medium(""), [[1.0; 3], [0.75; 3]]);
    near(medium("<float name=\"scale\" value=\"3\"/><float name=\"albedo\" value=\"0\"/>"), [[3.0; 3], [0.0; 3]]);
    let both = "<rgb name=\"sigma_t\" value=\"2, 3, 0\"/><rgb name=\"albedo\" value=\"0.1, 0.2, 1\"/>";
    near(medium(both), [[2.0, 3.0, 0.0], [0.1, 0.2, 1.0]]);
    let sigmas = "<rgb name=\"sigma_s\" value=\"1, 3, 0\"/><rgb name=\"sigma_a\" value=\"1, 1, 0\"/>";
    near(medium(sigmas), [[2.0, 4.0, 0.0], [0.5, 0.75, 0.0]]);
    // A spectrum as Mitsuba 3.9.1, scalar_rgb, has it before it is clamped to 1.
    let [sigma_t, _] = medium("<spectrum name=\"sigma_t\" value=\"400:2, 700:3\"/>");
    assert!([2.794_83, 2.475_97, 2.125_86].iter().zip([0, 1, 2]).all(|(v, i)| (sigma_t[i] - v).abs() < 0.01));
    let volume = "<volume name=\"sigma_t\" type=\"constvolume\"><rgb name=\"value\" value=\"1 2 3\"/></volume>";
    near(constants(&good(&cube(volume, "heterogeneous"))), [[1.0, 2.0, 3.0], [0.75; 3]]);
    let shared =
        format!("{}<volume id=\"v\" type=\"constvolume\"/>", cube("<ref name=\"albedo\" id=\"v\"/>", "heterogeneous"));
    near(constants(&good(&shared)), [[1.0; 3], [1.0; 3]]);
}

/// Numbers of Mitsuba 0.6: materials are in 1/cm there for all that its documentation says, and scattering is reduced.
#[test]
fn media_of_version_06_have_their_defaults() {
    let medium = |inside| constants(&old(&cube(inside, "homogeneous")));
    let skin = [[77.2, 105.0, 149.0], [74.0 / 77.2, 88.0 / 105.0, 101.0 / 149.0]];
    near(medium(""), skin);
    near(
        medium("<string name=\"material\" value=\"Skin1\"/><float name=\"scale\" value=\"0.01\"/>"),
        [[0.772, 1.05, 1.49], skin[1]],
    );
    let milk = [1820.52 * 0.25, 2038.26 * 0.286, 2236.98 * 0.319];
    let absorbed = [0.153, 0.46, 1.993];
    let sigma_t: [f32; 3] = std::array::from_fn(|i| milk[i] + absorbed[i]);
    let albedo = std::array::from_fn(|i| milk[i] / sigma_t[i]);
    near(medium("<string name=\"material\" value=\"Regular Milk\"/>"), [sigma_t, albedo]);
    near(
        medium("<spectrum name=\"sigmaT\" value=\"2\"/><spectrum name=\"albedo\" value=\"0.1, 0.2, 0.3\"/>"),
        [[2.0; 3], [0.1, 0.2, 0.3]],
    );
    // One alone is joined by that of the default.
    near(
        medium("<spectrum name=\"sigmaA\" value=\"26\"/>"),
        [[100.0, 114.0, 127.0], [0.74, 88.0 / 114.0, 101.0 / 127.0]],
    );
    let volumes = "<volume name=\"density\" type=\"constvolume\"><float name=\"value\" value=\"3\"/></volume>\
        <volume name=\"albedo\" type=\"constvolume\"><spectrum name=\"value\" value=\"0.9\"/></volume>";
    near(constants(&old(&cube(volumes, "heterogeneous"))), [[3.0; 3], [0.9; 3]]);
    let lacking = load(&scene(&cube("", "heterogeneous")).replacen("3.0.0", "0.6.0", 1)).unwrap_err();
    assert_eq!(messages(Err(lacking)).iter().map(|m| m.0).collect::<Vec<_>>(), ["scene::missing-property"; 2]);
}

#[test]
fn phase_functions_are_read() {
    let phase = |inside: &str| good(&cube(inside, "homogeneous")).media[0].phase.clone();
    let hg = |g| PhaseDesc::HenyeyGreenstein { g };
    assert_eq!(phase(""), PhaseDesc::Isotropic);
    assert_eq!(phase("<phase type=\"isotropic\"/>"), PhaseDesc::Isotropic);
    assert_eq!(phase("<phase type=\"rayleigh\"/>"), PhaseDesc::Rayleigh);
    assert_eq!(phase("<phase type=\"hg\"/>"), hg(0.8));
    assert_eq!(phase("<phase name=\"p\" type=\"hg\"><float name=\"g\" value=\"-0.25\"/></phase>"), hg(-0.25));
    // In the order of the file, whatever their names, as in Mitsuba 3.9.1.
    let blend = "<phase type=\"blendphase\"><float name=\"weight\" value=\"0.3\"/><phase name=\"b\" type=\"hg\"/>\
        <phase name=\"a\" type=\"rayleigh\"/></phase>";
    let phases = Box::new([hg(0.8), PhaseDesc::Rayleigh]);
    assert_eq!(phase(blend), PhaseDesc::Blend { weight: 0.3, phases });
    let shared = format!("<phase type=\"hg\" id=\"p\"/>{}", cube("<ref id=\"p\"/>", "homogeneous"));
    assert_eq!(good(&shared).media[0].phase, hg(0.8));
}

#[test]
fn shapes_lights_and_cameras_name_media() {
    let s = good(
        "<medium type=\"homogeneous\" id=\"fog\"/><medium type=\"homogeneous\" id=\"milk\"/>
        <medium type=\"homogeneous\" id=\"unused\"><float name=\"sigma_t\" value=\"-1\"/></medium>
        <sensor type=\"perspective\"><ref id=\"fog\"/></sensor>
        <emitter type=\"point\"><ref id=\"fog\"/></emitter>
        <shape type=\"sphere\"><emitter type=\"area\"><ref name=\"medium\" id=\"fog\"/></emitter></shape>
        <shape type=\"cube\"><ref name=\"exterior\" id=\"fog\"/><ref name=\"interior\" id=\"milk\"/></shape>
        <shape type=\"cube\"><ref name=\"interior\" id=\"fog\"/></shape>
        <shape type=\"shapegroup\"><shape type=\"cube\"><ref name=\"exterior\" id=\"milk\"/></shape></shape>",
    );
    let (fog, milk) = (Some(MediumId(0)), Some(MediumId(1)));
    assert_eq!((s.media.len(), s.sensors[0].medium, s.sensors[1].medium), (2, None, fog));
    let interfaces: Vec<_> = s.shapes.iter().map(|shape| shape.interface).collect();
    assert_eq!(
        interfaces,
        [
            None,
            None,
            Some(InterfaceDesc { interior: milk, exterior: fog }),
            Some(InterfaceDesc { interior: fog, exterior: None }),
        ]
    );
    let grouped = s.groups[0].shapes[0].interface;
    assert_eq!(grouped, Some(InterfaceDesc { interior: None, exterior: milk }));
}

/// A medium that ends at a shape without material: invisible in Mitsuba 0.6, diffuse in Mitsuba 3.9.1.
#[test]
fn borders_without_a_material_follow_the_version() {
    let xml = cube("", "homogeneous");
    assert_eq!(good(&xml).shapes[1].bsdf, None);
    let s = old(&xml);
    assert!(s.shapes[1].bsdf.is_some_and(|b| matches!(s.bsdfs[b.index()].kind, BsdfKind::Null)));
    let s =
        old("<shape type=\"cube\"><bsdf type=\"diffuse\"/><medium type=\"homogeneous\" name=\"exterior\"/></shape>");
    assert!(s.shapes[1].bsdf.is_some_and(|b| matches!(s.bsdfs[b.index()].kind, BsdfKind::Model(_))));
}

/// Loads a scene beside the file `a.vol` of the samples given, with the box (−1, −2, −3) … (1, 2, 3).
fn with_grid(xml: &str, size: [u32; 3], values: &[f32]) -> Result<(SceneDesc, Diagnostics), LoadFailure> {
    let mut file = b"VOL\x03".to_vec();
    let channels = values.len() as u32 / size.iter().product::<u32>();
    file.extend([1].iter().chain(&size).chain(&[channels]).flat_map(|n: &u32| n.to_le_bytes()));
    file.extend([-1.0f32, -2.0, -3.0, 1.0, 2.0, 3.0].iter().chain(values).flat_map(|v| v.to_le_bytes()));
    let files = Files::new(&[("s.xml", xml)]);
    std::fs::write(files.0.path().join("a.vol"), file).unwrap();
    files.load(&LoadOptions::default())
}

fn grid_volume(name: &str, inside: &str) -> String {
    format!("<volume name=\"{name}\" type=\"gridvolume\"><string name=\"filename\" value=\"a.vol\"/>{inside}</volume>")
}

/// The grid of the extinction of the only medium.
fn only_grid(scene: &SceneDesc) -> &GridDesc {
    match scene.media[0].sigma_t {
        VolumeDesc::Grid(ref grid) => grid,
        VolumeDesc::Constant(value) => panic!("{value:?}"),
    }
}

#[test]
fn grids_are_read_once_and_placed() {
    let to_world = "<transform name=\"to_world\"><translate x=\"5\"/></transform>";
    let two =
        [grid_volume("sigma_t", to_world), grid_volume("albedo", "<string name=\"wrap_mode\" value=\"mirror\"/>")];
    let xml = scene(&cube(&two.concat(), "heterogeneous"));
    let (s, found) = with_grid(&xml, [2, 1, 1], &[0.25, 1.0]).unwrap();
    assert!(found.list.is_empty());
    let VolumeDesc::Grid(albedo) = &s.media[0].albedo else { panic!() };
    let sigma_t = only_grid(&s);
    assert!(std::sync::Arc::ptr_eq(&albedo.grid, &sigma_t.grid));
    assert_eq!(sigma_t.grid.values, GridValues::Float32(vec![0.25, 1.0]));
    assert_eq!((sigma_t.wrap, albedo.wrap), (VolumeWrap::Clamp, VolumeWrap::Mirror));
    assert_eq!((sigma_t.to_world, albedo.to_world), (DMat4::from_translation(DVec3::X * 5.0), DMat4::IDENTITY));
    // The box of the file, only if asked for.
    let inside = format!("<boolean name=\"use_grid_bbox\" value=\"true\"/>{to_world}");
    let xml = scene(&cube(&grid_volume("sigma_t", &inside), "heterogeneous"));
    let (s, _) = with_grid(&xml, [1, 1, 1], &[2.0, 3.0, 4.0]).unwrap();
    assert_eq!(only_grid(&s).grid.channels, 3);
    let corner = |v| only_grid(&s).to_world.transform_point3(v);
    assert_eq!((corner(DVec3::ZERO), corner(DVec3::ONE)), (DVec3::new(4.0, -2.0, -3.0), DVec3::new(6.0, 2.0, 3.0)));
}

/// In Mitsuba 0.6 grids fill the box of their file, with samples in its corners, and there is nothing beyond.
#[test]
fn grids_of_version_06_have_samples_in_their_corners() {
    let load = |inside: &str| {
        let albedo = "<volume name=\"albedo\" type=\"constvolume\"><float name=\"value\" value=\"0.5\"/></volume>";
        let medium = format!("{}{albedo}", grid_volume("density", inside));
        let xml = scene(&cube(&medium, "heterogeneous")).replacen("3.0.0", "0.6.0", 1);
        with_grid(&xml, [2, 3, 5], &[0.5; 30]).unwrap().0
    };
    let place = |s: &SceneDesc, sample: [f64; 3]| {
        let grid = only_grid(s);
        let middle = (DVec3::from_array(sample) + 0.5) / DVec3::from_array(grid.grid.size.map(f64::from));
        assert_eq!(grid.wrap, VolumeWrap::Empty);
        grid.to_world.transform_point3(middle)
    };
    let s = load("");
    assert!(place(&s, [0.0; 3]).distance(DVec3::new(-1.0, -2.0, -3.0)) < 1e-12);
    assert!(place(&s, [1.0, 2.0, 4.0]).distance(DVec3::new(1.0, 2.0, 3.0)) < 1e-12);
    assert!(place(&s, [0.0, 1.0, 1.0]).distance(DVec3::new(-1.0, 0.0, -1.5)) < 1e-12);
    let s = load(
        "<point name=\"min\" x=\"0\" y=\"0\" z=\"0\"/><point name=\"max\" x=\"1\" y=\"1\" z=\"1\"/>\
        <transform name=\"toWorld\"><scale value=\"2\"/></transform>",
    );
    assert!(place(&s, [1.0, 1.0, 0.0]).distance(DVec3::new(2.0, 1.0, 0.0)) < 1e-12);
}

#[test]
fn grids_with_mistakes_are_refused() {
    let codes = |name: &str, values: &[f32], inside: &str| {
        let xml = scene(&cube(&grid_volume(name, inside), "heterogeneous"));
        messages(with_grid(&xml, [2, 1, 1], values)).iter().map(|m| m.0).collect::<Vec<_>>()
    };
    assert!(codes("sigma_t", &[0.0, 7.0], "").is_empty());
    assert_eq!(codes("albedo", &[0.5, 1.5], ""), ["load::volume"]);
    assert_eq!(codes("sigma_t", &[0.5, -1.5], ""), ["load::volume"]);
    assert_eq!(codes("sigma_t", &[0.5, f32::NAN], ""), ["load::volume"]);
    assert_eq!(codes("sigma_t", &[0.5; 12], ""), ["scene::unsupported"]);
    assert_eq!(codes("sigma_t", &[0.5; 4], ""), ["load::volume"]);
    assert!(codes("sigma_s", &[0.5; 2], "").contains(&"scene::unsupported"));
    let flat = "<transform name=\"to_world\"><scale x=\"0\"/></transform>";
    assert_eq!(codes("sigma_t", &[0.5; 2], flat), ["scene::bad-transform"]);
    let missing = cube(&grid_volume("sigma_t", "").replace("a.vol", "b.vol"), "heterogeneous");
    assert_eq!(messages(with_grid(&scene(&missing), [1; 3], &[1.0])), [("load::volume", 2, 137)]);
    let huge = cube(&format!("{}<float name=\"scale\" value=\"1e38\"/>", grid_volume("sigma_t", "")), "heterogeneous");
    assert_eq!(messages(with_grid(&scene(&huge), [1; 3], &[7.0]))[0].0, "scene::bad-value");
}

#[test]
fn open_boundaries_are_warned_of() {
    let side = |transform: &str| {
        format!(
            "<shape type=\"rectangle\"><transform name=\"to_world\"><translate z=\"1\"/>{transform}</transform>\
             <ref name=\"interior\" id=\"fog\"/></shape>"
        )
    };
    let fog = "<medium type=\"homogeneous\" id=\"fog\"/>";
    let turns = [
        "",
        "<rotate x=\"1\" angle=\"90\"/>",
        "<rotate x=\"1\" angle=\"180\"/>",
        "<rotate x=\"1\" angle=\"270\"/>",
        "<rotate y=\"1\" angle=\"90\"/>",
        "<rotate y=\"1\" angle=\"270\"/>",
    ];
    let sides: Vec<String> = turns.map(side).into();
    good(&format!("{fog}{}", sides.concat()));
    good(&format!("{fog}<shape type=\"sphere\"><ref name=\"exterior\" id=\"fog\"/></shape>"));
    // A surface with one medium on both sides is no boundary of it.
    good(&format!(
        "{fog}<shape type=\"rectangle\"><ref name=\"interior\" id=\"fog\"/><ref name=\"exterior\" id=\"fog\"/></shape>"
    ));
    for open in [sides[..5].concat(), "<shape type=\"cylinder\"><ref name=\"interior\" id=\"fog\"/></shape>".into()] {
        let found = messages(load(&scene(&format!("{fog}{open}"))));
        assert_eq!(found.iter().map(|m| m.0).collect::<Vec<_>>(), ["scene::open-boundary"], "{open}");
    }
    // A group counts once, however often it is placed.
    let tube = "<shape type=\"cylinder\"><ref name=\"interior\" id=\"fog\"/></shape>";
    let group = format!("<shape type=\"shapegroup\" id=\"group\">{tube}</shape>");
    let instance = "<shape type=\"instance\"><ref id=\"group\"/></shape>".repeat(3);
    let (_, found) = load(&scene(&format!("{fog}{group}{instance}"))).unwrap();
    assert!(found.list.len() == 1 && found.list[0].message.contains("2 of its edges"), "{:?}", found.list);
}
