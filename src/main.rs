//! The program: parse, run, exit code. Everything else is in the library's `app` room.

fn main() -> std::process::ExitCode {
    lightsieve::app::main()
}
