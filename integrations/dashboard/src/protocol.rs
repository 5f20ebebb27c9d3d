//! The messages of the WebSocket: JSON objects whose member `op` says what they are. The documentation of the crate lists them.

use serde_json::{Map, Value};

/// The version of the protocol. A client that asks for another is refused.
pub const VERSION: u64 = 1;

/// The longest message that a client may send.
pub(crate) const LONGEST: usize = 64 * 1024;

/// Number of paths that a client may watch at once.
const MOST_WATCHED: usize = 256;

/// The first message of a client.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Hello {
    pub(crate) client: String,
    pub(crate) token: Option<String>,
    pub(crate) robot: Option<String>,
}

/// Request of a client, with the number that its answer has.
#[derive(Debug, PartialEq)]
pub(crate) struct Request {
    pub(crate) id: u64,
    pub(crate) ask: Ask,
}

/// See [`Request`].
#[derive(Debug, PartialEq)]
pub(crate) enum Ask {
    Ping,
    Token(String),
    Describe,
    Watch(Vec<String>),
    Arm,
    Disarm,
    ForceDisarm,
    Stop,
    Set(Vec<(String, String)>),
    Start { path: String, arguments: String },
    Cancel { execution: u64 },
    Send { path: String, command: String },
    Publish { path: String, payload: String },
}

/// A malformed message, with the number of the request if it has one.
#[derive(Debug, PartialEq)]
pub(crate) struct Malformed {
    pub(crate) id: Option<u64>,
    pub(crate) error: String,
}

impl Hello {
    /// Parses the first message of a client.
    ///
    /// # Errors
    /// It is not a `hello` of this version.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let object = object(text)?;
        if object.get("op").and_then(Value::as_str) != Some("hello") {
            return Err("expected `hello` as the first message".to_owned());
        }
        match object.get("version").and_then(Value::as_u64) {
            Some(VERSION) => {}
            Some(other) => return Err(format!("this dashboard speaks version {VERSION}, not {other}")),
            None => return Err(format!("`hello` has no `version`; this dashboard speaks version {VERSION}")),
        }
        let text = |name: &str| object.get(name).and_then(Value::as_str).map(str::to_owned);
        let is_plain = |letter: &char| letter.is_ascii_alphanumeric() || "._-".contains(*letter);
        let client: String = text("client").unwrap_or_default().chars().filter(is_plain).take(32).collect();
        let client = if client.is_empty() { "client".to_owned() } else { client };
        Ok(Self { client, token: text("token"), robot: text("robot") })
    }
}

impl Request {
    /// Parses a request.
    ///
    /// # Errors
    /// It is not a request.
    pub(crate) fn parse(text: &str) -> Result<Self, Malformed> {
        let mut object = object(text).map_err(|error| Malformed { id: None, error })?;
        let id = object.get("id").and_then(Value::as_u64);
        let malformed = |error: String| Malformed { id, error };
        let Some(number) = id else { return Err(malformed("the request has no `id`".to_owned())) };
        ask(&mut object).map(|ask| Self { id: number, ask }).map_err(malformed)
    }
}

fn ask(object: &mut Map<String, Value>) -> Result<Ask, String> {
    let op = match object.remove("op") {
        Some(Value::String(op)) => op,
        _ => return Err("the request has no `op`".to_owned()),
    };
    Ok(match op.as_str() {
        "ping" => Ask::Ping,
        "token" => Ask::Token(text(object, "token")?),
        "describe" => Ask::Describe,
        "watch" => Ask::Watch(paths(object)?),
        "arm" => Ask::Arm,
        "disarm" => Ask::Disarm,
        "force_disarm" => Ask::ForceDisarm,
        "stop" => Ask::Stop,
        "set" => match object.remove("values") {
            Some(Value::Object(values)) => {
                Ask::Set(values.into_iter().map(|(path, value)| (path, value.to_string())).collect())
            }
            _ => return Err("`set` has no object `values`".to_owned()),
        },
        "start" => {
            let arguments = object.remove("arguments").filter(|arguments| !arguments.is_null());
            let arguments = arguments.map_or_else(String::new, |arguments| arguments.to_string());
            Ask::Start { path: text(object, "path")?, arguments }
        }
        "cancel" => {
            let execution = object.get("execution").and_then(Value::as_u64);
            Ask::Cancel { execution: execution.ok_or("`cancel` has no number `execution`")? }
        }
        "send" => {
            let command = object.remove("command").ok_or("`send` has no `command`")?.to_string();
            Ask::Send { path: text(object, "path")?, command }
        }
        "publish" => {
            let payload = object.remove("payload").ok_or("`publish` has no `payload`")?.to_string();
            Ask::Publish { path: text(object, "path")?, payload }
        }
        other => return Err(format!("`{other}` is no request")),
    })
}

fn paths(object: &Map<String, Value>) -> Result<Vec<String>, String> {
    let list = object.get("paths").and_then(Value::as_array).ok_or("`watch` has no list `paths`")?;
    if list.len() > MOST_WATCHED {
        return Err(format!("at most {MOST_WATCHED} paths may be watched at once"));
    }
    let paths = list.iter().map(|path| path.as_str().map(str::to_owned));
    paths.collect::<Option<_>>().ok_or_else(|| "`paths` holds something else than texts".to_owned())
}

fn text(object: &Map<String, Value>, name: &str) -> Result<String, String> {
    object
        .get(name)
        .and_then(Value::as_str)
        .map(str::to_owned)
        .ok_or_else(|| format!("the request has no text `{name}`"))
}

fn object(text: &str) -> Result<Map<String, Value>, String> {
    match serde_json::from_str(text) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(_) => Err("expected a JSON object".to_owned()),
        Err(error) => Err(format!("expected a JSON object: {error}")),
    }
}

/// A JSON string.
pub(crate) fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

/// An answer; `more` is empty, or members each after a comma.
pub(crate) fn done(id: u64, more: &str) -> String {
    format!(r#"{{"op":"answer","id":{id},"ok":true{more}}}"#)
}

pub(crate) fn refused(id: u64, error: &str) -> String {
    format!(r#"{{"op":"answer","id":{id},"error":{}}}"#, quoted(error))
}

/// The result of an execution that this client has started.
pub(crate) fn result(execution: u64, result: &Result<String, String>) -> String {
    match result {
        Ok(value) => format!(r#"{{"op":"result","execution":{execution},"value":{value}}}"#),
        Err(error) => format!(r#"{{"op":"result","execution":{execution},"error":{}}}"#, quoted(error)),
    }
}

pub(crate) fn error(error: &str) -> String {
    format!(r#"{{"op":"error","error":{}}}"#, quoted(error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_or_refused_with_their_number() {
        let parse = Request::parse;
        let arm = Request { id: 7, ask: Ask::Arm };
        assert_eq!(parse(r#"{"op":"arm","id":7}"#), Ok(arm));
        let start = Ask::Start { path: "command/go".into(), arguments: r#"{"far":1.5}"#.into() };
        assert_eq!(
            parse(r#"{"id":1,"op":"start","path":"command/go","arguments":{"far":1.5}}"#).map(|of| of.ask),
            Ok(start)
        );
        let set = Ask::Set(vec![("param/a".into(), "1".into()), ("param/b".into(), r#""x""#.into())]);
        assert_eq!(parse(r#"{"id":1,"op":"set","values":{"param/a":1,"param/b":"x"}}"#).map(|of| of.ask), Ok(set));
        let refused = |text: &str| parse(text).map(|_| ()).expect_err(text);
        let wrong = |id, error: &str| Malformed { id, error: error.to_owned() };
        assert_eq!(refused(r#"{"op":"arm"}"#), wrong(None, "the request has no `id`"));
        assert_eq!(refused(r#"{"id":3,"op":"fly"}"#), wrong(Some(3), "`fly` is no request"));
        assert_eq!(
            refused(r#"{"id":3,"op":"cancel","execution":-1}"#),
            wrong(Some(3), "`cancel` has no number `execution`")
        );
        assert_eq!(refused("[]"), wrong(None, "expected a JSON object"));
        let many = format!(r#"{{"id":1,"op":"watch","paths":[{}"a"]}}"#, r#""a","#.repeat(MOST_WATCHED));
        assert_eq!(refused(&many), wrong(Some(1), "at most 256 paths may be watched at once"));
    }

    #[test]
    fn the_first_message_is_a_hello_of_this_version() {
        let hello = Hello::parse(r#"{"op":"hello","version":1,"client":"page <1>\n","token":"a"}"#);
        assert_eq!(hello, Ok(Hello { client: "page1".into(), token: Some("a".into()), robot: None }));
        assert_eq!(
            Hello::parse(r#"{"op":"hello","version":2}"#),
            Err("this dashboard speaks version 1, not 2".into())
        );
        assert!(Hello::parse(r#"{"op":"arm","version":1}"#).is_err() && Hello::parse("").is_err());
    }
}
