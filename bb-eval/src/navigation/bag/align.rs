//! A start from rest, or from the course in motion, like that of the declared filter.

use super::messages::Inertial;
use super::sensors::Sensors;
use bb_core::nalgebra::Vector3;
use bb_estimators::navigation::{
    Alignment, AlignmentParams, Course, EskfParams, GnssPosition, ImuMean, Refusal, Start, TrackPoint,
};

/// How far the motion may differ from the IMU's x axis, rad.
const SLIP: f64 = 0.1;

/// The origin of the world is known by definition, m.
const ORIGIN: f64 = 0.01;

/// The first start that the samples allow, with its time since the epoch.
pub(super) fn align(imu: &[Inertial], sensors: &Sensors, params: &EskfParams) -> Result<Start, String> {
    let params = AlignmentParams { gravity: params.gravity, ..AlignmentParams::default() };
    let mut alignment = Alignment::new(params);
    let mut fixes = sensors.fixes.iter().peekable();
    let mut course = Course::within(None);
    for sample in imu {
        let Inertial { time_ns, angular_velocity, specific_force } = *sample;
        let sample = ImuMean { time_ns, angular_velocity, specific_force };
        if alignment.add(&sample).is_err() {
            continue;
        }
        course.turn(&sample);
        while let Some((at, fix)) = fixes.next_if(|(at, _)| *at <= time_ns) {
            let GnssPosition { position, covariance, .. } = *fix;
            course.add_point(TrackPoint { time_ns: *at, position, covariance, yaw: 0.0 });
        }
        if let Ok(start) = start(&alignment, &course, time_ns, sensors) {
            return Ok(start);
        }
    }
    let way_out = match sensors.options.heading_from_course {
        true => "no two fixes 0.5 to 5 s apart show a course that others agree with",
        false => {
            "the IMU is never at rest for a second; name the topic of a pose with --start, or the truth, or take the \
                  course with --set heading_from_course=true"
        }
    };
    Err(format!("there is nothing to start from: {way_out}"))
}

fn start(alignment: &Alignment, course: &Course, time_ns: i64, sensors: &Sensors) -> Result<Start, Refusal> {
    let options = &sensors.options;
    let heading = (options.heading, options.heading_deviation);
    let Some((_, GnssPosition { lever_arm, .. })) = sensors.fixes.first() else {
        let position = sensors.anchors.first().map_or((Vector3::zeros(), ORIGIN), |(_, pose)| {
            (pose.position, (pose.position_covariance.trace() / 3.0).sqrt())
        });
        return alignment.at_rest(position, heading);
    };
    let fix = course.newest(time_ns).ok_or(Refusal::NotObservable)?;
    let position = (fix.position, fix.deviation());
    let start = if options.heading_from_course {
        let velocity = course.velocity(time_ns).ok_or(Refusal::NotObservable)?;
        alignment.in_motion(position, velocity, &Vector3::x(), SLIP)?
    } else {
        alignment.at_rest(position, heading)?
    };
    // The fix is the antenna's.
    let antenna = start.world_from_body * lever_arm;
    Ok(Start { position: start.position - antenna, position_covariance: fix.covariance, ..start })
}
