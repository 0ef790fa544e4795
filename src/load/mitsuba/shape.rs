//! Shapes, groups of shapes, and their instances.

use super::document::OBJECT_TAGS;
use super::objects::Builder;
use super::props::Props;
use super::spectrum::Purpose::Emission;
use crate::load::assets::MeshSource;
use crate::load::mesh::{MeshColors, MeshOptions, SmoothAngle};
use crate::load::primitives::Primitive;
use crate::math::{Frame, Rgb};
use crate::scene::diag::Diagnostic;
use crate::scene::{
    AreaEmission, BsdfDesc, BsdfId, BsdfKind, ColorDesc, DiffuseParams, GroupDesc, GroupId, InstanceDesc,
    InterfaceDesc, RoundKind, ShapeDesc, ShapeGeometry, Span,
};
use glam::{DMat4, DVec3};

const PLUGINS: [&str; 11] =
    ["obj", "ply", "serialized", "rectangle", "cube", "sphere", "disk", "cylinder", "shapegroup", "instance", "merge"];

/// Most shapes inside of shapes that hold others: references to a `merge` of `merge`s multiply.
const MAX_MEMBERS: usize = 1 << 20;

/// A surface of a shape, as long as its file is not read.
enum Source {
    Mesh(MeshSource),
    Round(RoundKind),
}

/// A surface without its material and emission.
struct Outline {
    source: Source,
    to_world: DMat4,
    options: MeshOptions,
    /// Its file name, or else the whole element.
    span: Span,
}

/// The elements inside of a surface.
struct Parts {
    /// A BSDF or a reference to one.
    material: Option<usize>,
    emission: Option<AreaEmission>,
    interface: Option<InterfaceDesc>,
}

impl Source {
    /// A round shape that emits is one light, sampled by formulas of its kind. Where its place makes an ellipsoid or an
    /// elliptic cylinder of it, triangles emit.
    fn for_placement(self, to_world: &DMat4, emits: bool) -> Source {
        match self {
            Source::Round(kind) if emits && !kind.is_kept_by(to_world) => match kind {
                RoundKind::Sphere => Source::Mesh(MeshSource::Primitive(Primitive::Sphere)),
                RoundKind::Cylinder => Source::Mesh(MeshSource::Primitive(Primitive::Cylinder)),
                RoundKind::Disk => self,
            },
            other => other,
        }
    }
}

impl Builder<'_> {
    /// A `<shape>` that stands in the scene itself.
    pub(super) fn shape(&mut self, node: usize) {
        let Some(p) = self.props(node) else { return };
        match p.plugin {
            // Built when an instance refers to it; checked even if none does.
            "shapegroup" => {
                self.group(node, node);
            }
            "merge" => {
                for member in self.members(&p) {
                    self.shape(member);
                }
                p.finish();
            }
            "instance" => {
                if let Some(instance) = self.instance(&p) {
                    self.scene.instances.push(instance);
                }
                p.finish();
            }
            _ => {
                if let Some(shape) = self.surface(&p) {
                    self.scene.shapes.push(shape);
                }
            }
        }
    }

    fn instance(&mut self, p: &Props<'_>) -> Option<InstanceDesc> {
        let to_world = p.transform("to_world").unwrap_or(DMat4::IDENTITY);
        let &[from] = p.objects().as_slice() else {
            p.error("scene::nested-shape", "an `instance` needs one reference to a `shapegroup`");
            return None;
        };
        let object = self.resolve(from)?;
        let group = self.group(object, from)?;
        Some(InstanceDesc { group, to_world, span: Some(p.span()) })
    }

    fn group(&mut self, object: usize, from: usize) -> Option<GroupId> {
        if let Some(done) = self.groups.get(&object) {
            return *done;
        }
        let node = self.node(object);
        if node.tag != "shape" || node.attr("type").is_none_or(|a| a.value != "shapegroup") {
            let d = Diagnostic::error("scene::wrong-type", "an instance must refer to a <shape type=\"shapegroup\">");
            self.push(d.at(self.node(from).span.clone()).label("expected a shapegroup"));
            return None;
        }
        let built = self.guarded(object, from, |b| {
            let p = b.props(object)?;
            let mut group = GroupDesc::default();
            for child in b.members(&p) {
                let Some(shape) = b.props(child) else { continue };
                if matches!(shape.plugin, "shapegroup" | "instance") {
                    shape.error("scene::nested-shape", format!("a shapegroup cannot hold a `{}`", shape.plugin));
                    continue;
                }
                let Some(shape) = b.surface(&shape) else { continue };
                if let Some(emission) = &shape.emission {
                    let d = Diagnostic::error("scene::instanced-emitter", "a shape in a shapegroup cannot emit light");
                    b.push(d.at(emission.span.clone()));
                }
                group.shapes.push(shape);
            }
            p.finish();
            b.scene.groups.push(group);
            Some(GroupId((b.scene.groups.len() - 1) as u32))
        });
        self.groups.insert(object, built);
        built
    }

    /// The shapes inside of a shape that holds others; those inside of a `merge` in their places.
    fn members(&mut self, p: &Props<'_>) -> Vec<usize> {
        let mut found = vec![];
        for from in p.objects() {
            if self.members > MAX_MEMBERS {
                return vec![];
            }
            self.members += 1;
            if self.members > MAX_MEMBERS {
                let message = format!("shapes inside of shapes are more than {MAX_MEMBERS}");
                self.push(Diagnostic::error("scene::too-large", message).at(p.span()));
            }
            let Some(object) = self.resolve(from) else { continue };
            let node = self.node(object);
            if node.tag != "shape" {
                let message = format!("a <{}> has no place in a `{}`", node.tag, p.plugin);
                let d = Diagnostic::error("scene::misplaced-element", message);
                self.push(d.at(node.span.clone()).label("expected a <shape>"));
            } else if node.attr("type").is_some_and(|a| a.value == "merge") {
                let inside = self.guarded(object, from, |b| {
                    let p = b.props(object)?;
                    let inside = b.members(&p);
                    p.finish();
                    Some(inside)
                });
                found.extend(inside.unwrap_or_default());
            } else {
                found.push(object);
            }
        }
        found
    }

    /// Any shape that is a surface.
    fn surface(&mut self, p: &Props<'_>) -> Option<ShapeDesc> {
        let mut outline = self.outline(p)?;
        let flip_normals = p.boolean_or("flip_normals", false);
        let Parts { material, emission, interface } = self.parts(p);
        p.finish();
        let mut bsdf = material.and_then(|m| self.bsdf(m));
        outline.options.colors = material.map_or(MeshColors::Unused, |m| self.mesh_colors(m));
        let default = match (emission.is_some(), interface.is_some() && p.element().legacy) {
            // As in Mitsuba 3, a light without a material reflects nothing.
            (true, _) => Some(DiffuseParams { reflectance: ColorDesc::Constant(Rgb::BLACK) }.into()),
            // As in Mitsuba 0.6, a medium ends invisibly. In Mitsuba 3 its surface is a diffuse one.
            (false, true) => Some(BsdfKind::Null),
            (false, false) => None,
        };
        if let Some(kind) = default.filter(|_| bsdf.is_none()) {
            self.scene.bsdfs.push(BsdfDesc { name: None, kind, span: None });
            bsdf = Some(BsdfId((self.scene.bsdfs.len() - 1) as u32));
        }
        let to_world = outline.to_world;
        let geometry = self.geometry(outline, emission.is_some());
        let name = p.element().attr("id").map(|a| a.value.clone());
        let span = Some(p.span());
        Some(ShapeDesc { geometry, to_world, bsdf, emission, interface, flip_normals, name, span })
    }

    /// The outline that the plugin itself describes.
    fn outline(&mut self, p: &Props<'_>) -> Option<Outline> {
        let mut to_world = p.transform("to_world").unwrap_or(DMat4::IDENTITY);
        let mut span = p.span();
        let mut options = MeshOptions::default();
        let source = match p.plugin {
            "ply" | "obj" | "serialized" => {
                options.face_normals = p.boolean_or("face_normals", false);
                options.flip_v = p.boolean_or("flip_tex_coords", p.plugin == "obj");
                options.max_smooth_angle = smooth_angle(p, options.face_normals);
                let (path, place) = self.file(p, "filename")?;
                span = place;
                Source::Mesh(match p.plugin {
                    "ply" => MeshSource::Ply(path),
                    "obj" => MeshSource::Obj(path),
                    _ => MeshSource::Serialized(path, p.count("shape_index").unwrap_or(0)),
                })
            }
            "rectangle" => Source::Mesh(MeshSource::Primitive(Primitive::Rectangle)),
            "cube" => Source::Mesh(MeshSource::Primitive(Primitive::Cube)),
            "disk" => Source::Round(RoundKind::Disk),
            "sphere" => {
                let center = p.vector("center").unwrap_or(DVec3::ZERO);
                let radius = p.positive_or("radius", 1.0);
                to_world *= DMat4::from_translation(center) * DMat4::from_scale(DVec3::splat(radius));
                Source::Round(RoundKind::Sphere)
            }
            "cylinder" => {
                to_world *= cylinder_to_object(p)?;
                Source::Round(RoundKind::Cylinder)
            }
            _ => {
                self.unknown_plugin(p, &PLUGINS);
                return None;
            }
        };
        options.mirrored = to_world.determinant() < 0.0;
        Some(Outline { source, to_world, options, span })
    }

    /// The elements inside of a surface.
    fn parts(&mut self, p: &Props<'_>) -> Parts {
        let interface = self.interface(p);
        let mut parts = Parts { material: p.get_index("bsdf"), emission: None, interface };
        for object in p.objects() {
            let Some(found) = self.resolve(object) else { continue };
            match self.node(found).tag.as_str() {
                "bsdf" => parts.material = Some(object),
                "emitter" => parts.emission = self.area_emission(found),
                "medium" => {
                    let d = Diagnostic::error("scene::misplaced-element", "this medium of a shape has no side");
                    let node = self.node(object);
                    let expected = "name=\"interior\" or name=\"exterior\"";
                    self.push(d.at(node.span.clone()).label(format!("expected {expected}")));
                }
                tag => {
                    let d =
                        Diagnostic::error("scene::misplaced-element", format!("a <{tag}> has no place in a <shape>"));
                    self.push(d.at(self.node(object).span.clone()).label("expected <bsdf> or <emitter>"));
                }
            }
        }
        parts
    }

    fn geometry(&mut self, outline: Outline, emits: bool) -> ShapeGeometry {
        let Outline { source, to_world, options, span } = outline;
        match source.for_placement(&to_world, emits) {
            Source::Round(kind) => {
                if options.colors != MeshColors::Unused {
                    let attribute = options.colors.attribute();
                    let message =
                        format!("a texture asks for `{attribute}`, which spheres, disks and cylinders do not have");
                    self.push(Diagnostic::error("load::missing-attribute", message).at(span));
                }
                ShapeGeometry::Round(kind)
            }
            Source::Mesh(mesh) => ShapeGeometry::Mesh(self.assets.mesh(mesh, options, span)),
        }
    }

    fn area_emission(&mut self, node: usize) -> Option<AreaEmission> {
        debug_assert!(OBJECT_TAGS.contains(&self.node(node).tag.as_str()));
        let p = self.props(node)?;
        if p.plugin != "area" {
            let d = Diagnostic::error(
                "scene::misplaced-element",
                format!("an emitter of type `{}` has no place in a <shape>", p.plugin),
            );
            self.push(d.at(p.element().span_of("type")).label("expected `area`"));
            return None;
        }
        let radiance = self.color(&p, "radiance", 1.0, Emission);
        self.require_pictures(radiance, &p.span());
        let sampling_weight = self.sampling_weight(&p);
        self.check_media(&p);
        p.finish();
        Some(AreaEmission { radiance, sampling_weight, span: Some(p.span()) })
    }
}

/// The angle of `max_smooth_angle`, which excludes `face_normals`.
fn smooth_angle(p: &Props<'_>, face_normals: bool) -> Option<SmoothAngle> {
    let degrees = p.float("max_smooth_angle")?;
    if face_normals {
        p.error("scene::bad-value", "`max_smooth_angle` and `face_normals` exclude each other");
        return None;
    }
    if !(0.0..=180.0).contains(&degrees)
        && let Some(node) = p.get("max_smooth_angle")
    {
        p.bad_value(node, "value", format!("a smooth angle of {degrees} degrees"), "an angle from 0 to 180");
    }
    Some(SmoothAngle::degrees(degrees as f32))
}

/// The unit cylinder (around z from 0 to 1) → `p0` … `p1` with `radius`. The tangents are Mitsuba's: texture
/// coordinates start there.
fn cylinder_to_object(p: &Props<'_>) -> Option<DMat4> {
    let (p0, p1) = (p.vector("p0").unwrap_or(DVec3::ZERO), p.vector("p1").unwrap_or(DVec3::Z));
    let radius = p.positive_or("radius", 1.0);
    let axis = p1 - p0;
    let Some(direction) = axis.try_normalize() else {
        p.error("scene::bad-value", "`p0` and `p1` of a cylinder are the same point");
        return None;
    };
    let frame = Frame::from_normal(direction.as_vec3());
    // Orthonormal in double precision.
    let t = direction.cross(frame.s.as_dvec3()).normalize();
    let s = t.cross(direction);
    Some(DMat4::from_cols((s * radius).extend(0.0), (t * radius).extend(0.0), axis.extend(0.0), p0.extend(1.0)))
}
