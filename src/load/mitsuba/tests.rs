use crate::load::{LoadFailure, LoadOptions, load_scene};
use crate::math::Rgb;
use crate::scene::*;
use glam::{DMat4, DVec3};
use proptest::prelude::*;

/// A folder with some files; the scene is `s.xml`.
struct Files(tempfile::TempDir);

impl Files {
    fn new(files: &[(&str, &str)]) -> Files {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
        Files(folder)
    }

    fn load(&self, options: &LoadOptions) -> Result<(SceneDesc, Diagnostics), LoadFailure> {
        load_scene(&self.0.path().join("s.xml"), options)
    }
}

fn load(xml: &str) -> Result<(SceneDesc, Diagnostics), LoadFailure> {
    Files::new(&[("s.xml", xml)]).load(&LoadOptions::default())
}

/// Everything a scene needs, on one line so that `inside` begins in line 2.
fn scene(inside: &str) -> String {
    format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"cube\"/><emitter type=\"constant\"/>\n{inside}\n</scene>"
    )
}

fn good(inside: &str) -> SceneDesc {
    let (scene, found) = load(&scene(inside)).unwrap_or_else(|e| panic!("{inside}: {e}"));
    assert!(found.list.is_empty(), "{inside}: {:?}", found.list[0].message);
    scene
}

/// Codes with line and column of all messages.
fn messages(result: Result<(SceneDesc, Diagnostics), LoadFailure>) -> Vec<(&'static str, usize, usize)> {
    let found = result.map_or_else(|e| e.diagnostics, |ok| ok.1);
    let place = |d: &Diagnostic| d.span.as_ref().map_or((0, 0), Span::line_column);
    found.list.iter().map(|d| (d.code, place(d).0, place(d).1)).collect()
}

fn bsdf(scene: &SceneDesc, name: &str) -> BsdfKind {
    scene.bsdfs.iter().find(|b| b.name.as_deref() == Some(name)).expect(name).kind.clone()
}

/// Mistakes, `¦` before each place that must be reported, and the codes in the order of the messages.
#[rustfmt::skip]
const MISTAKES: &[(&str, &[&str])] = &[
    (r#"<bsdf type="¦difuse"/>"#, &["scene::unknown-plugin"]),
    (r#"<shape type="¦spere"/>"#, &["scene::unknown-plugin"]),
    (r#"<emitter type="¦sunny"/>"#, &["scene::unknown-plugin"]),
    (r#"<sensor type="¦fisheye"/>"#, &["scene::unknown-plugin"]),
    (r#"<bsdf type="diffuse"><texture name="reflectance" type="¦wood"/></bsdf>"#, &["scene::unknown-plugin"]),
    (r#"¦<bdsf type="diffuse"/>"#, &["scene::unknown-element"]),
    (r#"¦<bsdf/>"#, &["scene::missing-attribute"]),
    (r#"¦<float name="x" value="1"/>"#, &["scene::misplaced-element"]),
    (r#"<bsdf type="diffuse">
  <rgb name="¦reflectence" value="1"/></bsdf>"#, &["scene::unknown-property"]),
    (r#"<bsdf type="diffuse">¦<rgb name="reflectance" valeu="¦1"/></bsdf>"#, &["scene::unknown-attribute", "scene::missing-attribute"]),
    (r#"<bsdf type="plastic">¦<string name="nonlinear" value="1"/></bsdf>"#, &["scene::wrong-type"]),
    (r#"<bsdf type="diffuse">¦<string name="reflectance" value="1"/></bsdf>"#, &["scene::wrong-type"]),
    (r#"<bsdf type="diffuse"><rgb name="reflectance" value="¦0.1, x, 0"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="diffuse"><rgb name="reflectance" value="¦1 2"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="diffuse"><rgb name="reflectance" value="¦1.5 0.2 0.3"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="plastic"><rgb name="specular_reflectance" value="¦0.5 0.2 -0.3"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="diffuse"><float name="reflectance" value="¦-1"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="diffuse"><float name="reflectance" value="¦1.5"/></bsdf>"#, &["scene::bright-reflectance"]),
    (r#"<bsdf type="diffuse"><rgb name="reflectance" value="¦inf"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="diffuse"><rgb name="reflectance" value="1"/><rgb name="¦reflectance" value="1"/></bsdf>"#, &["scene::duplicate-property"]),
    (r#"<bsdf type="dielectric"><string name="int_ior" value="¦diamnd"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="conductor"><string name="material" value="¦Goldd"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="roughconductor"><string name="distribution" value="¦gxg"/></bsdf>"#, &["scene::bad-value"]),
    (r#"¦<bsdf type="twosided"/>"#, &["scene::nested-bsdf"]),
    (r#"¦<bsdf type="blendbsdf"><bsdf type="diffuse"/></bsdf>"#, &["scene::nested-bsdf"]),
    (r#"¦<bsdf type="mixturebsdf"><bsdf type="diffuse"/></bsdf>"#, &["scene::missing-property"]),
    (r#"<bsdf type="mixturebsdf"><string name="weights" value="¦0.5 0.2"/><bsdf type="diffuse"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="mixturebsdf"><string name="weights" value="¦-0.5"/><bsdf type="diffuse"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<bsdf type="mixturebsdf"><string name="weights" value="¦half"/><bsdf type="diffuse"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><ref id="¦wal"/></shape><bsdf type="diffuse" id="wall"/>"#, &["scene::undefined-reference"]),
    (r#"<bsdf type="diffuse" id="a"/>
<bsdf type="diffuse" id="¦a"/>"#, &["scene::duplicate-id"]),
    (r#"<alias id="¦b" as="c"/>"#, &["scene::undefined-reference"]),
    (r#"<bsdf type="twosided" id="a"><ref id="b"/></bsdf>
<bsdf type="twosided" id="b">¦<ref id="a"/></bsdf>"#, &["scene::circular-reference"]),
    (r#"<shape type="cube">¦<ref id="t"/></shape><texture type="checkerboard" id="t"/>"#, &["scene::misplaced-element"]),
    (r#"<shape type="cube"><transform name="to_world">¦<rotate angle="9"/></transform></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><transform name="to_world"><matrix value="¦1 2"/></transform></shape>"#, &["scene::bad-value"]),
    (r#"¦<shape type="cube"><transform name="to_world"><scale value="0"/></transform></shape>"#, &["scene::bad-transform"]),
    (r#"<shape type="sphere"><float name="radius" value="¦-1"/></shape>"#, &["scene::bad-value"]),
    (r#"¦<shape type="ply"/>"#, &["scene::missing-property"]),
    (r#"<shape type="ply"><string name="filename" value="¦no.ply"/></shape>"#, &["load::mesh"]),
    (r#"<shape type="cube"><emitter type="¦point"/></shape>"#, &["scene::misplaced-element"]),
    (r#"¦<emitter type="area"/>"#, &["scene::misplaced-element"]),
    (r#"<emitter type="envmap"><string name="filename" value="¦no.exr"/></emitter>"#, &["load::image"]),
    (r#"<sensor type="perspective">¦<film type="hdrfilm"><integer name="width" value="0"/></film></sensor>"#, &["scene::empty-film"]),
    (r#"<sensor type="perspective">¦<film type="hdrfilm"><integer name="crop_width" value="900"/></film></sensor>"#, &["scene::crop-outside"]),
    (r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="¦-3"/></film></sensor>"#, &["scene::bad-value"]),
    (r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="¦3.5"/></film></sensor>"#, &["scene::bad-value"]),
    (r#"<sensor type="perspective"><float name="fov" value="¦180"/></sensor>"#, &["scene::bad-value"]),
    (r#"<sensor type="perspective"><film type="hdrfilm"><rfilter type="¦lanczos"/></film></sensor>"#, &["scene::replaced-plugin"]),
    (r#"<shape type="cube">¦<medium type="homogeneous"/></shape>"#, &["scene::misplaced-element"]),
    (r#"<shape type="cube">¦<medium type="homogeneous" name="inside"/></shape>"#, &["scene::misplaced-element"]),
    (r#"<shape type="cube">¦<bsdf type="diffuse" name="interior"/></shape>"#, &["scene::wrong-type"]),
    (r#"<shape type="cube"><medium type="¦homogenous" name="interior"/></shape>"#, &["scene::unknown-plugin"]),
    (r#"<shape type="cube"><ref name="interior" id="¦fgo"/></shape><medium type="homogeneous" id="fog"/>"#, &["scene::undefined-reference"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="interior"><rgb name="albedo" value="¦0.2, 1.01, 1"/></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="exterior"><float name="sigma_t" value="¦-1"/></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="exterior"><float name="sigma_t" value="¦1e39"/></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="exterior"><float name="scale" value="¦-1"/></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="exterior"><float name="sigma_t" value="1e30"/><float name="scale" value="¦1e30"/></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube">¦<medium type="homogeneous" name="interior"><float name="sigma_t" value="1"/><float name="sigma_s" value="1"/><float name="sigma_a" value="1"/></medium></shape>"#, &["scene::duplicate-property"]),
    (r#"<shape type="cube">¦<medium type="homogeneous" name="interior"><float name="sigma_s" value="1"/></medium></shape>"#, &["scene::missing-property"]),
    (r#"<shape type="cube">¦<medium type="homogeneous" name="interior"><float name="sigma_s" value="3e38"/><float name="sigma_a" value="3e38"/></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="interior"><string name="material" value="¦skimmilc"/></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube">¦<medium type="homogeneous" name="interior"><phase type="hg"/><phase type="hg"/></medium></shape>"#, &["scene::nested-phase"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="interior"><phase type="hg"><float name="g" value="¦-1"/></phase></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="interior"><phase type="¦gh"/></medium></shape>"#, &["scene::unknown-plugin"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="interior">¦<phase type="blendphase"><phase type="hg"/></phase></medium></shape>"#, &["scene::nested-phase"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="interior"><phase type="blendphase"><float name="weight" value="¦1.5"/><phase type="hg"/><phase type="hg"/></phase></medium></shape>"#, &["scene::bad-value"]),
    (r#"<shape type="cube"><medium type="homogeneous" name="interior">¦<phase type="blendphase"><phase type="hg"/><phase type="blendphase"><phase type="hg"/><phase type="hg"/></phase></phase></medium></shape>"#, &["scene::unsupported"]),
    (r#"<phase type="blendphase" id="a"><phase type="hg"/>¦<ref id="a"/></phase><shape type="cube"><medium type="homogeneous" name="interior"><ref id="a"/></medium></shape>"#, &["scene::circular-reference"]),
    (r#"<shape type="cube"><emitter type="area"><ref id="¦fog"/></emitter></shape>"#, &["scene::undefined-reference"]),
    (r#"<shape type="cube"><bsdf type="¦roughcoating"/></shape>"#, &["scene::unsupported"]),
    (r#"<shape type="instance">¦<ref id="g"/></shape><shape type="cube" id="g"/>"#, &["scene::wrong-type"]),
    (r#"<shape type="shapegroup"><shape type="cube">¦<emitter type="area"/></shape></shape>"#, &["scene::instanced-emitter"]),
    (r#"<bsdf type="diffuse"><spectrum name="reflectance" value="¦500:1, 400:1"/></bsdf>"#, &["scene::bad-value"]),
    (r#"<include filename="¦no.xml"/>"#, &["load::io"]),
    (r#"<include filename="¦s.xml"/>"#, &["scene::circular-include"]),
    (r#"¦<float name="a" value="¦$spp"/>"#, &["scene::undefined-parameter", "scene::misplaced-element"]),
];

#[test]
fn every_mistake_has_its_code_line_and_column() {
    for (marked, codes) in MISTAKES {
        let (mut plain, mut places, mut line, mut column) = (String::new(), Vec::new(), 2, 1);
        for c in marked.chars() {
            match c {
                '¦' => places.push((line, column)),
                '\n' => (line, column) = (line + 1, 1),
                _ => column += 1,
            }
            if c != '¦' {
                plain.push(c);
            }
        }
        let got = messages(load(&scene(&plain)));
        let mut got_places: Vec<_> = got.iter().map(|m| (m.1, m.2)).collect();
        got_places.sort_unstable();
        assert_eq!(got.iter().map(|m| m.0).collect::<Vec<_>>(), *codes, "{marked}");
        assert_eq!(got_places, places, "{marked}");
    }
}

#[test]
fn syntax_errors_have_their_place() {
    for (xml, want) in [
        ("<scene version=\"3.0.0\">\n  <bsdf type=\"diffuse\">\n</scene>", ("scene::syntax", 3, 1)),
        ("<scene version=\"3.0.0\">\n  <bsdf type=diffuse/></scene>", ("scene::syntax", 2, 14)),
        ("", ("scene::syntax", 1, 1)),
        ("<scene version=\"three\"/>", ("scene::bad-value", 1, 17)),
    ] {
        assert_eq!(messages(load(xml)).first(), Some(&want), "{xml}");
    }
    let deep = "<bsdf>".repeat(100_000);
    let found = messages(load(&format!("<scene version=\"3.0.0\">{deep}")));
    assert_eq!(found[0].0, "scene::syntax");
    let none = load_scene(std::path::Path::new("none.xml"), &LoadOptions::default()).unwrap_err();
    assert!(none.io);
    assert_eq!(
        load_scene(std::path::Path::new("a.blend"), &LoadOptions::default()).unwrap_err().diagnostics.list[0].code,
        "load::unknown-format"
    );
}

#[test]
fn whole_scenes_are_checked() {
    let codes = |xml: &str| messages(load(xml)).into_iter().map(|m| m.0).collect::<Vec<_>>();
    assert_eq!(codes("<scene version=\"3.0.0\"/>"), ["scene::no-sensor", "scene::empty", "scene::no-emitter"]);
    assert_eq!(
        codes("<scene><sensor type=\"perspective\"/><shape type=\"cube\"><emitter type=\"area\"/></shape></scene>"),
        ["scene::no-version"]
    );
}

#[test]
fn the_nearest_known_name_is_shown() {
    for (inside, label) in [
        ("<bsdf type=\"difuse\"/>", "`diffuse`"),
        ("<bsdf type=\"diffuse\"><rgb name=\"reflectence\" value=\"1\"/></bsdf>", "`reflectance`"),
        ("<shape type=\"cube\"><ref id=\"wal\"/></shape><bsdf type=\"diffuse\" id=\"wall\"/>", "`wall`"),
        ("<bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"diamnd\"/></bsdf>", "`diamond`"),
        ("<bdsf type=\"diffuse\"/>", "<bsdf>"),
    ] {
        let found = load(&scene(inside)).map_or_else(|e| e.diagnostics, |ok| ok.1);
        let shown = found.list[0].label.as_deref().unwrap_or("");
        assert!(shown.contains(label), "{inside}: {shown}");
    }
}

#[test]
fn errors_stop_at_twenty() {
    let e = load(&scene(&"<bsdf type=\"x\"/>\n".repeat(50))).unwrap_err();
    assert_eq!(e.diagnostics.count(Severity::Error), 20);
    assert!(e.to_string().contains("(and 19 more)"), "{e}");
}

#[test]
fn definitions_replace_defaults() {
    let xml = "<scene version=\"3.0.0\"><default name=\"w\" value=\"12\"/><sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"$w\"/>\
        <integer name=\"height\" value=\"${h}\"/></film></sensor><shape type=\"cube\"/><emitter type=\"constant\"/></scene>"
        .replace("${h}", "$h");
    let define = |d: &[(&str, &str)]| LoadOptions {
        definitions: d.iter().map(|(k, v)| ((*k).into(), (*v).into())).collect(),
        ..LoadOptions::default()
    };
    let files = Files::new(&[("s.xml", &xml)]);
    let (scene, found) = files.load(&define(&[("h", "7"), ("u", "1")])).unwrap();
    assert_eq!((scene.sensors[0].film.width, scene.sensors[0].film.height), (12, 7));
    assert_eq!(messages(Ok((scene, found))), [("scene::unused-definition", 0, 0)]);
    let (scene, _) = files.load(&define(&[("h", "7"), ("w", "30")])).unwrap();
    assert_eq!(scene.sensors[0].film.width, 30);
}

#[test]
fn includes_are_put_in_place_and_keep_their_own_spans() {
    let files = Files::new(&[
        ("s.xml", &scene("<include filename=\"more.xml\"/><shape type=\"cube\"><ref id=\"m\"/></shape>")),
        (
            "more.xml",
            "<scene version=\"0.6.0\">\n<bsdf type=\"plastic\" id=\"m\"><rgb name=\"diffuseReflectance\" value=\"0.1\"/>\n<float name=\"bogus\" value=\"1\"/></bsdf></scene>",
        ),
    ]);
    let (scene, found) = files.load(&LoadOptions::default()).unwrap();
    assert!(
        matches!(bsdf(&scene, "m"), BsdfKind::Model(BsdfModel::Plastic(PlasticParams { diffuse_reflectance: ColorDesc::Constant(c), .. })) if c == Rgb::grey(0.1))
    );
    let span = found.list[0].span.as_ref().unwrap();
    assert!(span.source.path.ends_with("more.xml"));
    assert_eq!(messages(Ok((scene, found))), [("scene::unknown-property", 3, 14)]);
}

#[test]
fn references_may_come_first_be_nested_and_aliased() {
    let s = good(
        "<shape type=\"cube\" id=\"c\"><ref id=\"other\"/></shape><bsdf type=\"mask\" id=\"m\"><float name=\"opacity\" value=\"0.25\"/><ref id=\"d\"/></bsdf>\
         <bsdf type=\"diffuse\" id=\"d\"><ref name=\"reflectance\" id=\"t\"/></bsdf><texture type=\"checkerboard\" id=\"t\"/><alias id=\"m\" as=\"other\"/>",
    );
    let shape = s.shapes.iter().find(|s| s.name.as_deref() == Some("c")).unwrap();
    let BsdfKind::Mask { nested, opacity: ScalarDesc::Constant(0.25) } = s.bsdfs[shape.bsdf.unwrap().index()].kind
    else {
        panic!()
    };
    assert_eq!(s.bsdfs[nested.index()].name.as_deref(), Some("d"));
    assert_eq!((s.bsdfs.len(), s.textures.len()), (2, 1));
}

#[test]
fn old_spellings_are_renamed() {
    let xml = "<scene version=\"0.6.0\"><sensor type=\"thinlens\"><float name=\"fov\" value=\"30\"/><string name=\"fovAxis\" value=\"y\"/><float name=\"apertureRadius\" value=\"0.1\"/>\
        <float name=\"focusDistance\" value=\"5\"/><transform name=\"toWorld\"><lookAt origin=\"1,2,3\" target=\"4,0,-1\" up=\"0.1,1,0.2\"/></transform>\
        <sampler type=\"independent\"><integer name=\"sampleCount\" value=\"16\"/></sampler></sensor><emitter type=\"constant\"/>\
        <shape type=\"sphere\"><boolean name=\"flipNormals\" value=\"true\"/><bsdf type=\"roughdielectric\" id=\"b\"><float name=\"intIOR\" value=\"1.5\"/><float name=\"extIOR\" value=\"1\"/>\
        <float name=\"alphaU\" value=\"0.2\"/><float name=\"alphaV\" value=\"0.3\"/></bsdf></shape>\
        <bsdf type=\"diffuse\" id=\"d\"><texture name=\"diffuseReflectance\" type=\"checkerboard\"><float name=\"uscale\" value=\"2\"/><float name=\"uoffset\" value=\"0.25\"/></texture></bsdf></scene>";
    let (s, found) = load(xml).unwrap();
    assert!(found.list.is_empty(), "{:?}", found.list);
    let sensor = &s.sensors[0];
    assert_eq!(
        (sensor.fov, sensor.fov_axis, sensor.aperture_radius, sensor.focus_distance, sensor.sample_count),
        (30.0, FovAxis::Y, 0.1, 5.0, Some(16))
    );
    assert!(s.shapes[0].flip_normals);
    let BsdfKind::Model(BsdfModel::RoughDielectric(RoughDielectricParams { roughness, eta: 1.5, .. })) = bsdf(&s, "b")
    else {
        panic!()
    };
    assert_eq!((roughness.alpha_u, roughness.alpha_v), (ScalarDesc::Constant(0.2), ScalarDesc::Constant(0.3)));
    // Mitsuba 3.9.1: the offset counts before the scale.
    assert!(matches!(s.textures[0], TextureDesc::Checkerboard { to_uv: [[2.0, 0.0, 0.5], [0.0, 1.0, 0.0]], .. }));
}

fn to_world(steps: &str) -> DMat4 {
    good(&format!("<shape type=\"cube\" id=\"x\"><transform name=\"to_world\">{steps}</transform></shape>")).shapes[1]
        .to_world
}

/// Rows of the upper three lines by Mitsuba 3.9.1, scalar_rgb.
#[test]
fn transforms_are_mitsubas() {
    let near = |m: DMat4, rows: [[f64; 4]; 3]| {
        for (i, row) in rows.iter().enumerate() {
            assert!((m.row(i) - glam::DVec4::from(*row)).length() < 2e-6, "{m} {rows:?}");
        }
    };
    let look = [
        [-0.731_804_07, 0.392_578_63, 0.557_085_99, 1.0],
        [0.203_278_91, 0.905_950_67, -0.371_390_67, 2.0],
        [-0.650_492_49, -0.158_541_37, -0.742_781_34, 3.0],
    ];
    near(to_world("<lookat origin=\"1 2 3\" target=\"4,0,-1\" up=\"0.1,1,0.2\"/>"), look);
    let free = [
        [0.118_716_3, 0.821_925_58, 0.557_085_99, 1.0],
        [0.920_855_82, 0.118_716_3, -0.371_390_67, 2.0],
        [-0.371_390_67, 0.557_085_99, -0.742_781_34, 3.0],
    ];
    near(to_world("<lookat origin=\"1 2 3\" target=\"4,0,-1\"/>"), free);
    let (c, s) = (0.766_044_44, 0.642_787_61);
    near(to_world("<rotate x=\"1\" angle=\"40\"/>"), [[1.0, 0.0, 0.0, 0.0], [0.0, c, -s, 0.0], [0.0, s, c, 0.0]]);
    near(
        to_world("<scale value=\"2\"/><scale x=\"3\"/><translate value=\"1 2 3\"/>"),
        [[6.0, 0.0, 0.0, 1.0], [0.0, 2.0, 0.0, 2.0], [0.0, 0.0, 2.0, 3.0]],
    );
    near(
        to_world("<translate x=\"1\" z=\"5\"/><scale value=\"1, 2, 3\"/>"),
        [[1.0, 0.0, 0.0, 1.0], [0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 3.0, 15.0]],
    );
    near(
        to_world("<matrix value=\"1 2 0 0 1 0 0 0 1\"/>"),
        [[1.0, 2.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
    );
    near(
        to_world("<matrix value=\"1 2 0 7 0 1 0 8 0 0 1 9 0 0 0 1\"/>"),
        [[1.0, 2.0, 0.0, 7.0], [0.0, 1.0, 0.0, 8.0], [0.0, 0.0, 1.0, 9.0]],
    );
}

/// Mitsuba 3.9.1, scalar_rgb: `x_fov` of cameras with a film of 768 x 576.
#[test]
fn fields_of_view_are_mitsubas() {
    for (inside, x_fov) in [
        ("", 38.184_841),
        ("<string name=\"focal_length\" value=\"35mm\"/>", 52.622_543),
        ("<float name=\"fov\" value=\"40\"/><string name=\"fov_axis\" value=\"diagonal\"/>", 32.468_605),
    ] {
        let s = good(&format!("<sensor type=\"perspective\" id=\"s\">{inside}</sensor>"));
        let sensor = s.sensors.last().unwrap();
        assert_eq!(sensor.fov_axis, FovAxis::Diagonal);
        let diagonal = (768f64.powi(2) + 576f64.powi(2)).sqrt();
        let got = 2.0 * ((sensor.fov / 2.0).to_radians().tan() * 768.0 / diagonal).atan().to_degrees();
        assert!((got - x_fov).abs() < 1e-4, "{inside}: {got}");
    }
}

/// Mitsuba 3.9.1, scalar_rgb: uv of hits on cylinders with `p0`, `p1` and `radius`.
#[test]
fn cylinders_lie_where_mitsubas_do() {
    for (p0, p1, p, uv) in [
        ([0., 0., 0.], [0., 2., 0.], [0.458_258, 0.5, 0.2], [0.934_505, 0.25]),
        ([1., 0., 0.], [3., 2., 1.], [2.694_29, 1.0, 0.573_057], [0.905_349, 0.662_404]),
    ] {
        let point =
            |name: &str, p: [f64; 3]| format!("<point name=\"{name}\" x=\"{}\" y=\"{}\" z=\"{}\"/>", p[0], p[1], p[2]);
        let s = good(&format!(
            "<shape type=\"cylinder\">{}{}<float name=\"radius\" value=\"0.5\"/></shape>",
            point("p0", p0),
            point("p1", p1)
        ));
        let q = s.shapes[1].to_world.inverse().transform_point3(DVec3::from(p));
        let u = (q.y.atan2(q.x) / std::f64::consts::TAU).rem_euclid(1.0);
        assert!(
            (u - uv[0]).abs() < 1e-5 && (q.z - uv[1]).abs() < 1e-5 && (q.truncate().length() - 1.0).abs() < 1e-5,
            "{q}"
        );
    }
}

#[test]
fn every_material_is_read() {
    let s = good(
        "<bsdf type=\"diffuse\" id=\"diffuse\"/><bsdf type=\"dielectric\" id=\"dielectric\"/><bsdf type=\"thindielectric\" id=\"thin\"/>\
         <bsdf type=\"conductor\" id=\"mirror\"/><bsdf type=\"conductor\" id=\"au\"><string name=\"material\" value=\"Au\"/></bsdf>\
         <bsdf type=\"roughconductor\" id=\"rc\"><float name=\"alpha\" value=\"0.3\"/><string name=\"distribution\" value=\"ggx\"/><rgb name=\"eta\" value=\"1,2,3\"/></bsdf>\
         <bsdf type=\"plastic\" id=\"plastic\"><boolean name=\"nonlinear\" value=\"true\"/></bsdf>\
         <bsdf type=\"roughplastic\" id=\"rp\"><string name=\"int_ior\" value=\"water\"/><string name=\"ext_ior\" value=\"vacuum\"/></bsdf>\
         <bsdf type=\"principled\" id=\"principled\"/><bsdf type=\"phong\" id=\"phong\"/><bsdf type=\"ward\" id=\"ward\"/><bsdf type=\"null\" id=\"null\"/>\
         <bsdf type=\"twosided\" id=\"two\"><bsdf type=\"diffuse\"/><bsdf type=\"null\"/></bsdf>\
         <bsdf type=\"blendbsdf\" id=\"blend\"><float name=\"weight\" value=\"0.25\"/><ref id=\"diffuse\"/><ref id=\"null\"/></bsdf>\
         <bsdf type=\"bumpmap\" id=\"bump\"><texture type=\"checkerboard\"/><ref id=\"diffuse\"/><float name=\"scale\" value=\"2\"/></bsdf>\
         <bsdf type=\"normalmap\" id=\"normal\"><texture name=\"normalmap\" type=\"checkerboard\"/><ref id=\"diffuse\"/></bsdf>",
    );
    let grey = |v| ColorDesc::Constant(Rgb::grey(v));
    assert!(
        matches!(bsdf(&s, "diffuse"), BsdfKind::Model(BsdfModel::Diffuse(DiffuseParams { reflectance })) if reflectance == grey(0.5))
    );
    // Mitsuba 3.9.1: bk7 in air.
    assert!(
        matches!(bsdf(&s, "dielectric"), BsdfKind::Model(BsdfModel::Dielectric(DielectricParams { eta, .. })) if (eta - 1.504_183_3).abs() < 1e-6)
    );
    assert!(
        matches!(bsdf(&s, "thin"), BsdfKind::Model(BsdfModel::ThinDielectric(ThinDielectricParams { eta, .. })) if (eta - 1.504_183_3).abs() < 1e-6)
    );
    assert!(
        matches!(bsdf(&s, "mirror"), BsdfKind::Model(BsdfModel::Conductor(ConductorParams { ior: ComplexIor { eta, k }, .. })) if eta == grey(0.0) && k == grey(1.0))
    );
    assert!(
        matches!(bsdf(&s, "au"), BsdfKind::Model(BsdfModel::Conductor(ConductorParams { ior: ComplexIor { eta: ColorDesc::Constant(e), .. }, .. })) if (e.g - 0.375_307).abs() < 1e-6)
    );
    let BsdfKind::Model(BsdfModel::RoughConductor(RoughConductorParams {
        roughness,
        ior: ComplexIor { eta: ColorDesc::Constant(eta), k },
        ..
    })) = bsdf(&s, "rc")
    else {
        panic!()
    };
    assert_eq!(
        (roughness.distribution, roughness.alpha_v, eta, k),
        (Distribution::Ggx, ScalarDesc::Constant(0.3), Rgb::new(1.0, 2.0, 3.0), grey(1.0))
    );
    assert!(
        matches!(bsdf(&s, "plastic"), BsdfKind::Model(BsdfModel::Plastic(PlasticParams { eta, nonlinear: true, .. })) if (eta - 1.489_587_3).abs() < 1e-6)
    );
    assert!(matches!(
        bsdf(&s, "rp"),
        BsdfKind::Model(BsdfModel::RoughPlastic(RoughPlasticParams { eta: 1.333, nonlinear: false, .. }))
    ));
    assert!(
        matches!(bsdf(&s, "principled"), BsdfKind::Model(BsdfModel::Principled(p)) if (p.eta - 1.5).abs() < 1e-6 && p.roughness == ScalarDesc::Constant(0.5))
    );
    assert!(matches!(
        bsdf(&s, "phong"),
        BsdfKind::Model(BsdfModel::Phong(PhongParams { exponent: ScalarDesc::Constant(30.0), .. }))
    ));
    assert!(matches!(
        bsdf(&s, "ward"),
        BsdfKind::Model(BsdfModel::Ward(WardParams { variant: WardVariant::Balanced, .. }))
    ));
    assert!(matches!(bsdf(&s, "two"), BsdfKind::TwoSided { front, back } if front != back));
    assert!(matches!(bsdf(&s, "blend"), BsdfKind::Blend { weight: ScalarDesc::Constant(0.25), a, b } if a != b));
    assert!(matches!(bsdf(&s, "bump"), BsdfKind::BumpMap { scale: 2.0, .. }));
    assert!(matches!(bsdf(&s, "normal"), BsdfKind::NormalMap { .. }));
}

#[test]
fn every_model_of_the_table_is_a_plugin() {
    for model in MODELS {
        let s = good(&format!("<bsdf type=\"{}\" id=\"m\"/>", model.name));
        assert!(matches!(bsdf(&s, "m"), BsdfKind::Model(found) if found.name() == model.name), "{}", model.name);
    }
}

#[test]
fn lights_cameras_and_filters() {
    let s = good(
        "<integrator type=\"bdpt\"><integer name=\"max_depth\" value=\"7\"/></integrator>\
         <emitter type=\"point\"><point name=\"position\" value=\"1 2 3\"/><rgb name=\"intensity\" value=\"4\"/></emitter>\
         <emitter type=\"spot\"><float name=\"cutoff_angle\" value=\"40\"/></emitter>\
         <emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"0\" z=\"-2\"/></emitter>\
         <emitter type=\"sunsky\"><vector name=\"sun_direction\" value=\"0 1 1\"/><float name=\"sun_scale\" value=\"2\"/></emitter><emitter type=\"sky\"/>\
         <shape type=\"rectangle\"><emitter type=\"area\"><spectrum name=\"radiance\" value=\"3\"/></emitter></shape>\
         <sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"10\"/><integer name=\"height\" value=\"8\"/><integer name=\"crop_offset_x\" value=\"2\"/>\
         <integer name=\"crop_width\" value=\"5\"/><rfilter type=\"catmullrom\"/></film></sensor>",
    );
    let integrator = s.integrator.as_ref().unwrap();
    assert_eq!(
        (integrator.name.as_str(), integrator.params[0].0.as_str(), integrator.params[0].1.as_str()),
        ("bdpt", "max_depth", "7")
    );
    assert!(
        matches!(s.emitters[1].kind, EmitterKind::Point { position, intensity } if position == DVec3::new(1.0, 2.0, 3.0) && intensity == Rgb::grey(4.0))
    );
    assert!(matches!(s.emitters[2].kind, EmitterKind::Spot { cutoff_angle: 40.0, beam_width: 30.0, .. }));
    assert!(matches!(s.emitters[3].kind, EmitterKind::Directional { direction, .. } if direction == DVec3::NEG_Z));
    assert!(
        matches!(s.emitters[4].kind, EmitterKind::SunSky { sun_direction, sun_scale: 2.0, sky_scale: 1.0, turbidity: 3.0, .. } if (sun_direction.y - 0.5f64.sqrt()).abs() < 1e-12)
    );
    assert!(matches!(s.emitters[5].kind, EmitterKind::SunSky { sun_scale: 0.0, .. }));
    // Mitsuba 3.9.1: a spectrum of 3 at all wavelengths is not grey.
    let ColorDesc::Constant(c) = s.shapes[1].emission.as_ref().unwrap().radiance else { panic!() };
    assert!((c.r - 3.614).abs() < 0.01 && (c.b - 2.727).abs() < 0.01);
    let film = &s.sensors[1].film;
    assert_eq!((film.crop, film.filter), (Some([2, 0, 5, 8]), FilterDesc::Mitchell { b: 0.0, c: 0.5 }));
}

#[test]
fn equal_meshes_are_kept_once_and_mirrored_ones_apart() {
    let mirror = "<transform name=\"to_world\"><scale x=\"-1\"/></transform>";
    let s = good(&format!(
        "<shape type=\"cube\"/><shape type=\"cube\">{mirror}</shape><shape type=\"shapegroup\" id=\"g\"><shape type=\"sphere\"/></shape>\
         <shape type=\"instance\"><ref id=\"g\"/>{mirror}</shape><shape type=\"instance\"><ref id=\"g\"/></shape>"
    ));
    assert_eq!((s.meshes.len(), s.shapes.len(), s.groups.len(), s.instances.len()), (2, 3, 1, 2));
    assert_eq!(s.shapes[0].geometry, s.shapes[1].geometry);
    // In the world the front is outside all the same.
    let m = &s.meshes[s.shapes[2].geometry.mesh().unwrap().index()];
    let [a, b, c] = m.triangles[0].map(|i| s.shapes[2].to_world.transform_point3(m.positions[i as usize].as_dvec3()));
    assert!((b - a).cross(c - a).dot(a) > 0.0);
}

/// Only round shapes that emit and are stretched are made of triangles.
#[test]
fn round_shapes_stay_round() {
    let stretched = "<transform name=\"to_world\"><scale x=\"2\"/></transform>";
    let light = "<emitter type=\"area\"/>";
    let shape = |kind: &str, inside: &str| format!("<shape type=\"{kind}\">{inside}</shape>");
    for kind in ["sphere", "disk", "cylinder"] {
        for (inside, round) in [(stretched, true), (light, true), (&*format!("{stretched}{light}"), kind == "disk")] {
            let s = good(&shape(kind, inside));
            let found = s.shapes.last().unwrap().geometry;
            assert_eq!(matches!(found, ShapeGeometry::Round(_)), round, "{kind} {inside}");
        }
    }
}

#[test]
fn files_are_found_read_and_mistakes_in_them_placed() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let inside = "<shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/><boolean name=\"face_normals\" value=\"true\"/></shape>\n<shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/></shape>\
        <bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"no.png\"/></texture></bsdf>";
    let files = Files::new(&[("s.xml", &scene(inside)), ("a.ply", ply)]);
    let (s, found) = files.load(&LoadOptions::default()).unwrap();
    assert_eq!((s.meshes[1].normals.len(), s.meshes[2].normals.len()), (0, 3));
    assert_eq!(messages(Ok((s, found))), [("load::image", 3, 160)]);
    let strict = files.load(&LoadOptions { strict: true, ..LoadOptions::default() }).unwrap_err();
    assert!(strict.io);
    let files = Files::new(&[("s.xml", &scene(inside)), ("a.ply", &ply.replace("1 0 0", "1 y 0"))]);
    let e = files.load(&LoadOptions::default()).unwrap_err();
    assert!(!e.io && e.to_string().contains("line 11: `y` is not a number"), "{e}");
}

mod creases;
mod encodings;
mod hostile;
mod legacy;
mod media;
mod pictures;
mod plugins;
mod references;

const FUZZED: &str = "<scene version=\"2.1.0\"><default name=\"n\" value=\"4\"/><sensor type=\"perspective\"><float name=\"fov\" value=\"$n\"/><transform name=\"to_world\">\
    <lookat origin=\"0,0,5\" target=\"0,0,0\" up=\"0,1,0\"/></transform><film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/></film></sensor>\
    <bsdf type=\"twosided\" id=\"a\"><bsdf type=\"roughconductor\"><string name=\"material\" value=\"Cu\"/></bsdf></bsdf><shape type=\"sphere\"><ref id=\"a\"/></shape>\
    <emitter type=\"point\"><spectrum name=\"intensity\" value=\"400:1, 700:2\"/></emitter><alias id=\"a\" as=\"b\"/></scene>";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn mutated_scenes_never_panic(edits in proptest::collection::vec((0usize..1000, prop_oneof![any::<u8>(), proptest::sample::select(b"<>\"/&;$ -9e\xC3".to_vec())], 0usize..12), 1..5)) {
        let mut bytes = FUZZED.as_bytes().to_vec();
        for (at, value, delete) in edits {
            let at = at % bytes.len();
            bytes[at] = value;
            let end = (at + delete).min(bytes.len());
            bytes.drain(at + 1..end.max(at + 1));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.xml");
        std::fs::write(&path, &bytes).unwrap();
        match load_scene(&path, &LoadOptions::default()) {
            Ok((s, found)) => {
                prop_assert!(!found.has_errors());
                prop_assert!(s.shapes.iter().all(|shape| shape.geometry.mesh().is_none_or(|m| m.index() < s.meshes.len()) && shape.bsdf.is_none_or(|b| b.index() < s.bsdfs.len())));
            }
            Err(e) => {
                prop_assert!(e.diagnostics.has_errors());
                // Every place can be shown.
                e.diagnostics.list.iter().for_each(|d| drop(d.span.as_ref().map(Span::location)));
            }
        }
    }
}
