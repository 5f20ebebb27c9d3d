//! A whole robot beside a simulated flight controller on the loopback device, with frames of the crate `mavlink`.

mod faults;
mod flight;
mod other;
mod pymavlink;
mod reads;
mod sends;
#[cfg(all(unix, feature = "serial"))]
mod serial;

use bb_core::event::ComponentFault;
use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::GeodeticPosition;
use bb_core::prelude::*;
use bb_estimators::navigation::state_estimator::{FlightEstimate, FlightEvent, FlightEvents, Level, SourceLabel};
use bb_mavlink::{MavlinkAttitude, MavlinkGnss, MavlinkGpsHealth, MavlinkHeartbeat, MavlinkImu, MavlinkSender};

/// Far longer than anything takes.
const LONG: Duration = Duration::from_secs(30);

robot! {
    robot Drone;

    bridges {
        bridge position: MavlinkSender(
            link = "of the test", source = "sensor/base/estimate", texts = "sensor/base/events", component_id = 220,
            max_age = 60 s
        );
        bridge odometry: MavlinkSender(
            link = "of the test", source = "sensor/base/odometry", message = "odometry", component_id = 197,
            max_age = 60 s
        ) { rate: 50 Hz; }
    }
    link base {
        sensor imu: MavlinkImu(link = "of the test", timeout = 400 ms);
        sensor other_imu: MavlinkImu(link = "of the test", message = "scaled_imu2");
        sensor attitude: MavlinkAttitude(link = "of the test");
        sensor gps: MavlinkGnss(link = "of the test", geoid_height = 47 m);
        sensor gps_health: MavlinkGpsHealth(link = "of the test");
        sensor heartbeat: MavlinkHeartbeat(link = "of the test");
        sensor estimate: External<FlightEstimate>();
        sensor events: External<FlightEvents>();
        sensor odometry: External<Odometry>();
    }
}

/// A drone whose links all lead to `address`.
fn drone(address: &str) -> bb_core::Builder<Drone> {
    let mut builder = Drone::builder();
    for imu in [drone::sensor::base::imu, drone::sensor::base::other_imu] {
        builder.options(imu).link = address.to_owned();
    }
    for bridge in [drone::bridge::position, drone::bridge::odometry] {
        builder.options(bridge).link = address.to_owned();
    }
    builder.options(drone::sensor::base::attitude).link = address.to_owned();
    builder.options(drone::sensor::base::gps).link = address.to_owned();
    builder.options(drone::sensor::base::gps_health).link = address.to_owned();
    builder.options(drone::sensor::base::heartbeat).link = address.to_owned();
    builder
}

/// The message of the next fault of the IMU that contains `text`.
fn fault_of_imu(faults: &Subscription<ComponentFault>, text: &str) -> String {
    std::iter::from_fn(|| faults.recv_timeout(LONG))
        .find(|fault| fault.path == "sensor/base/imu" && fault.message.contains(text))
        .unwrap_or_else(|| panic!("no fault says that `{text}`"))
        .payload
        .message
}

/// Returns an estimate at 48° north.
fn estimate(time: MonotonicTime, longitude_deg: f64) -> FlightEstimate {
    FlightEstimate {
        frame_id: [0; 16],
        emitted: time,
        time,
        position: GeodeticPosition {
            latitude_rad: 48_f64.to_radians(),
            longitude_rad: longitude_deg.to_radians(),
            altitude: Some(500.0),
        },
        world_from_body: UnitQuaternion::identity(),
        velocity: Vector3::new(1.0, 2.0, 3.0),
        covariance: Matrix6::identity() * 4.0,
        label: SourceLabel::SatelliteAnchored,
        anchor_age_ms: None,
        smoothed: false,
        degraded: false,
        resets: 0,
        covariance_norm: 1.0,
        nis: None,
        is_anchor_degraded: false,
    }
}

/// Returns an event whose text is sent to the ground.
fn text(level: Level, text: &str) -> FlightEvent {
    FlightEvent {
        time: MonotonicTime::ZERO,
        frame_id: [0; 16],
        spoof_block: false,
        level,
        kind: "label".into(),
        input: None,
        reason: None,
        from: None,
        to: None,
        status_text: Some(text.into()),
        window: None,
        cov_inflation: None,
        keyframe: None,
    }
}
