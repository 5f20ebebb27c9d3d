//! Makes small bags.

// The tests of the command compile this too, and use a part of it.
#![allow(dead_code, unreachable_pub)]

#[path = "ros.rs"]
pub mod ros;

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use byteorder::{BigEndian, LittleEndian};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use ros::*;
use serde::Serialize;

/// A bag that is being written.
pub struct Maker {
    writer: Writer<Cursor<Vec<u8>>>,
    messages: u64,
}

/// The four ways in which messages lie in a file. Chunks are small, so that a small bag has several.
pub fn layouts() -> [(&'static str, WriteOptions); 4] {
    let options = || WriteOptions::new().profile("ros2").chunk_size(Some(1500));
    [
        ("zstd", options().compression(Some(Compression::Zstd))),
        ("lz4", options().compression(Some(Compression::Lz4))),
        ("plain", options().compression(None)),
        ("chunkless", options().use_chunks(false)),
    ]
}

impl Maker {
    pub fn new(options: WriteOptions) -> Self {
        let writer = options.create(Cursor::new(Vec::new())).expect("starts");
        Self { writer, messages: 0 }
    }

    pub fn topic(&mut self, name: &str, schema: &str) -> u16 {
        self.topic_encoded(name, schema, "cdr")
    }

    pub fn topic_encoded(&mut self, name: &str, schema: &str, encoding: &str) -> u16 {
        let schema = self.writer.add_schema(schema, "ros2msg", b"").expect("schema");
        self.writer.add_channel(schema, name, encoding, &BTreeMap::new()).expect("channel")
    }

    /// Writes the messages 0, 10, 20, … ms after 12 s.
    pub fn bytes(&mut self, channel_id: u16, payload: &[u8]) {
        self.bytes_at(channel_id, 12_000_000_000 + 10_000_000 * self.messages, payload);
    }

    pub fn bytes_at(&mut self, channel_id: u16, log_time: u64, payload: &[u8]) {
        let sequence = self.messages as u32;
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.writer.write_to_known_channel(&header, payload).expect("message");
        self.messages += 1;
    }

    pub fn message(&mut self, channel: u16, message: &impl Serialize) {
        self.bytes(channel, &little(message));
    }

    pub fn finish(mut self) -> Vec<u8> {
        self.writer.finish().expect("finishes");
        self.writer.into_inner().into_inner()
    }
}

pub fn little(message: &impl Serialize) -> Vec<u8> {
    let mut payload = vec![0, 1, 0, 0];
    payload.extend(cdr_encoding::to_vec::<_, LittleEndian>(message).expect("encodes"));
    payload
}

pub fn big(message: &impl Serialize) -> Vec<u8> {
    let mut payload = vec![0, 0, 0, 0];
    payload.extend(cdr_encoding::to_vec::<_, BigEndian>(message).expect("encodes"));
    payload
}

pub fn header(sec: i32) -> Header {
    Header { stamp: Stamp { sec, nanosec: 500 }, frame_id: "imu_link".into() }
}

pub fn imu(sec: i32) -> Imu {
    Imu {
        header: header(sec),
        angular_velocity: Vector3 { x: 0.1, y: -0.2, z: f64::from(sec) },
        linear_acceleration: Vector3 { x: 0.0, y: 0.0, z: 9.81 },
        ..Imu::default()
    }
}

/// A bag of `n` messages on /imu and `n` on /moving, in turns.
pub fn walk(options: WriteOptions, n: i32) -> Vec<u8> {
    let mut maker = Maker::new(options);
    let a = maker.topic("/imu", "sensor_msgs/msg/Imu");
    let b = maker.topic("/moving", "std_msgs/msg/Bool");
    for i in 0..n {
        maker.message(a, &imu(i));
        maker.message(b, &Bool { data: i % 2 == 0 });
    }
    maker.finish()
}

/// A file of this name in the directory that cargo keeps for tests.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, bytes).expect("writes");
    path
}
