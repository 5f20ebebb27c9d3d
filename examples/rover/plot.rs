//! Errors within three standard deviations, as a picture.

use crate::outcome::{Outcome, Point};
use bb_plot::{Line, PALETTE, Panel, Picture};

pub(crate) fn picture(outcome: &Outcome) -> Picture {
    let line = |value: &dyn Fn(&Point) -> f64| -> Vec<_> {
        outcome.points.iter().map(|point| (point.time_s, Some(value(point)))).collect()
    };
    let panels = ["east", "north"].into_iter().enumerate().map(|(axis, name)| {
        let error = line(&|point| point.error[axis]);
        let above = line(&|point| 3.0 * point.deviation[axis]);
        let below = line(&|point| -3.0 * point.deviation[axis]);
        let lines = vec![
            Line::new("3 sigma", PALETTE[1], 1, &above),
            Line::new("-3 sigma", PALETTE[1], 1, &below),
            Line::new("error", PALETTE[0], 2, &error),
        ];
        Panel::new(format!("{name} (m)"), lines)
    });
    Picture { title: "a minute without satellites".into(), panels: panels.collect(), panel_size: (1400, 300) }
}
