//! Messages for ROS 2 itself to read and write back: run by `tests/ros2/check`, which names the folder.

use super::super::super::tests::bytes_of;
use super::super::super::{Field, Reader, bytes_to_json, json_schema, to_json, type_hash};
use super::of_each_ros_payload;
use super::random::Random;
use crate::message::{Payload, RosMessage, Schema, Stamped};
use crate::payload::*;
use serde_json::Value;
use std::path::PathBuf;

const FOLDER: &str = "BB_ROS2_FOLDER";
const EACH: usize = 20;

fn file(name: &str) -> PathBuf {
    PathBuf::from(std::env::var_os(FOLDER).expect("tests/ros2/check names the folder")).join(name)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn line<T: Field>(schema: Schema, hash: &str, value: &T, lines: &mut Vec<String>) {
    let bytes = bytes_of(value);
    let text = |text: &str| Value::from(text).to_string();
    // Kept as text: serde_json reads floats to the last bit but one.
    let value = bytes_to_json(&bytes, T::SHAPE).expect("it was written just now");
    lines.push(format!(
        r#"{{"name": {}, "definition": {}, "hash": {}, "cdr": {}, "json": {value}, "schema": {}}}"#,
        text(&schema.name),
        text(&schema.text),
        text(hash),
        text(&hex(&bytes)),
        json_schema(T::SHAPE),
    ));
}

/// Any value of ROS's message, and the payload it converts to.
fn as_ros<T: Payload + RosMessage>(random: &mut Random, lines: &mut Vec<String>) {
    for _ in 0..EACH {
        let payload = Stamped::new(random.value(), random.value::<T>());
        for message in [random.value::<T::Message>(), T::to_ros(&payload)] {
            let schema = Stamped::<T>::ros_schema().expect("ROS has it");
            line(schema, &Stamped::<T>::ros_type_hash().expect("ROS has it"), &message, lines);
        }
    }
}

/// The layout that ROS has no message for.
fn exactly<T: Payload>(random: &mut Random, lines: &mut Vec<String>) {
    for _ in 0..EACH {
        let schema = Stamped::<T>::schema();
        let hash = type_hash(&format!("{}Stamped", T::NAME), Stamped::<T>::SHAPE);
        line(schema, &hash, &random.value::<Stamped<T>>(), lines);
    }
}

#[test]
#[ignore = "tests/ros2/check runs it"]
fn messages_for_ros() {
    let random = &mut Random(7);
    let mut ros = Vec::new();
    of_each_ros_payload!(as_ros(random, &mut ros));
    std::fs::write(file("ros.jsonl"), ros.join("\n")).expect("the folder is there");
    let mut exact = Vec::new();
    of_each_ros_payload!(exactly(random, &mut exact));
    of_each_ros_payload!(exactly(random, &mut exact): Marg PowerState RelativePose BeginMotion EndMotion);
    std::fs::write(file("exact.jsonl"), exact.join("\n")).expect("the folder is there");
}

/// Returns whether a message written by ROS, in hexadecimal digits, is the one it was given.
fn is_read<T: Payload + RosMessage>(name: &str, cdr: &str, expected: &str) -> bool {
    if Stamped::<T>::ros_schema().is_none_or(|schema| schema.name != name) {
        return false;
    }
    let bytes: Result<Vec<u8>, _> =
        (0..cdr.len()).step_by(2).map(|at| u8::from_str_radix(&cdr[at..at + 2], 16)).collect();
    let bytes = bytes.expect("they are digits");
    let message =
        Reader::of_message(&bytes).and_then(|mut data| T::Message::read(&mut data)).expect("ROS has written it");
    assert_eq!(hex(&bytes_of(&message)), expected, "{name}: {}", to_json(&message));
    true
}

#[test]
#[ignore = "tests/ros2/check runs it"]
fn messages_from_ros() {
    let text = std::fs::read_to_string(file("back.jsonl")).expect("the check has written it");
    for line in text.lines() {
        let line: Value = serde_json::from_str(line).expect("it is JSON");
        let of = |key: &str| line[key].as_str().expect("it is text").to_owned();
        let (name, cdr, expected) = (of("name"), of("cdr"), of("expected"));
        let mut count = 0;
        fn counted<T: Payload + RosMessage>(texts: [&str; 3], count: &mut usize) {
            *count += usize::from(is_read::<T>(texts[0], texts[1], texts[2]));
        }
        of_each_ros_payload!(counted([&name, &cdr, &expected], &mut count));
        assert!(count > 0, "{name} is not one of our messages");
    }
}
