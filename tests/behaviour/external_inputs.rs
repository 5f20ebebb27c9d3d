//! Inputs at paths at which other code publishes.

use crate::components::{Echo, Failure, Number, Pulse, Seen, Snapshot, Source, SourceOptions, Update, at, numbers};
use crate::gate::wait_until;
use crate::replay::{entries, journal, overflow, play, read_back, same_again};
use bb_core::event::{HealthState, Right};
use bb_core::journal::Event;
use bb_core::prelude::*;
use bb_core::run::DropReason;

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

robot! {
    robot Mapping;
    controllers { controller mapper: Pulse(init = mapper) { rate: 200 Hz; } }
    link base {
        sensor ticks: Source(read = |number, _| Ok(Reading::now(Number(f64::from(number))))) { rate: 100 Hz; }
        estimator echo: Echo() { input number: slam::scale, external; }
        estimator sum: Sum() {
            input driver: sensor::base::ticks, driver;
            input marks: slam::scale, external;
            runs_on: worker;
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
    let own =
        simulation.bus().publisher::<Number>("sensor/base/ticks").map(drop).map_err(|error| error.to_string());
    assert_eq!(
        own,
        Err("cannot publish at `sensor/base/ticks`: only its own publisher does; choose another path".into())
    );
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
    let mut builder = Mapping::builder();
    let lines = journal(&mut builder);
    let echoes = builder.subscribe_with(mapping::estimator::base::echo, overflow());
    let sums = builder.subscribe_with(mapping::estimator::base::sum, overflow());
    let running = builder.start()?;
    let outside = running.bus().publisher::<Number>("slam/scale")?;
    for number in 0..50 {
        outside.publish(Number(-f64::from(number)));
    }
    wait_until("twenty sums", || {
        running.report().topic("estimator/base/sum").is_some_and(|topic| topic.published > 20)
    });
    running.stop().ok()?;
    let lines = read_back::<Mapping>(&entries(&lines))?;
    assert!(!lines.iter().any(|line| matches!(line.event, Event::Own { .. })), "they are messages of a publisher");
    let (heard, report) = play(Mapping::builder(), &lines)?;
    report.ok()?;
    let count = |path| heard.get(path).map_or(0, |texts: &Vec<_>| texts.len());
    assert_eq!(count("estimator/base/echo"), echoes.drain().count());
    assert_eq!(count("estimator/base/sum"), sums.drain().count());
    Ok(())
}
