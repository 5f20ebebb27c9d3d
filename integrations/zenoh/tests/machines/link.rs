//! Several machines over a link that is cut, floods, or has a peer that is stopped: every message is accounted for, none that is too old is
//! taken, and the robots go on.

use crate::kit::{connected, folder, free_address, free_endpoint, router, until};
use crate::relay::{LinkState, Relay};
use bb_core::prelude::*;
use bb_zenoh::{Remote, Share, Source};
use std::path::PathBuf;
use std::process::{Child, Command as Process, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard};
use std::thread;
use std::time::Instant;
use zenoh::Wait;

/// Greatest age of a reading, and time after which an estimator without one is lost, as declared below.
const WITHIN: Duration = Duration::from_millis(150);
const LOST_AFTER: Duration = Duration::from_millis(500);
/// Length of a cut after which what a frozen link has held up arrives, and is too old.
const HELD_UP_S: f64 = 0.4;
/// Time from one message to the next.
const PERIOD: Duration = Duration::from_millis(10);
/// Time that a thread may wait for a processor of a busy machine.
const BUSY: Duration = Duration::from_millis(200);

/// Time since the start of this process.
fn now() -> Duration {
    static BEGUN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGUN.elapsed()
}

/// A measurement, with the time at which it was made by the clock of the process.
#[derive(Clone, Debug, PartialEq, Payload)]
struct Beat {
    number: u64,
    made_ns: u64,
    more: Vec<u8>,
}

/// A beat as an estimator got it.
#[derive(Clone, Debug, PartialEq, Payload)]
struct Seen {
    number: u64,
    handled_ns: u64,
    age_ns: u64,
}

/// Notes what comes.
#[derive(Debug)]
struct Judge;

impl Estimator for Judge {
    type Options = NoOptions;
    type Input = Beat;
    type Output = Seen;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, beat: &Stamped<Beat>) -> Result<Reply<Seen>, Fault> {
        let handled_ns = now().as_nanos() as u64;
        Ok(Reply::emit(Seen { number: beat.number, handled_ns, age_ns: handled_ns.saturating_sub(beat.made_ns) }))
    }
}

/// The robot's tick: the times of its last readings.
#[derive(Debug)]
struct Tick(Arc<Ticks>);

#[derive(Debug, Default)]
struct Ticks(Mutex<Vec<Duration>>);

impl Sensor for Tick {
    type Options = NoOptions;
    type Output = Seen;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(context.shared(Ticks::default)))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Seen>, Fault> {
        self.0.0.lock().expect("nobody has panicked").push(now());
        Ok(Reading::now(Seen { number: 0, handled_ns: 0, age_ns: 0 }))
    }
}

robot! {
    robot Mast;
    link mast {
        sensor beat: External<Beat>();
        sensor tick: Tick() { rate: 500 Hz; }
    }
    bridges { bridge net: Share(paths = "sensor/mast/beat"); }
}

robot! {
    robot Rover;
    link base {
        sensor beat: Remote<Beat>(from = Source::of(mast::sensor::mast::beat), within = 150 ms, clock_within = 15 ms);
        estimator judge: Judge() { input beat: sensor::base::beat; lost_after: 500 ms; }
        sensor tick: Tick() { rate: 500 Hz; }
    }
}

/// A mast that listens.
fn mast(endpoint: &str) -> Running<Mast> {
    let mut builder = Mast::builder();
    builder.options(mast::bridge::net).listen = endpoint.to_owned();
    builder.start().expect("it starts")
}

/// A rover, and what its estimator has got.
struct Listening {
    robot: Running<Rover>,
    seen: Subscription<Seen>,
    health: Subscription<HealthTransition>,
    last: Mutex<Option<Stamped<Seen>>>,
    oldest_ns: AtomicU64,
}

impl Listening {
    fn start(endpoint: &str) -> Self {
        Self::start_with(endpoint, PathBuf::new())
    }

    fn start_with(endpoint: &str, config: PathBuf) -> Self {
        let mut builder = Rover::builder();
        let options = builder.options(rover::sensor::base::beat);
        (options.connect, options.config) = (endpoint.to_owned(), config);
        let seen =
            builder.subscribe_with(rover::estimator::base::judge, Overflow::DropOldest { capacity: 100_000 });
        let health = builder.subscribe(system::Health);
        let robot = builder.start().expect("it starts");
        Self { robot, seen, health, last: Mutex::default(), oldest_ns: AtomicU64::new(0) }
    }

    /// The last beat that the estimator got.
    fn last(&self) -> MutexGuard<'_, Option<Stamped<Seen>>> {
        let mut last = self.last.lock().expect("nobody has panicked");
        for seen in self.seen.drain() {
            self.oldest_ns.fetch_max(seen.age_ns, Ordering::Relaxed);
            *last = Some(seen);
        }
        last
    }

    fn counts<const N: usize>(&self, names: [&str; N]) -> [u64; N] {
        let report = self.robot.report();
        names.map(|name| report.source("sensor/base/beat").map_or(0, |source| source.count(name)))
    }

    /// Waits for a change of health, and returns when it came.
    fn becomes(&self, state: HealthState) -> Option<Duration> {
        until(|| self.health.drain().any(|transition| transition.to == state)).then(now)
    }
}

/// Publishes beats until it is dropped.
struct Beating {
    is_over: Arc<AtomicBool>,
    is_paused: Arc<AtomicBool>,
    sent: Arc<AtomicU64>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Beating {
    fn start(mast: &Running<Mast>, period: Duration, size: usize) -> Self {
        let publisher = mast.publisher("sensor/mast/beat").expect("it may");
        let (is_over, is_paused, sent) =
            (Arc::<AtomicBool>::default(), Arc::<AtomicBool>::default(), Arc::<AtomicU64>::default());
        let thread = thread::spawn({
            let (is_over, is_paused, sent) = (Arc::clone(&is_over), Arc::clone(&is_paused), Arc::clone(&sent));
            move || {
                let mut next = Instant::now();
                while !is_over.load(Ordering::SeqCst) {
                    if !is_paused.load(Ordering::SeqCst) {
                        let number = sent.fetch_add(1, Ordering::SeqCst) + 1;
                        let made_ns = now().as_nanos() as u64;
                        publisher.publish(Beat { number, made_ns, more: vec![0; size] });
                    }
                    next = (next + period).max(Instant::now());
                    thread::sleep(next.saturating_duration_since(Instant::now()));
                }
            }
        });
        Self { is_over, is_paused, sent, thread: Some(thread) }
    }

    /// The number of the last beat, once the rover has it, and the rover's counts then.
    fn settled<const N: usize>(&self, rover: &Listening, names: [&str; N]) -> (u64, [u64; N]) {
        let mut sent = 0;
        // A message that is cut off at the end of a pause is found lost by the next.
        let is_settled = until(|| {
            self.is_paused.store(true, Ordering::SeqCst);
            let begun = Instant::now();
            let mut is_last = false;
            while !is_last && begun.elapsed() < Duration::from_millis(200) {
                thread::sleep(Duration::from_millis(2));
                sent = self.sent.load(Ordering::SeqCst);
                is_last = rover.last().as_ref().is_some_and(|last| last.number == sent);
            }
            if !is_last {
                self.is_paused.store(false, Ordering::SeqCst);
                thread::sleep(2 * PERIOD);
            }
            is_last
        });
        assert!(is_settled, "the last message does not arrive");
        let counts = rover.counts(names);
        self.is_paused.store(false, Ordering::SeqCst);
        (sent, counts)
    }
}

impl Drop for Beating {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::SeqCst);
        let _ = self.thread.take().map(thread::JoinHandle::join);
    }
}

/// Cuts the link for a while, and checks what the rover has made of it.
fn cut(state: LinkState, length: Duration) {
    let address = free_address();
    let mast = mast(&format!("tcp/{address}"));
    let relay = Relay::start(address).expect("it listens");
    let rover = Listening::start(&format!("tcp/127.0.0.1:{}", relay.port()));
    let beating = Beating::start(&mast, PERIOD, 0);
    assert!(until(|| rover.last().is_some()), "nothing is taken");
    thread::sleep(Duration::from_secs(1));
    const NAMES: [&str; 6] = ["received", "lost", "stale", "unsure", "refused", "repeated"];
    let (first, before) = beating.settled(&rover, NAMES);
    thread::sleep(Duration::from_millis(300));
    rover.health.drain().for_each(drop);

    relay.set(state);
    let begun = Instant::now();
    let name = format!("{state:?} for {length:?}");
    if length > LOST_AFTER + BUSY {
        let noticed = rover.becomes(HealthState::Lost).unwrap_or_else(|| panic!("{name}: it is not noticed"));
        let last = rover.last().as_ref().map_or(Duration::ZERO, |last| Duration::from_nanos(last.handled_ns));
        let after = noticed - last;
        println!("{name}: lost {after:?} after the last");
        assert!(after <= LOST_AFTER + PERIOD + BUSY, "{name}: lost {after:?} after the last");
    }
    thread::sleep(length.saturating_sub(begun.elapsed()));
    let opened = now();
    relay.set(LinkState::Open);
    if length > LOST_AFTER + BUSY {
        let joined = rover.becomes(HealthState::Healthy).unwrap_or_else(|| panic!("{name}: it does not recover"));
        println!("{name}: healthy after {:?}", joined - opened);
        assert!(joined - opened <= Duration::from_secs(2) + BUSY, "{name}: healthy after {:?}", joined - opened);
    } else {
        thread::sleep(Duration::from_secs(3));
    }
    thread::sleep(Duration::from_millis(500));
    let (last, after) = beating.settled(&rover, NAMES);
    let counts: [u64; 6] = std::array::from_fn(|index| after[index] - before[index]);
    println!("{name}: {} sent, {counts:?} {NAMES:?}", last - first);
    assert_eq!(counts[..4].iter().sum::<u64>(), last - first, "{name}: {counts:?}");
    assert_eq!(counts[4..], [0, 0], "{name}: {counts:?}");
    if (state, length) == (LinkState::Frozen, Duration::from_secs_f64(HELD_UP_S)) {
        assert!(counts[2] > 0, "{name}: nothing was too old: {counts:?}");
    }
    let oldest = Duration::from_nanos(rover.oldest_ns.load(Ordering::Relaxed));
    println!("{name}: the oldest was {oldest:?} old");
    assert!(oldest <= WITHIN + BUSY, "{name}: the oldest was {oldest:?} old");
}

fn cut_for(lengths_s: &[f64]) {
    thread::scope(|scope| {
        for length_s in lengths_s {
            for state in [LinkState::Frozen, LinkState::Closed] {
                scope.spawn(move || cut(state, Duration::from_secs_f64(*length_s)));
            }
        }
    });
}

#[test]
fn every_message_is_accounted_for_after_a_cut() {
    cut_for(&[0.05, HELD_UP_S, 1.0, 3.0]);
}

#[test]
#[ignore = "takes more than a minute"]
fn every_message_is_accounted_for_after_a_long_cut() {
    cut_for(&[10.0, 60.0]);
}

/// A mast and a rover that are clients of a router, and do not know each other.
#[test]
fn robots_meet_at_a_router_also_after_it_was_started_again() {
    let endpoint = free_endpoint();
    let first_router = router(&endpoint);
    let config = folder("client").join("client.json5");
    std::fs::write(&config, "{ mode: \"client\" }").expect("it is written");
    let mut builder = Mast::builder();
    let options = builder.options(mast::bridge::net);
    // The same settings would be the same session.
    (options.connect, options.config) = (format!("{endpoint} {endpoint}"), config.clone());
    let mast = builder.start().expect("it starts");
    let rover = Listening::start_with(&endpoint, config.clone());
    let beating = Beating::start(&mast, PERIOD, 0);
    assert!(until(|| rover.last().is_some()), "nothing is taken");
    const NAMES: [&str; 5] = ["received", "lost", "stale", "unsure", "refused"];
    let (first, before) = beating.settled(&rover, NAMES);
    thread::sleep(Duration::from_secs(1));
    let (last, after) = beating.settled(&rover, NAMES);
    let received = after[0] - before[0];
    assert_eq!((received, after[1] - before[1]), (last - first, 0), "not all is taken");
    rover.health.drain().for_each(drop);
    drop(first_router);
    assert!(rover.becomes(HealthState::Lost).is_some(), "the end of the router is not noticed");
    let _router = router(&endpoint);
    assert!(rover.becomes(HealthState::Healthy).is_some(), "they do not meet again");
    let (last, after) = beating.settled(&rover, NAMES);
    let counts: [u64; 5] = std::array::from_fn(|index| after[index] - before[index]);
    assert_eq!(counts.iter().sum::<u64>(), last - first, "{counts:?} {NAMES:?}");
    std::fs::remove_file(&config).expect("it is removed");
}

/// Environment of this program as a robot that reads, and is stopped.
pub(crate) const PEER_OF: &str = "BB_ZENOH_TEST_PEER_OF";

/// A program that ends with this one.
pub(crate) struct OtherProcess(Child);

impl OtherProcess {
    /// Runs one test of this program started again, as a peer of that endpoint.
    pub(crate) fn peer_of(test: &str, endpoint: &str) -> Self {
        let mut program = Process::new(std::env::current_exe().expect("it is this one"));
        program.args(["--exact", test]).env(PEER_OF, endpoint).stdin(Stdio::null()).stdout(Stdio::null());
        Self(program.spawn().expect("it starts"))
    }

    fn signal(&self, name: &str) {
        let sent = Process::new("kill").args([name, &self.0.id().to_string()]).status().expect("it is there");
        assert!(sent.success());
    }
}

impl Drop for OtherProcess {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Reads all that the mast says, until it is killed.
fn read_forever(endpoint: String) {
    let session = connected(vec![endpoint], None);
    let _all = session.declare_subscriber("bb/**").callback(|_| ()).wait().expect("it is declared");
    loop {
        thread::sleep(Duration::from_secs(1));
    }
}

/// Lateness of its tick over a time, the 99.9th percentile, and the number of ticks.
fn late(ticks: &Ticks, meanwhile: impl FnOnce()) -> (Duration, usize) {
    let lock = || ticks.0.lock().expect("nobody has panicked");
    lock().clear();
    meanwhile();
    let times = std::mem::take(&mut *lock());
    let mut late: Vec<Duration> =
        times.windows(2).map(|pair| (pair[1] - pair[0]).saturating_sub(Duration::from_millis(2))).collect();
    late.sort_unstable();
    (late[late.len() * 999 / 1000], times.len())
}

/// Prints how late the tick was, and compares it with that of an undisturbed robot before and after.
fn check_ticks(name: &str, disturbed: (Duration, usize), others: [(Duration, usize); 2]) {
    let undisturbed = others[0].0.max(others[1].0);
    println!("{name}: the tick is late by {:?} (p99.9 of {}), undisturbed by {others:?}", disturbed.0, disturbed.1);
    // A tick that waited for the network would be late by the lease, a second.
    assert!(disturbed.0 <= 3 * undisturbed + Duration::from_millis(50), "{name}: {disturbed:?} beside {others:?}");
    let fewest = others.iter().map(|other| other.1).min().unwrap_or(0);
    assert!(disturbed.1 * 2 >= fewest, "{name}: {disturbed:?} beside {others:?}");
}

const PHASE: Duration = Duration::from_secs(3);

/// Three read what the mast publishes; one of them is stopped, and neither closes its connection nor reads from it.
#[test]
fn a_peer_that_is_stopped_takes_nothing_from_the_others() {
    if let Ok(endpoint) = std::env::var(PEER_OF) {
        return read_forever(endpoint);
    }
    let endpoint = free_endpoint();
    let mast = mast(&endpoint);
    // The same settings would be the same session.
    let rovers = [endpoint.clone(), format!("{endpoint} {endpoint}")].map(|endpoint| Listening::start(&endpoint));
    let peer = OtherProcess::peer_of("link::a_peer_that_is_stopped_takes_nothing_from_the_others", &endpoint);
    // 200 Hz of 20 kB, so that the buffers of the one that is stopped are full at once.
    let beating = Beating::start(&mast, Duration::from_millis(5), 20_000);
    assert!(until(|| rovers.iter().all(|rover| rover.last().is_some())), "nothing is taken");
    let session = connected(vec![endpoint.clone(); 3], None);
    assert!(until(|| session.info().peers_zid().wait().next().is_some()));
    thread::sleep(Duration::from_secs(1));
    let ticks = mast.shared(Ticks::default);
    let before = rovers.each_ref().map(|rover| beating.settled(rover, ["received", "lost"]));
    let quiet = late(&ticks, || thread::sleep(PHASE));
    peer.signal("-STOP");
    let stopped = late(&ticks, || thread::sleep(PHASE));
    peer.signal("-CONT");
    thread::sleep(Duration::from_secs(1));
    let quiet_again = late(&ticks, || thread::sleep(PHASE));
    for (rover, (first, before)) in rovers.iter().zip(before) {
        let (last, after) = beating.settled(rover, ["received", "lost"]);
        let [received, lost] = [after[0] - before[0], after[1] - before[1]];
        println!("{received} of {} taken, {lost} lost", last - first);
        assert_eq!((lost, received > 1000), (0, true), "{received} of {}", last - first);
    }
    check_ticks("a peer is stopped", stopped, [quiet, quiet_again]);
}

#[test]
fn the_robot_ticks_on_during_a_cut_and_a_flood() {
    let address = free_address();
    let mast = mast(&format!("tcp/{address}"));
    let relay = Relay::start(address).expect("it listens");
    let rover = Listening::start(&format!("tcp/127.0.0.1:{}", relay.port()));
    let beating = Beating::start(&mast, PERIOD, 0);
    assert!(until(|| rover.last().is_some()), "nothing is taken");
    thread::sleep(Duration::from_secs(1));
    let ticks = rover.robot.shared(Ticks::default);
    let quiet = || late(&ticks, || thread::sleep(PHASE));
    let mut before = quiet();
    for state in [LinkState::Frozen, LinkState::Closed] {
        relay.set(state);
        let disturbed = late(&ticks, || thread::sleep(PHASE));
        relay.set(LinkState::Open);
        thread::sleep(Duration::from_secs(2));
        let after = quiet();
        check_ticks(&format!("{state:?}"), disturbed, [before, after]);
        before = after;
    }
    let received = rover.counts(["received"]);
    let disturbed = {
        let _flood = Beating::start(&mast, Duration::from_micros(250), 1000);
        late(&ticks, || thread::sleep(PHASE))
    };
    println!("{} taken of the flood", rover.counts(["received"])[0] - received[0]);
    check_ticks("a flood", disturbed, [before, quiet()]);
    drop(beating);
}
