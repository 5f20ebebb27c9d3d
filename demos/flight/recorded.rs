//! A recorded flight in CSV files, the same that `bb eval navigation` reads: what was measured, and the truth.

use crate::sensors::frame;
use bb_core::nalgebra::{Matrix3, Matrix6, Quaternion, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus, Imu};
use bb_core::prelude::*;
use bb_estimators::navigation::LocalFrame;
use bb_estimators::navigation::state_estimator::{
    AnchorReading, AttitudeReport, RelativePoseReading, WarmStartReport,
};
use std::error::Error;
use std::path::Path;

/// Input of the estimator, at its stamp.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Sent {
    Imu(Imu),
    Vio(RelativePoseReading),
    /// Anchor, and whether the recording says that it is an outlier.
    Anchor(AnchorReading, bool),
    Fix(GnssFix),
}

/// See the module. Its world is the tangent frame at the origin of the simulated flight.
pub(crate) struct Recorded {
    pub(crate) start: (MonotonicTime, WarmStartReport),
    /// Inputs in the order of stamps.
    pub(crate) sent: Vec<(MonotonicTime, Sent)>,
    /// Times, s, and positions of the truth.
    pub(crate) truth: Vec<(f64, Vector3<f64>)>,
    /// Gyroscope and accelerometer, and gravity.
    pub(crate) noise: [f64; 3],
}

struct Rows(Vec<Vec<f64>>);

impl Rows {
    fn read(prefix: &Path, what: &str, columns: usize) -> Result<Self, Box<dyn Error>> {
        let mut file = prefix.as_os_str().to_owned();
        file.push(format!("_{what}.csv"));
        let named = |error: &dyn std::fmt::Display| format!("{}: {error}", Path::new(&file).display());
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(&file).map_err(|e| named(&e))?;
        let rows: Result<Vec<Vec<f64>>, _> = reader.deserialize().collect();
        let rows = rows.map_err(|error| named(&error))?;
        match rows.iter().find(|row| row.len() < columns) {
            Some(row) => Err(named(&format!("{} columns, but must be {columns}", row.len())).into()),
            None => Ok(Self(rows)),
        }
    }

    /// Reads the rows of a file that a recording may have or not.
    fn read_if_there(prefix: &Path, what: &str, columns: usize) -> Result<Self, Box<dyn Error>> {
        let file = format!("{}_{what}.csv", prefix.display());
        if Path::new(&file).exists() { Self::read(prefix, what, columns) } else { Ok(Self(Vec::new())) }
    }

    fn first(&self) -> Result<&[f64], &'static str> {
        self.0.first().map(Vec::as_slice).ok_or("a file without a row")
    }
}

fn vector(row: &[f64], first: usize) -> Vector3<f64> {
    Vector3::new(row[first], row[first + 1], row[first + 2])
}

/// w, x, y, z.
fn orientation(row: &[f64], first: usize) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(row[first], row[first + 1], row[first + 2], row[first + 3]))
}

fn stamp(seconds: f64) -> MonotonicTime {
    MonotonicTime::from_nanos((seconds * 1e9).round() as i64)
}

fn diagonal(first: f64, second: f64) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| if i == j { (if i < 3 { first } else { second }).powi(2) } else { 0.0 })
}

/// A position of the recording on the Earth, and what takes vectors of its world to the tangent frame there.
fn local(position: &Vector3<f64>) -> (GeodeticPosition, UnitQuaternion<f64>) {
    let world = frame();
    let geodetic = world.geodetic(position);
    let turn = world.other_from_self(&LocalFrame::new(geodetic)).rotation;
    let (latitude_rad, longitude_rad) = (geodetic.latitude, geodetic.longitude);
    (GeodeticPosition { latitude_rad, longitude_rad, altitude: Some(geodetic.height) }, turn)
}

impl Recorded {
    /// Reads the files of a prefix: `folder/name` for `folder/name_imu.csv` and the others.
    pub(crate) fn read(prefix: &Path) -> Result<Self, Box<dyn Error>> {
        let keyframes = Rows::read(prefix, "keyframes", 4)?;
        let truth = Rows::read(prefix, "truth", 4)?;
        let time = |k: f64| {
            let keyframe = keyframes.0.get(k as usize).ok_or("a keyframe that is not among those listed")?;
            Ok::<_, &'static str>(stamp(keyframe[1]))
        };
        let mut sent = Vec::new();
        for row in &Rows::read(prefix, "imu", 8)?.0 {
            sent.push((stamp(row[0] + row[7]), Sent::Imu(Imu::new(vector(row, 1), vector(row, 4)))));
        }
        for row in &Rows::read_if_there(prefix, "vio", 12)?.0 {
            let reading = RelativePoseReading {
                from: time(row[0])?,
                translation: vector(row, 3),
                from_to: orientation(row, 6),
                covariance: diagonal(row[11], row[10]),
                accelerometer_bias: None,
                gyroscope_bias: None,
            };
            sent.push((time(row[1])?, Sent::Vio(reading)));
        }
        for row in &Rows::read_if_there(prefix, "anchor", 12)?.0 {
            let (position, turn) = local(&vector(row, 2));
            let reading = AnchorReading {
                provider: 0,
                position,
                world_from_body: turn * orientation(row, 5),
                covariance: diagonal(row[9], row[10]),
                is_covariance_degraded: false,
            };
            sent.push((time(row[0])?, Sent::Anchor(reading, row[11] != 0.0)));
        }
        for row in &Rows::read_if_there(prefix, "gps", 7)?.0 {
            let variances = Vector3::new(row[5], row[5], row[6]);
            let fix = GnssFix {
                status: GnssStatus::Fix,
                services: GnssServices::default(),
                position: Some(local(&vector(row, 2)).0),
                position_covariance: Some(Matrix3::from_diagonal(&variances.component_mul(&variances))),
            };
            sent.push((time(row[0])?, Sent::Fix(fix)));
        }
        // At the same time, the sample of the IMU comes first: so they were collected, and the order is kept.
        sent.sort_by_key(|(time, _)| *time);
        let init = Rows::read(prefix, "init", 19)?;
        let init = init.first()?;
        let (position, turn) = local(&vector(init, 0));
        let [rotation, place, velocity] = [init[16], init[17], init[18]];
        let state = WarmStartReport {
            attitude: AttitudeReport {
                world_from_body: turn * orientation(init, 3),
                tilt_deviation: rotation,
                heading_deviation: rotation,
            },
            position,
            position_covariance: Matrix3::identity() * place.powi(2),
            velocity: turn * vector(init, 7),
            velocity_covariance: Matrix3::identity() * velocity.powi(2),
        };
        let noise = Rows::read(prefix, "noise", 5)?;
        let noise = noise.first()?;
        Ok(Self {
            start: (time(0.0)?, state),
            sent,
            truth: truth.0.iter().map(|row| (row[0], vector(row, 1))).collect(),
            noise: [noise[0], noise[2], noise[4]],
        })
    }

    /// The position at a time, between the two rows of the truth around it.
    pub(crate) fn position(&self, time_s: f64) -> Option<Vector3<f64>> {
        let after = self.truth.partition_point(|(at_s, _)| *at_s < time_s);
        let (to_s, to) = *self.truth.get(after)?;
        let Some((from_s, from)) = after.checked_sub(1).and_then(|before| self.truth.get(before)) else {
            return (to_s == time_s).then_some(to);
        };
        Some(from + (to - from) * ((time_s - from_s) / (to_s - from_s)))
    }
}
