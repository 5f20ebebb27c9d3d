//! A router between the robot and other nodes.

use super::{SmallCart, bridged, imu, options};
use crate::kit::{folder, free_address, free_endpoint, router, until};
use crate::relay::{LinkState, Relay};
use bb_core::prelude::*;
use bb_zenoh::{Mode, Ros2Options, Session, SessionSettings};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use zenoh::Wait;

#[test]
fn the_end_waits_neither_for_a_frozen_router_nor_for_a_robot_that_publishes_on() {
    let routed = free_address();
    let router = router(&format!("tcp/{routed}"));
    let messages = router.declare_subscriber("0/sensor/base/imu/**").wait().expect("it is declared");
    let relay = Relay::start(routed).expect("it listens");
    let robot = SmallCart::builder().start().expect("it starts");
    let connect = format!("tcp/127.0.0.1:{}", relay.port());
    let bridge = bridged(&robot, Ros2Options { connect, listen: String::new(), ..options() });
    let publisher = robot.publisher("sensor/base/imu").expect("it may");
    assert!(until(|| {
        publisher.publish(imu(0.0));
        messages.try_recv().ok().flatten().is_some()
    }));
    let is_over = AtomicBool::new(false);
    let took = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                (0..20).for_each(|_| publisher.publish(imu(1.0)));
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        std::thread::sleep(Duration::from_millis(200));
        relay.set(LinkState::Frozen);
        std::thread::sleep(Duration::from_millis(200));
        let begun = Instant::now();
        drop(bridge);
        is_over.store(true, Ordering::Relaxed);
        begun.elapsed()
    });
    assert!(took < Duration::from_secs(6), "{took:?}");
    relay.set(LinkState::Open);
}

/// A router in the middle, as `rmw_zenohd` is one: nodes of ROS are peers that find each other by gossip, and the robot is a client.
#[test]
fn a_node_and_the_robot_meet_at_a_router_also_after_it_was_started_again() {
    let endpoint = free_endpoint();
    let first_router = router(&endpoint);
    let robot = SmallCart::builder().start().expect("it starts");
    let options = Ros2Options { connect: endpoint.clone(), listen: String::new(), ..options() };
    let _bridge = bridged(&robot, options);
    let file = folder("node").join("gossip.json5");
    let gossip =
        "{ scouting: { gossip: { enabled: true, autoconnect: { router: [], peer: ['router', 'peer'] } } } }";
    std::fs::write(&file, gossip).expect("it is written");
    let settings = SessionSettings {
        mode: Mode::Peer,
        listen: vec!["tcp/127.0.0.1:0".into()],
        connect: vec![endpoint.clone()],
        file: Some(file.clone()),
    };
    let node = Session::open(&settings).expect("it is opened");
    std::fs::remove_file(&file).expect("it is removed");
    let messages = node.declare_subscriber("0/sensor/base/imu/**").wait().expect("it is declared");
    let publisher = robot.publisher("sensor/base/imu").expect("it may");
    let meets = || {
        until(|| {
            publisher.publish(imu(0.0));
            messages.try_recv().ok().flatten().is_some()
        })
    };
    assert!(meets(), "not at first");
    drop(first_router);
    while messages.try_recv().ok().flatten().is_some() {}
    let _router = router(&endpoint);
    assert!(meets(), "not again");
}
