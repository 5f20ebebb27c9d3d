//! A connection of a viewer: its requests, and the frames sent to it.

use crate::guests::Seat;
use crate::hub::{Hub, Position};
use crate::protocol::{self, Ask, Hello, Malformed, Request, VERSION, quoted};
use crate::shared::Shared;
use axum::extract::ws::{Message, WebSocket};
use bb_core::component::DynamicExecution;
use bb_core::event::{Right, Rights};
use bb_core::{Fault, Session};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::time::timeout;

/// Time within which the first message must arrive.
const FIRST_WITHIN: Duration = Duration::from_secs(5);
/// Time within which a message to a viewer must be sent.
const SENT_WITHIN: Duration = Duration::from_secs(5);
/// Number of wrong tokens that end a connection.
const MOST_GUESSES: u32 = 3;
/// Largest number of requests of one viewer that wait for the robot.
const MOST_WAITING: usize = 4;
/// Largest number of executions of one viewer that run.
const MOST_EXECUTIONS: usize = 64;

/// A viewer that has introduced itself.
struct Viewer<'a> {
    shared: &'a Shared,
    hub: &'a Hub,
    seat: &'a Seat,
    client: String,
    session: Arc<Session>,
    position: Position,
    watched: Vec<String>,
    executions: Vec<DynamicExecution>,
    guesses: u32,
    answers: mpsc::Sender<Answer>,
    waiting: usize,
}

/// Answer to a call of the robot.
enum Answer {
    Text(String),
    Started { id: u64, execution: DynamicExecution },
}

pub(crate) async fn serve(mut socket: WebSocket, shared: &Shared, seat: Seat) {
    if let Err(Some(error)) = talk(&mut socket, shared, &seat).await {
        // The viewer may be gone.
        let _ = send(&mut socket, protocol::error(&error)).await;
    }
    let _ = timeout(SENT_WITHIN, socket.send(Message::Close(None))).await;
}

/// Serves the connection until it ends, with an error to report, or `None` if the viewer has left.
async fn talk(socket: &mut WebSocket, shared: &Shared, seat: &Seat) -> Result<(), Option<String>> {
    let first = tokio::select! {
        first = timeout(FIRST_WITHIN, received(socket)) => first,
        () = seat.asked_to_leave() => return Err(Some("too many viewers are connected".to_owned())),
    };
    let first = first.map_err(|_| Some("expected `hello` within 5 s".to_owned()))?.ok_or(None)?;
    let hello = Hello::parse(&first).map_err(Some)?;
    let hub = match &hello.robot {
        None => shared.hubs.first(),
        Some(name) => shared.hubs.iter().find(|hub| hub.name == *name),
    };
    let hub = hub.ok_or_else(|| Some("no such robot is served here".to_owned()))?;
    let (answers, mut answered) = mpsc::channel(MOST_WAITING);
    let session = Arc::new(hub.bus.session("client", Rights::NONE));
    let (client, position, guesses) = (hello.client, Position::default(), 0);
    let (watched, executions) = (Vec::new(), Vec::new());
    let mut viewer =
        Viewer { shared, hub, seat, client, session, position, watched, executions, guesses, answers, waiting: 0 };
    viewer.introduce(hello.token.as_deref()).map_err(Some)?;
    send(socket, viewer.welcome()).await?;
    let mut frames = hub.frames();
    loop {
        let text = tokio::select! {
            () = seat.asked_to_leave() => return Err(Some("too many viewers are connected".to_owned())),
            text = received(socket) => viewer.ask(&text.ok_or(None)?).map_err(Some)?,
            answer = answered.recv() => answer.map(|answer| viewer.answered(answer)),
            changed = frames.changed() => {
                changed.map_err(|_| None)?;
                for text in viewer.results() {
                    send(socket, text).await?;
                }
                viewer.hub.frame(&mut viewer.position, &viewer.watched)
            }
        };
        if let Some(text) = text {
            send(socket, text).await?;
        }
    }
}

impl Viewer<'_> {
    /// Starts a session with the rights of the options if the token is right, otherwise with the right to read, if that needs no token.
    fn introduce(&mut self, token: Option<&str>) -> Result<(), String> {
        let is_known = match token {
            Some(token) if self.shared.token.is(token) => true,
            Some(_) => {
                self.guesses += 1;
                tracing::warn!(client = self.client, "a viewer of the dashboard gave a wrong token");
                if self.guesses >= MOST_GUESSES || self.shared.settings.reads_need_token {
                    return Err("the token is wrong".to_owned());
                }
                false
            }
            None if self.shared.settings.reads_need_token => return Err("the token is missing".to_owned()),
            None => false,
        };
        self.seat.set_has_token(is_known);
        let rights = if is_known { self.shared.settings.rights } else { [Right::Read].into() };
        self.session.end();
        self.session = Arc::new(self.hub.bus.session(format!("{} {}", self.client, self.seat.number()), rights));
        Ok(())
    }

    fn welcome(&self) -> String {
        let robots: Vec<String> = self.shared.hubs.iter().map(|hub| quoted(&hub.name)).collect();
        format!(
            r#"{{"op":"welcome","version":{VERSION},"robot":{},"robots":[{}],"caller":{},"rights":[{}],"meshes":{},"description":{}}}"#,
            quoted(&self.hub.name),
            robots.join(","),
            quoted(self.session.caller()),
            self.rights().join(","),
            self.shared.meshes.addresses(),
            self.session.description().to_json(),
        )
    }

    fn rights(&self) -> Vec<String> {
        let rights = self.session.rights();
        Right::ALL.into_iter().filter(|right| rights.contains(*right)).map(|right| quoted(right.name())).collect()
    }

    /// Answers a request; `None` if the answer has to wait for the robot.
    ///
    /// # Errors
    /// The reason for which the connection ends.
    fn ask(&mut self, text: &str) -> Result<Option<String>, String> {
        let Request { id, ask } = match Request::parse(text) {
            Ok(request) => request,
            Err(Malformed { id: Some(id), error }) => return Ok(Some(protocol::refused(id, &error))),
            Err(Malformed { id: None, error }) => return Err(error),
        };
        match ask {
            Ask::Ping => return Ok(Some(protocol::done(id, ""))),
            Ask::Describe => {
                return Ok(Some(protocol::done(
                    id,
                    &format!(r#","description":{}"#, self.session.description().to_json()),
                )));
            }
            Ask::Token(token) => {
                self.introduce(Some(&token))?;
                let is_known = self.seat.has_token();
                let rights = format!(r#","rights":[{}]"#, self.rights().join(","));
                return Ok(Some(if is_known {
                    protocol::done(id, &rights)
                } else {
                    protocol::refused(id, "the token is wrong")
                }));
            }
            Ask::Watch(paths) => {
                self.hub.watch(&self.watched, &paths);
                self.watched = paths;
                self.position.again();
                return Ok(Some(protocol::done(id, "")));
            }
            // Other requests must not keep a viewer from disarming the robot.
            Ask::Disarm if self.waiting < 2 * MOST_WAITING => {}
            _ if self.waiting >= MOST_WAITING => {
                return Ok(Some(protocol::refused(id, "too many requests of this viewer wait for the robot")));
            }
            Ask::Start { .. } if self.executions.len() >= MOST_EXECUTIONS => {
                return Ok(Some(protocol::refused(id, "too many commands of this viewer run")));
            }
            _ => {}
        }
        self.waiting += 1;
        let (session, answers) = (Arc::clone(&self.session), self.answers.clone());
        tokio::task::spawn_blocking(move || {
            let answer = perform(&session, id, ask);
            // The viewer may have left.
            let _ = answers.blocking_send(answer);
        });
        Ok(None)
    }

    fn answered(&mut self, answer: Answer) -> String {
        self.waiting = self.waiting.saturating_sub(1);
        match answer {
            Answer::Text(text) => text,
            Answer::Started { id, execution } => {
                let text = protocol::done(id, &format!(r#","execution":{}"#, execution.number()));
                self.executions.push(execution);
                text
            }
        }
    }

    /// Removes the executions that have ended, and returns their results.
    fn results(&mut self) -> Vec<String> {
        let mut results = Vec::new();
        self.executions.retain(|execution| match execution.try_result() {
            None => true,
            Some(result) => {
                let result = result.map_err(|fault| fault.to_string());
                results.push(protocol::result(execution.number(), &result));
                false
            }
        });
        results
    }
}

impl Drop for Viewer<'_> {
    fn drop(&mut self) {
        // Requests that still wait for the robot hold the session, and lose its rights.
        self.session.end();
        self.hub.watch(&self.watched, &[]);
    }
}

/// Performs a request, which may wait for the robot.
fn perform(session: &Session, id: u64, ask: Ask) -> Answer {
    let done: Result<String, String> = match ask {
        Ask::Arm => session.arm().map(|()| String::new()).map_err(|error| error.to_string()),
        Ask::Disarm => session.disarm().map(|()| String::new()).map_err(|error| error.to_string()),
        Ask::ForceDisarm => session.force_disarm().map(|()| String::new()).map_err(|error| error.to_string()),
        Ask::Stop => text(session.request_stop().map(|()| String::new())),
        Ask::Set(values) => {
            let values = values.iter().map(|(path, value)| (path.as_str(), value.as_str()));
            session.set_parameters_json(values).map(|()| String::new()).map_err(|error| error.to_string())
        }
        Ask::Start { path, arguments } => match session.start_command(&path, &arguments) {
            Ok(execution) => return Answer::Started { id, execution },
            Err(fault) => Err(fault.to_string()),
        },
        Ask::Cancel { execution } => text(session.cancel(execution).map(|()| String::new())),
        Ask::Send { path, command } => {
            text(session.send_json(&path, &command).map(|carried_out| format!(r#","command":{carried_out}"#)))
        }
        Ask::Publish { path, payload } => text(session.publish_json(&path, &payload).map(|()| String::new())),
        // The viewer has answered these itself.
        Ask::Ping | Ask::Token(_) | Ask::Describe | Ask::Watch(_) => Ok(String::new()),
    };
    Answer::Text(match done {
        Ok(more) => protocol::done(id, &more),
        Err(error) => protocol::refused(id, &error),
    })
}

fn text(result: Result<String, Fault>) -> Result<String, String> {
    result.map_err(|fault| fault.to_string())
}

/// The next text; `None` if the connection has ended.
async fn received(socket: &mut WebSocket) -> Option<String> {
    loop {
        match socket.recv().await? {
            Ok(Message::Text(text)) => return Some(text.as_str().to_owned()),
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            // Viewers send no binary messages.
            Ok(Message::Binary(_) | Message::Close(_)) | Err(_) => return None,
        }
    }
}

async fn send(socket: &mut WebSocket, text: String) -> Result<(), Option<String>> {
    match timeout(SENT_WITHIN, socket.send(Message::Text(text.into()))).await {
        Ok(Ok(())) => Ok(()),
        Ok(Err(_)) | Err(_) => Err(None),
    }
}
