//! The connection factors of all methods, one formula a file.

pub mod balance;
pub mod per_cache;
pub mod per_length;
pub mod record_mixture;
pub mod ris;
pub mod uniform;

pub use balance::Balance;
pub use per_cache::{CacheTerm, CacheTerms, PerCacheFactor};
pub use per_length::{LengthTerm, LengthTerms, PerLengthFactor, PerLengthMeans};
pub use record_mixture::{RecordMixtureFactor, RecordNormalization};
pub use ris::{NormalizationEstimate, RisFactor, Stages};
pub use uniform::UniformFactor;
