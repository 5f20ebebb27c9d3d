//! Clients that send garbage, or nothing, or too much: the next one is served.

use crate::client::{Client, open, stream, token};
use crate::protocol::options;
use crate::robot::Cart;
use bb_core::prelude::*;
use bb_dashboard::Dashboard;
use serde_json::json;
use std::error::Error;
use std::io::{Read, Write};
use tungstenite::Message;

#[test]
fn a_wrong_token_ends_the_connection_at_the_third_time() -> Result<(), Box<dyn Error>> {
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
fn garbage_ends_its_connection_alone() -> Result<(), Box<dyn Error>> {
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
        assert!(end.is_some(), "{:.20} is answered by an end", first);
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
    // A frame of 1 GiB is announced, and none follows.
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

/// Silent connections are closed to make room, and readers for those who come after them; nobody with the token is.
#[test]
fn however_many_connect_the_next_is_served() -> Result<(), Box<dyn Error>> {
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
    // Once all places are those of writers, a further viewer is refused rather than one of them closed.
    let mut writers: Vec<Client> = (0..15).map(|_| Client::steering(&dashboard)).collect::<Result<_, _>>()?;
    assert!(Client::reading(&dashboard).is_err());
    for writer in &mut writers {
        writer.ask("ping", json!({}))?;
    }
    steering.ask("ping", json!({}))?;
    Ok(())
}

/// A viewer that reads nothing loses its connection, and nobody else anything.
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
