//! The positions of the joints over time, as a picture.

use crate::expected::Outcome;
use crate::path;
use crate::script::{self, Action};
use bb_core::prelude::*;
use bb_plot::{Band, Line, PALETTE, Panel, Picture};

pub(crate) fn picture(outcome: &Outcome) -> Picture {
    let joints = path::joints();
    let positions = |joint: usize| -> Vec<_> {
        let degrees = |positions: &Vec<f64>| positions.get(joint).map(|position| position.to_degrees());
        outcome.joints.iter().map(|(time_s, positions)| (*time_s, degrees(positions))).collect()
    };
    let name = |path: &str| path.rsplit('/').next().unwrap_or(path).to_owned();
    let lines = joints
        .iter()
        .enumerate()
        .map(|(joint, path)| Line::new(name(path), PALETTE[joint % PALETTE.len()], 1, &positions(joint)));
    let at = |action: Action| {
        script::STEPS.iter().find(|(_, of)| *of == action).map(|(time, _)| time.seconds_since(MonotonicTime::ZERO))
    };
    let unplugged = at(Action::Unplug).zip(at(Action::Plug));
    let unplugged =
        unplugged.map(|times| Band { label: "no IMU at the tip".into(), colour: (245, 190, 190), times });
    let panel = Panel::new("position (deg)", lines.collect()).shade(unplugged.as_slice());
    Picture { title: "an arm that loses the IMU at its tip".into(), panels: vec![panel], panel_size: (1400, 500) }
}
