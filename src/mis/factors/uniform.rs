//! c of a connection to a light vertex that is drawn uniformly from all connectable vertices of the M light sub-paths
//! of an iteration.
//!
//! The M sub-paths have M p(ȳ) of a prefix ȳ, per unit measure, among V = L M vertices. Each draw has a given vertex
//! with the probability 1/V, so that its density is M p(ȳ)/V = p(ȳ)/L, and
//!
//! c = 1/L.
//!
//! L is the mean number of connectable vertices of a light sub-path in earlier iterations: the V of the iteration
//! itself would make weights depend on the sub-paths that they weigh.

use crate::mis::factor::{ConnectionFactor, IncidentSubpath};

/// The factor; see the module's head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniformFactor {
    /// L; 0 if nothing is known yet.
    pub vertices_per_path: f32,
}

impl ConnectionFactor for UniformFactor {
    type Edge = ();

    #[inline]
    fn c(&self, _light: &IncidentSubpath, (): &()) -> f32 {
        if self.vertices_per_path > 0.0 { 1.0 / self.vertices_per_path } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_is_one_of_many() {
        let c = |vertices_per_path| UniformFactor { vertices_per_path }.c(&IncidentSubpath::default(), &());
        assert_eq!([c(4.0), c(0.5), c(0.0)], [0.25, 2.0, 1.0]);
    }
}
