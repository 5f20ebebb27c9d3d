//! A selection is the same on the builder and on the running robot.

use crate::kit::*;
use bb_estimators::SimulatedActuator;

/// Publishes at a path of its own, then reports an error of the hardware.
fn work(context: CommandContext) -> Doing {
    Box::pin(async move {
        context.bus().publisher("mission/progress")?.publish(Number(0.5));
        context.hardware_error("it burns");
        Ok(Outcome::done(()))
    })
}

robot! {
    robot Whole;
    parameters { gain: f64 = 1.0; }
    commands { arm: Arm; work: Task(run = work); }
    link base {
        sensor numbers: External<Number>() {
            estimator echo: Echo(input = |_, number| {
                if number < 0.0 { Err(Fault::new("negative")) } else { Ok(Reply::emit(Number(number))) }
            });
        }
        joint turn: revolute {
            axis: z;
            limit: { lower: -90 deg, upper: 90 deg, velocity: 4 rad/s, effort: 10 N*m };
            actuator motor: SimulatedActuator(acceleration = 50.0);
            sensor encoder: External<JointState>();
            link arm;
        }
    }
}

/// Publishes something at each path.
fn exercise(robot: &Live<Whole>, wait: &mut dyn FnMut()) -> Result<(), Failure> {
    let report = |path: &str| robot.report().topic(path).map_or(0, |topic| topic.published);
    let mut published = |path: &str, count: u64| {
        while report(path) < count {
            wait()
        }
    };
    robot.command(whole::command::arm, NoArguments)?;
    published("command/arm", 2);
    robot.actuate(whole::actuator::base::turn::motor, move_to(0.1))?;
    published("actuator/base/turn/motor/end_motion", 1);
    robot.publish(whole::sensor::base::turn::encoder, robot.clock().now(), joint(0.1));
    for number in [1.0, -1.0] {
        robot.publish(whole::sensor::base::numbers, robot.clock().now(), Number(number));
    }
    published("fault", 1);
    robot.set_parameter(whole::param::gain, 2.0)?;
    robot.command(whole::command::work, NoArguments)?;
    published("safety/error", 1);
    Ok(())
}

/// Messages received at each path, in order.
fn published(subscription: &DynamicSubscription) -> BTreeMap<&'static str, Vec<String>> {
    let mut heard = BTreeMap::<_, Vec<String>>::new();
    for message in subscription.drain() {
        heard.entry(message.path()).or_default().push(format!("{message:?}"));
    }
    heard
}

const ALL: [&str; 13] = [
    "actuator/base/turn/motor",
    "actuator/base/turn/motor/begin_motion",
    "actuator/base/turn/motor/end_motion",
    "command/arm",
    "command/work",
    "fault",
    "health",
    "mission/progress",
    "param/gain",
    "safety",
    "safety/error",
    "sensor/base/numbers",
    "sensor/base/numbers/echo",
];

/// Selections, with the number of paths that each gets.
const SELECTIONS: [(Select<'_>, Option<&str>, usize); 6] = [
    (Select::All, None, 15),
    (Select::Below("actuator"), None, 3),
    (Select::Path("actuator/base/turn/motor/end_motion"), None, 1),
    (Select::All, Some("BeginMotion"), 1),
    (Select::Below("safety"), None, 2),
    (Select::AnyOf(&[Select::Below("command"), Select::Path("actuator/base/turn/motor")]), None, 3),
];

fn listen(
    subscribe: impl Fn(Select<'static>, Option<&'static str>) -> DynamicSubscription,
) -> Vec<DynamicSubscription> {
    let listen = |(select, payload, _)| {
        let subscription = subscribe(select, payload);
        assert_eq!(subscription.unmatched(), [], "{select:?}");
        subscription
    };
    SELECTIONS.into_iter().map(listen).collect()
}

fn check(early: &[DynamicSubscription], late: &[DynamicSubscription]) {
    for (((early, late), (select, payload, count)), number) in early.iter().zip(late).zip(SELECTIONS).zip(0..) {
        assert_eq!(early.paths(), late.paths());
        let (early, late) = (published(early), published(late));
        assert_eq!(early, late, "{select:?} {payload:?}");
        assert_eq!(early.len(), count, "{select:?}: {:?}", early.keys());
        if number == 0 {
            let missing: Vec<_> = ALL.iter().filter(|path| !early.contains_key(*path)).collect();
            assert!(missing.is_empty(), "{missing:?}");
        }
    }
}

#[test]
fn the_builder_and_the_robot_give_the_same_messages_on_virtual_time_and_in_real_time() -> Result<(), Failure> {
    let heard = |builder: &Builder<Whole>| {
        listen(|select, payload| builder.subscribe_any(select, payload, Overflow::default()))
    };
    let heard_live =
        |robot: &Live<Whole>| listen(|select, payload| robot.subscribe_any(select, payload, Overflow::default()));
    let builder = Whole::builder();
    let early = heard(&builder);
    let mut simulation = builder.simulate()?;
    let robot = simulation.live();
    let late = heard_live(&robot);
    exercise(&robot, &mut || simulation.run_for(Duration::from_millis(1)))?;
    simulation.stop();
    check(&early, &late);

    let builder = Whole::builder();
    let early = heard(&builder);
    let running = builder.start()?;
    let late = heard_live(&running);
    exercise(&running, &mut || std::thread::sleep(Duration::from_millis(1)))?;
    running.stop();
    check(&early, &late);
    Ok(())
}
