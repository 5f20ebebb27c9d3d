//! Components that fail: at the start, in a callback, by a panic. The others go on.

use crate::kit::*;

static TERMINATED: AtomicUsize = AtomicUsize::new(0);

/// Breaks at its second reading.
fn break_down(reading: u32, _: MonotonicTime) -> Read {
    if reading == 1 { Ok(Reading::now(Number(1.0))) } else { Err(Fault::new("no answer on the bus")) }
}

/// Passes on, and calls itself diverged; `then` is what its third message does.
fn third(count: &mut f64, number: f64, then: fn() -> Replied) -> Replied {
    *count += 1.0;
    if *count == 3.0 { then() } else { Ok(Reply::emit(Number(number)).diverged("always")) }
}

fn terminate(_: Termination<'_>) {
    TERMINATED.fetch_add(1, Ordering::SeqCst);
}

robot! {
    robot Patient;

    link base {
        sensor numbers: Counter(count = 6) {
            rate: 10 Hz;
            estimator first: Echo(terminate = terminate);
            estimator second: Scale();
        }
        sensor broken: Source(read = break_down) { rate: 10 Hz; }
        sensor last: Source() { rate: 10 Hz; }
    }
}

#[test]
fn a_component_that_cannot_start_is_named_and_those_before_it_are_stopped() {
    let _alone = one_at_a_time();
    type Change = fn(&mut Builder<Patient>);
    let cases: [(Change, &str); 4] = [
        (
            |builder| builder.options(patient::sensor::base::last).init = |_| Err(Fault::new("no device")),
            "last cannot start: no device",
        ),
        (
            |builder| builder.options(patient::sensor::base::numbers::first).init = |_| Err(Fault::new("no map")),
            "numbers/first cannot start: no map",
        ),
        (
            |builder| builder.options(patient::sensor::base::numbers::first).init = |_| panic!("no map at all"),
            "numbers/first cannot start: panicked: no map at all",
        ),
        (
            |builder| builder.options(patient::sensor::base::numbers::second).factor = f64::NAN,
            "numbers/second cannot start: option `factor` is NaN, but must be in -1e3..=1e3",
        ),
    ];
    // The estimator `first` is stopped in order if it has started.
    for ((change, says), stopped) in cases.into_iter().zip([1, 0, 0, 1]) {
        let mut builder = Patient::builder();
        change(&mut builder);
        let before = TERMINATED.load(Ordering::SeqCst);
        assert_refused(builder.simulate(), &format!("sensor/base/{says}"));
        assert_eq!(TERMINATED.load(Ordering::SeqCst) - before, stopped, "{says}");
    }
}

#[test]
fn a_component_that_fails_is_restarted_alone_with_fresh_state() {
    let _alone = one_at_a_time();
    let errs =
        |count: &mut f64, number| third(count, number, || Err(Fault::new("covariance is not positive definite")));
    let panics = |count: &mut f64, number| third(count, number, || panic!("index out of bounds"));
    let rows: [(OnNumber, &str); 2] =
        [(errs, "covariance is not positive definite"), (panics, "panicked: index out of bounds")];
    for (input, message) in rows {
        let mut builder = Patient::builder();
        builder.options(patient::sensor::base::numbers::first).input = input;
        let first = builder.subscribe(patient::sensor::base::numbers::first);
        let second = builder.subscribe(patient::sensor::base::numbers::second);
        let mut simulation = builder.simulate().expect("it starts");
        // The sensor beside it breaks at 100 ms and, restarted, at 210 ms; the estimator at 200 ms.
        simulation.run_until(at(320));
        assert_eq!(numbers(&first), [0.0, 1.0, 3.0], "the third kills it");
        assert_eq!(second.drain().count(), 4, "its sibling misses nothing");
        let before = TERMINATED.load(Ordering::SeqCst);
        let report = simulation.stop();
        assert!(TERMINATED.load(Ordering::SeqCst) > before && first.recv().is_none(), "a stop ends both");
        let estimator = report.estimator("sensor/base/numbers/first").expect("it is declared");
        assert_eq!((estimator.restarts, estimator.diverged, estimator.stopped.as_deref()), (1, 3, None));
        assert_eq!(estimator.inputs[0].dropped(DropReason::Stopped), 0, "it was back before the next message");
        let own = format!("sensor/base/numbers/first failed: {message}");
        // The sensor's fault has come twice, the second time after the estimator's.
        let broken = "sensor/base/broken failed: no answer on the bus (2 times in 0.110 s)".to_owned();
        assert_eq!(told(&report), [own, broken]);
        assert_eq!((report.faults[1].count, report.all_faults), (2, 3));
        assert_eq!((report.faults[1].first_time, report.faults[1].last_time), (at(100), at(210)));
        assert!(report.ok().is_err());
    }
}
