//! The session of zenoh: one for all that has the same settings, with defaults chosen by measuring what is lost and delayed.

use serde_json::{Value, json};
use std::collections::HashMap;
use std::fmt;
use std::ops::Deref;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError, Weak, mpsc};
use std::thread;
use std::time::Duration;
use thiserror::Error;
use zenoh::Wait;

/// Time after which a machine that says nothing is gone, in milliseconds. With zenoh's 10 s a cut of 3 s is never reported, and what was
/// sent during it arrives afterwards, up to 4 s old.
const LEASE_MS: u32 = 1000;
/// Signs of life within that time.
const SIGNS_OF_LIFE: u32 = 4;
/// Time that a machine has to introduce itself, and to answer one that connects, in milliseconds; zenoh's is 10 s. While a link drops all,
/// the system repeats what opens a connection after 1, 3 and 7 s: with 10 s, a link that is whole again is tried up to 4 s later.
const ACCEPT_MS: u32 = 2000;
/// Number of machines that may be about to introduce themselves; as many that say nothing keep all others out. zenoh's is 100, and it has as
/// many sessions as this at most, each an open file.
const ACCEPTED: usize = 1000;
/// Bytes of a message in parts, at most: zenoh keeps up to 1 GiB of each that has begun. Longer ones are dropped.
const MOST_BYTES: usize = 64 * 1024 * 1024;
/// Times between two attempts to connect, in milliseconds.
const RETRIES_MS: (u32, u32) = (100, 200);

/// Time for which the end of a session waits for the network.
const CLOSING: Duration = Duration::from_secs(2);

/// Part of a session among others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// A robot that speaks to those it is connected with.
    #[default]
    Peer,
    /// A robot that speaks to all that its router knows. A router passes to peers what a client sends, but not what a peer sends of which
    /// gossip tells it nothing.
    Client,
    /// A robot through which others also hear each other: two nodes of ROS 2 that know it alone. They find each other by gossip, which is
    /// on in `rmw_zenoh_cpp` unless it is turned off there.
    Router,
}

/// Settings of a session. Multicast and timestamps are off, gossip is on for a router only, the lease is 1 s, and messages have at most 64 MiB,
/// unless the file sets them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct SessionSettings {
    /// Part of the session among others.
    pub mode: Mode,
    /// Endpoints to listen on: `tcp/127.0.0.1:7447`, with port 0 for any. A session that cannot listen there is not opened.
    pub listen: Vec<String>,
    /// Endpoints to connect to, tried again until they answer. A session of a client is not opened unless one answers at once.
    pub connect: Vec<String>,
    /// A file of zenoh's own configuration, in JSON5: what is written there goes before all else. It is the place of certificates, users
    /// and rights.
    pub file: Option<PathBuf>,
}

/// Reason for which there is no session.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The file of the configuration cannot be read.
    #[error("the configuration of zenoh in {}: {fault}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Fault.
        fault: String,
    },
    /// zenoh does not accept the configuration.
    #[error("zenoh does not accept the configuration: {0}")]
    Configuration(String),
    /// The session cannot be opened: the address is in use, or a certificate is missing.
    #[error("no session of zenoh{at}: {fault}", at = if listen.is_empty() { String::new() } else { format!(" that listens on {}", listen.join(", ")) })]
    Open {
        /// The endpoints to listen on.
        listen: Vec<String>,
        /// Fault.
        fault: String,
    },
    /// An operation in the session failed.
    #[error("{what}: {fault}")]
    Operation {
        /// The attempt: `declaring the publisher of /tf`.
        what: String,
        /// Fault.
        fault: String,
    },
}

impl SessionError {
    /// Error of an operation that zenoh refuses.
    pub(crate) fn of(what: impl Into<String>) -> impl FnOnce(zenoh::Error) -> Self {
        let what = what.into();
        move |error| Self::Operation { what, fault: error.to_string() }
    }
}

impl SessionSettings {
    /// zenoh's configuration: that which was measured, with that of the file over it.
    ///
    /// # Errors
    /// The file cannot be read, or zenoh does not accept the whole.
    pub fn configuration(&self) -> Result<zenoh::Config, SessionError> {
        let (first, longest) = RETRIES_MS;
        // By what a router tells of the others, two of them hear each other; it connects to none of them itself.
        let gossip = json!({ "enabled": self.mode == Mode::Router, "autoconnect": [] });
        let mut configuration = json!({
            "mode": match self.mode { Mode::Peer => "peer", Mode::Client => "client", Mode::Router => "router" },
            "listen": { "endpoints": self.listen, "exit_on_failure": true },
            "connect": {
                "endpoints": self.connect,
                "retry": { "period_init_ms": first, "period_max_ms": longest, "period_increase_factor": 2 },
            },
            "scouting": { "multicast": { "enabled": false }, "gossip": gossip },
            // Else what comes from a machine whose clock is ahead is refused, or gets another time.
            "timestamping": { "enabled": false },
            "transport": { "unicast": { "open_timeout": ACCEPT_MS, "accept_timeout": ACCEPT_MS, "accept_pending": ACCEPTED }, "link": {
                "tx": {
                    "lease": LEASE_MS,
                    "keep_alive": SIGNS_OF_LIFE,
                    // A machine that takes nothing for half as long is gone as well: threads that send wait for it, and so do zenoh's that receive, when
                    // they answer or declare. Meanwhile they do not see the signs of life of all others.
                    "queue": { "congestion_control": { "block": { "wait_before_close": LEASE_MS * 1000 / 2 } } },
                },
                "rx": { "max_message_size": MOST_BYTES },
            } },
        });
        if let Some(path) = &self.file {
            let error = |fault: String| SessionError::File { path: path.clone(), fault };
            let text = std::fs::read_to_string(path).map_err(|fault| error(fault.to_string()))?;
            let over: Value = json5::from_str(&text).map_err(|fault| error(fault.to_string()))?;
            if !over.is_object() {
                return Err(error("expected an object".to_owned()));
            }
            lay_over(&mut configuration, over);
        }
        zenoh::Config::from_json5(&configuration.to_string())
            .map_err(|error| SessionError::Configuration(error.to_string()))
    }
}

/// The endpoints, or paths, that are separated by spaces.
pub(crate) fn list(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

/// Writes what `over` has over `value`; lists are exchanged as a whole.
fn lay_over(value: &mut Value, over: Value) {
    match (value, over) {
        (Value::Object(members), Value::Object(over)) => {
            for (name, over) in over {
                lay_over(members.entry(name).or_insert(Value::Null), over);
            }
        }
        (value, over) => *value = over,
    }
}

/// A session, shared by all of this process that ask for one with the same settings, and closed with the last of them. It dereferences to
/// zenoh's.
#[derive(Clone)]
pub struct Session(Arc<Opened>);

struct Opened {
    session: zenoh::Session,
    numbers: AtomicU64,
}

impl Drop for Opened {
    fn drop(&mut self) {
        // Beside a machine that is frozen, zenoh waits for ten seconds or more, and its sockets linger: that goes on without the robot.
        let (session, (closed, is_closed)) = (self.session.clone(), mpsc::channel());
        let closing = thread::Builder::new().name("zenoh close".into()).spawn(move || {
            // Nobody may wait for it any more.
            let _ = closed.send(session.close().wait());
        });
        let fault = match closing.map(|_| is_closed.recv_timeout(CLOSING)) {
            Ok(Ok(Ok(()))) => return,
            Ok(Ok(Err(error))) => error.to_string(),
            Ok(Err(error)) => error.to_string(),
            Err(error) => error.to_string(),
        };
        tracing::warn!(fault, "the session of zenoh is not closed yet");
    }
}

/// The session with some settings, locked while it is opened: no other thread opens the same, and none waits that opens another.
type Slot = Arc<Mutex<Weak<Opened>>>;

static SESSIONS: LazyLock<Mutex<HashMap<SessionSettings, Slot>>> = LazyLock::new(Mutex::default);

/// Locks it also if a thread has panicked that held it.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Session {
    /// Returns the session with these settings, which is opened if it is not open yet.
    ///
    /// # Errors
    /// The configuration is not usable, an endpoint to listen on is in use, or the router of a client does not answer.
    pub fn open(settings: &SessionSettings) -> Result<Self, SessionError> {
        let configuration = settings.configuration()?;
        let slot = {
            let mut sessions = lock(&SESSIONS);
            // Those that nobody opens or holds.
            sessions.retain(|_, slot| {
                Arc::strong_count(slot) > 1 || slot.try_lock().map_or(true, |opened| opened.strong_count() > 0)
            });
            Arc::clone(sessions.entry(settings.clone()).or_default())
        };
        let mut last = lock(&slot);
        if let Some(opened) = last.upgrade() {
            return Ok(Self(opened));
        }
        let session = zenoh::open(configuration).wait();
        let session = session
            .map_err(|error| SessionError::Open { listen: settings.listen.clone(), fault: error.to_string() })?;
        let opened = Arc::new(Opened { session, numbers: AtomicU64::new(0) });
        *last = Arc::downgrade(&opened);
        Ok(Self(opened))
    }

    /// A number that nothing else in the session has: those of nodes and endpoints.
    pub(crate) fn next_number(&self) -> u64 {
        self.0.numbers.fetch_add(1, Ordering::Relaxed)
    }
}

impl Deref for Session {
    type Target = zenoh::Session;
    fn deref(&self) -> &zenoh::Session {
        &self.0.session
    }
}

impl fmt::Debug for Session {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Session").field(&self.0.session.zid()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    fn read(configuration: &zenoh::Config, key: &str) -> Value {
        let text = configuration.get_json(key).unwrap_or_else(|error| panic!("{key}: {error}"));
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{key}: {error}"))
    }

    #[test]
    fn the_defaults_are_those_that_lose_and_hide_nothing() {
        let listen = vec!["tcp/127.0.0.1:0".to_owned()];
        let settings = SessionSettings { listen, ..SessionSettings::default() };
        let configuration = settings.configuration().expect("it is accepted");
        for (key, expected) in [
            ("mode", json!("peer")),
            ("scouting/multicast/enabled", json!(false)),
            ("scouting/gossip/enabled", json!(false)),
            ("timestamping/enabled", json!(false)),
            ("transport/link/tx/lease", json!(1000)),
            ("transport/link/tx/keep_alive", json!(4)),
            ("transport/link/tx/queue/congestion_control/block/wait_before_close", json!(500_000)),
            ("transport/unicast/open_timeout", json!(2000)),
            ("transport/unicast/accept_timeout", json!(2000)),
            ("transport/unicast/accept_pending", json!(1000)),
            ("transport/link/rx/max_message_size", json!(67_108_864)),
            ("listen/endpoints", json!(["tcp/127.0.0.1:0"])),
            ("connect/endpoints", json!([])),
        ] {
            assert_eq!(read(&configuration, key), expected, "{key}");
        }
    }

    #[test]
    fn a_router_tells_of_the_others_and_connects_to_none() {
        let settings = SessionSettings { mode: Mode::Router, ..SessionSettings::default() };
        let configuration = settings.configuration().expect("it is accepted");
        assert_eq!(read(&configuration, "scouting/multicast/enabled"), json!(false));
        assert_eq!(read(&configuration, "scouting/gossip/enabled"), json!(true));
        assert_eq!(read(&configuration, "scouting/gossip/autoconnect"), json!([]));
    }

    #[test]
    fn a_file_goes_before_the_defaults_and_leaves_the_rest() {
        let path = std::env::temp_dir().join(format!("bb-zenoh-{}.json5", std::process::id()));
        let file = "{ mode: 'router', transport: { link: { tx: { lease: 500 } } }, // as in zenoh's own\n \
                    connect: { endpoints: ['tcp/192.0.2.1:7447'] } }";
        std::fs::write(&path, file).expect("it is written");
        let settings = SessionSettings { file: Some(path.clone()), ..SessionSettings::default() };
        let configuration = settings.configuration().expect("it is accepted");
        assert_eq!(read(&configuration, "mode"), json!("router"));
        // It is the mode of the settings that decides.
        assert_eq!(read(&configuration, "scouting/gossip/enabled"), json!(false));
        assert_eq!(read(&configuration, "transport/link/tx/lease"), json!(500));
        assert_eq!(read(&configuration, "transport/link/tx/keep_alive"), json!(4));
        assert_eq!(read(&configuration, "connect/endpoints"), json!(["tcp/192.0.2.1:7447"]));
        for (text, expected) in
            [("[1]", "expected an object"), ("{", "bb-zenoh-"), ("{ nodes: 7 }", "zenoh does not accept")]
        {
            std::fs::write(&path, text).expect("it is written");
            let error = settings.configuration().expect_err("it is refused").to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
        std::fs::remove_file(&path).expect("it is removed");
        assert!(matches!(settings.configuration(), Err(SessionError::File { .. })));
    }

    /// A client waits for the answer of its router.
    #[test]
    fn a_session_that_is_opened_slowly_keeps_no_other_waiting() {
        let silent = TcpListener::bind("127.0.0.1:0").expect("one is free");
        let connect = vec![format!("tcp/{}", silent.local_addr().expect("it has one"))];
        let slow = SessionSettings { mode: Mode::Client, connect, ..SessionSettings::default() };
        let opening = thread::spawn(move || Session::open(&slow).map(|_| ()));
        let (_accepted, _) = silent.accept().expect("it connects");
        let quick = SessionSettings { listen: vec!["tcp/127.0.0.1:0".into(); 2], ..SessionSettings::default() };
        Session::open(&quick).expect("it is opened");
        assert!(!opening.is_finished(), "the other was opened meanwhile");
        drop((_accepted, silent));
        let _ = opening.join().expect("it does not panic");
    }

    #[test]
    fn an_endpoint_that_does_not_answer_yet_is_tried_again() {
        let free =
            TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("one is free");
        let endpoint = vec![format!("tcp/{free}")];
        for mode in [Mode::Peer, Mode::Router] {
            let early = SessionSettings { mode, connect: endpoint.clone(), ..SessionSettings::default() };
            let early = Session::open(&early).expect("it is opened");
            let late =
                SessionSettings { mode: Mode::Router, listen: endpoint.clone(), ..SessionSettings::default() };
            let _late = Session::open(&late).expect("it is opened");
            let waited = std::time::Instant::now();
            while early.info().routers_zid().wait().next().is_none() {
                assert!(waited.elapsed() < Duration::from_secs(30), "{mode:?}");
                thread::sleep(Duration::from_millis(10));
            }
        }
    }

    #[test]
    fn the_same_settings_are_the_same_session() {
        let settings = SessionSettings { listen: vec!["tcp/127.0.0.1:0".into()], ..SessionSettings::default() };
        let first = Session::open(&settings).expect("it is opened");
        let second = Session::open(&settings).expect("it is opened");
        assert_eq!(first.zid(), second.zid());
        let zid = first.zid();
        drop((first, second));
        assert_ne!(Session::open(&settings).expect("it is opened").zid(), zid);
    }
}
