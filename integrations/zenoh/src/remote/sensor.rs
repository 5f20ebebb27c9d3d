//! The sensor.

use super::inbox::{Arrived, Inbox};
use super::peer::{Peer, Peers, Trust};
use super::settings;
use super::source::Source;
use super::tally::{Number, Place, Tally};
use super::wire::{Attachment, any_layout, hash_in};
use crate::session::{SessionError, lock};
use bb_core::component::Counter;
use bb_core::message::codec::decode;
use bb_core::time::Clock;
use bb_core::{Fault, MonotonicTime, Options, Payload, Reading, Sensor, SensorContext, Stamped};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use zenoh::Wait;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Locality;

/// Longest time for which one read waits.
const WAIT: Duration = Duration::from_millis(50);

/// Options of [`Remote`].
#[derive(Clone, Debug, Options)]
pub struct RemoteOptions<T: Payload> {
    /// Messages to take: `Source::of(mast::sensor::mast::gnss)`, or as text the name of the robot and the path there,
    /// `Mast/sensor/mast/gnss`.
    #[option(required)]
    pub from: Source<T>,
    /// Endpoints to connect to, separated by spaces: `tcp/192.168.1.7:7600`. They are tried again until they answer.
    #[option(default = "")]
    pub connect: String,
    /// Endpoints to listen on, separated by spaces, for a robot that connects to this one.
    #[option(default = "")]
    pub listen: String,
    /// File of zenoh's own configuration, with certificates and rights; none if empty.
    #[option(default = PathBuf::new())]
    pub config: PathBuf,
    /// Longest time without a reading; after it, the sensor fails.
    #[option(default = Duration::from_millis(500))]
    pub timeout: Duration,
    /// Greatest age of a reading when it is taken, with the error of its stamp; older ones are dropped. So are those that may be older if
    /// the other clock was put forward after its last answer: it should exceed a round trip by 50 ms.
    #[option(default = Duration::from_millis(200))]
    pub within: Duration,
    /// Greatest error of a stamp on the local clock; readings whose stamp may be further off are dropped. Half a round trip can be
    /// reached.
    #[option(default = Duration::from_millis(5))]
    pub clock_within: Duration,
}

/// The messages of another robot as those of a sensor: declare it without a `rate`.
///
/// The stamp of a reading is the time of the measurement on the clock of this machine. Its error is at most `clock_within`, since the other
/// machine is asked for its time, and the difference of the clocks is limited by how long the answers take; see
/// [the module](crate::remote) for what is sent. The frame is that of this sensor.
///
/// Readings are journaled like those of any sensor, so that a replay needs no network. On virtual time the sensor does not start: put a
/// simulated one in its place with `replace_sensor`.
///
/// # Counts
///
/// Between the first and the last message that arrive of one run of the other robot, each message that it published is counted
/// once ([`SourceStatistics::count`](bb_core::run::SourceStatistics::count)):
///
/// | count | messages |
/// |---|---|
/// | `received` | were taken |
/// | `stale` | were older than `within`, or may have been |
/// | `unsure` | had a stamp that could not be converted to within `clock_within`, or came from a run too soon after another |
/// | `refused` | were malformed: each is a fault |
/// | `lost` | did not come, or after a newer one; the sender or this sensor may have had no room for them |
///
/// `repeated` counts what came again, or after a newer one. If one message has a wrong number, far ahead, `lost` has as many more, and those
/// that follow are repetitions until none with a newer number has come for `within`: then their numbers are believed.
///
/// # Faults
///
/// After a fault the sensor is restarted, as any other, until messages come again. It fails if
///
/// - there was no reading for `timeout`; the text says why,
/// - the other robot publishes a payload of another shape at the path,
/// - two robots have the name,
/// - a message cannot be read, has a stamp in the future, or a number far ahead of the last.
#[derive(Debug)]
pub struct Remote<T: Payload> {
    peer: Arc<Peer>,
    path: String,
    inbox: Arc<Inbox>,
    _subscriber: Subscriber<()>,
    tally: Arc<Mutex<Tally>>,
    counts: Counts,
    clock: Clock,
    options: RemoteOptions<T>,
    hash: String,
    started: MonotonicTime,
    taken: Option<Taken>,
    /// Time of the last message, and why it was not taken.
    dropped: Option<(MonotonicTime, Dropped)>,
}

/// The last reading.
#[derive(Clone, Copy, Debug)]
struct Taken {
    at: MonotonicTime,
    session: u64,
    measured: MonotonicTime,
    time: MonotonicTime,
}

/// Reason for which a message was not taken.
#[derive(Clone, Copy, Debug)]
enum Dropped {
    Stale { age: Duration },
    Unknown,
    Unsure { bound: Duration },
    New,
}

#[derive(Debug)]
struct Counts {
    received: Counter,
    stale: Counter,
    unsure: Counter,
    refused: Counter,
    lost: Counter,
    repeated: Counter,
}

/// The tallies of all remote sensors of a run, which go on when a sensor is restarted.
#[derive(Debug, Default)]
struct Tallies(Mutex<HashMap<&'static str, Arc<Mutex<Tally>>>>);

impl<T: Payload> Sensor for Remote<T> {
    type Options = RemoteOptions<T>;
    type Output = T;

    fn init(options: RemoteOptions<T>, context: &SensorContext) -> Result<Self, Fault> {
        let clock = context.clock().clone();
        if clock.is_virtual() {
            return Err(Fault::permanent(
                "another robot does not follow virtual time; put a simulated sensor in its place with `replace_sensor`",
            ));
        }
        let Some((robot, path)) = options.from.parts() else {
            return Err(Fault::permanent(format!(
                "`from` is {:?}: expected the name of a robot and a path, such as `Mast/sensor/mast/gnss`",
                options.from
            )));
        };
        let settings = settings(&options.listen, &options.connect, &options.config);
        let peer = context.shared(Peers::default).get(&settings, robot, &clock)?;
        let inbox = Arc::new(Inbox::default());
        let subscriber = subscribe(&peer, path, &inbox, &clock)?;
        let tallies = context.shared(Tallies::default);
        let tally = Arc::clone(lock(&tallies.0).entry(context.path()).or_default());
        Ok(Self {
            path: path.to_owned(),
            inbox,
            _subscriber: subscriber,
            tally,
            counts: Counts {
                received: context.counter("received"),
                stale: context.counter("stale"),
                unsure: context.counter("unsure"),
                refused: context.counter("refused"),
                lost: context.counter("lost"),
                repeated: context.counter("repeated"),
            },
            started: clock.now(),
            clock,
            hash: Stamped::<T>::LAYOUTS.type_hash(),
            taken: None,
            dropped: None,
            peer,
            options,
        })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<T>, Fault> {
        let wait = self.peer.ask()?;
        let arrived = self.inbox.take(wait.clamp(Duration::from_millis(1), WAIT));
        if let Some(reading) = arrived.map(|arrived| self.judge(&arrived)).transpose()?.flatten() {
            self.counts.received.add();
            return Ok(reading);
        }
        self.check_silence()?;
        Ok(Reading::nothing())
    }
}

/// Subscribes to what the peer publishes at the path, in whatever layout.
fn subscribe(peer: &Peer, path: &str, inbox: &Arc<Inbox>, clock: &Clock) -> Result<Subscriber<()>, SessionError> {
    let (inbox, runs, clock) = (Arc::clone(inbox), peer.runs(), clock.clone());
    let key = any_layout(peer.robot(), path);
    let failed = SessionError::of(format!("subscribing to {key}"));
    let subscriber = peer.session().declare_subscriber(key).allowed_origin(Locality::Any).callback(move |sample| {
        let arrival = clock.now();
        let attachment = sample.attachment().and_then(|bytes| Attachment::from_bytes(&bytes.to_bytes()));
        if let Some(attachment) = attachment {
            lock(&runs).hear(attachment.session, arrival);
        }
        let payload = sample
            .encoding()
            .schema()
            .map_or_else(String::new, |name| String::from_utf8_lossy(name.as_slice()).into_owned());
        inbox.put(Arrived {
            arrival,
            hash: hash_in(sample.key_expr().as_str()).to_owned(),
            payload,
            attachment,
            bytes: sample.payload().to_bytes().into_owned(),
        });
    });
    subscriber.wait().map_err(failed)
}

impl<T: Payload> Remote<T> {
    /// The reading in a message; `None` if it is counted as dropped.
    fn judge(&mut self, arrived: &Arrived) -> Result<Option<Reading<T>>, Fault> {
        let Some(attachment) = arrived.attachment else {
            lock(&self.tally).add_unnumbered();
            self.counts.refused.add();
            return Err(self.fault("sends messages without a number: it is not a robot's `Share`"));
        };
        let number =
            Number { session: attachment.session, sequence: attachment.sequence, arrival: arrived.arrival };
        match lock(&self.tally).place(number, self.options.within) {
            Place::Newer { lost } => self.counts.lost.add_many(lost),
            Place::Repeated => {
                self.counts.repeated.add();
                return Ok(None);
            }
            Place::Absurd => {
                self.counts.refused.add();
                return Err(self.fault(format!("sends number {}, far ahead of the last", attachment.sequence)));
            }
        }
        if arrived.hash != self.hash {
            self.counts.refused.add();
            let (theirs, ours) = (if arrived.payload.is_empty() { "?" } else { &arrived.payload }, T::NAME);
            let (there, here) = (&arrived.hash, &self.hash);
            return Err(self.fault(format!(
                "publishes `{theirs}` in the layout {there}, and `{ours}` has {here} here: build both robots from one definition"
            )));
        }
        match self.peer.trust(attachment.session) {
            Trust::Alone => self.convert(arrived, attachment),
            Trust::New => {
                self.counts.unsure.add();
                self.dropped = Some((arrived.arrival, Dropped::New));
                Ok(None)
            }
            Trust::OneOfTwo => {
                self.counts.refused.add();
                Err(self.fault("is the name of two robots that are running"))
            }
        }
    }

    /// The reading in a message of the only run of the peer.
    fn convert(&mut self, arrived: &Arrived, attachment: Attachment) -> Result<Option<Reading<T>>, Fault> {
        let message: Stamped<T> = decode(&arrived.bytes).map_err(|error| {
            self.counts.refused.add();
            self.fault(format!("sends a message that cannot be read: {error}"))
        })?;
        let Attachment { session, measured, sent, .. } = attachment;
        let Some(converted) = self.peer.converted(session, measured) else {
            return Ok(self.drop_unsure(arrived, Dropped::Unknown));
        };
        if converted.bound > self.options.clock_within {
            return Ok(self.drop_unsure(arrived, Dropped::Unsure { bound: converted.bound }));
        }
        let ahead = converted.time.duration_since(arrived.arrival);
        if measured > sent || ahead > converted.bound {
            self.counts.refused.add();
            let ahead_s = ahead.as_secs_f64().max(measured.seconds_since(sent));
            return Err(self.fault(format!("stamps its messages {ahead_s:.3} s ahead of its clock")));
        }
        // It was measured before it arrived.
        let time = converted.time.min(arrived.arrival);
        let now = self.clock.now();
        let age = now.duration_since(time).saturating_add(converted.bound).max(now.duration_since(converted.since));
        if age > self.options.within {
            self.counts.stale.add();
            self.dropped = Some((arrived.arrival, Dropped::Stale { age }));
            return Ok(None);
        }
        // A later estimate of the difference does not turn the order round.
        let before = self.taken.filter(|taken| taken.session == session && taken.measured < measured);
        let time = before.map_or(time, |taken| time.max(taken.time.plus_nanos(1)));
        self.taken = Some(Taken { at: now, session, measured, time });
        Ok(Some(Reading::at(time, message.payload)))
    }

    fn drop_unsure<R>(&mut self, arrived: &Arrived, why: Dropped) -> Option<R> {
        self.counts.unsure.add();
        self.dropped = Some((arrived.arrival, why));
        None
    }

    /// # Errors
    /// There was no reading for `timeout`.
    fn check_silence(&self) -> Result<(), Fault> {
        let now = self.clock.now();
        let since = self.taken.map_or(self.started, |taken| taken.at);
        let waited = now.duration_since(since);
        if waited <= self.options.timeout {
            return Ok(());
        }
        let waited_s = waited.as_secs_f64();
        let recent = |time: MonotonicTime| now.duration_since(time) <= self.options.timeout;
        let why = match (self.dropped.filter(|(time, _)| recent(*time)), self.peer.last_heard()) {
            (Some((_, Dropped::Stale { age })), _) => {
                format!("messages arrive {:.3} s old, and `within` is {:?}", age.as_secs_f64(), self.options.within)
            }
            (Some((_, Dropped::Unknown)), _) => "messages arrive, but its clock does not answer".to_owned(),
            (Some((_, Dropped::Unsure { bound })), _) => {
                format!(
                    "the difference of the clocks is known to {bound:?}, and `clock_within` is {:?}",
                    self.options.clock_within
                )
            }
            (Some((_, Dropped::New)), _) => "it has started again just now".to_owned(),
            (None, None) => "nothing has been heard of it".to_owned(),
            (None, Some(heard)) if recent(heard) => "it is there, and does not publish".to_owned(),
            (None, Some(heard)) => format!("nothing was heard of it for {:.1} s", now.seconds_since(heard)),
        };
        Err(self.fault(format!("has given no reading for {waited_s:.1} s: {why}")))
    }

    /// A fault that names the peer and the path.
    fn fault(&self, what: impl std::fmt::Display) -> Fault {
        Fault::new(format!("`{}` at `{}` {what}", self.peer.robot(), self.path))
    }
}
