//! The `dalean` program.

fn main() -> std::process::ExitCode {
    dalean::cli::main()
}
