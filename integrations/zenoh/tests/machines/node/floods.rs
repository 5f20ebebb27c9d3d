//! Clients that ask too much, or take no answers, and robots that are slow to be made safe.

use super::{SmallCart, announced, ask, bridged, options, other, trigger, triggered};
use crate::kit::{PATIENCE, connected, until};
use crate::link::{OtherProcess, PEER_OF};
use bb_core::prelude::*;
use bb_ros2::{EndpointKind, Gid};
use bb_zenoh::Session;
use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;
use zenoh::Wait;

#[test]
fn a_connection_that_says_nothing_is_closed_after_2_s() {
    let robot = SmallCart::builder().simulate().expect("it starts");
    let bridge = bridged(&robot, options());
    let endpoint = bridge.endpoints().remove(0);
    let address = endpoint.strip_prefix("tcp/").expect("it is TCP");
    let mut silent = TcpStream::connect(address).expect("it listens");
    silent.set_read_timeout(Some(Duration::from_secs(6))).expect("it may");
    assert_eq!(silent.read(&mut [0]).expect("it is closed"), 0);
}

/// Each is made again as soon as it is closed.
#[test]
fn a_node_joins_beside_200_connections_that_say_nothing() {
    let robot = SmallCart::builder().simulate().expect("it starts");
    let bridge = bridged(&robot, options());
    let endpoint = bridge.endpoints().remove(0);
    let address = endpoint.strip_prefix("tcp/").expect("it is TCP");
    let silent = || {
        let silent = TcpStream::connect(address).ok()?;
        silent.set_nonblocking(true).expect("it may");
        Some(silent)
    };
    let mut all: Vec<_> = (0..200).map(|_| silent()).collect();
    let has_joined = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !has_joined.load(Ordering::Relaxed) {
                for one in &mut all {
                    let read = one.as_mut().map(|one| one.read(&mut [0]).map_err(|error| error.kind()));
                    if read != Some(Err(ErrorKind::WouldBlock)) {
                        *one = silent();
                    }
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        // Longer than a connection has.
        std::thread::sleep(Duration::from_secs(3));
        let node = connected(vec![endpoint.clone()], None);
        let joined = until(|| node.info().routers_zid().wait().next().is_some());
        has_joined.store(true, Ordering::Relaxed);
        assert!(joined);
    });
}

/// Takes so many milliseconds to be made safe.
struct Heavy<const MS: u64>;

impl<const MS: u64> Sensor for Heavy<MS> {
    type Options = NoOptions;
    type Output = Imu;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(|| {
            std::thread::sleep(Duration::from_millis(MS));
            Ok(())
        });
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        Ok(Reading::nothing())
    }
}

robot! {
    robot HeavyCart;
    commands { arm: Arm; }
    link base { sensor load: Heavy<700>() { rate: 1 Hz; } }
}

robot! {
    robot StuckCart;
    commands { arm: Arm; }
    link base { sensor load: Heavy<6000>() { rate: 1 Hz; } }
}

/// Number of the threads of bridges.
fn threads() -> usize {
    let tasks = std::fs::read_dir("/proc/self/task").expect("it is Linux").flatten();
    let name = |task: std::fs::DirEntry| std::fs::read_to_string(task.path().join("comm")).ok();
    tasks.filter_map(name).filter(|name| name.starts_with("ros2 ")).count()
}

#[test]
fn two_thousand_requests_to_disarm_are_answered_by_few_threads() {
    let robot = HeavyCart::builder().start().expect("it starts");
    let bridge = bridged(&robot, options());
    let session = other(&bridge);
    let disarm = announced(&session, EndpointKind::Service, "/heavy_cart/disarm").address;
    robot.arm().expect("it is armed");
    let (before, answers) = (threads(), Arc::default());
    let mut most = 0;
    for _ in 0..2000 {
        ask(&session, &disarm, &[0, 1, 0, 0, 0], &answers);
        most = most.max(threads());
    }
    assert!(until(|| robot.safety() == Safety::Disarmed));
    assert!(most < before + 200, "{most} threads, {before} before");
    assert!(until(|| answers.load(Ordering::Relaxed) >= 1), "nobody is answered");
}

/// A client that asks without end for what takes longest to answer.
#[test]
fn a_flood_of_requests_does_not_keep_the_robot_from_being_disarmed() {
    let robot = SmallCart::builder().start().expect("it starts");
    let bridge = bridged(&robot, options());
    let session = other(&bridge);
    let listed = |name: &str| announced(&session, EndpointKind::Service, name).address;
    let describe = listed("/small_cart/describe_parameters");
    // A list of 2,000 names of one letter.
    let mut names = vec![0, 1, 0, 0];
    names.extend(2000_u32.to_le_bytes());
    (0..2000).for_each(|_| names.extend([2, 0, 0, 0, b'x', 0, 0, 0]));
    let flooder = connected(vec![bridge.endpoints()[0].clone(); 2], None);
    assert!(until(|| flooder.info().routers_zid().wait().next().is_some()));
    let (is_over, answers) = (AtomicBool::new(false), Arc::<AtomicU64>::default());
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                ask(&flooder, &describe, &names, &answers);
            }
        });
        assert!(until(|| answers.load(Ordering::Relaxed) > 100));
        let mut slowest = Duration::ZERO;
        let results: Vec<_> = (0..20)
            .map(|_| {
                let begun = Instant::now();
                let call = || trigger(&session, "/small_cart/disarm", Gid([1; 16]));
                let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(call));
                slowest = slowest.max(begun.elapsed());
                result.map_err(|_| "it was refused")
            })
            .collect();
        is_over.store(true, Ordering::Relaxed);
        println!("the slowest of 20 took {slowest:?}");
        assert!(results.iter().all(|result| *result == Ok((true, "disarmed".to_owned()))), "{results:?}");
    });
}

/// Asks in three sessions for what is refused at length, more often than it can be, and takes no answer.
fn ask_without_reading(endpoint_of_robot: String) {
    let sessions: Vec<Session> =
        (1..=3).map(|count| connected(vec![endpoint_of_robot.clone(); count], None)).collect();
    assert!(until(|| sessions.iter().all(|session| session.info().routers_zid().wait().next().is_some())));
    let rest = announced(&sessions[0], EndpointKind::Service, "/small_cart/rest").address;
    let other = rest.key(0).replace(&rest.type_hash.to_string(), &"x".repeat(2_000));
    std::thread::scope(|scope| {
        for session in &sessions {
            scope.spawn(|| {
                loop {
                    let asked = session.get(&other).timeout(PATIENCE).callback(|_| {
                        loop {
                            std::thread::sleep(PATIENCE);
                        }
                    });
                    // Its connection may be closed meanwhile.
                    let _ = asked.wait();
                    std::thread::sleep(Duration::from_micros(100));
                }
            });
        }
    });
}

#[test]
fn clients_that_do_not_read_do_not_keep_the_robot_from_being_disarmed() {
    if let Ok(endpoint) = std::env::var(PEER_OF) {
        return ask_without_reading(endpoint);
    }
    let robot = SmallCart::builder().start().expect("it starts");
    let bridge = bridged(&robot, options());
    let session = other(&bridge);
    let disarm = announced(&session, EndpointKind::Service, "/small_cart/disarm");
    let test = "node::floods::clients_that_do_not_read_do_not_keep_the_robot_from_being_disarmed";
    let _peer = OtherProcess::peer_of(test, &bridge.endpoints()[0]);
    let begun = Instant::now();
    let mut slowest = Duration::ZERO;
    while begun.elapsed() < Duration::from_secs(10) {
        let asked = Instant::now();
        // Its link is closed only if a busy machine gives no sign of life.
        let answer = std::iter::repeat_with(|| triggered(&session, &disarm, Gid([1; 16])));
        assert_eq!(answer.take(2).flatten().next(), Some((true, "disarmed".to_owned())));
        slowest = slowest.max(asked.elapsed());
        std::thread::sleep(Duration::from_millis(20));
    }
    println!("the slowest took {slowest:?}");
    assert!(slowest < Duration::from_secs(2), "{slowest:?}");
}

#[test]
fn the_end_does_not_wait_for_what_cannot_be_made_safe() {
    let robot = StuckCart::builder().start().expect("it starts");
    let bridge = bridged(&robot, options());
    let session = other(&bridge);
    let disarm = announced(&session, EndpointKind::Service, "/stuck_cart/disarm").address;
    robot.arm().expect("it is armed");
    ask(&session, &disarm, &[0, 1, 0, 0, 0], &Arc::default());
    assert!(until(|| robot.safety() == Safety::Disarming));
    let begun = Instant::now();
    drop(bridge);
    assert!(begun.elapsed() < Duration::from_secs(4), "{:?}", begun.elapsed());
}
