//! Helpers of the tests.

use bb_core::prelude::*;
use bb_zenoh::{Mode, Session, SessionSettings};
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Enough for a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(30);

/// An address that nobody listens on.
pub(crate) fn free_address() -> SocketAddr {
    TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("one is free")
}

/// An endpoint that nobody listens on.
pub(crate) fn free_endpoint() -> String {
    format!("tcp/{}", free_address())
}

pub(crate) fn until(mut condition: impl FnMut() -> bool) -> bool {
    let end = Instant::now() + PATIENCE;
    while !condition() {
        if Instant::now() > end {
            return false;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    true
}

/// Opens a session that knows these endpoints alone. The same settings are the same session: another one lists an endpoint more often.
pub(crate) fn connected(connect: Vec<String>, file: Option<PathBuf>) -> Session {
    Session::open(&SessionSettings { connect, file, ..SessionSettings::default() }).expect("it is opened")
}

/// Opens a router, as soon as the endpoint is free.
pub(crate) fn router(endpoint: &str) -> Session {
    let settings =
        SessionSettings { mode: Mode::Router, listen: vec![endpoint.to_owned()], ..SessionSettings::default() };
    let mut router = None;
    assert!(until(|| {
        router = Session::open(&settings).ok();
        router.is_some()
    }));
    router.expect("it is opened")
}

/// A folder of this process.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("bb-zenoh-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("it is made");
    folder
}

/// A template of `access/` with other texts in it, as a file of its own.
pub(crate) fn changed(template: &str, folder: &Path, name: &str, changes: &[(&str, &str)]) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("access").join(template);
    let mut text = std::fs::read_to_string(path).expect("the template is there");
    for (from, to) in changes {
        assert!(text.contains(from), "{template} does not have {from}");
        text = text.replace(from, to);
    }
    let path = folder.join(name);
    std::fs::write(&path, text).expect("it is written");
    path
}

/// A number.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Number {
    pub(crate) value: u64,
}

/// A sensor that counts.
#[derive(Debug)]
pub(crate) struct Counter(u64);

impl Sensor for Counter {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(0))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        self.0 += 1;
        Ok(Reading::now(Number { value: self.0 }))
    }
}
