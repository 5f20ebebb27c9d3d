//! The door in front of Foxglove's server, which itself takes every connection: requests by a name that DNS rebinding leads here, and from the pages
//! of other sites, are refused before it sees a byte of them.

use crate::clients::Clients;
use std::io::{Error, ErrorKind};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::Semaphore;
use tokio::time::timeout;

/// Clients at the same time.
const MOST_CLIENTS: usize = 16;
/// Connections that have not said yet what they want, at the same time. Pages of all sites can make a browser open some.
const MOST_UNKNOWN: usize = 256;
/// The longest head of a request.
const LONGEST_HEAD: usize = 16 * 1024;
/// Time within which a client sends its request.
const PATIENCE: Duration = Duration::from_secs(5);
const END: &[u8] = b"\r\n\r\n";

/// The door, and the clients that it has let in.
pub(crate) struct Door {
    origins: Vec<String>,
    pub(crate) clients: Clients,
    room: Semaphore,
    unknown: Semaphore,
}

/// A refused request: its status, and the reason.
type Refused = (u16, String);

impl Door {
    pub(crate) fn new(origins: Vec<String>, clients: Clients) -> Self {
        Self { origins, clients, room: Semaphore::new(MOST_CLIENTS), unknown: Semaphore::new(MOST_UNKNOWN) }
    }

    /// Serves a connection until one of both sides ends it.
    pub(crate) async fn admit(self: Arc<Self>, mut client: TcpStream) {
        let Ok(unknown) = self.unknown.try_acquire() else { return };
        // Frames are whole messages.
        let _ = client.set_nodelay(true);
        let head = match timeout(PATIENCE, head(&mut client)).await {
            Ok(Ok(head)) => head,
            Ok(Err(_)) | Err(_) => return,
        };
        if let Err(refused) = check(&head, &self.origins) {
            tracing::warn!(why = refused.1, "a client of Foxglove's bridge is refused");
            return refuse(client, refused).await;
        }
        let Ok(_place) = self.room.try_acquire() else {
            return refuse(client, (503, "too many clients are connected".to_owned())).await;
        };
        drop(unknown);
        if let Err(error) = self.clients.serve(client, &head).await {
            tracing::debug!(%error, "a client of Foxglove's bridge is gone");
        }
    }
}

/// # Errors
/// The reason for which a request with this head is refused.
fn check(head: &[u8], origins: &[String]) -> Result<(), Refused> {
    let malformed = || (400, "this is no request for a WebSocket".to_owned());
    let head = std::str::from_utf8(head).map_err(|_| malformed())?;
    let mut lines = head.trim_end_matches("\r\n").split("\r\n");
    if !lines.next().is_some_and(|line| line.starts_with("GET ")) {
        return Err(malformed());
    }
    let mut host = None;
    for line in lines {
        // Neither a line that continues another nor one that another reader would divide.
        let (name, value) = line.split_once(':').ok_or_else(malformed)?;
        if name.is_empty()
            || name.contains(|letter: char| !letter.is_ascii_graphic())
            || line.contains(['\r', '\n'])
        {
            return Err(malformed());
        }
        let value = value.trim();
        if name.eq_ignore_ascii_case("host") && (host.replace(value).is_some() || !is_loopback(value)) {
            return Err((403, format!("the host name `{value}` is not one of the loopback device")));
        }
        if name.eq_ignore_ascii_case("origin") && !origins.contains(&value.to_ascii_lowercase()) {
            return Err((
                403,
                format!("pages of `{value}` may not connect; see the option `origins` of the bridge"),
            ));
        }
    }
    host.map(|_| ()).ok_or_else(malformed)
}

/// Returns whether it is a name of the loopback device, with any port: `ssh -L` gives it another.
fn is_loopback(host: &str) -> bool {
    let (name, port) = match host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((name, "")) => (name, None),
        Some((name, port)) => (name, Some(port.strip_prefix(':').unwrap_or(port))),
        None => host.split_once(':').map_or((host, None), |(name, port)| (name, Some(port))),
    };
    let has_name = name.eq_ignore_ascii_case("localhost") || ["127.0.0.1", "::1"].contains(&name);
    has_name && port.is_none_or(|port| port.parse::<u16>().is_ok())
}

/// The head of a request, to the empty line at its end.
async fn head(client: &mut TcpStream) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    let mut buffer = [0; 1024];
    while !head.ends_with(END) {
        let count = client.read(&mut buffer).await?;
        if count == 0 || head.len() + count > LONGEST_HEAD {
            return Err(Error::from(ErrorKind::InvalidData));
        }
        head.extend_from_slice(&buffer[..count]);
        // A client says no more before it is answered.
        if head.windows(END.len()).position(|four| four == END).is_some_and(|at| at + END.len() < head.len()) {
            return Err(Error::from(ErrorKind::InvalidData));
        }
    }
    Ok(head)
}

async fn refuse(mut client: TcpStream, (status, why): Refused) {
    let body = format!("{why}\n");
    let answer = format!(
        "HTTP/1.1 {status} Refused\r\ncontent-type: text/plain\r\ncontent-length: {}\r\nconnection: close\r\n\r\n{body}",
        body.len()
    );
    // It may be gone.
    let _ = timeout(PATIENCE, client.write_all(answer.as_bytes())).await;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(lines: &[&str]) -> u16 {
        let head = format!("GET / HTTP/1.1\r\n{}\r\n\r\n", lines.join("\r\n"));
        check(head.as_bytes(), &["https://app.foxglove.dev".to_owned()]).map_or_else(|(status, _)| status, |()| 0)
    }

    #[test]
    fn hosts_are_the_names_of_the_loopback_device() {
        for host in ["127.0.0.1:8765", "localhost:9000", "LOCALHOST", "[::1]:8765", "[::1]"] {
            assert_eq!(status(&[&format!("Host: {host}")]), 0, "{host}");
        }
        for host in [
            "evil.example:8765",
            "127.0.0.1.evil.example:8765",
            "localhost:",
            "localhost:x",
            "",
            "127.9.9.9:1",
            "[::1]x",
            "[::1]:",
        ] {
            assert_eq!(status(&[&format!("host:{host}")]), 403, "{host}");
        }
        assert_eq!(status(&["Host: localhost:1", "HOST: localhost:1"]), 403);
    }

    #[test]
    fn origins_are_an_exact_list() {
        let with = |origin: &str| status(&["Host: localhost:8765", &format!("Origin: {origin}")]);
        assert_eq!(with("https://app.foxglove.dev"), 0);
        for origin in [
            "http://app.foxglove.dev",
            "https://app.foxglove.dev.evil.example",
            "https://evil.example",
            "null",
            "",
            "http://localhost:8765",
        ] {
            assert_eq!(with(origin), 403, "{origin}");
        }
        assert_eq!(
            status(&["Host: localhost:1", "Origin: https://app.foxglove.dev", "origin: https://evil.example"]),
            403
        );
    }

    /// Heads that the server behind might read in another way than we do.
    #[test]
    fn heads_that_can_be_read_in_two_ways_are_refused() {
        let cases: &[&[&str]] = &[
            &[],
            &["Host: localhost:1", "Origin : https://evil.example"],
            &["Host: localhost:1", "X: y", " Origin: https://evil.example"],
            &["Host: localhost:1", "X: y\nOrigin: https://evil.example"],
            &["Host: localhost:1", "X: y\rOrigin: https://evil.example"],
            &["Host: localhost:1", "Origin"],
            &["Host: localhost:1", ": x"],
        ];
        for case in cases {
            assert_eq!(status(case), 400, "{case:?}");
        }
        for head in [
            &b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\n"[..],
            b"\r\n\r\n",
            b"GET / HTTP/1.1\r\nHost: \xff\r\n\r\n",
        ] {
            assert_eq!(check(head, &[]).map_err(|(status, _)| status), Err(400), "{head:?}");
        }
    }
}
