//! What happens at one instant, or in the middle of something else, happens in the same order again from the journal.

use crate::components::{Number, at};
use crate::gate::wait_until;
use crate::replay::{Heard, Lines, counts, hear, overflow, same};
use bb_core::prelude::*;
use bb_core::{Builder, Report, Robot};
use std::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Whether this is the first run, and not the one from its journal.
static IS_FIRST: AtomicBool = AtomicBool::new(true);
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

const PANICS: f64 = -2.0;
const DIVERGES: f64 = -1.0;
const IS_SLOW: f64 = 1000.0;

/// Emits what it gets, and then how many it has had since it was made.
#[derive(Debug)]
struct Echo {
    count: u32,
}

impl Estimator for Echo {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { count: 0 })
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        self.count += 1;
        if number.0 == IS_SLOW && IS_FIRST.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(20));
        }
        assert!(number.0 != PANICS, "told to");
        let reply = Reply::emit(number.payload).and(Request::Continue(1));
        Ok(if number.0 == DIVERGES { reply.diverged("told to") } else { reply })
    }

    fn handle_continue(&mut self, _: u32) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(1000.0 + f64::from(self.count))))
    }
}

/// Takes its time in the first run, and panics at 3.
#[derive(Debug)]
struct Slow;

impl Estimator for Slow {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        assert!(number.0 != 3.0, "it is three");
        if IS_FIRST.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(Reply::emit(number.payload))
    }
}

/// Enters a state after a millisecond.
#[derive(Debug)]
struct Enter<const IS_FAST: bool>;

impl<const IS_FAST: bool> Command for Enter<IS_FAST> {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        context.sleep(Duration::from_millis(1)).await;
        Ok(Outcome::done(()).next_state(if IS_FAST { "fast" } else { "crawling" }))
    }
}

robot! {
    robot Cascade;
    states { fast; crawling; }
    commands {
        arm: Arm;
        crawl: Enter<false> { cancel: all; allowed_states: [idle, executing, fast, crawling]; }
        hurry: Enter<true> { cancel: all; allowed_states: [idle, executing, fast, crawling]; }
    }
    link base {
        joint shoulder: fixed {
            link arm {
                sensor number: External<Number>() { estimator echo: Echo() { on_degraded: crawl; on_recovered: hurry; } }
                estimator below: Slow() { input number: sensor::base::shoulder::arm::number::echo; runs_on: worker; }
            }
        }
    }
}

robot! {
    robot Budgeted;
    link base {
        sensor number: External<Number>() {
            estimator first: Echo() { latency_budget: 10 ms; recover_after: 2; }
            estimator second: Echo() { latency_budget: 60 s; recover_after: 2; }
            estimator third: Slow() { latency_budget: 10 ms; }
        }
        estimator apart: Echo() { input number: sensor::base::number::first; latency_budget: 60 s; runs_on: worker; }
        estimator late: Echo() { input number: sensor::base::number::third; latency_budget: 10 ms; recover_after: 2; }
    }
}

/// Runs a robot, and once more from its journal: all that is published and counted is the same.
fn same_again<R: Robot>(
    builder: impl Fn() -> Builder<R>,
    run: impl FnOnce(Builder<R>) -> Result<Report, Box<dyn Error>>,
) -> Result<(Heard, Report), Box<dyn Error>> {
    IS_FIRST.store(true, Ordering::SeqCst);
    let mut first_builder = builder();
    let lines = Lines::default();
    let sink = lines.clone();
    first_builder.journal(move |line| sink.lock().unwrap_or_else(PoisonError::into_inner).push(line));
    let all = first_builder.subscribe_any(Select::All, None, overflow());
    let report = run(first_builder)?;
    let mut first = Heard::new();
    hear(&all, &mut first);

    IS_FIRST.store(false, Ordering::SeqCst);
    let builder = builder();
    let all = builder.subscribe_any(Select::All, None, overflow());
    let mut replay = builder.replay()?;
    replay.play(lines.lock().unwrap_or_else(PoisonError::into_inner).clone())?;
    let report_again = replay.stop();
    let mut again = Heard::new();
    hear(&all, &mut again);
    same(&first, &again);
    assert_eq!(counts(&report), counts(&report_again));
    assert_eq!(report.faults, report_again.faults);
    Ok((first, report))
}

fn cascade(max_restarts: u32) -> impl Fn() -> Builder<Cascade> {
    move || {
        let mut builder = Cascade::builder();
        builder.supervision().max_restarts = max_restarts as usize;
        builder
    }
}

#[test]
fn an_estimator_that_is_given_up_as_its_command_starts() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    let (heard, report) = same_again(cascade(0), |builder| {
        let mut simulation = builder.simulate()?;
        simulation.arm()?;
        simulation.publish(cascade::sensor::base::shoulder::arm::number, at(10), Number(PANICS));
        simulation.run_for(Duration::from_millis(100));
        Ok(simulation.stop())
    })?;
    assert_eq!((report.safety, heard["safety/error"].len()), (Safety::Error, 1));
    assert!(report.estimators.iter().any(|estimator| estimator.transitions > 0), "its health has changed");
    Ok(())
}

#[test]
fn changes_of_health_at_one_instant_start_their_commands_in_order() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    let (heard, report) = same_again(cascade(3), |builder| {
        let mut simulation = builder.simulate()?;
        simulation.arm()?;
        simulation.run_until(at(10));
        let live = simulation.live();
        for number in [DIVERGES, 1.0, DIVERGES] {
            live.publish(cascade::sensor::base::shoulder::arm::number, at(10), Number(number));
        }
        simulation.run_for(Duration::from_millis(100));
        Ok(simulation.stop())
    })?;
    assert_eq!(heard["health"].len(), 3, "{:?}", heard["health"]);
    assert_eq!((heard["command/crawl"].len(), heard["command/hurry"].len()), (4, 2), "the first two are cancelled");
    assert!(
        heard["state_machine"].iter().any(|change| change.contains("crawling")),
        "{:?}",
        heard["state_machine"]
    );
    assert_eq!(report.safety, Safety::Disarmed);
    Ok(())
}

#[test]
fn a_panic_downstream_that_restarts_what_is_upstream_in_the_middle_of_its_work() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    let (_, report) = same_again(cascade(1), |builder| {
        let mut simulation = builder.simulate()?;
        for (round, number) in [3.0, 1.0, 3.0, 1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
            let time = at(50 * (round as i64 + 1));
            simulation.publish(cascade::sensor::base::shoulder::arm::number, time, Number(number));
        }
        simulation.run_for(Duration::from_millis(100));
        Ok(simulation.stop())
    })?;
    assert!(report.estimators.iter().all(|estimator| estimator.restarts > 0), "both are restarted: {report}");
    Ok(())
}

#[test]
fn messages_that_wait_for_a_worker_as_the_robot_stops() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    let (_, report) = same_again(cascade(3), |builder| {
        let running = builder.start()?;
        for number in 0..200 {
            let number = Number(10.0 + f64::from(number));
            running.publish(cascade::sensor::base::shoulder::arm::number, running.clock().now(), number);
        }
        Ok(running.stop())
    })?;
    let below = report.estimator("estimator/base/shoulder/arm/below").ok_or("it is declared")?;
    assert!(below.emitted < 400, "some were not processed: {}", below.emitted);
    Ok(())
}

#[test]
fn one_of_several_callbacks_of_a_message_that_overruns() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    let overrunning = ["sensor/base/number/first", "estimator/base/late"];
    let (heard, _) = same_again(Budgeted::builder, |builder| {
        let running = builder.start()?;
        let overrun_twice = |path: &&str| running.report().estimator(path).is_some_and(|now| now.transitions >= 4);
        let mut round = 0;
        // On a busy machine, what is published waits for a thread, and any number overruns.
        wait_until("both overrun, recover and do so again", || {
            let number = if round % 6 == 3 { IS_SLOW } else { 10.0 };
            running.publish(budgeted::sensor::base::number, running.clock().now(), Number(number));
            round += 1;
            overrunning.iter().all(overrun_twice)
        });
        Ok(running.stop())
    })?;
    let of_second = |text: &&String| text.contains("number/second") && text.contains("latency overrun");
    assert_eq!(heard["health"].iter().filter(of_second).count(), 0, "it has a minute");
    Ok(())
}
