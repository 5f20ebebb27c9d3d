//! The example `rover` with the filter of a robot that drives on a plane; see `main.rs`.

mod arguments;
mod drive;
mod outcome;
mod plot;
mod recorded;
#[path = "robot_planar.rs"]
mod robot;
mod run;
mod simulated;

fn main() -> std::process::ExitCode {
    run::main()
}

#[cfg(test)]
mod tests {
    use crate::{run, simulated};
    use std::error::Error;

    #[test]
    fn the_drive_is_the_stored_one() -> Result<(), Box<dyn Error>> {
        let outcome = run::simulated(&simulated::drive())?;
        // To renew it: cargo run --example rover_planar > examples/rover/expected_planar.txt
        assert_eq!(outcome.to_string(), include_str!("expected_planar.txt"));
        assert_eq!(outcome.missing(), Vec::<String>::new());
        Ok(())
    }
}
