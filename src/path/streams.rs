//! Random streams: every use of random numbers in the program has a stream of its own, so that no two uses are
//! correlated.
//!
//! A stream is the second argument of [`PathSampler::new`](crate::math::sampler::PathSampler::new) and of
//! [`HashRng::new`](crate::math::hash::HashRng::new). Bits 32 and above are free for a number that tells sets of one
//! use apart.

/// Eye sub-paths of bidirectional methods.
pub const EYE: u64 = 1;
/// Camera rays of auxiliary layers (albedo, normal, depth).
pub const AUXILIARY: u64 = 2;
/// Light sub-paths.
pub const LIGHT: u64 = 3;
/// Eye sub-paths whose vertices become cache points or importance records.
pub const CACHE: u64 = 4;
/// Light sub-paths that estimate normalisations before the first iteration.
pub const WARM_UP: u64 = 5;
/// Representatives of the clusters of a first resampling stage.
pub const FIRST_STAGE: u64 = 6;
/// Which pixels share a light sub-path.
pub const ASSIGNMENT: u64 = 7;
/// Paths of the path tracer. They are not the eye sub-paths of bidirectional methods, so that renders of both with one
/// seed are independent.
pub const PATH: u64 = 8;
/// Paths of the path tracer that only tell how well it does, and are not part of a picture.
pub const PATH_PROBE: u64 = 9;

/// Eye sub-paths that find the rays of lights which matter.
pub const EMISSION_TRAINING: u64 = 10;

/// Every stream with its name.
pub const ALL: [(&str, u64); 10] = [
    ("eye", EYE),
    ("auxiliary", AUXILIARY),
    ("light", LIGHT),
    ("cache", CACHE),
    ("warm-up", WARM_UP),
    ("first stage", FIRST_STAGE),
    ("assignment", ASSIGNMENT),
    ("path", PATH),
    ("path probe", PATH_PROBE),
    ("emission training", EMISSION_TRAINING),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_distinct_and_leave_the_upper_bits_free() {
        for (i, (name, stream)) in ALL.iter().enumerate() {
            assert!(*stream < 1 << 32, "{name}");
            assert!(ALL[..i].iter().all(|(_, other)| other != stream), "{name}");
        }
    }
}
