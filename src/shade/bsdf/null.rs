//! No surface: light goes straight on.

use super::model::{DeltaSample, LobeSample, Model, TextureBinder};
use crate::math::{Rgb, Vec3};
use crate::shade::SurfacePoint;

/// Straight transmission, of null materials and of the holes of masks. It has no parameters and no row in the table of
/// models.
#[derive(Clone, Copy, Debug)]
pub(super) struct Null;

impl Model for Null {
    type Params = ();
    type Textured = ();
    const SMOOTH: bool = false;
    const DELTA: bool = true;

    fn bind(_: &(), _: &mut TextureBinder) -> Result<(), String> {
        Ok(())
    }

    fn at(_: &(), _: &SurfacePoint) -> Null {
        Null
    }

    fn eval_pdf(&self, _: Vec3, _: Vec3) -> (Rgb, f32) {
        (Rgb::BLACK, 0.0)
    }

    fn sample(&self, a: Vec3, _: [f32; 3]) -> Option<LobeSample> {
        let (value, pdf) = (Rgb::WHITE, 1.0);
        Some(LobeSample::Delta(DeltaSample { b: -a, value, pdf, pdf_reverse: pdf, eta: 1.0, passes_through: true }))
    }

    fn albedo(&self) -> Rgb {
        Rgb::WHITE
    }

    fn is_one_sided(&self) -> bool {
        false
    }
}
