//! Truth and estimate over time, as a picture.

use crate::outcome::{Outcome, Point};
use bb_cli::{Line, Panel, Picture};
use bb_core::nalgebra::UnitQuaternion;

const TRUTH: (u8, u8, u8) = (250, 170, 60);
const ESTIMATE: (u8, u8, u8) = (0, 80, 170);
const ERROR: (u8, u8, u8) = (210, 50, 30);

/// Roll, pitch and yaw of the first series, then its errors.
pub(crate) fn picture(outcome: &Outcome) -> Result<Picture, String> {
    let Some(series) = outcome.series.first().filter(|series| series.len() > 1) else {
        return Err("there is nothing to plot: no estimate was published".into());
    };
    let line = |value: &dyn Fn(&Point) -> Option<f64>| -> Vec<_> {
        series.points.iter().map(|point| (point.time_s, value(point))).collect()
    };
    let mut panels = Vec::new();
    for (index, name) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
        let angle = |rotation: &UnitQuaternion<f64>| {
            let (roll, pitch, yaw) = rotation.euler_angles();
            [roll, pitch, yaw][index].to_degrees()
        };
        let truth = line(&|point| point.truth.as_ref().map(angle));
        let estimate = line(&|point| Some(angle(&point.estimate)));
        let lines = vec![Line::new("truth", TRUTH, 4, &truth), Line::new("estimate", ESTIMATE, 1, &estimate)];
        panels.push(Panel { name: format!("{name}, deg over s"), lines });
    }
    let has_heading = outcome.has_heading;
    let heading = line(&|point| point.error.filter(|_| has_heading).map(|error| error.heading.to_degrees()));
    let inclination = line(&|point| point.error.map(|error| error.inclination.to_degrees()));
    let lines = vec![Line::new("heading", ERROR, 1, &heading), Line::new("inclination", ESTIMATE, 1, &inclination)];
    panels.push(Panel { name: "error, deg over s".into(), lines });
    let title = format!("{} ({})", series.name, outcome.filter);
    Ok(Picture { title, panels, panel_size: (1400, 240) })
}
