//! The demonstration `rover` with the filter of a robot that drives on a plane; see `main.rs`.

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
    use crate::drive::seconds;
    use crate::{recorded, run, simulated};
    use std::error::Error;

    #[test]
    fn the_drive_is_the_stored_one() -> Result<(), Box<dyn Error>> {
        let outcome = run::simulated(&simulated::drive())?;
        // To renew it: cargo run --example rover_planar > demos/rover/expected_planar.txt
        assert_eq!(format!("{}\n\n{outcome}", run::STORY), include_str!("expected_planar.txt"));
        assert_eq!(outcome.missing(), Vec::<String>::new());
        Ok(())
    }

    /// Recorded drive on a plane and without wheels, as `--data` plays it.
    #[test]
    #[ignore = "needs recordings: .ci/run runs it"]
    fn the_recorded_drive_keeps_within_its_bounds() -> Result<(), Box<dyn Error>> {
        let mut drive = recorded::drive(&bb_tests::recordings::navigation()?.join("kitti_s2"))?;
        // The rest of it is driven by the command alone.
        drive.events.retain(|(time, _)| seconds(*time) < 205.0);
        let outcome = run::of_record(&drive)?;
        assert_eq!(outcome.missing(), Vec::<String>::new(), "{outcome}");
        assert!(outcome.points.len() > 190);
        Ok(())
    }
}
