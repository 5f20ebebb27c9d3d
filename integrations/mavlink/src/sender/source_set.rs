//! The set of sources from which ArduPilot's filter takes position, velocity and heading.
//!
//! While there are estimates, the flight controller is to use the set that takes them; while the fallback is engaged, another. The
//! command is sent once a second until it is acknowledged or refused, as MAVLink's command protocol demands.

use crate::link::{Inbox, LinkError};
use bb_core::MonotonicTime;
use bb_estimators::navigation::state_estimator::FlightEvent;
use mavlink::dialects::ardupilotmega::{COMMAND_LONG_DATA, MavCmd, MavMessage, MavResult};
use std::sync::Arc;
use std::time::Duration;

/// The autopilot's component.
pub(super) const AUTOPILOT: u8 = 1;

/// Time after which a command without an answer is sent again.
const AGAIN: Duration = Duration::from_secs(1);

/// Switches between two sets.
#[derive(Debug)]
pub(super) struct SourceSet {
    /// Acknowledgements of the autopilot.
    answers: Arc<Inbox>,
    system_id: u8,
    /// The set for estimates, and for the fallback.
    estimates: u8,
    fallback: u8,
    wanted: u8,
    /// Set that was acknowledged, or refused; 0 for none.
    answered: u8,
    sent: Option<(MonotonicTime, u8)>,
}

/// An answer of the autopilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    Acknowledged(u8),
    Refused(u8),
}

impl SourceSet {
    pub(super) fn new(answers: Arc<Inbox>, system_id: u8, estimates: u8, fallback: u8) -> Self {
        Self { answers, system_id, estimates, fallback, wanted: 0, answered: 0, sent: None }
    }

    /// Asks for the set of estimates with the first one.
    pub(super) fn estimate(&mut self) {
        if self.wanted == 0 {
            self.want(self.estimates);
        }
    }

    pub(super) fn event(&mut self, event: &FlightEvent) {
        match event.kind.as_str() {
            "fallback_engaged" => self.want(self.fallback),
            "fallback_recovered" => self.want(self.estimates),
            _ => {}
        }
    }

    fn want(&mut self, set: u8) {
        if self.wanted != set {
            (self.wanted, self.answered, self.sent) = (set, 0, None);
        }
    }

    /// The newest answer to a command that waits for one.
    ///
    /// # Errors
    /// The link has failed.
    pub(super) fn answer(&mut self) -> Result<Option<Answer>, LinkError> {
        let mut newest = None;
        while let Some(received) = self.answers.receive(Duration::ZERO)? {
            let MavMessage::COMMAND_ACK(answer) = received.message else { continue };
            if answer.command != MavCmd::MAV_CMD_SET_EKF_SOURCE_SET || self.sent.is_none() {
                continue;
            }
            let set = self.wanted;
            newest = match answer.result {
                MavResult::MAV_RESULT_ACCEPTED => Some(Answer::Acknowledged(set)),
                // It is asked again.
                MavResult::MAV_RESULT_IN_PROGRESS | MavResult::MAV_RESULT_TEMPORARILY_REJECTED => continue,
                _ => Some(Answer::Refused(set)),
            };
            self.answered = set;
        }
        Ok(newest)
    }

    /// The command to send now, if one is due.
    pub(super) fn command(&mut self, now: MonotonicTime) -> Option<MavMessage> {
        if self.wanted == self.answered {
            return None;
        }
        let confirmation = match self.sent {
            Some((sent, _)) if now.seconds_since(sent) < AGAIN.as_secs_f64() => return None,
            Some((_, confirmation)) => confirmation.saturating_add(1),
            None => 0,
        };
        self.sent = Some((now, confirmation));
        Some(MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            param1: f32::from(self.wanted),
            command: MavCmd::MAV_CMD_SET_EKF_SOURCE_SET,
            target_system: self.system_id,
            target_component: AUTOPILOT,
            confirmation,
            ..COMMAND_LONG_DATA::default()
        }))
    }
}
