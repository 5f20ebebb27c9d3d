//! Results of a flight: events, and errors against the truth.

use crate::sensors::frame;
use crate::timeline::Happened;
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_estimators::navigation::Geodetic;
use bb_estimators::navigation::state_estimator::{
    FlightEstimate, FlightEvent, FlightEvents, FlightHealth, Level, SourceLabel,
};
use bb_plot::{Line, PALETTE, Panel, Picture};
use std::fmt::Write;

/// Words of the timeline, with what they mean.
const WORDS: [(&str, &str); 12] = [
    ("satellite_anchored", "the last anchor, which tells where the drone is in the world, is fresh"),
    ("visual_propagated", "the camera has carried the estimate on since the last anchor"),
    ("dead_reckoned", "only the IMU carries it on"),
    ("covariance_growing", "it becomes less certain, for nothing tells where it is"),
    ("gate blocked", "fixes of the receiver are refused"),
    ("gate dwelling", "the receiver is healthy again, and has to remain so for ten seconds"),
    ("gate awaits_anchor", "it has; the next anchor has to agree with it"),
    ("gate open", "its fixes are used"),
    ("rejected", "a measurement was not used, for this reason"),
    ("revised", "a late measurement has changed estimates that were given out before"),
    (
        "the iterations have not converged",
        "the smoother stopped at its limit; its window restarts in the state of the filter",
    ),
    ("degraded", "an input is not used as it should be, for this reason"),
];

/// An estimate beside the truth.
#[derive(Clone, Copy, Debug)]
struct Point {
    time_s: f64,
    error_m: f64,
    deviation_m: f64,
    age_s: Option<f64>,
    label: SourceLabel,
    covariance_norm: f64,
}

/// Position of the drone at a time, s, in the tangent frame at its origin, as far as that is known.
type Truth = Box<dyn Fn(f64) -> Option<Vector3<f64>>>;

/// See the module.
pub(crate) struct Outcome {
    truth: Truth,
    pub(crate) happened: Vec<Happened>,
    points: Vec<Point>,
    pub(crate) keyframes: usize,
    health: Option<FlightHealth>,
}

impl Outcome {
    /// Nothing yet, beside a truth.
    pub(crate) fn new(truth: impl Fn(f64) -> Option<Vector3<f64>> + 'static) -> Self {
        Self { truth: Box::new(truth), happened: Vec::new(), points: Vec::new(), keyframes: 0, health: None }
    }

    /// The label of each estimate, and its time, s.
    pub(crate) fn labels(&self) -> impl Iterator<Item = (f64, SourceLabel)> {
        self.points.iter().map(|point| (point.time_s, point.label))
    }

    pub(crate) fn take(
        &mut self,
        estimates: impl Iterator<Item = Stamped<FlightEstimate>>,
        health: impl Iterator<Item = Stamped<FlightHealth>>,
        events: impl Iterator<Item = Stamped<FlightEvents>>,
    ) {
        self.points.extend(estimates.filter_map(|estimate| Point::of(&estimate.payload, &self.truth)));
        self.health = health.last().map(|health| health.payload).or(self.health);
        for event in events.flat_map(|events| events.payload.events) {
            self.keyframes += usize::from(event.keyframe.is_some());
            if event.level <= Level::Info {
                self.happened.push(Happened { time_s: event.time.as_nanos() as f64 * 1e-9, what: words(&event) });
            }
        }
    }

    /// Lines; of what happens again and again, the first and how often.
    pub(crate) fn timeline(&self) -> Vec<String> {
        let mut lines: Vec<(f64, &str, usize)> = Vec::new();
        for Happened { time_s, what } in &self.happened {
            // Numbers in it differ.
            let alike = |other: &str| {
                other.chars().filter(|c| c.is_alphabetic()).eq(what.chars().filter(|c| c.is_alphabetic()))
            };
            match lines.last_mut() {
                Some((_, last, count)) if alike(last) => *count += 1,
                _ => lines.push((*time_s, what, 1)),
            }
        }
        let line = |(time_s, what, count): (f64, &str, usize)| match count {
            1 => format!("{time_s:8.3}  {what}"),
            _ => format!("{time_s:8.3}  {what}  ({count} times)"),
        };
        lines.into_iter().map(line).collect()
    }

    /// Explains the words of the timeline, of those that are in it.
    pub(crate) fn glossary(&self) -> String {
        let is_said = |word: &str| self.happened.iter().any(|one| one.what.contains(word));
        let words = WORDS.iter().filter(|(word, _)| is_said(word));
        words.map(|(word, meaning)| format!("{word:22}  {meaning}")).collect::<Vec<_>>().join("\n")
    }

    /// Errors by the age of the anchor.
    pub(crate) fn errors(&self) -> String {
        let mut table = String::from("age of the anchor  estimates  error, RMS  within 2σ\n");
        for (from, to) in [(0.0, 0.5), (0.5, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 8.0), (8.0, 16.0)] {
            let points =
                self.points.iter().filter(|point| point.age_s.is_some_and(|age| (from..to).contains(&age)));
            let points: Vec<_> = points.collect();
            let count = points.len();
            if count == 0 {
                continue;
            }
            let squares = points.iter().map(|point| point.error_m.powi(2)).sum::<f64>();
            let within = points.iter().filter(|point| point.error_m < 2.0 * point.deviation_m).count();
            let (rms, share) = ((squares / count as f64).sqrt(), 100.0 * within as f64 / count as f64);
            let _ = writeln!(table, "{from:7.1} to {to:4.1} s  {count:9}  {rms:8.2} m  {share:7.0} %");
        }
        table
    }

    pub(crate) fn picture(&self) -> Picture {
        let line = |label: &str, colour: usize, value: fn(&Point) -> Option<f64>| {
            let points: Vec<_> = self.points.iter().map(|point| (point.time_s, value(point))).collect();
            Line::new(label, PALETTE[colour], 1, &points)
        };
        let errors = vec![
            line("error, norm", 0, |point| Some(point.error_m)),
            line("1σ of the norm", 1, |point| Some(point.deviation_m)),
        ];
        let ages = vec![line("age of the anchor", 3, |point| point.age_s)];
        let panel = |axis: &str, lines| Panel::new(axis, lines);
        let panels = vec![panel("position (m)", errors), panel("age (s)", ages)];
        Picture { title: "flight".into(), panels, panel_size: (1400, 300) }
    }

    /// The largest error, m.
    #[cfg(test)]
    pub(crate) fn worst_m(&self) -> f64 {
        self.points.iter().map(|point| point.error_m).fold(0.0, f64::max)
    }

    /// Returns whether the covariance grew all the time while it was dead reckoning.
    pub(crate) fn grows_while_dead_reckoning(&self) -> bool {
        let is_lost = |point: &Point| point.label == SourceLabel::DeadReckoned;
        let pairs = self.points.windows(2).filter(|two| is_lost(&two[0]) && is_lost(&two[1]));
        let mut count = 0;
        let grows = pairs.inspect(|_| count += 1).all(|two| two[1].covariance_norm >= two[0].covariance_norm);
        grows && count > 40
    }

    /// Returns whether each estimate after `from_s`, s, is anchored: anchors are four seconds apart, for three of which they count, so fixes
    /// are used in between.
    pub(crate) fn is_fixed_after(&self, from_s: f64) -> bool {
        let mut points = self.points.iter().filter(|point| point.time_s > from_s).peekable();
        points.peek().is_some() && points.all(|point| point.label == SourceLabel::SatelliteAnchored)
    }

    /// Returns whether the receiver is let in at the end.
    pub(crate) fn is_gate_open(&self) -> bool {
        self.health.is_some_and(|health| health.is_gate_open)
    }
}

impl Point {
    fn of(estimate: &FlightEstimate, truth: &Truth) -> Option<Self> {
        let time_s = estimate.time.as_nanos() as f64 * 1e-9;
        let position = estimate.position;
        let position = Geodetic {
            latitude: position.latitude_rad,
            longitude: position.longitude_rad,
            height: position.altitude?,
        };
        let variance: f64 = (0..3).map(|i| estimate.covariance[(i, i)]).sum();
        Some(Self {
            time_s,
            error_m: (frame().position(&position) - truth(time_s)?).norm(),
            deviation_m: variance.sqrt(),
            age_s: estimate.anchor_age_ms.map(|age_ms| age_ms as f64 * 1e-3),
            label: estimate.label,
            covariance_norm: estimate.covariance_norm,
        })
    }
}

fn words(event: &FlightEvent) -> String {
    let text = |text: &Option<String>| text.clone().unwrap_or_default();
    match event.kind.as_str() {
        "label" | "gate" => format!("{} {}", event.kind, text(&event.to)),
        "started" => format!("started from {}", text(&event.from)),
        "ready" => format!("ready: {}", text(&event.to)),
        "rejected" => format!("rejected {}", text(&event.reason)),
        "degraded" | "fatal" => format!("{} {}: {}", event.kind, text(&event.input), text(&event.reason)),
        kind => kind.to_owned(),
    }
}
