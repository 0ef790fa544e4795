//! Dispatch to the scattering models: one enum for models with textures, one for lobes at a point, both made from the
//! table `scene::bsdf_models!`.

use super::conductor::{Conductor, RoughConductor};
use super::dielectric::{Dielectric, ThinDielectric};
use super::diffuse::Diffuse;
use super::features::Features;
use super::model::{LobeSample, Model, TextureBinder, features_of};
use super::phong::Phong;
use super::plastic::Plastic;
use super::pplastic::PolarizedPlastic;
use super::principled::Principled;
use super::rough_dielectric::RoughDielectric;
use super::rough_plastic::RoughPlastic;
use super::ward::Ward;
use crate::math::{Rgb, Vec3};
use crate::scene::{BsdfModel, bsdf_models};
use crate::shade::SurfacePoint;

macro_rules! define_lobes {
    ($($(#[$about:meta])* $name:literal $Model:ident($Params:ident) { $($params:tt)* })*) => {
        /// A scattering model with its textures.
        #[derive(Debug)]
        pub(super) enum TexturedModel {
            $($Model(<$Model as Model>::Textured),)*
        }

        impl TexturedModel {
            /// Binds the textures of a description.
            pub fn bind(desc: &BsdfModel, binder: &mut TextureBinder) -> Result<TexturedModel, String> {
                Ok(match desc {
                    $(BsdfModel::$Model(params) => TexturedModel::$Model($Model::bind(params, binder)?),)*
                })
            }

            /// The model at a point.
            pub fn at(&self, point: &SurfacePoint) -> Lobe {
                match self {
                    $(TexturedModel::$Model(textured) => Lobe::$Model($Model::at(textured, point)),)*
                }
            }
        }

        /// Features of a described model, textures aside.
        pub(super) fn features(desc: &BsdfModel) -> Features {
            match desc {
                $(BsdfModel::$Model(params) => features_of::<$Model>(params),)*
            }
        }

        /// True if a described model scatters nothing at any point.
        pub(super) fn is_black(desc: &BsdfModel) -> bool {
            match desc {
                $(BsdfModel::$Model(params) => $Model::is_black(params),)*
            }
        }

        /// A scattering model at a point; see [`Model`] for the conventions.
        #[derive(Clone, Copy, Debug)]
        pub(super) enum Lobe {
            $($Model($Model),)*
        }

        impl Lobe {
            /// Value (radiance, cosine weighted) and density of `b` given `a`, discrete events excluded.
            #[inline]
            pub fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
                match self {
                    $(Lobe::$Model(lobe) => lobe.eval_pdf(a, b),)*
                }
            }

            /// Density of `b` given `a`, discrete events excluded.
            #[inline]
            pub fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
                match self {
                    $(Lobe::$Model(lobe) => lobe.pdf(a, b),)*
                }
            }

            /// Draws a direction.
            pub fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
                match self {
                    $(Lobe::$Model(lobe) => lobe.sample(a, u),)*
                }
            }

            /// Approximate albedo, equal for all directions and both sides.
            pub fn albedo(&self) -> Rgb {
                let albedo = match self {
                    $(Lobe::$Model(lobe) => lobe.albedo(),)*
                };
                albedo.map(|c| c.clamp(0.0, 1.0))
            }

            /// True if the lobe has a density, and so can be connected to.
            pub fn is_smooth(&self) -> bool {
                match self {
                    $(Lobe::$Model(_) => $Model::SMOOTH,)*
                }
            }

            /// Interior / exterior refractive index, for the (1/η)² of refracted radiance; 1 where nothing is
            /// refracted.
            #[inline]
            pub fn eta(&self) -> f32 {
                match self {
                    $(Lobe::$Model(lobe) => lobe.eta(),)*
                }
            }

            /// True if the back scatters nothing.
            pub fn is_one_sided(&self) -> bool {
                match self {
                    $(Lobe::$Model(lobe) => lobe.is_one_sided(),)*
                }
            }
        }
    };
}
bsdf_models!(define_lobes);
