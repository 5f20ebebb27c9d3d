//! Virtual time.

use crate::kit::*;

robot! {
    robot Clockwork;

    link base {
        sensor rated: Counter(count = 100) { rate: 100 Hz; }
        sensor slow: Counter(start = 100.0, count = 2) { rate: 4 Hz; }
        sensor fed: External<Number>();
        // The driver is declared first; what it needs beside it is read before it all the same.
        sensor driver: Counter(count = 10) { rate: 10 Hz; }
        sensor other: Counter(count = 10) { rate: 10 Hz; }
        estimator both: Snapshot() {
            input driver: sensor::base::driver, driver;
            input second: sensor::base::other;
            sync_tolerance: 1 ms;
        }
        // Both have finished, unless their options say otherwise.
        sensor odd: Source(read = |_, _| Ok(Reading::finished()));
        sensor no_rate: Counter(count = 0);
    }
}

#[test]
fn sensors_are_read_at_their_rates_and_stamped_with_virtual_time() {
    let mut simulation = Clockwork::builder().simulate().expect("it starts");
    let slow = simulation.subscribe(clockwork::sensor::base::slow);
    let rated = simulation.subscribe(clockwork::sensor::base::rated);
    simulation.run_for(Duration::from_millis(495));
    assert_eq!(simulation.clock().now(), at(495));
    assert_eq!(rated.drain().count(), 50);
    assert_eq!(timed(&slow), [(0, 100.0), (250, 101.0)]);
}

#[test]
fn a_sensor_that_stops_virtual_time_is_stopped_and_named() {
    let mut builder = Clockwork::builder();
    // It forgets to say when to read it next.
    builder.options(clockwork::sensor::base::odd).read = |_, now| Ok(Reading::now(Number(0.0)).next_at(now));
    builder.options(clockwork::sensor::base::no_rate).count = 5;
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_to_end();
    let faults = simulation.stop().faults;
    let paths: Vec<_> = faults.iter().map(|fault| fault.path).collect();
    assert_eq!(paths, ["sensor/base/odd", "sensor/base/no_rate"]);
    assert!(faults[1].message.contains("declare `rate`"), "{}", faults[1]);
}

#[test]
fn publishing_ahead_of_time_loses_no_reading_and_doubles_none() {
    let mut simulation = Clockwork::builder().simulate().expect("it starts");
    let rated = simulation.subscribe(clockwork::sensor::base::rated);
    simulation.run_for(Duration::from_millis(5));
    simulation.publish(clockwork::sensor::base::fed, at(35), Number(0.0));
    simulation.run_until(at(60));
    let times: Vec<_> = rated.drain().map(|number| number.monotonic_time).collect();
    assert_eq!(times, [0, 10, 20, 30, 40, 50, 60].map(at));
}

#[test]
fn of_sensors_due_at_once_the_driver_is_read_last() {
    let mut simulation = Clockwork::builder().simulate().expect("it starts");
    let both = simulation.subscribe(clockwork::estimator::base::both);
    simulation.run_to_end();
    assert_eq!(both.drain().filter(|seen| seen.driver == seen.second).count(), 10);
}

const MADE_AT: MonotonicTime = MonotonicTime::from_nanos(1_600_000_000_000_000_000);

/// Plays two messages with stamps of its own.
fn recording(number: u32, now: MonotonicTime) -> Read {
    let reading = Reading::at(now, Number(f64::from(number))).next_at(now + Duration::from_millis(20));
    Ok(if number > 2 { Reading::finished() } else { reading })
}

#[test]
fn virtual_time_starts_with_a_recording_and_real_time_refuses_one() {
    let builder = || {
        let mut builder = Clockwork::builder();
        let odd = builder.options(clockwork::sensor::base::odd);
        (odd.read, odd.starts_at) = (recording, || Some(MADE_AT));
        builder
    };
    let first = builder();
    let (rated, played) =
        (first.subscribe(clockwork::sensor::base::rated), first.subscribe(clockwork::sensor::base::odd));
    let mut simulation = first.simulate().expect("it starts");
    simulation.run_to_end();
    assert_eq!(rated.try_recv().map(|number| number.monotonic_time), Some(MADE_AT));
    assert_eq!(played.drain().count(), 2);
    let mut running = builder().start().expect("it starts");
    running.wait();
    let faults = running.stop().faults;
    assert!(faults.len() == 1 && faults[0].message.contains("needs virtual time"), "{faults:?}");
}
