//! Rights of a caller: each verb of the bus needs its right, and everybody may disarm.

use crate::kit::*;
use bb_core::event::SafetyTransition;

/// Request to a bus that needs a right; its error says why the bus refuses.
type Verb = fn(&Bus) -> Result<(), Failure>;

const VERBS: [(Right, &str, Verb); 11] = [
    (Right::Read, "subscribe", |bus| {
        Ok(bus.subscribe::<Number>("sensor/base/pan/encoder", Overflow::default()).map(drop)?)
    }),
    (Right::Parameters, "set_parameter", |bus| Ok(bus.set_parameter("param/gain", 2.0)?)),
    (Right::Parameters, "set_parameters", |bus| Ok(bus.set_parameters([("param/gain", 3.0.into())])?)),
    (Right::Commands, "start_command", |bus| Ok(bus.start_command("command/disarm", "").map(drop)?)),
    (Right::Arm, "arm", |bus| Ok(bus.arm()?)),
    (Right::Actuators, "actuator", |bus| {
        Ok(bus.actuator::<Number>("actuator/base/pan/servo")?.send(Number(1.0))?)
    }),
    (Right::Arm, "force_disarm", |bus| Ok(bus.force_disarm()?)),
    (Right::Publish, "publisher", |bus| Ok(bus.publisher::<Number>("page/number").map(drop)?)),
    (Right::Publish, "publish_json", |bus| Ok(bus.publish_json("sensor/base/pan/encoder", "1")?)),
    (Right::Publish, "publish_cdr", |bus| Ok(bus.publish_cdr("sensor/base/pan/encoder", &encoded())?)),
    (Right::Publish, "publish_ros", |bus| {
        // There is no such message, which only those learn who may publish.
        let error = bus.publish_ros("sensor/base/pan/encoder", &[0; 4]).expect_err("no message").to_string();
        if error.contains("a payload that ROS has a message for") { Ok(()) } else { Err(error.into()) }
    }),
];

/// A message of the encoder.
fn encoded() -> Vec<u8> {
    let mut bytes = Vec::new();
    bb_core::message::codec::encode(&Stamped::new(MonotonicTime::ZERO, Number(1.0)), &mut bytes);
    bytes
}

#[test]
fn each_verb_needs_its_right_and_names_it_and_the_caller() {
    for bits in 0..1_u32 << Right::ALL.len() {
        let of_bits = Right::ALL.into_iter().filter(|right| bits & 1 << *right as u32 != 0);
        let rights: Rights = of_bits.collect();
        let robot = Plain::builder().simulate().expect("it starts");
        let page = robot.bus().for_caller("page", rights);
        assert_eq!((page.caller(), page.rights()), ("page", rights));
        for (right, verb, ask) in VERBS {
            // Whether the robot is armed is not what is asked here.
            robot.arm().expect("it may be armed");
            let told = ask(&page).map_err(|error| error.to_string());
            assert_eq!(page.check(right).is_ok(), rights.contains(right), "{right}");
            match told {
                Ok(()) => assert!(rights.contains(right), "{rights:?} {verb}"),
                Err(message) => {
                    let refusal = format!("`page` does not have the right `{right}`");
                    assert!(!rights.contains(right) && message.contains(&refusal), "{rights:?} {verb}: {message}");
                }
            }
        }
        robot.arm().expect("it may be armed");
        assert_eq!(page.disarm(), Ok(()), "everybody may");
        assert_eq!((page.safety(), page.state()), (Safety::Disarmed, "disarmed"));
    }
}

#[test]
fn callers_that_may_not_read_see_no_values_and_no_messages() {
    let robot = Plain::builder().simulate().expect("it starts");
    for (rights, may_read) in [(Rights::NONE, false), ([Right::Read].into(), true)] {
        let page = robot.bus().for_caller("page", rights);
        let all = page.subscribe_any(Select::All, None, Overflow::default());
        robot.arm().expect("it may be armed");
        robot.disarm().expect("it may be disarmed");
        assert_eq!(all.drain().count() > 0, may_read);
        assert_eq!(page.parameter("param/gain").is_some(), may_read);
        assert_eq!(page.description().parameters.len(), usize::from(may_read));
    }
}

#[test]
fn a_caller_gives_no_rights_that_it_does_not_have() {
    let robot = Plain::builder().simulate().expect("it starts");
    assert_eq!((robot.caller(), robot.rights()), ("program", Rights::ALL));
    let page = robot.for_caller("page", [Right::Read, Right::Arm]);
    let user = page.for_caller("user", [Right::Arm, Right::Commands]);
    assert_eq!((user.caller(), user.rights()), ("user", [Right::Arm].into()));
    assert_eq!(user.arm(), Ok(()));
    let error = page.for_caller("guest", Rights::NONE).arm().expect_err("it may not");
    let ArmError::Forbidden(why) = error else { panic!("{error}") };
    assert_eq!((why.caller.as_str(), why.right), ("guest", Right::Arm));
    let error = page.for_caller("guest", [Right::Read]).force_disarm().expect_err("it may not");
    assert!(matches!(&error, DisarmError::Forbidden(why) if why.right == Right::Arm), "{error}");
}

#[test]
fn a_command_that_arms_needs_the_right_to_arm_too() {
    for (rights, missing) in [
        (vec![Right::Commands], Some(Right::Arm)),
        (vec![Right::Arm], Some(Right::Commands)),
        (vec![Right::Arm, Right::Commands], None),
    ] {
        let mut robot = Plain::builder().simulate().expect("it starts");
        let page = robot.for_caller("page", rights.into_iter().collect::<Rights>());
        let started = page.start_command("command/arm", "").map(drop).map_err(|fault| fault.to_string());
        robot.run_for(Duration::from_millis(1));
        match missing {
            None => assert_eq!((started, robot.safety()), (Ok(()), Safety::Armed)),
            Some(right) => {
                let message = started.expect_err("it may not");
                assert!(message.contains(&format!("does not have the right `{right}`")), "{message}");
                assert_eq!(robot.safety(), Safety::Disarmed);
            }
        }
    }
}

/// Events, lines of the journal and a replay name the same callers.
#[test]
fn changes_of_parameters_and_safety_name_their_caller() -> Result<(), Failure> {
    let mut builder = Plain::builder();
    let lines = journal(&mut builder);
    let safety = builder.subscribe(system::SafetyState);
    let gain = builder.subscribe(plain::param::gain);
    let mut robot = builder.simulate()?;
    let page = robot.for_caller("page 1", Rights::ALL);
    page.set_parameter("param/gain", 2.0)?;
    robot.set_parameter(plain::param::gain, 3.0)?;
    page.arm()?;
    robot.for_caller("stop button", Rights::NONE).disarm()?;
    for command in ["command/arm", "command/disarm"] {
        page.start_command(command, "")?;
        robot.run_for(Duration::from_millis(1));
    }
    page.arm()?;
    robot.for_caller("service", Rights::ALL).request_stop()?;
    robot.stop();
    let callers: Vec<_> = gain.drain().map(|change| change.payload.caller).collect();
    assert_eq!(callers, ["page 1", "program"]);
    let changes = |safety: &Subscription<SafetyTransition>| {
        let change = |change: Stamped<SafetyTransition>| {
            format!("{} by {}", change.to, change.payload.caller.as_deref().unwrap_or_default())
        };
        safety.drain().map(change).collect::<Vec<_>>()
    };
    let expected = [
        "armed by page 1, disarming by stop button, disarmed by stop button",
        "armed by page 1, disarming by page 1, disarmed by page 1",
        "armed by page 1, disarming by service, disarmed by service",
    ];
    let first = changes(&safety);
    assert_eq!(first.join(", "), expected.join(", "));
    let lines = entries(&lines);
    let written = lines.iter().filter_map(|line| match &line.event {
        Event::Parameters { caller, .. } => Some(format!("parameters by {caller}")),
        Event::Arm { caller } => Some(format!("arm by {caller}")),
        Event::Disarm { caller, .. } => Some(format!("disarm by {caller}")),
        Event::Stop { caller } => Some(format!("stop by {caller}")),
        _ => None,
    });
    let expected = "parameters by page 1, parameters by program, arm by page 1, disarm by stop button, arm by page 1, \
                    stop by service";
    assert_eq!(written.collect::<Vec<_>>().join(", "), expected);
    // A replay publishes the same.
    let builder = Plain::builder();
    let again = builder.subscribe(system::SafetyState);
    play(builder, &read_back::<Plain>(&lines)?)?;
    assert_eq!(changes(&again), first);
    Ok(())
}
