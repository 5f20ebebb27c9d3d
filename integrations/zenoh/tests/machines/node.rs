//! The node from the other side, in one process.

use crate::kit::{PATIENCE, connected, folder, free_address, free_endpoint, router, until};
use crate::link::{OtherProcess, PEER_OF};
use crate::relay::{LinkState, Relay};
use bb_core::event::CommandEvent;
use bb_core::message::codec::{decode_as_ros, encode};
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_core::{Bus, Options};
use bb_ros2::{Address, Attachment, Endpoint, EndpointKind, Gid, Node, Qos, Token, TypeHash};
use bb_zenoh::{Mode, Ros2Bridge, Ros2Options, Ros2State, Session, SessionSettings};
use std::io::Read;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;
use zenoh::Wait;

/// Does nothing.
struct Rest;

impl Command for Rest {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        Ok(Outcome::done(()))
    }
}

robot! {
    robot SmallCart;
    parameters { speed: f64 = 0.5 m/s; }
    commands { rest: Rest { allowed_states: [disarmed, idle]; } }
    link base {
        sensor imu: External<Imu>();
        sensor marg: External<Marg>();
    }
}

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

/// A port of its own: with the same settings, it would be the session of another test.
fn options() -> Ros2Options {
    Ros2Options { listen: free_endpoint(), ..Ros2Options::defaults() }
}

fn bridged(robot: &Bus, options: Ros2Options) -> Ros2Bridge {
    Ros2Bridge::serve(robot, options).unwrap_or_else(|error| panic!("{error}"))
}

/// Another session, which knows the bridge alone.
fn other(bridge: &Ros2Bridge) -> Session {
    let session = connected(bridge.endpoints(), None);
    assert!(until(|| session.info().routers_zid().wait().next().is_some()), "it is not connected");
    session
}

fn imu(count: f64) -> Imu {
    Imu::new(Vector3::zeros(), Vector3::new(count, 0.0, 9.81))
}

fn tokens(session: &Session) -> Vec<Token> {
    let replies = session.liveliness().get("@ros2_lv/0/**").wait().expect("it is asked");
    replies
        .iter()
        .map(|reply| reply.result().expect("it is a token").key_expr().as_str().parse().expect("ROS reads it"))
        .collect()
}

/// The endpoint of that kind and name.
fn endpoint(session: &Session, kind: EndpointKind, name: &str) -> Option<Endpoint> {
    let endpoints = tokens(session).into_iter().filter_map(|token| token.endpoint);
    endpoints.into_iter().find(|endpoint| endpoint.kind == kind && endpoint.address.name == name)
}

/// The endpoint of that kind and name, once it is announced.
fn announced(session: &Session, kind: EndpointKind, name: &str) -> Endpoint {
    let mut found = None;
    let is_there = || {
        found = endpoint(session, kind, name);
        found.is_some()
    };
    assert!(until(is_there), "{name} is not announced");
    found.expect("it is there")
}

/// The token of a client of a service, which a node of that name has.
fn client_of(session: &Session, service: &str, node: &str) -> String {
    let token = Token {
        domain: 0,
        session: session.zid().to_string(),
        node_id: 0,
        id: 1,
        enclave: "/".into(),
        node: Node::new("/", node).expect("it is a name"),
        endpoint: Some(Endpoint {
            kind: EndpointKind::Client,
            address: announced(session, EndpointKind::Service, service).address,
            qos: Qos::reliable(10),
            backends: None,
        }),
    };
    token.to_string()
}

/// Calls a service without arguments in the name of a client, and returns what it answers: whether it succeeded, and the text.
fn trigger(session: &Session, name: &str, client: Gid) -> (bool, String) {
    triggered(session, &announced(session, EndpointKind::Service, name), client).expect("it is answered")
}

/// Calls a service that is known, as [`trigger`] does; `None` without an answer, as when the link was closed.
fn triggered(session: &Session, service: &Endpoint, client: Gid) -> Option<(bool, String)> {
    let attachment = Attachment { sequence: 7, time_ns: 1, gid: client };
    let replies =
        session.get(service.address.key(0)).payload([0, 1, 0, 0, 0]).attachment(attachment.to_bytes().as_slice());
    let reply = replies.timeout(PATIENCE).wait().expect("it is asked").recv().ok()?;
    let sample = reply.result().unwrap_or_else(|error| panic!("{:?}", error.payload().try_to_string()));
    let answered =
        sample.attachment().map(|bytes| Attachment::from_bytes(&bytes.to_bytes()).expect("ROS reads it"));
    assert_eq!(answered.map(|answered| (answered.sequence, answered.gid)), Some((7, client)));
    let payload = sample.payload().to_bytes();
    let text = payload.get(12..payload.len() - 1).expect("it has a text");
    Some((payload[4] == 1, String::from_utf8(text.to_vec()).expect("it is text")))
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
fn a_caller_has_the_name_of_its_node_and_the_rights_of_the_options() {
    let robot = SmallCart::builder().start().expect("it starts");
    let bridge = bridged(&robot, options());
    let session = other(&bridge);
    let operator = client_of(&session, "/small_cart/rest", "operator");
    let _declared = session.liveliness().declare_token(operator.clone()).wait().expect("it is declared");
    let events = robot.subscribe_any(Select::All, "CommandEvent", Overflow::default());
    let mut caller = String::new();
    // The token may come after the first call.
    assert!(
        until(|| {
            assert_eq!(trigger(&session, "/small_cart/rest", Gid::of(&operator)), (true, "{}".to_owned()));
            let last =
                events.drain().filter_map(|event| Some(event.downcast::<CommandEvent>()?.caller.clone())).last();
            caller = last.unwrap_or_default();
            caller == "ros2 /operator"
        }),
        "the caller is `{caller}`"
    );
    let (armed, why) = trigger(&session, "/small_cart/arm", Gid::of(&operator));
    assert!(!armed && why == "the robot was not armed: `ros2 /operator` does not have the right `arm`", "{why}");
    assert!(trigger(&session, "/small_cart/disarm", Gid([0; 16])).0, "everybody may");
    drop(bridge);
    assert_eq!(endpoint(&session, EndpointKind::Service, "/small_cart/rest"), None);
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

/// Goes on when it is cancelled, until the test lets it end.
struct Stuck;

static IS_INSIDE: AtomicBool = AtomicBool::new(false);
static MAY_END: AtomicBool = AtomicBool::new(false);

impl Command for Stuck {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        IS_INSIDE.store(true, Ordering::Relaxed);
        while !MAY_END.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(Outcome::done(()))
    }
}

robot! {
    robot Left;
    commands { stuck: Stuck; }
    link base;
}

#[test]
fn what_a_client_has_asked_for_is_not_done_once_it_has_left() {
    let robot = Left::builder().start().expect("it starts");
    let bridge = bridged(&robot, Ros2Options { rights: "arm parameters".into(), ..options() });
    // Arming waits for a command that was cancelled.
    robot.arm().expect("it is armed");
    robot.bus().start_command("command/stuck", "").expect("it is started");
    assert!(until(|| IS_INSIDE.load(Ordering::Relaxed)));
    robot.disarm().expect("it is disarmed");

    let session = other(&bridge);
    // A router passes on the token of a client, but not that of a peer.
    let settings =
        SessionSettings { mode: Mode::Client, connect: bridge.endpoints(), ..SessionSettings::default() };
    let node = Session::open(&settings).expect("it is opened");
    let address = |name: &str| announced(&session, EndpointKind::Service, name).address;
    assert!(until(|| node.info().routers_zid().wait().next().is_some()));
    let client = client_of(&node, "/left/arm", "operator");
    let declared = node.liveliness().declare_token(client.clone()).wait().expect("it is declared");
    let is_there = || tokens(&session).iter().any(|token| token.to_string() == client);
    assert!(until(is_there));
    let attachment = Attachment { sequence: 1, time_ns: 1, gid: Gid::of(&client) }.to_bytes();
    let arm = node.get(address("/left/arm").key(0)).payload([0, 1, 0, 0, 0]).attachment(attachment.as_slice());
    arm.callback(|_| ()).timeout(PATIENCE).wait().expect("it is asked");
    // Requests are looked at in their order. This one has no prefixes.
    let answers = Arc::default();
    ask(
        &node,
        &address("/left/list_parameters"),
        &[[0, 1, 0, 0], [0; 4], [0; 4], [0; 4], [0; 4]].concat(),
        &answers,
    );
    assert!(until(|| answers.load(Ordering::Relaxed) == 1));
    drop((declared, node));
    assert!(until(|| !is_there()));
    MAY_END.store(true, Ordering::Relaxed);
    let waited = Instant::now();
    while waited.elapsed() < Duration::from_millis(300) {
        assert_eq!(robot.safety(), Safety::Disarmed);
        std::thread::sleep(Duration::from_millis(2));
    }
    assert_eq!(trigger(&session, "/left/arm", Gid([1; 16])), (true, "armed".to_owned()));
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

/// Asks a service for nothing but an answer at some time, and does not wait for it.
fn ask(session: &Session, address: &Address, payload: &[u8], answers: &Arc<AtomicU64>) {
    let answers = Arc::clone(answers);
    let asked = session.get(address.key(0)).payload(payload).timeout(PATIENCE).callback(move |reply| {
        answers.fetch_add(u64::from(reply.result().is_ok()), Ordering::Relaxed);
    });
    asked.wait().expect("it is asked");
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

#[test]
fn requests_that_are_too_long_are_refused_by_name() {
    let robot = SmallCart::builder().start().expect("it starts");
    let bridge = bridged(&robot, options());
    let session = other(&bridge);
    let rest = announced(&session, EndpointKind::Service, "/small_cart/rest").address;
    let key = rest.key(0);
    let ask = |payload: usize, attachment: usize, parameters: usize| {
        let selector = format!("{key}?{}", "x".repeat(parameters));
        let once = || {
            let asked = session.get(&selector).payload(vec![0; payload]).attachment(vec![0; attachment]);
            asked.timeout(PATIENCE).wait().expect("it is asked").recv().ok()
        };
        // On a busy machine a link may be closed that stands still for a second.
        let reply = (0..3).find_map(|_| once()).expect("it is answered");
        let told =
            reply.result().map_err(|error| error.payload().try_to_string().expect("it is text").into_owned());
        told.map(|_| ())
    };
    let left = 65_536 - key.len();
    for (payload, attachment, parameters) in
        [(left, 0, 0), (0, left, 0), (0, 0, left), (left + 1, 0, 0), (left, 33, 0), (1, 0, left), (1_000_000, 0, 0)]
    {
        let size = payload + attachment + parameters + key.len();
        let expected = if size <= 65_536 {
            Ok(())
        } else {
            Err(format!("a request to /small_cart/rest has {size} bytes: send at most 65536"))
        };
        assert_eq!(ask(payload, attachment, parameters), expected, "{payload} {attachment} {parameters}");
    }
}

/// Asks in three sessions for what is refused at length, and takes no answer.
fn ask_without_reading(endpoint_of_robot: String) {
    let sessions: Vec<Session> =
        (1..=3).map(|count| connected(vec![endpoint_of_robot.clone(); count], None)).collect();
    assert!(until(|| sessions.iter().all(|session| session.info().routers_zid().wait().next().is_some())));
    let rest = announced(&sessions[0], EndpointKind::Service, "/small_cart/rest").address;
    let other = rest.key(0).replace(&rest.type_hash.to_string(), &"x".repeat(20_000));
    loop {
        for session in &sessions {
            let asked = session.get(&other).timeout(PATIENCE).callback(|_| {
                loop {
                    std::thread::sleep(PATIENCE);
                }
            });
            // Its connection may be closed meanwhile.
            let _ = asked.wait();
        }
        std::thread::sleep(Duration::from_millis(5));
    }
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
    let test = "node::clients_that_do_not_read_do_not_keep_the_robot_from_being_disarmed";
    let _peer = OtherProcess::peer_of(test, &bridge.endpoints()[0]);
    let begun = Instant::now();
    let mut slowest = Duration::ZERO;
    while begun.elapsed() < Duration::from_secs(6) {
        let asked = Instant::now();
        // A thread that receives may be held up for as long as a link lives without a sign of life: then it is made again.
        let answer = std::iter::repeat_with(|| triggered(&session, &disarm, Gid([1; 16])));
        assert_eq!(answer.take(20).flatten().next(), Some((true, "disarmed".to_owned())));
        slowest = slowest.max(asked.elapsed());
        std::thread::sleep(Duration::from_millis(20));
    }
    println!("the slowest took {slowest:?}");
    assert!(slowest < Duration::from_secs(4), "{slowest:?}");
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
