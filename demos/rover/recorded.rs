//! A recorded drive, as CSV files with one prefix.

use crate::drive::{Drive, Event, fix, seconds};
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_estimators::navigation::{Geodetic, LocalFrame};
use std::error::Error;
use std::path::{Path, PathBuf};

/// Time for which the recorded receiver is switched off, s.
const OUTAGE: std::ops::Range<f64> = 120.0..180.0;

pub(crate) fn drive(prefix: &Path) -> Result<Drive, Box<dyn Error>> {
    // The files have coordinates of a local frame. Where that is does not matter.
    let frame = LocalFrame::new(Geodetic::from_degrees(49.0, 8.4, 110.0));
    let truth = rows(prefix, "truth", 4)?;
    let mut drive = Drive { events: Vec::new(), truth: Vec::new(), frame, outage: OUTAGE };
    let (samples, keyframes) = (rows(prefix, "imu", 8)?, rows(prefix, "keyframes", 5)?);
    let starts = keyframes.iter().map(|row| row[2] as usize).skip(1).chain([samples.len()]);
    for (keyframe, next) in keyframes.iter().zip(starts) {
        // Between two keyframes samples follow one another; each is a mean, and is stamped at its end here.
        let mut end_s = keyframe[1];
        for row in samples.get(keyframe[2] as usize..next).ok_or("keyframes are not in order")? {
            end_s += row[7];
            drive.events.push((time(end_s), Event::Imu(Imu::new(vector(row, 1), vector(row, 4)))));
        }
    }
    for row in rows(prefix, "gps", 7)?.into_iter().filter(|row| !OUTAGE.contains(&row[1])) {
        let event = fix(&frame, &vector(&row, 2), &Vector3::new(row[5], row[5], row[6]));
        drive.events.push((time(row[1]), event));
    }
    for row in keyframes {
        let at = row[3] as usize;
        let position = truth.get(at).ok_or_else(|| format!("there is no row {at} of the truth"))?;
        drive.truth.push((time(row[1]), vector(position, 1)));
    }
    // A fix of the instant at which a sample ends comes before it.
    drive.events.sort_by_key(|(time, event)| (*time, matches!(event, Event::Imu(_))));
    if drive.events.last().is_none_or(|(time, _)| seconds(*time) < OUTAGE.end) {
        return Err(
            format!("the drive must last longer than {} s, to lose its satellites meanwhile", OUTAGE.end).into()
        );
    }
    Ok(drive)
}

fn time(time_s: f64) -> MonotonicTime {
    // A cast saturates.
    MonotonicTime::from_nanos((time_s * 1e9).round() as i64)
}

fn vector(row: &[f64], first: usize) -> Vector3<f64> {
    Vector3::new(row[first], row[first + 1], row[first + 2])
}

/// The numbers of a file, whose first row is a header.
fn rows(prefix: &Path, what: &str, columns: usize) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let mut file = prefix.as_os_str().to_owned();
    file.push(format!("_{what}.csv"));
    let file = PathBuf::from(file);
    let fault = |error: &dyn std::fmt::Display| format!("{}: {error}", file.display());
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(&file).map_err(|error| fault(&error))?;
    let mut rows = Vec::new();
    for row in reader.deserialize() {
        let row: Vec<f64> = row.map_err(|error| fault(&error))?;
        if row.len() < columns {
            return Err(fault(&format!("a row has {} columns, but must have {columns}", row.len())).into());
        }
        rows.push(row);
    }
    Ok(rows)
}
