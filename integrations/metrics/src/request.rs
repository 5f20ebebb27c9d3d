//! One request on one connection: its head is read within limits, and answered.

use std::io::{self, Read, Write};
use std::net::{IpAddr, TcpStream};
use std::time::{Duration, Instant};

/// Largest length of a head, bytes. Prometheus' is below 500.
const LONGEST_HEAD: usize = 8 * 1024;
const MOST_HEADERS: usize = 64;
/// Time that a client may take to send its head, and to receive the answer.
const PATIENCE: Duration = Duration::from_secs(1);

/// Answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Metrics { with_body: bool },
    NotFound,
    NotAllowed,
    OtherHost,
    Bad,
    TooLong,
    TooSlow,
}

/// Reads one request and answers it; the connection is then closed.
///
/// # Errors
/// The client has gone, or does not accept the answer.
pub(crate) fn serve(mut stream: TcpStream, render: &dyn Fn() -> String) -> io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    let is_local = stream.local_addr()?.ip().is_loopback();
    let answer = read(&mut stream, is_local)?;
    write(&mut stream, answer, render)?;
    stream.shutdown(std::net::Shutdown::Write)
}

fn read(stream: &mut TcpStream, is_local: bool) -> io::Result<Answer> {
    let deadline = Instant::now() + PATIENCE;
    let mut head = [0; LONGEST_HEAD];
    let mut length = 0;
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(Answer::TooSlow);
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut head[length..]) {
            Ok(0) => return Ok(Answer::Bad),
            Ok(read) => length += read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                return Ok(Answer::TooSlow);
            }
            Err(error) => return Err(error),
        }
        match answer(&head[..length], is_local) {
            Some(answer) => return Ok(answer),
            None if length == LONGEST_HEAD => return Ok(Answer::TooLong),
            None => {}
        }
    }
}

/// The answer to a head; `None` if it is incomplete. At the loopback device only requests by its own names are answered: a page of another
/// site whose name leads there (DNS rebinding) does not read the counts.
fn answer(head: &[u8], is_local: bool) -> Option<Answer> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(head) {
        Ok(httparse::Status::Partial) => return None,
        Ok(httparse::Status::Complete(_)) => {}
        Err(httparse::Error::TooManyHeaders) => return Some(Answer::TooLong),
        Err(_) => return Some(Answer::Bad),
    }
    let mut hosts = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case("host"));
    if is_local && !hosts.all(|host| names_this_machine(host.value)) {
        return Some(Answer::OtherHost);
    }
    let path = request.path.unwrap_or("").split('?').next().unwrap_or("");
    Some(match (path, request.method) {
        ("/metrics", Some("GET")) => Answer::Metrics { with_body: true },
        ("/metrics", Some("HEAD")) => Answer::Metrics { with_body: false },
        ("/metrics", _) => Answer::NotAllowed,
        _ => Answer::NotFound,
    })
}

/// Returns whether a host, with any port, is a name of the loopback device.
fn names_this_machine(host: &[u8]) -> bool {
    let Ok(host) = std::str::from_utf8(host) else { return false };
    let host = host.trim();
    let is_port = |port: &str| !port.is_empty() && port.chars().all(|digit| digit.is_ascii_digit());
    let name = host.rsplit_once(':').filter(|(_, port)| is_port(port)).map_or(host, |(name, _)| name);
    name.eq_ignore_ascii_case("localhost")
        || name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

fn write(stream: &mut TcpStream, answer: Answer, render: &dyn Fn() -> String) -> io::Result<()> {
    const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    const PLAIN: &str = "text/plain; charset=utf-8";
    let (status, kind, body) = match answer {
        Answer::Metrics { .. } => ("200 OK", OPEN_METRICS, render()),
        Answer::NotFound => ("404 Not Found", PLAIN, "the metrics are at /metrics\n".into()),
        Answer::NotAllowed => ("405 Method Not Allowed\r\nAllow: GET, HEAD", PLAIN, "only GET and HEAD\n".into()),
        Answer::OtherHost => ("403 Forbidden", PLAIN, "this is not a name of the loopback device\n".into()),
        Answer::Bad => ("400 Bad Request", PLAIN, "this is no HTTP request\n".into()),
        Answer::TooLong => ("431 Request Header Fields Too Large", PLAIN, "the head is too long\n".into()),
        Answer::TooSlow => ("408 Request Timeout", PLAIN, "the request took too long\n".into()),
    };
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    if answer != (Answer::Metrics { with_body: false }) {
        stream.write_all(body.as_bytes())?;
    }
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_head_has_its_answer() {
        let rows: [(&str, Option<Answer>); 8] = [
            ("GET /metrics HTTP/1.1\r\n\r\n", Some(Answer::Metrics { with_body: true })),
            ("GET /metrics?name=a HTTP/1.0\r\nHost: a\r\n\r\n", Some(Answer::Metrics { with_body: true })),
            ("HEAD /metrics HTTP/1.1\r\n\r\n", Some(Answer::Metrics { with_body: false })),
            ("POST /metrics HTTP/1.1\r\n\r\n", Some(Answer::NotAllowed)),
            ("GET / HTTP/1.1\r\n\r\n", Some(Answer::NotFound)),
            ("GET /metrics HTTP/1.1\r\nHost", None),
            ("\u{1}\u{2}\r\n\r\n", Some(Answer::Bad)),
            ("GET /metrics FTP/1.1\r\n\r\n", Some(Answer::Bad)),
        ];
        for (head, expected) in rows {
            assert_eq!(answer(head.as_bytes(), false), expected, "{head:?}");
        }
        let many = format!("GET /metrics HTTP/1.1\r\n{}\r\n", "a: b\r\n".repeat(MOST_HEADERS + 1));
        assert_eq!(answer(many.as_bytes(), false), Some(Answer::TooLong));
    }

    #[test]
    fn at_the_loopback_device_only_its_names_are_answered() {
        let answered = |host: &str| {
            let head = format!("GET /metrics HTTP/1.1\r\nHost: {host}\r\n\r\n");
            answer(head.as_bytes(), true) == Some(Answer::Metrics { with_body: true })
        };
        for host in
            ["localhost", "LocalHost:9464", "127.0.0.1", "127.0.0.1:9464", "127.1.2.3:1", "[::1]:9464", "[::1]"]
        {
            assert!(answered(host), "{host}");
        }
        for host in
            ["evil.example", "evil.example:9464", "localhost.evil.example", "192.168.0.1:9464", "", "localhost:x"]
        {
            assert!(!answered(host), "{host}");
        }
        let twice = b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nhost: evil.example\r\n\r\n";
        assert_eq!(answer(twice, true), Some(Answer::OtherHost));
        assert_eq!(answer(b"GET /metrics HTTP/1.0\r\n\r\n", true), Some(Answer::Metrics { with_body: true }));
        assert_eq!(answer(twice, false), Some(Answer::Metrics { with_body: true }));
    }
}
