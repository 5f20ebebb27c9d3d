//! Topics that the robot publishes, and those that it takes.

use super::{SmallCart, announced, bridged, endpoint, imu, options, other, tokens, trigger};
use crate::kit::{PATIENCE, until};
use bb_core::message::codec::{decode_as_ros, encode};
use bb_core::prelude::*;
use bb_ros2::{Attachment, EndpointKind, Gid, Qos, TypeHash};
use bb_zenoh::{Ros2Bridge, Ros2Options, Ros2State};
use zenoh::Wait;

/// A robot that is a node by itself.
mod own {
    use bb_core::prelude::*;
    use bb_zenoh::Ros2Bridge;

    robot! {
        pub(crate) robot Own;
        bridges { bridge ros2: Ros2Bridge(listen = "tcp/127.0.0.1:0", namespace = "/site"); }
        link base { sensor imu: External<Imu>(); }
    }
}

#[test]
fn every_message_goes_out_with_its_number_and_the_id_of_its_token() {
    let robot = SmallCart::builder().simulate().expect("it starts");
    let bridge = bridged(&robot, options());
    assert_eq!(bridge.node(), "/small_cart");
    let session = other(&bridge);
    let token = tokens(&session)
        .into_iter()
        .find(|token| token.endpoint.as_ref().is_some_and(|endpoint| endpoint.address.name == "/sensor/base/imu"));
    let token = token.expect("it is announced");
    let address = &token.endpoint.as_ref().expect("it is one").address;
    let messages = session.declare_subscriber(address.key(0)).wait().expect("it is declared");
    let (seen, publisher) =
        (|| messages.try_recv().ok().flatten(), robot.publisher("sensor/base/imu").expect("it may"));
    // The first that comes shows that the subscription is known.
    let mut first = None;
    assert!(until(|| {
        publisher.publish(imu(-1.0));
        first = seen();
        first.is_some()
    }));
    for count in 0..500 {
        publisher.publish(imu(f64::from(count)));
    }
    let mut sequence =
        Attachment::from_bytes(&first.expect("it came").attachment().expect("it has one").to_bytes())
            .expect("it is one")
            .sequence;
    let mut counted = 0.0;
    while counted < 500.0 {
        let message = messages.recv_timeout(PATIENCE).expect("the session is open").expect("a message is missing");
        let attachment =
            Attachment::from_bytes(&message.attachment().expect("it has one").to_bytes()).expect("it is one");
        assert_eq!((attachment.sequence, attachment.gid), (sequence + 1, Gid::of(&token.to_string())));
        sequence += 1;
        let (imu, _) = decode_as_ros::<Imu>(&message.payload().to_bytes()).expect("ROS reads it");
        if imu.linear_acceleration.x >= 0.0 {
            assert_eq!(imu.linear_acceleration.x, counted);
            counted += 1.0;
        }
    }
    assert_eq!(bridge.state().unpublished, 0);
}

#[test]
fn what_ros_has_two_messages_for_has_two_topics_and_what_it_has_none_for_only_if_named() {
    let robot = SmallCart::builder().simulate().expect("it starts");
    let bridge = bridged(&robot, options());
    let session = other(&bridge);
    let kind = |name: &str| {
        endpoint(&session, EndpointKind::Publisher, name).map(|found| found.address.type_name.to_string())
    };
    assert_eq!(kind("/sensor/base/marg").as_deref(), Some("sensor_msgs/msg/Imu"));
    assert_eq!(kind("/sensor/base/marg/magnetic_field").as_deref(), Some("sensor_msgs/msg/MagneticField"));
    assert_eq!(kind("/health"), None);
    assert_eq!(kind("/clock").as_deref(), Some("rosgraph_msgs/msg/Clock"));
    let latched = announced(&session, EndpointKind::Publisher, "/robot_description");
    assert_eq!(latched.qos, Qos::LATCHED);

    let named = bridged(&robot, Ros2Options { publish: "health".into(), node: "named".into(), ..options() });
    let session = other(&named);
    let health = announced(&session, EndpointKind::Publisher, "/health");
    assert_eq!(health.address.type_name.to_string(), "bb_msgs/msg/HealthTransitionStamped");
    assert_eq!(endpoint(&session, EndpointKind::Publisher, "/sensor/base/imu"), None);
}

#[test]
fn a_node_without_hashes_is_one_of_humble() {
    let robot = SmallCart::builder().start().expect("it starts");
    let bridge = bridged(&robot, Ros2Options { hashes: false, ..options() });
    let session = other(&bridge);
    let endpoints = tokens(&session).into_iter().filter_map(|token| token.endpoint);
    assert!(endpoints.into_iter().all(|endpoint| endpoint.address.type_hash == TypeHash::Unsupported));
    let key = "0/sensor/base/imu/sensor_msgs::msg::dds_::Imu_/TypeHashNotSupported";
    let messages = session.declare_subscriber(key).wait().expect("it is declared");
    let publisher = robot.publisher("sensor/base/imu").expect("it may");
    assert!(until(|| {
        publisher.publish(imu(1.0));
        messages.try_recv().ok().flatten().is_some()
    }));
    let client = Gid([7; 16]);
    assert_eq!(trigger(&session, "/small_cart/rest", client), (true, "{}".to_owned()));
}

#[test]
fn only_external_paths_with_a_message_of_ros_are_inputs() {
    let robot = SmallCart::builder().simulate().expect("it starts");
    let refused = |subscribe: &str| {
        let served = Ros2Bridge::serve(&robot, Ros2Options { subscribe: subscribe.into(), ..options() });
        served.map(|_| ()).expect_err("it is refused").to_string()
    };
    assert_eq!(
        refused("sensor/base/imus"),
        "the robot is no node of ROS: `subscribe` has `sensor/base/imus`: the robot has no topic there"
    );
    assert!(refused("health").contains("only its own publisher publishes there"));
    let taken = bridged(&robot, options());
    let listen = taken.endpoints().join(" ");
    let error = Ros2Bridge::serve(&robot, Ros2Options { listen: listen.clone(), mode: "peer".into(), ..options() });
    let error = error.map(|_| ()).expect_err("the address is taken").to_string();
    assert!(error.contains(&format!("no session of zenoh that listens on {listen}")), "{error}");
}

#[test]
fn a_message_that_comes_in_is_not_sent_back() {
    let robot = SmallCart::builder().simulate().expect("it starts");
    let inputs = robot.subscribe_any(Select::Path("sensor/base/imu"), None, Overflow::default());
    let bridge = bridged(&robot, Ros2Options { subscribe: "sensor/base/imu".into(), ..options() });
    let session = other(&bridge);
    assert_eq!(endpoint(&session, EndpointKind::Publisher, "/sensor/base/imu"), None);
    let address = announced(&session, EndpointKind::Subscription, "/sensor/base/imu").address;
    let mut bytes = Vec::new();
    let message = Imu::to_ros(&Stamped::new(MonotonicTime::default(), imu(3.0)));
    encode(&message, &mut bytes);
    let echoes = session.declare_subscriber("0/sensor/base/imu/**").wait().expect("it is declared");
    let put = session.declare_publisher(address.key(0)).wait().expect("it is declared");
    let mut sent = 0;
    assert!(until(|| {
        put.put(bytes.clone()).wait().expect("it is put");
        sent += 1;
        inputs
            .try_recv()
            .is_some_and(|message| message.downcast::<Imu>().is_some_and(|imu| imu.linear_acceleration.x == 3.0))
    }));
    // It is counted after it is published.
    assert!(until(|| bridge.state().received > 0));
    assert_eq!(bridge.state().refused, 0);
    // What it has put comes to its own subscription, and nothing else.
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(echoes.drain().count(), sent);
}

#[test]
fn a_robot_declares_that_it_is_a_node_in_one_line() {
    let builder = own::Own::builder();
    let states = builder.subscribe(own::own::bridge::ros2);
    let robot = builder.start().expect("it starts");
    let publisher = robot.publisher("sensor/base/imu").expect("it may");
    let mut state = Ros2State::default();
    assert!(
        until(|| {
            publisher.publish(imu(0.0));
            state = states.try_recv().map_or(state, |state| state.payload);
            state.published > 10
        }),
        "{state:?}"
    );
}
