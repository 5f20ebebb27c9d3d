//! Remarks on several topics together.

use super::offset;
use super::remark::{Remark, Subject};
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::payload::{GnssFix, Imu, MagneticField, Odometry, Pose};
use bb_estimators::navigation::Geodetic;
use bb_eval::motion::latency::Oddity;
use bb_eval::motion::scatter::{Oddities, oddities, position, track};
use bb_eval::motion::{Motion, Sample, latency};
use bb_mcap::{BagMessage, IMU, MAGNETIC_FIELD, ODOMETRY, POSE, RecordingError};

const FIX: &str = "sensor_msgs/msg/NavSatFix";

/// Messages kept of a topic; what comes later is not looked at.
const MOST: usize = 1_000_000;

/// The measurements of a topic, by their stamps in nanoseconds.
#[derive(Debug, Default)]
pub(super) enum Signal {
    #[default]
    None,
    Imu(Vec<Sample>),
    Field(Vec<(i64, Vector3<f64>)>),
    /// Positions with the sum of their variances.
    Fixes(Vec<(i64, Geodetic, Option<f64>)>),
    /// Orientations with the angular velocity that an odometry says beside.
    Orientations(Vec<(i64, UnitQuaternion<f64>, Vector3<f64>)>),
}

impl Signal {
    /// Adds a message, if its type is one of these.
    pub(super) fn take(&mut self, message: &BagMessage) -> Result<(), RecordingError> {
        let has_room = match self {
            Self::None => true,
            Self::Imu(all) => all.len() < MOST,
            Self::Field(all) => all.len() < MOST,
            Self::Fixes(all) => all.len() < MOST,
            Self::Orientations(all) => all.len() < MOST,
        };
        if !has_room {
            return Ok(());
        }
        if let Self::None = self {
            *self = match &*message.schema {
                IMU => Self::Imu(Vec::new()),
                MAGNETIC_FIELD => Self::Field(Vec::new()),
                FIX => Self::Fixes(Vec::new()),
                POSE | ODOMETRY => Self::Orientations(Vec::new()),
                _ => return Ok(()),
            };
        }
        match self {
            Self::None => {}
            Self::Imu(all) => {
                let (imu, time) = message.payload::<Imu>()?;
                all.push((time.as_unix_nanos(), imu.angular_velocity, imu.linear_acceleration));
            }
            Self::Field(all) => {
                let (field, time) = message.payload::<MagneticField>()?;
                let field = field.magnetic_field;
                all.extend(field.iter().all(|value| value.is_finite()).then_some((time.as_unix_nanos(), field)));
            }
            Self::Fixes(all) => {
                let (fix, time) = message.payload::<GnssFix>()?;
                all.extend(position(&fix).map(|(position, variance)| (time.as_unix_nanos(), position, variance)));
            }
            Self::Orientations(all) => {
                let (pose, rate, time) = match &*message.schema {
                    POSE => message.payload::<Pose>().map(|(pose, time)| (pose, Vector3::zeros(), time))?,
                    _ => message
                        .payload::<Odometry>()
                        .map(|(odometry, time)| (odometry.pose, odometry.twist.angular, time))?,
                };
                let turned = pose.world_from_body;
                let is_rotation = (turned.norm() - 1.0).abs() < 0.1;
                let turned = || UnitQuaternion::new_normalize(turned.into_inner());
                all.extend(is_rotation.then(|| (time.as_unix_nanos(), turned(), rate)));
            }
        }
        Ok(())
    }

    fn samples(&self) -> &[Sample] {
        match self {
            Self::Imu(samples) => samples,
            _ => &[],
        }
    }
}

/// The motion that the topics are compared with.
pub(super) struct Reference<'a> {
    imu: &'a str,
    motion: Motion,
    zero_ns: i64,
}

impl<'a> Reference<'a> {
    /// The IMU with the most messages; `None` if there is none.
    pub(super) fn new(signals: impl Iterator<Item = (&'a str, &'a Signal)>) -> Option<Self> {
        let (imu, signal) = signals.max_by_key(|(_, signal)| signal.samples().len())?;
        let samples = signal.samples();
        let zero_ns = samples.first()?.0;
        Some(Self { imu, motion: Motion::new(samples, zero_ns), zero_ns })
    }
}

/// Remarks on a topic beside the motion of the IMU. The places are seconds since `start_ns`.
pub(super) fn remarks(signal: &Signal, reference: Option<&Reference<'_>>, start_ns: i64) -> Vec<Remark> {
    let zero_ns = reference.map_or(start_ns, |reference| reference.zero_ns);
    let seconds = |time_ns: i64| time_ns.saturating_sub(zero_ns) as f64 * 1e-9;
    let late = |latency_s: f64, what: &str| {
        let imu = reference.map_or("", |reference| reference.imu);
        Remark::new(Subject::Latency, latency::remark(latency_s, imu, what))
    };
    let scaled = |times: f64| {
        Remark::new(Subject::Unit, latency::scaled(times, reference.map_or("", |reference| reference.imu)))
    };
    let mut remarks = Vec::new();
    match signal {
        Signal::None | Signal::Imu(_) => {}
        Signal::Field(fields) => {
            let fields: Vec<_> = fields.iter().map(|(time_ns, field)| (seconds(*time_ns), *field)).collect();
            let found = offset::offset(&fields);
            remarks.extend(found.map(|(at, norm)| Remark::new(Subject::Calibration, offset::remark(&at, norm))));
            let at = found.map_or(Vector3::zeros(), |(at, _)| at);
            let found = reference.and_then(|reference| latency::of_field(&fields, &at, &reference.motion));
            remarks.extend(found.map(|found| match found {
                Oddity::Late(latency_s) => late(latency_s, "the turns"),
                Oddity::Scaled(times) => scaled(times),
            }));
        }
        Signal::Orientations(poses) => {
            let mut turned: Vec<_> =
                poses.iter().map(|(time_ns, turned, _)| (seconds(*time_ns), *turned)).collect();
            // Filters take the velocities of an odometry, and its pose may hold the step after its stamp.
            let has_rates = poses.iter().any(|(_, _, rate)| *rate != Vector3::zeros());
            if has_rates {
                let rates: Vec<_> =
                    poses.iter().map(|(time_ns, _, rate)| (*time_ns, *rate, Vector3::zeros())).collect();
                let motion = Motion::new(&rates, zero_ns);
                turned = turned.iter().filter_map(|(time_s, _)| Some((*time_s, motion.turned(*time_s)?))).collect();
            }
            let found = reference.and_then(|reference| latency::of_orientations(&turned, &reference.motion));
            remarks.extend(found.and_then(|found| match found {
                Oddity::Late(latency_s) => Some(late(latency_s, "the turns")),
                // A twist may be in another unit itself.
                Oddity::Scaled(_) if has_rates => None,
                Oddity::Scaled(times) => Some(scaled(times)),
            }));
        }
        Signal::Fixes(fixes) => {
            let track = track(fixes, zero_ns);
            let Oddities { scatter, latency_s } = oddities(&track, reference.map(|reference| &reference.motion));
            remarks.extend(latency_s.map(|latency_s| late(latency_s, "the accelerations")));
            remarks.extend(scatter.map(|found| {
                let since_s = zero_ns.saturating_sub(start_ns) as f64 * 1e-9;
                let said = found.in_words(since_s, reference.map(|reference| reference.imu));
                Remark::new(Subject::Covariance, said)
            }));
        }
    }
    remarks
}
