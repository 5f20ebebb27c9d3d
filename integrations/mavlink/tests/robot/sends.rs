//! Messages that the bridge sends.

use super::{LONG, drone, estimate, text};
use crate::other::FlightController;
use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::{Pose, Twist};
use bb_core::prelude::*;
use bb_estimators::navigation::state_estimator::{FlightEstimate, FlightEvent, FlightEvents, Level};
use bb_mavlink::MavlinkSent;
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::{MavCmd, MavFrame, MavMessage, MavResult, MavSeverity};

#[test]
fn an_estimate_arrives_and_a_stale_one_does_not() {
    let other = FlightController::new();
    let builder = drone(&other.address);
    let sent = builder.subscribe(drone::bridge::position);
    let running = builder.start().expect("the link can be opened");
    let live = running.live();
    let clock = Clock::real();
    // As if it had been measured before the system was started.
    let stale = clock.now() - Duration::from_secs(3_600);
    live.publish(drone::sensor::base::estimate, stale, estimate(stale, 10.0));
    let counts = std::iter::from_fn(|| sent.recv_timeout(LONG)).find(|sent| sent.stale > 0).expect("it is counted");
    assert_eq!(counts.estimates, 0);

    let now = clock.now();
    live.publish(drone::sensor::base::estimate, now, estimate(now, 11.0));
    let position = other.hears(|header, message| match message {
        MavMessage::GPS_INPUT(data) => Some((header.component_id, data)),
        _ => None,
    });
    let (component_id, data) = position.expect("it is sent");
    assert_eq!((component_id, data.lat, data.lon), (220, 480_000_000, 110_000_000), "not the stale one");
    assert_eq!([data.vn, data.ve, data.vd], [2.0, 1.0, -3.0]);
    assert_eq!((data.horiz_accuracy, data.vert_accuracy), (2.0, 2.0));
    let wall = clock.wall_at(now).as_unix_nanos() / 1_000;
    assert!((data.time_usec as i64 - wall).abs() < 1_000_000, "{} {wall}", data.time_usec);
}

#[test]
fn texts_arrive_with_their_severities() {
    let other = FlightController::new();
    let running = drone(&other.address).start().expect("the link can be opened");
    let now = Clock::real().now();
    let long = "x".repeat(60);
    let events = vec![text(Level::Warn, "visual blackout"), text(Level::Info, &long)];
    running.live().publish(drone::sensor::base::events, now, FlightEvents { events });
    let received = |_| {
        other.hears(|_, message| match message {
            MavMessage::STATUSTEXT(data) => Some(data),
            _ => None,
        })
    };
    let texts: Vec<_> = (0..3).map_while(received).collect();
    let read: Vec<_> = texts
        .iter()
        .map(|data| (data.severity, data.text.to_str().map(str::len), data.id, data.chunk_seq))
        .collect();
    assert_eq!(
        read,
        [
            (MavSeverity::MAV_SEVERITY_WARNING, Ok(15), 0, 0),
            (MavSeverity::MAV_SEVERITY_INFO, Ok(50), 1, 0),
            (MavSeverity::MAV_SEVERITY_INFO, Ok(10), 1, 1),
        ]
    );
}

/// A command is repeated until it is answered, and follows the fallback.
#[test]
fn sources_are_switched_for_estimates_and_for_the_fallback() {
    let other = FlightController::new();
    let mut builder = drone(&other.address);
    let options = builder.options(drone::bridge::position);
    (options.source_set, options.fallback_source_set) = (2, 3);
    let sent = builder.subscribe(drone::bridge::position);
    let running = builder.start().expect("the link can be opened");
    let live = running.live();
    let commanded = || {
        let set = other.hears(|_, message| match message {
            MavMessage::COMMAND_LONG(data) => {
                Some((data.command, data.target_component, data.param1, data.confirmation))
            }
            _ => None,
        });
        let (command, component, set, confirmation) = set.expect("it is sent");
        assert_eq!((command, component), (MavCmd::MAV_CMD_SET_EKF_SOURCE_SET, 1));
        (set, confirmation)
    };
    let answer = |result| *other.behaviour.answer.lock().expect("nobody panics with it") = Some(result);
    let counts = |is: &dyn Fn(&MavlinkSent) -> bool| {
        std::iter::from_fn(|| sent.recv_timeout(LONG))
            .find(|sent| is(&sent.payload))
            .expect("it is counted")
            .payload
    };
    let tell = |kind: &str| {
        let events = vec![FlightEvent { kind: kind.into(), ..text(Level::Error, kind) }];
        live.publish(drone::sensor::base::events, Clock::real().now(), FlightEvents { events });
    };
    let now = Clock::real().now();
    live.publish(drone::sensor::base::estimate, now, estimate(now, 11.0));
    assert_eq!((commanded(), commanded()), ((2.0, 0), (2.0, 1)), "again, as there was no answer");
    answer(MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(counts(&|sent| sent.source_set > 0).source_set, 2);
    tell("fallback_engaged");
    assert_eq!(counts(&|sent| sent.source_set != 2).source_set, 3);
    answer(MavResult::MAV_RESULT_DENIED);
    tell("fallback_recovered");
    assert_eq!(counts(&|sent| sent.source_sets_refused > 0).source_set, 3, "the one before holds");
}

/// The estimator says how often its estimate has jumped, and the origin may move on besides.
#[test]
fn resets_of_the_estimate_are_counted_in_its_odometry() {
    let other = FlightController::new();
    let mut builder = drone(&other.address);
    builder.options(drone::bridge::odometry).source = "sensor/base/estimate".into();
    builder.options(drone::bridge::odometry).frame = "local_frd".into();
    let running = builder.start().expect("the link can be opened");
    for resets in [0, 3, 259] {
        let now = Clock::real().now();
        let estimate = FlightEstimate { resets, ..estimate(now, 11.0) };
        running.live().publish(drone::sensor::base::estimate, now, estimate);
        let odometry = other.hears(|_, message| match message {
            MavMessage::ODOMETRY(data) => Some(data),
            _ => None,
        });
        let odometry = odometry.expect("it is sent");
        assert_eq!(
            (odometry.reset_counter, odometry.frame_id),
            ((resets % 256) as u8, MavFrame::MAV_FRAME_LOCAL_FRD)
        );
    }
}

#[test]
fn odometry_of_any_estimator_arrives_and_both_bridges_say_that_they_are_there() {
    let other = FlightController::new();
    let running = drone(&other.address).start().expect("the link can be opened");
    let pose = Pose {
        position: Vector3::new(1.0, 2.0, 3.0),
        world_from_body: UnitQuaternion::identity(),
        covariance: Some(Matrix6::identity()),
    };
    let twist = Twist { linear: Vector3::new(4.0, 5.0, 6.0), angular: Vector3::zeros(), covariance: None };
    running.live().publish(drone::sensor::base::odometry, Clock::real().now(), Odometry { pose, twist });
    let odometry = other.hears(|header, message| match message {
        MavMessage::ODOMETRY(data) => Some((header, data)),
        _ => None,
    });
    let (header, data) = odometry.expect("it is sent");
    assert_eq!((header.system_id, header.component_id), (1, 197));
    assert_eq!([data.x, data.y, data.z], [2.0, 1.0, -3.0]);
    assert_eq!([data.vx, data.vy, data.vz], [4.0, -5.0, -6.0]);
    assert_eq!(data.frame_id, MavFrame::MAV_FRAME_LOCAL_NED);
    assert!(data.pose_covariance[0] == 1.0 && data.velocity_covariance[0].is_nan());
    for component_id in [197, 220] {
        let hello = |header: MavHeader, message| {
            (header.component_id == component_id && matches!(message, MavMessage::HEARTBEAT(_))).then_some(())
        };
        other.hears(hello).expect("it says so once a second");
    }
}
