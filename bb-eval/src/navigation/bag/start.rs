//! The start of the filters.

use super::NavigationBag;
use super::align::align;
use super::messages::{Inertial, Time};
use super::notes::Notes;
use super::options::StartFrom;
use super::sensors::Sensors;
use crate::navigation::data::Truth;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_estimators::navigation::{EskfParams, Start};

/// The assumed deviation of a true pose for a filter that starts there: m, rad.
const POSITION: f64 = 0.1;
const ROTATION: f64 = 0.02;

/// The same for a velocity from the truth, from its positions, and for an unknown one, m/s.
const TOLD: f64 = 0.1;
const FROM_POSITIONS: f64 = 0.5;
const UNKNOWN: f64 = 5.0;

/// The time over which true positions give a velocity, ns.
const BASELINE_NS: i64 = 100_000_000;

impl NavigationBag {
    /// With a time since the epoch.
    pub(super) fn start(
        &self,
        imu: &[Inertial],
        sensors: &Sensors,
        params: &EskfParams,
        notes: &mut Notes,
    ) -> Result<Start, String> {
        let first_ns = imu.first().map_or(0, |sample| sample.time_ns);
        let mut start = match (&self.options.start, &self.topics.start) {
            (Some(StartFrom::Align), _) => align(imu, sensors, params)?,
            (Some(StartFrom::Truth), _) => at_truth(sensors, first_ns)
                .ok_or("the truth tells no orientation to start with; choose --start align")?,
            (_, Some(topic)) => {
                of_topic(sensors, first_ns).ok_or_else(|| format!("{topic} holds no pose to start from"))?
            }
            (_, None) => match at_truth(sensors, first_ns) {
                Some(start) => {
                    notes.push("the filters start at the truth; --start says where else".to_owned());
                    start
                }
                None => align(imu, sensors, params)?,
            },
        };
        if let Some(deviation) = self.options.bias_deviation {
            start.gyroscope_bias_deviation = deviation.gyroscope;
            start.accelerometer_bias_deviation = deviation.accelerometer;
        }
        Ok(start)
    }
}

fn of_topic(sensors: &Sensors, first_ns: Time) -> Option<Start> {
    let start = sensors.start?;
    let rotation = start.pose.world_from_body;
    if !start.pose.position.iter().chain(rotation.coords.iter()).all(|x| x.is_finite()) {
        return None;
    }
    let time_ns = start.time_ns.max(first_ns);
    let velocity = start.velocity.unwrap_or((Vector3::zeros(), UNKNOWN));
    let rotation = (UnitQuaternion::new_normalize(rotation.into_inner()), ROTATION);
    Some(Start {
        position_covariance: start.pose.position_covariance,
        rotation_covariance: start.pose.rotation_covariance,
        ..Start::at(time_ns, (start.pose.position, POSITION), velocity, rotation)
    })
}

fn at_truth(sensors: &Sensors, first_ns: Time) -> Option<Start> {
    let points = sensors.truth.points();
    let from = points.iter().position(|(time, truth)| *time >= first_ns && truth.world_from_body.is_some())?;
    let (time_ns, Truth { position, world_from_body, velocity }) = points.get(from)?;
    let later = points.iter().skip(from).find(|(time, _)| time - time_ns >= BASELINE_NS);
    let velocity = velocity.map(|velocity| (velocity, TOLD)).or_else(|| {
        let (later_ns, later) = later?;
        let seconds = (later_ns - time_ns) as f64 * 1e-9;
        Some(((later.position - position) / seconds, FROM_POSITIONS))
    });
    let velocity = velocity.unwrap_or((Vector3::zeros(), UNKNOWN));
    Some(Start::at(*time_ns, (*position, POSITION), velocity, ((*world_from_body)?, ROTATION)))
}
