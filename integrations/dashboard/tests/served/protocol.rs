//! Views and rights of viewers.

use crate::client::{Client, token};
use crate::robot::{Cart, HTML, Level, cart, other, own};
use bb_core::Options as _;
use bb_core::prelude::*;
use bb_dashboard::{Dashboard, DashboardOptions};
use serde_json::{Value, json};
use std::error::Error;
use std::sync::{Arc, Mutex, PoisonError};

pub(crate) fn options() -> DashboardOptions {
    DashboardOptions { port: 0, ..DashboardOptions::defaults() }
}

fn at(millis: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis * 1_000_000)
}

/// A viewer that comes late sees what is wrong, since when and why.
#[test]
fn the_first_report_says_what_is_wrong_and_since_when() -> Result<(), Box<dyn Error>> {
    let mut simulation = Cart::builder().simulate()?;
    simulation.run_until(at(10_000));
    let dashboard = Dashboard::serve(&simulation, options())?;
    let mut client = Client::reading(&dashboard)?;
    assert_eq!((&client.welcome["robot"], &client.welcome["rights"]), (&"Cart".into(), &json!(["read"])));
    assert_eq!(client.welcome["description"]["run"], "simulation");
    let report = client.until(|message| message.get("report").cloned())?;
    let problem = &report["problems"][0];
    assert_eq!((&problem["severity"], &problem["path"]), (&"lost".into(), &"estimator/base/pass".into()));
    assert_eq!((&problem["since"], &report["time"]), (&0.2.into(), &10.0.into()));
    assert_eq!(dashboard.viewers(), 1);
    Ok(())
}

#[test]
fn readers_disarm_and_do_nothing_else() -> Result<(), Box<dyn Error>> {
    let simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    simulation.arm()?;
    let mut reader = Client::reading(&dashboard)?;
    let lacks = |right: &str| format!("`visitor 1` does not have the right `{right}`");
    assert_eq!(reader.refusal("arm", json!({})), format!("the robot was not armed: {}", lacks("arm")));
    assert!(reader.refusal("force_disarm", json!({})).contains(&lacks("arm")));
    assert_eq!(reader.refusal("stop", json!({})), lacks("arm"));
    assert_eq!(reader.refusal("start", json!({"path": "command/travel"})), lacks("commands"));
    assert_eq!(reader.refusal("cancel", json!({"execution": 1})), lacks("commands"));
    assert_eq!(reader.refusal("send", json!({"path": "actuator/a", "command": 1})), lacks("actuators"));
    assert_eq!(reader.refusal("publish", json!({"path": "sensor/base/level", "payload": 1})), lacks("publish"));
    let set = reader.refusal("set", json!({"values": {"param/speed": 1.0}}));
    assert_eq!(set, format!("param/speed is not set: {}", lacks("parameters")));
    assert_eq!(simulation.safety(), Safety::Armed);
    reader.ask("disarm", json!({}))?;
    assert_eq!(simulation.safety(), Safety::Disarmed);
    // The token may follow.
    reader.ask("token", json!({"token": token(&dashboard)}))?;
    reader.ask("arm", json!({}))?;
    assert_eq!(simulation.safety(), Safety::Armed);
    Ok(())
}

#[test]
fn a_writer_has_the_rights_of_the_options() -> Result<(), Box<dyn Error>> {
    let (mut builder, lines) = (Cart::builder(), Arc::new(Mutex::new(Vec::new())));
    let sink = Arc::clone(&lines);
    builder.journal(move |line| sink.lock().unwrap_or_else(PoisonError::into_inner).push(format!("{line:?}")));
    let simulation = builder.simulate()?;
    let dashboard = Dashboard::serve(&simulation, DashboardOptions { rights: "parameters".into(), ..options() })?;
    let mut writer = Client::steering(&dashboard)?;
    assert_eq!(writer.welcome["rights"], json!(["read", "parameters"]));
    writer.ask("set", json!({"values": {"param/speed": 1, "param/count": 4}}))?;
    assert_eq!((simulation.parameter(cart::param::speed), simulation.parameter(cart::param::count)), (1.0, 4));
    assert!(writer.refusal("arm", json!({})).contains("does not have the right `arm`"));
    // All or none, with the robot's own words.
    let refused = writer.refusal("set", json!({"values": {"param/count": 5, "param/speed": 9}}));
    assert_eq!(refused, "param/speed is not set: expected a number in 0.0..=1.5 m/s, found `9.0`");
    assert_eq!(simulation.parameter(cart::param::count), 4);
    let parameters =
        writer.until(|message| message.get("parameters").filter(|all| all["param/count"] == 4).cloned())?;
    assert_eq!(parameters, json!({"param/speed": 1.0, "param/count": 4}));
    // Who has done it is in the journal, the token that allowed it is not.
    let token = token(&dashboard);
    drop((writer, dashboard, simulation));
    let journal = lines.lock().unwrap_or_else(PoisonError::into_inner).concat();
    assert!(journal.contains("tester") && !journal.contains(&token), "{journal}");
    Ok(())
}

/// A command runs until it ends, or until any client cancels it.
#[test]
fn commands_are_started_awaited_and_cancelled_by_another() -> Result<(), Box<dyn Error>> {
    let mut simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    let mut first = Client::steering(&dashboard)?;
    let mut second = Client::steering(&dashboard)?;
    let refused = first.refusal("start", json!({"path": "command/travel"}));
    assert_eq!(refused, "`travel` is refused: it is not allowed in the state `disarmed`");
    let wrong = first.refusal("start", json!({"path": "command/travel", "arguments": {"distance": "far"}}));
    assert!(wrong.contains("distance"), "{wrong}");
    first.ask("arm", json!({}))?;
    let travel = |distance: f64| json!({"path": "command/travel", "arguments": {"distance": distance}});
    let execution = first.ask("start", travel(2.0))?["execution"].clone();
    simulation.run_for(Duration::from_secs(3));
    let value = first.until(|message| (message["op"] == "result").then(|| message["value"].clone()))?;
    assert_eq!(value, 4.0);
    let long = first.ask("start", travel(3600.0))?["execution"].clone();
    assert_ne!(long, execution);
    let listed = second.until(|message| {
        let list = message["report"]["executions"].as_array()?;
        list.iter().find(|one| one["number"] == long).cloned()
    })?;
    assert_eq!((&listed["path"], &listed["caller"]), (&"command/travel".into(), &"tester 1".into()));
    drop(first);
    second.ask("cancel", json!({"execution": long}))?;
    let phase = |event: &Value| event["message"]["payload"]["phase"].clone();
    let cancelled = second.event(|event| phase(event) == "Cancelled")?;
    assert_eq!(cancelled["message"]["payload"]["caller"], "tester 1");
    assert!(second.refusal("cancel", json!({"execution": long})).starts_with("no execution with the number"));
    Ok(())
}

#[test]
fn watched_paths_give_their_newest_message_and_others_none() -> Result<(), Box<dyn Error>> {
    let mut simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    let mut client = Client::reading(&dashboard)?;
    client.ask("watch", json!({"paths": ["estimator/base/pass", "no/such/path"]}))?;
    let level = simulation.publisher::<Level>("sensor/base/level")?;
    // Whenever the hub has subscribed: at the latest then, the newest is delivered.
    let mut value = 0.0;
    let messages = loop {
        value += 1.0;
        simulation.run_for(Duration::from_millis(100));
        level.publish(Level { value });
        let frame = client.until(|message| (message["op"] == "frame").then(|| message.clone()))?;
        if let Some(messages) = frame.get("messages") {
            break messages.clone();
        }
    };
    assert_eq!(messages.as_object().map(|messages| messages.len()), Some(1), "{messages}");
    assert!(messages["estimator/base/pass"]["payload"]["value"].as_f64().is_some_and(|seen| seen <= value));
    Ok(())
}

/// Texts of a component are shown as text, also long ones and those with markup.
#[test]
fn texts_of_the_robot_arrive_as_they_are() -> Result<(), Box<dyn Error>> {
    let mut simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    let mut client = Client::reading(&dashboard)?;
    simulation.run_until(at(100));
    simulation.publisher::<Level>("sensor/base/level")?.publish(Level { value: -1.0 });
    // As an event, the length alone. The frame of the event may have the first report of it too; later ones repeat it.
    let event = client.event(|event| event["path"] == "fault")?;
    assert!(event["message"]["too_long"].as_u64().is_some_and(|long| long > 300_000), "{event}");
    let fault = client.until(|message| {
        let faults = message["report"]["faults"].as_array()?;
        faults.first().and_then(|fault| fault["message"].as_str().map(str::to_owned))
    })?;
    assert!(fault.starts_with(HTML) && fault.len() > 300_000);
    Ok(())
}

#[test]
fn reading_may_need_the_token() -> Result<(), Box<dyn Error>> {
    let simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, DashboardOptions { read: "token".into(), ..options() })?;
    assert_eq!(Client::reading(&dashboard).map(drop).unwrap_err().to_string(), "the token is missing");
    let wrong = json!({"op": "hello", "version": 1, "token": "0".repeat(32)});
    assert_eq!(Client::with(&dashboard, wrong).map(drop).unwrap_err().to_string(), "the token is wrong");
    Client::steering(&dashboard)?.ask("ping", json!({}))?;
    Ok(())
}

#[test]
fn one_page_serves_several_robots() -> Result<(), Box<dyn Error>> {
    let (first, second, third) =
        (Cart::builder().simulate()?, other::Other::builder().simulate()?, Cart::builder().simulate()?);
    let dashboard = Dashboard::serve_all(&[&first, &second, &third], options())?;
    let client = Client::reading(&dashboard)?;
    assert_eq!(client.welcome["robots"], json!(["Cart", "Other", "Cart 2"]));
    let hello = |robot: &str| {
        let token = token(&dashboard);
        json!({"op": "hello", "version": 1, "token": token, "robot": robot})
    };
    Client::with(&dashboard, hello("Cart 2"))?.ask("set", json!({"values": {"param/count": 9}}))?;
    let count = cart::param::count;
    assert_eq!((first.parameter(count), third.parameter(count)), (3, 9));
    let other = Client::with(&dashboard, hello("Other"))?;
    assert_eq!(other.welcome["description"]["parameters"][0]["path"], "param/depth");
    let none = Client::with(&dashboard, hello("Nobody")).map(drop).unwrap_err();
    assert_eq!(none.to_string(), "no such robot is served here");
    Ok(())
}

/// A dashboard declared by a line of `robot!`, in real time.
#[test]
fn a_robot_may_declare_its_dashboard() -> Result<(), Box<dyn Error>> {
    let builder = own::Own::builder();
    let states = builder.subscribe_any(Select::Path("bridge/dashboard"), None, Overflow::default());
    let running = builder.start()?;
    let state = states.recv_timeout(Duration::from_secs(30)).ok_or("it publishes its state")?;
    let state: Value = serde_json::from_str(&state.to_json())?;
    let port = state["payload"]["port"].as_u64().and_then(|port| u16::try_from(port).ok()).ok_or("a port")?;
    let (head, _) =
        crate::client::request(([127, 0, 0, 1], port).into(), &format!("GET / HTTP/1.1\nHost: localhost:{port}"))?;
    assert!(head.starts_with("HTTP/1.1 200"), "{head}");
    running.stop().ok()?;
    assert!(std::net::TcpStream::connect(("127.0.0.1", port)).is_err(), "it ends with the robot");
    Ok(())
}
