//! Timers, ticks and continues that ask for the impossible.

use crate::components::{Number, Source, at, within};
use bb_core::prelude::*;

/// Options of [`Asking`].
#[derive(Clone, Debug, Options)]
pub(crate) struct AskingOptions {
    #[option(default = "nothing")]
    pub(crate) asks: &'static str,
}

/// Asks again at every callback.
#[derive(Debug)]
pub(crate) struct Asking(&'static str, u64);

impl Asking {
    fn request(&mut self) -> Option<Request> {
        self.1 += 1;
        Some(match self.0 {
            "a timer at once" => Request::Timer(1, Duration::ZERO),
            "a timeout at once" => Request::Timeout(Duration::ZERO),
            "to go on" => Request::Continue(1),
            "a nanosecond's tick" => Request::Tick(Duration::from_nanos(1)),
            "never" => Request::Timer(1, Duration::MAX),
            "never a tick" => Request::Tick(Duration::MAX),
            "ever earlier" => Request::Timer(1, Duration::from_nanos(4_000_000_000_000 - 2_000_000 * self.1)),
            _ => return None,
        })
    }
}

impl Estimator for Asking {
    type Options = AskingOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: AskingOptions, context: &Context) -> Result<Self, Fault> {
        let mut asking = Self(options.asks, 0);
        if let Some(request) = asking.request() {
            context.request(request);
        }
        Ok(asking)
    }

    fn handle_input(&mut self, _: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        self.reply()
    }

    fn handle_info(&mut self, _: Info) -> Result<Reply<Number>, Fault> {
        self.reply()
    }

    fn handle_continue(&mut self, _: u32) -> Result<Reply<Number>, Fault> {
        self.reply()
    }
}

impl Asking {
    fn reply(&mut self) -> Result<Reply<Number>, Fault> {
        let reply = Reply::emit(Number(self.1 as f64));
        Ok(match self.request() {
            Some(request) if self.0 != "a nanosecond's tick" => reply.and(request),
            _ => reply,
        })
    }
}

robot! {
    robot Impatient;
    link base {
        sensor number: External<Number>() { estimator asking: Asking(); }
        sensor other: External<Number>() { estimator beside: Asking(asks = "nothing"); }
        // Wants to be read at a time that never comes.
        sensor never: Source(read = |_, _| Ok(Reading::now(Number(1.0)).next_at(MonotonicTime::MAX)));
    }
}

fn start(asks: &'static str) -> Simulation<Impatient> {
    let mut builder = Impatient::builder();
    builder.options(impatient::sensor::base::number::asking).asks = asks;
    builder.simulate().expect("it starts")
}

fn emitted(simulation: &Simulation<Impatient>) -> u64 {
    simulation.report().estimator("sensor/base/number/asking").map_or(0, |asking| asking.emitted)
}

#[test]
fn nothing_is_due_sooner_than_a_microsecond_after_it_was_asked_for() {
    for asks in ["a timer at once", "a timeout at once", "a nanosecond's tick"] {
        within(60, move || {
            let mut simulation = start(asks);
            simulation.run_until(at(10));
            assert_eq!(emitted(&simulation), 10_000, "{asks}");
            assert!(simulation.stop().ok().is_ok());
        });
    }
}

#[test]
fn an_estimator_that_never_ends_its_work_is_stopped() {
    within(60, || {
        let mut simulation = start("to go on");
        simulation.publish(impatient::sensor::base::other, at(1), Number(1.0));
        let report = simulation.stop();
        let asking = report.estimator("sensor/base/number/asking").expect("it is declared");
        let reason = "it asked 1000000 times in a row to go on at 0.000000000 s, and nothing else could happen";
        assert_eq!((asking.stopped.as_deref(), asking.restarts), (Some(reason), 0));
        assert_eq!(report.estimator("sensor/base/other/beside").map(|beside| beside.emitted), Some(1));
    });
}

#[test]
fn what_is_beyond_the_end_of_time_never_comes() {
    for asks in ["never", "never a tick"] {
        within(60, move || {
            let mut simulation = start(asks);
            simulation.run_until(at(10));
            simulation.run_until(MonotonicTime::MAX);
            assert_eq!(emitted(&simulation), 0, "{asks}");
        });
    }
}

#[test]
fn a_timer_that_is_put_forward_again_and_again_is_due_once() {
    within(120, || {
        let mut simulation = start("ever earlier");
        let start = std::time::Instant::now();
        for micros in 1..=200_000 {
            let time = MonotonicTime::from_nanos(micros * 1_000);
            simulation.publish(impatient::sensor::base::number, time, Number(1.0));
        }
        let asked = start.elapsed();
        let start = std::time::Instant::now();
        simulation.run_until(at(3_000_000));
        // However busy the machine: it has less to do than to hear of them.
        assert!(start.elapsed() < asked, "it took {:?} after {asked:?}", start.elapsed());
    });
}

#[test]
fn a_sensor_that_is_read_at_the_end_of_time_has_finished() {
    within(60, || {
        let mut simulation = start("a nanosecond's tick");
        simulation.run_to_end();
        assert_eq!((simulation.clock().now(), simulation.next_due()), (at(0), None));
    });
}
