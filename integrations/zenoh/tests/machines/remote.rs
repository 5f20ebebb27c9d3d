//! A remote sensor whose peer does what it should not, over loopback.

use crate::kit::{Counter, Number, connected, free_endpoint, until};
use bb_core::message::codec::encode;
use bb_core::prelude::*;
use bb_zenoh::{Remote, RemoteOptions, Session, Share};
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use zenoh::Wait;

/// A payload of another shape.
#[derive(Clone, Debug, PartialEq, Payload)]
struct Text {
    value: String,
}

robot! {
    robot Rover;
    link base {
        sensor number: Remote<Number>(
            from = "Mast/sensor/mast/number", timeout = 300 ms, within = 5 s, clock_within = 50 ms
        );
    }
}

/// Something in the place of the mast.
struct Peer {
    session: Session,
    clock: Clock,
    /// Time that its clock is ahead, ns.
    ahead: Arc<AtomicI64>,
    answers: Arc<AtomicBool>,
    number: u64,
    _answers: zenoh::query::Queryable<()>,
}

impl Peer {
    fn start(endpoint: &str, number: u64, ahead: i64) -> Self {
        // The same settings would be the same session: a peer with another number lists the endpoint twice.
        let session = connected(vec![endpoint.to_owned(); 1 + number as usize % 2], None);
        let clock = Clock::real();
        let (ahead, is_answering) = (Arc::new(AtomicI64::new(ahead)), Arc::new(AtomicBool::new(true)));
        let (of_answers, ahead_then, answers_then) = (clock.clone(), Arc::clone(&ahead), Arc::clone(&is_answering));
        let answers = session.declare_queryable("bb/Mast/@clock").callback(move |query| {
            if !answers_then.load(Ordering::Relaxed) {
                return;
            }
            let now = (of_answers.now().as_nanos() + ahead_then.load(Ordering::Relaxed)) as u64;
            let answer: Vec<u8> = [number, now, now].iter().flat_map(|part| part.to_le_bytes()).collect();
            query.reply("bb/Mast/@clock", answer).wait().expect("it is answered");
        });
        let answers = answers.wait().expect("it is declared");
        Self { session, clock, ahead, answers: is_answering, number, _answers: answers }
    }

    fn now(&self) -> i64 {
        self.clock.now().as_nanos() + self.ahead.load(Ordering::Relaxed)
    }

    /// Puts a message of the right shape, measured `ago` before, with that number.
    fn put(&self, sequence: u64, ago: Duration) {
        let measured = self.now() - ago.as_nanos() as i64;
        let mut bytes = Vec::new();
        encode(&Stamped::new(MonotonicTime::from_nanos(measured), Number { value: sequence }), &mut bytes);
        self.put_raw(&Stamped::<Number>::LAYOUTS.type_hash(), bytes, Some((sequence, measured)));
    }

    fn put_raw(&self, hash: &str, bytes: Vec<u8>, attachment: Option<(u64, i64)>) {
        let put = self.session.put(format!("bb/Mast/sensor/mast/number/{hash}"), bytes);
        match attachment {
            Some((sequence, measured)) => {
                let parts = [self.number, sequence, measured as u64, self.now() as u64];
                let bytes: Vec<u8> = parts.iter().flat_map(|part| part.to_le_bytes()).collect();
                put.attachment(bytes).wait()
            }
            None => put.wait(),
        }
        .expect("it is put");
    }
}

/// A rover that listens, and what it has published.
struct Listening {
    robot: Running<Rover>,
    readings: Subscription<Number>,
    faults: Subscription<bb_core::ComponentFault>,
    endpoint: String,
}

impl Listening {
    fn start() -> Self {
        Self::start_with(|_| ())
    }

    fn start_with(change: impl FnOnce(&mut RemoteOptions<Number>)) -> Self {
        let endpoint = free_endpoint();
        let mut builder = Rover::builder();
        let options = builder.options(rover::sensor::base::number);
        options.listen = endpoint.clone();
        change(options);
        let readings = builder.subscribe(rover::sensor::base::number);
        let faults = builder.subscribe(system::Faults);
        Self { robot: builder.start().expect("it starts"), readings, faults, endpoint }
    }

    fn count(&self, name: &str) -> u64 {
        self.robot.report().source("sensor/base/number").map_or(0, |source| source.count(name))
    }

    /// Lets the peer act until it is so.
    fn until(&self, mut act: impl FnMut(), mut is_so: impl FnMut(&Self) -> bool) {
        let is_so = || {
            act();
            std::thread::sleep(Duration::from_millis(8));
            is_so(self)
        };
        assert!(until(is_so), "it did not become so");
    }

    /// Lets the peer act until a fault says this of it, and none of its messages was taken.
    fn refuses(&self, expected: &str, act: impl FnMut()) {
        self.until(act, |rover| {
            let found = rover.faults.drain().find(|fault| fault.message.contains(expected));
            if let Some(fault) = &found {
                assert!(fault.message.starts_with("`Mast` at `sensor/mast/number` "), "{}", fault.message);
            }
            found.is_some()
        });
        assert_eq!(self.readings.drain().count(), 0, "{expected}");
    }
}

#[test]
fn every_message_of_a_peer_is_accounted_for() {
    let rover = Listening::start();
    let peer = Peer::start(&rover.endpoint, 7, -123_456_789_000);
    let mut sequence = 0;
    rover.until(
        || {
            sequence += 1;
            peer.put(sequence, Duration::ZERO);
        },
        |rover| rover.count("received") > 0,
    );
    let settled = ["received", "stale", "unsure", "refused", "lost", "repeated"];
    let now = || settled.map(|name| rover.count(name));
    // What is still under way arrives.
    let mut before = [0; 6];
    while before != now() {
        before = now();
        std::thread::sleep(Duration::from_millis(500));
    }
    let mut first = sequence + 1;
    // Of five each: as they should, with one missing, twice, and too old.
    for round in 0..20 {
        let ago = if round % 4 == 3 { Duration::from_secs(30) } else { Duration::ZERO };
        for offset in 0..5 {
            if round % 4 == 1 && offset == 2 {
                continue;
            }
            peer.put(first + offset, ago);
            if round % 4 == 2 {
                peer.put(first + offset, ago);
            }
        }
        first += 5;
        std::thread::sleep(Duration::from_millis(30));
    }
    let difference = |now: [u64; 6]| std::array::from_fn::<u64, 6, _>(|index| now[index] - before[index]);
    rover.until(|| (), |_| difference(now()).iter().sum::<u64>() >= 125);
    // Twenty rounds: five with one lost, five repeated, five too old.
    assert_eq!(difference(now()), [70, 25, 0, 0, 5, 25], "{settled:?}");
    let readings: Vec<_> = rover.readings.drain().collect();
    for pair in readings.windows(2) {
        assert!(pair[0].value < pair[1].value && pair[0].monotonic_time < pair[1].monotonic_time, "{pair:?}");
    }
    let clock = Clock::real();
    assert!(readings.iter().all(|reading| reading.monotonic_time <= clock.now()));
}

/// A link that held all up for 303 ms, in which the clock of the peer was put forward: by that clock, the message is 153 ms old.
#[test]
fn a_clock_that_is_put_forward_makes_no_old_message_fresh() {
    let rover = Listening::start_with(|options| {
        options.within = Duration::from_millis(200);
        options.timeout = Duration::from_secs(20);
    });
    let peer = Peer::start(&rover.endpoint, 7, 0);
    let mut sequence = 0;
    let mut put = |ago_ms| {
        sequence += 1;
        peer.put(sequence, Duration::from_millis(ago_ms));
    };
    rover.until(|| put(0), |rover| rover.count("received") > 20);
    peer.answers.store(false, Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(303));
    peer.ahead.fetch_add(150_000_000, Ordering::Relaxed);
    let before = ["received", "stale"].map(|name| rover.count(name));
    put(303);
    rover.until(|| (), |rover| rover.count("received") + rover.count("stale") > before[0] + before[1]);
    assert_eq!(rover.count("received"), before[0], "it is taken");
    // It recovers.
    peer.answers.store(true, Ordering::Relaxed);
    rover.until(|| put(0), |rover| rover.count("received") > before[0]);
}

#[test]
fn what_is_malformed_is_refused_and_not_lost_as_well() {
    let rover = Listening::start_with(|options| options.timeout = Duration::from_secs(20));
    let peer = Peer::start(&rover.endpoint, 7, 0);
    let mut sequence = 0;
    let counts = || ["received", "stale", "unsure", "refused", "lost"].map(|name| rover.count(name));
    let (hash, other) = (Stamped::<Number>::LAYOUTS.type_hash(), Stamped::<Text>::LAYOUTS.type_hash());
    let mut sent = 0;
    let layouts = [(&hash, Some(0)), (&other, Some(0)), (&hash, Some(1 << 40)), (&hash, None), (&other, None)];
    for malformed in std::iter::once(None).chain(layouts.map(Some)) {
        if let Some((hash, ahead)) = malformed {
            let refused = rover.count("refused");
            sequence += 1;
            peer.put_raw(hash, vec![1, 2, 3], ahead.map(|ahead: u64| (sequence + ahead, peer.now())));
            rover.until(|| (), |rover| rover.count("refused") > refused);
        }
        // The sensor is restarted after a fault; what comes meanwhile is lost.
        let received = rover.count("received");
        let mut put = || {
            sequence += 1;
            peer.put(sequence, Duration::ZERO);
        };
        rover.until(&mut put, |rover| rover.count("received") > received + 20);
        let mut now = 0;
        // What is under way arrives.
        assert!(until(|| {
            std::thread::sleep(Duration::from_millis(300));
            let before = std::mem::replace(&mut now, counts().iter().sum());
            now == before
        }));
        match malformed {
            // What came before the first is not known.
            None => sent = sequence - now,
            Some(_) => assert_eq!(sequence - now, sent, "{malformed:?}: {:?}", counts()),
        }
    }
    assert_eq!(rover.count("refused"), 5);
}

#[test]
fn what_is_malformed_is_refused_by_name() {
    let rover = Listening::start();
    rover.refuses("nothing has been heard of it", || ());
    let peer = Peer::start(&rover.endpoint, 7, 5_000_000_000);
    let hash = Stamped::<Number>::LAYOUTS.type_hash();
    let sequence = AtomicU64::new(0);
    let next = || sequence.fetch_add(1, Ordering::Relaxed);
    let other = Stamped::<Text>::LAYOUTS.type_hash();
    rover.refuses("build both robots from one definition", || {
        peer.put_raw(&other, vec![1, 2, 3], Some((next(), peer.now())))
    });
    rover.refuses("it is not a robot's `Share`", || peer.put_raw(&hash, vec![0; 100], None));
    let random = AtomicU64::new(1);
    rover.refuses("cannot be read", || {
        let seed = random.fetch_add(0x9e37_79b9_7f4a_7c15, Ordering::Relaxed);
        let bytes = (0..seed % 80).map(|index| (seed >> (index % 57)) as u8).collect();
        peer.put_raw(&hash, bytes, Some((next(), peer.now())));
    });
    let mut bytes = Vec::new();
    encode(&Stamped::new(MonotonicTime::ZERO, Number { value: 0 }), &mut bytes);
    rover.refuses("ahead of its clock", || {
        peer.put_raw(&hash, bytes.clone(), Some((next(), peer.now() + 2_000_000_000)));
    });
    let far = AtomicU64::new(1 << 40);
    rover.refuses("far ahead of the last", || {
        let number = far.fetch_add(1 << 40, Ordering::Relaxed);
        peer.put_raw(&hash, bytes.clone(), Some((number, peer.now() - 30_000_000_000)));
    });
}

#[test]
fn two_robots_of_one_name_are_refused() {
    let rover = Listening::start();
    let peers = [Peer::start(&rover.endpoint, 2, 0), Peer::start(&rover.endpoint, 3, 1_000_000_000)];
    let mut sequence = 0;
    let mut act = || {
        sequence += 1;
        peers.iter().for_each(|peer| peer.put(sequence, Duration::ZERO));
    };
    rover.until(&mut act, |rover| {
        rover.faults.drain().any(|fault| fault.message.contains("is the name of two robots"))
    });
    rover.readings.drain().for_each(drop);
    (0..100).for_each(|_| act());
    rover.until(&mut act, |rover| {
        rover.faults.drain().any(|fault| fault.message.contains("is the name of two robots"))
    });
    assert_eq!(rover.readings.drain().count(), 0);
}

robot! {
    robot Mast;
    commands { arm: Arm; }
    link mast { sensor number: Counter() { rate: 200 Hz; } sensor other: Counter() { rate: 200 Hz; } }
    bridges { bridge net: Share(paths = "sensor/mast/number"); }
}

/// Checks that all that is shared arrives, that nothing else does, and that neither robot arms the other.
#[test]
fn a_robot_shares_what_it_selects_and_nothing_else() {
    let rover = Listening::start();
    let mut builder = Mast::builder();
    builder.options(mast::bridge::net).connect = rover.endpoint.clone();
    let mast = builder.start().expect("it starts");
    // Listens to all that crosses.
    let session = connected(vec![rover.endpoint.clone(); 3], None);
    let keys: Arc<Mutex<std::collections::BTreeSet<String>>> = Arc::default();
    let seen = Arc::clone(&keys);
    let listener = session.declare_subscriber("bb/**").callback(move |sample| {
        seen.lock().expect("nobody has panicked").insert(sample.key_expr().to_string());
    });
    let _listener = listener.wait().expect("it is declared");

    rover.until(|| (), |rover| rover.count("received") >= 200);
    mast.arm().expect("it is armed");
    rover.until(|| (), |rover| rover.count("received") >= 400);
    assert_eq!((mast.safety(), rover.robot.safety()), (Safety::Armed, Safety::Disarmed));
    rover.robot.bus().disarm().expect("it is disarmed");
    assert_eq!(mast.safety(), Safety::Armed);
    let (received, lost) = (rover.count("received"), rover.count("lost"));
    assert!(lost * 10 < received, "{lost} of {received} lost");
    let hash = Stamped::<Number>::LAYOUTS.type_hash();
    let keys = keys.lock().expect("nobody has panicked");
    assert!(keys.iter().all(|key| *key == format!("bb/Mast/sensor/mast/number/{hash}")), "{keys:?}");
}

#[test]
fn a_simulation_takes_another_sensor_in_its_place() {
    let error = Rover::builder().simulate().expect_err("it has no network").to_string();
    assert!(error.contains("replace_sensor"), "{error}");
    let mut builder = Rover::builder();
    builder.replace_sensor::<External<Number>>("sensor/base/number", NoOptions).expect("it is there");
    builder.simulate().expect("it starts");
    // A bridge is left out.
    Mast::builder().simulate().expect("it starts");
}
