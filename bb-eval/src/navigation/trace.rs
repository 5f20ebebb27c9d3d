//! A record of playing a data set, for a plot.

use super::data::{DataSet, Keyframe, Truth};
use super::errors::Errors;
use super::measured::{Answers, Sensor};
use super::step::Known;
use bb_core::nalgebra::Vector3;
use bb_estimators::navigation::Refusal;

/// A record of playing a data set, keyframe by keyframe.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    pub(crate) rows: Vec<Row>,
    pub(crate) innovations: Vec<Innovation>,
    /// The positions of the fixes.
    pub(crate) fixes: Vec<Vector3<f64>>,
    /// States, each from its time on: `starting`, `healthy`, `degraded` or `lost`.
    #[cfg_attr(not(feature = "plot"), expect(dead_code, reason = "for pictures"))]
    pub(crate) health: Vec<(f64, &'static str)>,
    /// Times without a position in the world, from and to.
    pub(crate) outages: Vec<(f64, f64)>,
    /// Times without samples of the IMU, from and to.
    pub(crate) gaps: Vec<(f64, f64)>,
    last_anchor_s: Option<f64>,
    last_fix_s: Option<f64>,
    last_sample: usize,
}

/// A longer time without a position is an outage, s,
const OUTAGE_S: f64 = 5.0;
/// and a longer sample of the IMU is a gap.
const GAP_S: f64 = 0.25;

/// A keyframe.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "plot"), expect(dead_code, reason = "for pictures"))]
pub(crate) struct Row {
    pub(crate) time_s: f64,
    pub(crate) position: Vector3<f64>,
    pub(crate) truth: Option<Truth>,
    pub(crate) errors: Option<Errors>,
    /// Time since the last fused absolute pose, s.
    pub(crate) anchor_age_s: Option<f64>,
}

/// A measurement compared with its prediction.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "plot"), expect(dead_code, reason = "for pictures"))]
pub(crate) struct Innovation {
    pub(crate) time_s: f64,
    pub(crate) sensor: Sensor,
    /// Normalised innovation squared.
    pub(crate) nis: f64,
    /// Whether it passed the gate.
    pub(crate) is_fused: bool,
}

impl Trace {
    pub(crate) fn add(
        &mut self,
        keyframe: &Keyframe,
        known: &Option<Known>,
        answers: &Answers,
        data: &DataSet,
        k: u64,
    ) {
        let time_s = keyframe.time_s;
        for (sensor, answer) in Sensor::ALL.into_iter().zip(answers) {
            let (nis, is_fused) = match answer {
                Some(Ok(fused)) => (fused.nis, true),
                Some(Err(Refusal::Gate { nis, .. })) => (*nis, false),
                _ => continue,
            };
            if sensor == Sensor::Anchor && is_fused {
                self.last_anchor_s = Some(time_s);
            }
            self.innovations.push(Innovation { time_s, sensor, nis, is_fused });
        }
        self.fixes.extend(data.fixes.get(&k).map(|fix| fix.position));
        if data.fixes.contains_key(&k) || data.anchors.contains_key(&k) {
            let since_s = self.last_fix_s.replace(time_s).filter(|last_s| time_s - last_s > OUTAGE_S);
            self.outages.extend(since_s.map(|last_s| (last_s, time_s)));
        }
        let mut end_s = time_s;
        let taken = std::mem::replace(&mut self.last_sample, keyframe.sample)..keyframe.sample;
        for sample in data.samples.get(taken).unwrap_or_default().iter().rev() {
            self.gaps.extend((sample.dt > GAP_S).then_some((end_s - sample.dt, end_s)));
            end_s -= sample.dt;
        }
        let Some(known) = known else { return };
        self.rows.push(Row {
            time_s,
            position: known.position,
            truth: keyframe.truth,
            errors: keyframe.truth.map(|truth| Errors::between(&truth, &data.antenna, known)),
            anchor_age_s: self.last_anchor_s.map(|last_s| time_s - last_s),
        });
    }
}
