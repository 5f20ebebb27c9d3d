//! Topics, parameters and services as the protocol has them.

use crate::{Client, Level, Rover, imu, served, until};
use bb_core::joints::ViewerChannel;
use bb_core::nalgebra::UnitQuaternion;
use bb_core::prelude::*;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

#[test]
fn channels_are_those_of_a_recording_and_messages_its_bytes() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let mut client = Client::connect(&foxglove);
    assert_eq!((&client.info["name"], &client.info["capabilities"]), (&json!("Rover"), &json!(["services"])));
    let mut expected: BTreeMap<String, (String, String)> =
        ViewerChannel::ALL.map(|of| (of.topic().to_owned(), (of.schema().name, of.schema().text))).into();
    for topic in robot.description().topics {
        let (name, schema) = topic.layouts.channel(topic.path);
        expected.insert(name, (schema.name, schema.text));
        if let Some((name, schema)) = topic.layouts.companion_channel(topic.path) {
            expected.insert(name, (schema.name, schema.text));
        }
    }
    while client.channels.len() < expected.len() {
        client.text("advertise");
    }
    let text = |value: &Value| value.as_str().expect("it is text").to_owned();
    let found = client.channels.iter().map(|(topic, channel)| {
        assert_eq!(
            (text(&channel["encoding"]), text(&channel["schemaEncoding"])),
            ("cdr".into(), "ros2msg".into())
        );
        (topic.clone(), (text(&channel["schemaName"]), text(&channel["schema"])))
    });
    assert_eq!(found.collect::<BTreeMap<_, _>>(), expected);
    // One with ROS's layout, one with the exact one.
    let all = robot.subscribe_any(Select::Below("sensor/base"), None, Overflow::default());
    client.subscribe("/sensor/base/imu", 3);
    client.subscribe("/sensor/base/level", 4);
    assert!(until(
        || robot.subscribers("sensor/base/imu").len() == 2 && robot.subscribers("sensor/base/level").len() == 2
    ));
    let (imus, levels) = (robot.publisher("sensor/base/imu"), robot.publisher("sensor/base/level"));
    let (imus, levels) = (imus.expect("it is there"), levels.expect("it is there"));
    for count in 0..500 {
        imus.publish(imu(count));
        levels.publish(Level { value: f64::from(count), picture: vec![7; 100] });
    }
    let mut received = [Vec::new(), Vec::new()];
    for _ in 0..1000 {
        let (number, time, bytes) = client.message();
        received[number as usize - 3].push((time, bytes));
    }
    let mut sent = [Vec::new(), Vec::new()];
    for message in all.drain() {
        let mut bytes = Vec::new();
        let is_ros = message.encode_as_ros(&mut bytes);
        if !is_ros {
            message.encode(&mut bytes);
        }
        sent[usize::from(!is_ros)].push((message.stamp().wall_time.as_unix_nanos() as u64, bytes));
    }
    assert!(received == sent, "the messages differ");
    assert_eq!((foxglove.state().encoded, foxglove.state().lost), (1000, 0));
    // A path that is created later.
    robot.publisher::<Level>("rover/note").expect("it is a path of its own");
    client.announced("/rover/note");
}

#[test]
fn nothing_is_encoded_while_no_client_is_subscribed() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let imus = robot.publisher("sensor/base/imu").expect("it is there");
    let publish = || (0..100).for_each(|count| imus.publish(imu(count)));
    let is_subscribed = || !robot.subscribers("sensor/base/imu").is_empty();
    publish();
    let (mut one, mut other) = (Client::connect(&foxglove), Client::connect(&foxglove));
    assert!(until(|| foxglove.state().clients == 2));
    publish();
    assert!(!is_subscribed());
    assert_eq!(foxglove.state().encoded, 0);
    // Once for both.
    one.subscribe("/sensor/base/imu", 1);
    assert!(until(is_subscribed));
    other.subscribe("/sensor/base/imu", 1);
    other.send(json!({"op": "getParameters", "parameterNames": []}));
    // It is refused, after the subscription.
    assert!(other.text("status")["message"].as_str().is_some_and(|said| said.contains("parameters")));
    publish();
    for client in [&mut one, &mut other] {
        (0..100).for_each(|_| _ = client.message());
    }
    assert_eq!(foxglove.state().encoded, 100);
    // One leaves, by a word or without.
    one.send(json!({"op": "unsubscribe", "subscriptionIds": [1]}));
    publish();
    (0..100).for_each(|_| _ = other.message());
    drop(other);
    assert!(until(|| {
        imus.publish(imu(0));
        !is_subscribed()
    }));
    let encoded = foxglove.state().encoded;
    assert!(encoded >= 200, "{encoded}");
    publish();
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(foxglove.state().encoded, encoded);
}

#[test]
fn a_late_client_gets_the_description_and_the_transforms() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let mut early = Client::connect(&foxglove);
    early.subscribe("/robot_description", 1);
    let (_, _, first) = early.message();
    let mut late = Client::connect(&foxglove);
    for (number, topic) in [(1, "/robot_description"), (2, "/tf_static"), (3, "/tf")] {
        late.subscribe(topic, number);
    }
    let (number, _, description) = late.message();
    assert_eq!((number, &description), (1, &first));
    assert!(String::from_utf8_lossy(&description).contains("<robot name=\"Rover\""));
    assert_eq!(late.message().0, 2);
    assert!(until(|| !robot.subscribers("sensor/base/attitude").is_empty()));
    let attitude = Orientation { world_from_body: UnitQuaternion::identity(), covariance: None };
    robot.publisher("sensor/base/attitude").expect("it is there").publish(attitude);
    let (number, _, transforms) = late.message();
    assert!(number == 3 && String::from_utf8_lossy(&transforms).contains("world"), "{transforms:?}");
    // The one who came early got nothing twice.
    early.send(json!({"op": "setParameters", "parameters": []}));
    early.text("status");
}

#[test]
fn a_refused_parameter_keeps_its_value_and_the_client_gets_the_reason() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "parameters");
    let (mut client, mut other) = (Client::connect(&foxglove), Client::connect(&foxglove));
    assert_eq!(client.info["capabilities"], json!(["services", "parameters", "parametersSubscribe"]));
    let names = ["param/count", "param/lights", "param/name", "param/speed"];
    other.send(json!({"op": "subscribeParameterUpdates", "parameterNames": names}));
    other.send(json!({"op": "getParameters", "parameterNames": [], "id": "all"}));
    let all = other.text("parameterValues");
    let listed: BTreeSet<&str> =
        all["parameters"].as_array().into_iter().flatten().filter_map(|one| one["name"].as_str()).collect();
    assert_eq!(listed, BTreeSet::from(names));
    let value = |values: &Value, name: &str| {
        let found = values["parameters"].as_array().into_iter().flatten().find(|one| one["name"] == name);
        found.unwrap_or_else(|| panic!("{values}"))["value"].clone()
    };
    // A value, and the text of its refusal.
    let cases = [
        ("param/speed", json!(1.0), None),
        ("param/speed", json!(7.0), Some("0.0..=1.5 m/s")),
        ("param/speed", json!("fast"), Some("number")),
        ("param/speed", json!([1.0]), Some("number")),
        ("param/count", json!(5), None),
        ("param/count", json!(1.5), Some("param/count")),
        ("param/name", json!("other"), None),
        ("param/lights", json!(true), None),
        ("param/lights", json!({"on": true}), Some("param/lights")),
        ("param/speed", Value::Null, Some("cannot be removed")),
    ];
    for (number, (name, new, why)) in cases.into_iter().enumerate() {
        let id = number.to_string();
        client.send(json!({"op": "getParameters", "parameterNames": [name], "id": "before"}));
        let before = value(&client.text("parameterValues"), name);
        let mut given = json!({"name": name, "value": new});
        if new.is_null() {
            given = json!({"name": name});
        }
        client.send(json!({"op": "setParameters", "parameters": [given], "id": id}));
        let expected = if why.is_some() { before } else { new.clone() };
        if let Some(why) = why {
            let status = client.text("status");
            assert!(status["message"].as_str().is_some_and(|said| said.contains(why)), "{name} = {new}: {status}");
            assert_eq!(status["level"], 1);
        }
        let answer = client.text("parameterValues");
        assert_eq!((&answer["id"], value(&answer, name)), (&json!(id), expected.clone()), "{name} = {new}");
        // The other one sees what has changed.
        if why.is_none() {
            assert_eq!(value(&other.text("parameterValues"), name), expected, "{name} = {new}");
        }
    }
    // Of two, both or none.
    let both = json!([{"name": "param/count", "value": 9}, {"name": "param/speed", "value": 9.0}]);
    client.send(json!({"op": "setParameters", "parameters": both, "id": "both"}));
    client.text("status");
    assert_eq!(value(&client.text("parameterValues"), "param/count"), json!(5));
    client.send(json!({"op": "setParameters", "parameters": [{"name": "param/sped", "value": 1.0}], "id": "x"}));
    assert_eq!(
        client.text("status")["message"],
        json!("param/sped is not set: no such parameter is declared; did you mean `param/speed`?")
    );
    // A change by others.
    client.send(json!({"op": "subscribeParameterUpdates", "parameterNames": ["param/speed"]}));
    client.text("parameterValues");
    client.send(json!({"op": "getParameters", "parameterNames": ["param/speed"], "id": "here"}));
    while client.text("parameterValues")["id"] != "here" {}
    robot.bus().set_parameter("param/speed", 0.25).expect("it is in the range");
    assert_eq!(value(&client.text("parameterValues"), "param/speed"), json!(0.25));
}

#[test]
fn a_service_answers_with_the_result_or_the_reason() {
    let running = Rover::builder().start().expect("it starts");
    let foxglove = served(&running, "arm commands");
    let mut client = Client::connect(&foxglove);
    let disarmed = client.call("/command/drive", r#"{"distance": 2}"#).expect_err("it is disarmed");
    assert_eq!(disarmed, "`drive` is refused: it is not allowed in the state `disarmed`");
    assert_eq!(client.call("/arm", ""), Ok("{}".into()));
    assert_eq!(client.call("/command/drive", r#"{"distance": 2}"#), Ok("2.0".into()));
    assert_eq!(
        client.call("/command/drive", r#"{"distance": 0}"#),
        Err("the command failed: it has nowhere to go".into())
    );
    for wrong in [r#"{"distance": 99}"#, r#"{"distance": "far"}"#, "{", r#"{"way": 1}"#, "\u{fffd}"] {
        assert!(client.call("/command/drive", wrong).is_err(), "{wrong}");
    }
    assert_eq!(client.call("/disarm", "{}"), Ok("{}".into()));
    assert!(client.call("/command/drive", r#"{"distance": 2}"#).is_err());
}
