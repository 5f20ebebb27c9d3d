//! A client of the WebSocket, and one of plain HTTP.

use bb_dashboard::Dashboard;
use serde_json::{Value, json};
use std::error::Error;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;
use tungstenite::{Message, WebSocket};

/// Long enough for a machine that is busy; nothing waits for it to pass.
const PATIENCE: Duration = Duration::from_secs(30);

/// A viewer.
pub(crate) struct Client {
    pub(crate) socket: WebSocket<TcpStream>,
    next: u64,
    pub(crate) welcome: Value,
    /// Messages that came while something else was awaited.
    kept: Vec<Value>,
}

pub(crate) fn token(dashboard: &Dashboard) -> String {
    dashboard.url().split("#token=").nth(1).unwrap_or_default().to_owned()
}

pub(crate) fn stream(address: SocketAddr) -> std::io::Result<TcpStream> {
    let stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    Ok(stream)
}

pub(crate) fn open(address: SocketAddr) -> Result<WebSocket<TcpStream>, Box<dyn Error>> {
    Ok(tungstenite::client(format!("ws://{address}/ws"), stream(address)?)?.0)
}

impl Client {
    /// Connects with the token, as `tester`.
    pub(crate) fn steering(dashboard: &Dashboard) -> Result<Self, Box<dyn Error>> {
        let token = token(dashboard);
        Self::with(dashboard, json!({"op": "hello", "version": 1, "client": "tester", "token": token}))
    }

    /// Connects without it, as `visitor`.
    pub(crate) fn reading(dashboard: &Dashboard) -> Result<Self, Box<dyn Error>> {
        Self::with(dashboard, json!({"op": "hello", "version": 1, "client": "visitor"}))
    }

    pub(crate) fn with(dashboard: &Dashboard, hello: Value) -> Result<Self, Box<dyn Error>> {
        let mut socket = open(dashboard.address())?;
        socket.send(Message::text(hello.to_string()))?;
        let mut client = Self { socket, next: 1, welcome: Value::Null, kept: Vec::new() };
        client.welcome = client.receive()?;
        match client.welcome["op"].as_str() {
            Some("welcome") => Ok(client),
            _ => Err(client.welcome["error"].as_str().unwrap_or("no welcome").into()),
        }
    }

    pub(crate) fn receive(&mut self) -> Result<Value, Box<dyn Error>> {
        loop {
            match self.socket.read()? {
                Message::Text(text) => return Ok(serde_json::from_str(text.as_str())?),
                Message::Close(_) => return Err("the connection was closed".into()),
                _ => {}
            }
        }
    }

    /// The answer to a request; what comes before it is kept for [`Self::until`].
    pub(crate) fn ask(&mut self, op: &str, mut more: Value) -> Result<Value, Box<dyn Error>> {
        let id = self.next;
        self.next += 1;
        more["op"] = op.into();
        more["id"] = id.into();
        self.socket.send(Message::text(more.to_string()))?;
        loop {
            let message = self.receive()?;
            if message["op"] == "answer" && message["id"] == id {
                return match message["error"].as_str() {
                    Some(error) => Err(error.into()),
                    None => Ok(message),
                };
            }
            self.kept.push(message);
        }
    }

    /// Returns the reason for which a request is refused.
    pub(crate) fn refusal(&mut self, op: &str, more: Value) -> String {
        self.ask(op, more).map_or_else(|error| error.to_string(), |answer| format!("not refused: {answer}"))
    }

    /// Returns what `find` makes of the first message that it accepts; those before it are kept.
    pub(crate) fn until<T>(&mut self, find: impl Fn(&Value) -> Option<T>) -> Result<T, Box<dyn Error>> {
        if let Some(index) = self.kept.iter().position(|message| find(message).is_some())
            && let Some(found) = find(&self.kept.remove(index))
        {
            return Ok(found);
        }
        loop {
            let message = self.receive()?;
            match find(&message) {
                Some(found) => return Ok(found),
                None => self.kept.push(message),
            }
        }
    }

    /// The first event that `find` takes.
    pub(crate) fn event(&mut self, find: impl Fn(&Value) -> bool) -> Result<Value, Box<dyn Error>> {
        self.until(|message| message["events"].as_array()?.iter().find(|event| find(event)).cloned())
    }
}

/// The head and the body of an answer to a request with these lines.
pub(crate) fn request(address: SocketAddr, lines: &str) -> Result<(String, String), Box<dyn Error>> {
    let mut stream = stream(address)?;
    stream.write_all(format!("{}\r\nConnection: close\r\n\r\n", lines.replace('\n', "\r\n")).as_bytes())?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer)?;
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let (head, body) = answer.split_once("\r\n\r\n").ok_or("no head")?;
    Ok((head.to_owned(), body.to_owned()))
}
