//! Messages that are packed one by one, as rosbag2 writes them with `--compression-mode message`.

use super::common::{Maker, file, imu, little};
use bb_core::prelude::*;
use bb_mcap::{Bag, MargSamples};
use mcap::WriteOptions;
use std::io::Write;

fn zstd(data: &[u8]) -> Vec<u8> {
    zstd::stream::encode_all(data, 0).expect("packs")
}

fn lz4(data: &[u8]) -> Vec<u8> {
    let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).expect("starts");
    encoder.write_all(data).expect("packs");
    encoder.finish().0
}

#[test]
fn packed_messages_are_read() {
    for (name, pack) in [("zstd", zstd as fn(&[u8]) -> Vec<u8>), ("lz4", lz4)] {
        let mut maker = Maker::new(WriteOptions::new());
        let topic = maker.topic("/imu", "sensor_msgs/msg/Imu");
        for number in 0..10 {
            maker.bytes(topic, &pack(&little(&imu(number))));
        }
        let bag = Bag::open(file(&format!("packed_{name}.mcap"), &maker.finish())).expect("opens");
        let samples = MargSamples::read(&bag, "/imu", None).expect("reads");
        let rates: Vec<f64> = samples.map(|sample| sample.expect("reads").1.imu.angular_velocity.z).collect();
        assert_eq!(rates, (0..10).map(f64::from).collect::<Vec<_>>(), "{name}");
    }
}

#[test]
fn a_damaged_packed_message_is_named_by_its_place() {
    let mut maker = Maker::new(WriteOptions::new());
    let topic = maker.topic("/imu", "sensor_msgs/msg/Imu");
    let packed = zstd(&little(&imu(0)));
    maker.bytes(topic, &packed);
    maker.bytes(topic, &packed[..packed.len() / 2]);
    let bag = Bag::open(file("packed_cut.mcap", &maker.finish())).expect("opens");
    let mut messages = bag.messages(&["/imu"]).expect("opens");
    assert!(messages.next().is_some_and(|first| first.is_ok_and(|first| first.payload::<Imu>().is_ok())));
    let said = messages.next().expect("there are two").expect_err("it is cut").to_string();
    assert!(said.contains("message 2 on /imu at 12.010 s (byte "), "{said}");
    assert!(said.contains("the message cannot be unpacked"), "{said}");
}
