//! A flight controller at a serial port that is unplugged and comes back.

use bb_core::prelude::*;
use bb_estimators::navigation::state_estimator::FlightEstimate;
use bb_mavlink::{MavlinkHeartbeat, MavlinkImu, MavlinkSender};
use mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, MavMessage, SCALED_IMU2_DATA};
use mavlink::{MavHeader, MavlinkReader, MavlinkVersion, write_versioned_msg};
use serialport::{SerialPort, TTYPort};
use std::io::Write;
use std::path::PathBuf;

robot! {
    robot Drone;

    bridges { bridge position: MavlinkSender(link = "of the test", source = "sensor/base/estimate", component_id = 220); }
    link base {
        sensor estimate: External<FlightEstimate>();
        sensor imu: MavlinkImu(link = "of the test", message = "scaled_imu2", timeout = 60 s);
        sensor heartbeat: MavlinkHeartbeat(link = "of the test", timeout = 60 s);
    }
}

/// A device and the line to it, whose file is a link, as under `/dev/serial/by-id`.
fn plug_in(link: &PathBuf) -> (TTYPort, TTYPort) {
    let (device, line) = TTYPort::pair().expect("a pseudo-terminal");
    let _ = std::fs::remove_file(link);
    std::os::unix::fs::symlink(line.name().expect("it has a name"), link).expect("a link");
    (device, line)
}

#[test]
fn a_port_that_is_unplugged_is_opened_again_for_all_its_users() {
    let link = std::env::temp_dir().join(format!("bb-mavlink-{}", std::process::id()));
    let (mut device, line) = plug_in(&link);
    let mut builder = Drone::builder();
    let address = format!("serial:{}:57600", link.display());
    builder.options(drone::sensor::base::imu).link = address.clone();
    builder.options(drone::sensor::base::heartbeat).link = address.clone();
    builder.options(drone::bridge::position).link = address.clone();
    let faults = builder.subscribe(system::Faults);
    let readings = builder.subscribe(drone::sensor::base::imu);
    let heartbeats = builder.subscribe(drone::sensor::base::heartbeat);
    let running = builder.start().expect("the device is there");
    let mut millis = 1;
    let mut arrives = |device: &mut TTYPort| {
        (0..600).any(|_| {
            millis += 10;
            let sample = SCALED_IMU2_DATA { time_boot_ms: millis, zacc: -1000, ..Default::default() };
            let messages = [MavMessage::SCALED_IMU2(sample), MavMessage::HEARTBEAT(HEARTBEAT_DATA::default())];
            for message in messages {
                let header = MavHeader { system_id: 1, component_id: 1, sequence: 0 };
                let mut frame = b"noise".to_vec();
                write_versioned_msg(&mut frame, MavlinkVersion::V2, header, &message).expect("a vector takes all");
                let _ = device.write_all(&frame);
            }
            readings.recv_timeout(Duration::from_millis(50)).is_some() && heartbeats.try_recv().is_some()
        })
    };
    assert!(arrives(&mut device), "it measures");
    drop((device, line));
    let failed = format!("the link `{address}` has failed: ");
    let fault = std::iter::from_fn(|| faults.recv_timeout(Duration::from_secs(30)))
        .find(|fault| fault.message.contains(&failed))
        .expect("it is unplugged");
    assert!(fault.path.starts_with("sensor/base/"), "{}", fault.path);
    let (mut device, _line) = plug_in(&link);
    assert!(arrives(&mut device), "both come back");
    // The bridge has nothing to send, but has opened the port again nevertheless: its heartbeats arrive.
    device.set_timeout(Duration::from_secs(30)).expect("it can be set");
    let mut reader = MavlinkReader::new(&mut device);
    let is_of_bridge = |frame: (MavHeader, MavMessage)| frame.0.component_id == 220;
    assert!((0..1_000).map_while(|_| reader.read_any_message().ok()).any(is_of_bridge), "it says that it is there");
    let report = running.stop();
    assert!(report.sources.iter().all(|source| source.stopped.is_none()), "{report}");
    let _ = std::fs::remove_file(link);
}
