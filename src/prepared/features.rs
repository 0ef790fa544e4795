//! Features of a scene. A renderer may skip the code for features that the scene lacks.

/// A set of features.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features(u32);

macro_rules! features {
    ($($(#[$doc:meta])* $name:ident = $bit:literal, $text:literal;)*) => {
        impl Features {
            $($(#[$doc])* pub const $name: Features = Features(1 << $bit);)*
            const NAMES: &'static [(Features, &'static str)] = &[$((Features::$name, $text)),*];
        }
    };
}

features! {
    /// Some material looks up a picture or pattern.
    TEXTURES = 0, "textures";
    /// Some surface lets a share of the light straight through.
    MASKS = 1, "masks";
    /// Some light is a point, a spot or parallel.
    DELTA_LIGHTS = 2, "delta-lights";
    /// Light from beyond the scene that arrives from a range of directions.
    ENVIRONMENT = 3, "environment";
    /// Some material reflects or transmits in single directions.
    SPECULAR = 4, "specular";
    /// The camera has a lens.
    THIN_LENS = 5, "thin-lens";
    /// Some mesh has normals of its own.
    SHADING_NORMALS = 6, "shading-normals";
    /// Some group is placed by instances.
    INSTANCES = 7, "instances";
    /// Only part of the picture is rendered.
    CROP = 8, "crop";
    /// Some surface emits.
    AREA_LIGHTS = 9, "area-lights";
    /// Some material scatters into lobes so narrow that connections hardly ever meet them.
    NEARLY_SPECULAR = 10, "nearly-specular";
    /// Light is scattered or absorbed between surfaces.
    MEDIA = 11, "media";
}

impl Features {
    /// Has all of `other`.
    pub fn contains(self, other: Features) -> bool {
        self.0 & other.0 == other.0
    }

    /// Adds `other` if `condition` holds.
    pub fn set(&mut self, other: Features, condition: bool) {
        if condition {
            self.0 |= other.0;
        }
    }

    /// Names of the features, for people and statistics.
    pub fn names(self) -> Vec<&'static str> {
        Features::NAMES.iter().filter(|(f, _)| self.contains(*f)).map(|&(_, n)| n).collect()
    }
}
