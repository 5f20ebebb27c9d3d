//! Errors beside what the filter said of them, and whether what the demonstration claims happened.

use crate::drive::{Drive, seconds};
use bb_core::HealthTransition;
use bb_core::nalgebra::{Matrix2, Vector2};
use bb_core::prelude::*;
use std::fmt;
use std::ops::Range;

/// Results of a drive.
#[derive(Debug)]
pub(crate) struct Outcome {
    filter: &'static str,
    pub(crate) points: Vec<Point>,
    /// Changes of health: time, s, and the new state.
    health: Vec<(f64, HealthState)>,
    pub(crate) outage: Range<f64>,
}

/// One instant at which the truth is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) time_s: f64,
    /// True position, east and north, m.
    pub(crate) truth: Vector2<f64>,
    /// East and north, m.
    pub(crate) error: Vector2<f64>,
    /// Standard deviations of both, m.
    pub(crate) deviation: Vector2<f64>,
    /// Standard deviation in the direction where the position is least known, m.
    worst: f64,
}

impl Point {
    fn is_within(&self) -> bool {
        self.error.norm() <= 3.0 * self.worst
    }
}

impl Outcome {
    pub(crate) fn new(
        filter: &'static str,
        drive: &Drive,
        odometry: &[Stamped<Odometry>],
        health: &[Stamped<HealthTransition>],
    ) -> Self {
        let mut points = Vec::new();
        for (time, truth) in drive.truth_in_world() {
            let Ok(index) = odometry.binary_search_by_key(&time, |message| message.monotonic_time) else {
                continue;
            };
            let Pose { position, covariance: Some(covariance), .. } = odometry[index].pose else { continue };
            let covariance: Matrix2<f64> = covariance.fixed_view::<2, 2>(0, 0).into_owned();
            points.push(Point {
                time_s: seconds(time),
                truth: truth.xy(),
                error: (position - truth).xy(),
                deviation: Vector2::new(covariance[(0, 0)], covariance[(1, 1)]).map(f64::sqrt),
                worst: covariance.symmetric_eigenvalues().max().sqrt(),
            });
        }
        let health = health.iter().map(|change| (seconds(change.monotonic_time), change.to)).collect();
        Self { filter, points, health, outage: drive.outage.clone() }
    }

    fn during(&self, span: Range<f64>) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(move |point| span.contains(&point.time_s))
    }

    /// The last point before a time.
    fn before(&self, time_s: f64) -> Option<&Point> {
        self.points.iter().rev().find(|point| point.time_s < time_s)
    }

    /// Returns the claims that did not come true.
    pub(crate) fn missing(&self) -> Vec<String> {
        let mut missing = Vec::new();
        let mut claim = |holds: bool, what: &str| {
            if !holds {
                missing.push(what.to_owned());
            }
        };
        let Range { start, end } = self.outage;
        let within = self.points.iter().filter(|point| point.is_within()).count();
        claim(within as f64 >= 0.99 * self.points.len() as f64, "errors within 3 sigma, 99 of 100");
        claim(self.during(start..end).all(Point::is_within), "all errors within 3 sigma while there are no fixes");
        // From second to second; between two fixes it is not known better either.
        let each: Vec<f64> = self.during(start + 3.0..end).map(|point| point.worst).collect();
        let grows = each.len() > 10 && each.windows(2).all(|pair| pair[1] >= 0.999 * pair[0]);
        claim(grows, "bounds that grow as long as there are no fixes");
        // Over some seconds: at a fix the position is known better than between two.
        let widest = |span: Range<f64>| self.during(span).map(|point| point.worst).reduce(f64::max);
        let (sure, unsure) = (widest(start - 10.0..start), self.before(end).map(|point| point.worst));
        let is_wider = sure.zip(unsure).is_some_and(|(sure, unsure)| unsure > 2.0 * sure);
        claim(is_wider, "bounds more than twice as wide after a minute without fixes");
        let settled = widest(end + 10.0..f64::INFINITY);
        // After an outage the filter may take the noise of the IMU to be larger than before.
        let is_settled = sure.zip(settled).is_some_and(|(sure, settled)| settled < 3.0 * sure);
        claim(is_settled, "bounds as before, ten seconds after");
        let state_at = |time_s: f64| {
            let change = self.health.iter().rev().find(|(at_s, _)| *at_s <= time_s);
            change.map_or(HealthState::Healthy, |(_, state)| *state)
        };
        claim(state_at(start) == HealthState::Healthy, "healthy while there are fixes");
        claim(state_at(end - 0.1) == HealthState::Degraded, "degraded after half a minute without");
        claim(state_at(end + 5.0) == HealthState::Healthy, "healthy again");
        missing
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Range { start, end } = self.outage;
        writeln!(f, "{}\n", self.filter)?;
        writeln!(f, "time, s  error, m  3 sigma, m")?;
        let mut notes: Vec<(f64, String)> =
            self.health.iter().map(|(time_s, state)| (*time_s, format!("health: {state}"))).collect();
        notes.push((start, "no satellites from now on".into()));
        notes.push((end, "satellites again".into()));
        notes.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut notes = notes.into_iter().peekable();
        let mut next_s = 0.0;
        for point in &self.points {
            while let Some((time_s, note)) = notes.next_if(|(time_s, _)| *time_s <= point.time_s) {
                writeln!(f, "{time_s:7.2}  {note}")?;
            }
            if point.time_s >= next_s {
                let (error, bound) = (point.error.norm(), 3.0 * point.worst);
                writeln!(f, "{:7.2}  {error:8.2}  {bound:10.2}", point.time_s)?;
                next_s = (point.time_s / 10.0).floor() * 10.0 + 10.0;
            }
        }
        for (time_s, note) in notes {
            writeln!(f, "{time_s:7.2}  {note}")?;
        }
        let rms = |span: Range<f64>| {
            let squares: Vec<f64> = self.during(span).map(|point| point.error.norm_squared()).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let within = self.points.iter().filter(|point| point.is_within()).count();
        writeln!(
            f,
            "\nerror with satellites, RMS  {:.2} m before, {:.2} m after",
            rms(0.0..start),
            rms(end + 10.0..1e9)
        )?;
        writeln!(
            f,
            "error without, at the end   {:.2} m",
            self.before(end).map_or(f64::NAN, |point| point.error.norm())
        )?;
        writeln!(f, "within 3 sigma              {within} of {}", self.points.len())?;
        let missing = self.missing();
        for what in &missing {
            writeln!(f, "missing: {what}")?;
        }
        if missing.is_empty() {
            writeln!(
                f,
                "\nAll that was claimed happened: bounds that grew without satellites, and errors within them."
            )?;
        }
        Ok(())
    }
}
