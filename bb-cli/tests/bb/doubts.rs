//! `bb eval attitude` on recordings whose errors are not those of the filters: it says what looks wrong.

use crate::common::{Walk, eval};
use bb_core::nalgebra::{Quaternion, UnitQuaternion, Vector3 as V};
use serde_json::Value;

/// Ten seconds, most of them a turn about a level axis: gravity turns in the body.
fn roll() -> Walk {
    Walk { samples: 1000, axis: V::x(), ..Walk::default() }
}

/// Returns the notes that are printed beside the table.
fn notes(walk: Walk, name: &str, arguments: &[&str]) -> Vec<String> {
    let file = walk.file(name);
    let output = eval(&[&file], &[&["--filter", "mekf,madgwick"], arguments].concat());
    assert_eq!(output.code, Some(0), "{}", output.err);
    let lead = format!("note: {}: ", file.display());
    output.err.lines().map(|line| line.strip_prefix(&lead).expect("a note").to_owned()).collect()
}

#[test]
fn nothing_is_said_of_a_good_recording() {
    assert_eq!(notes(roll(), "doubt_good.mcap", &[]), [""; 0]);
    assert_eq!(notes(roll(), "doubt_good.mcap", &["--axes", "6"]), [""; 0]);
    assert_eq!(notes(Walk::default(), "doubt_level.mcap", &[]), [""; 0]);
}

#[test]
fn units_that_look_wrong_are_named_with_their_topic() {
    let gyroscope = notes(Walk { units: [57.29578, 1.0, 1.0], ..roll() }, "doubt_deg.mcap", &[]);
    assert!(gyroscope[0].starts_with("/imu: the angular velocity looks to be in deg/s: "), "{gyroscope:?}");
    let force = notes(Walk { units: [1.0, 1.0 / 9.81, 1.0], ..roll() }, "doubt_g.mcap", &[]);
    assert_eq!(force[0], "/imu: the specific force has a median of 1.000: it looks to be in g; ROS has m/s²");
    let field = notes(Walk { units: [1.0, 1.0, 1e6], ..roll() }, "doubt_ut.mcap", &[]);
    assert_eq!(field[0], "/mag: the magnetic field has a median of 44.721: it looks to be in µT; ROS has T");
    // Once, and not for each variant; and of what was recorded, without what a variant adds.
    let variants = notes(roll(), "doubt_variants.mcap", &["--offset", "300uT:3"]);
    assert_eq!(variants, [""; 0]);
    let walk = Walk { units: [1.0, 1.0 / 9.81, 1.0], ..roll() };
    assert_eq!(notes(walk, "doubt_g_variants.mcap", &["--start", "random:3"]).len(), 1);
}

#[test]
fn a_truth_in_another_convention_is_named() {
    let inverse = notes(Walk { written: |truth| truth.inverse(), ..roll() }, "doubt_inverse.mcap", &[]);
    let lead = "/truth: the truth looks to be inverse, `body_from_world`: with it read so, ";
    assert!(inverse.len() == 1 && inverse[0].starts_with(lead), "{inverse:?}");
    assert!(inverse[0].ends_with("; it should be `world_from_body` in east, north, up"), "{inverse:?}");
    let six = notes(Walk { written: |truth| truth.inverse(), ..roll() }, "doubt_inverse.mcap", &["--axes", "6"]);
    assert!(six[0].starts_with(lead), "{six:?}");

    let ned = |truth: UnitQuaternion<f64>| {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        UnitQuaternion::new_normalize(Quaternion::new(0.0, half, half, 0.0)) * truth
    };
    let ned = notes(Walk { written: ned, ..roll() }, "doubt_ned.mcap", &[]);
    assert!(ned[0].starts_with("/truth: the truth looks to be in north, east, down: with it read so"), "{ned:?}");
    // A heading that is off, as of a room whose axes are not east and north, is nothing of that.
    let turned = notes(Walk { error: 0.8, ..roll() }, "doubt_heading.mcap", &[]);
    assert_eq!(turned.len(), 1);
    assert!(turned[0].starts_with("the truth's world is turned about the vertical by -45.8 deg"), "{turned:?}");
    assert!(turned[0].contains(": --align heading"), "{turned:?}");
    let aligned = notes(Walk { error: 0.8, ..roll() }, "doubt_heading.mcap", &["--align", "heading"]);
    assert!(aligned.iter().all(|note| note.contains("the truth is turned by")), "{aligned:?}");
}

#[test]
fn a_magnetometer_that_says_nothing_is_no_axis() {
    let file = Walk { silent: true, ..roll() }.file("doubt_silent.mcap");
    let output = eval(&[&file], &["--filter", "mekf"]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    let note = format!("note: {}: /mag holds no message, so six axes are scored\n", file.display());
    assert_eq!(output.err, note);
    assert!(output.out.starts_with("Error against the truth, six axes"), "{}", output.out);

    // Beside one that has nine, which alone make the averages.
    let nine = ["doubt_one.mcap", "doubt_two.mcap"].map(|name| roll().file(name));
    let output = eval(&[&file, &nine[0], &nine[1]], &["--filter", "mekf"]);
    assert!(output.out.starts_with("Error against the truth, nine axes"), "{}", output.out);
    let cells = |start: &str| {
        let line = output.out.lines().find(|line| line.starts_with(start)).expect("is there");
        line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(cells("doubt_silent")[2..4], ["-", "-"]);
    assert!(cells("doubt_one")[2].parse::<f64>().is_ok());
    assert_eq!(cells("mean of")[2], "2");
    let output = eval(&[&file, &nine[0]], &["--filter", "mekf", "--json"]);
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!((&rows[0]["axes"], &rows[0]["total_deg"]), (&"six".into(), &Value::Null));
    assert_eq!(rows[1]["axes"], "nine");

    let output = eval(&[&file], &["--filter", "mekf", "--magnet", "30uT"]);
    assert_eq!(output.code, Some(1));
    assert!(output.err.contains("/mag holds no message, so --offset, --magnet"), "{}", output.err);
}
