//! Every eye vertex is connected to the vertices of one light sub-path, which the pixel traces for itself or shares
//! with a few others.

use crate::bidir::{Candidate, ConnectionStrategy, EyeVertex};
use crate::math::sampler::PathSampler;
use crate::math::{Rgb, Vec3};
use crate::mis::factors::Balance;
use crate::path::StoredPlace;

/// The strategy of bidirectional path tracing.
#[derive(Clone, Copy, Debug, Default)]
pub struct OwnSubpath;

/// Light vertices whose connections are left out or made independently of each other; a vertex beyond has the choice of
/// an earlier one.
const INDEPENDENT: usize = 64;

/// A mask in which each bit is set independently with the probability `fraction`, a power of two of at most one.
#[inline]
fn random_mask(fraction: f32, sampler: &mut PathSampler) -> u64 {
    let (mut mask, mut share) = (u64::MAX, 1.0);
    while share > fraction {
        mask &= sampler.rng().next_u64();
        share *= 0.5;
    }
    mask
}

impl ConnectionStrategy for OwnSubpath {
    type Factor = Balance;
    type Lookup = ();

    fn factor(&self) -> Balance {
        Balance
    }

    #[inline]
    fn draw<'a>(
        &'a self,
        eye: &EyeVertex<'a, '_>,
        sampler: &mut PathSampler,
        wanted: impl Fn(usize) -> bool,
        mut connect: impl FnMut(Candidate<'a, ()>),
    ) {
        let light = eye.own;
        if light.vertices.is_empty() {
            return;
        }
        let mask = random_mask(eye.fraction, sampler);
        for (number, vertex) in light.vertices.iter().enumerate() {
            if mask >> (number % INDEPENDENT) & 1 == 1 && wanted(vertex.length()) {
                connect(Candidate {
                    vertex,
                    bsdf: vertex.bsdf_in(&light.bsdfs),
                    pdfs: light.pdfs.first(vertex.length()),
                    emitter: light.emitter,
                    origin: light.origin,
                    number: None,
                    scale: 1.0 / eye.fraction,
                    selected: None,
                    lookup: None,
                });
            }
        }
    }

    #[inline]
    fn edge(&self, (): &(), _y: &StoredPlace, _value: impl Fn(Vec3) -> Rgb) {}
}
