//! Timers, ticks, continues and readings with times that never come.

use crate::kit::*;

/// Asks as it is made, and again at every callback; a tick comes again by itself.
macro_rules! asking {
    ($request:expr) => {
        EchoOptions {
            init: |context| {
                context.request($request);
                Ok(())
            },
            info: |_, info| {
                let reply = Reply::emit(Number(0.0));
                Ok(if info == Info::Tick { reply } else { reply.and($request) })
            },
            go_on: |_, _| Ok(Reply::emit(Number(0.0)).and($request)),
            ..EchoOptions::defaults()
        }
    };
}

const NANOSECOND: Duration = Duration::from_nanos(1);

fn start(asks: EchoOptions) -> Simulation<Plain> {
    let mut builder = Plain::builder();
    *builder.options(ECHO) = asks;
    // The next reading is due at a time that never comes.
    builder.options(SOURCE).read = |_, _| Ok(Reading::now(Number(1.0)).next_at(MonotonicTime::MAX));
    builder.simulate().expect("it starts")
}

fn emitted(simulation: &Simulation<Plain>) -> u64 {
    simulation.report().estimator("sensor/base/number/echo").map_or(0, |asking| asking.emitted)
}

#[test]
fn nothing_is_due_sooner_than_a_microsecond_after_it_was_asked_for() {
    within(60, || {
        for (row, asks) in [
            ("a timer at once", asking!(Request::Timer(1, Duration::ZERO))),
            ("a timeout at once", asking!(Request::Timeout(Duration::ZERO))),
            ("a nanosecond's tick", asking!(Request::Tick(NANOSECOND))),
        ] {
            let mut simulation = start(asks);
            simulation.run_until(at(10));
            assert_eq!(emitted(&simulation), 10_000, "{row}");
            assert!(simulation.stop().ok().is_ok());
        }
    });
}

#[test]
fn an_estimator_that_never_ends_its_work_is_stopped() {
    within(60, || {
        let mut simulation = start(asking!(Request::Continue(1)));
        simulation.publish(ENCODER, at(1), Number(1.0));
        let report = simulation.stop();
        let asking = report.estimator("sensor/base/number/echo").expect("it is declared");
        let reason = "it asked 1000000 times in a row to go on at 0.000000000 s, and nothing else could happen";
        assert_eq!((asking.stopped.as_deref(), asking.restarts), (Some(reason), 0));
        assert_eq!(report.estimator("sensor/base/pan/encoder/position").map(|beside| beside.emitted), Some(1));
    });
}

#[test]
fn what_is_beyond_the_end_of_time_never_comes() {
    within(60, || {
        for (row, asks) in [
            ("a timer", asking!(Request::Timer(1, Duration::MAX))),
            ("a tick", asking!(Request::Tick(Duration::MAX))),
        ] {
            let mut simulation = start(asks);
            simulation.run_until(at(10));
            simulation.run_until(MonotonicTime::MAX);
            assert_eq!(emitted(&simulation), 0, "{row}");
        }
    });
}

#[test]
fn a_sensor_that_is_read_at_the_end_of_time_has_finished() {
    within(60, || {
        let mut simulation = start(asking!(Request::Tick(NANOSECOND)));
        simulation.run_to_end();
        assert_eq!((simulation.clock().now(), simulation.next_due()), (at(0), None));
    });
}
