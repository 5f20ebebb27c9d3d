//! Results of a run: estimates beside the truth, and their errors.

use bb_core::Report;
use bb_core::nalgebra::UnitQuaternion;
use bb_estimators::attitude::OrientationError;
use bb_eval::{Degrees, Score};
use std::fmt;

pub(crate) struct Outcome {
    pub(crate) filter: &'static str,
    /// Series of estimates; the one that counts comes first.
    pub(crate) series: Vec<Series>,
    pub(crate) report: Report,
    pub(crate) seconds: f64,
    pub(crate) has_truth: bool,
    /// `true` if there is a magnetometer; without one heading starts anywhere and is no result.
    pub(crate) has_heading: bool,
}

/// One estimate over time.
pub(crate) struct Series {
    pub(crate) name: &'static str,
    pub(crate) points: Vec<Point>,
    score: Score,
}

#[cfg_attr(not(feature = "plot"), expect(dead_code, reason = "for pictures"))]
pub(crate) struct Point {
    pub(crate) time_s: f64,
    pub(crate) estimate: UnitQuaternion<f64>,
    pub(crate) truth: Option<UnitQuaternion<f64>>,
    pub(crate) error: Option<OrientationError>,
}

impl Series {
    pub(crate) fn new(name: &'static str) -> Self {
        Self { name, points: Vec::new(), score: Score::default() }
    }

    /// Adds an estimate; its error counts where the body moves and the truth is known.
    pub(crate) fn add(
        &mut self,
        time_s: f64,
        estimate: UnitQuaternion<f64>,
        truth: Option<UnitQuaternion<f64>>,
        moving: bool,
    ) {
        let error = self.score.add(&estimate, truth.as_ref(), moving);
        self.points.push(Point { time_s, estimate, truth, error });
    }

    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }
}

impl Outcome {
    /// The object that `--json` prints, of the first series. Errors are null where there is no truth.
    pub(crate) fn json(&self) -> String {
        let first = self.series.first();
        let rms = first.and_then(|series| series.score.rms());
        let number = |of: fn(&Degrees) -> f64| rms.map_or_else(|| "null".to_owned(), |rms| of(&rms).to_string());
        let samples = first.map_or(0, Series::len);
        // Number of estimates that were compared with the truth.
        let scored = first.map_or(0, |series| series.score.count());
        format!(
            "{{\"filter\":\"{}\",\"samples\":{samples},\"scored\":{scored},\"total_deg\":{},\"heading_deg\":{},\"inclination_deg\":{},\"seconds\":{}}}\n",
            self.filter,
            number(|rms| rms.total),
            number(|rms| rms.heading),
            number(|rms| rms.inclination),
            self.seconds,
        )
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Published:\n\n{}", self.report)?;
        let recorded_s =
            self.series.first().and_then(|series| series.points.last()).map_or(0.0, |last| last.time_s);
        writeln!(f, "{}: {recorded_s:.1} s in {:.2} s", self.filter, self.seconds)?;
        if !self.has_truth {
            return writeln!(f, "The recording has no truth to compare with.");
        }
        writeln!(f, "\nError against the truth, RMS in degrees:\n")?;
        writeln!(f, "{:16} {:>8} {:>8} {:>12} {:>9}", "orientation", "total", "heading", "inclination", "scored")?;
        for series in &self.series {
            let Some(Degrees { total, heading, inclination }) = series.score.rms() else { continue };
            let count = series.score.count();
            writeln!(f, "{:16} {total:8.2} {heading:8.2} {inclination:12.2} {count:9}", series.name)?;
        }
        if !self.has_heading {
            writeln!(f, "\nWith six axes the heading starts anywhere: only the inclination counts.")?;
        }
        Ok(())
    }
}
