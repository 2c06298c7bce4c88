//! The `kinocue` program: arguments in, exit code out; everything else lives in the library.

fn main() -> std::process::ExitCode {
    kinocue::cli::main()
}
