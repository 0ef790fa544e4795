//! Collects meshes, materials and lights of one scene and writes them as a Mitsuba 3 file with its meshes and textures.

use crate::mesh::Mesh;
use std::collections::BTreeSet;
use std::{fs, io, path::Path};

/// Where a mesh is put: turned about the vertical by degrees, then moved.
#[derive(Clone, Copy)]
pub struct Place {
    pub turn: f64,
    pub at: [f64; 3],
}

/// Moved, not turned.
pub fn at(x: f64, y: f64, z: f64) -> Place {
    Place { turn: 0.0, at: [x, y, z] }
}

/// Turned by degrees, then moved.
pub fn turned(turn: f64, x: f64, y: f64, z: f64) -> Place {
    Place { turn, at: [x, y, z] }
}

struct Shape {
    mesh: usize,
    material: String,
    place: Option<Place>,
    radiance: Option<[f64; 3]>,
}

struct NamedMesh {
    name: String,
    mesh: Mesh,
    textured: bool,
}

/// A scene's row of the table in `scenes/README.md`.
pub struct Row {
    pub name: &'static str,
    pub file: String,
    pub purpose: &'static str,
    pub triangles: usize,
    pub lights: String,
    pub bytes: u64,
}

/// A scene in the making.
pub struct Scene {
    name: &'static str,
    purpose: &'static str,
    size: [u32; 2],
    max_depth: u32,
    spp: u32,
    sensor: String,
    materials: String,
    textured: BTreeSet<String>,
    meshes: Vec<NamedMesh>,
    shapes: Vec<Shape>,
    emitters: String,
    infinite: Vec<&'static str>,
    files: Vec<(String, Vec<u8>)>,
    variant: Option<Variant>,
}

/// The scene once more in another file, filled with a medium.
struct Variant {
    name: &'static str,
    purpose: &'static str,
    medium: String,
}

/// `a, b, c`, shortest form.
fn list(c: [f64; 3]) -> String {
    c.map(|x| format!("{}", (x * 1e4).round() / 1e4 + 0.0)).join(", ")
}

fn rgb(name: &str, c: [f64; 3]) -> String {
    format!("<rgb name=\"{name}\" value=\"{}\"/>", list(c))
}

impl Scene {
    /// An empty scene of 640 × 360 pixels.
    pub fn new(name: &'static str, purpose: &'static str, max_depth: u32, spp: u32) -> Scene {
        Scene {
            name,
            purpose,
            size: [640, 360],
            max_depth,
            spp,
            sensor: String::new(),
            materials: String::new(),
            textured: BTreeSet::new(),
            meshes: Vec::new(),
            shapes: Vec::new(),
            emitters: String::new(),
            infinite: Vec::new(),
            files: Vec::new(),
            variant: None,
        }
    }

    /// Another film size.
    pub fn film(&mut self, width: u32, height: u32) {
        self.size = [width, height];
    }

    /// Where the camera stands, what it looks at, and its horizontal field of view in degrees.
    pub fn camera(&mut self, origin: [f64; 3], target: [f64; 3], fov: f64) {
        self.sensor = format!(
            "        <float name=\"fov\" value=\"{fov}\"/>\n        <string name=\"fov_axis\" value=\"x\"/>\n        \
             <transform name=\"to_world\">\n            <lookat origin=\"{}\" target=\"{}\" up=\"0, 1, 0\"/>\n        \
             </transform>\n",
            list(origin),
            list(target)
        );
    }

    /// Writes the scene also as `name`, full of a medium of this extinction per metre and albedo that scatters equally in
    /// all directions.
    pub fn foggy(&mut self, name: &'static str, purpose: &'static str, sigma_t: f64, albedo: f64) {
        let medium = format!(
            "        <medium type=\"homogeneous\">{}{}</medium>\n",
            rgb("sigma_t", [sigma_t; 3]),
            rgb("albedo", [albedo; 3])
        );
        self.variant = Some(Variant { name, purpose, medium });
    }

    fn material(&mut self, id: &str, twosided: bool, kind: &str, params: &[String]) {
        let mut lines: Vec<String> = params.iter().flat_map(|p| p.lines()).map(|l| format!("    {l}")).collect();
        let id_attribute = format!(" id=\"{id}\"");
        lines.insert(0, format!("<bsdf type=\"{kind}\"{}>", if twosided { "" } else { &id_attribute }));
        lines.push("</bsdf>".into());
        if twosided {
            lines = lines.iter().map(|l| format!("    {l}")).collect();
            lines.insert(0, format!("<bsdf type=\"twosided\"{id_attribute}>"));
            lines.push("</bsdf>".into());
        }
        for line in lines {
            self.materials += &format!("    {line}\n");
        }
    }

    /// A matt surface.
    pub fn matt(&mut self, id: &str, c: [f64; 3]) {
        self.material(id, true, "diffuse", &[rgb("reflectance", c)]);
    }

    /// A varnished or glazed surface of the given roughness.
    pub fn glossy(&mut self, id: &str, c: [f64; 3], alpha: f64) {
        let params = [rgb("diffuse_reflectance", c), gloss(alpha)];
        self.material(id, true, "roughplastic", &params);
    }

    /// A perfectly polished coat.
    pub fn polished(&mut self, id: &str, c: [f64; 3]) {
        let params = [rgb("diffuse_reflectance", c), "<float name=\"int_ior\" value=\"1.5\"/>".into()];
        self.material(id, true, "plastic", &params);
    }

    /// A picture on a matt surface; `repeat` is how often it fits into one unit of texture space.
    pub fn matt_picture(&mut self, id: &str, file: &str, repeat: [f64; 2]) {
        self.textured.insert(id.into());
        self.material(id, true, "diffuse", &[bitmap("reflectance", file, repeat)]);
    }

    /// A picture under varnish.
    pub fn glossy_picture(&mut self, id: &str, file: &str, repeat: [f64; 2], alpha: f64) {
        self.textured.insert(id.into());
        let params = [bitmap("diffuse_reflectance", file, repeat), gloss(alpha)];
        self.material(id, true, "roughplastic", &params);
    }

    /// A metal by its complex refractive index; `alpha` 0 is a mirror.
    pub fn metal(&mut self, id: &str, metal: Metal, alpha: f64) {
        // Refractive indices at about 630, 530 and 465 nm, rounded (Rakić et al. 1998; Johnson & Christy 1972).
        let (eta, k) = match metal {
            Metal::Steel => ([2.9, 2.85, 2.6], [3.05, 2.9, 2.75]),
            Metal::Silver => ([0.15, 0.14, 0.13], [4.0, 3.2, 2.6]),
            Metal::Brass => ([0.45, 0.6, 1.15], [3.5, 2.6, 1.9]),
            Metal::Copper => ([0.22, 0.95, 1.2], [3.6, 2.6, 2.4]),
        };
        let mut params = vec![rgb("eta", eta), rgb("k", k)];
        if alpha > 0.0 {
            params.push("<string name=\"distribution\" value=\"ggx\"/>".into());
            params.push(format!("<float name=\"alpha\" value=\"{alpha}\"/>"));
        }
        self.material(id, true, if alpha > 0.0 { "roughconductor" } else { "conductor" }, &params);
    }

    /// Clear glass of refractive index 1.5.
    pub fn glass(&mut self, id: &str) {
        let params = ["int_ior\" value=\"1.5", "ext_ior\" value=\"1"].map(|p| format!("<float name=\"{p}\"/>"));
        self.material(id, false, "dielectric", &params);
    }

    /// A file beside the scene's.
    pub fn file(&mut self, path: &str, bytes: Vec<u8>) {
        self.files.push((path.into(), bytes));
    }

    fn mesh(&mut self, name: &str, mesh: Mesh) -> usize {
        self.meshes.push(NamedMesh { name: name.into(), mesh, textured: false });
        self.meshes.len() - 1
    }

    /// Adds a mesh that already stands where it belongs. All that has the same name becomes one shape.
    pub fn put(&mut self, name: &str, material: &str, mesh: Mesh) {
        match self.meshes.iter().position(|m| m.name == name) {
            Some(i) => {
                assert!(self.shapes.iter().any(|s| s.mesh == i && s.material == material), "{name}: other material");
                self.meshes[i].mesh.add(mesh);
            }
            None => {
                let i = self.mesh(name, mesh);
                self.meshes[i].textured = self.textured.contains(material);
                self.shapes.push(Shape { mesh: i, material: material.into(), place: None, radiance: None });
            }
        }
    }

    /// Stores a mesh to be placed several times.
    pub fn define(&mut self, name: &str, mesh: Mesh) {
        self.mesh(name, mesh);
    }

    /// Places a stored mesh.
    pub fn place(&mut self, name: &str, material: &str, place: Place) {
        let mesh = self.find(name);
        self.meshes[mesh].textured |= self.textured.contains(material);
        self.shapes.push(Shape { mesh, material: material.into(), place: Some(place), radiance: None });
    }

    fn find(&self, name: &str) -> usize {
        self.meshes.iter().position(|m| m.name == name).unwrap_or_else(|| panic!("no mesh {name}"))
    }

    /// Adds a light that already stands where it belongs: its front shines with this radiance.
    pub fn lamp(&mut self, name: &str, mesh: Mesh, radiance: [f64; 3]) {
        let mesh = self.mesh(name, mesh);
        self.shapes.push(Shape { mesh, material: String::new(), place: None, radiance: Some(radiance) });
    }

    /// Places a stored mesh as a light.
    pub fn place_lamp(&mut self, name: &str, radiance: [f64; 3], place: Place) {
        let mesh = self.find(name);
        self.shapes.push(Shape { mesh, material: String::new(), place: Some(place), radiance: Some(radiance) });
    }

    /// An environment map; `file` must have been added.
    pub fn environment(&mut self, file: &str, scale: f64) {
        self.infinite.push("environment map");
        self.emitters += &format!(
            "    <emitter type=\"envmap\">\n        <string name=\"filename\" value=\"{file}\"/>\n        \
             <float name=\"scale\" value=\"{scale}\"/>\n    </emitter>\n"
        );
    }

    /// Constant radiance from all directions.
    pub fn constant(&mut self, radiance: [f64; 3]) {
        self.infinite.push("constant sky");
        let radiance = rgb("radiance", radiance);
        self.emitters += &format!("    <emitter type=\"constant\">\n        {radiance}\n    </emitter>\n");
    }

    /// The file `name`; `medium` is what the camera is in.
    fn xml(&self, name: &str, purpose: &str, medium: &str) -> String {
        let mut x = format!(
            "<!-- {}: {} Units: metres, y up. Written by scenes/generate. -->\n<scene version=\"3.0.0\">\n    \
             <integrator type=\"path\">\n        <integer name=\"max_depth\" value=\"{}\"/>\n    </integrator>\n\n    \
             <sensor type=\"perspective\">\n{}{medium}        <sampler type=\"independent\">\n            \
             <integer name=\"sample_count\" value=\"{}\"/>\n        </sampler>\n        <film type=\"hdrfilm\">\n            \
             <integer name=\"width\" value=\"{}\"/>\n            <integer name=\"height\" value=\"{}\"/>\n            \
             <rfilter type=\"gaussian\"/>\n        </film>\n    </sensor>\n\n",
            name, purpose, self.max_depth, self.sensor, self.spp, self.size[0], self.size[1]
        );
        x += &self.materials;
        if !self.emitters.is_empty() {
            x += "\n";
            x += &self.emitters;
        }
        x += "\n";
        for s in &self.shapes {
            let file = &self.meshes[s.mesh].name;
            x +=
                &format!("    <shape type=\"ply\">\n        <string name=\"filename\" value=\"meshes/{file}.ply\"/>\n");
            if let Some(p) = s.place {
                x += "        <transform name=\"to_world\">";
                if p.turn != 0.0 {
                    x += &format!("<rotate y=\"1\" angle=\"{}\"/>", (p.turn * 1e4).round() / 1e4);
                }
                x += &format!("<translate value=\"{}\"/></transform>\n", list(p.at));
            }
            match s.radiance {
                Some(r) => x += &format!("        <emitter type=\"area\">{}</emitter>\n", rgb("radiance", r)),
                None => x += &format!("        <ref id=\"{}\"/>\n", s.material),
            }
            x += "    </shape>\n";
        }
        x + "</scene>\n"
    }

    /// Writes the scene's folder into `out` and returns its line of the table.
    pub fn write(&self, out: &Path) -> io::Result<Vec<Row>> {
        let folder = out.join(self.name);
        if folder.exists() {
            fs::remove_dir_all(&folder)?;
        }
        fs::create_dir_all(folder.join("meshes"))?;
        let mut bytes = 0;
        let mut save = |path: &str, data: &[u8]| {
            bytes += data.len() as u64;
            let path = folder.join(path);
            path.parent().map_or(Ok(()), fs::create_dir_all)?;
            fs::write(path, data)
        };
        save(&format!("{}.xml", self.name), self.xml(self.name, self.purpose, "").as_bytes())?;
        let variant_xml = self.variant.as_ref().map(|v| (v, self.xml(v.name, v.purpose, &v.medium)));
        if let Some((variant, xml)) = &variant_xml {
            fs::write(folder.join(format!("{}.xml", variant.name)), xml)?;
        }
        for m in &self.meshes {
            save(&format!("meshes/{}.ply", m.name), &m.mesh.ply(m.textured))?;
        }
        for (path, data) in &self.files {
            save(path, data)?;
        }
        let triangles = self.shapes.iter().map(|s| self.meshes[s.mesh].mesh.triangles.len()).sum();
        let lamps = self.shapes.iter().filter(|s| s.radiance.is_some()).count();
        let mut lights: Vec<String> = Vec::new();
        if lamps > 0 {
            lights.push(format!("{lamps} lamp{}", if lamps == 1 { "" } else { "s" }));
        }
        lights.extend(self.infinite.iter().map(ToString::to_string));
        let row = |name, purpose, bytes| {
            let file = format!("{}/{name}.xml", self.name);
            Row { name, file, purpose, triangles, lights: lights.join(" + "), bytes }
        };
        let variant_row = variant_xml.iter().map(|(v, xml)| row(v.name, v.purpose, xml.len() as u64));
        Ok(std::iter::once(row(self.name, self.purpose, bytes)).chain(variant_row).collect())
    }
}

fn gloss(alpha: f64) -> String {
    format!(
        "<string name=\"distribution\" value=\"ggx\"/>\n<float name=\"int_ior\" value=\"1.5\"/>\n\
         <float name=\"alpha\" value=\"{alpha}\"/>"
    )
}

fn bitmap(name: &str, file: &str, repeat: [f64; 2]) -> String {
    let mut x =
        format!("<texture type=\"bitmap\" name=\"{name}\">\n    <string name=\"filename\" value=\"{file}\"/>\n");
    if repeat != [1.0, 1.0] {
        x += &format!(
            "    <transform name=\"to_uv\">\n        <scale x=\"{}\" y=\"{}\"/>\n    </transform>\n",
            repeat[0], repeat[1]
        );
    }
    x + "</texture>"
}

/// Metals.
#[derive(Clone, Copy)]
pub enum Metal {
    Steel,
    Silver,
    Brass,
    Copper,
}
