//! Measurements of a drive, and its truth.

use bb_core::nalgebra::Vector3;
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus, Twist};
use bb_core::prelude::*;
use bb_estimators::navigation::{Geodetic, LocalFrame};
use std::ops::Range;

/// A drive, from the sensors' side.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    /// Messages of the sensors, in their order.
    pub(crate) events: Vec<(MonotonicTime, Event)>,
    /// Positions of the link by time, in the frame of the drive.
    pub(crate) truth: Vec<(MonotonicTime, Vector3<f64>)>,
    /// Frame of the drive on the Earth.
    pub(crate) frame: LocalFrame,
    /// Time without fixes, s.
    pub(crate) outage: Range<f64>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Event {
    Imu(Imu),
    /// Velocity and yaw rate, and their covariance.
    Wheels(Twist),
    Fix(GnssFix),
}

impl Drive {
    /// The truth in the world of the filter, whose origin is the first fix.
    pub(crate) fn truth_in_world(&self) -> impl Iterator<Item = (MonotonicTime, Vector3<f64>)> {
        let fix = self.events.iter().find_map(|(_, event)| match event {
            Event::Fix(GnssFix { position: Some(position), .. }) => Some(Geodetic {
                latitude: position.latitude_rad,
                longitude: position.longitude_rad,
                height: position.altitude.unwrap_or(0.0),
            }),
            _ => None,
        });
        let world = fix.map_or(self.frame, LocalFrame::new);
        self.truth.iter().map(move |(time, position)| (*time, world.position(&self.frame.geodetic(position))))
    }
}

/// The fix of an antenna at `position` in `frame`, which says nothing about how good it is but its `deviation`, m.
pub(crate) fn fix(frame: &LocalFrame, position: &Vector3<f64>, deviation: &Vector3<f64>) -> Event {
    let place = frame.geodetic(position);
    let altitude = Some(place.height);
    let position = GeodeticPosition { latitude_rad: place.latitude, longitude_rad: place.longitude, altitude };
    Event::Fix(GnssFix {
        status: GnssStatus::Fix,
        services: GnssServices::default(),
        position: Some(position),
        position_covariance: Some(bb_core::nalgebra::Matrix3::from_diagonal(&deviation.component_mul(deviation))),
    })
}

pub(crate) fn seconds(time: MonotonicTime) -> f64 {
    time.seconds_since(MonotonicTime::ZERO)
}
