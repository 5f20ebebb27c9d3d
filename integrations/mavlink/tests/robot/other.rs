//! A flight controller.

use mavlink::dialects::ardupilotmega::{
    ATTITUDE_QUATERNION_DATA, COMMAND_ACK_DATA, GPS_RAW_INT_DATA, GpsFixType, HEARTBEAT_DATA, HIGHRES_IMU_DATA,
    HighresImuUpdatedFlags, MavAutopilot, MavMessage, MavModeFlag, MavResult, MavState, MavType, SCALED_IMU2_DATA,
    STATUSTEXT_DATA,
};
use mavlink::{MavHeader, MavlinkReader, MavlinkVersion, write_versioned_msg};
use std::net::UdpSocket;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Behaviour of the flight controller, which tests switch.
#[derive(Debug, Default)]
pub(crate) struct Behaviour {
    /// Sends no `HIGHRES_IMU`.
    pub(crate) is_mute: AtomicBool,
    /// Sends `HIGHRES_IMU` that has no values.
    pub(crate) is_empty: AtomicBool,
    /// Sends no heartbeats.
    pub(crate) is_dead: AtomicBool,
    /// Says that its receiver is spoofed.
    pub(crate) is_spoofed: AtomicBool,
    /// Sends without a pause.
    pub(crate) floods: AtomicBool,
    /// Lead of its clock, ms.
    pub(crate) ahead_ms: AtomicI64,
    /// `true` if its clock does not advance.
    pub(crate) is_still: AtomicBool,
    /// Answer to commands, if it answers.
    pub(crate) answer: Mutex<Option<MavResult>>,
    pub(crate) ends: AtomicBool,
}

/// Sends everything a hundred times a second, until it is dropped.
pub(crate) struct FlightController {
    pub(crate) address: String,
    pub(crate) behaviour: Arc<Behaviour>,
    pub(crate) received: Receiver<(MavHeader, MavMessage)>,
    thread: Option<JoinHandle<()>>,
}

impl FlightController {
    pub(crate) fn new() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port is free");
        let address = format!("udpout:{}", socket.local_addr().expect("it is bound"));
        socket.set_read_timeout(Some(Duration::from_millis(10))).expect("it can be set");
        let (hears, received) = channel();
        let behaviour = Arc::new(Behaviour::default());
        let shared = Arc::clone(&behaviour);
        let thread = thread::spawn(move || {
            let (start, mut sequence, mut buffer, mut peer) = (Instant::now(), 0_u8, [0; 2048], None);
            let mut commanded = None;
            while !shared.ends.load(Ordering::Acquire) {
                // Without a peer, or in the pauses.
                let listens = peer.is_none() || !shared.floods.load(Ordering::Acquire);
                if listens && let Ok((length, from)) = socket.recv_from(&mut buffer) {
                    peer = Some(from);
                    let Ok(frame) = MavlinkReader::new(&buffer[..length]).read_any_message() else { continue };
                    let answer = *shared.answer.lock().expect("nobody panics with it");
                    commanded = match (&frame.1, answer) {
                        (MavMessage::COMMAND_LONG(asked), Some(result)) => Some((asked.command, result)),
                        _ => None,
                    };
                    let _ = hears.send(frame);
                    if commanded.is_none() {
                        continue;
                    }
                }
                let Some(peer) = peer else { continue };
                let answer = commanded.take().map(|(command, result)| {
                    MavMessage::COMMAND_ACK(COMMAND_ACK_DATA { command, result, ..COMMAND_ACK_DATA::default() })
                });
                for message in messages(&shared, start).into_iter().chain(answer) {
                    let header = MavHeader { system_id: 1, component_id: 1, sequence };
                    sequence = sequence.wrapping_add(1);
                    let mut frame = Vec::new();
                    write_versioned_msg(&mut frame, MavlinkVersion::V2, header, &message)
                        .expect("a vector takes all");
                    let _ = socket.send_to(&frame, peer);
                }
            }
        });
        Self { address, behaviour, received, thread: Some(thread) }
    }

    /// The next message that fits.
    pub(crate) fn hears<T>(&self, mut fits: impl FnMut(MavHeader, MavMessage) -> Option<T>) -> Option<T> {
        std::iter::from_fn(|| self.received.recv_timeout(super::LONG).ok())
            .find_map(|(header, message)| fits(header, message))
    }
}

impl Drop for FlightController {
    fn drop(&mut self) {
        self.behaviour.ends.store(true, Ordering::Release);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn messages(behaviour: &Behaviour, start: Instant) -> Vec<MavMessage> {
    let elapsed = if behaviour.is_still.load(Ordering::Acquire) { 0 } else { start.elapsed().as_millis() as i64 };
    // It has been running for some time.
    let millis = (1_000_000 + elapsed + behaviour.ahead_ms.load(Ordering::Acquire)) as u64;
    let mut messages = vec![scaled(millis as u32), attitude(millis as u32), fix(millis * 1_000)];
    if !behaviour.is_mute.load(Ordering::Acquire) {
        messages.push(high_res(millis * 1_000, !behaviour.is_empty.load(Ordering::Acquire)));
    }
    if behaviour.is_spoofed.load(Ordering::Acquire) {
        let text = "GPS 1: spoofing indicated".into();
        messages.push(MavMessage::STATUSTEXT(STATUSTEXT_DATA { text, ..Default::default() }));
    }
    if !behaviour.is_dead.load(Ordering::Acquire) {
        messages.push(heartbeat());
    }
    messages
}

fn high_res(time_usec: u64, has_values: bool) -> MavMessage {
    MavMessage::HIGHRES_IMU(HIGHRES_IMU_DATA {
        time_usec,
        xacc: 0.5,
        yacc: 0.25,
        zacc: -9.75,
        xgyro: 0.125,
        ygyro: 0.0625,
        zgyro: 0.5,
        fields_updated: HighresImuUpdatedFlags::from_bits_truncate(if has_values { 0x3f } else { 0 }),
        ..Default::default()
    })
}

fn scaled(time_boot_ms: u32) -> MavMessage {
    MavMessage::SCALED_IMU2(SCALED_IMU2_DATA { time_boot_ms, zacc: -1000, xgyro: 250, ..Default::default() })
}

/// Level, to the east.
fn attitude(time_boot_ms: u32) -> MavMessage {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
        time_boot_ms,
        q1: half,
        q4: half,
        ..Default::default()
    })
}

fn fix(time_usec: u64) -> MavMessage {
    MavMessage::GPS_RAW_INT(GPS_RAW_INT_DATA {
        time_usec,
        fix_type: GpsFixType::GPS_FIX_TYPE_3D_FIX,
        lat: 481_000_000,
        lon: 115_000_000,
        alt: 500_000,
        eph: 80,
        satellites_visible: 12,
        ..Default::default()
    })
}

fn heartbeat() -> MavMessage {
    MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode: 5,
        mavtype: MavType::MAV_TYPE_QUADROTOR,
        autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
        system_status: MavState::MAV_STATE_ACTIVE,
        mavlink_version: 3,
    })
}
