//! Whatever is wrong with the input: the exit code, the place, what was expected, and an earlier picture left as it
//! was.

use crate::support::program::{BOX, Run, Sandbox};

/// Stands for a picture that took a night.
const EARLIER: &[u8] = b"an earlier picture";

/// Renders `scene.xml` over an earlier picture, which must survive.
#[track_caller]
fn refused(sandbox: &Sandbox, arguments: &str, code: i32, parts: &[&str]) {
    for name in ["out.exr", "out.pfm"] {
        sandbox.write(name, EARLIER);
    }
    let run = sandbox.run(&format!("render {arguments} -o out.exr -o out.pfm")).expect(code, parts);
    assert!(run.stdout.is_empty(), "{}", run.stdout);
    for name in ["out.exr", "out.pfm"] {
        assert_eq!(sandbox.read(name), EARLIER, "{name} was touched");
    }
    let left: Vec<_> = std::fs::read_dir(sandbox.path("")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(!left.iter().any(|n| n.to_string_lossy().starts_with('.')), "temporary files are left: {left:?}");
}

/// A change to the box that makes it bad: what is replaced by what, and what must be said.
#[track_caller]
fn bad_box(from: &str, to: &str, parts: &[&str]) {
    let sandbox = Sandbox::new();
    sandbox.write_box_with("scene.xml", from, to);
    refused(&sandbox, "scene.xml", 2, parts);
}

/// A change that is warned of only; the picture is written.
#[track_caller]
fn renders_with_warning(sandbox: &Sandbox, parts: &[&str]) -> Run {
    sandbox.write("out.pfm", EARLIER);
    let run = sandbox.run("render scene.xml -o out.pfm").expect(0, &["warning["]).expect(0, parts);
    assert!(sandbox.read("out.pfm").starts_with(b"PF"), "the picture replaces the earlier one");
    run
}

fn pfm_pixels(sandbox: &Sandbox) -> Vec<f32> {
    let image = lightsieve::image::read_image(&sandbox.path("out.pfm"), lightsieve::image::Encoding::Linear).unwrap();
    (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y))).map(|(x, y)| image.rgb(x, y).g).collect()
}

/// The box's cube replaced by a mesh file.
fn with_mesh(name: &str, contents: impl AsRef<[u8]>) -> Sandbox {
    let sandbox = Sandbox::new();
    let kind = name.rsplit('.').next().unwrap();
    let shape = format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"{name}\"/>");
    sandbox.write_box_with("scene.xml", "<shape type=\"cube\">", &shape);
    sandbox.write(name, contents);
    sandbox
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 2\nproperty list uchar int vertex_indices\nend_header\n-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n3 0 1 2\n3 0 2 3\n";
const OBJ: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nf 1 2 3\n";

/// Where the mesh's file name is in the scene file.
const MESH_PLACE: &str = "scene.xml:25:54";

#[test]
fn missing_scene_file() {
    refused(&Sandbox::new(), "none.xml", 3, &["none.xml", "No such file"]);
    let sandbox = Sandbox::new();
    sandbox.run("info none.xml").expect(3, &["none.xml"]);
    sandbox.run("compare none.pfm scene.xml").expect(3, &["none.pfm"]);
}

#[test]
fn unknown_kind_of_scene_file() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.blend", "BLENDER");
    refused(&sandbox, "scene.blend", 2, &["scene.blend", ".xml"]);
}

#[test]
fn not_well_formed() {
    bad_box("</scene>", "", &["error[scene::syntax]", "scene.xml:1:1"]);
}

#[test]
fn unknown_plugin() {
    bad_box("type=\"diffuse\"", "type=\"difuse\"", &["unknown-plugin", "scene.xml:21:21", "did you mean `diffuse`?"]);
}

#[test]
fn unknown_property_is_ignored() {
    let sandbox = Sandbox::new();
    sandbox.write_box_with("scene.xml", "name=\"fov\"", "name=\"fovv\"");
    renders_with_warning(&sandbox, &["unknown-property", "scene.xml:8:22", "did you mean `fov`?"]);
}

#[test]
fn wrong_type() {
    bad_box("<float name=\"fov\"", "<string name=\"fov\"", &["wrong-type", "scene.xml:8:9", "expected a number"]);
}

#[test]
fn undefined_reference() {
    bad_box(
        "<ref id=\"grey\"",
        "<ref id=\"gray\"",
        &["undefined-reference", "scene.xml:26:18", "did you mean `grey`?"],
    );
}

#[test]
fn circular_reference() {
    let from =
        "<bsdf type=\"diffuse\">\n            <rgb name=\"reflectance\" value=\"$red, 0.5, 0.4\"/>\n        </bsdf>";
    bad_box(from, "<ref id=\"grey\"/>", &["circular-reference", "scene.xml:21:9", "closes the circle"]);
}

#[test]
fn bad_numbers() {
    for bad in ["sixty", "1e999", "nan", "60,5", ""] {
        let to = format!("\"fov\" value=\"{bad}\"");
        bad_box("\"fov\" value=\"60\"", &to, &["bad-value", "scene.xml:8:34", "expected a number"]);
    }
    bad_box("\"5, 4, 3\"", "\"5, 4\"", &["bad-value", "scene.xml:35:41"]);
}

#[test]
fn bad_definitions() {
    let sandbox = Sandbox::new();
    refused(&sandbox, "scene.xml -D spp=some", 2, &["scene.xml:13:49", "expected a whole number"]);
    refused(&sandbox, "scene.xml -D spp", 2, &["name=value"]);
    sandbox.run("render scene.xml -D spq=3 -o out.pfm").expect(0, &["unused-definition", "spq"]);
}

#[test]
fn truncated_ply() {
    let ascii = &PLY[..PLY.len() - 10];
    refused(&with_mesh("cut.ply", ascii), "scene.xml", 2, &["cut.ply", "line 14", "too short", MESH_PLACE]);
    let mut binary = PLY[..PLY.find("-1 -1").unwrap()].replace("ascii", "binary_little_endian").into_bytes();
    binary.extend([0; 30]);
    refused(&with_mesh("cut.ply", binary), "scene.xml", 2, &["cut.ply", MESH_PLACE]);
    refused(&with_mesh("cut.ply", &PLY[..40]), "scene.xml", 2, &["cut.ply", MESH_PLACE]);
}

#[test]
fn truncated_obj() {
    let sandbox = with_mesh("cut.obj", &OBJ[..OBJ.find(" -1\nf").unwrap()]);
    refused(&sandbox, "scene.xml", 2, &["cut.obj", "line 3", "expected 3 numbers", MESH_PLACE]);
    refused(&sandbox, "cut.obj", 2, &["cut.obj", "line 3"]);
}

#[test]
fn missing_mesh() {
    let sandbox = with_mesh("gone.ply", PLY);
    std::fs::remove_file(sandbox.path("gone.ply")).unwrap();
    refused(&sandbox, "scene.xml", 3, &["gone.ply", MESH_PLACE]);
}

#[test]
fn index_out_of_range() {
    let ply = with_mesh("bad.ply", PLY.replace("3 0 1 2", "3 0 1 7"));
    refused(&ply, "scene.xml", 2, &["bad.ply", "vertex 7", "4 vertices", MESH_PLACE]);
    let obj = with_mesh("bad.obj", OBJ.replace("f 1 2 3", "f 1 2 9"));
    refused(&obj, "scene.xml", 2, &["bad.obj", "line 4", "no vertex 9", MESH_PLACE]);
}

#[test]
fn nan_vertices() {
    let ply = with_mesh("bad.ply", PLY.replace("1 1 -1", "nan 1 -1"));
    refused(&ply, "scene.xml", 2, &["bad.ply", "not finite", MESH_PLACE]);
    let obj = with_mesh("bad.obj", OBJ.replace("v 1 1 -1", "v inf 1 -1"));
    refused(&obj, "scene.xml", 2, &["bad.obj", "line 3", MESH_PLACE]);
}

#[test]
fn flat_triangles_are_left_out() {
    let sandbox = with_mesh("flat.ply", PLY.replace("3 0 2 3", "3 0 2 2"));
    renders_with_warning(&sandbox, &["flat-triangles", "1 triangle", "flat.ply", "scene.xml:25:5"]);
    assert!(pfm_pixels(&sandbox).iter().all(|v| v.is_finite()));
}

#[test]
fn truncated_texture() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml -o whole.exr --quiet").expect(0, &[]);
    let whole = sandbox.read("whole.exr");
    sandbox.write("cut.exr", &whole[..whole.len() / 2]);
    let texture =
        "<texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"cut.exr\"/></texture>";
    sandbox.write_box_with("scene.xml", "<rgb name=\"reflectance\" value=\"$red, 0.5, 0.4\"/>", texture);
    renders_with_warning(&sandbox, &["cut.exr", "scene.xml:22:86", "magenta"]);
    refused(&sandbox, "scene.xml --strict", 2, &["error[load::image]", "cut.exr", "scene.xml:22:86"]);
    std::fs::remove_file(sandbox.path("cut.exr")).unwrap();
    refused(&sandbox, "scene.xml --strict", 3, &["error[load::image]", "cut.exr", "scene.xml:22:86"]);
}

#[test]
fn no_emitters_is_black() {
    let sandbox = Sandbox::new();
    let emitter = &BOX[BOX.find("<emitter").unwrap()..BOX.find("</emitter>").unwrap() + "</emitter>".len()];
    sandbox.write_box_with("scene.xml", emitter, "");
    renders_with_warning(&sandbox, &["no-emitter", "black"]);
    assert!(pfm_pixels(&sandbox).iter().all(|&v| v == 0.0));
}

#[test]
fn empty_scene() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.xml", format!("{}</scene>", &BOX[..BOX.find("<shape").unwrap()]));
    refused(&sandbox, "scene.xml", 2, &["scene::empty"]);
    sandbox.write("scene.xml", "<scene version=\"3.0.0\"/>");
    refused(&sandbox, "scene.xml", 2, &["scene::empty", "scene::no-sensor", "add a <sensor"]);
    sandbox.write("scene.xml", "");
    refused(&sandbox, "scene.xml", 2, &["scene::syntax"]);
}

#[test]
fn film_without_pixels() {
    bad_box("\"width\" value=\"16\"", "\"width\" value=\"0\"", &["empty-film", "scene.xml:15:9"]);
    bad_box(
        "\"width\" value=\"16\"",
        "\"width\" value=\"-4\"",
        &["bad-value", "scene.xml:16:42", "expected a whole number"],
    );
    let sandbox = Sandbox::new();
    for bad in ["0x4", "4x0", "4294967295x4294967295", "4", "axb", "4x4x4"] {
        refused(&sandbox, &format!("scene.xml --size {bad}"), 2, &["error"]);
    }
}

#[test]
fn crop_outside_of_the_film() {
    let crop = "<integer name=\"width\" value=\"16\"/><integer name=\"crop_offset_x\" value=\"1\"/><integer name=\"crop_width\" value=\"16\"/>";
    bad_box("<integer name=\"width\" value=\"16\"/>", crop, &["crop-outside", "scene.xml:15:9", "16 x 16"]);
    let sandbox = Sandbox::new();
    for bad in ["10,10,10,10", "0,0,0,0", "4294967295,0,4294967295,1", "16,0,1,1"] {
        refused(&sandbox, &format!("scene.xml --crop {bad}"), 2, &["crop", "16 x 16"]);
    }
    refused(&sandbox, "scene.xml --crop 1,2,3", 2, &["x,y,width,height"]);
}

#[test]
fn unknown_integrator() {
    let sandbox = Sandbox::new();
    refused(&sandbox, "scene.xml -i pathh", 2, &["unknown integrator \"pathh\"", "did you mean \"path\"?"]);
    refused(&sandbox, "scene.xml -i zebra", 2, &["unknown integrator \"zebra\"", "known: path"]);
    sandbox.run("list -i pathh").expect(2, &["unknown integrator \"pathh\"", "did you mean \"path\"?"]);
    // In a scene file it is a proposal.
    sandbox.write_box_with("scene.xml", "type=\"path\"", "type=\"pathh\"");
    renders_with_warning(&sandbox, &["integrator::unknown", "scene.xml:4:5", "did you mean \"path\"?"]);
    sandbox.run("render scene.xml --print-config").expect(0, &["integrator::unknown", "scene.xml:4:5"]);
}

#[test]
fn unknown_parameter() {
    let sandbox = Sandbox::new();
    refused(&sandbox, "scene.xml -p max_dept=3", 2, &["\"max_dept\"", "did you mean \"max_depth\"?"]);
    refused(&sandbox, "scene.xml -p max_depth", 2, &["name=value"]);
    sandbox.write_box_with("scene.xml", "\"max_depth\"", "\"max_dept\"");
    renders_with_warning(&sandbox, &["integrator::parameter", "scene.xml:5:", "did you mean \"max_depth\"?"]);
}

#[test]
fn bad_parameter_value() {
    let sandbox = Sandbox::new();
    refused(&sandbox, "scene.xml -p max_depth=many", 2, &["max_depth = many", "expected whole number"]);
    refused(&sandbox, "scene.xml -p heuristic=powr", 2, &["heuristic = powr", "balance or power"]);
    refused(&sandbox, "scene.xml --max-depth -7", 2, &["max_depth = -7", "expected whole number"]);
    sandbox.write_box_with("scene.xml", "\"max_depth\" value=\"5\"", "\"max_depth\" value=\"-7\"");
    renders_with_warning(&sandbox, &["integrator::parameter", "scene.xml:5:", "expected whole number"]);
}

#[test]
fn bad_options() {
    let sandbox = Sandbox::new();
    for bad in
        ["--spp 0", "--spp -1", "--time soon", "--time 0s", "--seed x", "--threads 0", "--query brute", "--sppp 3"]
    {
        refused(&sandbox, &format!("scene.xml {bad}"), 2, &["error"]);
    }
    refused(&sandbox, "scene.xml --aov albedo,glow", 2, &["unknown layer \"glow\"", "normal"]);
    refused(&sandbox, "", 2, &["Usage"]);
    sandbox.run("").expect(2, &["Usage"]);
    sandbox.run("rendr scene.xml").expect(2, &["render"]);
}

#[test]
fn unknown_output_ending() {
    refused(&Sandbox::new(), "scene.xml -o out.jpeg", 2, &["out.jpeg", ".exr, .pfm, .png"]);
    refused(&Sandbox::new(), "scene.xml -o out", 2, &[".exr, .pfm, .png"]);
}

#[test]
fn unwritable_output_folder() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("folder.png")).unwrap();
    for option in ["-o", "--stats", "--checkpoint"] {
        // The kernel lets nobody, root included, create files in /proc. An endless render shows that this is found out
        // before it.
        for bad in ["no/such/out.png", "/proc/out.png", "scene.xml/out.png", "folder.png"] {
            refused(&sandbox, &format!("scene.xml --spp 1000000000 {option} {bad}"), 3, &[bad]);
        }
    }
}

#[test]
fn full_disk() {
    let sandbox = Sandbox::new();
    for ending in ["png", "exr", "pfm"] {
        let name = format!("full.{ending}");
        std::os::unix::fs::symlink("/dev/full", sandbox.path(&name)).unwrap();
        // Outputs that can be written are written.
        let other = format!("good-{ending}.pfm");
        let run = sandbox.run(&format!("render scene.xml -o {name} -o {other}")).expect(3, &[&name, "No space left"]);
        assert!(!run.stderr.contains(&format!("wrote {name}")) && run.stderr.contains(&format!("wrote {other}")));
        assert!(sandbox.read(&other).starts_with(b"PF"));
        assert!(std::fs::symlink_metadata(sandbox.path(&name)).unwrap().is_symlink());
    }
    std::os::unix::fs::symlink("/dev/full", sandbox.path("stats.json")).unwrap();
    sandbox.run("render scene.xml --stats stats.json").expect(3, &["stats.json", "No space left"]);
    sandbox.run("render scene.xml --checkpoint stats.json").expect(3, &["stats.json", "No space left"]);
}

#[test]
fn bad_pictures_to_compare() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml -o a.pfm --quiet").expect(0, &[]);
    let whole = sandbox.read("a.pfm");
    sandbox.write("cut.pfm", &whole[..whole.len() - 7]);
    sandbox.run("compare cut.pfm a.pfm").expect(2, &["cut.pfm", "damaged"]);
    sandbox.run("compare a.pfm scene.xml").expect(2, &["scene.xml", "known format"]);
}

/// Rays in the space of such an instance would be beyond single precision, whatever answers them.
#[test]
fn an_instance_scaled_to_nothing_is_refused() {
    for (scale, query) in [
        ("value=\"1e-20\"", "embree"),
        ("value=\"1e-15\"", "obvhs"),
        ("x=\"1e-20\"", "embree"),
        ("x=\"1e-20\"", "obvhs"),
    ] {
        let sandbox = Sandbox::new();
        let instance = format!(
            "<shape type=\"shapegroup\" id=\"g\"><shape type=\"rectangle\"/></shape>\
             <shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><scale {scale}/></transform></shape></scene>"
        );
        sandbox.write_box_with("scene.xml", "</scene>", &instance);
        let arguments = format!("scene.xml --query {query}");
        refused(&sandbox, &arguments, 2, &["scene::bad-transform", "the transform of this instance"]);
    }
}

/// An integrator that shows something else than light is refused where it would be used, and only there.
#[test]
fn integrators_of_other_pictures_are_refused() {
    let sandbox = Sandbox::new();
    sandbox.write_box_with("scene.xml", "<integrator type=\"path\">", "<integrator type=\"depth\">");
    refused(&sandbox, "scene.xml", 2, &["scene.xml", "`depth` is not supported", "--aov depth"]);
    sandbox.run("render scene.xml -i path --spp 1 -o a.pfm").expect(0, &[]);
    sandbox.run("render scene.xml --force --spp 1 -o a.pfm").expect(0, &["`depth` is not supported"]);
}
