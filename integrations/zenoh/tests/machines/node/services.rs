//! Commands and parameters: in whose name they are carried out, and what of them is refused.

use super::{SmallCart, announced, ask, bridged, client_of, endpoint, imu, options, other, tokens, trigger};
use crate::kit::{PATIENCE, until};
use bb_core::event::CommandEvent;
use bb_core::message::codec::encode;
use bb_core::prelude::*;
use bb_ros2::{Attachment, EndpointKind, Gid};
use bb_zenoh::{Mode, Ros2Options, Session, SessionSettings};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use zenoh::Wait;

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

/// A tool that asks for all there is, or puts something everywhere.
#[test]
fn keys_with_wildcards_are_neither_requests_nor_messages() {
    let robot = SmallCart::builder().start().expect("it starts");
    let with_rights =
        Ros2Options { rights: "arm commands".into(), subscribe: "sensor/base/imu".into(), ..options() };
    let bridge = bridged(&robot, with_rights);
    let session = other(&bridge);
    let hash = announced(&session, EndpointKind::Service, "/small_cart/arm").address.type_hash;
    let selectors = [
        "**".to_owned(),
        "0/small_cart/arm/**/TypeHashNotSupported".to_owned(),
        format!("0/small_cart/arm/*/{hash}"),
        format!("0/small_cart/a$*/*/{hash}"),
    ];
    for selector in selectors {
        let replies = session.get(&selector).payload([0, 1, 0, 0, 0]).timeout(PATIENCE).wait();
        let replies: Vec<_> = replies.expect("it is asked").iter().collect();
        assert!(
            !replies.is_empty() && replies.iter().all(|reply| reply.result().is_err()),
            "{selector}: {replies:?}"
        );
        assert_eq!(robot.safety(), Safety::Disarmed, "{selector}");
    }
    let imu_hash = announced(&session, EndpointKind::Subscription, "/sensor/base/imu").address.type_hash;
    let mut bytes = Vec::new();
    encode(&Imu::to_ros(&Stamped::new(MonotonicTime::default(), imu(3.0))), &mut bytes);
    let keys =
        ["**".to_owned(), "0/sensor/**/TypeHashNotSupported".to_owned(), format!("0/sensor/base/*/*/{imu_hash}")];
    for key in &keys {
        session.put(key, bytes.clone()).wait().expect("it is put");
    }
    assert!(until(|| bridge.state().refused == keys.len() as u64), "{:?}", bridge.state());
    assert_eq!(bridge.state().received, 0);
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
        // On a busy machine, a link that gives no sign of life for a second may be closed.
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
