//! PX4 logs (ULog): the IMU, the magnetometer and the fixes. The body axes of PX4 are forward, right, down, those of ROS forward, left,
//! up.

use super::entry::{Entry, FIX, What};
use bb_core::nalgebra::{Matrix3, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
use px4_ulog::full_parser::{Completeness, MultiId, ParsedData, SomeVec, read_file};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Reads the entries of a file in the order of their times, and the reason if it cannot be read to its end.
pub(super) fn read(file: &Path, topic: Option<&str>) -> Result<(Vec<Entry>, Option<String>), String> {
    let name = file.to_str().ok_or("the name of the file is not UTF-8")?;
    let log = read_file(name).map_err(|error| format!("cannot be read: {error}"))?;
    let broken = match &log.completeness {
        Completeness::Complete => None,
        other => Some(format!("{other:?}")),
    };
    let utc_us = utc(&log);
    // `f64` holds microseconds since 1970 exactly, but not nanoseconds.
    let time = |us: f64| ((us + utc_us) as i64).saturating_mul(1000);
    let mut entries = Vec::new();
    if let Some(imu) = Columns::of(&log, &["sensor_combined"]) {
        let us = imu.all(&["timestamp"])?;
        let rates = imu.vectors("gyro_rad")?;
        let forces = imu.vectors("accelerometer_m_s2")?;
        for ((us, rate), force) in us.iter().zip(rates).zip(forces) {
            let what = What::Imu { angular_velocity: body(rate), specific_force: body(force) };
            entries.push(Entry { time_ns: time(*us), what });
        }
    }
    if let Some(field) = Columns::of(&log, &["vehicle_magnetometer"]) {
        let us = field.all(&["timestamp_sample", "timestamp"])?;
        for (us, gauss) in us.iter().zip(field.vectors("magnetometer_ga")?) {
            let what = What::MagneticField(body(gauss).map(|gauss| gauss * 1e-4));
            entries.push(Entry { time_ns: time(*us), what });
        }
    }
    if let Some(gnss) = Columns::of(&log, &["vehicle_gps_position", "sensor_gps"]) {
        let topic: Arc<str> = topic.unwrap_or(FIX).into();
        // Most drivers leave `timestamp_sample` of a receiver at zero.
        let us = gnss.all(&["timestamp"])?;
        for ((us, fix), topic) in us.iter().zip(fixes(&gnss)?).zip(std::iter::repeat(topic)) {
            entries.push(Entry { time_ns: time(*us), what: What::Fix { topic, fix } });
        }
    }
    if entries.is_empty() {
        return Err(
            "it has none of sensor_combined, vehicle_magnetometer, vehicle_gps_position and sensor_gps".into()
        );
    }
    entries.sort_by_key(|entry| entry.time_ns);
    Ok((entries, broken))
}

/// UTC minus the time since boot, µs; 0 if the receiver never reports the time.
fn utc(log: &ParsedData) -> f64 {
    let Some(gnss) = Columns::of(log, &["vehicle_gps_position", "sensor_gps"]) else { return 0.0 };
    let (Ok(us), Ok(utc)) = (gnss.all(&["timestamp"]), gnss.all(&["time_utc_usec"])) else { return 0.0 };
    let first = us.iter().zip(&utc).find(|(_, utc)| **utc > 0.0);
    first.map_or(0.0, |(us, utc)| utc - us)
}

fn fixes(gnss: &Columns<'_>) -> Result<Vec<GnssFix>, String> {
    // Since PX4 1.15 in degrees and metres, before in 1e-7 degrees and mm.
    let (latitudes, longitudes, heights) = match gnss.all(&["latitude_deg"]) {
        Ok(latitudes) => (latitudes, gnss.all(&["longitude_deg"])?, gnss.all(&["altitude_ellipsoid_m"])?),
        Err(_) => {
            let scaled = |name: &str, factor: f64| {
                gnss.all(&[name]).map(|values| values.iter().map(|value| value * factor).collect::<Vec<_>>())
            };
            (scaled("lat", 1e-7)?, scaled("lon", 1e-7)?, scaled("alt_ellipsoid", 1e-3)?)
        }
    };
    let kinds = gnss.all(&["fix_type"])?;
    let (horizontal, vertical) = (gnss.all(&["eph"])?, gnss.all(&["epv"])?);
    let count = latitudes.len();
    let fix = |index: usize| {
        let status = match kinds[index] as u8 {
            0..=1 => GnssStatus::NoFix,
            2..=3 => GnssStatus::Fix,
            4..=6 => GnssStatus::GroundAugmented,
            _ => GnssStatus::Unknown,
        };
        let position = GeodeticPosition {
            latitude_rad: latitudes[index].to_radians(),
            longitude_rad: longitudes[index].to_radians(),
            altitude: Some(heights[index]),
        };
        let deviations = Vector3::new(horizontal[index], horizontal[index], vertical[index]);
        let is_known = deviations.iter().all(|deviation| deviation.is_finite() && *deviation > 0.0);
        let position_covariance =
            is_known.then(|| Matrix3::from_diagonal(&deviations.map(|deviation| deviation * deviation)));
        let position = (status != GnssStatus::NoFix).then_some(position);
        GnssFix { status, services: GnssServices::default(), position, position_covariance }
    };
    Ok((0..count).map(fix).collect())
}

/// Turns a vector from forward, right, down to forward, left, up.
fn body([forward, right, down]: [f64; 3]) -> [f64; 3] {
    [forward, -right, -down]
}

/// The columns of the first instance of a topic, all of the same length.
struct Columns<'a> {
    topic: &'a str,
    fields: &'a HashMap<String, SomeVec>,
}

impl<'a> Columns<'a> {
    /// The columns of the first of these topics that is in the log.
    fn of(log: &'a ParsedData, topics: &[&'a str]) -> Option<Self> {
        topics.iter().find_map(|topic| {
            let fields = log.messages.get(*topic)?.get(&MultiId::new(0))?;
            Some(Self { topic, fields })
        })
    }

    /// The numbers of the first of these fields that the topic has.
    fn all(&self, names: &[&str]) -> Result<Vec<f64>, String> {
        let found = names.iter().find_map(|name| self.fields.get(*name));
        found.map(numbers).ok_or_else(|| format!("{} has no field {}", self.topic, names.join(" or ")))
    }

    fn vectors(&self, name: &str) -> Result<Vec<[f64; 3]>, String> {
        let axis = |axis: usize| self.all(&[&format!("{name}[{axis}]")]);
        let (x, y, z) = (axis(0)?, axis(1)?, axis(2)?);
        Ok(x.iter().zip(&y).zip(&z).map(|((x, y), z)| [*x, *y, *z]).collect())
    }
}

fn numbers(values: &SomeVec) -> Vec<f64> {
    fn all<T: Copy + Into<f64>>(values: &[T]) -> Vec<f64> {
        values.iter().map(|value| (*value).into()).collect()
    }
    match values {
        SomeVec::Int8(values) => all(values),
        SomeVec::UInt8(values) => all(values),
        SomeVec::Int16(values) => all(values),
        SomeVec::UInt16(values) => all(values),
        SomeVec::Int32(values) => all(values),
        SomeVec::UInt32(values) => all(values),
        SomeVec::Int64(values) => values.iter().map(|value| *value as f64).collect(),
        SomeVec::UInt64(values) => values.iter().map(|value| *value as f64).collect(),
        SomeVec::Float(values) => all(values),
        SomeVec::Double(values) => values.clone(),
        SomeVec::Bool(values) => values.iter().map(|value| f64::from(u8::from(*value))).collect(),
        SomeVec::Char(values) => values.iter().map(|value| f64::from(u32::from(*value))).collect(),
    }
}
