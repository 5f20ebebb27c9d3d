//! The command `bb`.

fn main() -> std::process::ExitCode {
    bb_cli::run(std::env::args_os())
}
