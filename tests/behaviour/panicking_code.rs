//! A panic in a user's code is charged to whom it belongs, at the start too; and what would keep virtual time from going on is
//! ended.

use crate::kit::*;
use bb_core::message::codec::{Reader, Shape, Writer};
use bb_core::message::{DecodeError, Field, Finite};

static PANICS: AtomicU32 = AtomicU32::new(0);
fn may_panic(code: u32) {
    assert!(PANICS.load(Ordering::SeqCst) != code || std::thread::panicking(), "code {code}");
}

/// A number with code that panics.
#[derive(Debug)]
pub(crate) struct Evil(f64);

impl Clone for Evil {
    fn clone(&self) -> Self {
        may_panic(1);
        Self(self.0)
    }
}

impl Drop for Evil {
    fn drop(&mut self) {
        may_panic(2);
    }
}

impl Finite for Evil {
    fn is_finite(&self) -> bool {
        assert!(self.0 < 3.0, "cursed");
        true
    }
}

impl Field for Evil {
    const SHAPE: Shape = <f64 as Field>::SHAPE;

    fn heap_bytes(&self) -> usize {
        may_panic(3);
        0
    }

    fn write(&self, writer: &mut Writer<'_>) {
        may_panic(4);
        self.0.write(writer);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(Self(f64::read(reader)?))
    }
}

static MADE_SAFE: AtomicBool = AtomicBool::new(false);

fn guard(context: &SensorContext) -> Done {
    context.on_disarm(|| {
        MADE_SAFE.store(true, Ordering::SeqCst);
        Ok(())
    });
    Ok(())
}

#[derive(Clone, Debug, Payload)]
pub(crate) struct Output {
    evil: Evil,
}

stateless! {
    Maker: Number => Output, |number: &Stamped<Number>| Ok(Reply::emit(Output { evil: Evil(number.0) }));
    Taker: Output => Number, |output: &Stamped<Output>| Ok(Reply::emit(Number(output.evil.0)));
}

robot! {
    robot Making;
    link base {
        sensor source: Source(init = guard, read = |_, _| Ok(Reading::now(Number(1.0)))) { rate: 100 Hz; estimator maker: Maker(); }
        sensor curse: External<Output>() { estimator taker: Taker(); }
    }
}

/// One panic of each code, and what the robot does after it.
#[test]
fn a_panic_in_the_code_of_an_estimators_output_is_charged_to_the_estimator_which_is_restarted() {
    let _alone = one_at_a_time();
    for code in 1..=4 {
        let mut builder = Making::builder();
        builder.journal(|_| ());
        let outputs = builder.subscribe(making::sensor::base::source::maker);
        let health = builder.subscribe(system::Health);
        let mut simulation = armed_simulation(builder);
        simulation.run_for(Duration::from_millis(15));
        PANICS.store(code, Ordering::SeqCst);
        simulation.run_for(Duration::from_millis(10));
        PANICS.store(0, Ordering::SeqCst);
        simulation.run_for(Duration::from_millis(50));
        let report = simulation.report();
        let expected = format!("sensor/base/source/maker failed: panicked: code {code}");
        assert_eq!(told(&report), [expected], "code {code}");
        assert_eq!(report.sources[0].restarts, 0, "the sensor has done nothing");
        assert_eq!(report.sources[0].readings, 8, "and is read at its rate");
        assert_eq!(report.estimators[0].restarts, 1, "code {code}");
        assert!(outputs.drain().count() >= 7);
        let changes: Vec<_> = changes_of(&health);
        let expected =
            [(HealthState::Degraded, HealthReason::Restarted), (HealthState::Healthy, HealthReason::Recovered)];
        assert_eq!(changes, expected);
        assert_eq!(simulation.safety(), Safety::Armed);
    }
}

#[test]
fn a_payload_that_panics_fails_the_estimator_that_takes_it_and_not_its_publisher() {
    let _alone = one_at_a_time();
    let running = Making::builder().start().expect("it starts");
    for number in 1..=5 {
        let output = Output { evil: Evil(f64::from(number)) };
        running.publish(making::sensor::base::curse, running.clock().now(), output);
    }
    wait_until("all that is published is taken", || {
        let report = running.report();
        report.estimator("sensor/base/curse/taker").is_some_and(|taker| taker.inputs[0].received == 5)
    });
    let report = running.stop();
    let taker = report.estimator("sensor/base/curse/taker").expect("it is declared");
    let faults: Vec<_> = report.faults.iter().map(|fault| (fault.path, fault.message.as_str())).collect();
    assert_eq!(faults, [(taker.path, "panicked: cursed")]);
    assert_eq!((taker.emitted, taker.inputs[0].received), (2, 5));
}

#[test]
fn outputs_that_panic_too_often_have_the_robot_made_safe() {
    let _alone = one_at_a_time();
    let mut simulation = armed_simulation(Making::builder());
    let _outputs = simulation.subscribe(making::sensor::base::source::maker);
    PANICS.store(1, Ordering::SeqCst);
    MADE_SAFE.store(false, Ordering::SeqCst);
    simulation.run_for(Duration::from_secs(5));
    PANICS.store(0, Ordering::SeqCst);
    assert_eq!(simulation.safety(), Safety::Error);
    assert!(MADE_SAFE.swap(false, Ordering::SeqCst) && simulation.arm().is_err());
    let report = simulation.report();
    let stopped = report.estimators[0].stopped.as_deref();
    assert!(stopped.is_some_and(|why| why.contains("code 1")), "{stopped:?}");
}

#[test]
fn a_backoff_of_zero_does_not_keep_virtual_time_from_going_on() {
    let mut builder = Plain::builder();
    builder.options(SOURCE).read = |_, _| Err(Fault::new("unplugged"));
    builder.supervision().first_backoff = Duration::ZERO;
    builder.supervision().longest_backoff = Duration::ZERO;
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_for(Duration::from_millis(10));
    assert_eq!(simulation.clock().now(), MonotonicTime::from_nanos(10_000_000));
    let restarts = simulation.report().sources[0].restarts;
    assert!((99..=101).contains(&restarts), "100 µs apart: {restarts}");
}

#[test]
fn a_stop_that_is_requested_stops_sensors_on_virtual_time_too() {
    let mut builder = Plain::builder();
    builder.options(SOURCE).read = |_, _| Ok(Reading::now(Number(1.0)));
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_for(Duration::from_millis(95));
    assert_eq!(simulation.report().sources[0].readings, 10);
    simulation.request_stop();
    simulation.run_for(Duration::from_secs(1));
    assert_eq!((simulation.report().sources[0].readings, simulation.next_due()), (10, None));
    simulation.stop().ok().expect("nothing is wrong");
}
