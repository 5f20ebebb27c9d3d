//! A served robot, as clients of Foxglove's protocol see it.

use bb_core::component::ParameterDescription;
use bb_core::joints::ViewerChannel;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::prelude::*;
use bb_core::{Bus, Options, ParameterValue};
use bb_foxglove::{Foxglove, FoxgloveOptions};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Instant;
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};

const PATIENCE: Duration = Duration::from_secs(20);

/// A payload that ROS has no message for.
#[derive(Clone, Debug, PartialEq, Payload)]
struct Level {
    value: f64,
    picture: Vec<u8>,
}

#[derive(Clone, Copy, Debug, Default, Payload)]
struct Distance {
    /// Metres, ahead.
    #[payload(unit = "m", range = 0.0..=10.0)]
    distance: f64,
}

#[derive(Debug)]
struct Drive;

impl Command for Drive {
    type Options = NoOptions;
    type Arguments = Distance;
    type Output = f64;

    async fn run(_: NoOptions, of: Distance, _: CommandContext) -> Result<Outcome<f64>, Fault> {
        match of.distance {
            0.0 => Err(Fault::new("it has nowhere to go")),
            distance => Ok(Outcome::done(2.0 * distance)),
        }
    }
}

robot! {
    robot Rover;
    parameters {
        speed: f64 = 0.5 m/s, range: 0 m/s..=1.5 m/s;
        count: i64 = 3;
        name: String = "rover";
        lights: bool = false;
    }
    commands { drive: Drive { allowed_states: [idle]; } }
    link base {
        sensor imu: External<Imu>();
        sensor attitude: External<Orientation>();
        sensor level: External<Level>();
    }
}

fn served(robot: &Bus, rights: &str) -> Foxglove {
    let options = FoxgloveOptions { port: 0, rights: rights.into(), ..FoxgloveOptions::defaults() };
    Foxglove::serve(robot, options).unwrap_or_else(|error| panic!("{error}"))
}

fn until(mut condition: impl FnMut() -> bool) -> bool {
    let end = Instant::now() + PATIENCE;
    while !condition() {
        if Instant::now() > end {
            return false;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    true
}

/// A client, and what the server has said of itself.
struct Client {
    socket: WebSocket<TcpStream>,
    info: Value,
    /// The channels by topic.
    channels: BTreeMap<String, Value>,
    services: BTreeMap<String, u64>,
}

/// A message that a client gets.
#[derive(Debug)]
enum Got {
    /// Subscription, time and contents.
    Message(u32, u64, Vec<u8>),
    /// The result of a service.
    Result(String),
    Text(Value),
}

impl Client {
    fn connect(foxglove: &Foxglove) -> Self {
        Self::with(foxglove, &[]).unwrap_or_else(|error| panic!("{error}"))
    }

    fn with(foxglove: &Foxglove, headers: &[(&'static str, &'static str)]) -> tungstenite::Result<Self> {
        let mut request = format!("ws://{}/", foxglove.address()).into_client_request()?;
        for (name, value) in [("sec-websocket-protocol", "foxglove.sdk.v1")].iter().chain(headers) {
            request.headers_mut().insert(*name, HeaderValue::from_static(value));
        }
        let stream = TcpStream::connect(foxglove.address())?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let (socket, _) = tungstenite::client(request, stream).map_err(|error| match error {
            tungstenite::HandshakeError::Failure(error) => error,
            other => panic!("{other}"),
        })?;
        let mut client = Self { socket, info: Value::Null, channels: BTreeMap::new(), services: BTreeMap::new() };
        client.info = client.text("serverInfo");
        client.announced("/robot_description");
        if client.info["capabilities"].as_array().is_some_and(|all| all.iter().any(|one| one == "services")) {
            client.text("advertiseServices");
        }
        Ok(client)
    }

    fn send(&mut self, json: Value) {
        self.socket.send(Message::text(json.to_string())).expect("it is connected");
    }

    fn next(&mut self) -> Got {
        loop {
            match self.socket.read().expect("a message comes") {
                Message::Binary(bytes) if bytes[0] == 1 => {
                    let (number, time) = (&bytes[1..5], &bytes[5..13]);
                    let number = u32::from_le_bytes(number.try_into().expect("four bytes"));
                    let time = u64::from_le_bytes(time.try_into().expect("eight bytes"));
                    return Got::Message(number, time, bytes[13..].to_vec());
                }
                Message::Binary(bytes) => {
                    assert_eq!(bytes[0], 3);
                    let length = u32::from_le_bytes(bytes[9..13].try_into().expect("four bytes")) as usize;
                    assert_eq!(&bytes[13..13 + length], b"json");
                    return Got::Result(String::from_utf8(bytes[13 + length..].to_vec()).expect("it is text"));
                }
                Message::Text(text) => {
                    let value: Value = serde_json::from_str(&text).expect("it is JSON");
                    for channel in value["channels"].as_array().into_iter().flatten() {
                        self.channels.insert(channel["topic"].as_str().expect("a name").into(), channel.clone());
                    }
                    for service in value["services"].as_array().into_iter().flatten() {
                        let (name, id) = (service["name"].as_str(), service["id"].as_u64());
                        self.services.insert(name.expect("a name").into(), id.expect("a number"));
                    }
                    return Got::Text(value);
                }
                _ => {}
            }
        }
    }

    /// The next text of that kind.
    fn text(&mut self, op: &str) -> Value {
        loop {
            match self.next() {
                Got::Text(value) if value["op"] == op => return value,
                Got::Text(_) => {}
                other => panic!("{op} is expected, not {other:?}"),
            }
        }
    }

    fn announced(&mut self, topic: &str) {
        while !self.channels.contains_key(topic) {
            self.text("advertise");
        }
    }

    fn subscribe(&mut self, topic: &str, number: u32) {
        self.announced(topic);
        let channel = self.channels[topic]["id"].as_u64();
        self.send(json!({"op": "subscribe", "subscriptions": [{"id": number, "channelId": channel}]}));
    }

    fn message(&mut self) -> (u32, u64, Vec<u8>) {
        match self.next() {
            Got::Message(number, time, bytes) => (number, time, bytes),
            other => panic!("a message is expected, not {other:?}"),
        }
    }

    /// Calls a service, and returns its result in JSON or the reason of its failure.
    fn call(&mut self, service: &str, arguments: &str) -> Result<String, String> {
        let id = u32::try_from(self.services[service]).expect("it is small");
        let mut request = vec![2];
        for number in [id, 7, 4] {
            request.extend(number.to_le_bytes());
        }
        request.extend(b"json");
        request.extend(arguments.as_bytes());
        self.socket.send(Message::binary(request)).expect("it is connected");
        match self.next() {
            Got::Result(json) => Ok(json),
            Got::Text(failure) if failure["op"] == "serviceCallFailure" => {
                Err(failure["message"].as_str().unwrap_or_default().to_owned())
            }
            other => panic!("an answer is expected, not {other:?}"),
        }
    }
}

fn imu(count: u32) -> Imu {
    Imu::new(Vector3::zeros(), Vector3::new(f64::from(count), 0.0, 9.81))
}

#[test]
fn channels_are_those_of_a_recording_and_messages_its_bytes() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let mut client = Client::connect(&foxglove);
    assert_eq!((&client.info["name"], &client.info["capabilities"]), (&json!("Rover"), &json!([])));
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
    assert_eq!((foxglove.encoded(), foxglove.lost()), (1000, 0));
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
    assert!(until(|| foxglove.clients() == 2));
    publish();
    assert!(!is_subscribed());
    assert_eq!(foxglove.encoded(), 0);
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
    assert_eq!(foxglove.encoded(), 100);
    // One leaves, by a word or without.
    one.send(json!({"op": "unsubscribe", "subscriptionIds": [1]}));
    publish();
    (0..100).for_each(|_| _ = other.message());
    drop(other);
    assert!(until(|| {
        imus.publish(imu(0));
        !is_subscribed()
    }));
    let encoded = foxglove.encoded();
    assert!(encoded >= 200, "{encoded}");
    publish();
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(foxglove.encoded(), encoded);
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

fn parameter(robot: &Bus, path: &str) -> ParameterValue {
    let description = robot.description();
    let found: Option<&ParameterDescription> = description.parameter(path);
    found.expect("it is there").value.clone()
}

#[test]
fn without_rights_a_client_only_reads() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    assert!(foxglove.address().ip().is_loopback());
    let mut client = Client::connect(&foxglove);
    let speed = json!([{"name": "param/speed", "type": "float64", "value": 1.0}]);
    let attempts = [
        json!({"op": "setParameters", "parameters": speed, "id": "a"}),
        json!({"op": "getParameters", "parameterNames": [], "id": "a"}),
        json!({"op": "advertise", "channels": [{"id": 1, "topic": "/sensor/base/imu", "encoding": "cdr", "schemaName": "sensor_msgs/msg/Imu"}]}),
        json!({"op": "fetchAsset", "uri": "file:///etc/passwd", "requestId": 1}),
    ];
    for attempt in attempts {
        client.send(attempt.clone());
        assert_eq!(client.text("status")["level"], 2, "{attempt}");
    }
    client.services.insert("/command/drive".into(), 1);
    assert!(client.call("/command/drive", "{}").is_err());
    assert_eq!(parameter(&robot, "param/speed"), ParameterValue::Float(0.5));
}

#[test]
fn a_refused_parameter_keeps_its_value_and_the_client_gets_the_reason() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "parameters");
    let (mut client, mut other) = (Client::connect(&foxglove), Client::connect(&foxglove));
    assert_eq!(client.info["capabilities"], json!(["parameters", "parametersSubscribe"]));
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
        // The other one sees it as well.
        assert_eq!(value(&other.text("parameterValues"), name), expected, "{name} = {new}");
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
fn services_are_there_by_right_alone() {
    let robot = Rover::builder().simulate().expect("it starts");
    for (rights, expected) in [
        ("", &[][..]),
        ("parameters", &[]),
        ("commands", &["/command/drive"]),
        ("arm", &["/arm", "/disarm"]),
        ("arm commands", &["/arm", "/command/drive", "/disarm"]),
    ] {
        let foxglove = served(&robot, rights);
        let client = Client::connect(&foxglove);
        assert_eq!(client.services.keys().map(String::as_str).collect::<Vec<_>>(), expected, "{rights}");
    }
}

#[test]
fn a_service_answers_with_the_result_or_the_reason() {
    let running = Rover::builder().start().expect("it starts");
    let foxglove = served(&running, "arm commands");
    let mut client = Client::connect(&foxglove);
    let disarmed = client.call("/command/drive", r#"{"distance": 2}"#).expect_err("it is disarmed");
    assert_eq!(disarmed, "`drive` is refused: it is not allowed in the state `disarmed`");
    assert_eq!(client.call("/arm", ""), Ok("{}".into()));
    assert_eq!(client.call("/command/drive", r#"{"distance": 2}"#), Ok("4.0".into()));
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

#[test]
fn a_client_that_does_not_read_loses_the_oldest_and_costs_nobody_else() {
    const COUNT: u32 = 4000;
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let (mut slow, mut quick) = (Client::connect(&foxglove), Client::connect(&foxglove));
    for client in [&mut slow, &mut quick] {
        client.subscribe("/sensor/base/level", 1);
        client.send(json!({"op": "getParameters", "parameterNames": []}));
        client.text("status");
    }
    let levels = robot.publisher("sensor/base/level").expect("it is there");
    let mut longest = Duration::ZERO;
    for count in 0..COUNT {
        let start = Instant::now();
        levels.publish(Level { value: f64::from(count), picture: vec![0; 30_000] });
        longest = longest.max(start.elapsed());
        // At the pace of the one that reads.
        let (_, _, bytes) = quick.message();
        assert_eq!(number(&bytes), count);
    }
    assert!(longest < Duration::from_secs(1), "a publisher waited for {longest:?}");
    assert!(foxglove.lost() > 0, "the system holds all {COUNT} messages");
    let (mut numbers, mut told) = (Vec::new(), None);
    while numbers.last() != Some(&(COUNT - 1)) {
        match slow.next() {
            Got::Message(_, _, bytes) => numbers.push(number(&bytes)),
            Got::Text(status) => {
                assert_eq!((&status["op"], &status["level"]), (&json!("status"), &json!(1)));
                let said = status["message"].as_str().expect("it is text").to_owned();
                assert!(told.is_none() && said.starts_with("messages lost, the oldest first"), "{said}");
                told = said.rsplit(' ').next().and_then(|count| count.parse::<u64>().ok());
            }
            other => panic!("{other:?}"),
        }
    }
    // Each is received or counted; what is missing is before what is there.
    assert!(numbers.is_sorted());
    let received = numbers.len() as u64;
    assert_eq!((told, received + foxglove.lost()), (Some(foxglove.lost()), u64::from(COUNT)));
    let gaps = numbers.windows(2).filter(|two| two[1] != two[0] + 1).count();
    assert_eq!((gaps, numbers[0]), (1, 0), "what the system held, a gap, and the newest");
}

/// The number of a message of `Level`, from its end: value, number of bytes, bytes.
fn number(bytes: &[u8]) -> u32 {
    let end = bytes.len() - 30_000 - 4;
    let value = f64::from_le_bytes(bytes[end - 8..end].try_into().expect("eight bytes"));
    value as u32
}

#[test]
fn pages_of_other_sites_and_other_hosts_are_refused() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "parameters commands arm");
    let status = |headers: &[(&'static str, &'static str)]| match Client::with(&foxglove, headers) {
        Ok(_) => 101,
        Err(tungstenite::Error::Http(response)) => response.status().as_u16(),
        Err(error) => panic!("{error}"),
    };
    assert_eq!(status(&[("origin", "https://app.foxglove.dev")]), 101);
    assert_eq!(status(&[("host", "localhost:1234")]), 101);
    assert_eq!(status(&[("origin", "https://evil.example")]), 403);
    assert_eq!(status(&[("host", "evil.example:8765")]), 403);
    assert_eq!(status(&[("sec-websocket-protocol", "foxglove.websocket.v1")]), 400);
    // Those who say nothing, or nonsense, take no place for long.
    let hostile: Vec<TcpStream> = (0..40)
        .map(|number| {
            let mut stream = TcpStream::connect(foxglove.address()).expect("it listens");
            let text = ["GET / HTTP/1.1\r\n", "\0\0\0\0", "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n\u{81}"];
            _ = stream.write_all(text[number % 3].as_bytes());
            stream
        })
        .collect();
    assert!(until(|| Client::with(&foxglove, &[]).is_ok()));
    drop(hostile);
    let mut plain = TcpStream::connect(foxglove.address()).expect("it listens");
    plain.write_all(b"GET / HTTP/1.1\r\nHost: rebound.example\r\n\r\n").expect("it listens");
    let mut answer = String::new();
    _ = plain.read_to_string(&mut answer);
    assert!(answer.starts_with("HTTP/1.1 403 ") && answer.contains("`rebound.example`"), "{answer}");
}

#[test]
fn the_end_of_the_bridge_closes_its_connections() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let mut client = Client::connect(&foxglove);
    client.subscribe("/sensor/base/imu", 1);
    assert!(until(|| !robot.subscribers("sensor/base/imu").is_empty()));
    let start = Instant::now();
    let address = foxglove.address();
    drop(foxglove);
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
    while client.socket.read().is_ok() {}
    assert!(TcpStream::connect(address).is_err());
    robot.publisher("sensor/base/imu").expect("it is there").publish(imu(1));
    assert!(robot.subscribers("sensor/base/imu").is_empty());
}
