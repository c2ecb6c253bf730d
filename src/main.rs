//! The `graver` command; see the library of the same name.

fn main() -> std::process::ExitCode {
    graver::main()
}
