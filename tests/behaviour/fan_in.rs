//! Driver, last known inputs, tolerance, and what is dropped why; sensors that other code feeds, from several threads.

use crate::kit::*;

robot! {
    robot FanIn;

    link base {
        sensor a: External<Number>();
        sensor b: External<Number>();
        sensor c: External<Number>();
        estimator snapshot: Snapshot() {
            // Declared in another order than the struct's: inputs go by name.
            input third: sensor::base::c, optional, within: 50 ms;
            input second: sensor::base::b;
            input driver: sensor::base::a, driver;
            sync_tolerance: 10 ms;
        }
    }
}

fn start() -> Result<(Simulation<FanIn>, Subscription<Seen>), StartError> {
    let builder = FanIn::builder();
    let seen = builder.subscribe(fan_in::estimator::base::snapshot);
    Ok((builder.simulate()?, seen))
}

fn dropped(simulation: &Simulation<FanIn>, input: &str, reason: DropReason) -> u64 {
    let report = simulation.report();
    let estimator = report.estimator("estimator/base/snapshot").expect("it is declared");
    estimator.inputs.iter().find(|other| other.name == input).map_or(0, |input| input.dropped(reason))
}

/// Each row publishes numbers of `a`, the driver, of `b`, which is required, and of `c`, which is not, at the milliseconds that they
/// name; and it says which of `b` and `c` the estimator sees then, with a `+` if it is new, or that it misses `b`.
#[test]
fn what_a_dispatch_sees() -> Result<(), StartError> {
    let rows = [
        ("nothing is dispatched before every required input has arrived", "a0: miss; b1; a2: b1+"),
        ("an input is new once", "b0; c0; a1: b0+ c0+; a2: b0 c0; b3; a3: b3+ c0"),
        ("a dropped dispatch leaves the inputs new", "c0; a0: miss; b1; a1: b1+ c0+"),
        (
            "10 ms are within 10 ms, 11 ms are not, and 300 ms newer are",
            "b100; a110: b100+; a111: miss; b500; a200: b500+",
        ),
        (
            "an optional one that is missing or too old, by its own tolerance, drops nothing",
            "b0; a0: b0+; c0; b50; \
            a50: b50+ c0+; b51; a51: b51+",
        ),
    ];
    for (row, steps) in rows {
        let (mut simulation, seen) = start()?;
        let publish = |simulation: &mut Simulation<FanIn>, sensor: &str, millis: i64| {
            let handle = match sensor {
                "a" => fan_in::sensor::base::a,
                "b" => fan_in::sensor::base::b,
                _ => fan_in::sensor::base::c,
            };
            simulation.publish(handle, at(millis), Number(millis as f64));
        };
        let mut missed = 0;
        check_steps(row, steps, &mut simulation, publish, |simulation| {
            let input =
                |name: &str, number: f64, is_new: bool| format!("{name}{number}{}", if is_new { "+" } else { "" });
            let runs = seen.drain().map(|seen| {
                let third = (seen.third >= 0.0).then(|| input(" c", seen.third, seen.third_is_new));
                input("b", seen.second, seen.second_is_new) + &third.unwrap_or_default()
            });
            assert_eq!(dropped(simulation, "third", DropReason::SyncMiss), 0, "{row}");
            let misses = dropped(simulation, "second", DropReason::SyncMiss);
            let is_miss = misses > std::mem::replace(&mut missed, misses);
            runs.chain(is_miss.then(|| "miss".to_owned())).collect()
        });
    }
    Ok(())
}

const SNAPSHOT: &str = "estimator/base/snapshot";

#[test]
fn a_dropped_dispatch_reaches_handlers_of_telemetry() {
    let told: Arc<Mutex<Vec<TelemetryEvent>>> = Arc::default();
    let mut builder = FanIn::builder();
    let tell = Arc::clone(&told);
    builder.telemetry(move |_, event| {
        if let TelemetryEvent::Dropped { estimator: SNAPSHOT, .. }
        | TelemetryEvent::Latency { estimator: SNAPSHOT, .. } = event
        {
            lock(&tell).push(event.clone());
        }
    });
    let mut simulation = builder.simulate().expect("it starts");
    let dropped = |input| TelemetryEvent::Dropped { estimator: SNAPSHOT, input, reason: "sync miss" };
    simulation.publish(fan_in::sensor::base::a, at(0), Number(1.0));
    assert_eq!(std::mem::take(&mut *lock(&told)), [dropped("second")], "it is missing");
    simulation.publish(fan_in::sensor::base::b, at(1), Number(1.0));
    simulation.publish(fan_in::sensor::base::a, at(11), Number(1.0));
    // Without a budget, and for the first run of many.
    let ran = || TelemetryEvent::Latency { estimator: SNAPSHOT, duration: Duration::ZERO };
    assert_eq!(std::mem::take(&mut *lock(&told)), [ran()]);
    simulation.publish(fan_in::sensor::base::a, at(11), Number(1.0));
    assert_eq!(std::mem::take(&mut *lock(&told)), [ran()], "each run is told of");
    simulation.publish(fan_in::sensor::base::a, at(12), Number(1.0));
    assert_eq!(std::mem::take(&mut *lock(&told)), [dropped("second")], "it is too old");
}

#[test]
fn messages_out_of_order_and_non_finite_ones_are_dropped_and_counted_by_input() -> Result<(), StartError> {
    let (mut simulation, seen) = start()?;
    simulation.publish(fan_in::sensor::base::b, at(5), Number(2.0));
    simulation.publish(fan_in::sensor::base::b, at(4), Number(9.0));
    simulation.publish(fan_in::sensor::base::b, at(5), Number(f64::NAN));
    simulation.publish(fan_in::sensor::base::a, at(5), Number(f64::INFINITY));
    simulation.publish(fan_in::sensor::base::a, at(5), Number(1.0));
    assert_eq!(seen.drain().map(|seen| seen.second).collect::<Vec<_>>(), [2.0]);
    assert_eq!(dropped(&simulation, "second", DropReason::OutOfOrder), 1);
    assert_eq!(dropped(&simulation, "second", DropReason::NonFinite), 1);
    assert_eq!(dropped(&simulation, "driver", DropReason::NonFinite), 1);
    // A repeated stamp is in order.
    simulation.publish(fan_in::sensor::base::a, at(5), Number(1.0));
    assert_eq!(seen.drain().count(), 1);
    Ok(())
}

#[test]
fn absurd_stamps_are_survived() -> Result<(), StartError> {
    let (mut simulation, seen) = start()?;
    let (first, last) = (MonotonicTime::from_nanos(i64::MIN), MonotonicTime::MAX);
    simulation.publish(fan_in::sensor::base::b, first, Number(2.0));
    simulation.publish(fan_in::sensor::base::a, last, Number(1.0));
    assert_eq!(dropped(&simulation, "second", DropReason::SyncMiss), 1);
    simulation.publish(fan_in::sensor::base::b, last, Number(2.0));
    simulation.publish(fan_in::sensor::base::a, last, Number(1.0));
    assert_eq!(seen.drain().count(), 1);
    Ok(())
}

/// The second stamp is far ahead of the clock.
fn skewed(reading: u32, now: MonotonicTime) -> Read {
    Ok(Reading::at(if reading == 2 { MonotonicTime::MAX } else { now }, Number(f64::from(reading))))
}

#[test]
fn a_stamp_from_the_future_is_dropped_and_does_not_disable_the_input() {
    let mut builder = Plain::builder();
    builder.options(SOURCE).read = skewed;
    let behind = builder.subscribe(BEHIND);
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_until(at(35));
    assert_eq!(numbers(&behind), [1.0, 3.0, 4.0]);
    let report = simulation.report();
    let input = &report.estimator("sensor/base/source/behind").expect("it is declared").inputs[0];
    assert_eq!(input.dropped(DropReason::ClockSkew), 1);
}

robot! {
    robot Diamond;
    link base {
        sensor a: Counter() { rate: 100 Hz; }
        // Declared before what it depends on, which hangs on a child link.
        estimator both: Snapshot() {
            input driver: sensor::base::a, driver;
            input second: estimator::base::mount::mast::derived;
            input third: sensor::base::a, optional;
            sync_tolerance: 1 ms;
        }
        joint mount: fixed {
            link mast {
                estimator derived: Scale(factor = 10.0) { input number: sensor::base::a; }
            }
        }
    }
}

#[test]
fn what_is_derived_from_a_message_arrives_before_those_that_take_both() {
    let mut simulation = Diamond::builder().simulate().expect("it starts");
    let both = simulation.subscribe(diamond::estimator::base::both);
    simulation.run_to_end();
    let seen: Vec<_> = both.drain().map(|seen| (seen.driver, seen.second, seen.third, seen.third_is_new)).collect();
    assert_eq!(seen, [0.0, 1.0, 2.0, 3.0, 4.0].map(|number| (number, 10.0 * number, number, true)));
}
