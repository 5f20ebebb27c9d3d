//! The output is the stored one, and what does not happen is named.

use crate::drive::seconds;
use crate::outcome::Outcome;
use crate::{plot, recorded, run, simulated};
use std::error::Error;
use std::path::Path;

#[test]
fn the_drive_is_the_stored_one() -> Result<(), Box<dyn Error>> {
    let outcome = run::simulated(&simulated::drive())?;
    // To renew it: cargo run --example rover > demos/rover/expected.txt
    assert_eq!(format!("{}\n\n{outcome}", run::STORY), include_str!("expected.txt"));
    assert_eq!(outcome.missing(), Vec::<String>::new());
    Ok(())
}

#[test]
fn another_filter_is_four_other_lines() {
    let (one, other) = (include_str!("robot.rs"), include_str!("robot_planar.rs"));
    let differ: Vec<_> = one.lines().zip(other.lines()).filter(|(one, other)| one != other).collect();
    assert_eq!((one.lines().count(), differ.len()), (other.lines().count(), 4), "{differ:#?}");
}

/// Drives with errors a hundred times as large, with fixes in what is said to be the outage, and without any output.
#[test]
fn what_does_not_happen_is_missing() -> Result<(), Box<dyn Error>> {
    let missing = |change: &dyn Fn(&mut Outcome)| -> Result<Vec<String>, Box<dyn Error>> {
        let mut outcome = run::simulated(&simulated::drive())?;
        change(&mut outcome);
        Ok(outcome.missing())
    };
    let too_sure = missing(&|outcome| outcome.points.iter_mut().for_each(|point| point.error *= 100.0))?;
    assert!(too_sure.contains(&"all errors within 3 sigma while there are no fixes".to_owned()), "{too_sure:?}");
    let mut drive = simulated::drive();
    drive.outage = 150.0..170.0;
    let elsewhere = run::simulated(&drive)?.missing();
    assert!(elsewhere.contains(&"bounds that grow as long as there are no fixes".to_owned()), "{elsewhere:?}");
    let empty = missing(&|outcome| outcome.points.clear())?;
    assert!(empty.len() >= 3, "{empty:?}");
    Ok(())
}

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

#[test]
fn a_drive_that_is_not_there_is_named() {
    let error = recorded::drive(Path::new("nowhere/drive")).map(drop).map_err(|error| error.to_string());
    assert!(error.is_err_and(|error| error.starts_with("nowhere/drive_truth.csv: ")));
}

#[test]
fn errors_and_bounds_are_drawn() -> Result<(), Box<dyn Error>> {
    let file = std::env::temp_dir().join(format!("rover-{}.svg", std::process::id()));
    plot::picture(&run::simulated(&simulated::drive())?).write(&file)?;
    let drawn = std::fs::read_to_string(&file)?;
    std::fs::remove_file(&file)?;
    let labels = ["track", "error east (m)", "error north (m)", "3 sigma", "no satellites", "without satellites"];
    assert!(labels.iter().all(|label| drawn.contains(label)));
    Ok(())
}
