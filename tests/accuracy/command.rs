//! `bb eval attitude` gives the figures of the filters in a robot: the same samples, the same score.

use crate::attitude;
use crate::recordings::broad;
use bb_cli::{Axes, Chosen, Evaluator, FILTERS, Progress, Setting, Topics, Variants, evaluate};
use std::error::Error;

#[test]
fn the_command_and_a_robot_agree() -> Result<(), Box<dyn Error>> {
    // The runs of the robot, in its order.
    let runs = [
        ("madgwick", Axes::Nine, "beta=0.12"),
        ("madgwick", Axes::Six, "beta=0.03"),
        ("complementary", Axes::Nine, ""),
        ("complementary", Axes::Six, ""),
        ("mekf", Axes::Nine, ""),
        ("mekf", Axes::Six, ""),
        ("mahony", Axes::Nine, "proportional_gain=0.74 integral_gain=0.0012"),
        ("mahony", Axes::Six, "proportional_gain=0.18 integral_gain=0.0015"),
        ("vqf", Axes::Nine, ""),
        ("vqf", Axes::Six, ""),
        ("fusion", Axes::Nine, "gain=0.1 recovery_time=20"),
        ("fusion", Axes::Six, "gain=0.1 recovery_time=20"),
        ("fusion", Axes::Nine, ""),
        ("tilt", Axes::Nine, ""),
        ("tilt", Axes::Six, ""),
    ];
    // One of them disturbed.
    for file in broad()?.into_iter().flatten().rev().take(2) {
        for ((name, axes, setting), robot) in runs.into_iter().zip(attitude::errors(&file)?) {
            let filter = FILTERS.iter().find(|filter| filter.name == name).ok_or("no such filter")?;
            let settings = setting.split_whitespace().map(str::parse::<Setting>).collect::<Result<Vec<_>, _>>()?;
            let filters = Chosen::all(&[filter], axes, &settings)?;
            let (topics, before_motion_s, keep_errors) = (Topics::default(), None, false);
            let variants = Variants::default();
            let evaluator = Evaluator { filters, axes, topics, before_motion_s, variants, keep_errors };
            let evaluation = evaluate(&file, &evaluator, &Progress::new("", 0));
            let command = evaluation.runs?.first().and_then(|run| run.score.rms()).ok_or("no score")?;
            assert_eq!(command, robot, "{name}, {axes:?} axes, {}", file.display());
        }
    }
    Ok(())
}
