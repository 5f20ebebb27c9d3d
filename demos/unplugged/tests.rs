//! The output is the stored one, and what is missing is named.

use crate::expected::EXPECTED;
use crate::rover::Rover;
use crate::timeline::{self, Kind, Line};
use crate::{Arguments, run, tell};
use std::error::Error;

#[test]
fn the_story_on_virtual_time_is_the_stored_one() -> Result<(), Box<dyn Error>> {
    let mut out = Vec::new();
    assert!(tell(Rover::builder(), &Arguments { real_time: false }, &mut out)?);
    // To renew it: cargo run --example unplugged > demos/unplugged/expected.txt
    assert_eq!(String::from_utf8(out)?, include_str!("expected.txt"));
    Ok(())
}

/// A setting from outside takes effect: the speed is a parameter, so another one is another story.
#[test]
fn a_setting_from_outside_takes_effect() -> Result<(), Box<dyn Error>> {
    let mut builder = Rover::builder();
    builder.set("command/drive/speed", "0.5 m/s")?;
    let lines = run::on_virtual_time(builder, &mut std::io::sink())?;
    let speeds: Vec<&str> =
        lines.iter().filter(|line| line.kind == Kind::Parameter).map(|line| line.event.as_str()).collect();
    assert_eq!(speeds.first(), Some(&"speed 0.0 -> 0.5"));
    Ok(())
}

#[test]
fn the_tutorial_shows_a_part_of_it() {
    let chapter = include_str!("../../book/src/tutorial/4-failing-sensors.md");
    let shown: Vec<&str> = chapter.split("```text\n").filter_map(|rest| rest.split("```").next()).collect();
    assert!(
        shown.iter().any(|block| block.contains("  hardware  ") && include_str!("expected.txt").contains(block))
    );
}

#[test]
fn what_has_not_happened_in_its_order_is_missing() -> Result<(), Box<dyn Error>> {
    let lines = run::on_virtual_time(Rover::builder(), &mut std::io::sink())?;
    assert_eq!(timeline::missing(EXPECTED, &lines), []);
    let without: Vec<Line> = lines.iter().filter(|line| line.event != "drive refused").cloned().collect();
    assert_eq!(timeline::missing(EXPECTED, &without), [(Kind::Command, "drive refused")]);
    let mut late = lines.clone();
    if let Some(first) = late.iter().position(|line| line.event == "disarmed -> idle") {
        let line = late.remove(first);
        late.push(line);
    }
    assert!(!timeline::missing(EXPECTED, &late).is_empty());
    Ok(())
}
