//! Whether this processor has the instruction sets that the program was compiled for.
//!
//! Without the check, a program on an older processor dies of an illegal instruction, which explains nothing. The macro
//! `is_x86_feature_detected!` cannot make it: features that are enabled at compile time are constants of value true to
//! it. So the CPUID instruction itself is asked. All crates are compiled for the same instruction sets, this file too,
//! and copying a struct by a vector register would already be too much: it works on single whole numbers, and prints by
//! functions of the standard library, which is compiled for the oldest processors. `.ci/run` starts the program on an
//! emulated one.

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use raw_cpuid::cpuid;
    use std::io::Write;

    /// A register of CPUID that has a bit for each of several instruction sets.
    #[derive(Clone, Copy, PartialEq, Eq)]
    enum Register {
        /// Leaf 1, ecx.
        Basic,
        /// Leaf 7, ebx.
        Structured,
        /// Leaf 8000_0001h, ecx.
        Extended,
    }

    struct InstructionSet {
        name: &'static str,
        /// The program was compiled for it.
        needed: bool,
        register: Register,
        bit: u32,
    }

    macro_rules! instruction_set {
        ($name:tt, $register:ident, $bit:literal) => {
            InstructionSet {
                name: concat!(" ", $name),
                needed: cfg!(target_feature = $name),
                register: Register::$register,
                bit: $bit,
            }
        };
    }

    /// Bits of Intel's Software Developer's Manual, volume 2, CPUID, and AMD's Programmer's Manual, volume 3, appendix
    /// E.
    static INSTRUCTION_SETS: [InstructionSet; 20] = [
        instruction_set!("sse3", Basic, 0),
        instruction_set!("ssse3", Basic, 9),
        instruction_set!("fma", Basic, 12),
        instruction_set!("cmpxchg16b", Basic, 13),
        instruction_set!("sse4.1", Basic, 19),
        instruction_set!("sse4.2", Basic, 20),
        instruction_set!("movbe", Basic, 22),
        instruction_set!("popcnt", Basic, 23),
        // The operating system saves the wide registers.
        InstructionSet { name: " osxsave", needed: cfg!(target_feature = "avx"), register: Register::Basic, bit: 27 },
        instruction_set!("avx", Basic, 28),
        instruction_set!("f16c", Basic, 29),
        instruction_set!("bmi1", Structured, 3),
        instruction_set!("avx2", Structured, 5),
        instruction_set!("bmi2", Structured, 8),
        instruction_set!("avx512f", Structured, 16),
        instruction_set!("avx512dq", Structured, 17),
        instruction_set!("avx512cd", Structured, 28),
        instruction_set!("avx512bw", Structured, 30),
        instruction_set!("avx512vl", Structured, 31),
        instruction_set!("lzcnt", Extended, 5),
    ];

    /// The register's bits of instruction sets that the program was compiled for.
    const fn needed(register: Register) -> u32 {
        let mut bits = 0;
        let mut i = 0;
        while i < INSTRUCTION_SETS.len() {
            let set = &INSTRUCTION_SETS[i];
            if set.needed && set.register as u32 == register as u32 {
                bits |= 1 << set.bit;
            }
            i += 1;
        }
        bits
    }

    /// True if an instruction set is missing, which is reported on standard error.
    #[inline(never)]
    pub(crate) fn reports_missing_instruction_sets() -> bool {
        const BASIC: u32 = needed(Register::Basic);
        const STRUCTURED: u32 = needed(Register::Structured);
        const EXTENDED: u32 = needed(Register::Extended);
        let basic = BASIC & !cpuid!(1).ecx;
        let structured = STRUCTURED & !if cpuid!(0).eax >= 7 { cpuid!(7).ebx } else { 0 };
        let extended =
            EXTENDED & !if cpuid!(0x8000_0000_u32).eax > 0x8000_0000 { cpuid!(0x8000_0001_u32).ecx } else { 0 };
        if basic | structured | extended == 0 {
            return false;
        }
        report(basic, structured, extended);
        true
    }

    /// Prints the names of the instruction sets whose bits are set.
    #[cold]
    #[inline(never)]
    fn report(basic: u32, structured: u32, extended: u32) {
        let print = |text: &str| {
            let _ = std::io::stderr().write_all(text.as_bytes());
        };
        print("error: this program was compiled for newer processors; this one lacks");
        for set in &INSTRUCTION_SETS {
            let missing = match set.register {
                Register::Basic => basic,
                Register::Structured => structured,
                Register::Extended => extended,
            };
            if missing >> set.bit & 1 == 1 {
                print(set.name);
            }
        }
        print("\nhelp: build it for this processor: RUSTFLAGS=\"-C target-cpu=native\" cargo build --release\n");
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn what_runs_this_test_has_what_it_was_compiled_for() {
            assert!(!reports_missing_instruction_sets());
        }

        #[test]
        fn needed_bits_are_those_of_the_compiler() {
            assert_eq!(needed(Register::Structured) >> 5 & 1 == 1, cfg!(target_feature = "avx2"));
            assert_eq!(needed(Register::Basic) >> 27 & 1 == 1, cfg!(target_feature = "avx"));
            assert_eq!(needed(Register::Extended), u32::from(cfg!(target_feature = "lzcnt")) << 5);
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86_64::reports_missing_instruction_sets;

/// Other architectures are compiled for their baseline.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) fn reports_missing_instruction_sets() -> bool {
    false
}
