//! The bridge that sends what is published to other robots.

use super::settings;
use super::wire::{Attachment, ClockAnswer, clock_key, message_key};
use crate::session::{Session, SessionError, list};
use bb_core::pubsub::DynamicSubscription;
use bb_core::time::Clock;
use bb_core::{
    Bus, DynamicMessage, Fault, MonotonicTime, Options, Overflow, Payload, Reading, Select, Service, ServiceContext,
};
use std::collections::BTreeMap;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::marker::PhantomData;
use std::path::PathBuf;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll, Wake, Waker};
use std::thread::Thread;
use std::time::Duration;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::query::Queryable;

/// Longest time for which one update waits.
const WAIT: Duration = Duration::from_millis(50);
/// Messages of one path that wait while the network is slow; then the oldest makes room, and shows as a gap in the numbers.
const CAPACITY: usize = 256;
/// Time between two looks for paths that have been created meanwhile, and between two reports.
const REFRESH: Duration = Duration::from_secs(1);

/// Options of [`Share`].
#[derive(Clone, Debug, Options)]
pub struct ShareOptions {
    /// Paths to send, separated by spaces, each with everything below it; `*` matches any one name: `sensor/mast estimator/*/pose`.
    #[option(required)]
    pub paths: String,
    /// Endpoints to listen on, separated by spaces: `tcp/192.168.1.7:7600`. Others than those of the loopback device let everyone who
    /// reaches them read, unless `config` says who may.
    #[option(default = "")]
    pub listen: String,
    /// Endpoints to connect to, separated by spaces. They are tried again until they answer.
    #[option(default = "")]
    pub connect: String,
    /// File of zenoh's own configuration, with certificates and rights; none if empty.
    #[option(default = PathBuf::new())]
    pub config: PathBuf,
}

/// Counts of a [`Share`], published once a second while they change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub struct SharedMessages {
    /// Messages that were sent.
    pub sent: u64,
    /// Messages that had to make room for newer ones while the network was slow.
    pub dropped: u64,
}

/// The clock that other robots are shown: the robot's own, but in tests of clocks that differ.
#[doc(hidden)]
pub trait ShownClock: Send + 'static {
    /// A time of the robot on the shown clock.
    fn shown(time: MonotonicTime) -> MonotonicTime;
}

/// The robot's own clock.
#[doc(hidden)]
#[derive(Debug)]
pub struct OwnClock;

impl ShownClock for OwnClock {
    fn shown(time: MonotonicTime) -> MonotonicTime {
        time
    }
}

/// Sends what is published at selected paths to the robots that declare a [`Remote`](super::Remote) for it. Declare it without a `rate`.
///
/// It also answers questions for the time. It takes nothing else from the network: what another robot does cannot arm, disarm or command
/// this one. It waits for a slow network on its own thread; the robot does not.
///
/// On virtual time it is left out.
#[derive(Debug)]
pub struct Share<C = OwnClock> {
    bus: Bus,
    clock: Clock,
    session: Session,
    number: u64,
    robot: &'static str,
    paths: Vec<String>,
    outlets: BTreeMap<&'static str, Outlet>,
    _answers: Queryable<()>,
    refreshed: Option<MonotonicTime>,
    reported: SharedMessages,
    of: PhantomData<fn() -> C>,
}

/// One path that is sent.
#[derive(Debug)]
struct Outlet {
    subscription: DynamicSubscription,
    /// Declared with the first message, which tells the layout.
    publisher: Option<Publisher<'static>>,
    sent: u64,
}

/// The number of a run, random, since two robots may have one name.
struct RunNumber(u64);

/// Waker of the thread of the bridge.
struct Unpark(Thread);

impl Wake for Unpark {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

impl<C: ShownClock> Service for Share<C> {
    type Options = ShareOptions;
    type Output = SharedMessages;

    fn init(options: ShareOptions, context: &ServiceContext) -> Result<Self, Fault> {
        let clock = context.clock().clone();
        if clock.is_virtual() {
            return Err(Fault::skip("other robots do not follow virtual time"));
        }
        let session = Session::open(&settings(&options.listen, &options.connect, &options.config))?;
        let number = context.shared(|| RunNumber(RandomState::new().build_hasher().finish())).0;
        let robot = context.robot();
        let answers = answer::<C>(&session, robot, number, &clock)?;
        Ok(Self {
            bus: context.bus(),
            clock,
            session,
            number,
            robot,
            paths: list(&options.paths),
            outlets: BTreeMap::new(),
            _answers: answers,
            refreshed: None,
            reported: SharedMessages::default(),
            of: PhantomData,
        })
    }

    fn update(&mut self, now: MonotonicTime) -> Result<Reading<SharedMessages>, Fault> {
        let is_due = self.refreshed.is_none_or(|last| now.duration_since(last) >= REFRESH);
        let mut counts = None;
        if is_due {
            self.refreshed = Some(now);
            self.subscribe();
            counts = Some(self.counts()).filter(|counts| *counts != self.reported);
        }
        // Messages that arrive from here on wake it.
        let waker = Waker::from(Arc::new(Unpark(std::thread::current())));
        if !self.send_waiting(&mut Context::from_waker(&waker))? {
            std::thread::park_timeout(WAIT);
        }
        Ok(match counts {
            Some(counts) => {
                self.reported = counts;
                Reading::now(counts)
            }
            None => Reading::nothing(),
        })
    }
}

/// Answers questions for the time, on zenoh's thread, so that an answer does not wait for the bridge.
fn answer<C: ShownClock>(
    session: &Session,
    robot: &str,
    number: u64,
    clock: &Clock,
) -> Result<Queryable<()>, SessionError> {
    let (key, clock) = (clock_key(robot), clock.clone());
    let declared = session.declare_queryable(key.clone()).callback({
        let key = key.clone();
        move |query| {
            let received = C::shown(clock.now());
            let answer = ClockAnswer { session: number, received, answered: C::shown(clock.now()) };
            if let Err(error) = query.reply(key.as_str(), answer.to_bytes()).wait() {
                tracing::debug!(%error, "a question for the time was not answered");
            }
        }
    });
    declared.wait().map_err(SessionError::of(format!("declaring {key}")))
}

impl<C: ShownClock> Share<C> {
    /// Subscribes to selected paths that are new.
    fn subscribe(&mut self) {
        for path in self.bus.paths() {
            let is_selected = self.paths.iter().any(|selected| Select::Below(selected).includes(path));
            if is_selected && !self.outlets.contains_key(path) {
                let overflow = Overflow::DropOldest { capacity: CAPACITY };
                let subscription = self.bus.subscribe_any(Select::Path(path), None, overflow);
                self.outlets.insert(path, Outlet { subscription, publisher: None, sent: 0 });
            }
        }
    }

    /// Sends a message of each path that has one; `false` if none has.
    fn send_waiting(&mut self, context: &mut Context<'_>) -> Result<bool, Fault> {
        let mut is_any = false;
        let (session, robot, number, clock) = (&self.session, self.robot, self.number, &self.clock);
        for (path, outlet) in &mut self.outlets {
            let next = pin!(outlet.subscription.recv_async()).poll(context);
            if let Poll::Ready(Some(message)) = next {
                is_any = true;
                outlet.send::<C>(&message, path, session, robot, number, clock)?;
            }
        }
        Ok(is_any)
    }

    fn counts(&self) -> SharedMessages {
        let outlets = self.outlets.values();
        outlets.fold(SharedMessages::default(), |counts, outlet| SharedMessages {
            sent: counts.sent + outlet.sent,
            dropped: counts.dropped + outlet.subscription.lagged(),
        })
    }
}

impl Outlet {
    fn send<C: ShownClock>(
        &mut self,
        message: &DynamicMessage,
        path: &str,
        session: &Session,
        robot: &str,
        number: u64,
        clock: &Clock,
    ) -> Result<(), SessionError> {
        let publisher = match self.publisher.take() {
            Some(publisher) => publisher,
            None => {
                // The hash takes longer than the message.
                let key = message_key(robot, path, &message.layouts().type_hash());
                let encoding = Encoding::APPLICATION_CDR.with_schema(message.payload_name());
                // What is put must arrive, or show: with `Drop`, and with `express`, zenoh loses messages without a word.
                let declared = session.declare_publisher(key.clone()).congestion_control(CongestionControl::Block);
                let declared = declared.express(false).encoding(encoding).wait();
                declared.map_err(SessionError::of(format!("declaring {key}")))?
            }
        };
        let publisher = self.publisher.insert(publisher);
        let mut bytes = Vec::new();
        message.encode(&mut bytes);
        self.sent += 1;
        let attachment = Attachment {
            session: number,
            // What was dropped before shows as a gap.
            sequence: self.sent + self.subscription.lagged(),
            measured: C::shown(message.stamp().monotonic_time),
            sent: C::shown(clock.now()),
        };
        let put = publisher.put(bytes).attachment(attachment.to_bytes()).wait();
        put.map_err(|error| SessionError::of(format!("putting {robot}/{path}"))(error))
    }
}
