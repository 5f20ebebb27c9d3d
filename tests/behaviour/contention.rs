//! Several threads at once: nothing is lost uncounted, orders are kept, nobody waits for ever.

use crate::kit::*;

/// Numbers of two publishers, which must never go back.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Two<'a> {
    pub(crate) first: Input<'a, Number>,
    pub(crate) second: Option<Input<'a, Number>>,
}

/// Fails if something is out of order; half a number is a fault.
#[derive(Default)]
pub(crate) struct Ordered([f64; 2]);

impl Estimator for Ordered {
    type Options = ScaleOptions;
    type Input = Two<'static>;
    type Output = Number;

    fn init(_: ScaleOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_input(&mut self, two: Two<'_>) -> Result<Reply<Number>, Fault> {
        if two.first.0.fract() != 0.0 {
            return Err(Fault::new("asked to fail"));
        }
        let now = [two.first.0, two.second.map_or(0.0, |second| second.0)];
        assert!(now[0] >= self.0[0] && now[1] >= self.0[1], "out of order");
        self.0 = now;
        Ok(Reply::emit(Number(two.first.0)))
    }

    fn handle_options(&mut self, _: ScaleOptions, _: &Context) -> Result<(), Fault> {
        Ok(())
    }
}

impl HandleCall<Ask> for Ordered {
    type Response = f64;
    fn handle_call(&mut self, Ask: Ask) -> Result<(f64, Reply<Number>), Fault> {
        Ok((self.0[0], Reply::none()))
    }
}

static CASTS: AtomicU64 = AtomicU64::new(0);

impl HandleCast<Ask> for Ordered {
    fn handle_cast(&mut self, Ask: Ask) -> Result<Reply<Number>, Fault> {
        CASTS.fetch_add(1, Ordering::SeqCst);
        Ok(Reply::none())
    }
}

robot! {
    robot Crowded;

    parameters { gain: f64 = 1.0; }

    link base {
        sensor a: External<Number>();
        sensor b: External<Number>();
        estimator ordered: Ordered(factor = param::gain) {
            input first: sensor::base::a, driver;
            input second: sensor::base::b, optional;
        }
        estimator beside: Ordered() {
            input first: sensor::base::b, driver;
            input second: sensor::base::a, optional;
        }
        estimator apart: Ordered() {
            input first: sensor::base::a, driver;
            input second: sensor::base::b, optional;
            runs_on: worker;
        }
        estimator behind: Echo() { input number: estimator::base::ordered; }
    }
}

const ORDERED: &str = "estimator/base/ordered";

#[test]
fn every_lost_message_is_counted_whatever_publishes_or_fails() {
    alone_within(60, || {
        const EACH: u64 = 20_000;
        let mut builder = Crowded::builder();
        builder.supervision().max_restarts = usize::MAX;
        builder.supervision().first_backoff = Duration::from_micros(100);
        builder.supervision().longest_backoff = Duration::from_millis(1);
        let running = builder.start().expect("it starts");
        let before = CASTS.load(Ordering::SeqCst);
        let mut casts = 0;
        std::thread::scope(|scope| {
            for sensor in [crowded::sensor::base::a, crowded::sensor::base::b] {
                let live = (*running).clone();
                scope.spawn(move || {
                    for number in 1..=EACH {
                        let time = live.clock().now();
                        // A fault now and then, and a pause of another length each time.
                        let payload = if number % 3000 == 0 { number as f64 + 0.5 } else { number as f64 };
                        live.publish(sensor, time, Number(payload));
                        (0..number % 7).for_each(|_| std::hint::spin_loop());
                    }
                });
            }
            for round in 0..2000 {
                casts += u64::from(running.cast(crowded::estimator::base::ordered, Ask).is_ok());
                let _ = running.call(crowded::estimator::base::beside, Ask);
                let _ = running.call(crowded::estimator::base::apart, Ask);
                running.set_parameter(crowded::param::gain, f64::from(round % 1000)).expect("it is in range");
            }
        });
        let report = running.stop();
        for path in [ORDERED, "estimator/base/beside", "estimator/base/apart"] {
            let estimator = report.estimator(path).expect("it is declared");
            for input in &estimator.inputs {
                assert_eq!(input.received, EACH, "{path} {}", input.name);
            }
            let dropped = |reason| estimator.inputs[0].dropped(reason);
            let all: u64 = DropReason::ALL.iter().map(|reason| dropped(*reason)).sum();
            assert_eq!(estimator.dispatched + all, EACH, "{path}: {report}");
            assert!(estimator.restarts > 0, "{path}");
        }
        assert!(report.faults.iter().all(|fault| fault.message == "asked to fail"), "{:?}", report.faults);
        // Those that waited when it stopped are not taken any more.
        assert!(CASTS.load(Ordering::SeqCst) - before <= casts);
    });
}

#[test]
fn a_waker_may_publish_subscribe_and_stop_and_a_call_from_there_is_refused() {
    alone_within(60, || {
        let running = Crowded::builder().start().expect("it starts");
        let mut ordered = running.subscribe(crowded::estimator::base::ordered);
        let (live, answers) = ((*running).clone(), Arc::new(Mutex::new(Vec::new())));
        let said = Arc::clone(&answers);
        let taps: Mutex<Vec<DynamicSubscription>> = Mutex::default();
        when_woken(&mut ordered, move || {
            let time = live.clock().now();
            live.publish(crowded::sensor::base::b, time, Number(1.0));
            let tap = live.subscribe_any(Select::All, None, Overflow::KeepLatest);
            lock(&taps).push(tap);
            let answer = live.call(crowded::estimator::base::ordered, Ask).map_err(|fault| fault.to_string());
            lock(&said).push(answer);
            live.request_stop();
        });
        running.publish(crowded::sensor::base::a, running.clock().now(), Number(1.0));
        // Whoever looks at the start what is due may deliver it in our place.
        wait_until("it was woken", || !lock(&answers).is_empty());
        let refused = "estimator/base/ordered cannot be asked by code that an estimator's message has woken, which \
                       would wait for itself: use `cast`, or another thread";
        assert_eq!(*lock(&answers), [Err(refused.to_owned())]);
        let report = running.stop();
        assert_eq!(report.estimator(ORDERED).map(|ordered| ordered.inputs[1].received), Some(1));
    });
}

#[test]
fn a_waker_that_panics_harms_nobody() {
    alone_within(60, || {
        let running = Crowded::builder().start().expect("it starts");
        let mut ordered = running.subscribe(crowded::estimator::base::ordered);
        let behind = running.subscribe(crowded::estimator::base::behind);
        let mut safety = running.subscribe(system::SafetyState);
        when_woken(&mut ordered, || panic!("a waker of a subscriber"));
        when_woken(&mut safety, || panic!("one that a thread of the pool wakes"));
        running.publish(crowded::sensor::base::a, running.clock().now(), Number(1.0));
        assert_eq!(behind.recv_timeout(Duration::from_secs(5)).map(|number| number.0), Some(1.0));
        let report = running.report();
        assert_eq!((report.panics.wakers, report.topic(ORDERED).map(|topic| topic.panics)), (1, Some(1)));
        let report = running.stop();
        assert_eq!(report.panics.wakers, 2);
        assert!(report.to_string().contains("wakers: 2 panics"), "{report}");
        assert!(report.ok().is_ok());
    });
}

#[test]
fn a_robot_may_be_dropped_by_code_that_it_calls() {
    alone_within(60, || {
        let builder = Crowded::builder();
        let mut ordered = builder.subscribe(crowded::estimator::base::ordered);
        let mut running = Some(builder.start().expect("it starts"));
        let live = running.as_deref().expect("it runs").clone();
        when_woken(&mut ordered, move || drop(running.take()));
        let start = std::time::Instant::now();
        live.publish(crowded::sensor::base::a, live.clock().now(), Number(1.0));
        assert!(start.elapsed() < Duration::from_secs(4), "it took {:?}", start.elapsed());
        assert_eq!(live.safety(), Safety::Disarmed);
    });
}

#[test]
fn a_robot_that_has_stopped_answers_whatever_it_is_asked() {
    alone_within(60, || {
        let running = Crowded::builder().start().expect("it starts");
        let live = (*running).clone();
        let report = running.stop();
        live.publish(crowded::sensor::base::a, live.clock().now(), Number(1.0));
        assert!(live.call(crowded::estimator::base::ordered, Ask).is_err());
        assert!(live.cast(crowded::estimator::base::ordered, Ask).is_err());
        assert_eq!((live.arm(), live.disarm()), (Err(ArmError::Stopping), Ok(())));
        assert!(live.subscribe(crowded::sensor::base::a).recv().is_none());
        let refused = live.set_parameter(crowded::param::gain, 2.0);
        assert_refused(refused, "param/gain is not set: the robot has stopped");
        assert_eq!(live.report(), report, "it was the last one");
    });
}
