//! Clients that send garbage, nothing or too much, beside which others are served.

use crate::client::{Client, open, stream, token};
use crate::protocol::options;
use crate::robot::{Cart, Level};
use bb_core::prelude::*;
use bb_dashboard::Dashboard;
use serde_json::json;
use std::error::Error;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use tungstenite::Message;

#[test]
fn the_third_wrong_token_closes_the_connection() -> Result<(), Box<dyn Error>> {
    let simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    let mut right = token(&dashboard);
    let last = if right.ends_with('0') { "1" } else { "0" };
    right.replace_range(31.., last);
    let wrong = right;
    let mut guesser = Client::with(&dashboard, json!({"op": "hello", "version": 1, "token": wrong}))?;
    assert_eq!(guesser.welcome["rights"], json!(["read"]));
    assert_eq!(guesser.refusal("token", json!({"token": wrong})), "the token is wrong");
    assert!(guesser.ask("token", json!({"token": wrong})).is_err());
    assert!(guesser.ask("ping", json!({})).is_err(), "the connection has ended");
    Client::steering(&dashboard)?.ask("ping", json!({}))?;
    Ok(())
}

#[test]
fn garbage_closes_only_its_own_connection() -> Result<(), Box<dyn Error>> {
    let simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    let mut watching = Client::reading(&dashboard)?;
    let hello = r#"{"op":"hello","version":1}"#;
    let long = "x".repeat(70_000);
    for first in ["", "{", "[]", "null", r#"{"op":"hello"}"#, r#"{"op":"hello","version":7}"#, &long] {
        let mut socket = open(dashboard.address())?;
        socket.send(Message::text(first))?;
        let end = (0..4)
            .find_map(|_| socket.read().map_or_else(|_| Some(()), |message| message.is_close().then_some(())));
        assert!(end.is_some(), "{:.20} closes the connection", first);
    }
    for then in
        [Message::text("{"), Message::text("{}"), Message::binary(vec![1, 2, 3]), Message::text(long.clone())]
    {
        let mut socket = open(dashboard.address())?;
        socket.send(Message::text(hello))?;
        // It may be closed while this is still being sent.
        let _ = socket.send(then);
        while socket.read().is_ok_and(|message| !message.is_close()) {}
    }
    // The header of a frame of 1 GiB without its payload.
    let mut socket = open(dashboard.address())?;
    socket.get_mut().write_all(&[0x81, 0xff, 0, 0, 0, 0, 0x40, 0, 0, 0, 1, 2, 3, 4])?;
    let mut rest = Vec::new();
    // Closed, or reset.
    let _ = socket.get_mut().read_to_end(&mut rest);
    for bytes in [&b"\x00\x01\x02\r\n\r\n"[..], b"GET / HTTP/1.1\r\nHost: \xff\r\nConnection: close\r\n\r\n"] {
        let mut raw = stream(dashboard.address())?;
        raw.write_all(bytes)?;
        let mut answer = Vec::new();
        let _ = raw.read_to_end(&mut answer);
        assert!(!answer.starts_with(b"HTTP/1.1 200"));
    }
    watching.ask("ping", json!({}))?;
    let refused = watching.refusal("fly", json!({}));
    assert_eq!(refused, "`fly` is no request");
    Ok(())
}

/// The oldest silent connections and readers are closed to make room, but never a client with the token.
#[test]
fn new_clients_are_served_beside_300_silent_ones() -> Result<(), Box<dyn Error>> {
    let simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    let mut steering = Client::steering(&dashboard)?;
    // More than may be open, some in the middle of a request.
    let mut silent = Vec::new();
    for number in 0..300 {
        let mut stream = stream(dashboard.address())?;
        if number % 2 == 0 {
            let _ = stream.write_all(b"GET /ws HTTP/1.1\r\nUpgrade: websocket\r\n");
        }
        silent.push(stream);
    }
    let mut closed = [0; 1];
    assert!(matches!(silent[0].read(&mut closed), Ok(0) | Err(_)), "the oldest was closed");
    let readers: Vec<Client> = (0..40).map(|_| Client::reading(&dashboard)).collect::<Result<_, _>>()?;
    assert!(dashboard.viewers() <= 16, "{}", dashboard.viewers());
    steering.ask("ping", json!({}))?;
    let page = crate::client::request(
        dashboard.address(),
        &format!("GET / HTTP/1.1\nHost: localhost:{}", dashboard.address().port()),
    )?;
    assert!(page.0.starts_with("HTTP/1.1 200"));
    drop((silent, readers));
    // If all places are taken by writers, a further viewer is refused.
    let mut writers: Vec<Client> = (0..15).map(|_| Client::steering(&dashboard)).collect::<Result<_, _>>()?;
    assert!(Client::reading(&dashboard).is_err());
    for writer in &mut writers {
        writer.ask("ping", json!({}))?;
    }
    steering.ask("ping", json!({}))?;
    Ok(())
}

/// Requests beyond the limit of one viewer are refused.
#[test]
fn requests_of_one_viewer_are_bounded() -> Result<(), Box<dyn Error>> {
    let simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    let mut client = Client::steering(&dashboard)?;
    for id in 1000..3000 {
        client.socket.send(Message::text(format!(r#"{{"op":"arm","id":{id}}}"#)))?;
    }
    for id in 1000..3000 {
        let answer = client.until(|message| (message["op"] == "answer").then(|| message.clone()))?;
        let error = answer["error"].as_str().unwrap_or("too many requests");
        assert!(error.starts_with("too many requests"), "{id}: {answer}");
    }
    assert_eq!(simulation.safety(), Safety::Armed);
    Ok(())
}

/// Environment variable with the address for the viewer in another process.
const VIEWER: &str = "BB_TEST_VIEWER";

/// A long text.
#[derive(Clone, Debug, Payload)]
struct Long {
    text: String,
}

/// Viewer that the test below stops and kills; does nothing without the address.
#[test]
#[ignore = "run by another test in a process of its own"]
fn viewer_in_another_process() -> Result<(), Box<dyn Error>> {
    let Ok(address) = std::env::var(VIEWER) else { return Ok(()) };
    let mut socket = open(address.parse()?)?;
    socket.send(Message::text(r#"{"op":"hello","version":1}"#))?;
    socket.send(Message::text(r#"{"op":"watch","id":1,"paths":["sensor/base/level","own/long"]}"#))?;
    let mut messages = 0;
    loop {
        socket.read()?;
        messages += 1;
        if messages == 20 {
            println!("\nwatching");
        }
    }
}

fn signal(viewer: &Child, signal: &str) -> Result<(), Box<dyn Error>> {
    let status = Command::new("kill").args([signal, &viewer.id().to_string()]).status()?;
    if status.success() { Ok(()) } else { Err("it is gone".into()) }
}

/// Resident memory of this process, bytes.
fn resident() -> Result<u64, Box<dyn Error>> {
    let pages = std::fs::read_to_string("/proc/self/statm")?;
    Ok(pages.split(' ').nth(1).ok_or("it has two numbers")?.parse::<u64>()? * 4096)
}

/// Latency of callbacks, memory and the next viewer, while a viewer is stopped with full buffers, and after it was killed.
#[cfg(target_os = "linux")]
#[test]
fn a_viewer_that_is_stopped_or_killed_costs_the_robot_nothing() -> Result<(), Box<dyn Error>> {
    let running = Cart::builder().start()?;
    let dashboard = Dashboard::serve(&running, options())?;
    let level = running.publisher::<Level>("sensor/base/level")?;
    let long = running.publisher::<Long>("own/long")?;
    let text = "x".repeat(200_000);
    // The 99.9th percentile of the callbacks' durations, at 1 kHz beside 3 MB/s of text.
    let feed = |seconds: f64| {
        let (start, mut taken) = (Instant::now(), Vec::new());
        while start.elapsed().as_secs_f64() < seconds {
            if taken.len() % 50 == 0 {
                long.publish(Long { text: text.clone() });
            }
            let before = Instant::now();
            level.publish(Level { value: 1.0 });
            taken.push(before.elapsed());
            std::thread::sleep(Duration::from_millis(1));
        }
        taken.sort_unstable();
        taken[taken.len() - 1 - taken.len() / 1000]
    };
    let alone = feed(2.0);
    let mut viewer = Command::new(std::env::current_exe()?)
        .args(["--ignored", "--exact", "hostile::viewer_in_another_process", "--nocapture"])
        .env(VIEWER, dashboard.address().to_string())
        .stdout(Stdio::piped())
        .spawn()?;
    let output = BufReader::new(viewer.stdout.take().ok_or("it is piped")?);
    let watching = std::thread::spawn(move || output.lines().map_while(Result::ok).any(|line| line == "watching"));
    let watched = feed(2.0);
    assert!(watching.is_finished() && watching.join().is_ok_and(|is_watching| is_watching), "it watches");
    let before = resident()?;
    signal(&viewer, "-STOP")?;
    // Longer than a message to it may take.
    let stopped = feed(6.0);
    let grown = resident()?.saturating_sub(before);
    let served = |what: &str| -> Result<(), Box<dyn Error>> {
        let start = Instant::now();
        let mut next = Client::reading(&dashboard)?;
        next.until(|message| message.get("report").map(|_| ()))?;
        let taken = start.elapsed();
        println!("{what}: the next viewer is served after {taken:?}");
        assert!(taken < Duration::from_secs(1), "{what}: {taken:?}");
        Ok(())
    };
    served("stopped")?;
    signal(&viewer, "-KILL")?;
    viewer.wait()?;
    served("killed")?;
    let killed = feed(2.0);
    println!(
        "p99.9 alone {alone:?}, watched {watched:?}, stopped {stopped:?}, killed {killed:?}; {grown} bytes more"
    );
    assert!(grown < 20 << 20, "{grown} bytes");
    // A callback that waited for the viewer would wait for as long as a message to it may take: 5 s.
    let longest = (10 * alone.max(watched)).max(Duration::from_millis(5));
    assert!(stopped < longest && killed < longest, "{alone:?} {watched:?} {stopped:?} {killed:?}");
    Ok(())
}
