//! Clients that may not, do not read, flood or leave.

use crate::{Client, Got, Level, Rover, imu, served, until};
use bb_core::component::ParameterDescription;
use bb_core::prelude::*;
use bb_core::{Bus, ParameterValue};
use serde_json::json;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tungstenite::Message;

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
fn services_are_there_by_right_alone() {
    let robot = Rover::builder().simulate().expect("it starts");
    for (rights, expected) in [
        ("", &["/disarm"][..]),
        ("parameters", &["/disarm"]),
        ("commands", &["/command/drive", "/disarm"]),
        ("arm", &["/arm", "/disarm"]),
        ("arm commands", &["/arm", "/command/drive", "/disarm"]),
    ] {
        let foxglove = served(&robot, rights);
        let client = Client::connect(&foxglove);
        assert_eq!(client.services.keys().map(String::as_str).collect::<Vec<_>>(), expected, "{rights}");
    }
}

/// A long message would be parsed on the thread that carries the requests of all clients.
#[test]
fn a_client_with_too_long_a_message_is_disconnected() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let parts = |total: usize, part: usize| {
        let mut client = Client::connect(&foxglove);
        let mut frames = Vec::new();
        for at in (0..total).step_by(part) {
            let (first, last) = (u8::from(at == 0), u8::from(at + part >= total));
            let length = u64::try_from(part).expect("it is short").to_be_bytes();
            frames.extend([last << 7 | first, 0xff]);
            frames.extend(length);
            frames.extend([0; 4]);
            frames.extend(std::iter::repeat_n(b' ', part));
        }
        // It may be gone before it has sent all.
        let _ = client.socket.get_mut().write_all(&frames);
        loop {
            match client.socket.read() {
                Err(_) => return true,
                // It is no JSON, which the server says.
                Ok(message) if message.is_text() && message.to_string().contains("\"status\"") => return false,
                Ok(_) => {}
            }
        }
    };
    assert!(!parts(65_536, 65_536) && !parts(65_536, 1024), "as long as allowed");
    assert!(parts(65_537, 65_537) && parts(128 * 1024, 1024), "in one frame, and in many");
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
    let mut shown = Instant::now();
    for count in 0..COUNT {
        // It is not frozen.
        if shown.elapsed() > Duration::from_secs(1) {
            slow.socket.send(Message::Pong(Vec::new().into())).expect("it is connected");
            shown = Instant::now();
        }
        let start = Instant::now();
        levels.publish(Level { value: f64::from(count), picture: vec![0; 30_000] });
        longest = longest.max(start.elapsed());
        // At the pace of the one that reads.
        let (_, _, bytes) = quick.message();
        assert_eq!(number(&bytes), count);
    }
    assert!(longest < Duration::from_secs(1), "a publisher waited for {longest:?}");
    assert!(foxglove.state().lost > 0, "the system holds all {COUNT} messages");
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
    assert_eq!((told, received + foxglove.state().lost), (Some(foxglove.state().lost), u64::from(COUNT)));
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

/// Goes on when it is cancelled, until the test lets it end.
#[derive(Debug)]
struct Stuck<const TEST: usize>;

static IS_INSIDE: [AtomicBool; 2] = [const { AtomicBool::new(false) }; 2];
static MAY_END: [AtomicBool; 2] = [const { AtomicBool::new(false) }; 2];

impl<const TEST: usize> Command for Stuck<TEST> {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        IS_INSIDE[TEST].store(true, Ordering::Relaxed);
        while !MAY_END[TEST].load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(Outcome::done(()))
    }
}

robot! {
    robot Flooded;
    commands { stuck: Stuck<0>; }
    link base;
}

robot! {
    robot Left;
    commands { stuck: Stuck<1>; }
    link base;
}

/// Makes a robot whose arming waits for a command that was cancelled.
fn hold_up(robot: &Bus, test: usize) {
    robot.arm().expect("it is armed");
    robot.start_command("command/stuck", "").expect("it is started");
    assert!(until(|| IS_INSIDE[test].load(Ordering::Relaxed)));
    robot.disarm().expect("it is disarmed");
}

#[test]
fn a_flood_of_requests_does_not_keep_the_robot_from_being_disarmed() {
    let robot = Flooded::builder().start().expect("it starts");
    let foxglove = served(&robot, "arm");
    hold_up(&robot, 0);
    let mut clients: Vec<Client> = (0..4).map(|_| Client::connect(&foxglove)).collect();
    for client in &mut clients {
        // More than it may, of which some are refused at once.
        (0..32).for_each(|_| client.ask("/arm", ""));
        for _ in 0..8 {
            let refused = client.text("serviceCallFailure");
            assert_eq!(refused["message"], "too many requests wait for the robot");
        }
    }
    // One that has asked for nothing yet, and then each of the others, whose arms end by it.
    let (begun, mut other) = (Instant::now(), Client::connect(&foxglove));
    assert_eq!(other.call("/disarm", ""), Ok("{}".into()));
    for client in &mut clients {
        client.ask("/disarm", "");
        while !matches!(client.next(), Got::Result(_)) {}
    }
    let took = begun.elapsed();
    assert!(took < Duration::from_secs(2), "{took:?}");
    // In one go with more calls than its server lets through.
    for client in &mut clients {
        (0..100).for_each(|_| client.write("/arm", ""));
        client.ask("/disarm", "");
        while let Got::Text(failure) = client.next() {
            assert_ne!(failure["message"], "Too many requests");
        }
    }
    MAY_END[0].store(true, Ordering::Relaxed);
}

/// Whom a page can make a browser connect with, which then says nothing.
#[test]
fn a_client_is_let_in_beside_those_that_do_not_say_what_they_want() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let half = || {
        let mut half = TcpStream::connect(foxglove.address()).expect("it listens");
        half.write_all(b"GET / HTTP/1.1\r\n").expect("it listens");
        half
    };
    let _halves: Vec<TcpStream> = (0..100).map(|_| half()).collect();
    let begun = Instant::now();
    Client::connect(&foxglove);
    let took = begun.elapsed();
    assert!(took < Duration::from_secs(2), "{took:?}");
}

#[test]
fn a_client_that_shows_no_sign_of_life_is_ended() {
    let robot = Rover::builder().simulate().expect("it starts");
    let foxglove = served(&robot, "");
    let (mut frozen, mut alive) = (Client::connect(&foxglove), Client::connect(&foxglove));
    let begun = Instant::now();
    alive.socket.get_mut().set_read_timeout(Some(Duration::from_millis(50))).expect("it may");
    let mut ended = None;
    while begun.elapsed() < Duration::from_secs(8) {
        // It answers pings by reading, and says nothing else.
        _ = alive.socket.read();
        if foxglove.state().clients == 1 {
            ended.get_or_insert(begun.elapsed());
        }
    }
    let ended = ended.expect("it is ended");
    assert!((Duration::from_millis(2500)..Duration::from_secs(6)).contains(&ended), "{ended:?}");
    assert_eq!(foxglove.state().clients, 1, "the other one is there");
    while frozen.socket.read().is_ok() {}
}

#[test]
fn what_a_client_has_asked_for_is_not_done_once_it_has_left() {
    let robot = Left::builder().start().expect("it starts");
    let foxglove = served(&robot, "arm");
    hold_up(&robot, 1);
    let mut client = Client::connect(&foxglove);
    client.ask("/arm", "");
    // The service has the request before the next one.
    client.send(json!({"op": "getParameters", "parameterNames": []}));
    client.text("status");
    drop(client);
    assert!(until(|| foxglove.state().clients == 0));
    MAY_END[1].store(true, Ordering::Relaxed);
    let waited = Instant::now();
    while waited.elapsed() < Duration::from_millis(300) {
        assert_eq!(robot.safety(), Safety::Disarmed);
        std::thread::sleep(Duration::from_millis(2));
    }
    let mut other = Client::connect(&foxglove);
    assert_eq!(other.call("/arm", ""), Ok("{}".into()));
    assert_eq!(robot.safety(), Safety::Armed);
}
