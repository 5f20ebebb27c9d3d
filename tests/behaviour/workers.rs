//! Estimators with a thread of their own: they hang, fail, tick, are lost and stopped as any other, and hold nobody up.

use crate::kit::*;

static TERMINATED: AtomicUsize = AtomicUsize::new(0);
static TICKS: AtomicUsize = AtomicUsize::new(0);

static HERE: Gate = Gate::new();

const HANGS: f64 = -1.0;
const PANICS: f64 = -2.0;

fn ticks(_: &mut f64, _: Info) -> Replied {
    TICKS.fetch_add(1, Ordering::SeqCst);
    Ok(Reply::emit(Number(-10.0)))
}

fn work(_: &mut f64, number: f64) -> Replied {
    if number == HANGS {
        HERE.pass("a worker");
    }
    assert!(number != PANICS, "asked to");
    Ok(Reply::emit(Number(number)))
}

fn end(_: Termination<'_>) {
    TERMINATED.fetch_add(1, Ordering::SeqCst);
}

robot! {
    robot Laden;
    link base {
        sensor number: External<Number>();
        estimator heavy: Echo(init = tick::<5>, input = work, info = ticks, terminate = end) {
            input number: sensor::base::number;
            runs_on: worker;
            lost_after: 100 ms;
        }
    }
}

const HEAVY: &str = "estimator/base/heavy";

fn publish(running: &Running<Laden>, number: f64) {
    running.publish(laden::sensor::base::number, running.clock().now(), Number(number));
}

fn hang(running: &Running<Laden>) {
    HERE.close("a worker");
    publish(running, HANGS);
    HERE.wait_for(1);
}

#[test]
fn what_does_not_fit_while_it_hangs_is_counted_and_the_rest_comes_in_order() {
    alone_within(60, || {
        let running = Laden::builder().start().expect("it starts");
        let heavy = running.subscribe_with(laden::estimator::base::heavy, Overflow::DropOldest { capacity: 4096 });
        hang(&running);
        // Nobody waits for it.
        (0..1500).for_each(|number| publish(&running, f64::from(number)));
        HERE.open();
        let mut numbers = Vec::new();
        while numbers.last() != Some(&1499.0) {
            let number = heavy.recv_timeout(PATIENCE).expect("it goes on");
            numbers.extend((number.0 >= 0.0).then_some(number.0));
        }
        assert_eq!(numbers, (476..1500).map(f64::from).collect::<Vec<_>>(), "the oldest made room");
        let report = running.stop();
        let input = &report.estimator(HEAVY).expect("it is declared").inputs[0];
        assert_eq!((input.received, input.dropped(DropReason::Overflow)), (1501, 476));
    });
}

#[test]
fn it_restarts_ticks_and_is_lost_as_any_other() {
    alone_within(60, || {
        let running = Laden::builder().start().expect("it starts");
        let heavy = running.subscribe(laden::estimator::base::heavy);
        let health = running.subscribe(system::Health);
        let next = || heavy.recv_timeout(PATIENCE).expect("it goes on").0;
        assert_eq!(next(), -10.0, "it ticks before anything has come");
        publish(&running, PANICS);
        wait_until("it is restarted", || {
            running.report().estimator(HEAVY).is_some_and(|heavy| heavy.restarts == 1)
        });
        heavy.drain().for_each(drop);
        assert_eq!(next(), -10.0, "it ticks again");
        publish(&running, 5.0);
        while next() != 5.0 {}
        let lost = |change: Stamped<HealthTransition>| change.to == HealthState::Lost;
        while !lost(health.recv_timeout(PATIENCE).expect("it is lost some time")) {}
    });
}

#[test]
fn one_that_is_flooded_still_ticks_and_answers() {
    alone_within(60, || {
        let running = Laden::builder().start().expect("it starts");
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !stop.load(Ordering::SeqCst) {
                    publish(&running, 1.0);
                }
            });
            for _ in 0..100 {
                running.call(laden::estimator::base::heavy, Ask).expect("it runs");
            }
            let before = TICKS.load(Ordering::SeqCst);
            wait_until("it ticks", || TICKS.load(Ordering::SeqCst) >= before + 3);
            stop.store(true, Ordering::SeqCst);
        });
    });
}

#[test]
fn a_robot_is_stopped_with_a_full_inbox_and_with_one_that_hangs() {
    alone_within(60, || {
        let running = Laden::builder().start().expect("it starts");
        hang(&running);
        (0..1024).for_each(|number| publish(&running, f64::from(number)));
        let live = (*running).clone();
        let terminated = TERMINATED.load(Ordering::SeqCst);
        let stopping = std::thread::spawn(move || running.stop());
        std::thread::sleep(Duration::from_millis(100));
        HERE.open();
        let report = stopping.join().expect("it does not panic");
        assert!(report.ok().is_ok());
        assert_eq!(TERMINATED.load(Ordering::SeqCst), terminated + 1);
        let report = live.report();
        let heavy = report.estimator(HEAVY).expect("it is declared");
        let input = &heavy.inputs[0];
        assert_eq!(input.received, 1025);
        assert_eq!(heavy.dispatched + input.dropped(DropReason::Stopped), 1025, "what it did not take is counted");
    });
}
