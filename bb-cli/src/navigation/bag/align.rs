//! A start from rest, or from the course in motion, as the declared filter does it.

use super::messages::{Inertial, Time};
use super::sensors::Sensors;
use bb_core::nalgebra::Vector3;
use bb_estimators::navigation::{Alignment, AlignmentParams, EskfParams, GnssPosition, ImuMean, Refusal, Start};

/// The time between two fixes that show a course, ns.
const BASELINE_NS: std::ops::RangeInclusive<i64> = 500_000_000..=5_000_000_000;

/// How far the motion may differ from the IMU's x axis, rad.
const SLIP: f64 = 0.1;

/// Where the world begins is known by definition, m.
const ORIGIN: f64 = 0.01;

/// The first start that the samples allow, with its time since the epoch.
pub(super) fn align(imu: &[Inertial], sensors: &Sensors, params: &EskfParams) -> Result<Start, String> {
    let params = AlignmentParams { gravity: params.gravity, ..AlignmentParams::default() };
    let mut alignment = Alignment::new(params);
    let mut fixes = sensors.fixes.iter().peekable();
    let mut seen: Vec<&(Time, GnssPosition)> = Vec::new();
    for sample in imu {
        let Inertial { time_ns, angular_velocity, specific_force } = *sample;
        if alignment.add(&ImuMean { time_ns, angular_velocity, specific_force }).is_err() {
            continue;
        }
        while let Some(fix) = fixes.next_if(|(time, _)| *time <= time_ns) {
            seen.push(fix);
        }
        if let Ok(start) = start(&alignment, &seen, sensors) {
            return Ok(start);
        }
    }
    let way_out = match sensors.options.heading_from_course {
        true => "no two fixes 0.5 to 5 s apart show a course",
        false => {
            "the IMU is never at rest for a second; name the topic of a pose with --start, or the truth, or take the \
                  course with --set heading_from_course=true"
        }
    };
    Err(format!("there is nothing to start from: {way_out}"))
}

fn start(alignment: &Alignment, seen: &[&(Time, GnssPosition)], sensors: &Sensors) -> Result<Start, Refusal> {
    let options = &sensors.options;
    let heading = (options.heading, options.heading_deviation);
    if sensors.fixes.is_empty() {
        let position = sensors.anchors.first().map_or((Vector3::zeros(), ORIGIN), |(_, pose)| {
            (pose.position, (pose.position_covariance.trace() / 3.0).sqrt())
        });
        return alignment.at_rest(position, heading);
    }
    let (time, fix) = seen.last().ok_or(Refusal::NotObservable)?;
    let deviation = |fix: &GnssPosition| (fix.covariance.fixed_view::<2, 2>(0, 0).trace() / 2.0).max(0.0).sqrt();
    let position = (fix.position, deviation(fix));
    let start = if options.heading_from_course {
        let in_time = |(older, _): &&&&(Time, GnssPosition)| BASELINE_NS.contains(&(time - older));
        let (before, older) = seen.iter().rev().find(|older| in_time(&older)).ok_or(Refusal::NotObservable)?;
        let seconds = (time - before) as f64 * 1e-9;
        let velocity = (fix.position - older.position) / seconds;
        let spread = deviation(fix).hypot(deviation(older)) / seconds;
        alignment.in_motion(position, (velocity, spread), &Vector3::x(), SLIP)?
    } else {
        alignment.at_rest(position, heading)?
    };
    // The fix is the antenna's.
    let antenna = start.world_from_body * fix.lever_arm;
    Ok(Start { position: start.position - antenna, position_covariance: fix.covariance, ..start })
}
