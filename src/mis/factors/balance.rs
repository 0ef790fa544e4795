//! c = 1: bidirectional path tracing, and methods whose weights do not know of resampling (PCBPT, Popov et al. 2015).

use crate::mis::factor::{ConnectionFactor, IncidentSubpath};

/// c = 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Balance;

impl ConnectionFactor for Balance {
    type Edge = ();

    const IS_ONE: bool = true;

    #[inline]
    fn c(&self, _light: &IncidentSubpath, (): &()) -> f32 {
        1.0
    }
}
