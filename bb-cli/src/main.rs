//! The command `bb`.

fn main() -> std::process::ExitCode {
    bb_command::run(std::env::args_os())
}
