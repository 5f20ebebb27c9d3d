//! A connection to a running robot.

use super::address::Address;
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::net::TcpStream;
use std::time::Duration;
use strsim::levenshtein;
use tungstenite::{Message, WebSocket};

/// The version of the protocol.
const VERSION: u64 = 1;
/// Time without a message after which the robot is gone, since it sends reports all the time.
const SILENCE: Duration = Duration::from_secs(10);

/// A running robot.
pub(super) struct Robot {
    socket: WebSocket<TcpStream>,
    host: String,
    /// The id of the next request.
    next_id: u64,
    /// Messages that arrived while an answer was awaited.
    kept: VecDeque<Value>,
    /// `true` once a report has arrived. The first may have been made before the connection.
    has_report: bool,
    /// Name and parts of the robot, and the rights of this connection.
    pub(super) welcome: Value,
}

impl Robot {
    pub(super) fn connect(address: &Address, name: Option<&str>) -> Result<Self, String> {
        let host = &address.host;
        let failed = |why: String| format!("no robot at {host}: {why}");
        let stream = TcpStream::connect(host).map_err(|error| failed(error.to_string()))?;
        let _ = stream.set_nodelay(true);
        stream.set_read_timeout(Some(SILENCE)).map_err(|error| failed(error.to_string()))?;
        stream.set_write_timeout(Some(SILENCE)).map_err(|error| failed(error.to_string()))?;
        let (mut socket, _) =
            tungstenite::client(format!("ws://{host}/ws"), stream).map_err(|error| failed(error.to_string()))?;
        let mut hello = json!({"op": "hello", "version": VERSION, "client": "bb"});
        if let Some(token) = &address.token {
            hello["token"] = token.as_str().into();
        }
        if let Some(name) = name {
            hello["robot"] = name.into();
        }
        socket.send(Message::text(hello.to_string())).map_err(|error| failed(error.to_string()))?;
        let mut robot = Self {
            socket,
            host: host.clone(),
            next_id: 1,
            kept: VecDeque::new(),
            has_report: false,
            welcome: Value::Null,
        };
        robot.welcome = robot.receive()?;
        if address.token.is_some() && robot.welcome["rights"].as_array().is_some_and(|rights| rights.len() < 2) {
            return Err(format!(
                "the robot at {host} does not know the token, which may be of a run before; take the address that the dashboard prints"
            ));
        }
        Ok(robot)
    }

    /// The description of the robot's parts.
    pub(super) fn description(&self) -> &Value {
        &self.welcome["description"]
    }

    /// The elements of a list of the description.
    pub(super) fn listed(&self, list: &str) -> &[Value] {
        self.description()[list].as_array().map_or(&[], Vec::as_slice)
    }

    /// The element of a list with this path, which may lack its `prefix`; the error names the nearest one.
    pub(super) fn element(&self, list: &str, prefix: &str, path: &str) -> Result<&Value, String> {
        let long = format!("{prefix}{path}");
        let elements = self.listed(list);
        let found = elements.iter().find(|one| one["path"] == path || one["path"] == long.as_str());
        found.ok_or_else(|| {
            let mut paths: Vec<&str> = elements.iter().filter_map(|one| one["path"].as_str()).collect();
            paths.sort_by_key(|known| levenshtein(known, path).min(levenshtein(known, &long)));
            match paths.first() {
                Some(near) => format!("the robot has no `{path}`; did you mean `{near}`?"),
                None => format!("the robot has no `{path}`"),
            }
        })
    }

    /// The next message.
    pub(super) fn next(&mut self) -> Result<Value, String> {
        match self.kept.pop_front() {
            Some(message) => Ok(message),
            None => self.receive(),
        }
    }

    /// The next report made since the connection.
    pub(super) fn report(&mut self) -> Result<Value, String> {
        loop {
            if let Some(report) = self.next()?.get_mut("report")
                && std::mem::replace(&mut self.has_report, true)
            {
                return Ok(report.take());
            }
        }
    }

    /// Makes a request, and returns its answer.
    pub(super) fn ask(&mut self, op: &str, mut more: Value) -> Result<Value, String> {
        let id = self.next_id;
        self.next_id += 1;
        more["op"] = op.into();
        more["id"] = id.into();
        self.socket.send(Message::text(more.to_string())).map_err(|_| self.gone())?;
        loop {
            let message = self.receive()?;
            if message["op"] != "answer" || message["id"] != id {
                self.kept.push_back(message);
                continue;
            }
            return match message["error"].as_str() {
                Some(error) => Err(error.to_owned()),
                None => Ok(message),
            };
        }
    }

    fn receive(&mut self) -> Result<Value, String> {
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => {
                    let message: Value = serde_json::from_str(text.as_str())
                        .map_err(|error| format!("{} does not speak our protocol: {error}", self.host))?;
                    match message["error"].as_str() {
                        Some(error) if message["op"] == "error" => return Err(format!("{}: {error}", self.host)),
                        _ => return Ok(message),
                    }
                }
                Ok(Message::Ping(_) | Message::Pong(_)) => {}
                Ok(_) | Err(_) => return Err(self.gone()),
            }
        }
    }

    fn gone(&self) -> String {
        format!("the robot at {} is gone", self.host)
    }
}
