//! Spheres, disks and cylinders give Mitsuba's pictures with every integrator: lit, textured, anisotropic, emitting
//! from outside and inside, and in stretched and mirrored instances.

use crate::support::pictures::{Picture, parse, prepare, sampled_by_pixel, takes};
use lightsieve::ray::Backend;

/// Mean over the channels, and its standard error, of each pixel of 4 x 4 by Mitsuba 3.9.1: llvm_ad_rgb, `path`,
/// box filter, 64 renders of 65536 samples per pixel.
type Expected = [(f64, f64); 16];

const ROOM: &str = r#"
    <integrator type="path"><integer name="max_depth" value="4"/><integer name="rr_depth" value="100"/>
    </integrator><sensor type="perspective"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0,-6,3" target="0,0,0.8" up="0,0,1"/></transform>
    <sampler type="independent"/><film type="hdrfilm"><integer name="width" value="4"/>
    <integer name="height" value="4"/><rfilter type="box"/></film></sensor>
    <bsdf type="diffuse" id="grey"><rgb name="reflectance" value="0.5"/></bsdf>
    <texture type="checkerboard" id="t"><rgb name="color0" value="0.1,0.2,0.3"/>
    <rgb name="color1" value="0.9,0.8,0.4"/><transform name="to_uv"><scale x="3" y="3"/></transform></texture>
    <bsdf type="twosided" id="checks"><bsdf type="diffuse"><ref name="reflectance" id="t"/></bsdf></bsdf>
    <shape type="rectangle"><transform name="to_world"><scale value="5"/></transform><ref id="grey"/></shape>"#;

const LAMP: &str = r#"
    <shape type="rectangle"><transform name="to_world"><scale value="0.7"/><rotate x="1" angle="180"/>
    <translate x="1" y="-1" z="4"/></transform><emitter type="area"><rgb name="radiance" value="9"/>
    </emitter></shape>"#;

const TEXTURED: &str = r#"
    <shape type="sphere"><transform name="to_world"><scale value="1.2"/><rotate x="0.6" y="0.8" angle="40"/>
    <translate z="1.2"/></transform><ref id="checks"/></shape>
    <shape type="cylinder"><point name="p0" x="-2" y="0" z="0"/><point name="p1" x="-1.6" y="0.4" z="2"/>
    <float name="radius" value="0.5"/><ref id="checks"/></shape>
    <shape type="disk"><transform name="to_world"><scale x="1" y="0.6"/><rotate x="0.6" y="0.8" angle="40"/>
    <translate x="2" z="1.3"/></transform><ref id="checks"/></shape>"#;

const TEXTURED_BY_MITSUBA: Expected = [
    (0.000000, 0.000000),
    (0.013340, 0.000044),
    (0.010786, 0.000037),
    (0.000000, 0.000000),
    (0.019281, 0.000018),
    (0.050537, 0.000037),
    (0.194100, 0.000128),
    (0.054174, 0.000043),
    (0.027492, 0.000021),
    (0.018341, 0.000020),
    (0.058093, 0.000031),
    (0.076861, 0.000032),
    (0.075831, 0.000010),
    (0.108872, 0.000014),
    (0.135446, 0.000013),
    (0.133207, 0.000011),
];

const ANISOTROPIC: &str = r#"
    <shape type="sphere"><point name="center" x="0" y="0" z="1.2"/><float name="radius" value="1.2"/>
    <bsdf type="roughconductor"><string name="material" value="none"/><float name="alpha_u" value="0.3"/>
    <float name="alpha_v" value="0.7"/></bsdf></shape>
    <shape type="cylinder"><point name="p0" x="-2" y="0" z="0"/><point name="p1" x="-2" y="0" z="2"/>
    <float name="radius" value="0.5"/>
    <bsdf type="twosided"><bsdf type="roughconductor"><string name="material" value="none"/>
    <float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.7"/></bsdf></bsdf></shape>"#;

const ANISOTROPIC_BY_MITSUBA: Expected = [
    (0.000000, 0.000000),
    (0.002172, 0.000027),
    (0.021218, 0.000096),
    (0.000000, 0.000000),
    (0.042930, 0.000046),
    (0.044487, 0.000077),
    (0.351743, 0.000268),
    (0.010176, 0.000009),
    (0.026904, 0.000026),
    (0.011006, 0.000021),
    (0.055759, 0.000031),
    (0.116042, 0.000019),
    (0.074768, 0.000010),
    (0.107172, 0.000013),
    (0.133401, 0.000012),
    (0.131495, 0.000009),
];

const LAMPS: &str = r#"
    <shape type="sphere"><transform name="to_world"><scale value="0.4"/><rotate x="0.6" y="0.8" angle="40"/>
    <translate x="-1" y="-1" z="1.5"/></transform>
    <emitter type="area"><texture name="radiance" type="checkerboard"><rgb name="color0" value="0.2,0.6,0.4"/>
    <rgb name="color1" value="0.9,0.1,0.3"/></texture></emitter></shape>
    <shape type="cylinder"><point name="p0" x="1" y="-1" z="2"/><point name="p1" x="2" y="0" z="2.5"/>
    <float name="radius" value="0.1"/><emitter type="area"><rgb name="radiance" value="4,8,6"/>
    </emitter></shape>
    <shape type="disk"><transform name="to_world"><scale x="0.6" y="0.3"/><rotate x="1" angle="140"/>
    <translate x="0" y="1.5" z="2.5"/></transform><emitter type="area"><rgb name="radiance" value="5,6,9"/>
    </emitter></shape>
    <shape type="sphere"><point name="center" x="0.5" y="0" z="0.5"/><float name="radius" value="0.5"/>
    <ref id="grey"/></shape>"#;

const LAMPS_BY_MITSUBA: Expected = [
    (0.000000, 0.000000),
    (0.411166, 0.000677),
    (0.410899, 0.000818),
    (0.304158, 0.000632),
    (0.029529, 0.000058),
    (0.116643, 0.000083),
    (0.152748, 0.000455),
    (0.324750, 0.000660),
    (0.030157, 0.000014),
    (0.070899, 0.000042),
    (0.048485, 0.000047),
    (0.055458, 0.000049),
    (0.019641, 0.000013),
    (0.026840, 0.000012),
    (0.031858, 0.000021),
    (0.035088, 0.000025),
];

const INSIDE: &str = r#"
    <shape type="sphere"><float name="radius" value="9"/><boolean name="flip_normals" value="true"/>
    <emitter type="area"><rgb name="radiance" value="0.4,0.6,0.8"/></emitter></shape>
    <shape type="sphere"><point name="center" x="0.5" y="0" z="0.7"/><float name="radius" value="0.7"/>
    <ref id="checks"/></shape>"#;

const INSIDE_BY_MITSUBA: Expected = [
    (0.600040, 0.000001),
    (0.600039, 0.000001),
    (0.600039, 0.000001),
    (0.600038, 0.000001),
    (0.491094, 0.000073),
    (0.488845, 0.000079),
    (0.475583, 0.000083),
    (0.490980, 0.000083),
    (0.297297, 0.000035),
    (0.277210, 0.000046),
    (0.219276, 0.000065),
    (0.290783, 0.000039),
    (0.297812, 0.000038),
    (0.295607, 0.000045),
    (0.294060, 0.000037),
    (0.295886, 0.000045),
];

const INSTANCES: &str = r#"
    <shape type="shapegroup" id="g"><shape type="sphere"><ref id="checks"/></shape>
    <shape type="cylinder"><point name="p0" x="1.2" y="0" z="-1"/><point name="p1" x="1.2" y="0" z="1"/>
    <float name="radius" value="0.4"/><ref id="checks"/></shape>
    <shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform><ref id="grey"/></shape>
    </shape>
    <shape type="instance"><ref id="g"/><transform name="to_world"><scale x="0.8" y="0.5" z="1"/>
    <rotate x="0.6" y="0.8" angle="40"/><translate x="-1.2" z="1.5"/></transform></shape>
    <shape type="instance"><ref id="g"/><transform name="to_world"><scale x="-0.6" y="0.6" z="0.6"/>
    <translate x="1.5" z="0.7"/></transform></shape>"#;

const INSTANCES_BY_MITSUBA: Expected = [
    (0.000142, 0.000002),
    (0.003983, 0.000015),
    (0.000000, 0.000000),
    (0.000000, 0.000000),
    (0.006043, 0.000007),
    (0.053249, 0.000042),
    (0.034720, 0.000036),
    (0.028896, 0.000042),
    (0.033653, 0.000019),
    (0.076687, 0.000031),
    (0.107727, 0.000028),
    (0.094547, 0.000031),
    (0.075977, 0.000010),
    (0.110273, 0.000012),
    (0.135395, 0.000014),
    (0.132870, 0.000010),
];

#[track_caller]
fn agrees_with_mitsuba(name: &str, depth: &str, shapes: &str, expected: &Expected) {
    let mean: Vec<[f64; 3]> = expected.iter().map(|e| [e.0; 3]).collect();
    let mut by_mitsuba = Picture::exact(mean);
    by_mitsuba.variance = expected.iter().map(|e| [e.1 * e.1; 3]).collect();
    by_mitsuba.whole.1 = expected.iter().map(|e| e.1 * e.1).sum::<f64>() / 256.0;
    by_mitsuba.freedom = 63.0;
    for backend in [Backend::default_available(), Backend::Obvhs] {
        let scene = prepare(parse(&format!("{ROOM}{shapes}"), &[]), backend, None);
        for spec in sampled_by_pixel().filter(|s| takes(s, &scene)) {
            if backend == Backend::Obvhs && spec.name != "path" {
                continue;
            }
            let mut picture = Picture::render(spec, &scene, &[("max_depth", depth), ("rr_depth", "100")], 64, 1);
            for (mean, variance) in picture.mean.iter_mut().zip(&mut picture.variance) {
                *mean = [mean.iter().sum::<f64>() / 3.0; 3];
                // Channels may vary together: the mean of their deviations bounds that of their mean.
                *variance = [(variance.iter().map(|v| v.sqrt()).sum::<f64>() / 3.0).powi(2); 3];
            }
            picture.assert_agrees(&by_mitsuba, 2e-4, &format!("{name}: {} {backend:?}", spec.name));
        }
    }
}

#[test]
fn textures_on_round_shapes_are_mitsubas() {
    agrees_with_mitsuba("textured", "4", &format!("{LAMP}{TEXTURED}"), &TEXTURED_BY_MITSUBA);
}

/// Direct light only: what the polished shapes throw on the floor is too rare for so few samples.
#[test]
fn anisotropic_round_shapes_are_mitsubas() {
    agrees_with_mitsuba("anisotropic", "2", &format!("{LAMP}{ANISOTROPIC}"), &ANISOTROPIC_BY_MITSUBA);
}

#[test]
fn round_lamps_are_mitsubas() {
    agrees_with_mitsuba("lamps", "4", LAMPS, &LAMPS_BY_MITSUBA);
}

#[test]
fn the_inside_of_a_sphere_that_emits_is_mitsubas() {
    agrees_with_mitsuba("inside", "4", INSIDE, &INSIDE_BY_MITSUBA);
}

#[test]
fn instances_of_round_shapes_are_mitsubas() {
    agrees_with_mitsuba("instances", "4", &format!("{LAMP}{INSTANCES}"), &INSTANCES_BY_MITSUBA);
}
