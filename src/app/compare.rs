//! `lightsieve compare`.

use super::Failure;
use super::cli::CompareArgs;

pub(crate) fn run(args: &CompareArgs) -> Result<(), Failure> {
    let _ = args;
    Ok(())
}
