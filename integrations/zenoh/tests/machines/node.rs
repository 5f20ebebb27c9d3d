//! The node from the other side, in one process.

use crate::kit::{PATIENCE, connected, free_endpoint, until};
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_core::{Bus, Options};
use bb_ros2::{Address, Attachment, Endpoint, EndpointKind, Gid, Node, Qos, Token};
use bb_zenoh::{Ros2Bridge, Ros2Options, Session};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use zenoh::Wait;

mod floods;
mod routers;
mod services;
mod topics;

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

/// Asks a service for nothing but an answer at some time, and does not wait for it.
fn ask(session: &Session, address: &Address, payload: &[u8], answers: &Arc<AtomicU64>) {
    let answers = Arc::clone(answers);
    let asked = session.get(address.key(0)).payload(payload).timeout(PATIENCE).callback(move |reply| {
        answers.fetch_add(u64::from(reply.result().is_ok()), Ordering::Relaxed);
    });
    asked.wait().expect("it is asked");
}
