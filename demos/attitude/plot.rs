//! Truth and estimate over time, as a picture.

use crate::outcome::{Outcome, Point};
use bb_core::nalgebra::UnitQuaternion;
use bb_plot::{Colour, Line, PALETTE, Panel, Picture};

const ESTIMATE: Colour = PALETTE[0];
const HEADING: Colour = PALETTE[1];
const TRUTH: Colour = PALETTE[3];

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
        let lines =
            vec![Line::degrees("truth", TRUTH, 4, &truth), Line::degrees("estimate", ESTIMATE, 1, &estimate)];
        panels.push(Panel::new(format!("{name} (deg)"), lines));
    }
    let has_heading = outcome.has_heading;
    let heading = line(&|point| point.error.filter(|_| has_heading).map(|error| error.heading.to_degrees()));
    let inclination = line(&|point| point.error.map(|error| error.inclination.to_degrees()));
    let lines =
        vec![Line::peaks("heading", HEADING, 1, &heading), Line::peaks("inclination", ESTIMATE, 1, &inclination)];
    panels.push(Panel::new("error (deg)", lines));
    let title = format!("{} ({})", series.name, outcome.filter);
    Ok(Picture { title, panels, panel_size: (1400, 240) })
}
