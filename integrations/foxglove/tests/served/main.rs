//! A served robot, as clients of Foxglove's protocol see it.

mod clients;
#[allow(dead_code)]
#[path = "../../examples/foxglove_rover.rs"]
mod example;
mod protocol;

use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_core::{Bus, Options};
use bb_foxglove::{Foxglove, FoxgloveOptions};
use example::Drive;
use serde_json::{Value, json};
use std::collections::BTreeMap;
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
        self.ask(service, arguments);
        match self.next() {
            Got::Result(json) => Ok(json),
            Got::Text(failure) if failure["op"] == "serviceCallFailure" => {
                Err(failure["message"].as_str().unwrap_or_default().to_owned())
            }
            other => panic!("an answer is expected, not {other:?}"),
        }
    }

    /// Calls a service, and does not wait for its answer.
    fn ask(&mut self, service: &str, arguments: &str) {
        self.write(service, arguments);
        self.socket.flush().expect("it is connected");
    }

    /// Calls a service with the next call that is sent.
    fn write(&mut self, service: &str, arguments: &str) {
        let id = u32::try_from(self.services[service]).expect("it is small");
        let mut request = vec![2];
        for number in [id, 7, 4] {
            request.extend(number.to_le_bytes());
        }
        request.extend(b"json");
        request.extend(arguments.as_bytes());
        self.socket.write(Message::binary(request)).expect("it is connected");
    }
}

fn imu(count: u32) -> Imu {
    Imu::new(Vector3::zeros(), Vector3::new(f64::from(count), 0.0, 9.81))
}
