//! Inputs at paths at which other code publishes.

use crate::kit::*;
use bb_core::message::codec::{decode, encode_as_ros, from_json, to_json};
use bb_core::payload::*;

/// All numbers since the last run.
#[derive(Clone, Copy, Debug, Inputs)]
struct Marks<'a> {
    driver: Input<'a, Number>,
    marks: Every<'a, Number>,
}

/// Emits their sum, and a hundredth of the driver's.
struct Sum;

impl Estimator for Sum {
    type Options = NoOptions;
    type Input = Marks<'static>;
    type Output = Number;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        // Of no frame of the robot.
        let mark = context.frame_from_input("marks")?;
        if mark == bb_core::nalgebra::Isometry3::identity() { Ok(Self) } else { Err(Fault::new("it is moved")) }
    }
    fn handle_input(&mut self, inputs: Marks<'_>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(inputs.marks.iter().fold(0.01 * inputs.driver.0, |sum, mark| sum + mark.0))))
    }
}

/// A controller that publishes for the estimators.
fn mapper(context: &ServiceContext) -> Result<Update, Fault> {
    let scale = context.bus().publisher("slam/scale")?;
    let mut count = 0.0;
    Ok(Box::new(move |_| {
        count += 1.0;
        scale.publish(Number(count));
        Ok(Reading::nothing())
    }))
}

robot! {
    robot Mapped;
    sensors { sensor radio: External<Number>(); }
    controllers { controller mapper: Pulse() { rate: 200 Hz; } }
    link base {
        sensor imu: External<Imu>();
        sensor ticks: Source(read = |number, _| Ok(Reading::now(Number(f64::from(number))))) { rate: 100 Hz; }
        estimator fused: Snapshot() {
            input driver: sensor::base::ticks, driver;
            input second: slam::scale, external, within: 30 ms;
            input third: slam::height, external;
        }
        estimator echo: Echo() { input number: slam::scale, external; lost_after: 50 ms; }
        joint mast: fixed {
            origin: { xyz: [0 m, 0 m, 1 m] };
            link top {
                estimator sum: Sum() {
                    input driver: sensor::base::ticks, driver;
                    input marks: slam::scale, external;
                    runs_on: worker;
                }
            }
        }
    }
}

#[test]
fn what_other_code_publishes_is_an_input_like_any_other() -> Result<(), Failure> {
    let mut simulation = Mapped::builder().simulate()?;
    let fused = simulation.subscribe(mapped::estimator::base::fused);
    let echoes = simulation.subscribe(mapped::estimator::base::echo);
    let sums = simulation.subscribe(mapped::estimator::base::mast::top::sum);
    let scales = simulation.subscribe(mapped::slam::scale);
    let changes = simulation.subscribe(system::Health);
    let bus = simulation.bus();
    // Its subscribers may be there before its publishers.
    let by_path = bus.subscribe::<Number>("slam/scale", Overflow::default())?;
    simulation.run_until(at(15));
    assert_eq!(fused.drain().count(), 0, "the second input has not come");

    let scale = bus.publisher::<Number>("slam/scale")?;
    scale.publish(Number(0.5));
    assert_eq!(numbers(&echoes), [0.5], "it runs before `publish` returns");
    scale.clone().publish(Number(0.25));
    bus.publisher::<Number>("slam/height")?.publish(Number(9.0));
    simulation.run_until(at(60));
    let seen: Vec<Seen> = fused.drain().map(|seen| seen.payload).collect();
    let seen_at =
        |driver, is_new| Seen { driver, second: 0.25, second_is_new: is_new, third: 9.0, third_is_new: is_new };
    assert_eq!(seen, [seen_at(3.0, true), seen_at(4.0, false), seen_at(5.0, false)]);
    assert_eq!(numbers(&sums), [0.78, 0.04, 0.05, 0.06, 0.07], "every one, once, from the first on");
    assert_eq!((numbers(&scales), numbers(&by_path)), (vec![0.5, 0.25], vec![0.5, 0.25]));

    // Older than its tolerance, and silent for longer than `lost_after`.
    simulation.run_until(at(70));
    let report = simulation.report();
    let fused = report.estimator("estimator/base/fused").ok_or("declared")?;
    let second = fused.inputs.iter().find(|input| input.name == "second").ok_or("declared")?;
    assert_eq!(second.dropped(DropReason::SyncMiss), 2 + 3, "before it came, and once it was too old");
    let of_echo = || changes.drain().filter(|change| change.estimator == "estimator/base/echo");
    assert_eq!(of_echo().map(|change| (change.to, change.time)).collect::<Vec<_>>(), [(HealthState::Lost, at(65))]);
    scale.publish(Number(2.0));
    assert_eq!(numbers(&echoes), [0.25, 2.0]);
    assert_eq!(of_echo().last().map(|change| change.to), Some(HealthState::Healthy));

    // A message with its own stamp.
    scale.forward(&Stamped::new(at(71), Number(3.0)));
    let forwarded = echoes.try_recv().ok_or("it was taken")?;
    assert_eq!((forwarded.0, forwarded.monotonic_time), (3.0, at(71)));
    simulation.stop().ok()?;
    scale.publish(Number(4.0));
    assert_eq!(echoes.drain().count(), 0);
    Ok(())
}

#[test]
fn a_publisher_of_another_payload_or_of_a_sensor_of_the_robot_is_refused_with_the_reason() {
    let simulation = Mapped::builder().simulate().expect("it starts");
    let bus = simulation.bus();
    let takers = "the input `second` of `estimator/base/fused` and the input `number` of `estimator/base/echo` and the input \
                  `marks` of `estimator/base/mast/top/sum` takes";
    let scale = format!("cannot publish `JointState` at `slam/scale`: {takers} `Number`");
    let height =
        "cannot publish `JointState` at `slam/height`: the input `third` of `estimator/base/fused` takes `Number`";
    let radio = "cannot publish `JointState` at `sensor/radio`: the robot takes `Number`";
    for (path, says) in [("slam/scale", &*scale), ("slam/height", height), ("sensor/radio", radio)] {
        assert_refused(bus.publisher::<JointState>(path), says);
    }
    let says = "cannot publish at `sensor/base/ticks`: only its own publisher does; choose another path";
    assert_refused(bus.publisher::<Number>("sensor/base/ticks"), says);
    assert!(bus.for_caller("page", [Right::Read]).publisher::<Number>("slam/scale").is_err(), "it may not publish");
}

#[test]
fn a_component_may_take_the_place_of_other_code() -> Result<(), Failure> {
    let mut builder = Mapped::builder();
    let options = SourceOptions {
        read: |number, _| Ok(Reading::now(Number(-f64::from(number))).next_at(at(10 * i64::from(number)))),
        ..SourceOptions::defaults()
    };
    builder.replace_sensor::<Source>("slam/scale", options)?;
    let echoes = builder.subscribe(mapped::estimator::base::echo);
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(20));
    assert_eq!(numbers(&echoes), [-1.0, -2.0, -3.0]);
    Ok(())
}

/// Replay of a file, without a publisher, after a run with a publisher outside and a controller that publishes. Runs on many threads are
/// those of `tests/stress.rs`.
#[test]
fn a_replay_takes_what_was_published_bit_for_bit() -> Result<(), Failure> {
    let mapping = || {
        let mut builder = Mapped::builder();
        builder.options(mapped::controller::mapper).init = mapper;
        builder
    };
    let (heard, report) = same_from_file(mapping, |builder| {
        let mut simulation = builder.simulate()?;
        let scale = simulation.bus().publisher::<Number>("slam/scale")?;
        for step in 1..20 {
            simulation.run_until(at(7 * step));
            scale.publish(Number(f64::from(step as i32).sqrt()));
        }
        Ok(simulation.stop())
    })?;
    report.ok()?;
    assert!(heard["estimator/base/echo"].len() > 40 && heard["estimator/base/mast/top/sum"].len() > 10);
    Ok(())
}

/// Publishes a payload at `path`, typed and as data: the same bits arrive. What is cut is refused. The codecs' own laws have random payloads of
/// every type, damaged ones, and what an error says.
fn typed_and_by_path<T: Payload>(bus: &Bus, path: &str, payload: T) -> Result<(), Failure> {
    let publisher = bus.publisher::<T>(path)?;
    let arrived = bus.subscribe_any(Select::Path(path), None, Overflow::default());
    let bytes = || -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        arrived.try_recv().ok_or("nothing has arrived")?.encode(&mut bytes);
        Ok(bytes)
    };
    let (json, mut ros) = (to_json(&payload), Vec::new());
    publisher.publish(payload);
    let typed = bytes()?;
    bus.publish_json(path, &json)?;
    assert_eq!(bytes()?, typed, "{path}");
    bus.publish_cdr(path, &typed)?;
    assert_eq!(bytes()?, typed, "{path}");
    if encode_as_ros(&decode::<Stamped<T>>(&typed)?, &mut ros) {
        bus.publish_ros(path, &ros)?;
        assert_eq!(bytes()?, typed, "{path}");
        ros.truncate(ros.len() / 2);
    }
    let wrong = json + "]";
    let why = from_json::<T>(&wrong).map(drop).expect_err("it is no JSON").to_string();
    assert_refused(bus.publish_json(path, &wrong), &format!("nothing is published at `{path}`: {why}"));
    for refused in [bus.publish_cdr(path, &typed[..typed.len() / 2]), bus.publish_ros(path, &ros)] {
        let error = refused.expect_err("it is cut").to_string();
        assert!(error.starts_with(&format!("nothing is published at `{path}`: ")), "{error}");
    }
    assert_eq!(arrived.drain().count(), 0);
    Ok(())
}

/// A distance to something.
fn range() -> Result<Range, Failure> {
    let range =
        r#"{"radiation": "Ultrasound", "field_of_view": 0.3, "min_range": 0.02, "max_range": 4, "range": 1.5}"#;
    Ok(from_json(range)?)
}

#[test]
fn data_by_path_is_the_typed_message_or_an_error() -> Result<(), Failure> {
    let mut simulation = Mapped::builder().simulate()?;
    simulation.run_until(at(7));
    let bus = simulation.bus();
    let imu = Imu::new([0.1, -0.0, 1e-300].into(), [9.0, 0.1 + 0.2, -1.0].into());
    typed_and_by_path(&bus, "sensor/base/imu", imu)?;
    typed_and_by_path(&bus, "sensor/radio", Number(0.1 + 0.2))?;
    typed_and_by_path(&bus, "slam/height", Number(-1e300))?;
    typed_and_by_path(&bus, "own/range", range()?)
}

/// A header's stamp counts within 10 s before and 100 ms after now; what is further away comes from another clock.
#[test]
fn a_message_of_ros_is_stamped_by_its_header_or_refused() -> Result<(), Failure> {
    let mut simulation = Mapped::builder().simulate()?;
    simulation.run_until(MonotonicTime::from_nanos(60_000_000_000));
    let bus = simulation.bus();
    let now = simulation.clock().now();
    let arrived = bus.subscribe::<Range>("own/range", Overflow::default())?;
    let wall = simulation.clock().wall_at(now).as_unix_nanos();
    let range = range()?;
    let publish = |age_nanos: Option<i64>| -> Result<i64, String> {
        let wall_time = age_nanos.map_or(WallTime::default(), |age| WallTime::from_unix_nanos(wall - age));
        let mut ros = Vec::new();
        assert!(encode_as_ros(&Stamped { wall_time, ..Stamped::new(now, range) }, &mut ros));
        bus.publish_ros("own/range", &ros).map_err(|error| error.to_string())?;
        let message = arrived.try_recv().ok_or("nothing has arrived")?;
        Ok(now.as_nanos() - message.monotonic_time.as_nanos())
    };
    let refused =
        |says: &str| Err(format!("nothing is published at `own/range`: the stamp of its header is {says}"));
    for (age, counted) in [
        (None, Ok(0)),
        (Some(0), Ok(0)),
        (Some(2_500_000_000), Ok(2_500_000_000)),
        (Some(10_000_000_000), Ok(10_000_000_000)),
        (Some(-100_000_000), Ok(0)),
        (Some(10_000_000_001), refused("10.0 s old by the robot's clock: expected at most 10 s")),
        (Some(3_600_000_000_000), refused("3600.0 s old by the robot's clock: expected at most 10 s")),
        (Some(-1_500_000_000), refused("1.5 s ahead of the robot's clock: expected at most 100 ms")),
    ] {
        assert_eq!(publish(age), counted, "{age:?}");
    }
    assert_eq!(arrived.drain().count(), 0);
    Ok(())
}

#[test]
fn what_cannot_be_published_by_path_says_why() -> Result<(), Failure> {
    let simulation = Mapped::builder().simulate()?;
    let refused = |path: &str| simulation.publish_json(path, "1.5").map_err(|error| error.to_string());
    assert_eq!(refused("slam/scale"), Ok(()), "an external input");
    assert_eq!(refused("sensor/radio"), Ok(()), "an external sensor");
    let own = "cannot publish at `sensor/base/ticks`: only its own publisher does; choose another path";
    assert_eq!(refused("sensor/base/ticks"), Err(own.into()));
    let unknown = |path: &str, hint: &str| {
        let why = "its payload is not known, since nobody has published or subscribed there";
        Err(format!("cannot publish at `{path}`: {why}{hint}"))
    };
    assert_eq!(refused("sensor/radios"), unknown("sensor/radios", "; did you mean `sensor/radio`?"));
    assert_eq!(refused("own/number"), unknown("own/number", ""));
    // From when somebody waits for it.
    let awaited = simulation.bus().subscribe::<Number>("own/number", Overflow::default())?;
    assert_eq!((refused("own/number"), numbers(&awaited)), (Ok(()), vec![1.5]));
    let session = simulation.session("page 1", Rights::ALL);
    let page = session.bus();
    drop(session);
    assert_refused(page.publish_json("sensor/radio", "1"), "the session of `page 1` has ended");
    let bus = simulation.bus();
    simulation.stop().ok()?;
    let stopped = bus.publish_json("sensor/radio", "1").expect_err("it has stopped").to_string();
    assert!(stopped.ends_with("the robot has stopped") || stopped.starts_with("cannot publish"), "{stopped}");
    Ok(())
}

/// The journal names the caller that publishes, once for as long as it is the same.
#[test]
fn the_journal_names_who_publishes_for_a_sensor() -> Result<(), Failure> {
    let mut builder = Mapped::builder();
    let lines = journal(&mut builder);
    let simulation = builder.simulate()?;
    let page = simulation.for_caller("page 1", [Right::Publish]);
    let bridge = simulation.for_caller("bridge", [Right::Publish]);
    let radio = bridge.publisher::<Number>("sensor/radio")?;
    for number in 0..3 {
        page.publish_json("sensor/radio", &number.to_string())?;
    }
    assert!(page.publish_json("sensor/radio", "true").is_err());
    radio.publish(Number(3.0));
    page.publish_json("slam/scale", "4")?;
    page.publish_json("sensor/radio", "5")?;
    simulation.stop().ok()?;
    let lines = entries(&lines);
    let callers: Vec<_> = lines
        .iter()
        .cloned()
        .filter_map(|line| match line.event {
            Event::Publisher { path, caller } => Some(format!("{path}: {caller}")),
            Event::Message { message: bb_core::journal::Recorded::Message(message), .. } => {
                message.downcast::<Number>().map(|number| number.0.to_string())
            }
            _ => None,
        })
        .collect();
    let expected =
        "sensor/radio: page 1, 0, 1, 2, sensor/radio: bridge, 3, slam/scale: page 1, 4, sensor/radio: page 1, 5";
    assert_eq!(callers.join(", "), expected);
    assert!(!lines.iter().any(|line| matches!(line.event, Event::Own { .. })), "they are messages of a publisher");
    let (heard, report) = play(Mapped::builder(), &read_back::<Mapped>(&lines)?)?;
    report.ok()?;
    assert_eq!(heard.get("sensor/radio").map(Vec::len), Some(5));
    Ok(())
}
