//! Inputs at paths at which other code publishes.

use crate::kit::*;
use bb_core::event::{HealthState, Right};
use bb_core::message::codec::{Layouts, Shape, encode, encode_as_ros, from_json, to_json};
use bb_core::payload::*;
use serde_json::json;

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
    let builder = Mapped::builder();
    let fused = builder.subscribe(mapped::estimator::base::fused);
    let echoes = builder.subscribe(mapped::estimator::base::echo);
    let sums = builder.subscribe(mapped::estimator::base::mast::top::sum);
    let scales = builder.subscribe(mapped::slam::scale);
    let changes = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
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
    let seen_at = |driver, second_is_new, third_is_new| Seen {
        driver,
        second: 0.25,
        second_is_new,
        third: 9.0,
        third_is_new,
    };
    assert_eq!(seen, [seen_at(3.0, true, true), seen_at(4.0, false, false), seen_at(5.0, false, false)]);
    assert_eq!(numbers(&sums), [0.78, 0.04, 0.05, 0.06, 0.07], "every one, once, from the first on");
    assert_eq!((numbers(&scales), numbers(&by_path)), (vec![0.5, 0.25], vec![0.5, 0.25]));

    // Older than its tolerance, and silent for longer than `lost_after`.
    simulation.run_until(at(70));
    let report = simulation.report();
    let fused = report.estimators.iter().find(|one| one.path == "estimator/base/fused").ok_or("declared")?;
    let second = fused.inputs.iter().find(|input| input.name == "second").ok_or("declared")?;
    assert_eq!(second.dropped(DropReason::SyncMiss), 2 + 3, "before it came, and once it was too old");
    let lost: Vec<_> = changes.drain().filter(|change| change.estimator == "estimator/base/echo").collect();
    assert_eq!(
        lost.iter().map(|change| (change.to, change.time)).collect::<Vec<_>>(),
        [(HealthState::Lost, at(65))]
    );
    scale.publish(Number(2.0));
    assert_eq!(numbers(&echoes), [0.25, 2.0]);
    let back: Vec<_> = changes.drain().filter(|change| change.estimator == "estimator/base/echo").collect();
    assert_eq!(back.last().map(|change| change.to), Some(HealthState::Healthy));

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
fn a_publisher_of_another_payload_is_refused_with_both_types_and_the_estimators() -> Result<(), Failure> {
    let simulation = Mapped::builder().simulate()?;
    let refusal =
        |path: &str| simulation.bus().publisher::<JointState>(path).map(drop).map_err(|error| error.to_string());
    let takers = "the input `second` of `estimator/base/fused` and the input `number` of `estimator/base/echo` and the input \
                  `marks` of `estimator/base/mast/top/sum` takes";
    assert_eq!(
        refusal("slam/scale"),
        Err(format!("cannot publish `JointState` at `slam/scale`: {takers} `Number`"))
    );
    let height =
        "cannot publish `JointState` at `slam/height`: the input `third` of `estimator/base/fused` takes `Number`";
    assert_eq!(refusal("slam/height"), Err(height.into()));
    let of_sensor = "cannot publish `JointState` at `sensor/radio`: the robot takes `Number`";
    assert_eq!(refusal("sensor/radio"), Err(of_sensor.into()));
    let reader = simulation.bus().for_caller("page", [Right::Read]);
    assert!(reader.publisher::<Number>("slam/scale").is_err(), "it may not publish");
    Ok(())
}

/// A sensor fed by other code may be fed by path.
#[test]
fn an_external_sensor_has_publishers_by_path() -> Result<(), Failure> {
    let builder = Mapped::builder();
    let radio = builder.subscribe(mapped::sensor::radio);
    let simulation = builder.simulate()?;
    simulation.bus().publisher::<Number>("sensor/radio")?.publish(Number(7.0));
    assert_eq!(numbers(&radio), [7.0]);
    let says = "cannot publish at `sensor/base/ticks`: only its own publisher does; choose another path";
    assert_refused(simulation.bus().publisher::<Number>("sensor/base/ticks"), says);
    Ok(())
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

#[test]
fn a_replay_takes_what_was_published_bit_for_bit() -> Result<(), Failure> {
    // On virtual time.
    same_again(Mapped::builder, |builder| {
        let mut simulation = builder.simulate()?;
        let scale = simulation.bus().publisher::<Number>("slam/scale")?;
        for step in 1..20 {
            simulation.run_until(at(7 * step));
            scale.publish(Number(f64::from(step as i32).sqrt()));
        }
        Ok(simulation.stop())
    })?;
    // On many threads, and from a file, which a replay reads without a publisher.
    let mut builder = Mapped::builder();
    builder.options(mapped::controller::mapper).init = mapper;
    let lines = journal(&mut builder);
    let echoes = builder.subscribe_with(mapped::estimator::base::echo, overflow());
    let sums = builder.subscribe_with(mapped::estimator::base::mast::top::sum, overflow());
    let running = builder.start()?;
    let outside = running.bus().publisher::<Number>("slam/scale")?;
    for number in 0..50 {
        outside.publish(Number(-f64::from(number)));
    }
    wait_until("twenty sums", || {
        running.report().topic("estimator/base/mast/top/sum").is_some_and(|topic| topic.published > 20)
    });
    running.stop().ok()?;
    let lines = read_back::<Mapped>(&entries(&lines))?;
    assert!(!lines.iter().any(|line| matches!(line.event, Event::Own { .. })), "they are messages of a publisher");
    let (heard, report) = play(Mapped::builder(), &lines)?;
    report.ok()?;
    let count = |path| heard.get(path).map_or(0, |texts: &Vec<_>| texts.len());
    assert_eq!(count("estimator/base/echo"), echoes.drain().count());
    assert_eq!(count("estimator/base/mast/top/sum"), sums.drain().count());
    Ok(())
}

/// A field of every form.
#[derive(Clone, Debug, Payload)]
struct Everything {
    yes: bool,
    letter: char,
    tiny: i8,
    wide: u64,
    single: f32,
    text: String,
    maybe: Option<Option<u16>>,
    nested: Vec<Form>,
    table: [[f64; 2]; 3],
    after: Duration,
    matrix: bb_core::nalgebra::Matrix2x3<f64>,
    unit: (),
}

#[derive(Clone, Debug, Payload)]
enum Form {
    Unit,
    Pair(f64, String),
    Fields { x: f32, list: Vec<u16> },
    One(Option<bool>),
}

robot! {
    robot Injected;
    link base {
        sensor imu: External<Imu>();
        sensor marg: External<Marg>();
        sensor scan: External<LaserScan>();
        sensor odometry: External<Odometry>();
        sensor everything: External<Everything>();
    }
}

/// JSON of the shape, of which the type may still refuse some.
fn random_json(random: &mut Random, shape: Shape) -> Value {
    let fields = |random: &mut Random, of: &[bb_core::message::codec::FieldShape]| -> Value {
        match of {
            [only] if only.name == "0" => random_json(random, only.shape),
            // What a struct without fields has.
            of if of.iter().any(|field| field.name.starts_with("structure_needs")) => json!({}),
            of => Value::Object(
                of.iter().map(|field| (field.name.into(), random_json(random, field.shape))).collect(),
            ),
        }
    };
    match shape {
        Shape::Bool => json!(random.below(2) == 1),
        Shape::Char => json!(["x", "é", "\"", "\n"][random.below(4) as usize]),
        Shape::Text => json!(["", "base_link", "é \\ \"quoted\"", "left wheel"][random.below(4) as usize]),
        Shape::F32 | Shape::F64 => match random.below(8) {
            0 => json!(["NaN", "Infinity", "-Infinity"][random.below(3) as usize]),
            1 => json!([0.0, -0.0, -1.0, 1e-300][random.below(4) as usize]),
            _ => json!(random.noise()),
        },
        Shape::I8 | Shape::U8 | Shape::Byte | Shape::I16 | Shape::U16 => json!(random.below(128)),
        Shape::I32 | Shape::U32 | Shape::I64 | Shape::U64 => json!(random.below(1_000_000_000)),
        Shape::Option(of) => {
            if random.below(2) == 0 {
                Value::Null
            } else {
                random_json(random, *of)
            }
        }
        Shape::List(of) => (0..random.below(4)).map(|_| random_json(random, *of)).collect(),
        Shape::Array(of, length) => (0..length).map(|_| random_json(random, *of)).collect(),
        Shape::Struct(of) => fields(random, of.fields),
        Shape::Enum(of) => {
            let variant = &of.variants[random.below(of.variants.len() as u64) as usize];
            match variant.fields.is_empty() {
                true => json!(variant.name),
                false => json!({ variant.name: fields(random, variant.fields) }),
            }
        }
    }
}

/// Replaces a value in a tree of JSON that holds no other ones. Returns its path as errors write it.
fn replace_leaf(random: &mut Random, value: &mut Value, other: Value) -> String {
    let length = match &*value {
        Value::Object(members) => members.len(),
        Value::Array(items) => items.len(),
        _ => 0,
    };
    let index = random.below(length.max(1) as u64) as usize;
    let (step, inner) = match value {
        Value::Object(members) if length > 0 => match members.iter_mut().nth(index) {
            Some((name, member)) => (name.clone(), member),
            None => return String::new(),
        },
        Value::Array(items) if length > 0 => (format!("[{index}]"), &mut items[index]),
        leaf => {
            *leaf = other;
            return String::new();
        }
    };
    let rest = replace_leaf(random, inner, other);
    if rest.is_empty() || rest.starts_with('[') { step + &rest } else { format!("{step}.{rest}") }
}

/// Random payloads of each type, and damaged copies of each.
const CASES: usize = 10;

/// Publishes random payloads at `path`, typed and as data: the same bits arrive. What is damaged is refused with its place, or is another
/// payload.
fn typed_and_by_path<T: Payload>(bus: &Bus, path: &str, random: &mut Random) -> Result<(), Failure> {
    let publisher = bus.publisher::<T>(path)?;
    let arrived = bus.subscribe_any(Select::Path(path), None, overflow());
    let bytes = |arrived: &DynamicSubscription| -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        arrived.try_recv().ok_or("nothing has arrived")?.encode(&mut bytes);
        Ok(bytes)
    };
    let (mut published, mut last_refusal) = (0, String::new());
    for _ in 0..10 * CASES {
        if published == CASES {
            break;
        }
        let mut value = random_json(random, Layouts::of::<T>().payload());
        // Some values are refused by the type, typed or not.
        let payload = from_json::<T>(&value.to_string());
        let Ok(payload) = payload else {
            let refused = bus.publish_json(path, &value.to_string()).expect_err("the type refuses it").to_string();
            assert_eq!(refused, format!("nothing is published at `{path}`: {}", payload.expect_err("it is one")));
            last_refusal = refused;
            continue;
        };
        published += 1;
        publisher.publish(payload.clone());
        let typed = bytes(&arrived)?;
        bus.publish_json(path, &to_json(&payload))?;
        assert_eq!(bytes(&arrived)?, typed, "{path} {value}");
        bus.publish_cdr(path, &typed)?;
        assert_eq!(bytes(&arrived)?, typed, "{path} {value}");

        // In ROS's layout: what that keeps.
        let mut ros = Vec::new();
        let message = bb_core::message::codec::decode::<Stamped<T>>(&typed)?;
        if encode_as_ros(&message, &mut ros) && bus.publish_ros(path, &ros).is_ok() {
            let back = arrived.try_recv().ok_or("nothing has arrived")?;
            let (mut kept, mut again) = (Vec::new(), Vec::new());
            let (read, wall_time) = bb_core::message::codec::decode_as_ros::<T>(&ros)?;
            encode(&Stamped { payload: read, wall_time, ..message.clone() }, &mut kept);
            back.encode(&mut again);
            if wall_time.as_unix_nanos() != 0 {
                assert_eq!(again, kept, "{path} {value}");
            }
        }

        let place = replace_leaf(random, &mut value, json!({ "wrong": [{}] }));
        let refused = bus.publish_json(path, &value.to_string()).expect_err("no field is that").to_string();
        let expected = format!("nothing is published at `{path}`: {place}");
        assert!(refused.starts_with(&expected), "{refused}\n{expected}\n{value}");
        for _ in 0..CASES {
            let mut text = to_json(&payload).into_bytes();
            let (mut exact, mut ros) = (typed.clone(), ros.clone());
            for bytes in [&mut text, &mut exact, &mut ros] {
                for _ in 0..=random.below(3) {
                    let at = random.below(bytes.len().max(1) as u64) as usize;
                    match random.below(3) {
                        0 => bytes.truncate(at),
                        1 if at < bytes.len() => bytes[at] = random.below(256) as u8,
                        _ if at < bytes.len() => drop(bytes.remove(at)),
                        _ => {}
                    }
                }
            }
            let results = [
                bus.publish_json(path, &String::from_utf8_lossy(&text)),
                bus.publish_cdr(path, &exact),
                bus.publish_ros(path, &ros),
            ];
            for error in results.iter().filter_map(|result| result.as_ref().err()) {
                assert!(error.to_string().starts_with(&format!("nothing is published at `{path}`: ")), "{error}");
            }
            assert_eq!(arrived.drain().count(), results.iter().filter(|result| result.is_ok()).count());
        }
    }
    assert_eq!(published, CASES, "{last_refusal}");
    Ok(())
}

#[test]
fn data_by_path_is_the_typed_message_or_an_error_that_names_the_field() -> Result<(), Failure> {
    let simulation = Injected::builder().simulate()?;
    let (bus, random) = (simulation.bus(), &mut Random::new(1));
    typed_and_by_path::<Imu>(&bus, "sensor/base/imu", random)?;
    typed_and_by_path::<Marg>(&bus, "sensor/base/marg", random)?;
    typed_and_by_path::<LaserScan>(&bus, "sensor/base/scan", random)?;
    typed_and_by_path::<Odometry>(&bus, "sensor/base/odometry", random)?;
    typed_and_by_path::<Everything>(&bus, "sensor/base/everything", random)?;
    macro_rules! own {
        ($($payload:ident)*) => { $( typed_and_by_path::<$payload>(&bus, concat!("own/", stringify!($payload)), random)?; )* };
    }
    own! {
        MagneticField FluidPressure Range Image GnssFix BatteryState JointState JointStates PositionCommand VelocityCommand
        EffortCommand JointTrajectory Orientation Pose PoseWithCovariance Twist TwistWithCovariance Accel Wrench Path
    }
    Ok(())
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
    let range =
        r#"{"radiation": "Ultrasound", "field_of_view": 0.3, "min_range": 0.02, "max_range": 4, "range": 1.5}"#;
    let range = from_json::<Range>(range)?;
    let publish = |age_nanos: Option<i64>| -> Result<i64, String> {
        let wall_time = age_nanos.map_or(WallTime::default(), |age| WallTime::from_unix_nanos(wall - age));
        let mut ros = Vec::new();
        assert!(encode_as_ros(&Stamped { wall_time, ..Stamped::new(now, range) }, &mut ros));
        bus.publish_ros("own/range", &ros).map_err(|error| error.to_string())?;
        let message = arrived.try_recv().ok_or("nothing has arrived")?;
        Ok(now.as_nanos() - message.monotonic_time.as_nanos())
    };
    for (age, counted) in [
        (None, 0),
        (Some(0), 0),
        (Some(2_500_000_000), 2_500_000_000),
        (Some(10_000_000_000), 10_000_000_000),
        (Some(-100_000_000), 0),
    ] {
        assert_eq!(publish(age), Ok(counted), "{age:?}");
    }
    let refused =
        |age, says: &str| (age, format!("nothing is published at `own/range`: the stamp of its header is {says}"));
    for (age, error) in [
        refused(10_000_000_001, "10.0 s old by the robot's clock: expected at most 10 s"),
        refused(3_600_000_000_000, "3600.0 s old by the robot's clock: expected at most 10 s"),
        refused(-1_500_000_000, "1.5 s ahead of the robot's clock: expected at most 100 ms"),
    ] {
        assert_eq!(publish(Some(age)), Err(error));
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
    let (heard, report) = play(Mapped::builder(), &read_back::<Mapped>(&lines)?)?;
    report.ok()?;
    assert_eq!(heard.get("sensor/radio").map(Vec::len), Some(5));
    Ok(())
}
