//! Whether this processor has the instructions that the program was compiled for.
//!
//! Without the check, a program on an older processor dies of an illegal instruction, which explains nothing. The macro
//! `is_x86_feature_detected!` cannot make it: features that are enabled at compile time are constants of value true to it.
//! So the CPUID instruction itself is asked.

/// Names of the instruction sets that the program was compiled for and the processor lacks.
#[cfg(target_arch = "x86_64")]
pub(crate) fn missing_instruction_sets() -> Vec<&'static str> {
    let cpu = raw_cpuid::CpuId::new();
    let basic = cpu.get_feature_info();
    let structured = cpu.get_extended_feature_info();
    let extended = cpu.get_extended_processor_and_feature_identifiers();
    macro_rules! instruction_set {
        ($name:literal, $leaf:ident.$has:ident()) => {
            ($name, cfg!(target_feature = $name), $leaf.as_ref().is_some_and(|leaf| leaf.$has()))
        };
    }
    missing(&[
        instruction_set!("sse3", basic.has_sse3()),
        instruction_set!("ssse3", basic.has_ssse3()),
        instruction_set!("sse4.1", basic.has_sse41()),
        instruction_set!("sse4.2", basic.has_sse42()),
        instruction_set!("popcnt", basic.has_popcnt()),
        instruction_set!("cmpxchg16b", basic.has_cmpxchg16b()),
        instruction_set!("avx", basic.has_avx()),
        instruction_set!("f16c", basic.has_f16c()),
        instruction_set!("fma", basic.has_fma()),
        instruction_set!("movbe", basic.has_movbe()),
        instruction_set!("avx2", structured.has_avx2()),
        instruction_set!("bmi1", structured.has_bmi1()),
        instruction_set!("bmi2", structured.has_bmi2()),
        instruction_set!("lzcnt", extended.has_lzcnt()),
        instruction_set!("avx512f", structured.has_avx512f()),
        instruction_set!("avx512bw", structured.has_avx512bw()),
        instruction_set!("avx512cd", structured.has_avx512cd()),
        instruction_set!("avx512dq", structured.has_avx512dq()),
        instruction_set!("avx512vl", structured.has_avx512vl()),
        // The operating system must save the wide registers of AVX.
        (
            "xsave (operating system)",
            cfg!(target_feature = "avx"),
            basic.as_ref().is_some_and(raw_cpuid::FeatureInfo::has_oxsave),
        ),
    ])
}

/// The names of the instruction sets (name, needed, present) that are needed and not present.
#[cfg(target_arch = "x86_64")]
fn missing(sets: &[(&'static str, bool, bool)]) -> Vec<&'static str> {
    sets.iter().filter(|(_, needed, present)| *needed && !present).map(|set| set.0).collect()
}

/// Other architectures are compiled for their baseline.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) fn missing_instruction_sets() -> Vec<&'static str> {
    Vec::new()
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    #[test]
    fn what_runs_this_test_has_what_it_was_compiled_for() {
        assert!(missing_instruction_sets().is_empty());
    }

    #[test]
    fn needed_and_not_present_is_missing() {
        let sets = [("a", true, true), ("b", true, false), ("c", false, false), ("d", false, true), ("e", true, false)];
        assert_eq!(missing(&sets), ["b", "e"]);
    }
}
