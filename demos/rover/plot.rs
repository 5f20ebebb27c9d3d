//! The track, and errors within three standard deviations, as a picture.

use crate::outcome::{Outcome, Point};
use bb_plot::{Band, Colour, Line, PALETTE, Panel, Part, Plane, Scale, Sheet};

/// The truth is thick and light, so that it is seen under the estimate.
const TRUTH: Colour = (190, 190, 190);
const OUTAGE: Colour = (255, 236, 200);

pub(crate) fn picture(outcome: &Outcome) -> Sheet {
    let (start, end) = (outcome.outage.start, outcome.outage.end);
    let path = |is_meant: &dyn Fn(&Point) -> bool, of: &dyn Fn(&Point) -> [f64; 2]| -> Vec<_> {
        outcome.points.iter().filter(|point| is_meant(point)).map(|point| of(point).into()).collect()
    };
    let estimate = |point: &Point| (point.truth + point.error).into();
    let is_out = |point: &Point| (start..end).contains(&point.time_s);
    let track = Plane {
        title: "track".into(),
        x_axis: "east (m)".into(),
        y_axis: "north (m)".into(),
        scale: Scale::Square,
        lines: vec![
            Line::path("truth", TRUTH, 7, &path(&|_| true, &|point| point.truth.into())),
            Line::path("estimate", PALETTE[0], 1, &path(&|_| true, &estimate)),
            Line::path("without satellites", PALETTE[1], 3, &path(&is_out, &estimate)),
        ],
    };
    let line = |value: &dyn Fn(&Point) -> f64| -> Vec<_> {
        outcome.points.iter().map(|point| (point.time_s, Some(value(point)))).collect()
    };
    let outage = Band { label: "no satellites".into(), colour: OUTAGE, times: (start, end) };
    let panels = ["east", "north"].into_iter().enumerate().map(|(axis, name)| {
        let error = line(&|point| point.error[axis]);
        let above = line(&|point| 3.0 * point.deviation[axis]);
        let below = line(&|point| -3.0 * point.deviation[axis]);
        let lines = vec![
            Line::new("3 sigma", PALETTE[1], 1, &above),
            Line::new("-3 sigma", PALETTE[1], 1, &below),
            Line::new("error", PALETTE[0], 2, &error),
        ];
        Part::Panel(Panel::new(format!("error {name} (m)"), lines).shade(std::slice::from_ref(&outage)))
    });
    let parts = std::iter::once(Part::Plane(track, 2)).chain(panels).collect();
    Sheet { title: "a minute without satellites".into(), parts, panel_size: (1400, 300) }
}
