//! The example of two machines, as it is run by hand: it takes a third of a minute, and fails unless all happened that should.

#[path = "../examples/two_machines/main.rs"]
mod story;

fn main() -> std::process::ExitCode {
    story::main()
}
