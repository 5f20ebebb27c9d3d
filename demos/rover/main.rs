//! A rover that loses its satellites for a minute, and says how little it knows meanwhile.
//!
//! Without arguments the drive is simulated; `--data PREFIX` plays a recorded one, CSV files as `bb eval navigation` takes them.
//! It fails if an error was beyond what the filter said, or anything else that it claims did not happen. The demonstration
//! `rover_planar` is the same with another filter, which takes four other lines: `robot.rs` and `robot_planar.rs`.

mod arguments;
mod drive;
mod outcome;
mod plot;
mod recorded;
mod robot;
mod run;
mod simulated;
#[cfg(test)]
mod tests;

fn main() -> std::process::ExitCode {
    run::main()
}
