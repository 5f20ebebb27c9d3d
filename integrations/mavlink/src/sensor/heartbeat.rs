//! `HEARTBEAT`.

use super::stream::Stream;
use crate::link::{LinkStatistics, Peer};
use bb_core::{Fault, MonotonicTime, Options, Payload, Reading, Sensor, SensorContext};
use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, MavMessage, MavModeFlag};
use std::time::Duration;

/// Options of [`MavlinkHeartbeat`].
#[derive(Clone, Debug, Options)]
pub struct MavlinkHeartbeatOptions {
    /// Address of the flight controller: see [`Address`](crate::Address).
    #[option(required)]
    pub link: String,
    /// System that sends; 0 for any.
    #[option(default = 1)]
    pub system_id: u8,
    /// Component that sends; 0 for any.
    #[option(default = 1)]
    pub component_id: u8,
    /// Time for which it may send nothing. Heartbeats come once a second.
    #[option(default = Duration::from_secs(5))]
    pub timeout: Duration,
}

/// A flight controller's report about itself once a second, and the state of its link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct FlightController {
    /// `MAV_TYPE`: the type of vehicle.
    pub vehicle_type: u8,
    /// `MAV_AUTOPILOT`: 3 is ArduPilot, 12 is PX4.
    pub autopilot: u8,
    /// `MAV_MODE_FLAG`.
    pub base_mode: u8,
    /// A mode of that autopilot.
    pub custom_mode: u32,
    /// `MAV_STATE`: 3 is standby, 4 is active.
    pub system_status: u8,
    /// `true` if motors may turn.
    pub is_armed: bool,
    /// The link since it was opened.
    pub link: LinkStatistics,
}

/// The flight controller's heartbeat, stamped with its arrival.
#[derive(Debug)]
pub struct MavlinkHeartbeat {
    stream: Stream,
}

impl Sensor for MavlinkHeartbeat {
    type Options = MavlinkHeartbeatOptions;
    type Output = FlightController;

    fn init(options: MavlinkHeartbeatOptions, context: &SensorContext) -> Result<Self, Fault> {
        let message = (HEARTBEAT_DATA::NAME, HEARTBEAT_DATA::ID);
        let peer = Peer { system_id: options.system_id, component_id: options.component_id };
        Ok(Self { stream: Stream::open(&options.link, peer, &[message], options.timeout, context)? })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<FlightController>, Fault> {
        let Some(received) = self.stream.next()? else { return Ok(Reading::nothing()) };
        let MavMessage::HEARTBEAT(data) = &received.message else { return Ok(Reading::nothing()) };
        self.stream.has_value();
        Ok(Reading::at(received.arrival, flight_controller(data, self.stream.link().statistics())))
    }
}

fn flight_controller(data: &HEARTBEAT_DATA, link: LinkStatistics) -> FlightController {
    FlightController {
        vehicle_type: data.mavtype as u8,
        autopilot: data.autopilot as u8,
        base_mode: data.base_mode.bits(),
        custom_mode: data.custom_mode,
        system_status: data.system_status as u8,
        is_armed: data.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED),
        link,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mavlink::dialects::ardupilotmega::{MavAutopilot, MavState, MavType};

    #[test]
    fn numbers_are_those_of_the_specification() {
        let data = HEARTBEAT_DATA {
            custom_mode: u32::MAX,
            mavtype: MavType::MAV_TYPE_QUADROTOR,
            autopilot: MavAutopilot::MAV_AUTOPILOT_PX4,
            base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED | MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
            system_status: MavState::MAV_STATE_ACTIVE,
            mavlink_version: 3,
        };
        let said = flight_controller(&data, LinkStatistics::default());
        let numbers = (said.vehicle_type, said.autopilot, said.base_mode, said.custom_mode, said.system_status);
        assert_eq!(numbers, (2, 12, 129, u32::MAX, 4));
        assert!(said.is_armed);
        let base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
        assert!(!flight_controller(&HEARTBEAT_DATA { base_mode, ..data }, LinkStatistics::default()).is_armed);
    }
}
