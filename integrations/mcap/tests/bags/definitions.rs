//! Messages of types that are known only from the definition in the file, and bags made of payloads.

use super::common::{Maker, big, file, header, imu, little, ros};
use bb_core::message::codec::{Shape, encode};
use bb_core::message::{Field, Schema};
use bb_core::nalgebra::Vector3;
use bb_core::payload::{Imu, MagneticField};
use bb_core::time::{MonotonicTime, WallTime};
use bb_core::{Payload, Stamped};
use bb_mcap::{Bag, BagWriter, MessageDefinition, RecorderOptions, RecordingErrorKind, Value};
use bb_tests::laws;
use mcap::WriteOptions;
use proptest::prelude::*;
use std::path::PathBuf;

/// All kinds of fields.
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "my_msgs/Everything")]
struct Everything {
    on: bool,
    small: Small,
    large: Large,
    floats: Floats,
    text: String,
    maybe: Option<f64>,
    list: Vec<Inner>,
    bytes: Vec<u8>,
    three: [f64; 3],
}

#[derive(Clone, Debug, PartialEq, Payload)]
struct Small(i8, i16, u8, u16);

#[derive(Clone, Debug, PartialEq, Payload)]
struct Large(i32, i64, u32, u64);

#[derive(Clone, Debug, PartialEq, Payload)]
struct Floats(f32, f64);

#[derive(Clone, Debug, PartialEq, Payload)]
struct Inner {
    id: u16,
    place: Vector3<f64>,
}

fn definition<T: Field>() -> MessageDefinition {
    let Shape::Struct(shape) = T::SHAPE else { panic!("a message is a struct") };
    let schema = Schema::new(shape.name, T::SHAPE);
    MessageDefinition::parse(&schema.name, &schema.text).expect("it is a definition")
}

/// The numbers and texts of a value, in their order.
fn leaves(value: &Value) -> Vec<String> {
    match value {
        Value::Message(fields) => fields.iter().flat_map(|(_, value)| leaves(value)).collect(),
        Value::List(values) => values.iter().flat_map(leaves).collect(),
        Value::Bytes(bytes) => bytes.iter().map(u8::to_string).collect(),
        Value::Bool(value) => vec![value.to_string()],
        Value::Signed(value) => vec![value.to_string()],
        Value::Unsigned(value) => vec![value.to_string()],
        Value::Variant { number, .. } => vec![number.to_string()],
        Value::F32(value) => vec![format!("{value:?}")],
        Value::F64(value) => vec![format!("{value:?}")],
        Value::Text(value) => vec![value.clone()],
    }
}

impl Everything {
    fn leaves(&self) -> Vec<String> {
        let Self { on, small, large, floats, text, maybe, list, bytes, three } = self;
        let mut leaves = vec![on.to_string()];
        leaves.extend([small.0.to_string(), small.1.to_string(), small.2.to_string(), small.3.to_string()]);
        leaves.extend([large.0.to_string(), large.1.to_string(), large.2.to_string(), large.3.to_string()]);
        leaves.extend([format!("{:?}", floats.0), format!("{:?}", floats.1), text.clone()]);
        leaves.extend(maybe.map(|value| format!("{value:?}")));
        for Inner { id, place } in list {
            leaves.push(id.to_string());
            leaves.extend(place.iter().map(|value| format!("{value:?}")));
        }
        leaves.extend(bytes.iter().map(u8::to_string));
        leaves.extend(three.iter().map(|value| format!("{value:?}")));
        leaves
    }
}

prop_compose! {
    fn inner()(id: u16, x: f64, y: f64, z: f64) -> Inner {
        Inner { id, place: Vector3::new(x, y, z) }
    }
}

prop_compose! {
    fn everything()(
        on: bool, small: (i8, i16, u8, u16), large: (i32, i64, u32, u64), floats: (f32, f64), text in "[a-zµ ]{0,9}",
        maybe: Option<f64>, list in prop::collection::vec(inner(), 0..4), bytes: Vec<u8>, three: [f64; 3],
    ) -> Everything {
        let small = Small(small.0, small.1, small.2, small.3);
        let large = Large(large.0, large.1, large.2, large.3);
        Everything { on, small, large, floats: Floats(floats.0, floats.1), text, maybe, list, bytes, three }
    }
}

laws! {
    /// A definition reads what the project writes of any type.
    #[test]
    fn a_definition_reads_what_was_written(value in everything()) {
        let mut bytes = Vec::new();
        encode(&value, &mut bytes);
        let read = definition::<Everything>().read(&bytes).expect("it is one");
        prop_assert_eq!(leaves(&read), value.leaves());
    }

    /// Bytes that end early are an error, and no bytes are a panic or a value of more than there are.
    #[test]
    fn damage_is_an_error(value in everything(), at in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let mut bytes = Vec::new();
        encode(&value, &mut bytes);
        let definition = definition::<Everything>();
        prop_assert!(definition.read(&bytes[..at.index(bytes.len())]).is_err());
        let changed = at.index(bytes.len());
        bytes[changed] = byte;
        if let Ok(read) = definition.read(&bytes) {
            prop_assert!(leaves(&read).len() <= bytes.len());
        }
    }

    #[test]
    fn no_definition_is_a_panic(text in "[a-c/ \\[\\]<=0-9#\n]{0,60}|(float64|string|uint8|A)(\\[[0-9]{0,20}\\])? x", bytes in any::<Vec<u8>>()) {
        if let Ok(definition) = MessageDefinition::parse("a/msg/A", &text) {
            let _ = definition.read(&bytes);
        }
    }
}

#[test]
fn a_wrong_field_is_named() {
    let definition = definition::<Everything>();
    assert!(!definition.has_header());
    let error = definition.read(&[0, 1, 0, 0, 1, 2, 3]).expect_err("it ends early");
    assert_eq!(error.to_string(), "`small.field_1`: expected a number at byte 2, found the end");
    let text = "Inner[2] list\n===\nMSG: a/Inner\nbool on\n";
    let definition = MessageDefinition::parse("a/msg/A", text).expect("it is one");
    let error = definition.read(&[0, 1, 0, 0, 1, 7]).expect_err("7 is no bool");
    assert_eq!(error.to_string(), "`list[1].on`: expected 0 or 1 at byte 2, found 7");
    let definition = MessageDefinition::parse("a/msg/A", "uint8[18446744073709551615] x").expect("it is one");
    let error = definition.read(&[0, 1, 0, 0, 1]).expect_err("so many are not there");
    assert_eq!(error.to_string(), "`x`: expected as many elements as are declared at byte 0, found 1 bytes");
}

/// Another encoder's messages, in both byte orders, of a type that the file does not define.
#[test]
fn known_types_need_no_definition() {
    let mut maker = Maker::new(WriteOptions::new());
    let channel = maker.topic("/imu", "sensor_msgs/msg/Imu");
    let other = maker.topic("/other", "my/msg/Other");
    maker.bytes(channel, &little(&imu(7)));
    maker.bytes(channel, &big(&imu(8)));
    maker.bytes(other, &little(&1_u8));
    let bag = Bag::open(file("known.mcap", &maker.finish())).expect("opens");
    let definition = bag.topics()[0].message_definition().expect("it is known");
    assert!(definition.has_header());
    for (message, sec) in bag.messages(&["/imu"]).expect("is there").zip([7, 8]) {
        let value = message.expect("is whole").value(&definition).expect("is one");
        let at = |names: &[&str]| names.iter().try_fold(&value, |value, name| value.field(name)).cloned();
        assert_eq!(at(&["header", "stamp", "sec"]), Some(Value::Signed(sec)));
        assert_eq!(at(&["header", "frame_id"]), Some(Value::Text(header(0).frame_id)));
        assert_eq!(at(&["angular_velocity", "z"]), Some(Value::F64(sec as f64)));
        assert_eq!(at(&["angular_velocity_covariance"]), Some(Value::List(vec![Value::F64(0.0); 9])));
    }
    let fault = bag.topics()[1].message_definition().expect_err("it is not known");
    assert_eq!(fault, "the file has no definition of my/msg/Other, and it is not a known type");
}

#[test]
fn messages_in_another_encoding_give_their_bytes() {
    let mut maker = Maker::new(WriteOptions::new());
    let channel = maker.topic_encoded("/state", "State", "json");
    maker.bytes(channel, b"{\"on\": true}");
    let bag = Bag::open(file("json.mcap", &maker.finish())).expect("opens");
    let error = bag.messages(&["/state"]).expect_err("is no CDR");
    assert!(matches!(error.kind(), RecordingErrorKind::Encoding { .. }));
    let mut messages = bag.messages_in_any_encoding(&["/state"]).expect("is there");
    let message = messages.next().expect("is one").expect("is whole");
    assert_eq!((&*message.encoding, &*message.data), ("json", &b"{\"on\": true}"[..]));
    let error = message.header().expect_err("is no CDR");
    assert!(matches!(error.kind(), RecordingErrorKind::Encoding { .. }));
}

fn out(name: &str) -> PathBuf {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&path);
    path
}

#[test]
fn a_bag_of_payloads_is_read_back() {
    let path = out("written.mcap");
    let mut writer = BagWriter::create(&path, &RecorderOptions::default()).expect("creates");
    let imus: Vec<_> = (0..500).map(|i| Imu::new(Vector3::new(f64::from(i), 0.0, 0.0), Vector3::z())).collect();
    for (second, imu) in (1..).zip(&imus) {
        let mut message = Stamped::new(MonotonicTime::ZERO, *imu);
        message.wall_time = WallTime::from_unix_nanos(second * 1_000_000_000);
        writer.payload("/imu", &message).expect("writes");
    }
    let field = Stamped::new(MonotonicTime::ZERO, MagneticField::new(Vector3::z()));
    let error = writer.payload("/imu", &field).expect_err("has another type");
    assert!(error.to_string().contains("sensor_msgs/msg/MagneticField"), "{error}");
    let own = Stamped::new(MonotonicTime::ZERO, Inner { id: 1, place: Vector3::z() });
    let error = writer.payload("/inner", &own).expect_err("ROS has none");
    assert!(error.to_string().contains("a payload that ROS has a message for"), "{error}");
    // Encoded elsewhere: what counts is the definition.
    let imu = Schema::new("sensor_msgs/Imu", Imu::ROS.expect("ROS has one").shape());
    let time = WallTime::from_unix_nanos(1);
    writer.encoded("/imu", &imu, time, &[0; 8]).expect("is the same type");
    let older = Schema { text: imu.text.replacen("float64", "float32", 1), ..imu };
    let error = writer.encoded("/imu", &older, time, &[0; 8]).expect_err("is defined otherwise");
    let said =
        "the messages of /imu are sensor_msgs/msg/Imu, and sensor_msgs/msg/Imu as it was defined before is needed";
    assert!(error.to_string().contains(said), "{error}");
    assert_eq!(writer.finish().expect("finishes"), 501);

    let bag = Bag::open(&path).expect("opens");
    assert_eq!((bag.topics().len(), bag.topics()[0].messages), (1, Some(501)));
    for (second, (message, imu)) in (1..).zip(bag.messages(&["/imu"]).expect("is there").zip(&imus)) {
        let (read, time) = message.expect("is whole").payload::<Imu>().expect("is one");
        assert_eq!((read, time.as_unix_nanos()), (*imu, second * 1_000_000_000));
    }
    let error = BagWriter::create(&path, &RecorderOptions::default()).expect_err("is there");
    assert!(matches!(error.kind(), RecordingErrorKind::Exists));
}

/// Types whose encoder is another's: rows of ROS's fields, as the tests declare them.
#[test]
fn definitions_of_bags_are_those_of_other_encoders() {
    let definition = MessageDefinition::parse("std_msgs/msg/Bool", "bool data").expect("it is one");
    let value = definition.read(&little(&ros::Bool { data: true })).expect("it is one");
    assert_eq!(value, Value::Message(vec![("data".into(), Value::Bool(true))]));
}
