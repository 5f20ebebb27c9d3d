//! The kind of message to send.

use super::gps_input::GpsInput;
use super::odometry::OdometryFrame;
use super::source::Estimate;
use bb_core::time::WallTime;
use mavlink::dialects::ardupilotmega::MavMessage;

/// The kind of message.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    GpsInput(GpsInput),
    Odometry(OdometryFrame),
}

impl Kind {
    /// Returns whether it can be built from the odometry of any estimator, which does not know its place on the Earth.
    pub(super) fn takes_odometry(&self) -> bool {
        matches!(self, Self::Odometry(_))
    }

    /// `None` if the estimate has a value that cannot be sent.
    pub(super) fn message(&mut self, estimate: &Estimate, wall: WallTime) -> Option<MavMessage> {
        match (self, estimate) {
            (Self::GpsInput(settings), Estimate::Flight(estimate)) => {
                settings.message(estimate, wall).map(MavMessage::GPS_INPUT)
            }
            (Self::GpsInput(_), Estimate::Odometry(_)) => None,
            (Self::Odometry(frame), Estimate::Flight(estimate)) => {
                frame.of_flight(estimate, wall).map(MavMessage::ODOMETRY)
            }
            (Self::Odometry(frame), Estimate::Odometry(estimate)) => {
                frame.of_odometry(&estimate.payload, wall).map(MavMessage::ODOMETRY)
            }
        }
    }
}
